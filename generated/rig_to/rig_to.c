/*
 * rig_to: friction observer TO, velocity estimated; 17 operations a step.
 *
 * Made by stiction 0.1.0 from rig_to.yaml
 * sha256 548fde0b8ad1aa0f939cbcfd46f103a1fdb2f3fd97d1d062f74811fafc58e9f5
 * with: stiction generate rig_to.yaml
 */
#include "rig_to.h"

#include <math.h>

void rig_to_init(rig_to_state *state, const rig_to_parameters *parameters,
                             const rig_to_inputs *inputs)
{
    (void)parameters;
    (void)inputs;
    /* states at the first sample */
    state->z_omega = -(parameters->K_v * inputs->theta);
    state->z_theta = -(parameters->K_1 * inputs->theta);
}

void rig_to_step(rig_to_state *state, const rig_to_parameters *parameters,
                             const rig_to_inputs *inputs, rig_to_outputs *outputs)
{
    /* velocity estimate, (4.25) */
    const double omega_hat = state->z_omega + parameters->K_v * inputs->theta; /* rad/s */

    /* tracked friction, (4.16) */
    const double tracked_theta = state->z_theta + parameters->K_1 * inputs->theta + parameters->K_2 * omega_hat; /* N*m */

    /* friction force, (4.16) */
    const double F_hat_on_theta = tracked_theta; /* N*m */

    /* acceleration, (4.2) */
    const double omega_dot_hat = (inputs->w - F_hat_on_theta) / parameters->J; /* rad/s^2 */

    /* states one sample later (explicit Euler) */
    const double z_omega_next = state->z_omega + parameters->sample_time * (omega_dot_hat - parameters->K_v * omega_hat);
    const double z_theta_next = state->z_theta - parameters->sample_time * (parameters->K_1 * omega_hat + parameters->K_2 * omega_dot_hat);
    state->z_omega = z_omega_next;
    state->z_theta = z_theta_next;

    outputs->omega_hat = omega_hat;
    outputs->tracked_theta = tracked_theta;
    outputs->F_hat_on_theta = F_hat_on_theta;
}
