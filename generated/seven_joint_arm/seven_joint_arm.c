/*
 * seven_joint_arm: friction observer GTO, velocity estimated, double precision.
 * A step: 881 additions, 1089 multiplications, 7 divisions, 12 calls, 0 of sign or magnitude.
 *
 * Made by stiction 0.1.0 from seven_joint_arm.yaml
 * sha256 52b7fc24362cad8069841d41e04e6920488a5d21d83ed6b1e517ee0008775850
 * with: stiction generate seven_joint_arm.yaml
 */
#include "seven_joint_arm.h"

#include <float.h>
#include <math.h>

#if defined(__clang__)
#pragma STDC FP_CONTRACT OFF
#endif

void seven_joint_arm_prepare(seven_joint_arm_parameters *parameters)
{
    parameters->h_K_1_shoulder_yaw = parameters->sample_time * parameters->K_1_shoulder_yaw;
    parameters->h_K_2_shoulder_yaw = parameters->sample_time * parameters->K_2_shoulder_yaw;
    parameters->h_K_1_shoulder_pitch = parameters->sample_time * parameters->K_1_shoulder_pitch;
    parameters->h_K_2_shoulder_pitch = parameters->sample_time * parameters->K_2_shoulder_pitch;
    parameters->h_K_1_arm_roll = parameters->sample_time * parameters->K_1_arm_roll;
    parameters->h_K_2_arm_roll = parameters->sample_time * parameters->K_2_arm_roll;
    parameters->h_K_1_elbow_pitch = parameters->sample_time * parameters->K_1_elbow_pitch;
    parameters->h_K_2_elbow_pitch = parameters->sample_time * parameters->K_2_elbow_pitch;
    parameters->h_K_1_forearm_roll = parameters->sample_time * parameters->K_1_forearm_roll;
    parameters->h_K_2_forearm_roll = parameters->sample_time * parameters->K_2_forearm_roll;
    parameters->h_K_1_wrist_pitch = parameters->sample_time * parameters->K_1_wrist_pitch;
    parameters->h_K_2_wrist_pitch = parameters->sample_time * parameters->K_2_wrist_pitch;
    parameters->h_K_1_hand_roll = parameters->sample_time * parameters->K_1_hand_roll;
    parameters->h_K_2_hand_roll = parameters->sample_time * parameters->K_2_hand_roll;
}

void seven_joint_arm_init(seven_joint_arm_state *state, const seven_joint_arm_parameters *parameters,
    const seven_joint_arm_inputs *inputs)
{
    /* from rest at zero if the first sample is not finite */
    const double check = inputs->shoulder_yaw + inputs->shoulder_pitch + inputs->arm_roll + inputs->elbow_pitch
        + inputs->forearm_roll + inputs->wrist_pitch + inputs->hand_roll;
    const int finite = fabs(check) <= DBL_MAX;
    const double shoulder_yaw = finite ? inputs->shoulder_yaw : 0.0;
    const double shoulder_pitch = finite ? inputs->shoulder_pitch : 0.0;
    const double arm_roll = finite ? inputs->arm_roll : 0.0;
    const double elbow_pitch = finite ? inputs->elbow_pitch : 0.0;
    const double forearm_roll = finite ? inputs->forearm_roll : 0.0;
    const double wrist_pitch = finite ? inputs->wrist_pitch : 0.0;
    const double hand_roll = finite ? inputs->hand_roll : 0.0;

    state->z_v_shoulder_yaw = -(parameters->K_v_v_shoulder_yaw * shoulder_yaw);
    state->z_v_shoulder_pitch = -(parameters->K_v_v_shoulder_pitch * shoulder_pitch);
    state->z_v_arm_roll = -(parameters->K_v_v_arm_roll * arm_roll);
    state->z_v_elbow_pitch = -(parameters->K_v_v_elbow_pitch * elbow_pitch);
    state->z_v_forearm_roll = -(parameters->K_v_v_forearm_roll * forearm_roll);
    state->z_v_wrist_pitch = -(parameters->K_v_v_wrist_pitch * wrist_pitch);
    state->z_v_hand_roll = -(parameters->K_v_v_hand_roll * hand_roll);
    state->z_shoulder_yaw = -(parameters->K_1_shoulder_yaw * shoulder_yaw);
    state->z_shoulder_pitch = -(parameters->K_1_shoulder_pitch * shoulder_pitch);
    state->z_arm_roll = -(parameters->K_1_arm_roll * arm_roll);
    state->z_elbow_pitch = -(parameters->K_1_elbow_pitch * elbow_pitch);
    state->z_forearm_roll = -(parameters->K_1_forearm_roll * forearm_roll);
    state->z_wrist_pitch = -(parameters->K_1_wrist_pitch * wrist_pitch);
    state->z_hand_roll = -(parameters->K_1_hand_roll * hand_roll);
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
    const double tracked_shoulder_yaw = state->z_shoulder_yaw + parameters->K_1_shoulder_yaw
        * inputs->shoulder_yaw + parameters->K_2_shoulder_yaw * v_shoulder_yaw_hat; /* N*m */
    const double tracked_shoulder_pitch = state->z_shoulder_pitch + parameters->K_1_shoulder_pitch
        * inputs->shoulder_pitch + parameters->K_2_shoulder_pitch * v_shoulder_pitch_hat; /* N*m */
    const double tracked_arm_roll = state->z_arm_roll + parameters->K_1_arm_roll * inputs->arm_roll
        + parameters->K_2_arm_roll * v_arm_roll_hat; /* N*m */
    const double tracked_elbow_pitch = state->z_elbow_pitch + parameters->K_1_elbow_pitch * inputs->elbow_pitch
        + parameters->K_2_elbow_pitch * v_elbow_pitch_hat; /* N*m */
    const double tracked_forearm_roll = state->z_forearm_roll + parameters->K_1_forearm_roll
        * inputs->forearm_roll + parameters->K_2_forearm_roll * v_forearm_roll_hat; /* N*m */
    const double tracked_wrist_pitch = state->z_wrist_pitch + parameters->K_1_wrist_pitch * inputs->wrist_pitch
        + parameters->K_2_wrist_pitch * v_wrist_pitch_hat; /* N*m */
    const double tracked_hand_roll = state->z_hand_roll + parameters->K_1_hand_roll * inputs->hand_roll
        + parameters->K_2_hand_roll * v_hand_roll_hat; /* N*m */

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
    const double sin_shoulder_pitch = sin(inputs->shoulder_pitch);
    const double cos_shoulder_pitch = cos(inputs->shoulder_pitch);
    const double cos_arm_roll = cos(inputs->arm_roll);
    const double sin_arm_roll = sin(inputs->arm_roll);
    const double acceleration_1 = 9.81 * sin_shoulder_pitch;
    const double cos_elbow_pitch = cos(inputs->elbow_pitch);
    const double sin_elbow_pitch = sin(inputs->elbow_pitch);
    const double acceleration_2 = 9.81 * cos_shoulder_pitch;
    const double cos_forearm_roll = cos(inputs->forearm_roll);
    const double sin_forearm_roll = sin(inputs->forearm_roll);
    const double cos_wrist_pitch = cos(inputs->wrist_pitch);
    const double sin_wrist_pitch = sin(inputs->wrist_pitch);
    const double cos_hand_roll = cos(inputs->hand_roll);
    const double acceleration_3 = 0.9950041652780258 * cos_hand_roll;
    const double acceleration_4 = 0.09983341664682815 * cos_hand_roll;
    const double sin_hand_roll = sin(inputs->hand_roll);
    const double acceleration_5 = 0.09983341664682815 * sin_hand_roll;
    const double acceleration_6 = 0.9950041652780258 * sin_hand_roll;
    const double acceleration_7 = 0.0170088 * sin_hand_roll + 0.00028 * cos_hand_roll;
    const double acceleration_8 = 0.0002799999999999998 * sin_hand_roll + 0.0169318 * cos_hand_roll;
    const double acceleration_9 = v_shoulder_yaw_hat * sin_shoulder_pitch;
    const double acceleration_10 = v_shoulder_pitch_hat * acceleration_9;
    const double acceleration_11 = v_shoulder_yaw_hat * cos_shoulder_pitch;
    const double acceleration_12 = v_shoulder_pitch_hat * acceleration_11;
    const double acceleration_13 = 0.0816141 * v_shoulder_pitch_hat - 0.00011800000000000001 * acceleration_9
        - 0.01112 * acceleration_11;
    const double acceleration_14 = 0.01112 * v_shoulder_pitch_hat - 5.099999999999994e-05 * acceleration_9
        - 0.0126441 * acceleration_11;
    const double acceleration_15 = sin_arm_roll * acceleration_9 + v_shoulder_pitch_hat * cos_arm_roll;
    const double acceleration_16 = v_arm_roll_hat * acceleration_15 - cos_arm_roll * acceleration_12;
    const double acceleration_17 = v_shoulder_pitch_hat * sin_arm_roll - cos_arm_roll * acceleration_9;
    const double acceleration_18 = sin_arm_roll * acceleration_12 - v_arm_roll_hat * acceleration_17;
    const double acceleration_19 = cos_arm_roll * -(0.39 * v_shoulder_pitch_hat) + sin_arm_roll * -(0.39
        * acceleration_9);
    const double acceleration_20 = sin_arm_roll * acceleration_1 - cos_arm_roll * -(0.39 * acceleration_12)
        + v_arm_roll_hat * acceleration_19;
    const double acceleration_21 = acceleration_11 + v_arm_roll_hat;
    const double acceleration_22 = sin_arm_roll * -(0.39 * v_shoulder_pitch_hat) - cos_arm_roll * -(0.39
        * acceleration_9);
    const double acceleration_23 = 0.001368 * acceleration_17 + 0.005310000000000001 * acceleration_15
        + 0.0118396 * acceleration_21 + 0.012400000000000001 * acceleration_22 + 0.093 * acceleration_19;
    const double acceleration_24 = 0.0342396 * acceleration_15 - 7.200000000000007e-05 * acceleration_17
        + 0.005310000000000001 * acceleration_21 + 0.21700000000000003 * acceleration_19;
    const double acceleration_25 = 0.012400000000000001 * acceleration_15 - 0.093 * acceleration_17;
    const double acceleration_26 = cos_elbow_pitch * acceleration_21 - sin_elbow_pitch * acceleration_17;
    const double acceleration_27 = cos_elbow_pitch * acceleration_16 - sin_elbow_pitch * acceleration_10
        + v_elbow_pitch_hat * acceleration_26;
    const double acceleration_28 = cos_elbow_pitch * acceleration_17 + sin_elbow_pitch * acceleration_21;
    const double acceleration_29 = sin_elbow_pitch * acceleration_16 + cos_elbow_pitch * acceleration_10
        + v_elbow_pitch_hat * acceleration_28;
    const double acceleration_30 = acceleration_20 - 0.02 * acceleration_16;
    const double acceleration_31 = v_arm_roll_hat * acceleration_22 - cos_arm_roll * acceleration_1
        - sin_arm_roll * -(0.39 * acceleration_12);
    const double acceleration_32 = acceleration_31 + 0.02 * acceleration_18;
    const double acceleration_33 = 0.02 * acceleration_15 - acceleration_19;
    const double acceleration_34 = cos_elbow_pitch * acceleration_33;
    const double acceleration_35 = cos_elbow_pitch * acceleration_2 - sin_elbow_pitch * acceleration_32
        - v_elbow_pitch_hat * acceleration_34;
    const double acceleration_36 = v_elbow_pitch_hat - acceleration_15;
    const double acceleration_37 = sin_elbow_pitch * acceleration_33;
    const double acceleration_38 = 0.0490261 * acceleration_36 - 0.00013900000000000007 * acceleration_28
        - 0.010199999999999999 * acceleration_26 - 0.29 * acceleration_34 + 0.0087 * acceleration_37;
    const double acceleration_39 = acceleration_22 - 0.02 * acceleration_17;
    const double acceleration_40 = 0.00107 * acceleration_28 + 0.010636099999999996 * acceleration_26
        - 0.010199999999999999 * acceleration_36 + 0.087 * acceleration_34 - 0.0087 * acceleration_39;
    const double acceleration_41 = 2.9 * acceleration_39 - 0.0087 * acceleration_26 - 0.29 * acceleration_28;
    const double acceleration_42 = 2.9 * acceleration_37 + 0.087 * acceleration_28 + 0.0087 * acceleration_36;
    const double acceleration_43 = sin_forearm_roll * acceleration_28 + cos_forearm_roll * acceleration_36;
    const double acceleration_44 = cos_forearm_roll * acceleration_27 + sin_forearm_roll * acceleration_18
        - v_forearm_roll_hat * acceleration_43;
    const double acceleration_45 = cos_forearm_roll * acceleration_28 - sin_forearm_roll * acceleration_36;
    const double acceleration_46 = cos_forearm_roll * acceleration_18 - sin_forearm_roll * acceleration_27
        - v_forearm_roll_hat * acceleration_45;
    const double acceleration_47 = cos_elbow_pitch * acceleration_32 + sin_elbow_pitch * acceleration_2
        - v_elbow_pitch_hat * acceleration_37;
    const double acceleration_48 = acceleration_47 + 0.37 * acceleration_18;
    const double acceleration_49 = 0.37 * acceleration_27 - acceleration_30;
    const double acceleration_50 = acceleration_34 - 0.37 * acceleration_36;
    const double acceleration_51 = 0.37 * acceleration_28 - acceleration_39;
    const double acceleration_52 = cos_forearm_roll * acceleration_50 - sin_forearm_roll * acceleration_51;
    const double acceleration_53 = sin_forearm_roll * acceleration_48 + cos_forearm_roll * acceleration_49
        + v_forearm_roll_hat * acceleration_52;
    const double acceleration_54 = acceleration_26 + v_forearm_roll_hat;
    const double acceleration_55 = sin_forearm_roll * acceleration_50 + cos_forearm_roll * acceleration_51;
    const double acceleration_56 = 0.00033200000000000005 * acceleration_45 - 0.0035399999999999997
        * acceleration_43 + 0.005882199999999999 * acceleration_54 - 0.0022 * acceleration_55
        - 0.044000000000000004 * acceleration_52;
    const double acceleration_57 = 0.0035399999999999997 * acceleration_54 - 0.000144 * acceleration_45
        - 0.0189222 * acceleration_43 + 0.0022 * acceleration_37 - 0.132 * acceleration_52;
    const double acceleration_58 = 0.0022 * acceleration_43 + 0.044000000000000004 * acceleration_45 - 2.2
        * acceleration_37;
    const double acceleration_59 = 2.2 * acceleration_55 - 0.132 * acceleration_45 - 0.0022 * acceleration_54;
    const double acceleration_60 = sin_wrist_pitch * acceleration_45 + cos_wrist_pitch * acceleration_54;
    const double acceleration_61 = cos_wrist_pitch * acceleration_44 + sin_wrist_pitch * acceleration_29
        - v_wrist_pitch_hat * acceleration_60;
    const double acceleration_62 = cos_wrist_pitch * acceleration_45 - sin_wrist_pitch * acceleration_54;
    const double acceleration_63 = cos_wrist_pitch * acceleration_29 - sin_wrist_pitch * acceleration_44
        - v_wrist_pitch_hat * acceleration_62;
    const double acceleration_64 = cos_forearm_roll * acceleration_48 - sin_forearm_roll * acceleration_49
        - v_forearm_roll_hat * acceleration_55;
    const double acceleration_65 = acceleration_64 + 0.02 * acceleration_46;
    const double acceleration_66 = acceleration_52 - 0.02 * acceleration_43;
    const double acceleration_67 = cos_wrist_pitch * acceleration_66 + sin_wrist_pitch * acceleration_37;
    const double acceleration_68 = sin_wrist_pitch * acceleration_65 + cos_wrist_pitch * acceleration_35
        + v_wrist_pitch_hat * acceleration_67;
    const double acceleration_69 = acceleration_53 + 0.02 * acceleration_44;
    const double acceleration_70 = cos_wrist_pitch * acceleration_37 - sin_wrist_pitch * acceleration_66;
    const double acceleration_71 = acceleration_55 + 0.02 * acceleration_45;
    const double acceleration_72 = 0.0034 * acceleration_60 - 0.068 * acceleration_62 - 1.7 * acceleration_71;
    const double acceleration_73 = v_wrist_pitch_hat - acceleration_43;
    const double acceleration_74 = 1.7 * acceleration_70 - 0.0085 * acceleration_62 + 0.0034 * acceleration_73;
    const double acceleration_75 = 8.300000000000001e-05 * acceleration_62 - 0.00074 * acceleration_60
        + 0.0078268 * acceleration_73 + 0.0034 * acceleration_70 + 0.068 * acceleration_67;
    const double acceleration_76 = 0.000236 * acceleration_62 - 0.0038493000000000004 * acceleration_60
        + 0.00074 * acceleration_73 + 0.0085 * acceleration_67 + 0.0034 * acceleration_71;
    const double acceleration_77 = acceleration_5 * acceleration_60 - acceleration_6 * acceleration_62
        + cos_hand_roll * acceleration_73;
    const double acceleration_78 = acceleration_3 * acceleration_61 + acceleration_4 * acceleration_63
        + sin_hand_roll * acceleration_46 + v_hand_roll_hat * acceleration_77;
    const double acceleration_79 = acceleration_3 * acceleration_62 - acceleration_4 * acceleration_60
        + sin_hand_roll * acceleration_73;
    const double acceleration_80 = cos_hand_roll * acceleration_46 - acceleration_6 * acceleration_61
        - acceleration_5 * acceleration_63 - v_hand_roll_hat * acceleration_79;
    const double acceleration_81 = 0.09983341664682815 * acceleration_61 - 0.9950041652780258 * acceleration_63;
    const double acceleration_82 = cos_wrist_pitch * acceleration_65 - sin_wrist_pitch * acceleration_35
        + v_wrist_pitch_hat * acceleration_70;
    const double acceleration_83 = acceleration_82 + 0.06 * acceleration_46;
    const double acceleration_84 = 0.05 * acceleration_46 - acceleration_68;
    const double acceleration_85 = 0.09983341664682815 * acceleration_83 - 0.9950041652780258 * acceleration_84;
    const double acceleration_86 = acceleration_69 + 0.05 * acceleration_63 + 0.06 * acceleration_61;
    const double acceleration_87 = acceleration_67 + 0.06 * acceleration_73;
    const double acceleration_88 = acceleration_70 + 0.05 * acceleration_73;
    const double acceleration_89 = 0.05 * acceleration_60 - 0.06 * acceleration_62 - acceleration_71;
    const double acceleration_90 = acceleration_3 * acceleration_87 + acceleration_4 * acceleration_88
        + sin_hand_roll * acceleration_89;
    const double acceleration_91 = acceleration_6 * acceleration_83 + acceleration_5 * acceleration_84
        + cos_hand_roll * acceleration_86 + v_hand_roll_hat * acceleration_90;
    const double acceleration_92 = 0.09983341664682815 * acceleration_62 + 0.9950041652780258 * acceleration_60
        + v_hand_roll_hat;
    const double acceleration_93 = cos_hand_roll * acceleration_89 - acceleration_6 * acceleration_87
        - acceleration_5 * acceleration_88;
    const double acceleration_94 = 0.00019601428534987285 * acceleration_79 - 0.0002340142853498729
        * acceleration_77 + 0.0020205999999999987 * acceleration_92 - 0.0004627416997969522 * acceleration_93
        - 0.0010627416997969527 * acceleration_90;
    const double acceleration_95 = 0.09983341664682815 * acceleration_87 - 0.9950041652780258 * acceleration_88;
    const double acceleration_96 = 0.00028 * acceleration_79 + 0.0169318 * acceleration_77
        - 0.0002340142853498729 * acceleration_92 + 0.12200000000000001 * acceleration_90
        + 0.0004627416997969522 * acceleration_95;
    const double acceleration_97 = 1.4 * acceleration_95 + 0.0004627416997969522 * acceleration_77
        + 0.0010627416997969527 * acceleration_79;
    const double acceleration_98 = 1.4 * acceleration_93 - 0.12200000000000001 * acceleration_79
        - 0.0004627416997969522 * acceleration_92;
    const double acceleration_99 = 0.0170088 * acceleration_78 + 0.0002799999999999998 * acceleration_80
        + 0.00019601428534987285 * acceleration_81 + 0.0010627416997969527 * acceleration_85
        + 0.12200000000000001 * acceleration_91 + acceleration_77 * acceleration_94 - acceleration_92
        * acceleration_96 + acceleration_93 * acceleration_97 - acceleration_95 * acceleration_98;
    const double acceleration_100 = acceleration_3 * acceleration_83 + acceleration_4 * acceleration_84
        - sin_hand_roll * acceleration_86 + v_hand_roll_hat * acceleration_93;
    const double acceleration_101 = 0.0170088 * acceleration_79 + 0.0002799999999999998 * acceleration_77
        + 0.00019601428534987285 * acceleration_92 + 0.0010627416997969527 * acceleration_95
        - 0.12200000000000001 * acceleration_93;
    const double acceleration_102 = 1.4 * acceleration_90 - 0.0010627416997969527 * acceleration_92
        + 0.12200000000000001 * acceleration_77;
    const double acceleration_103 = 0.00028 * acceleration_78 + 0.0169318 * acceleration_80
        - 0.0002340142853498729 * acceleration_81 + 0.12200000000000001 * acceleration_100
        + 0.0004627416997969522 * acceleration_85 + acceleration_92 * acceleration_101 - acceleration_79
        * acceleration_94 + acceleration_95 * acceleration_102 - acceleration_90 * acceleration_97;
    const double acceleration_104 = 0.00019601428534987285 * acceleration_78 - 0.0002340142853498729
        * acceleration_80 + 0.0020205999999999987 * acceleration_81 - 0.0010627416997969527 * acceleration_100
        + 0.0004627416997969522 * acceleration_91 + acceleration_79 * acceleration_96 - acceleration_77
        * acceleration_101 + acceleration_90 * acceleration_98 - acceleration_93 * acceleration_102;
    const double acceleration_105 = 1.4 * acceleration_100 - 0.0010627416997969527 * acceleration_81
        + 0.12200000000000001 * acceleration_80 + acceleration_77 * acceleration_97 - acceleration_92
        * acceleration_98;
    const double acceleration_106 = acceleration_92 * acceleration_102 - acceleration_79 * acceleration_97 - 1.4
        * acceleration_91 - 0.12200000000000001 * acceleration_78 - 0.0004627416997969522 * acceleration_81;
    const double acceleration_107 = sin_hand_roll * acceleration_105 + cos_hand_roll * acceleration_106;
    const double acceleration_108 = 0.0089625 * acceleration_61 + 0.000236 * acceleration_63
        + 8.300000000000001e-05 * acceleration_46 + 0.0085 * acceleration_68 + 0.068 * acceleration_69
        + acceleration_70 * acceleration_72 + acceleration_71 * acceleration_74 - acceleration_60
        * acceleration_75 - acceleration_73 * acceleration_76 + acceleration_3 * acceleration_99
        - acceleration_6 * acceleration_103 + 0.09983341664682815 * acceleration_104 - 0.06 * acceleration_107;
    const double acceleration_109 = 0.0089625 * acceleration_62 - 0.000236 * acceleration_60
        + 8.300000000000001e-05 * acceleration_73 - 0.0085 * acceleration_70 + 0.068 * acceleration_71;
    const double acceleration_110 = 1.7 * acceleration_67 - 0.0085 * acceleration_60 + 0.068 * acceleration_73;
    const double acceleration_111 = 0.000236 * acceleration_61 + 0.0038493000000000004 * acceleration_63
        + 0.00074 * acceleration_46 + 0.0085 * acceleration_82 + 0.0034 * acceleration_69 + acceleration_73
        * acceleration_109 - acceleration_62 * acceleration_75 - acceleration_71 * acceleration_110
        - acceleration_67 * acceleration_72 + acceleration_4 * acceleration_99 - acceleration_5
        * acceleration_103 - 0.9950041652780258 * acceleration_104 - 0.05 * acceleration_107;
    const double acceleration_112 = acceleration_62 * acceleration_74 + acceleration_60 * acceleration_110 - 1.7
        * acceleration_69 - 0.0034 * acceleration_63 - 0.068 * acceleration_61 + acceleration_107;
    const double acceleration_113 = 0.0208 * acceleration_44 - 0.000144 * acceleration_46
        - 0.00033200000000000005 * acceleration_29 + 0.044000000000000004 * acceleration_35 - 0.132
        * acceleration_53 - acceleration_43 * acceleration_56 - acceleration_54 * acceleration_57
        - acceleration_55 * acceleration_58 - acceleration_37 * acceleration_59 + cos_wrist_pitch
        * acceleration_108 - sin_wrist_pitch * acceleration_111 - 0.02 * acceleration_112;
    const double acceleration_114 = 0.0208 * acceleration_45 + 0.000144 * acceleration_43
        + 0.00033200000000000005 * acceleration_54 - 0.132 * acceleration_55 - 0.044000000000000004
        * acceleration_37;
    const double acceleration_115 = 2.2 * acceleration_52 - 0.044000000000000004 * acceleration_54 + 0.132
        * acceleration_43;
    const double acceleration_116 = 1.4 * acceleration_85 + 0.0004627416997969522 * acceleration_80
        + 0.0010627416997969527 * acceleration_78 + acceleration_79 * acceleration_98 - acceleration_77
        * acceleration_102;
    const double acceleration_117 = acceleration_4 * acceleration_105 - acceleration_5 * acceleration_106
        - 0.9950041652780258 * acceleration_116;
    const double acceleration_118 = acceleration_3 * acceleration_105 - acceleration_6 * acceleration_106
        + 0.09983341664682815 * acceleration_116;
    const double acceleration_119 = 8.300000000000001e-05 * acceleration_61 + 0.00074 * acceleration_63
        + 0.0078268 * acceleration_46 - 0.0034 * acceleration_68 + 0.068 * acceleration_82 + acceleration_62
        * acceleration_76 + acceleration_60 * acceleration_109 + acceleration_67 * acceleration_74
        - acceleration_70 * acceleration_110 + sin_hand_roll * acceleration_99 + cos_hand_roll
        * acceleration_103 + 0.05 * acceleration_117 + 0.06 * acceleration_118;
    const double acceleration_120 = 1.7 * acceleration_82 + 0.068 * acceleration_46 + 0.0085 * acceleration_63
        - acceleration_60 * acceleration_72 - acceleration_73 * acceleration_74 + acceleration_118;
    const double acceleration_121 = acceleration_73 * acceleration_110 - acceleration_62 * acceleration_72 - 1.7
        * acceleration_68 - 0.0085 * acceleration_61 + 0.0034 * acceleration_46 + acceleration_117;
    const double acceleration_122 = cos_wrist_pitch * acceleration_120 - sin_wrist_pitch * acceleration_121;
    const double acceleration_123 = 0.0189222 * acceleration_46 - 0.000144 * acceleration_44
        - 0.0035399999999999997 * acceleration_29 - 0.132 * acceleration_64 - 0.0022 * acceleration_35
        + acceleration_54 * acceleration_114 - acceleration_45 * acceleration_56 - acceleration_37
        * acceleration_115 - acceleration_52 * acceleration_58 + acceleration_119 + 0.02 * acceleration_122;
    const double acceleration_124 = 2.2 * acceleration_64 + 0.044000000000000004 * acceleration_29 - 0.132
        * acceleration_46 + acceleration_54 * acceleration_59 - acceleration_43 * acceleration_58
        + acceleration_122;
    const double acceleration_125 = acceleration_54 * acceleration_115 - acceleration_45 * acceleration_58 - 2.2
        * acceleration_53 - 0.0022 * acceleration_29 + 0.132 * acceleration_44 + acceleration_112;
    const double acceleration_126 = sin_forearm_roll * acceleration_124 + cos_forearm_roll * acceleration_125;
    const double acceleration_127 = 0.05361 * acceleration_27 - 0.00107 * acceleration_29
        + 0.00013900000000000007 * acceleration_18 - 0.29 * acceleration_30 - 0.087 * acceleration_35
        + acceleration_26 * acceleration_38 - acceleration_36 * acceleration_40 + acceleration_37
        * acceleration_41 - acceleration_39 * acceleration_42 + cos_forearm_roll * acceleration_113
        - sin_forearm_roll * acceleration_123 - 0.37 * acceleration_126;
    const double acceleration_128 = 0.05361 * acceleration_28 + 0.00107 * acceleration_26
        - 0.00013900000000000007 * acceleration_36 + 0.087 * acceleration_37 - 0.29 * acceleration_39;
    const double acceleration_129 = 2.9 * acceleration_34 - 0.29 * acceleration_36 + 0.087 * acceleration_26;
    const double acceleration_130 = 0.00033200000000000005 * acceleration_44 + 0.0035399999999999997
        * acceleration_46 - 0.005882199999999999 * acceleration_29 - 0.0022 * acceleration_53
        - 0.044000000000000004 * acceleration_64 + acceleration_45 * acceleration_57 + acceleration_43
        * acceleration_114 + acceleration_55 * acceleration_115 - acceleration_52 * acceleration_59
        - sin_wrist_pitch * acceleration_108 - cos_wrist_pitch * acceleration_111;
    const double acceleration_131 = 0.00107 * acceleration_27 - 0.010636099999999996 * acceleration_29
        + 0.010199999999999999 * acceleration_18 + 0.087 * acceleration_47 - 0.0087 * acceleration_30
        + acceleration_36 * acceleration_128 - acceleration_28 * acceleration_38 + acceleration_34
        * acceleration_41 - acceleration_39 * acceleration_129 + acceleration_130;
    const double acceleration_132 = 0.29 * acceleration_27 - 0.0087 * acceleration_29 - 2.9 * acceleration_30
        - acceleration_28 * acceleration_42 - acceleration_26 * acceleration_129 - acceleration_126;
    const double acceleration_133 = 0.03898 * acceleration_16 - 7.200000000000007e-05 * acceleration_18
        - 0.001368 * acceleration_10 + 0.9123300000000001 * cos_shoulder_pitch + 0.21700000000000003
        * acceleration_20 + acceleration_15 * acceleration_23 - acceleration_21 * acceleration_24
        - acceleration_22 * acceleration_25 + cos_elbow_pitch * acceleration_127 - sin_elbow_pitch
        * acceleration_131 + 0.02 * acceleration_132;
    const double acceleration_134 = 0.03898 * acceleration_17 - 7.200000000000007e-05 * acceleration_15
        + 0.001368 * acceleration_21 + 0.21700000000000003 * acceleration_22;
    const double acceleration_135 = cos_forearm_roll * acceleration_124 - sin_forearm_roll * acceleration_125;
    const double acceleration_136 = cos_elbow_pitch * (2.9 * acceleration_47 - 0.087 * acceleration_29 + 0.29
        * acceleration_18 + acceleration_36 * acceleration_42 - acceleration_26 * acceleration_41
        + acceleration_135) - sin_elbow_pitch * (5.1 * acceleration_35 - 0.087 * acceleration_27 + 0.0087
        * acceleration_18 + acceleration_36 * acceleration_129 + acceleration_28 * acceleration_41 - 0.0022
        * acceleration_46 + 0.044000000000000004 * acceleration_44 + acceleration_43 * acceleration_115
        - acceleration_45 * acceleration_59 - sin_wrist_pitch * acceleration_120 - cos_wrist_pitch
        * acceleration_121);
    const double acceleration_137 = 0.010199999999999999 * acceleration_29 - 0.00013900000000000007
        * acceleration_27 - 0.0490261 * acceleration_18 - 0.0087 * acceleration_35 - 0.29 * acceleration_47
        + acceleration_28 * acceleration_40 - acceleration_26 * acceleration_128 + acceleration_37
        * acceleration_129 - acceleration_34 * acceleration_42 - sin_forearm_roll * acceleration_113
        - cos_forearm_roll * acceleration_123 - 0.37 * acceleration_135;
    const double acceleration_138 = 0.0342396 * acceleration_18 - 7.200000000000007e-05 * acceleration_16
        - 0.005310000000000001 * acceleration_10 - 0.21700000000000003 * acceleration_31 - 0.12164400000000002
        * cos_shoulder_pitch + acceleration_21 * acceleration_134 - acceleration_17 * acceleration_23
        - acceleration_19 * acceleration_25 + 0.02 * acceleration_136 - acceleration_137;
    const double acceleration_139 = 3.1 * acceleration_22 + 0.21700000000000003 * acceleration_17
        + 0.012400000000000001 * acceleration_21;
    const double acceleration_140 = 3.1 * acceleration_31 + 0.093 * acceleration_10 - 0.21700000000000003
        * acceleration_18 - acceleration_15 * acceleration_25 - acceleration_21 * acceleration_139
        + acceleration_136;
    const double acceleration_141 = 3.1 * acceleration_19 + 0.093 * acceleration_21 + 0.21700000000000003
        * acceleration_15;
    const double acceleration_142 = 3.1 * acceleration_20 - 0.012400000000000001 * acceleration_10
        + 0.21700000000000003 * acceleration_16 + acceleration_17 * acceleration_25 - acceleration_21
        * acceleration_141 - acceleration_132;
    const double acceleration_143 = 0.00011800000000000001 * v_shoulder_pitch_hat - 0.08524999999999999
        * acceleration_9 - 5.099999999999994e-05 * acceleration_11;
    const double acceleration_144 = 0.001368 * acceleration_16 + 0.005310000000000001 * acceleration_18
        - 0.0118396 * acceleration_10 + 0.012400000000000001 * acceleration_20 - 0.093 * acceleration_31
        + acceleration_17 * acceleration_24 - acceleration_15 * acceleration_134 + acceleration_22
        * acceleration_141 - acceleration_19 * acceleration_139 + sin_elbow_pitch * acceleration_127
        + cos_elbow_pitch * acceleration_131;
    const double acceleration_145 = inputs->w_shoulder_yaw - F_hat_on_shoulder_yaw + sin_shoulder_pitch
        * (5.099999999999994e-05 * acceleration_10 - 0.08524999999999999 * acceleration_12 + 0.8044199999999999
        * cos_shoulder_pitch - acceleration_11 * acceleration_13 - v_shoulder_pitch_hat * acceleration_14
        + cos_arm_roll * acceleration_133 - sin_arm_roll * acceleration_138 - 0.39 * (sin_arm_roll
        * acceleration_140 + cos_arm_roll * acceleration_142)) + cos_shoulder_pitch * (0.0126441
        * acceleration_10 - 5.099999999999994e-05 * acceleration_12 - 0.8044199999999999 * sin_shoulder_pitch
        + v_shoulder_pitch_hat * acceleration_143 + acceleration_9 * acceleration_13 - acceleration_144);
    const double acceleration_146 = 0.016923826846380885 * cos_hand_roll - 0.0002786011662778472 * sin_hand_roll
        + 1.9568775818064122e-05;
    const double acceleration_147 = 0.000278601166277847 * cos_hand_roll - 0.01684721152565448 * sin_hand_roll
        - 2.3362445650643596e-05;
    const double acceleration_148 = 0.000195035030377119 * cos_hand_roll + 0.00023284518865768404
        * sin_hand_roll + 0.00020172340167658084;
    const double acceleration_149 = 0.06 * -(4.61970849156906e-05 * cos_hand_roll + 0.00010609713490378755
        * sin_hand_roll + 0.12139050816391916);
    const double acceleration_150 = -(4.61970849156906e-05 * cos_hand_roll + 0.00010609713490378755
        * sin_hand_roll + 0.12139050816391916) - 0.08399999999999999;
    const double acceleration_151 = 0.06 * acceleration_150;
    const double acceleration_152 = 0.0089625 + acceleration_3 * acceleration_146 - acceleration_6
        * acceleration_147 + 0.09983341664682815 * acceleration_148 - acceleration_149 - acceleration_151;
    const double acceleration_153 = 0.001698046617062571 * cos_hand_roll - 2.795335666111188e-05 * sin_hand_roll
        - 0.000195035030377119;
    const double acceleration_154 = 2.7953356661111864e-05 * cos_hand_roll - 0.001690359443980765
        * sin_hand_roll + 0.00023284518865768404;
    const double acceleration_155 = 1.9568775818064122e-05 * cos_hand_roll + 2.3362445650643596e-05
        * sin_hand_roll - 0.0020105054163607776;
    const double acceleration_156 = 0.012179676830913037 - 0.0004604299187458012 * cos_hand_roll
        - 0.0010574324179126171 * sin_hand_roll;
    const double acceleration_157 = acceleration_156 + 0.06999999999999999;
    const double acceleration_158 = 0.000236 + acceleration_3 * acceleration_153 - acceleration_6
        * acceleration_154 + 0.09983341664682815 * acceleration_155 - 0.05 * -(4.61970849156906e-05
        * cos_hand_roll + 0.00010609713490378755 * sin_hand_roll + 0.12139050816391916) + 0.06
        * acceleration_157;
    const double acceleration_159 = cos_wrist_pitch * acceleration_152 - sin_wrist_pitch * acceleration_158;
    const double acceleration_160 = 0.000236 + acceleration_4 * acceleration_146 - acceleration_5
        * acceleration_147 - 0.9950041652780258 * acceleration_148 + 0.06 * acceleration_156 - 0.05
        * acceleration_150;
    const double acceleration_161 = 0.05 * acceleration_156;
    const double acceleration_162 = 0.05 * acceleration_157;
    const double acceleration_163 = 0.0038493000000000004 + acceleration_4 * acceleration_153 - acceleration_5
        * acceleration_154 - 0.9950041652780258 * acceleration_155 + acceleration_161 + acceleration_162;
    const double acceleration_164 = cos_wrist_pitch * acceleration_160 - sin_wrist_pitch * acceleration_163;
    const double acceleration_165 = 0.0034 + acceleration_157;
    const double acceleration_166 = sin_wrist_pitch * acceleration_165;
    const double acceleration_167 = acceleration_150 - 0.068;
    const double acceleration_168 = cos_wrist_pitch * acceleration_167;
    const double acceleration_169 = acceleration_166 + acceleration_168;
    const double acceleration_170 = 0.02 * acceleration_169;
    const double acceleration_171 = 0.06199999999999999 - acceleration_169;
    const double acceleration_172 = 0.02 * acceleration_171;
    const double acceleration_173 = 0.0208 + cos_wrist_pitch * acceleration_159 - sin_wrist_pitch
        * acceleration_164 - acceleration_170 + acceleration_172;
    const double acceleration_174 = 0.00019601428534987285 * sin_hand_roll - 0.0002340142853498729
        * cos_hand_roll;
    const double acceleration_175 = 0.0010627416997969527 * cos_hand_roll - 0.0004627416997969522
        * sin_hand_roll;
    const double acceleration_176 = 0.05 * acceleration_175;
    const double acceleration_177 = 8.300000000000001e-05 + acceleration_3 * acceleration_7 - acceleration_6
        * acceleration_8 + 0.09983341664682815 * acceleration_174 - acceleration_176;
    const double acceleration_178 = 0.06 * acceleration_175;
    const double acceleration_179 = 0.00074 + acceleration_4 * acceleration_7 - acceleration_5 * acceleration_8
        - 0.9950041652780258 * acceleration_174 + acceleration_178;
    const double acceleration_180 = cos_wrist_pitch * acceleration_177 - 0.000144 - sin_wrist_pitch
        * acceleration_179;
    const double acceleration_181 = cos_forearm_roll * acceleration_173 - sin_forearm_roll * acceleration_180;
    const double acceleration_182 = 8.300000000000001e-05 + sin_hand_roll * acceleration_146 + cos_hand_roll
        * acceleration_147 - acceleration_176;
    const double acceleration_183 = 0.00074 + sin_hand_roll * acceleration_153 + cos_hand_roll
        * acceleration_154 + acceleration_178;
    const double acceleration_184 = cos_wrist_pitch * acceleration_182 - sin_wrist_pitch * acceleration_183;
    const double acceleration_185 = acceleration_184 - 0.000144;
    const double acceleration_186 = 0.0078268 + sin_hand_roll * acceleration_7 + cos_hand_roll * acceleration_8
        - acceleration_149 + acceleration_161 - acceleration_151 + acceleration_162;
    const double acceleration_187 = 0.0189222 + acceleration_186 - acceleration_170 + acceleration_172;
    const double acceleration_188 = cos_forearm_roll * acceleration_185 - sin_forearm_roll * acceleration_187;
    const double acceleration_189 = acceleration_171 - 0.132;
    const double acceleration_190 = 0.37 * acceleration_189;
    const double acceleration_191 = acceleration_189 + 1.9609999999999999;
    const double acceleration_192 = 0.37 * acceleration_191;
    const double acceleration_193 = 0.05361 + cos_forearm_roll * acceleration_181 - sin_forearm_roll
        * acceleration_188 + acceleration_190 + acceleration_192;
    const double acceleration_194 = sin_wrist_pitch * acceleration_160 + cos_wrist_pitch * acceleration_163;
    const double acceleration_195 = sin_wrist_pitch * acceleration_152 + cos_wrist_pitch * acceleration_158;
    const double acceleration_196 = cos_wrist_pitch * acceleration_165;
    const double acceleration_197 = sin_wrist_pitch * acceleration_167;
    const double acceleration_198 = acceleration_196 - acceleration_197;
    const double acceleration_199 = 0.02 * acceleration_198;
    const double acceleration_200 = 0.00033200000000000005 + sin_wrist_pitch * acceleration_194
        - cos_wrist_pitch * acceleration_195 - acceleration_199;
    const double acceleration_201 = 0.0085 + acceleration_175;
    const double acceleration_202 = 0.02 * acceleration_201;
    const double acceleration_203 = sin_wrist_pitch * acceleration_182 + cos_wrist_pitch * acceleration_183;
    const double acceleration_204 = 0.0035399999999999997 - acceleration_202 - acceleration_203;
    const double acceleration_205 = 0.0022 + acceleration_198;
    const double acceleration_206 = cos_forearm_roll * acceleration_205;
    const double acceleration_207 = 0.044000000000000004 + acceleration_201;
    const double acceleration_208 = sin_forearm_roll * acceleration_207;
    const double acceleration_209 = acceleration_206 - acceleration_208;
    const double acceleration_210 = 0.37 * acceleration_209;
    const double acceleration_211 = 0.00107 + cos_forearm_roll * acceleration_200 - sin_forearm_roll
        * acceleration_204 - acceleration_210;
    const double acceleration_212 = cos_elbow_pitch * acceleration_193 - sin_elbow_pitch * acceleration_211;
    const double acceleration_213 = 0.00033200000000000005 - acceleration_199 - sin_wrist_pitch
        * acceleration_159 - cos_wrist_pitch * acceleration_164;
    const double acceleration_214 = 0.0035399999999999997 - sin_wrist_pitch * acceleration_177 - cos_wrist_pitch
        * acceleration_179 - acceleration_202;
    const double acceleration_215 = cos_forearm_roll * acceleration_213 - sin_forearm_roll * acceleration_214;
    const double acceleration_216 = 0.00107 + acceleration_215 - acceleration_210;
    const double acceleration_217 = 0.005882199999999999 + sin_wrist_pitch * acceleration_195 + cos_wrist_pitch
        * acceleration_194;
    const double acceleration_218 = 0.010636099999999996 + acceleration_217;
    const double acceleration_219 = cos_elbow_pitch * acceleration_216 - sin_elbow_pitch * acceleration_218;
    const double acceleration_220 = acceleration_209 - 0.0087;
    const double acceleration_221 = sin_elbow_pitch * acceleration_220;
    const double acceleration_222 = 0.29 + acceleration_191;
    const double acceleration_223 = cos_elbow_pitch * acceleration_222;
    const double acceleration_224 = acceleration_221 + acceleration_223;
    const double acceleration_225 = 0.02 * acceleration_224;
    const double acceleration_226 = acceleration_224 + 0.16399999999999998;
    const double acceleration_227 = 0.02 * acceleration_226;
    const double acceleration_228 = 0.03898 + cos_elbow_pitch * acceleration_212 - sin_elbow_pitch
        * acceleration_219 + acceleration_225 + acceleration_227;
    const double acceleration_229 = sin_forearm_roll * acceleration_213 + cos_forearm_roll * acceleration_214;
    const double acceleration_230 = sin_forearm_roll * acceleration_205;
    const double acceleration_231 = cos_forearm_roll * acceleration_207;
    const double acceleration_232 = acceleration_230 + acceleration_231;
    const double acceleration_233 = 0.37 * acceleration_232;
    const double acceleration_234 = acceleration_233 - 0.010199999999999999 - acceleration_229;
    const double acceleration_235 = sin_forearm_roll * acceleration_185 + cos_forearm_roll * acceleration_187;
    const double acceleration_236 = sin_forearm_roll * acceleration_173 + cos_forearm_roll * acceleration_180;
    const double acceleration_237 = sin_forearm_roll * acceleration_235 - 0.00013900000000000007
        - cos_forearm_roll * acceleration_236;
    const double acceleration_238 = sin_elbow_pitch * acceleration_234 - 7.200000000000007e-05 - cos_elbow_pitch
        * acceleration_237;
    const double acceleration_239 = cos_arm_roll * acceleration_228 - sin_arm_roll * acceleration_238;
    const double acceleration_240 = acceleration_233 - 0.010199999999999999 - sin_forearm_roll
        * acceleration_200 - cos_forearm_roll * acceleration_204;
    const double acceleration_241 = cos_elbow_pitch * -(0.00013900000000000007 + sin_forearm_roll
        * acceleration_181 + cos_forearm_roll * acceleration_188) - sin_elbow_pitch * acceleration_240;
    const double acceleration_242 = 0.0490261 + sin_forearm_roll * acceleration_236 + cos_forearm_roll
        * acceleration_235 + acceleration_190 + acceleration_192;
    const double acceleration_243 = 0.0342396 + acceleration_242 + acceleration_225 + acceleration_227;
    const double acceleration_244 = cos_arm_roll * -(7.200000000000007e-05 + acceleration_241) - sin_arm_roll
        * acceleration_243;
    const double acceleration_245 = acceleration_226 - 0.21700000000000003;
    const double acceleration_246 = 0.39 * acceleration_245;
    const double acceleration_247 = 0.39 * -(4.407 + acceleration_245);
    const double acceleration_248 = sin_elbow_pitch * -(0.00013900000000000007 + sin_forearm_roll
        * acceleration_181 + cos_forearm_roll * acceleration_188) + cos_elbow_pitch * acceleration_240;
    const double acceleration_249 = 0.087 - acceleration_232;
    const double acceleration_250 = 0.02 * acceleration_249;
    const double acceleration_251 = 0.005310000000000001 - acceleration_248 + acceleration_250;
    const double acceleration_252 = sin_elbow_pitch * acceleration_193 + cos_elbow_pitch * acceleration_211;
    const double acceleration_253 = sin_elbow_pitch * acceleration_216 + cos_elbow_pitch * acceleration_218;
    const double acceleration_254 = cos_elbow_pitch * acceleration_220 - sin_elbow_pitch * acceleration_222;
    const double acceleration_255 = 0.02 * acceleration_254;
    const double acceleration_256 = 0.001368 + cos_elbow_pitch * acceleration_252 - sin_elbow_pitch
        * acceleration_253 - acceleration_255;
    const double acceleration_257 = 0.012400000000000001 + acceleration_254;
    const double acceleration_258 = 0.093 - acceleration_249;
    const double acceleration_259 = 0.39 * (cos_arm_roll * acceleration_257 - sin_arm_roll * acceleration_258);
    const double acceleration_260 = 0.001368 + sin_elbow_pitch * acceleration_212 + cos_elbow_pitch
        * acceleration_219 - acceleration_255;
    const double acceleration_261 = 0.005310000000000001 + acceleration_250 - sin_elbow_pitch * acceleration_237
        - cos_elbow_pitch * acceleration_234;
    const double acceleration_262 = cos_arm_roll * acceleration_260 - sin_arm_roll * acceleration_261
        - acceleration_259;
    const double acceleration_263 = 0.0118396 + sin_elbow_pitch * acceleration_252 + cos_elbow_pitch
        * acceleration_253;
    const double acceleration_264 = 0.0157968 + sin_shoulder_pitch * (sin_shoulder_pitch * (0.08524999999999999
        + cos_arm_roll * acceleration_239 - sin_arm_roll * acceleration_244 + acceleration_246
        - acceleration_247) + cos_shoulder_pitch * (5.099999999999994e-05 + sin_arm_roll * acceleration_251
        - cos_arm_roll * acceleration_256 + acceleration_259)) + cos_shoulder_pitch * (sin_shoulder_pitch
        * (5.099999999999994e-05 - acceleration_262) + cos_shoulder_pitch * (0.0126441 + acceleration_263));
    const double one_over_acceleration_264 = 1.0 / acceleration_264;
    const double acceleration_265 = sin_arm_roll * acceleration_257;
    const double acceleration_266 = cos_arm_roll * acceleration_258;
    const double acceleration_267 = one_over_acceleration_264 * (sin_shoulder_pitch * (0.00011800000000000001
        + sin_arm_roll * acceleration_239 + cos_arm_roll * acceleration_244) + cos_shoulder_pitch * (0.01112
        - sin_arm_roll * acceleration_256 - cos_arm_roll * acceleration_251 + 0.39 * (acceleration_265 + acceleration_266)));
    const double acceleration_268 = inputs->w_shoulder_pitch - F_hat_on_shoulder_pitch - 0.01112
        * acceleration_10 + 0.00011800000000000001 * acceleration_12 + 4.42431 * sin_shoulder_pitch + 0.040221
        * cos_shoulder_pitch - acceleration_11 * acceleration_143 + acceleration_9 * acceleration_14
        - sin_arm_roll * acceleration_133 - cos_arm_roll * acceleration_138 - 0.39 * (cos_arm_roll
        * acceleration_140 - sin_arm_roll * acceleration_142) + acceleration_145 * acceleration_267;
    const double acceleration_269 = 0.0816141 + sin_arm_roll * (sin_arm_roll * acceleration_228 + cos_arm_roll
        * acceleration_238) + cos_arm_roll * (sin_arm_roll * -(7.200000000000007e-05 + acceleration_241)
        + cos_arm_roll * acceleration_243) + acceleration_246 - acceleration_247 - acceleration_264
        * acceleration_267 * acceleration_267;
    const double one_over_acceleration_269 = 1.0 / acceleration_269;
    const double acceleration_270 = one_over_acceleration_264 * (cos_shoulder_pitch * acceleration_263
        - sin_shoulder_pitch * acceleration_262);
    const double acceleration_271 = one_over_acceleration_269 * (sin_arm_roll * acceleration_260 + cos_arm_roll
        * acceleration_261 - 0.39 * (acceleration_266 + acceleration_265) + acceleration_264 * acceleration_267
        * acceleration_270);
    const double acceleration_272 = inputs->w_arm_roll - F_hat_on_arm_roll - acceleration_144 - acceleration_145
        * acceleration_270 - acceleration_268 * acceleration_271;
    const double acceleration_273 = acceleration_263 - acceleration_264 * acceleration_270 * acceleration_270
        - acceleration_269 * acceleration_271 * acceleration_271;
    const double one_over_acceleration_273 = 1.0 / acceleration_273;
    const double acceleration_274 = acceleration_223 + acceleration_221;
    const double acceleration_275 = acceleration_242 + 0.02 * acceleration_274 + 0.39 * acceleration_274;
    const double acceleration_276 = one_over_acceleration_264 * (cos_shoulder_pitch * acceleration_248
        - sin_shoulder_pitch * (cos_arm_roll * acceleration_241 + sin_arm_roll * acceleration_275));
    const double acceleration_277 = one_over_acceleration_269 * (sin_arm_roll * acceleration_241 - cos_arm_roll
        * acceleration_275 + acceleration_264 * acceleration_267 * acceleration_276);
    const double acceleration_278 = one_over_acceleration_273 * (acceleration_248 - acceleration_264
        * acceleration_270 * acceleration_276 - acceleration_269 * acceleration_271 * acceleration_277);
    const double acceleration_279 = inputs->w_elbow_pitch - F_hat_on_elbow_pitch - acceleration_137
        - acceleration_145 * acceleration_276 - acceleration_268 * acceleration_277 - acceleration_272
        * acceleration_278;
    const double acceleration_280 = acceleration_242 - acceleration_264 * acceleration_276 * acceleration_276
        - acceleration_269 * acceleration_277 * acceleration_277 - acceleration_273 * acceleration_278
        * acceleration_278;
    const double one_over_acceleration_280 = 1.0 / acceleration_280;
    const double acceleration_281 = acceleration_231 + acceleration_230;
    const double acceleration_282 = 0.37 * acceleration_281 - acceleration_229;
    const double acceleration_283 = acceleration_208 - acceleration_206;
    const double acceleration_284 = acceleration_215 + 0.37 * acceleration_283;
    const double acceleration_285 = sin_elbow_pitch * acceleration_284 + cos_elbow_pitch * acceleration_217;
    const double acceleration_286 = cos_elbow_pitch * acceleration_284 - sin_elbow_pitch * acceleration_217
        + 0.02 * acceleration_283;
    const double acceleration_287 = cos_elbow_pitch * acceleration_281;
    const double acceleration_288 = acceleration_282 + 0.02 * acceleration_287;
    const double acceleration_289 = one_over_acceleration_264 * (cos_shoulder_pitch * acceleration_285
        - sin_shoulder_pitch * (cos_arm_roll * acceleration_286 + sin_arm_roll * acceleration_288 + 0.39
        * (sin_arm_roll * acceleration_287 + cos_arm_roll * acceleration_283)));
    const double acceleration_290 = one_over_acceleration_269 * (sin_arm_roll * acceleration_286 - cos_arm_roll
        * acceleration_288 + 0.39 * (sin_arm_roll * acceleration_283 - cos_arm_roll * acceleration_287)
        + acceleration_264 * acceleration_267 * acceleration_289);
    const double acceleration_291 = one_over_acceleration_273 * (acceleration_285 - acceleration_264
        * acceleration_270 * acceleration_289 - acceleration_269 * acceleration_271 * acceleration_290);
    const double acceleration_292 = one_over_acceleration_280 * (acceleration_282 - acceleration_264
        * acceleration_276 * acceleration_289 - acceleration_269 * acceleration_277 * acceleration_290
        - acceleration_273 * acceleration_278 * acceleration_291);
    const double acceleration_293 = inputs->w_forearm_roll - F_hat_on_forearm_roll - acceleration_130
        - acceleration_145 * acceleration_289 - acceleration_268 * acceleration_290 - acceleration_272
        * acceleration_291 - acceleration_279 * acceleration_292;
    const double acceleration_294 = acceleration_217 - acceleration_264 * acceleration_289 * acceleration_289
        - acceleration_269 * acceleration_290 * acceleration_290 - acceleration_273 * acceleration_291
        * acceleration_291 - acceleration_280 * acceleration_292 * acceleration_292;
    const double one_over_acceleration_294 = 1.0 / acceleration_294;
    const double acceleration_295 = acceleration_168 + acceleration_166;
    const double acceleration_296 = acceleration_186 - 0.02 * acceleration_295;
    const double acceleration_297 = sin_forearm_roll * acceleration_295;
    const double acceleration_298 = cos_forearm_roll * acceleration_184 - sin_forearm_roll * acceleration_296
        + 0.37 * acceleration_297;
    const double acceleration_299 = sin_elbow_pitch * acceleration_298 - cos_elbow_pitch * acceleration_203;
    const double acceleration_300 = cos_elbow_pitch * acceleration_298 + sin_elbow_pitch * acceleration_203
        + 0.02 * acceleration_297;
    const double acceleration_301 = cos_forearm_roll * acceleration_295;
    const double acceleration_302 = 0.37 * acceleration_301 - sin_forearm_roll * acceleration_184
        - cos_forearm_roll * acceleration_296;
    const double acceleration_303 = cos_elbow_pitch * acceleration_301 + sin_elbow_pitch * (acceleration_197
        - acceleration_196);
    const double acceleration_304 = acceleration_302 + 0.02 * acceleration_303;
    const double acceleration_305 = one_over_acceleration_264 * (cos_shoulder_pitch * acceleration_299
        - sin_shoulder_pitch * (cos_arm_roll * acceleration_300 + sin_arm_roll * acceleration_304 + 0.39
        * (sin_arm_roll * acceleration_303 + cos_arm_roll * acceleration_297)));
    const double acceleration_306 = one_over_acceleration_269 * (sin_arm_roll * acceleration_300 - cos_arm_roll
        * acceleration_304 + 0.39 * (sin_arm_roll * acceleration_297 - cos_arm_roll * acceleration_303)
        + acceleration_264 * acceleration_267 * acceleration_305);
    const double acceleration_307 = one_over_acceleration_273 * (acceleration_299 - acceleration_264
        * acceleration_270 * acceleration_305 - acceleration_269 * acceleration_271 * acceleration_306);
    const double acceleration_308 = one_over_acceleration_280 * (acceleration_302 - acceleration_264
        * acceleration_276 * acceleration_305 - acceleration_269 * acceleration_277 * acceleration_306
        - acceleration_273 * acceleration_278 * acceleration_307);
    const double acceleration_309 = one_over_acceleration_294 * (acceleration_203 + acceleration_264
        * acceleration_289 * acceleration_305 + acceleration_269 * acceleration_290 * acceleration_306
        + acceleration_273 * acceleration_291 * acceleration_307 + acceleration_280 * acceleration_292
        * acceleration_308);
    const double acceleration_310 = inputs->w_wrist_pitch - F_hat_on_wrist_pitch - acceleration_119
        - acceleration_145 * acceleration_305 - acceleration_268 * acceleration_306 - acceleration_272
        * acceleration_307 - acceleration_279 * acceleration_308 + acceleration_293 * acceleration_309;
    const double acceleration_311 = acceleration_186 - acceleration_264 * acceleration_305 * acceleration_305
        - acceleration_269 * acceleration_306 * acceleration_306 - acceleration_273 * acceleration_307
        * acceleration_307 - acceleration_280 * acceleration_308 * acceleration_308 - acceleration_294
        * acceleration_309 * acceleration_309;
    const double one_over_acceleration_311 = 1.0 / acceleration_311;
    const double acceleration_312 = 4.61970849156906e-05 * sin_hand_roll - 0.00010609713490378755
        * cos_hand_roll;
    const double acceleration_313 = 0.0004604299187458012 * sin_hand_roll - 0.0010574324179126171
        * cos_hand_roll;
    const double acceleration_314 = acceleration_174 + 0.05 * acceleration_312 + 0.06 * acceleration_313;
    const double acceleration_315 = acceleration_148 - 0.06 * -(0.0010627416997969527 * sin_hand_roll
        + 0.0004627416997969522 * cos_hand_roll);
    const double acceleration_316 = acceleration_155 - 0.05 * -(0.0010627416997969527 * sin_hand_roll
        + 0.0004627416997969522 * cos_hand_roll);
    const double acceleration_317 = cos_wrist_pitch * acceleration_315 - sin_wrist_pitch * acceleration_316
        - 0.02 * -(0.0010627416997969527 * sin_hand_roll + 0.0004627416997969522 * cos_hand_roll);
    const double acceleration_318 = cos_wrist_pitch * acceleration_313 - sin_wrist_pitch * acceleration_312;
    const double acceleration_319 = acceleration_314 + 0.02 * acceleration_318;
    const double acceleration_320 = sin_forearm_roll * acceleration_318 + cos_forearm_roll
        * -(0.0010627416997969527 * sin_hand_roll + 0.0004627416997969522 * cos_hand_roll);
    const double acceleration_321 = cos_forearm_roll * acceleration_317 - sin_forearm_roll * acceleration_319
        - 0.37 * acceleration_320;
    const double acceleration_322 = sin_wrist_pitch * acceleration_315 + cos_wrist_pitch * acceleration_316;
    const double acceleration_323 = sin_elbow_pitch * acceleration_321 - cos_elbow_pitch * acceleration_322;
    const double acceleration_324 = cos_elbow_pitch * acceleration_321 + sin_elbow_pitch * acceleration_322
        - 0.02 * acceleration_320;
    const double acceleration_325 = cos_forearm_roll * acceleration_318 - sin_forearm_roll
        * -(0.0010627416997969527 * sin_hand_roll + 0.0004627416997969522 * cos_hand_roll);
    const double acceleration_326 = sin_forearm_roll * acceleration_317 + cos_forearm_roll * acceleration_319
        + 0.37 * acceleration_325;
    const double acceleration_327 = cos_elbow_pitch * acceleration_325 + sin_elbow_pitch * (sin_wrist_pitch
        * acceleration_313 + cos_wrist_pitch * acceleration_312);
    const double acceleration_328 = acceleration_326 + 0.02 * acceleration_327;
    const double acceleration_329 = one_over_acceleration_264 * (cos_shoulder_pitch * acceleration_323
        - sin_shoulder_pitch * (cos_arm_roll * acceleration_324 - sin_arm_roll * acceleration_328 - 0.39
        * (sin_arm_roll * acceleration_327 + cos_arm_roll * acceleration_320)));
    const double acceleration_330 = one_over_acceleration_269 * (sin_arm_roll * acceleration_324 + cos_arm_roll
        * acceleration_328 + 0.39 * (cos_arm_roll * acceleration_327 - sin_arm_roll * acceleration_320)
        + acceleration_264 * acceleration_267 * acceleration_329);
    const double acceleration_331 = one_over_acceleration_273 * (acceleration_323 - acceleration_264
        * acceleration_270 * acceleration_329 - acceleration_269 * acceleration_271 * acceleration_330);
    const double acceleration_332 = one_over_acceleration_280 * (acceleration_326 + acceleration_264
        * acceleration_276 * acceleration_329 + acceleration_269 * acceleration_277 * acceleration_330
        + acceleration_273 * acceleration_278 * acceleration_331);
    const double acceleration_333 = one_over_acceleration_294 * (acceleration_280 * acceleration_292
        * acceleration_332 - acceleration_322 - acceleration_264 * acceleration_289 * acceleration_329
        - acceleration_269 * acceleration_290 * acceleration_330 - acceleration_273 * acceleration_291
        * acceleration_331);
    const double acceleration_334 = one_over_acceleration_311 * (acceleration_314 - acceleration_264
        * acceleration_305 * acceleration_329 - acceleration_269 * acceleration_306 * acceleration_330
        - acceleration_273 * acceleration_307 * acceleration_331 + acceleration_280 * acceleration_308
        * acceleration_332 + acceleration_294 * acceleration_309 * acceleration_333);
    const double v_hand_roll_dot_hat = (inputs->w_hand_roll - F_hat_on_hand_roll - acceleration_104
        - acceleration_145 * acceleration_329 - acceleration_268 * acceleration_330 - acceleration_272
        * acceleration_331 + acceleration_279 * acceleration_332 - acceleration_293 * acceleration_333
        - acceleration_310 * acceleration_334) / (0.0020206 - acceleration_264 * acceleration_329
        * acceleration_329 - acceleration_269 * acceleration_330 * acceleration_330 - acceleration_273
        * acceleration_331 * acceleration_331 - acceleration_280 * acceleration_332 * acceleration_332
        - acceleration_294 * acceleration_333 * acceleration_333 - acceleration_311 * acceleration_334
        * acceleration_334);
    const double v_wrist_pitch_dot_hat = acceleration_310 * one_over_acceleration_311 - acceleration_334
        * v_hand_roll_dot_hat;
    const double v_forearm_roll_dot_hat = acceleration_293 * one_over_acceleration_294 + acceleration_309
        * v_wrist_pitch_dot_hat - acceleration_333 * v_hand_roll_dot_hat;
    const double v_elbow_pitch_dot_hat = acceleration_279 * one_over_acceleration_280 - acceleration_292
        * v_forearm_roll_dot_hat - acceleration_308 * v_wrist_pitch_dot_hat + acceleration_332
        * v_hand_roll_dot_hat;
    const double v_arm_roll_dot_hat = acceleration_272 * one_over_acceleration_273 - acceleration_278
        * v_elbow_pitch_dot_hat - acceleration_291 * v_forearm_roll_dot_hat - acceleration_307
        * v_wrist_pitch_dot_hat - acceleration_331 * v_hand_roll_dot_hat;
    const double v_shoulder_pitch_dot_hat = acceleration_268 * one_over_acceleration_269 - acceleration_271
        * v_arm_roll_dot_hat - acceleration_277 * v_elbow_pitch_dot_hat - acceleration_290
        * v_forearm_roll_dot_hat - acceleration_306 * v_wrist_pitch_dot_hat - acceleration_330
        * v_hand_roll_dot_hat;
    const double v_shoulder_yaw_dot_hat = acceleration_145 * one_over_acceleration_264 + acceleration_267
        * v_shoulder_pitch_dot_hat - acceleration_270 * v_arm_roll_dot_hat - acceleration_276
        * v_elbow_pitch_dot_hat - acceleration_289 * v_forearm_roll_dot_hat - acceleration_305
        * v_wrist_pitch_dot_hat - acceleration_329 * v_hand_roll_dot_hat; /* rad/s^2 */

    /* states one sample later (explicit Euler) */
    const double z_v_shoulder_yaw_next = state->z_v_shoulder_yaw + parameters->sample_time * (v_shoulder_yaw_dot_hat
        - parameters->K_v_v_shoulder_yaw * v_shoulder_yaw_hat);
    const double z_v_shoulder_pitch_next = state->z_v_shoulder_pitch + parameters->sample_time
        * (v_shoulder_pitch_dot_hat - parameters->K_v_v_shoulder_pitch * v_shoulder_pitch_hat);
    const double z_v_arm_roll_next = state->z_v_arm_roll + parameters->sample_time * (v_arm_roll_dot_hat
        - parameters->K_v_v_arm_roll * v_arm_roll_hat);
    const double z_v_elbow_pitch_next = state->z_v_elbow_pitch + parameters->sample_time * (v_elbow_pitch_dot_hat
        - parameters->K_v_v_elbow_pitch * v_elbow_pitch_hat);
    const double z_v_forearm_roll_next = state->z_v_forearm_roll + parameters->sample_time * (v_forearm_roll_dot_hat
        - parameters->K_v_v_forearm_roll * v_forearm_roll_hat);
    const double z_v_wrist_pitch_next = state->z_v_wrist_pitch + parameters->sample_time * (v_wrist_pitch_dot_hat
        - parameters->K_v_v_wrist_pitch * v_wrist_pitch_hat);
    const double z_v_hand_roll_next = state->z_v_hand_roll + parameters->sample_time * (v_hand_roll_dot_hat
        - parameters->K_v_v_hand_roll * v_hand_roll_hat);
    const double z_shoulder_yaw_next = state->z_shoulder_yaw - parameters->h_K_1_shoulder_yaw * v_shoulder_yaw_hat
        - parameters->h_K_2_shoulder_yaw * v_shoulder_yaw_dot_hat;
    const double z_shoulder_pitch_next = state->z_shoulder_pitch - parameters->h_K_1_shoulder_pitch
        * v_shoulder_pitch_hat - parameters->h_K_2_shoulder_pitch * v_shoulder_pitch_dot_hat;
    const double z_arm_roll_next = state->z_arm_roll - parameters->h_K_1_arm_roll * v_arm_roll_hat
        - parameters->h_K_2_arm_roll * v_arm_roll_dot_hat;
    const double z_elbow_pitch_next = state->z_elbow_pitch - parameters->h_K_1_elbow_pitch * v_elbow_pitch_hat
        - parameters->h_K_2_elbow_pitch * v_elbow_pitch_dot_hat;
    const double z_forearm_roll_next = state->z_forearm_roll - parameters->h_K_1_forearm_roll * v_forearm_roll_hat
        - parameters->h_K_2_forearm_roll * v_forearm_roll_dot_hat;
    const double z_wrist_pitch_next = state->z_wrist_pitch - parameters->h_K_1_wrist_pitch * v_wrist_pitch_hat
        - parameters->h_K_2_wrist_pitch * v_wrist_pitch_dot_hat;
    const double z_hand_roll_next = state->z_hand_roll - parameters->h_K_1_hand_roll * v_hand_roll_hat
        - parameters->h_K_2_hand_roll * v_hand_roll_dot_hat;

    /* hold the last state and estimates where a next state, or an input that it does not show, is not finite */
    const double check = z_v_shoulder_yaw_next + z_v_shoulder_pitch_next + z_v_arm_roll_next
        + z_v_elbow_pitch_next + z_v_forearm_roll_next + z_v_wrist_pitch_next + z_v_hand_roll_next
        + z_shoulder_yaw_next + z_shoulder_pitch_next + z_arm_roll_next + z_elbow_pitch_next
        + z_forearm_roll_next + z_wrist_pitch_next + z_hand_roll_next;
    if (fabs(check) <= DBL_MAX) {
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
        outputs->fault = 1;
    }
}
