/*
 * rig: friction observer CFO, velocity estimated, double precision.
 * A step: 6 additions, 8 multiplications, 0 divisions, 0 calls, 2 of sign or magnitude.
 *
 * Made by stiction 0.1.0 from rig.yaml
 * sha256 f86bd8b1a92165fc8be5068dad91ef4dc02dd84ee43c29f9621a6f3ae7dc1e8a
 * with: stiction generate rig.yaml
 */
#include "rig.h"

#include <math.h>

#if defined(__clang__)
#pragma STDC FP_CONTRACT OFF
#endif

#if defined(__GNUC__)
#define RIG_COLD __attribute__((noinline, cold))
#else
#define RIG_COLD
#endif

static inline double rig_sign(double u)
{
    return (u > 0.0) ? 1.0 : ((u < 0.0) ? -1.0 : 0.0);
}

void rig_prepare(rig_parameters *parameters)
{
    parameters->one_over_J = 1.0 / parameters->J;
    parameters->h_K_F = parameters->sample_time * parameters->K_F;
}

void rig_init(rig_state *state, const rig_parameters *parameters,
    const rig_inputs *inputs)
{
    state->z_omega = -(parameters->K_v * inputs->theta);
    state->z_plates = parameters->plates_a;
    state->mode = RIG_RUNNING;
    state->invalid_samples = 0u;

    /* if the measurement is invalid, wait for the first valid one */
    const double check = fabs(inputs->theta) + fabs(inputs->w) + fabs(state->z_omega) + fabs(state->z_plates);
    if (!(fabs(check) <= 1e+150)) {
        state->z_omega = 0.0;
        state->z_plates = 0.0;
        state->mode = RIG_STARTING;
    }
}

/* Predict the state over an invalid sample, as if the machine moved at the held velocity estimate. */
static void rig_predict(rig_state *state, const rig_parameters *parameters,
    const rig_outputs *outputs)
{
    state->z_omega = state->z_omega - parameters->sample_time * parameters->K_v * outputs->omega_hat;

    /* after 2 invalid samples in a row, resume from the next valid one */
    if (state->mode == RIG_RUNNING) {
        if (outputs->fault == 0) {
            state->invalid_samples = 0u; /* the sample before was valid */
        }
        state->invalid_samples++;
        if (state->invalid_samples >= 2u) {
            state->mode = RIG_HOLDING;
        }
    }
}

/* Set the state from a valid sample so that the estimates equal the held ones. */
static void rig_resume(rig_state *state, const rig_parameters *parameters,
    const rig_inputs *inputs, const rig_outputs *outputs)
{
    state->z_omega = outputs->omega_hat - parameters->K_v * (inputs->theta + parameters->sample_time
        * outputs->omega_hat);
    state->z_plates = outputs->a_hat_plates + parameters->K_F * fabs(outputs->omega_hat);
    state->mode = RIG_RUNNING;
    state->invalid_samples = 0u;
}

/* Handle an invalid sample, or an invalid state: hold the last estimates, and set the state for the next sample. */
static RIG_COLD void rig_handle_fault(rig_state *state,
    const rig_parameters *parameters, const rig_inputs *inputs, rig_outputs *outputs)
{
    const double given = fabs(inputs->theta) + fabs(inputs->w);
    if (!(fabs(given) <= 1e+150)) {
        /* invalid sample */
        if (state->mode != RIG_STARTING) {
            rig_predict(state, parameters, outputs);
        }
    } else if (state->mode == RIG_HOLDING) {
        /* first valid sample after many invalid ones */
        rig_resume(state, parameters, inputs, outputs);
    } else {
        /* first valid sample of all, or an invalid state */
        rig_init(state, parameters, inputs);
    }
    outputs->fault = 1;
}

void rig_step(rig_state *state, const rig_parameters *parameters,
    const rig_inputs *inputs, rig_outputs *outputs)
{
    /* velocity estimate, (4.25) */
    const double omega_hat = state->z_omega + parameters->K_v * inputs->theta; /* rad/s */

    /* slip sign, (4.13) */
    const double sign_plates = rig_sign(omega_hat); /* 1 */

    /* friction level, (4.11) */
    const double a_hat_plates = state->z_plates - parameters->K_F * fabs(omega_hat); /* N*m */

    /* contact friction, (4.10) */
    const double F_hat_plates = sign_plates * a_hat_plates; /* N*m */

    /* acceleration, (4.2) */
    const double omega_dot_hat = parameters->one_over_J * (inputs->w - F_hat_plates); /* rad/s^2 */

    /* states one sample later (explicit Euler) */
    const double z_omega_next = state->z_omega + parameters->sample_time * (omega_dot_hat - parameters->K_v
        * omega_hat);
    const double z_plates_next = state->z_plates + parameters->h_K_F * sign_plates * omega_dot_hat;

    /* this sum is too large or NaN if a next state is, or an input or output on which no next state depends */
    const double check = z_omega_next + z_plates_next;
    if (fabs(check) <= 1e+150 && state->mode == RIG_RUNNING) {
        outputs->omega_hat = omega_hat;
        outputs->a_hat_plates = a_hat_plates;
        outputs->F_hat_plates = F_hat_plates;
        outputs->F_hat_on_theta = F_hat_plates;

        state->z_omega = z_omega_next;
        state->z_plates = z_plates_next;
        outputs->fault = 0;
    } else {
        rig_handle_fault(state, parameters, inputs, outputs);
    }
}
