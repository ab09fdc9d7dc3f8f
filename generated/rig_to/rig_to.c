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

void rig_to_init(rig_to_state *state, const rig_to_parameters *parameters,
    const rig_to_inputs *inputs)
{
    state->z_omega = -(parameters->K_v * inputs->theta);
    state->z_theta = -(parameters->K_1 * inputs->theta);
    state->mode = RIG_TO_RUNNING;
    state->invalid_samples = 0u;

    /* if the measurement is invalid, wait for the first valid one */
    const double check = fabs(inputs->theta) + fabs(inputs->w) + fabs(state->z_omega) + fabs(state->z_theta);
    if (!(fabs(check) <= 1e+150)) {
        state->z_omega = 0.0;
        state->z_theta = 0.0;
        state->mode = RIG_TO_STARTING;
    }
}

/* Predict the state over an invalid sample, as if the machine moved at the held velocity estimate. */
static void rig_to_predict(rig_to_state *state, const rig_to_parameters *parameters,
    const rig_to_outputs *outputs)
{
    state->z_omega = state->z_omega - parameters->sample_time * parameters->K_v * outputs->omega_hat;
    state->z_theta = state->z_theta - parameters->h_K_1 * outputs->omega_hat;

    /* after 2 invalid samples in a row, resume from the next valid one */
    if (state->mode == RIG_TO_RUNNING) {
        if (outputs->fault == 0) {
            state->invalid_samples = 0u; /* the sample before was valid */
        }
        state->invalid_samples++;
        if (state->invalid_samples >= 2u) {
            state->mode = RIG_TO_HOLDING;
        }
    }
}

/* Set the state from a valid sample so that the estimates equal the held ones. */
static void rig_to_resume(rig_to_state *state, const rig_to_parameters *parameters,
    const rig_to_inputs *inputs, const rig_to_outputs *outputs)
{
    const double resumed_1 = inputs->theta + parameters->sample_time * outputs->omega_hat;
    state->z_omega = outputs->omega_hat - parameters->K_v * resumed_1;
    state->z_theta = outputs->tracked_theta - parameters->K_1 * resumed_1 - parameters->K_2 * outputs->omega_hat;
    state->mode = RIG_TO_RUNNING;
    state->invalid_samples = 0u;
}

/* Handle an invalid sample, or an invalid state: hold the last estimates, and set the state for the next sample. */
static RIG_TO_COLD void rig_to_handle_fault(rig_to_state *state,
    const rig_to_parameters *parameters, const rig_to_inputs *inputs, rig_to_outputs *outputs)
{
    const double given = fabs(inputs->theta) + fabs(inputs->w);
    if (!(fabs(given) <= 1e+150)) {
        /* invalid sample */
        if (state->mode != RIG_TO_STARTING) {
            rig_to_predict(state, parameters, outputs);
        }
    } else if (state->mode == RIG_TO_HOLDING) {
        /* first valid sample after many invalid ones */
        rig_to_resume(state, parameters, inputs, outputs);
    } else {
        /* first valid sample of all, or an invalid state */
        rig_to_init(state, parameters, inputs);
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

    /* this sum is too large or NaN if a next state is, or an input or output on which no next state depends */
    const double check = z_omega_next + z_theta_next;
    if (fabs(check) <= 1e+150 && state->mode == RIG_TO_RUNNING) {
        outputs->omega_hat = omega_hat;
        outputs->tracked_theta = tracked_theta;
        outputs->F_hat_on_theta = tracked_theta;

        state->z_omega = z_omega_next;
        state->z_theta = z_theta_next;
        outputs->fault = 0;
    } else {
        rig_to_handle_fault(state, parameters, inputs, outputs);
    }
}
