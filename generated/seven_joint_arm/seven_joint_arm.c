/*
 * seven_joint_arm: friction observer GTO, velocity estimated, double precision.
 * A step: 592 additions, 659 multiplications, 7 divisions, 12 calls, 0 of sign or magnitude.
 *
 * Made by stiction 0.1.0 from seven_joint_arm.yaml
 * sha256 9fdf4378f6fb9e1b1c4b537e8ffc93bd7914598df7afed94c8c086353543ed8a
 * with: stiction generate seven_joint_arm.yaml
 */
#include "seven_joint_arm.h"

#include <math.h>

#if defined(__clang__)
#pragma STDC FP_CONTRACT OFF
#endif

#if defined(__GNUC__)
#define SEVEN_JOINT_ARM_COLD __attribute__((noinline, cold))
#else
#define SEVEN_JOINT_ARM_COLD
#endif

void seven_joint_arm_prepare(seven_joint_arm_parameters *parameters)
{
    parameters->h_K_2_shoulder_yaw = parameters->sample_time * parameters->K_2_shoulder_yaw;
    parameters->h_K_2_shoulder_pitch = parameters->sample_time * parameters->K_2_shoulder_pitch;
    parameters->h_K_2_arm_roll = parameters->sample_time * parameters->K_2_arm_roll;
    parameters->h_K_2_elbow_pitch = parameters->sample_time * parameters->K_2_elbow_pitch;
    parameters->h_K_2_forearm_roll = parameters->sample_time * parameters->K_2_forearm_roll;
    parameters->h_K_2_wrist_pitch = parameters->sample_time * parameters->K_2_wrist_pitch;
    parameters->h_K_2_hand_roll = parameters->sample_time * parameters->K_2_hand_roll;
}

void seven_joint_arm_init(seven_joint_arm_state *state, const seven_joint_arm_parameters *parameters,
    const seven_joint_arm_inputs *inputs)
{
    state->z_v_shoulder_yaw = -(parameters->K_v_v_shoulder_yaw * inputs->shoulder_yaw);
    state->z_v_shoulder_pitch = -(parameters->K_v_v_shoulder_pitch * inputs->shoulder_pitch);
    state->z_v_arm_roll = -(parameters->K_v_v_arm_roll * inputs->arm_roll);
    state->z_v_elbow_pitch = -(parameters->K_v_v_elbow_pitch * inputs->elbow_pitch);
    state->z_v_forearm_roll = -(parameters->K_v_v_forearm_roll * inputs->forearm_roll);
    state->z_v_wrist_pitch = -(parameters->K_v_v_wrist_pitch * inputs->wrist_pitch);
    state->z_v_hand_roll = -(parameters->K_v_v_hand_roll * inputs->hand_roll);
    state->z_shoulder_yaw = 0.0;
    state->z_shoulder_pitch = 0.0;
    state->z_arm_roll = 0.0;
    state->z_elbow_pitch = 0.0;
    state->z_forearm_roll = 0.0;
    state->z_wrist_pitch = 0.0;
    state->z_hand_roll = 0.0;
    state->mode = SEVEN_JOINT_ARM_RUNNING;
    state->invalid_samples = 0u;

    /* if the measurement is invalid, wait for the first valid one */
    const double check = fabs(inputs->shoulder_yaw) + fabs(inputs->shoulder_pitch) + fabs(inputs->arm_roll)
        + fabs(inputs->elbow_pitch) + fabs(inputs->forearm_roll) + fabs(inputs->wrist_pitch)
        + fabs(inputs->hand_roll) + fabs(inputs->w_shoulder_yaw) + fabs(inputs->w_shoulder_pitch)
        + fabs(inputs->w_arm_roll) + fabs(inputs->w_elbow_pitch) + fabs(inputs->w_forearm_roll)
        + fabs(inputs->w_wrist_pitch) + fabs(inputs->w_hand_roll) + fabs(state->z_v_shoulder_yaw)
        + fabs(state->z_v_shoulder_pitch) + fabs(state->z_v_arm_roll) + fabs(state->z_v_elbow_pitch)
        + fabs(state->z_v_forearm_roll) + fabs(state->z_v_wrist_pitch) + fabs(state->z_v_hand_roll)
        + fabs(state->z_shoulder_yaw) + fabs(state->z_shoulder_pitch) + fabs(state->z_arm_roll)
        + fabs(state->z_elbow_pitch) + fabs(state->z_forearm_roll) + fabs(state->z_wrist_pitch)
        + fabs(state->z_hand_roll);
    if (!(fabs(check) <= 1e+150)) {
        state->z_v_shoulder_yaw = 0.0;
        state->z_v_shoulder_pitch = 0.0;
        state->z_v_arm_roll = 0.0;
        state->z_v_elbow_pitch = 0.0;
        state->z_v_forearm_roll = 0.0;
        state->z_v_wrist_pitch = 0.0;
        state->z_v_hand_roll = 0.0;
        state->z_shoulder_yaw = 0.0;
        state->z_shoulder_pitch = 0.0;
        state->z_arm_roll = 0.0;
        state->z_elbow_pitch = 0.0;
        state->z_forearm_roll = 0.0;
        state->z_wrist_pitch = 0.0;
        state->z_hand_roll = 0.0;
        state->mode = SEVEN_JOINT_ARM_STARTING;
    }
}

/* Predict the state over an invalid sample, as if the machine moved at the held velocity estimate. */
static void seven_joint_arm_predict(seven_joint_arm_state *state, const seven_joint_arm_parameters *parameters,
    const seven_joint_arm_outputs *outputs)
{
    state->z_v_shoulder_yaw = state->z_v_shoulder_yaw - parameters->sample_time * parameters->K_v_v_shoulder_yaw
        * outputs->v_shoulder_yaw_hat;
    state->z_v_shoulder_pitch = state->z_v_shoulder_pitch - parameters->sample_time
        * parameters->K_v_v_shoulder_pitch * outputs->v_shoulder_pitch_hat;
    state->z_v_arm_roll = state->z_v_arm_roll - parameters->sample_time * parameters->K_v_v_arm_roll
        * outputs->v_arm_roll_hat;
    state->z_v_elbow_pitch = state->z_v_elbow_pitch - parameters->sample_time * parameters->K_v_v_elbow_pitch
        * outputs->v_elbow_pitch_hat;
    state->z_v_forearm_roll = state->z_v_forearm_roll - parameters->sample_time * parameters->K_v_v_forearm_roll
        * outputs->v_forearm_roll_hat;
    state->z_v_wrist_pitch = state->z_v_wrist_pitch - parameters->sample_time * parameters->K_v_v_wrist_pitch
        * outputs->v_wrist_pitch_hat;
    state->z_v_hand_roll = state->z_v_hand_roll - parameters->sample_time * parameters->K_v_v_hand_roll
        * outputs->v_hand_roll_hat;

    /* after 8 invalid samples in a row, resume from the next valid one */
    if (state->mode == SEVEN_JOINT_ARM_RUNNING) {
        if (outputs->fault == 0) {
            state->invalid_samples = 0u; /* the sample before was valid */
        }
        state->invalid_samples++;
        if (state->invalid_samples >= 8u) {
            state->mode = SEVEN_JOINT_ARM_HOLDING;
        }
    }
}

/* Set the state from a valid sample so that the estimates equal the held ones. */
static void seven_joint_arm_resume(seven_joint_arm_state *state, const seven_joint_arm_parameters *parameters,
    const seven_joint_arm_inputs *inputs, const seven_joint_arm_outputs *outputs)
{
    state->z_v_shoulder_yaw = outputs->v_shoulder_yaw_hat - parameters->K_v_v_shoulder_yaw
        * (inputs->shoulder_yaw + parameters->sample_time * outputs->v_shoulder_yaw_hat);
    state->z_v_shoulder_pitch = outputs->v_shoulder_pitch_hat - parameters->K_v_v_shoulder_pitch
        * (inputs->shoulder_pitch + parameters->sample_time * outputs->v_shoulder_pitch_hat);
    state->z_v_arm_roll = outputs->v_arm_roll_hat - parameters->K_v_v_arm_roll * (inputs->arm_roll
        + parameters->sample_time * outputs->v_arm_roll_hat);
    state->z_v_elbow_pitch = outputs->v_elbow_pitch_hat - parameters->K_v_v_elbow_pitch * (inputs->elbow_pitch
        + parameters->sample_time * outputs->v_elbow_pitch_hat);
    state->z_v_forearm_roll = outputs->v_forearm_roll_hat - parameters->K_v_v_forearm_roll
        * (inputs->forearm_roll + parameters->sample_time * outputs->v_forearm_roll_hat);
    state->z_v_wrist_pitch = outputs->v_wrist_pitch_hat - parameters->K_v_v_wrist_pitch * (inputs->wrist_pitch
        + parameters->sample_time * outputs->v_wrist_pitch_hat);
    state->z_v_hand_roll = outputs->v_hand_roll_hat - parameters->K_v_v_hand_roll * (inputs->hand_roll
        + parameters->sample_time * outputs->v_hand_roll_hat);
    state->z_shoulder_yaw = outputs->tracked_shoulder_yaw - parameters->K_2_shoulder_yaw
        * outputs->v_shoulder_yaw_hat;
    state->z_shoulder_pitch = outputs->tracked_shoulder_pitch - parameters->K_2_shoulder_pitch
        * outputs->v_shoulder_pitch_hat;
    state->z_arm_roll = outputs->tracked_arm_roll - parameters->K_2_arm_roll * outputs->v_arm_roll_hat;
    state->z_elbow_pitch = outputs->tracked_elbow_pitch - parameters->K_2_elbow_pitch
        * outputs->v_elbow_pitch_hat;
    state->z_forearm_roll = outputs->tracked_forearm_roll - parameters->K_2_forearm_roll
        * outputs->v_forearm_roll_hat;
    state->z_wrist_pitch = outputs->tracked_wrist_pitch - parameters->K_2_wrist_pitch
        * outputs->v_wrist_pitch_hat;
    state->z_hand_roll = outputs->tracked_hand_roll - parameters->K_2_hand_roll * outputs->v_hand_roll_hat;
    state->mode = SEVEN_JOINT_ARM_RUNNING;
    state->invalid_samples = 0u;
}

/* Handle an invalid sample, or an invalid state: hold the last estimates, and set the state for the next sample. */
static SEVEN_JOINT_ARM_COLD void seven_joint_arm_handle_fault(seven_joint_arm_state *state,
    const seven_joint_arm_parameters *parameters, const seven_joint_arm_inputs *inputs, seven_joint_arm_outputs *outputs)
{
    const double given = fabs(inputs->shoulder_yaw) + fabs(inputs->shoulder_pitch) + fabs(inputs->arm_roll)
        + fabs(inputs->elbow_pitch) + fabs(inputs->forearm_roll) + fabs(inputs->wrist_pitch)
        + fabs(inputs->hand_roll) + fabs(inputs->w_shoulder_yaw) + fabs(inputs->w_shoulder_pitch)
        + fabs(inputs->w_arm_roll) + fabs(inputs->w_elbow_pitch) + fabs(inputs->w_forearm_roll)
        + fabs(inputs->w_wrist_pitch) + fabs(inputs->w_hand_roll);
    if (!(fabs(given) <= 1e+150)) {
        /* invalid sample */
        if (state->mode != SEVEN_JOINT_ARM_STARTING) {
            seven_joint_arm_predict(state, parameters, outputs);
        }
    } else if (state->mode == SEVEN_JOINT_ARM_HOLDING) {
        /* first valid sample after many invalid ones */
        seven_joint_arm_resume(state, parameters, inputs, outputs);
    } else {
        /* first valid sample of all, or an invalid state */
        seven_joint_arm_init(state, parameters, inputs);
    }
    outputs->fault = 1;
}

void seven_joint_arm_step(seven_joint_arm_state *state, const seven_joint_arm_parameters *parameters,
    const seven_joint_arm_inputs *inputs, seven_joint_arm_outputs *outputs)
{
    /* velocity estimate, (4.25) */
    const double v_shoulder_yaw_hat = state->z_v_shoulder_yaw + parameters->K_v_v_shoulder_yaw
        * inputs->shoulder_yaw; /* rad/s */
    const double v_shoulder_pitch_hat = state->z_v_shoulder_pitch + parameters->K_v_v_shoulder_pitch
        * inputs->shoulder_pitch; /* rad/s */
    const double v_arm_roll_hat = state->z_v_arm_roll + parameters->K_v_v_arm_roll * inputs->arm_roll; /* rad/s */
    const double v_elbow_pitch_hat = state->z_v_elbow_pitch + parameters->K_v_v_elbow_pitch
        * inputs->elbow_pitch; /* rad/s */
    const double v_forearm_roll_hat = state->z_v_forearm_roll + parameters->K_v_v_forearm_roll
        * inputs->forearm_roll; /* rad/s */
    const double v_wrist_pitch_hat = state->z_v_wrist_pitch + parameters->K_v_v_wrist_pitch
        * inputs->wrist_pitch; /* rad/s */
    const double v_hand_roll_hat = state->z_v_hand_roll + parameters->K_v_v_hand_roll * inputs->hand_roll; /* rad/s */

    /* tracked friction, (4.16) */
    const double tracked_shoulder_yaw = state->z_shoulder_yaw + parameters->K_2_shoulder_yaw
        * v_shoulder_yaw_hat; /* N*m */
    const double tracked_shoulder_pitch = state->z_shoulder_pitch + parameters->K_2_shoulder_pitch
        * v_shoulder_pitch_hat; /* N*m */
    const double tracked_arm_roll = state->z_arm_roll + parameters->K_2_arm_roll * v_arm_roll_hat; /* N*m */
    const double tracked_elbow_pitch = state->z_elbow_pitch + parameters->K_2_elbow_pitch * v_elbow_pitch_hat; /* N*m */
    const double tracked_forearm_roll = state->z_forearm_roll + parameters->K_2_forearm_roll
        * v_forearm_roll_hat; /* N*m */
    const double tracked_wrist_pitch = state->z_wrist_pitch + parameters->K_2_wrist_pitch * v_wrist_pitch_hat; /* N*m */
    const double tracked_hand_roll = state->z_hand_roll + parameters->K_2_hand_roll * v_hand_roll_hat; /* N*m */

    /* known friction, declared effects */
    const double known_shoulder_yaw = parameters->viscous_shoulder_yaw_b * v_shoulder_yaw_hat; /* N*m */
    const double known_shoulder_pitch = parameters->viscous_shoulder_pitch_b * v_shoulder_pitch_hat; /* N*m */
    const double known_arm_roll = parameters->viscous_arm_roll_b * v_arm_roll_hat; /* N*m */
    const double known_elbow_pitch = parameters->viscous_elbow_pitch_b * v_elbow_pitch_hat; /* N*m */
    const double known_forearm_roll = parameters->viscous_forearm_roll_b * v_forearm_roll_hat; /* N*m */
    const double known_wrist_pitch = parameters->viscous_wrist_pitch_b * v_wrist_pitch_hat; /* N*m */
    const double known_hand_roll = parameters->viscous_hand_roll_b * v_hand_roll_hat; /* N*m */

    /* friction force, (4.16) */
    const double F_hat_on_shoulder_yaw = known_shoulder_yaw + tracked_shoulder_yaw; /* N*m */
    const double F_hat_on_shoulder_pitch = known_shoulder_pitch + tracked_shoulder_pitch; /* N*m */
    const double F_hat_on_arm_roll = known_arm_roll + tracked_arm_roll; /* N*m */
    const double F_hat_on_elbow_pitch = known_elbow_pitch + tracked_elbow_pitch; /* N*m */
    const double F_hat_on_forearm_roll = known_forearm_roll + tracked_forearm_roll; /* N*m */
    const double F_hat_on_wrist_pitch = known_wrist_pitch + tracked_wrist_pitch; /* N*m */
    const double F_hat_on_hand_roll = known_hand_roll + tracked_hand_roll; /* N*m */

    /* acceleration, (4.2) */
    const double cos_hand_roll = cos(inputs->hand_roll);
    const double sin_hand_roll = sin(inputs->hand_roll);
    const double cos_forearm_roll = cos(inputs->forearm_roll);
    const double cos_wrist_pitch = cos(inputs->wrist_pitch);
    const double sin_wrist_pitch = sin(inputs->wrist_pitch);
    const double sin_forearm_roll = sin(inputs->forearm_roll);
    const double acceleration_1 = 0.0003027650871698192 * cos_hand_roll;
    const double cos_elbow_pitch = cos(inputs->elbow_pitch);
    const double sin_elbow_pitch = sin(inputs->elbow_pitch);
    const double cos_shoulder_pitch = cos(inputs->shoulder_pitch);
    const double cos_arm_roll = cos(inputs->arm_roll);
    const double sin_arm_roll = sin(inputs->arm_roll);
    const double sin_shoulder_pitch = sin(inputs->shoulder_pitch);
    const double acceleration_2 = 0.0002259499347204054 * sin_hand_roll;
    const double v_shoulder_pitch_hat_squared = v_shoulder_pitch_hat * v_shoulder_pitch_hat;
    const double acceleration_3 = 9.81 * sin_shoulder_pitch;
    const double acceleration_4 = sin_arm_roll * acceleration_3;
    const double acceleration_5 = cos_arm_roll * acceleration_3;
    const double acceleration_6 = 0.9950041652780258 * cos_hand_roll;
    const double acceleration_7 = 0.09983341664682815 * sin_hand_roll;
    const double acceleration_8 = 0.9950041652780258 * sin_hand_roll;
    const double acceleration_9 = 0.09983341664682815 * cos_hand_roll;
    const double acceleration_10 = 0.00056 * sin_hand_roll - 7.699999999999992e-05 * cos_hand_roll;
    const double acceleration_11 = cos_hand_roll * acceleration_10;
    const double acceleration_12 = 0.0073443 - acceleration_11;
    const double acceleration_13 = 0.0010488 + acceleration_11;
    const double acceleration_14 = 0.0002259499347204054 * cos_hand_roll + 0.0003027650871698192 * sin_hand_roll;
    const double acceleration_15 = 0.09983341664682815 * acceleration_13 + 0.9950041652780258 * acceleration_14;
    const double acceleration_16 = 4.6197084915690593e-05 * cos_hand_roll + 0.00010609713490378748
        * sin_hand_roll;
    const double acceleration_17 = 0.04187779227084341 + 0.09983341664682815 * acceleration_15
        + 0.09933466539753062 * acceleration_14 - 2.0 * (0.00436873060511378 * acceleration_16);
    const double acceleration_18 = 0.0004604299187458011 * cos_hand_roll + 0.0010574324179126165 * sin_hand_roll;
    const double acceleration_19 = 0.006233836391918195 + 0.9900332889206209 * acceleration_13
        - 0.19866933079506124 * acceleration_14 - 2.0 * (0.043541584522179204 * acceleration_18);
    const double acceleration_20 = 0.9950041652780258 * acceleration_15 - 0.012821687277795328
        - 0.009966711079379185 * acceleration_14 - 0.043541584522179204 * acceleration_16 - 0.00436873060511378
        * acceleration_18;
    const double acceleration_21 = cos_wrist_pitch * (acceleration_19 - acceleration_17) - 2.0 * sin_wrist_pitch
        * acceleration_20;
    const double acceleration_22 = cos_wrist_pitch * acceleration_21;
    const double acceleration_23 = 0.0020022 + acceleration_17 + acceleration_22;
    const double acceleration_24 = sin_hand_roll * acceleration_10 - 0.00028;
    const double acceleration_25 = acceleration_1 - acceleration_2;
    const double acceleration_26 = 0.001062741699796952 * cos_hand_roll - 0.00046274169979695207 * sin_hand_roll;
    const double acceleration_27 = 0.9950041652780258 * acceleration_24 - 8.3e-05 + 0.09983341664682815
        * acceleration_25 + 0.043541584522179204 * acceleration_26;
    const double acceleration_28 = cos_wrist_pitch * acceleration_27;
    const double acceleration_29 = 0.09983341664682815 * acceleration_24 - 0.00074 - 0.9950041652780258
        * acceleration_25 + 0.00436873060511378 * acceleration_26;
    const double acceleration_30 = sin_wrist_pitch * acceleration_29;
    const double acceleration_31 = 0.000144 + acceleration_28 - acceleration_30;
    const double acceleration_32 = cos_forearm_roll * (acceleration_23 - acceleration_12) - 2.0
        * sin_forearm_roll * acceleration_31;
    const double acceleration_33 = cos_forearm_roll * acceleration_32;
    const double acceleration_34 = 0.0030261 + acceleration_12 + acceleration_33;
    const double acceleration_35 = 0.08557967683091304 - acceleration_18;
    const double acceleration_36 = 0.27339050816391913 + acceleration_16;
    const double acceleration_37 = sin_wrist_pitch * acceleration_35 - cos_wrist_pitch * acceleration_36;
    const double acceleration_38 = 0.39 * acceleration_37;
    const double acceleration_39 = 0.73793 + acceleration_19 - acceleration_22 - 2.0 * acceleration_38;
    const double acceleration_40 = cos_wrist_pitch * acceleration_35;
    const double acceleration_41 = sin_wrist_pitch * acceleration_36;
    const double acceleration_42 = acceleration_40 + acceleration_41;
    const double acceleration_43 = 0.000482 + 0.39 * acceleration_42 - acceleration_20 - sin_wrist_pitch
        * acceleration_21;
    const double acceleration_44 = cos_forearm_roll * acceleration_43;
    const double M65 = sin_wrist_pitch * acceleration_27 + cos_wrist_pitch * acceleration_29;
    const double acceleration_45 = 0.016055 + 0.39 * acceleration_26 - M65;
    const double acceleration_46 = sin_forearm_roll * acceleration_45;
    const double acceleration_47 = acceleration_44 - 0.00107 - acceleration_46;
    const double acceleration_48 = cos_elbow_pitch * (acceleration_34 - acceleration_39) - 2.0 * sin_elbow_pitch
        * acceleration_47;
    const double acceleration_49 = cos_elbow_pitch * acceleration_48;
    const double acceleration_50 = 0.0022 + acceleration_42;
    const double acceleration_51 = cos_forearm_roll * acceleration_50;
    const double acceleration_52 = 0.0525 + acceleration_26;
    const double acceleration_53 = sin_forearm_roll * acceleration_52;
    const double acceleration_54 = acceleration_51 - 0.0087 - acceleration_53;
    const double acceleration_55 = sin_elbow_pitch * acceleration_54;
    const double acceleration_56 = 2.181 - acceleration_37;
    const double acceleration_57 = cos_elbow_pitch * acceleration_56;
    const double acceleration_58 = 1.78847 + acceleration_34 - acceleration_49 + 2.0 * (0.41 * (acceleration_55
        + acceleration_57));
    const double acceleration_59 = 0.0159 + acceleration_23 - acceleration_33;
    const double acceleration_60 = 0.0035496 + acceleration_39 + acceleration_49;
    const double acceleration_61 = 0.000139 - acceleration_31 - sin_forearm_roll * acceleration_32;
    const double acceleration_62 = cos_elbow_pitch * acceleration_61;
    const double M54 = sin_forearm_roll * acceleration_43 + cos_forearm_roll * acceleration_45;
    const double acceleration_63 = 0.0102 - M54;
    const double acceleration_64 = sin_elbow_pitch * acceleration_63;
    const double acceleration_65 = 7.2e-05 - acceleration_62 + acceleration_64;
    const double acceleration_66 = cos_arm_roll * (acceleration_60 - acceleration_59) - 2.0 * sin_arm_roll
        * acceleration_65;
    const double acceleration_67 = cos_arm_roll * acceleration_66;
    const double acceleration_68 = 0.0045041 + acceleration_59 + acceleration_67;
    const double acceleration_69 = 0.003468 + acceleration_47 + sin_elbow_pitch * acceleration_48 + 0.41
        * (cos_elbow_pitch * acceleration_54 - sin_elbow_pitch * acceleration_56);
    const double acceleration_70 = cos_arm_roll * acceleration_69;
    const double acceleration_71 = sin_forearm_roll * acceleration_50;
    const double acceleration_72 = cos_forearm_roll * acceleration_52;
    const double acceleration_73 = sin_elbow_pitch * acceleration_61 + cos_elbow_pitch * acceleration_63;
    const double acceleration_74 = 0.41 * (acceleration_71 + acceleration_72) - 0.00471 - acceleration_73;
    const double acceleration_75 = sin_arm_roll * acceleration_74;
    const double acceleration_76 = sin_arm_roll * acceleration_69 + cos_arm_roll * acceleration_74;
    const double M21 = sin_shoulder_pitch * (acceleration_65 - 0.000118 + sin_arm_roll * acceleration_66)
        - cos_shoulder_pitch * (0.01112 + acceleration_76);
    const double M33 = acceleration_60 + acceleration_59;
    const double M31 = cos_shoulder_pitch * M33 - sin_shoulder_pitch * (acceleration_75 - acceleration_70);
    const double acceleration_77 = acceleration_64 - acceleration_62;
    const double M44 = acceleration_34 + acceleration_39;
    const double acceleration_78 = M44 + 0.41 * (acceleration_57 + acceleration_55);
    const double acceleration_79 = sin_shoulder_pitch * (cos_arm_roll * acceleration_77 + sin_arm_roll
        * acceleration_78) + cos_shoulder_pitch * acceleration_73;
    const double acceleration_80 = acceleration_46 - acceleration_44;
    const double M55 = acceleration_23 + acceleration_12;
    const double M53 = sin_elbow_pitch * acceleration_80 + cos_elbow_pitch * M55;
    const double acceleration_81 = cos_elbow_pitch * acceleration_80 - sin_elbow_pitch * M55 + 0.41
        * (acceleration_53 - acceleration_51);
    const double acceleration_82 = M54 + 0.41 * cos_elbow_pitch * (acceleration_72 + acceleration_71);
    const double M51 = cos_shoulder_pitch * M53 - sin_shoulder_pitch * (cos_arm_roll * acceleration_81
        + sin_arm_roll * acceleration_82);
    const double acceleration_83 = acceleration_30 - acceleration_28;
    const double M66 = acceleration_19 + acceleration_17;
    const double acceleration_84 = M66 - acceleration_38;
    const double acceleration_85 = cos_forearm_roll * acceleration_83 - sin_forearm_roll * acceleration_84;
    const double M63 = sin_elbow_pitch * acceleration_85 + cos_elbow_pitch * M65;
    const double acceleration_86 = cos_elbow_pitch * acceleration_85 - sin_elbow_pitch * M65 + 0.41
        * sin_forearm_roll * acceleration_37;
    const double acceleration_87 = sin_forearm_roll * acceleration_83 + cos_forearm_roll * acceleration_84;
    const double acceleration_88 = acceleration_87 - 0.41 * (cos_forearm_roll * cos_elbow_pitch
        * acceleration_37 - sin_elbow_pitch * (acceleration_41 + acceleration_40));
    const double M61 = cos_shoulder_pitch * M63 - sin_shoulder_pitch * (cos_arm_roll * acceleration_86
        - sin_arm_roll * acceleration_88);
    const double acceleration_89 = 0.001062741699796952 * sin_hand_roll + 0.00046274169979695207 * cos_hand_roll;
    const double acceleration_90 = 0.0002248211261911014 * cos_hand_roll + 0.00030125252283473466
        * sin_hand_roll + 0.00020172340167658097 - 0.00436873060511378 * acceleration_89;
    const double acceleration_91 = 2.2557353974265858e-05 * cos_hand_roll + 3.0226073093537806e-05
        * sin_hand_roll - 0.002010505416360779 + 0.043541584522179204 * acceleration_89;
    const double acceleration_92 = cos_wrist_pitch * acceleration_90 - sin_wrist_pitch * acceleration_91 + 0.39
        * acceleration_89;
    const double acceleration_93 = 4.6197084915690593e-05 * sin_hand_roll - 0.00010609713490378748
        * cos_hand_roll;
    const double acceleration_94 = 0.0004604299187458011 * sin_hand_roll - 0.0010574324179126165 * cos_hand_roll;
    const double M76 = acceleration_2 - acceleration_1 + 0.043541584522179204 * acceleration_93
        - 0.00436873060511378 * acceleration_94;
    const double acceleration_95 = cos_wrist_pitch * acceleration_94 - sin_wrist_pitch * acceleration_93;
    const double acceleration_96 = M76 + 0.39 * acceleration_95;
    const double acceleration_97 = cos_forearm_roll * acceleration_92 - sin_forearm_roll * acceleration_96;
    const double acceleration_98 = sin_wrist_pitch * acceleration_90 + cos_wrist_pitch * acceleration_91;
    const double M73 = sin_elbow_pitch * acceleration_97 - cos_elbow_pitch * acceleration_98;
    const double acceleration_99 = cos_elbow_pitch * acceleration_97 + sin_elbow_pitch * acceleration_98 - 0.41
        * (sin_forearm_roll * acceleration_95 - cos_forearm_roll * acceleration_89);
    const double acceleration_100 = sin_forearm_roll * acceleration_92 + cos_forearm_roll * acceleration_96;
    const double acceleration_101 = acceleration_100 + 0.41 * (cos_elbow_pitch * (cos_forearm_roll
        * acceleration_95 + sin_forearm_roll * acceleration_89) + sin_elbow_pitch * (sin_wrist_pitch
        * acceleration_94 + cos_wrist_pitch * acceleration_93));
    const double M71 = cos_shoulder_pitch * M73 - sin_shoulder_pitch * (cos_arm_roll * acceleration_99
        - sin_arm_roll * acceleration_101);
    const double acceleration_102 = v_shoulder_yaw_hat * sin_shoulder_pitch;
    const double acceleration_102_squared = acceleration_102 * acceleration_102;
    const double acceleration_103 = acceleration_102_squared + v_shoulder_pitch_hat_squared;
    const double acceleration_104 = v_shoulder_yaw_hat * cos_shoulder_pitch;
    const double acceleration_104_squared = acceleration_104 * acceleration_104;
    const double acceleration_105 = acceleration_102_squared + acceleration_104_squared;
    const double acceleration_106 = v_shoulder_pitch_hat * acceleration_104;
    const double acceleration_107 = v_shoulder_pitch_hat * acceleration_102;
    const double acceleration_108 = acceleration_102 * acceleration_104;
    const double acceleration_109 = sin_arm_roll * acceleration_102 + v_shoulder_pitch_hat * cos_arm_roll;
    const double acceleration_110 = acceleration_104 + v_arm_roll_hat;
    const double acceleration_111 = acceleration_109 * acceleration_110;
    const double acceleration_112 = v_arm_roll_hat * acceleration_109 - cos_arm_roll * acceleration_106;
    const double acceleration_113 = acceleration_111 + acceleration_112;
    const double acceleration_114 = v_shoulder_pitch_hat * sin_arm_roll - cos_arm_roll * acceleration_102;
    const double acceleration_115 = acceleration_110 * acceleration_114;
    const double acceleration_116 = sin_arm_roll * acceleration_106 - v_arm_roll_hat * acceleration_114;
    const double acceleration_117 = acceleration_115 - acceleration_116;
    const double acceleration_118 = acceleration_109 * acceleration_114;
    const double acceleration_119 = acceleration_118 - acceleration_107;
    const double acceleration_114_squared = acceleration_114 * acceleration_114;
    const double acceleration_110_squared = acceleration_110 * acceleration_110;
    const double acceleration_120 = acceleration_114_squared + acceleration_110_squared;
    const double acceleration_109_squared = acceleration_109 * acceleration_109;
    const double acceleration_121 = acceleration_114_squared + acceleration_109_squared;
    const double acceleration_122 = cos_elbow_pitch * acceleration_110 - sin_elbow_pitch * acceleration_114;
    const double acceleration_123 = v_elbow_pitch_hat - acceleration_109;
    const double acceleration_124 = acceleration_122 * acceleration_123;
    const double acceleration_125 = cos_elbow_pitch * acceleration_112 - sin_elbow_pitch * acceleration_107
        + v_elbow_pitch_hat * acceleration_122;
    const double acceleration_126 = acceleration_124 + acceleration_125;
    const double acceleration_127 = cos_elbow_pitch * acceleration_114 + sin_elbow_pitch * acceleration_110;
    const double acceleration_128 = acceleration_123 * acceleration_127;
    const double acceleration_129 = sin_elbow_pitch * acceleration_112 + cos_elbow_pitch * acceleration_107
        + v_elbow_pitch_hat * acceleration_127;
    const double acceleration_130 = acceleration_128 + acceleration_129;
    const double acceleration_131 = acceleration_122 * acceleration_127;
    const double acceleration_132 = acceleration_131 - acceleration_116;
    const double acceleration_127_squared = acceleration_127 * acceleration_127;
    const double acceleration_123_squared = acceleration_123 * acceleration_123;
    const double acceleration_133 = acceleration_127_squared + acceleration_123_squared;
    const double acceleration_122_squared = acceleration_122 * acceleration_122;
    const double acceleration_134 = acceleration_127_squared + acceleration_122_squared;
    const double acceleration_135 = acceleration_111 - acceleration_112;
    const double acceleration_136 = acceleration_4 + 0.41 * acceleration_135;
    const double acceleration_137 = sin_forearm_roll * acceleration_127 + cos_forearm_roll * acceleration_123;
    const double acceleration_138 = cos_forearm_roll * acceleration_125 + sin_forearm_roll * acceleration_116
        - v_forearm_roll_hat * acceleration_137;
    const double acceleration_139 = acceleration_122 + v_forearm_roll_hat;
    const double acceleration_140 = acceleration_137 * acceleration_139;
    const double acceleration_141 = acceleration_138 - acceleration_140;
    const double acceleration_142 = cos_forearm_roll * acceleration_127 - sin_forearm_roll * acceleration_123;
    const double acceleration_143 = acceleration_139 * acceleration_142;
    const double acceleration_144 = cos_forearm_roll * acceleration_116 - sin_forearm_roll * acceleration_125
        - v_forearm_roll_hat * acceleration_142;
    const double acceleration_145 = acceleration_143 - acceleration_144;
    const double acceleration_146 = acceleration_137 * acceleration_142;
    const double acceleration_147 = acceleration_146 + acceleration_129;
    const double acceleration_142_squared = acceleration_142 * acceleration_142;
    const double acceleration_139_squared = acceleration_139 * acceleration_139;
    const double acceleration_148 = acceleration_142_squared + acceleration_139_squared;
    const double acceleration_137_squared = acceleration_137 * acceleration_137;
    const double acceleration_149 = acceleration_142_squared + acceleration_137_squared;
    const double acceleration_150 = 9.81 * cos_shoulder_pitch - 0.41 * acceleration_121;
    const double acceleration_151 = acceleration_115 + acceleration_116;
    const double acceleration_152 = 0.41 * acceleration_151 - acceleration_5;
    const double acceleration_153 = cos_elbow_pitch * acceleration_150 - sin_elbow_pitch * acceleration_152;
    const double acceleration_154 = sin_wrist_pitch * acceleration_142 + cos_wrist_pitch * acceleration_139;
    const double acceleration_155 = cos_wrist_pitch * acceleration_138 + sin_wrist_pitch * acceleration_129
        - v_wrist_pitch_hat * acceleration_154;
    const double acceleration_156 = v_wrist_pitch_hat - acceleration_137;
    const double acceleration_157 = acceleration_154 * acceleration_156;
    const double acceleration_158 = acceleration_155 - acceleration_157;
    const double acceleration_159 = cos_wrist_pitch * acceleration_142 - sin_wrist_pitch * acceleration_139;
    const double acceleration_160 = acceleration_156 * acceleration_159;
    const double acceleration_161 = cos_wrist_pitch * acceleration_129 - sin_wrist_pitch * acceleration_138
        - v_wrist_pitch_hat * acceleration_159;
    const double acceleration_162 = acceleration_160 - acceleration_161;
    const double acceleration_163 = acceleration_154 * acceleration_159;
    const double acceleration_164 = acceleration_144 - acceleration_163;
    const double acceleration_159_squared = acceleration_159 * acceleration_159;
    const double acceleration_156_squared = acceleration_156 * acceleration_156;
    const double acceleration_165 = acceleration_159_squared + acceleration_156_squared;
    const double acceleration_154_squared = acceleration_154 * acceleration_154;
    const double acceleration_166 = acceleration_159_squared + acceleration_154_squared;
    const double acceleration_167 = cos_elbow_pitch * acceleration_152 + sin_elbow_pitch * acceleration_150;
    const double acceleration_168 = cos_forearm_roll * acceleration_136 - sin_forearm_roll * acceleration_167;
    const double acceleration_169 = acceleration_140 + acceleration_138;
    const double acceleration_170 = acceleration_168 - 0.39 * acceleration_169;
    const double acceleration_171 = acceleration_7 * acceleration_154 - acceleration_8 * acceleration_159
        + cos_hand_roll * acceleration_156;
    const double acceleration_172 = 0.09983341664682815 * acceleration_159 + 0.9950041652780258
        * acceleration_154 + v_hand_roll_hat;
    const double acceleration_173 = acceleration_171 * acceleration_172;
    const double acceleration_174 = acceleration_6 * acceleration_155 + acceleration_9 * acceleration_161
        + sin_hand_roll * acceleration_144 + v_hand_roll_hat * acceleration_171;
    const double acceleration_175 = acceleration_173 + acceleration_174;
    const double acceleration_176 = acceleration_6 * acceleration_159 - acceleration_9 * acceleration_154
        + sin_hand_roll * acceleration_156;
    const double acceleration_177 = acceleration_172 * acceleration_176;
    const double acceleration_178 = cos_hand_roll * acceleration_144 - acceleration_8 * acceleration_155
        - acceleration_7 * acceleration_161 - v_hand_roll_hat * acceleration_176;
    const double acceleration_179 = acceleration_177 - acceleration_178;
    const double acceleration_180 = acceleration_171 * acceleration_176;
    const double acceleration_181 = 0.09983341664682815 * acceleration_155 - 0.9950041652780258
        * acceleration_161;
    const double acceleration_182 = acceleration_180 + acceleration_181;
    const double acceleration_176_squared = acceleration_176 * acceleration_176;
    const double acceleration_172_squared = acceleration_172 * acceleration_172;
    const double acceleration_183 = acceleration_176_squared + acceleration_172_squared;
    const double acceleration_171_squared = acceleration_171 * acceleration_171;
    const double acceleration_184 = acceleration_176_squared + acceleration_171_squared;
    const double acceleration_185 = cos_forearm_roll * acceleration_167 + sin_forearm_roll * acceleration_136;
    const double acceleration_186 = acceleration_143 + acceleration_144;
    const double acceleration_187 = acceleration_185 + 0.39 * acceleration_186;
    const double acceleration_188 = acceleration_153 - 0.39 * acceleration_149;
    const double acceleration_189 = cos_wrist_pitch * acceleration_187 - sin_wrist_pitch * acceleration_188;
    const double acceleration_190 = acceleration_154_squared + acceleration_156_squared;
    const double acceleration_191 = acceleration_163 + acceleration_144;
    const double acceleration_192 = acceleration_189 - 0.043541584522179204 * acceleration_190
        - 0.00436873060511378 * acceleration_191;
    const double acceleration_193 = sin_wrist_pitch * acceleration_187 + cos_wrist_pitch * acceleration_188;
    const double acceleration_194 = 0.043541584522179204 * acceleration_164 - 0.00436873060511378
        * acceleration_165 - acceleration_193;
    const double acceleration_195 = 0.09983341664682815 * acceleration_192 - 0.9950041652780258
        * acceleration_194;
    const double acceleration_196 = 0.0010488 * acceleration_175 - 0.00028 * acceleration_179
        + 0.0002259499347204054 * acceleration_182 + 0.0003027650871698192 * (acceleration_183
        - acceleration_184) + 0.001062741699796952 * acceleration_195;
    const double acceleration_197 = acceleration_180 - acceleration_181;
    const double acceleration_198 = acceleration_171_squared + acceleration_172_squared;
    const double acceleration_199 = 0.0003027650871698192 * acceleration_197 - 0.0009718 * acceleration_179
        + 0.00028 * acceleration_175 - 0.0002259499347204054 * (acceleration_184 - acceleration_198)
        + 0.00046274169979695207 * acceleration_195;
    const double acceleration_200 = acceleration_170 + 0.043541584522179204 * acceleration_162
        + 0.00436873060511378 * acceleration_158;
    const double acceleration_201 = 0.0009718 * acceleration_182 - 0.0010488 * acceleration_197
        - 0.0002259499347204054 * (acceleration_173 - acceleration_174) - 0.0003027650871698192
        * (acceleration_177 + acceleration_178) - 0.00028 * (acceleration_198 - acceleration_183)
        - 0.00046274169979695207 * (cos_hand_roll * acceleration_200 - acceleration_8 * acceleration_192
        - acceleration_7 * acceleration_194) - 0.001062741699796952 * (acceleration_6 * acceleration_192
        + acceleration_9 * acceleration_194 + sin_hand_roll * acceleration_200);
    const double acceleration_202 = 0.001062741699796952 * acceleration_197 + 0.00046274169979695207
        * acceleration_198;
    const double acceleration_203 = 0.00046274169979695207 * acceleration_182 + 0.001062741699796952
        * acceleration_183;
    const double acceleration_204 = sin_hand_roll * acceleration_202 - cos_hand_roll * acceleration_203;
    const double acceleration_205 = 0.04187779227084341 * acceleration_158 - 0.012821687277795328
        * acceleration_162 + 8.3e-05 * acceleration_164 - 0.00074 * (acceleration_165 - acceleration_166)
        - 0.27339050816391913 * acceleration_170 + acceleration_6 * acceleration_196 - acceleration_8
        * acceleration_199 + 0.09983341664682815 * acceleration_201 + 0.00436873060511378 * acceleration_204;
    const double acceleration_206 = 0.00074 * acceleration_191 - 8.3e-05 * (acceleration_166 - acceleration_190)
        - 0.006233836391918195 * acceleration_162 + 0.012821687277795328 * acceleration_158
        - 0.08557967683091304 * acceleration_170 + acceleration_9 * acceleration_196 - acceleration_7
        * acceleration_199 - 0.9950041652780258 * acceleration_201 - 0.043541584522179204 * acceleration_204;
    const double acceleration_207 = 0.08557967683091304 * acceleration_162 - 0.27339050816391913
        * acceleration_158 + acceleration_204;
    const double acceleration_208 = 0.0063725 * acceleration_141 + 0.000144 * acceleration_145 + 0.000482
        * acceleration_147 + 0.016055 * (acceleration_148 - acceleration_149) + 0.0525 * acceleration_153
        + cos_wrist_pitch * acceleration_205 - sin_wrist_pitch * acceleration_206 - 0.39 * acceleration_207;
    const double acceleration_209 = acceleration_129 - acceleration_146;
    const double acceleration_210 = acceleration_137_squared + acceleration_139_squared;
    const double acceleration_211 = 0.001062741699796952 * acceleration_175 - 0.00046274169979695207
        * acceleration_179;
    const double acceleration_212 = acceleration_9 * acceleration_202 + acceleration_7 * acceleration_203
        - 0.9950041652780258 * acceleration_211;
    const double acceleration_213 = acceleration_6 * acceleration_202 + acceleration_8 * acceleration_203
        + 0.09983341664682815 * acceleration_211;
    const double acceleration_214 = 0.006233836391918195 * acceleration_164 + 0.04187779227084341
        * acceleration_191 + 8.3e-05 * (acceleration_157 + acceleration_155) + 0.00074 * (acceleration_160
        + acceleration_161) - 0.012821687277795328 * (acceleration_190 - acceleration_165)
        - 0.08557967683091304 * acceleration_193 + 0.27339050816391913 * acceleration_189 + sin_hand_roll
        * acceleration_196 + cos_hand_roll * acceleration_199 + 0.043541584522179204 * acceleration_212
        - 0.00436873060511378 * acceleration_213;
    const double acceleration_215 = acceleration_213 - 0.08557967683091304 * acceleration_190
        + 0.27339050816391913 * acceleration_191;
    const double acceleration_216 = 0.08557967683091304 * acceleration_164 + 0.27339050816391913
        * acceleration_165 + acceleration_212;
    const double acceleration_217 = cos_wrist_pitch * acceleration_215 - sin_wrist_pitch * acceleration_216;
    const double acceleration_218 = 0.016055 * acceleration_209 - 0.0020022 * acceleration_145 - 0.000144
        * acceleration_141 + 0.000482 * (acceleration_149 - acceleration_210) - 0.0022 * acceleration_153
        + acceleration_214 + 0.39 * acceleration_217;
    const double acceleration_219 = 0.73793 * acceleration_126 - 0.00107 * acceleration_130 - 0.000139
        * acceleration_132 + 0.0102 * (acceleration_133 - acceleration_134) - 2.181 * acceleration_136
        + cos_forearm_roll * acceleration_208 - sin_forearm_roll * acceleration_218;
    const double acceleration_220 = acceleration_131 + acceleration_116;
    const double acceleration_221 = acceleration_122_squared + acceleration_123_squared;
    const double acceleration_222 = 0.000144 * (acceleration_210 - acceleration_148) - 0.0020022
        * acceleration_147 - 0.0063725 * acceleration_209 - 0.000482 * acceleration_169 - 0.016055
        * acceleration_186 + 0.0022 * acceleration_168 - 0.0525 * acceleration_185 - sin_wrist_pitch
        * acceleration_205 - cos_wrist_pitch * acceleration_206;
    const double acceleration_223 = 0.0102 * acceleration_220 - 0.0030261 * acceleration_130 + 0.00107
        * acceleration_126 + 0.000139 * (acceleration_134 - acceleration_221) - 0.0087 * acceleration_136
        + acceleration_222;
    const double acceleration_224 = 0.0525 * acceleration_209 - 0.0022 * acceleration_210 + acceleration_217;
    const double acceleration_225 = acceleration_207 - 0.0022 * acceleration_147 - 0.0525 * acceleration_148;
    const double acceleration_226 = 0.0159 * acceleration_113 + 7.2e-05 * acceleration_117 - 0.003468
        * acceleration_119 - 0.00471 * (acceleration_120 - acceleration_121) + 0.05886 * cos_shoulder_pitch
        + cos_elbow_pitch * acceleration_219 - sin_elbow_pitch * acceleration_223 + 0.41 * (2.181
        * acceleration_126 - 0.0087 * acceleration_130 - sin_forearm_roll * acceleration_224 - cos_forearm_roll
        * acceleration_225);
    const double acceleration_227 = acceleration_118 + acceleration_107;
    const double acceleration_228 = acceleration_109_squared + acceleration_110_squared;
    const double acceleration_229 = 0.0030261 * acceleration_132 - 0.73793 * acceleration_220 + 0.000139
        * (acceleration_124 - acceleration_125) - 0.0102 * (acceleration_128 - acceleration_129) - 0.00107
        * (acceleration_221 - acceleration_133) - 0.0087 * acceleration_153 - 2.181 * acceleration_167
        - sin_forearm_roll * acceleration_208 - cos_forearm_roll * acceleration_218;
    const double acceleration_230 = 0.003468 * (acceleration_121 - acceleration_228) - 0.00471
        * acceleration_227 - 0.0035496 * acceleration_117 - 7.2e-05 * acceleration_113 - 0.121644
        * cos_shoulder_pitch + 0.41 * (cos_elbow_pitch * (2.181 * acceleration_220 + 0.0087 * acceleration_221
        + cos_forearm_roll * acceleration_224 - sin_forearm_roll * acceleration_225) - sin_elbow_pitch
        * (0.0022 * acceleration_145 - 0.0087 * acceleration_132 - 2.181 * acceleration_133 + 0.0525
        * acceleration_141 - sin_wrist_pitch * acceleration_215 - cos_wrist_pitch * acceleration_216))
        - acceleration_229;
    const double acceleration_231 = acceleration_104_squared + v_shoulder_pitch_hat_squared;
    const double acceleration_232 = 0.0035496 * acceleration_119 - 0.0159 * acceleration_227 + 0.003468
        * acceleration_135 + 0.00471 * acceleration_151 + 7.2e-05 * (acceleration_228 - acceleration_120)
        + 0.0124 * acceleration_4 + 0.006 * acceleration_5 + sin_elbow_pitch * acceleration_219
        + cos_elbow_pitch * acceleration_223;
    const double r1 = inputs->w_shoulder_yaw - F_hat_on_shoulder_yaw + sin_shoulder_pitch * (0.000102
        * acceleration_107 - 0.01112 * (acceleration_103 - acceleration_105) - 3.57694 * acceleration_106
        + 0.000118 * acceleration_108 + cos_arm_roll * acceleration_226 - sin_arm_roll * acceleration_230)
        + cos_shoulder_pitch * (0.0090082 * acceleration_107 - 0.01112 * acceleration_108 - 0.000102
        * acceleration_106 - 0.000118 * (acceleration_105 - acceleration_231) - acceleration_232);
    const double one_over_D1 = 1.0 / (0.0239368 + acceleration_58 + cos_shoulder_pitch * (cos_shoulder_pitch
        * (acceleration_68 - acceleration_58) - 2.0 * sin_shoulder_pitch * (acceleration_75 - 5.1e-05
        - acceleration_70)) + acceleration_60 - acceleration_67);
    const double L21 = M21 * one_over_D1;
    const double L31 = M31 * one_over_D1;
    const double acceleration_233 = acceleration_79 * one_over_D1;
    const double L51 = M51 * one_over_D1;
    const double L61 = M61 * one_over_D1;
    const double L71 = M71 * one_over_D1;
    const double one_over_D2 = 1.0 / (acceleration_68 + acceleration_58 - M21 * L21);
    const double acceleration_234 = acceleration_76 + M31 * L21;
    const double acceleration_235 = one_over_D2 * acceleration_234;
    const double LD42 = sin_arm_roll * acceleration_77 - cos_arm_roll * acceleration_78 + acceleration_79 * L21;
    const double L42 = one_over_D2 * LD42;
    const double LD52 = sin_arm_roll * acceleration_81 - cos_arm_roll * acceleration_82 - M51 * L21;
    const double L52 = one_over_D2 * LD52;
    const double LD62 = sin_arm_roll * acceleration_86 + cos_arm_roll * acceleration_88 - M61 * L21;
    const double L62 = one_over_D2 * LD62;
    const double LD72 = sin_arm_roll * acceleration_99 + cos_arm_roll * acceleration_101 - M71 * L21;
    const double L72 = one_over_D2 * LD72;
    const double one_over_D3 = 1.0 / (M33 - M31 * L31 - acceleration_234 * acceleration_235);
    const double LD43 = acceleration_79 * L31 - acceleration_73 + acceleration_235 * LD42;
    const double L43 = one_over_D3 * LD43;
    const double LD53 = M53 - M51 * L31 + acceleration_235 * LD52;
    const double L53 = one_over_D3 * LD53;
    const double LD63 = M63 - M61 * L31 + acceleration_235 * LD62;
    const double L63 = one_over_D3 * LD63;
    const double LD73 = M73 - M71 * L31 + acceleration_235 * LD72;
    const double L73 = one_over_D3 * LD73;
    const double one_over_D4 = 1.0 / (M44 - acceleration_79 * acceleration_233 - LD42 * L42 - LD43 * L43);
    const double LD54 = M54 + M51 * acceleration_233 - L42 * LD52 - L43 * LD53;
    const double L54 = one_over_D4 * LD54;
    const double LD64 = M61 * acceleration_233 - acceleration_87 - L42 * LD62 - L43 * LD63;
    const double L64 = one_over_D4 * LD64;
    const double LD74 = M71 * acceleration_233 - acceleration_100 - L42 * LD72 - L43 * LD73;
    const double L74 = one_over_D4 * LD74;
    const double one_over_D5 = 1.0 / (M55 - M51 * L51 - LD52 * L52 - LD53 * L53 - LD54 * L54);
    const double LD65 = M65 - M61 * L51 - L52 * LD62 - L53 * LD63 - L54 * LD64;
    const double L65 = one_over_D5 * LD65;
    const double acceleration_236 = acceleration_98 + M71 * L51 + L52 * LD72 + L53 * LD73 + L54 * LD74;
    const double acceleration_237 = one_over_D5 * acceleration_236;
    const double one_over_D6 = 1.0 / (M66 - M61 * L61 - LD62 * L62 - LD63 * L63 - LD64 * L64 - LD65 * L65);
    const double LD76 = M76 - M71 * L61 - L62 * LD72 - L63 * LD73 - L64 * LD74 + L65 * acceleration_236;
    const double L76 = one_over_D6 * LD76;
    const double y2 = inputs->w_shoulder_pitch - F_hat_on_shoulder_pitch - sin_arm_roll * acceleration_226
        + 1.7839659 * acceleration_108 + 5.1e-05 * (acceleration_231 - acceleration_103) + 47.13705
        * sin_shoulder_pitch + 0.04022100000000001 * cos_shoulder_pitch - cos_arm_roll * acceleration_230 - r1
        * L21;
    const double y3 = inputs->w_arm_roll - F_hat_on_arm_roll - acceleration_232 - r1 * L31 + acceleration_235
        * y2;
    const double y4 = inputs->w_elbow_pitch - F_hat_on_elbow_pitch - acceleration_229 + r1 * acceleration_233
        - L42 * y2 - L43 * y3;
    const double y5 = inputs->w_forearm_roll - F_hat_on_forearm_roll - acceleration_222 - r1 * L51 - L52 * y2
        - L53 * y3 - L54 * y4;
    const double y6 = inputs->w_wrist_pitch - F_hat_on_wrist_pitch - acceleration_214 - r1 * L61 - L62 * y2
        - L63 * y3 - L64 * y4 - L65 * y5;
    const double a7 = 1.0 / (0.0020206 - M71 * L71 - LD72 * L72 - LD73 * L73 - LD74 * L74 - acceleration_236
        * acceleration_237 - LD76 * L76) * (inputs->w_hand_roll - F_hat_on_hand_roll - acceleration_201 - r1
        * L71 - L72 * y2 - L73 * y3 - L74 * y4 + acceleration_237 * y5 - L76 * y6);
    const double a6 = one_over_D6 * y6 - L76 * a7;
    const double a5 = one_over_D5 * y5 - L65 * a6 + acceleration_237 * a7;
    const double a4 = one_over_D4 * y4 - L54 * a5 - L64 * a6 - L74 * a7;
    const double a3 = one_over_D3 * y3 - L43 * a4 - L53 * a5 - L63 * a6 - L73 * a7;
    const double a2 = one_over_D2 * y2 + acceleration_235 * a3 - L42 * a4 - L52 * a5 - L62 * a6 - L72 * a7;
    const double v_shoulder_yaw_dot_hat = r1 * one_over_D1 - L21 * a2 - L31 * a3 + acceleration_233 * a4
        - L51 * a5 - L61 * a6 - L71 * a7; /* rad/s^2 */

    /* states one sample later (explicit Euler) */
    const double z_v_shoulder_yaw_next = state->z_v_shoulder_yaw + parameters->sample_time
        * (v_shoulder_yaw_dot_hat - parameters->K_v_v_shoulder_yaw * v_shoulder_yaw_hat);
    const double z_v_shoulder_pitch_next = state->z_v_shoulder_pitch + parameters->sample_time * (a2
        - parameters->K_v_v_shoulder_pitch * v_shoulder_pitch_hat);
    const double z_v_arm_roll_next = state->z_v_arm_roll + parameters->sample_time * (a3
        - parameters->K_v_v_arm_roll * v_arm_roll_hat);
    const double z_v_elbow_pitch_next = state->z_v_elbow_pitch + parameters->sample_time * (a4
        - parameters->K_v_v_elbow_pitch * v_elbow_pitch_hat);
    const double z_v_forearm_roll_next = state->z_v_forearm_roll + parameters->sample_time * (a5
        - parameters->K_v_v_forearm_roll * v_forearm_roll_hat);
    const double z_v_wrist_pitch_next = state->z_v_wrist_pitch + parameters->sample_time * (a6
        - parameters->K_v_v_wrist_pitch * v_wrist_pitch_hat);
    const double z_v_hand_roll_next = state->z_v_hand_roll + parameters->sample_time * (a7
        - parameters->K_v_v_hand_roll * v_hand_roll_hat);
    const double z_shoulder_yaw_next = state->z_shoulder_yaw - parameters->h_K_2_shoulder_yaw
        * v_shoulder_yaw_dot_hat;
    const double z_shoulder_pitch_next = state->z_shoulder_pitch - parameters->h_K_2_shoulder_pitch * a2;
    const double z_arm_roll_next = state->z_arm_roll - parameters->h_K_2_arm_roll * a3;
    const double z_elbow_pitch_next = state->z_elbow_pitch - parameters->h_K_2_elbow_pitch * a4;
    const double z_forearm_roll_next = state->z_forearm_roll - parameters->h_K_2_forearm_roll * a5;
    const double z_wrist_pitch_next = state->z_wrist_pitch - parameters->h_K_2_wrist_pitch * a6;
    const double z_hand_roll_next = state->z_hand_roll - parameters->h_K_2_hand_roll * a7;

    /* this sum is too large or NaN if a next state is, or an input or output on which no next state depends */
    const double check = z_v_shoulder_yaw_next + z_v_shoulder_pitch_next + z_v_arm_roll_next
        + z_v_elbow_pitch_next + z_v_forearm_roll_next + z_v_wrist_pitch_next + z_v_hand_roll_next
        + z_shoulder_yaw_next + z_shoulder_pitch_next + z_arm_roll_next + z_elbow_pitch_next
        + z_forearm_roll_next + z_wrist_pitch_next + z_hand_roll_next;
    if (fabs(check) <= 1e+150 && state->mode == SEVEN_JOINT_ARM_RUNNING) {
        outputs->v_shoulder_yaw_hat = v_shoulder_yaw_hat;
        outputs->v_shoulder_pitch_hat = v_shoulder_pitch_hat;
        outputs->v_arm_roll_hat = v_arm_roll_hat;
        outputs->v_elbow_pitch_hat = v_elbow_pitch_hat;
        outputs->v_forearm_roll_hat = v_forearm_roll_hat;
        outputs->v_wrist_pitch_hat = v_wrist_pitch_hat;
        outputs->v_hand_roll_hat = v_hand_roll_hat;
        outputs->tracked_shoulder_yaw = tracked_shoulder_yaw;
        outputs->tracked_shoulder_pitch = tracked_shoulder_pitch;
        outputs->tracked_arm_roll = tracked_arm_roll;
        outputs->tracked_elbow_pitch = tracked_elbow_pitch;
        outputs->tracked_forearm_roll = tracked_forearm_roll;
        outputs->tracked_wrist_pitch = tracked_wrist_pitch;
        outputs->tracked_hand_roll = tracked_hand_roll;
        outputs->F_hat_on_shoulder_yaw = F_hat_on_shoulder_yaw;
        outputs->F_hat_on_shoulder_pitch = F_hat_on_shoulder_pitch;
        outputs->F_hat_on_arm_roll = F_hat_on_arm_roll;
        outputs->F_hat_on_elbow_pitch = F_hat_on_elbow_pitch;
        outputs->F_hat_on_forearm_roll = F_hat_on_forearm_roll;
        outputs->F_hat_on_wrist_pitch = F_hat_on_wrist_pitch;
        outputs->F_hat_on_hand_roll = F_hat_on_hand_roll;

        state->z_v_shoulder_yaw = z_v_shoulder_yaw_next;
        state->z_v_shoulder_pitch = z_v_shoulder_pitch_next;
        state->z_v_arm_roll = z_v_arm_roll_next;
        state->z_v_elbow_pitch = z_v_elbow_pitch_next;
        state->z_v_forearm_roll = z_v_forearm_roll_next;
        state->z_v_wrist_pitch = z_v_wrist_pitch_next;
        state->z_v_hand_roll = z_v_hand_roll_next;
        state->z_shoulder_yaw = z_shoulder_yaw_next;
        state->z_shoulder_pitch = z_shoulder_pitch_next;
        state->z_arm_roll = z_arm_roll_next;
        state->z_elbow_pitch = z_elbow_pitch_next;
        state->z_forearm_roll = z_forearm_roll_next;
        state->z_wrist_pitch = z_wrist_pitch_next;
        state->z_hand_roll = z_hand_roll_next;
        outputs->fault = 0;
    } else {
        seven_joint_arm_handle_fault(state, parameters, inputs, outputs);
    }
}
