/*
 * rig_to: friction observer TO, velocity estimated, double precision.
 * A step: 8 additions, 8 multiplications, 0 divisions, 0 calls, 0 of sign or magnitude.
 *
 * Made by stiction 0.1.0 from rig_to.yaml
 * sha256 3f8a34b28bf62f6eba9ec73e43a7a6df1bc1671345b852be96b034354d84bb91
 * with: stiction generate rig_to.yaml
 */
#include "rig_to.h"

#include <math.h>

#if defined(__clang__)
#pragma STDC FP_CONTRACT OFF
#endif

#if defined(__GNUC__)
#define RIG_TO_COLD __attribute__((noinline, cold))
#else
#define RIG_TO_COLD
#endif

void rig_to_prepare(rig_to_parameters *parameters)
{
    parameters->one_over_J = 1.0 / parameters->J;
    parameters->h_K_1 = parameters->sample_time * parameters->K_1;
    parameters->h_K_2 = parameters->sample_time * parameters->K_2;
}

/* Set the state from a measurement, at the first sample or anew. */
static void rig_to_start(rig_to_state *state, const rig_to_parameters *parameters,
    const rig_to_inputs *inputs)
{
    state->z_omega = -(parameters->K_v * inputs->theta);
    state->z_theta = -(parameters->K_1 * inputs->theta);

    /* where that cannot be used, wait for a good sample */
    const double check = inputs->theta + inputs->w + state->z_omega + state->z_theta;
    state->waiting = 0.0;
    if (!(fabs(check) <= 1e+150)) {
        state->z_omega = 0.0;
        state->z_theta = 0.0;
        state->waiting = 1.0;
    }
}

void rig_to_init(rig_to_state *state, const rig_to_parameters *parameters,
    const rig_to_inputs *inputs)
{
    rig_to_start(state, parameters, inputs);
}

/* A sample is lost: the machine is taken to go on with the velocity that is held, and the states with it. */
static void rig_to_miss(rig_to_state *state, const rig_to_parameters *parameters,
    const rig_to_outputs *outputs)
{
    state->z_omega = state->z_omega - parameters->sample_time * parameters->K_v * outputs->omega_hat;
    state->z_theta = state->z_theta - parameters->h_K_1 * outputs->omega_hat;

    /* after 2 in a row, wait for a good sample that sets the states anew */
    if (state->waiting < 0.5) {
        state->waiting = ((outputs->fault != 0) ? state->waiting : 0.0) + 0.25;
    }
}

/* Set the state from a good sample after many that were lost, so that the estimates go on from those that are held. */
static void rig_to_resume(rig_to_state *state, const rig_to_parameters *parameters,
    const rig_to_inputs *inputs, const rig_to_outputs *outputs)
{
    const double resumed_1 = inputs->theta + parameters->sample_time * outputs->omega_hat;
    state->z_omega = outputs->omega_hat - parameters->K_v * resumed_1;
    state->z_theta = outputs->tracked_theta - parameters->K_1 * resumed_1 - parameters->K_2 * outputs->omega_hat;
    state->waiting = 0.0;
}

/* What becomes of the state where a sample is not used. */
static RIG_TO_COLD void rig_to_set_anew(rig_to_state *state,
    const rig_to_parameters *parameters, const rig_to_inputs *inputs, rig_to_outputs *outputs)
{
    const double given = inputs->theta + inputs->w;
    if (!(fabs(given) <= 1e+150)) {
        if (state->waiting < 0.75) {
            rig_to_miss(state, parameters, outputs);
        }
    } else if ((state->waiting < 0.5) || (state->waiting > 0.75)) {
        rig_to_start(state, parameters, inputs); /* the state cannot be used, or waits for its first sample */
    } else {
        rig_to_resume(state, parameters, inputs, outputs);
    }
    outputs->fault = 1;
}

void rig_to_step(rig_to_state *state, const rig_to_parameters *parameters,
    const rig_to_inputs *inputs, rig_to_outputs *outputs)
{
    /* velocity estimate, (4.25) */
    const double omega_hat = state->z_omega + parameters->K_v * inputs->theta; /* rad/s */

    /* tracked friction, (4.16) */
    const double tracked_theta = state->z_theta + parameters->K_1 * inputs->theta + parameters->K_2
        * omega_hat; /* N*m */

    /* acceleration, (4.2) */
    const double omega_dot_hat = parameters->one_over_J * (inputs->w - tracked_theta); /* rad/s^2 */

    /* states one sample later (explicit Euler) */
    const double z_omega_next = state->z_omega + parameters->sample_time * (omega_dot_hat - parameters->K_v
        * omega_hat);
    const double z_theta_next = state->z_theta - parameters->h_K_1 * omega_hat - parameters->h_K_2
        * omega_dot_hat;

    /* hold the last state and estimates where a next state, or an input that it does not show, is too large or NaN */
    const double check = z_omega_next + z_theta_next;
    if (fabs(check) <= 1e+150 && state->waiting < 0.5) {
        outputs->omega_hat = omega_hat;
        outputs->tracked_theta = tracked_theta;
        outputs->F_hat_on_theta = tracked_theta;

        state->z_omega = z_omega_next;
        state->z_theta = z_theta_next;
        outputs->fault = 0;
    } else {
        rig_to_set_anew(state, parameters, inputs, outputs);
    }
}
