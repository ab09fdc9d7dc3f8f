/*
 * rig_dfob: friction observer DFO, velocity estimated, double precision.
 * A step: 13 additions, 18 multiplications, 0 divisions, 0 calls, 1 of sign or magnitude.
 *
 * Made by stiction 0.1.0 from rig_dfob.yaml
 * sha256 35344a60bec08ac01ae4fac2503c305726c82aef028174816f332dc9de0dc5f3
 * with: stiction generate rig_dfob.yaml
 */
#include "rig_dfob.h"

#include <math.h>

#if defined(__clang__)
#pragma STDC FP_CONTRACT OFF
#endif

#if defined(__GNUC__)
#define RIG_DFOB_COLD __attribute__((noinline, cold))
#else
#define RIG_DFOB_COLD
#endif

static inline double rig_dfob_sign(double u)
{
    return (u > 0.0) ? 1.0 : ((u < 0.0) ? -1.0 : 0.0);
}

void rig_dfob_prepare(rig_dfob_parameters *parameters)
{
    parameters->one_over_J = 1.0 / parameters->J;
    parameters->h_K_a = parameters->sample_time * parameters->K_a;
}

void rig_dfob_init(rig_dfob_state *state, const rig_dfob_parameters *parameters,
    const rig_dfob_inputs *inputs)
{
    state->z_omega = -(parameters->K_v * inputs->theta);
    state->z_f_plates = -(parameters->K_f1 * inputs->theta);
    state->z_a_plates = parameters->plates_a;
    state->mode = RIG_DFOB_RUNNING;
    state->invalid_samples = 0u;

    /* if the measurement is invalid, wait for the first valid one */
    const double check = fabs(inputs->theta) + fabs(inputs->w) + fabs(state->z_omega) + fabs(state->z_f_plates)
        + fabs(state->z_a_plates);
    if (!(fabs(check) <= 1e+150)) {
        state->z_omega = 0.0;
        state->z_f_plates = 0.0;
        state->z_a_plates = 0.0;
        state->mode = RIG_DFOB_STARTING;
    }
}

/* Predict the state over an invalid sample, as if the machine moved at the held velocity estimate. */
static void rig_dfob_predict(rig_dfob_state *state, const rig_dfob_parameters *parameters,
    const rig_dfob_outputs *outputs)
{
    state->z_omega = state->z_omega - parameters->sample_time * parameters->K_v * outputs->omega_hat;
    state->z_f_plates = state->z_f_plates - parameters->sample_time * parameters->K_f1 * outputs->omega_hat;

    /* after 2 invalid samples in a row, resume from the next valid one */
    if (state->mode == RIG_DFOB_RUNNING) {
        if (outputs->fault == 0) {
            state->invalid_samples = 0u; /* the sample before was valid */
        }
        state->invalid_samples++;
        if (state->invalid_samples >= 2u) {
            state->mode = RIG_DFOB_HOLDING;
        }
    }
}

/* Set the state from a valid sample so that the estimates equal the held ones. */
static void rig_dfob_resume(rig_dfob_state *state, const rig_dfob_parameters *parameters,
    const rig_dfob_inputs *inputs, const rig_dfob_outputs *outputs)
{
    const double resumed_1 = inputs->theta + parameters->sample_time * outputs->omega_hat;
    state->z_omega = outputs->omega_hat - parameters->K_v * resumed_1;
    state->z_f_plates = outputs->f_hat_plates - parameters->K_f1 * resumed_1 - parameters->K_f2
        * outputs->omega_hat;
    state->z_a_plates = outputs->a_hat_plates - parameters->K_a * outputs->omega_hat * outputs->f_hat_plates;
    state->mode = RIG_DFOB_RUNNING;
    state->invalid_samples = 0u;
}

/* Handle an invalid sample, or an invalid state: hold the last estimates, and set the state for the next sample. */
static RIG_DFOB_COLD void rig_dfob_handle_fault(rig_dfob_state *state,
    const rig_dfob_parameters *parameters, const rig_dfob_inputs *inputs, rig_dfob_outputs *outputs)
{
    const double given = fabs(inputs->theta) + fabs(inputs->w);
    if (!(fabs(given) <= 1e+150)) {
        /* invalid sample */
        if (state->mode != RIG_DFOB_STARTING) {
            rig_dfob_predict(state, parameters, outputs);
        }
    } else if (state->mode == RIG_DFOB_HOLDING) {
        /* first valid sample after many invalid ones */
        rig_dfob_resume(state, parameters, inputs, outputs);
    } else {
        /* first valid sample of all, or an invalid state */
        rig_dfob_init(state, parameters, inputs);
    }
    outputs->fault = 1;
}

void rig_dfob_step(rig_dfob_state *state, const rig_dfob_parameters *parameters,
    const rig_dfob_inputs *inputs, rig_dfob_outputs *outputs)
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
    const double f_rate_plates = parameters->plates_c * omega_hat * (1.0 - rig_dfob_sign(omega_hat)
        * f_hat_plates); /* 1/s */

    /* states one sample later (explicit Euler) */
    const double z_omega_next = state->z_omega + parameters->sample_time * (omega_dot_hat - parameters->K_v
        * omega_hat);
    const double z_f_plates_next = state->z_f_plates + parameters->sample_time * (f_rate_plates
        - parameters->K_f1 * omega_hat - parameters->K_f2 * omega_dot_hat);
    const double z_a_plates_next = state->z_a_plates - parameters->h_K_a * (f_hat_plates * omega_dot_hat
        + omega_hat * f_rate_plates);

    /* this sum is too large or NaN if a next state is, or an input or output on which no next state depends */
    const double check = z_omega_next + z_f_plates_next + z_a_plates_next;
    if (fabs(check) <= 1e+150 && state->mode == RIG_DFOB_RUNNING) {
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
        rig_dfob_handle_fault(state, parameters, inputs, outputs);
    }
}
