/*
 * two_link_arm: friction observer GCFO, velocity estimated, double precision.
 * A step: 30 additions, 42 multiplications, 1 division, 4 calls, 4 of sign or magnitude.
 *
 * Made by stiction 0.1.0 from two_link_arm.yaml
 * sha256 b6da30848bfb88be36fdd088967c28eb76bff5115c2e0e2e130e666fe4a04476
 * with: stiction generate two_link_arm.yaml
 */
#include "two_link_arm.h"

#include <math.h>

#if defined(__clang__)
#pragma STDC FP_CONTRACT OFF
#endif

#if defined(__GNUC__)
#define TWO_LINK_ARM_COLD __attribute__((noinline, cold))
#else
#define TWO_LINK_ARM_COLD
#endif

static inline double two_link_arm_sign(double u)
{
    return (u > 0.0) ? 1.0 : ((u < 0.0) ? -1.0 : 0.0);
}

void two_link_arm_prepare(two_link_arm_parameters *parameters)
{
    parameters->constant_1 = parameters->I1 + parameters->I2 + parameters->m1 * parameters->b1 * parameters->b1
        + parameters->m2 * parameters->b2 * parameters->b2 + parameters->m2 * parameters->l1 * parameters->l1;
    parameters->twice_m2_l1_b2 = 2.0 * parameters->m2 * parameters->l1 * parameters->b2;
    parameters->I2_plus_m2_b2_squared = parameters->I2 + parameters->m2 * parameters->b2 * parameters->b2;
    parameters->m2_l1_b2 = parameters->m2 * parameters->l1 * parameters->b2;
    parameters->m2_b2_gravity = parameters->m2 * parameters->b2 * parameters->gravity;
    parameters->m1_b1_gravity_plus_m2_l1_gravity = parameters->m1 * parameters->b1 * parameters->gravity
        + parameters->m2 * parameters->l1 * parameters->gravity;
    parameters->h_K_F_shoulder_shoulder = parameters->sample_time * parameters->K_F_shoulder_shoulder;
    parameters->h_K_F_elbow_elbow = parameters->sample_time * parameters->K_F_elbow_elbow;
    parameters->h_K_F_elbow_shoulder = parameters->sample_time * parameters->K_F_elbow_shoulder;
}

void two_link_arm_init(two_link_arm_state *state, const two_link_arm_parameters *parameters,
    const two_link_arm_inputs *inputs)
{
    state->z_omega1 = -(parameters->K_v_omega1_omega1 * inputs->theta1 + parameters->K_v_omega1_omega2
        * inputs->theta2);
    state->z_omega2 = -(parameters->K_v_omega2_omega1 * inputs->theta1 + parameters->K_v_omega2_omega2
        * inputs->theta2);
    state->z_shoulder = parameters->shoulder_a;
    state->z_elbow = parameters->elbow_a;
    state->mode = TWO_LINK_ARM_RUNNING;
    state->invalid_samples = 0u;

    /* if the measurement is invalid, wait for the first valid one */
    const double check = fabs(inputs->theta1) + fabs(inputs->theta2) + fabs(inputs->w1) + fabs(inputs->w2)
        + fabs(state->z_omega1) + fabs(state->z_omega2) + fabs(state->z_shoulder) + fabs(state->z_elbow);
    if (!(fabs(check) <= 1e+150)) {
        state->z_omega1 = 0.0;
        state->z_omega2 = 0.0;
        state->z_shoulder = 0.0;
        state->z_elbow = 0.0;
        state->mode = TWO_LINK_ARM_STARTING;
    }
}

/* Predict the state over an invalid sample, as if the machine moved at the held velocity estimate. */
static void two_link_arm_predict(two_link_arm_state *state, const two_link_arm_parameters *parameters,
    const two_link_arm_outputs *outputs)
{
    state->z_omega1 = state->z_omega1 - parameters->sample_time * parameters->K_v_omega1_omega1
        * outputs->omega1_hat - parameters->sample_time * parameters->K_v_omega1_omega2 * outputs->omega2_hat;
    state->z_omega2 = state->z_omega2 - parameters->sample_time * parameters->K_v_omega2_omega1
        * outputs->omega1_hat - parameters->sample_time * parameters->K_v_omega2_omega2 * outputs->omega2_hat;

    /* after 8 invalid samples in a row, resume from the next valid one */
    if (state->mode == TWO_LINK_ARM_RUNNING) {
        if (outputs->fault == 0) {
            state->invalid_samples = 0u; /* the sample before was valid */
        }
        state->invalid_samples++;
        if (state->invalid_samples >= 8u) {
            state->mode = TWO_LINK_ARM_HOLDING;
        }
    }
}

/* Set the state from a valid sample so that the estimates equal the held ones. */
static void two_link_arm_resume(two_link_arm_state *state, const two_link_arm_parameters *parameters,
    const two_link_arm_inputs *inputs, const two_link_arm_outputs *outputs)
{
    const double resumed_1 = inputs->theta1 + parameters->sample_time * outputs->omega1_hat;
    const double resumed_2 = inputs->theta2 + parameters->sample_time * outputs->omega2_hat;
    const double resumed_3 = fabs(outputs->omega1_hat);
    state->z_omega1 = outputs->omega1_hat - parameters->K_v_omega1_omega1 * resumed_1
        - parameters->K_v_omega1_omega2 * resumed_2;
    state->z_omega2 = outputs->omega2_hat - parameters->K_v_omega2_omega1 * resumed_1
        - parameters->K_v_omega2_omega2 * resumed_2;
    state->z_shoulder = outputs->a_hat_shoulder + parameters->K_F_shoulder_shoulder * resumed_3;
    state->z_elbow = outputs->a_hat_elbow + parameters->K_F_elbow_elbow * fabs(outputs->omega2_hat)
        + parameters->K_F_elbow_shoulder * resumed_3;
    state->mode = TWO_LINK_ARM_RUNNING;
    state->invalid_samples = 0u;
}

/* Handle an invalid sample, or an invalid state: hold the last estimates, and set the state for the next sample. */
static TWO_LINK_ARM_COLD void two_link_arm_handle_fault(two_link_arm_state *state,
    const two_link_arm_parameters *parameters, const two_link_arm_inputs *inputs, two_link_arm_outputs *outputs)
{
    const double given = fabs(inputs->theta1) + fabs(inputs->theta2) + fabs(inputs->w1) + fabs(inputs->w2);
    if (!(fabs(given) <= 1e+150)) {
        /* invalid sample */
        if (state->mode != TWO_LINK_ARM_STARTING) {
            two_link_arm_predict(state, parameters, outputs);
        }
    } else if (state->mode == TWO_LINK_ARM_HOLDING) {
        /* first valid sample after many invalid ones */
        two_link_arm_resume(state, parameters, inputs, outputs);
    } else {
        /* first valid sample of all, or an invalid state */
        two_link_arm_init(state, parameters, inputs);
    }
    outputs->fault = 1;
}

void two_link_arm_step(two_link_arm_state *state, const two_link_arm_parameters *parameters,
    const two_link_arm_inputs *inputs, two_link_arm_outputs *outputs)
{
    /* velocity estimate, (4.25) */
    const double omega1_hat = state->z_omega1 + parameters->K_v_omega1_omega1 * inputs->theta1
        + parameters->K_v_omega1_omega2 * inputs->theta2; /* rad/s */
    const double omega2_hat = state->z_omega2 + parameters->K_v_omega2_omega1 * inputs->theta1
        + parameters->K_v_omega2_omega2 * inputs->theta2; /* rad/s */

    /* slip sign, (4.13) */
    const double sign_shoulder = two_link_arm_sign(omega1_hat); /* 1 */
    const double sign_elbow = two_link_arm_sign(omega2_hat); /* 1 */

    /* friction level, (4.11) */
    const double abs_omega1_hat = fabs(omega1_hat);
    const double a_hat_shoulder = state->z_shoulder - parameters->K_F_shoulder_shoulder * abs_omega1_hat; /* N*m */
    const double a_hat_elbow = state->z_elbow - parameters->K_F_elbow_elbow * fabs(omega2_hat)
        - parameters->K_F_elbow_shoulder * abs_omega1_hat; /* N*m */

    /* contact friction, (4.10) */
    const double F_hat_shoulder = sign_shoulder * a_hat_shoulder; /* N*m */
    const double F_hat_elbow = sign_elbow * a_hat_elbow; /* N*m */

    /* acceleration, (4.2) */
    const double cos_theta2 = cos(inputs->theta2);
    const double sin_theta2 = sin(inputs->theta2);
    const double cos_theta1 = cos(inputs->theta1);
    const double M11 = parameters->constant_1 + parameters->twice_m2_l1_b2 * cos_theta2;
    const double M21 = parameters->I2_plus_m2_b2_squared + parameters->m2_l1_b2 * cos_theta2;
    const double acceleration_1 = parameters->m2_b2_gravity * (cos_theta2 * cos_theta1 - sin_theta2
        * sin(inputs->theta1));
    const double r1 = inputs->w1 + sin_theta2 * omega2_hat * (parameters->m2_l1_b2 * omega2_hat
        + parameters->twice_m2_l1_b2 * omega1_hat) - F_hat_shoulder
        - parameters->m1_b1_gravity_plus_m2_l1_gravity * cos_theta1 - acceleration_1;
    const double r2 = inputs->w2 - F_hat_elbow - acceleration_1 - parameters->m2_l1_b2 * sin_theta2 * omega1_hat
        * omega1_hat;
    const double one_over_det_M = 1.0 / (parameters->I2_plus_m2_b2_squared * M11 - M21 * M21);
    const double omega1_dot_hat = one_over_det_M * (parameters->I2_plus_m2_b2_squared * r1 - M21 * r2); /* rad/s^2 */
    const double omega2_dot_hat = one_over_det_M * (M11 * r2 - M21 * r1); /* rad/s^2 */

    /* states one sample later (explicit Euler) */
    const double z_omega1_next = state->z_omega1 + parameters->sample_time * (omega1_dot_hat
        - parameters->K_v_omega1_omega1 * omega1_hat - parameters->K_v_omega1_omega2 * omega2_hat);
    const double z_omega2_next = state->z_omega2 + parameters->sample_time * (omega2_dot_hat
        - parameters->K_v_omega2_omega1 * omega1_hat - parameters->K_v_omega2_omega2 * omega2_hat);
    const double z_shoulder_next = state->z_shoulder + parameters->h_K_F_shoulder_shoulder * sign_shoulder
        * omega1_dot_hat;
    const double z_elbow_next = state->z_elbow + parameters->h_K_F_elbow_elbow * sign_elbow * omega2_dot_hat
        + parameters->h_K_F_elbow_shoulder * sign_shoulder * omega1_dot_hat;

    /* this sum is too large or NaN if a next state is, or an input or output on which no next state depends */
    const double check = z_omega1_next + z_omega2_next + z_shoulder_next + z_elbow_next;
    if (fabs(check) <= 1e+150 && state->mode == TWO_LINK_ARM_RUNNING) {
        outputs->omega1_hat = omega1_hat;
        outputs->omega2_hat = omega2_hat;
        outputs->a_hat_shoulder = a_hat_shoulder;
        outputs->a_hat_elbow = a_hat_elbow;
        outputs->F_hat_shoulder = F_hat_shoulder;
        outputs->F_hat_elbow = F_hat_elbow;
        outputs->F_hat_on_theta1 = F_hat_shoulder;
        outputs->F_hat_on_theta2 = F_hat_elbow;

        state->z_omega1 = z_omega1_next;
        state->z_omega2 = z_omega2_next;
        state->z_shoulder = z_shoulder_next;
        state->z_elbow = z_elbow_next;
        outputs->fault = 0;
    } else {
        two_link_arm_handle_fault(state, parameters, inputs, outputs);
    }
}
