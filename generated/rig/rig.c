/*
 * rig: friction observer CFO, velocity estimated; 17 operations a step.
 *
 * Made by stiction 0.1.0 from rig.yaml
 * sha256 7251f4f1b617cc2038090d9dbaa1075a2eab900ef9bf816326a579f8bfb3dcf1
 * with: stiction generate rig.yaml
 */
#include "rig.h"

#include <math.h>

static double signum(double u)
{
    return u > 0.0 ? 1.0 : (u < 0.0 ? -1.0 : 0.0);
}

void rig_init(rig_state *state, const rig_parameters *parameters,
                             const rig_inputs *inputs)
{
    (void)parameters;
    (void)inputs;
    /* states at the first sample */
    state->z_omega = -(parameters->K_v * inputs->theta);
    state->z_plates = parameters->plates_a;
}

void rig_step(rig_state *state, const rig_parameters *parameters,
                             const rig_inputs *inputs, rig_outputs *outputs)
{
    /* velocity estimate, (4.25) */
    const double omega_hat = state->z_omega + parameters->K_v * inputs->theta; /* rad/s */

    /* slip velocity, U' v, (4.5) */
    const double slip_plates = omega_hat; /* rad/s */

    /* slip sign, (4.13) */
    const double sign_plates = signum(slip_plates); /* 1 */

    /* friction level, (4.11) */
    const double a_hat_plates = state->z_plates - parameters->K_F * fabs(slip_plates); /* N*m */

    /* contact friction, (4.10) */
    const double F_hat_plates = a_hat_plates * sign_plates; /* N*m */

    /* friction force, (4.10) */
    const double F_hat_on_theta = F_hat_plates; /* N*m */

    /* acceleration, (4.2) */
    const double omega_dot_hat = (inputs->w - F_hat_on_theta) / parameters->J; /* rad/s^2 */

    /* states one sample later (explicit Euler) */
    const double z_omega_next = state->z_omega + parameters->sample_time * (omega_dot_hat - parameters->K_v * omega_hat);
    const double z_plates_next = state->z_plates + parameters->sample_time * (parameters->K_F * omega_dot_hat * sign_plates);
    state->z_omega = z_omega_next;
    state->z_plates = z_plates_next;

    outputs->omega_hat = omega_hat;
    outputs->a_hat_plates = a_hat_plates;
    outputs->F_hat_plates = F_hat_plates;
    outputs->F_hat_on_theta = F_hat_on_theta;
}
