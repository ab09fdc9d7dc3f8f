/*
 * two_link_arm: friction observer GCFO, velocity estimated; 105 operations a step.
 *
 * Made by stiction 0.1.0 from two_link_arm.yaml
 * sha256 8b25c9c1855802942b021ffbcf57601b15385794294bca198854e44907fbf30b
 * with: stiction generate two_link_arm.yaml
 */
#include "two_link_arm.h"

#include <math.h>

static double signum(double u)
{
    return u > 0.0 ? 1.0 : (u < 0.0 ? -1.0 : 0.0);
}

void two_link_arm_init(two_link_arm_state *state, const two_link_arm_parameters *parameters,
                             const two_link_arm_inputs *inputs)
{
    (void)parameters;
    (void)inputs;
    /* states at the first sample */
    state->z_omega1 = -(parameters->K_v_omega1_omega1 * inputs->theta1 + parameters->K_v_omega1_omega2 * inputs->theta2);
    state->z_omega2 = -(parameters->K_v_omega2_omega1 * inputs->theta1 + parameters->K_v_omega2_omega2 * inputs->theta2);
    state->z_shoulder = parameters->shoulder_a;
    state->z_elbow = parameters->elbow_a;
}

void two_link_arm_step(two_link_arm_state *state, const two_link_arm_parameters *parameters,
                             const two_link_arm_inputs *inputs, two_link_arm_outputs *outputs)
{
    /* velocity estimate, (4.25) */
    const double omega1_hat = state->z_omega1 + parameters->K_v_omega1_omega1 * inputs->theta1 + parameters->K_v_omega1_omega2 * inputs->theta2; /* rad/s */
    const double omega2_hat = state->z_omega2 + parameters->K_v_omega2_omega1 * inputs->theta1 + parameters->K_v_omega2_omega2 * inputs->theta2; /* rad/s */

    /* slip velocity, U' v, (4.5) */
    const double slip_shoulder = omega1_hat; /* rad/s */
    const double slip_elbow = omega2_hat; /* rad/s */

    /* slip sign, (4.13) */
    const double sign_shoulder = signum(slip_shoulder); /* 1 */
    const double sign_elbow = signum(slip_elbow); /* 1 */

    /* friction level, (4.11) */
    const double part_of_friction_level_1 = fabs(slip_shoulder);
    const double a_hat_shoulder = state->z_shoulder - parameters->K_F_shoulder_shoulder * part_of_friction_level_1; /* N*m */
    const double a_hat_elbow = state->z_elbow - parameters->K_F_elbow_elbow * fabs(slip_elbow) - parameters->K_F_elbow_shoulder * part_of_friction_level_1; /* N*m */

    /* contact friction, (4.10) */
    const double F_hat_shoulder = a_hat_shoulder * sign_shoulder; /* N*m */
    const double F_hat_elbow = a_hat_elbow * sign_elbow; /* N*m */

    /* friction force, (4.10) */
    const double F_hat_on_theta1 = F_hat_shoulder; /* N*m */
    const double F_hat_on_theta2 = F_hat_elbow; /* N*m */

    /* acceleration, (4.2) */
    const double part_of_acceleration_1 = parameters->b2 * parameters->l1 * parameters->m2;
    const double part_of_acceleration_2 = sin(inputs->theta2);
    const double part_of_acceleration_3 = 2.0 * parameters->b2 * parameters->l1 * parameters->m2;
    const double part_of_acceleration_4 = cos(inputs->theta1);
    const double part_of_acceleration_5 = parameters->b2 * parameters->gravity * parameters->m2 * cos(inputs->theta1 + inputs->theta2);
    const double part_of_acceleration_6 = inputs->w1 + part_of_acceleration_1 * (omega2_hat * omega2_hat) * part_of_acceleration_2 + part_of_acceleration_3 * omega1_hat * omega2_hat * part_of_acceleration_2 - F_hat_on_theta1 - parameters->b1 * parameters->gravity * parameters->m1 * part_of_acceleration_4 - part_of_acceleration_5 - parameters->gravity * parameters->l1 * parameters->m2 * part_of_acceleration_4;
    const double part_of_acceleration_7 = parameters->m2 * (parameters->b2 * parameters->b2);
    const double part_of_acceleration_8 = cos(inputs->theta2);
    const double part_of_acceleration_9 = parameters->I1 + parameters->I2 + parameters->m1 * (parameters->b1 * parameters->b1) + part_of_acceleration_7 + parameters->m2 * (parameters->l1 * parameters->l1) + part_of_acceleration_3 * part_of_acceleration_8;
    const double part_of_acceleration_10 = parameters->I2 + part_of_acceleration_7;
    const double part_of_acceleration_11 = (part_of_acceleration_10 + part_of_acceleration_1 * part_of_acceleration_8) / part_of_acceleration_9;
    const double part_of_acceleration_12 = (inputs->w2 - F_hat_on_theta2 - part_of_acceleration_5 - part_of_acceleration_1 * (omega1_hat * omega1_hat) * part_of_acceleration_2 - part_of_acceleration_11 * part_of_acceleration_6) / (part_of_acceleration_10 - part_of_acceleration_11 * part_of_acceleration_11 * part_of_acceleration_9);
    const double omega1_dot_hat = part_of_acceleration_6 / part_of_acceleration_9 - part_of_acceleration_11 * part_of_acceleration_12; /* rad/s^2 */
    const double omega2_dot_hat = part_of_acceleration_12; /* rad/s^2 */

    /* states one sample later (explicit Euler) */
    const double z_omega1_next = state->z_omega1 + parameters->sample_time * (omega1_dot_hat - parameters->K_v_omega1_omega1 * omega1_hat - parameters->K_v_omega1_omega2 * omega2_hat);
    const double z_omega2_next = state->z_omega2 + parameters->sample_time * (omega2_dot_hat - parameters->K_v_omega2_omega1 * omega1_hat - parameters->K_v_omega2_omega2 * omega2_hat);
    const double z_shoulder_next = state->z_shoulder + parameters->sample_time * (parameters->K_F_shoulder_shoulder * omega1_dot_hat * sign_shoulder);
    const double z_elbow_next = state->z_elbow + parameters->sample_time * (parameters->K_F_elbow_elbow * omega2_dot_hat * sign_elbow + parameters->K_F_elbow_shoulder * omega1_dot_hat * sign_shoulder);
    state->z_omega1 = z_omega1_next;
    state->z_omega2 = z_omega2_next;
    state->z_shoulder = z_shoulder_next;
    state->z_elbow = z_elbow_next;

    outputs->omega1_hat = omega1_hat;
    outputs->omega2_hat = omega2_hat;
    outputs->a_hat_shoulder = a_hat_shoulder;
    outputs->a_hat_elbow = a_hat_elbow;
    outputs->F_hat_shoulder = F_hat_shoulder;
    outputs->F_hat_elbow = F_hat_elbow;
    outputs->F_hat_on_theta1 = F_hat_on_theta1;
    outputs->F_hat_on_theta2 = F_hat_on_theta2;
}
