/*
 * rig_dfoa: friction observer DFO, velocity estimated, double precision.
 * A step: 18 additions, 20 multiplications, 0 divisions, 0 calls, 2 of sign or magnitude.
 *
 * Made by stiction 0.1.0 from rig_dfoa.yaml
 * sha256 69aaea3018dec1cd2da8ec6c8a524dd0cbad32293aeaf657237465d01904a3f3
 * with: stiction generate rig_dfoa.yaml
 */
#include "rig_dfoa.h"

#include <math.h>

#if defined(__clang__)
#pragma STDC FP_CONTRACT OFF
#endif

#if defined(__GNUC__)
#define RIG_DFOA_COLD __attribute__((noinline, cold))
#else
#define RIG_DFOA_COLD
#endif

void rig_dfoa_prepare(rig_dfoa_parameters *parameters)
{
    parameters->one_over_J = 1.0 / parameters->J;
    parameters->plates_D1_minus_plates_D2 = parameters->plates_D1 - parameters->plates_D2;
    parameters->h_K_a = parameters->sample_time * parameters->K_a;
}

void rig_dfoa_init(rig_dfoa_state *state, const rig_dfoa_parameters *parameters,
    const rig_dfoa_inputs *inputs)
{
    state->z_omega = -(parameters->K_v * inputs->theta);
    state->z_f_plates = -(parameters->K_f1 * inputs->theta);
    state->z_a_plates = parameters->plates_a;
    state->mode = RIG_DFOA_RUNNING;
    state->invalid_samples = 0u;

    /* if the measurement is invalid, wait for the first valid one */
    const double check = fabs(inputs->theta) + fabs(inputs->w) + fabs(state->z_omega) + fabs(state->z_f_plates)
        + fabs(state->z_a_plates);
    if (!(fabs(check) <= 1e+150)) {
        state->z_omega = 0.0;
        state->z_f_plates = 0.0;
        state->z_a_plates = 0.0;
        state->mode = RIG_DFOA_STARTING;
    }
}

/* Predict the state over an invalid sample, as if the machine moved at the held velocity estimate. */
static void rig_dfoa_predict(rig_dfoa_state *state, const rig_dfoa_parameters *parameters,
    const rig_dfoa_outputs *outputs)
{
    state->z_omega = state->z_omega - parameters->sample_time * parameters->K_v * outputs->omega_hat;
    state->z_f_plates = state->z_f_plates - parameters->sample_time * parameters->K_f1 * outputs->omega_hat;

    /* after 2 invalid samples in a row, resume from the next valid one */
    if (state->mode == RIG_DFOA_RUNNING) {
        if (outputs->fault == 0) {
            state->invalid_samples = 0u; /* the sample before was valid */
        }
        state->invalid_samples++;
        if (state->invalid_samples >= 2u) {
            state->mode = RIG_DFOA_HOLDING;
        }
    }
}

/* Set the state from a valid sample so that the estimates equal the held ones. */
static void rig_dfoa_resume(rig_dfoa_state *state, const rig_dfoa_parameters *parameters,
    const rig_dfoa_inputs *inputs, const rig_dfoa_outputs *outputs)
{
    const double resumed_1 = inputs->theta + parameters->sample_time * outputs->omega_hat;
    state->z_omega = outputs->omega_hat - parameters->K_v * resumed_1;
    state->z_f_plates = outputs->f_hat_plates - parameters->K_f1 * resumed_1 - parameters->K_f2
        * outputs->omega_hat;
    state->z_a_plates = outputs->a_hat_plates - parameters->K_a * outputs->omega_hat * outputs->f_hat_plates;
    state->mode = RIG_DFOA_RUNNING;
    state->invalid_samples = 0u;
}

/* Handle an invalid sample, or an invalid state: hold the last estimates, and set the state for the next sample. */
static RIG_DFOA_COLD void rig_dfoa_handle_fault(rig_dfoa_state *state,
    const rig_dfoa_parameters *parameters, const rig_dfoa_inputs *inputs, rig_dfoa_outputs *outputs)
{
    const double given = fabs(inputs->theta) + fabs(inputs->w);
    if (!(fabs(given) <= 1e+150)) {
        /* invalid sample */
        if (state->mode != RIG_DFOA_STARTING) {
            rig_dfoa_predict(state, parameters, outputs);
        }
    } else if (state->mode == RIG_DFOA_HOLDING) {
        /* first valid sample after many invalid ones */
        rig_dfoa_resume(state, parameters, inputs, outputs);
    } else {
        /* first valid sample of all, or an invalid state */
        rig_dfoa_init(state, parameters, inputs);
    }
    outputs->fault = 1;
}

void rig_dfoa_step(rig_dfoa_state *state, const rig_dfoa_parameters *parameters,
    const rig_dfoa_inputs *inputs, rig_dfoa_outputs *outputs)
{
    /* velocity estimate, (4.25) */
    const double omega_hat = state->z_omega + parameters->K_v * inputs->theta; /* rad/s */

    /* friction state, (7.11) */
    const double f_hat_plates = state->z_f_plates + parameters->K_f1 * inputs->theta + parameters->K_f2
        * omega_hat; /* 1 */

    /* friction level, (7.10) */
    const double a_hat_plates = state->z_a_plates + parameters->K_a * omega_hat * f_hat_plates; /* N*m */

    /* contact friction, (7.12) */
    const double F_hat_plates = f_hat_plates * a_hat_plates; /* N*m */

    /* acceleration, (4.2) */
    const double omega_dot_hat = parameters->one_over_J * (inputs->w - F_hat_plates); /* rad/s^2 */

    /* friction state rate, xi_1 of (6.5), (6.6) */
    const double f_rate_plates = parameters->plates_c * (omega_hat - parameters->plates_D2 * f_hat_plates
        - parameters->plates_D1_minus_plates_D2 * (f_hat_plates + 0.5 * fabs(f_hat_plates - 1.0) - 0.5
        * fabs(1.0 + f_hat_plates))); /* 1/s */

    /* states one sample later (explicit Euler) */
    const double z_omega_next = state->z_omega + parameters->sample_time * (omega_dot_hat - parameters->K_v
        * omega_hat);
    const double z_f_plates_next = state->z_f_plates + parameters->sample_time * (f_rate_plates
        - parameters->K_f1 * omega_hat - parameters->K_f2 * omega_dot_hat);
    const double z_a_plates_next = state->z_a_plates - parameters->h_K_a * (f_hat_plates * omega_dot_hat
        + omega_hat * f_rate_plates);

    /* this sum is too large or NaN if a next state is, or an input or output on which no next state depends */
    const double check = z_omega_next + z_f_plates_next + z_a_plates_next;
    if (fabs(check) <= 1e+150 && state->mode == RIG_DFOA_RUNNING) {
        outputs->omega_hat = omega_hat;
        outputs->f_hat_plates = f_hat_plates;
        outputs->a_hat_plates = a_hat_plates;
        outputs->F_hat_plates = F_hat_plates;
        outputs->F_hat_on_theta = F_hat_plates;

        state->z_omega = z_omega_next;
        state->z_f_plates = z_f_plates_next;
        state->z_a_plates = z_a_plates_next;
        outputs->fault = 0;
    } else {
        rig_dfoa_handle_fault(state, parameters, inputs, outputs);
    }
}
