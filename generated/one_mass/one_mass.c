/*
 * one_mass: friction observer CFO, velocity estimated, double precision.
 * A step: 6 additions, 8 multiplications, 0 divisions, 0 calls, 2 of sign or magnitude.
 *
 * Made by stiction 0.1.0 from one_mass.yaml
 * sha256 f35d28fd5d082a4348c6e3c2db950b3ab2e9329228ae1cac120397be24e3f251
 * with: stiction generate one_mass.yaml
 */
#include "one_mass.h"

#include <math.h>

#if defined(__clang__)
#pragma STDC FP_CONTRACT OFF
#endif

#if defined(__GNUC__)
#define ONE_MASS_COLD __attribute__((noinline, cold))
#else
#define ONE_MASS_COLD
#endif

static inline double one_mass_sign(double u)
{
    return (u > 0.0) ? 1.0 : ((u < 0.0) ? -1.0 : 0.0);
}

void one_mass_prepare(one_mass_parameters *parameters)
{
    parameters->one_over_m = 1.0 / parameters->m;
    parameters->h_K_F = parameters->sample_time * parameters->K_F;
}

void one_mass_init(one_mass_state *state, const one_mass_parameters *parameters,
    const one_mass_inputs *inputs)
{
    state->z_v = -(parameters->K_v * inputs->x);
    state->z_rail = parameters->rail_a;
    state->mode = ONE_MASS_RUNNING;
    state->invalid_samples = 0u;

    /* if the measurement is invalid, wait for the first valid one */
    const double check = fabs(inputs->x) + fabs(inputs->w) + fabs(state->z_v) + fabs(state->z_rail);
    if (!(fabs(check) <= 1e+150)) {
        state->z_v = 0.0;
        state->z_rail = 0.0;
        state->mode = ONE_MASS_STARTING;
    }
}

/* Predict the state over an invalid sample, as if the machine moved at the held velocity estimate. */
static void one_mass_predict(one_mass_state *state, const one_mass_parameters *parameters,
    const one_mass_outputs *outputs)
{
    state->z_v = state->z_v - parameters->sample_time * parameters->K_v * outputs->v_hat;

    /* after 8 invalid samples in a row, resume from the next valid one */
    if (state->mode == ONE_MASS_RUNNING) {
        if (outputs->fault == 0) {
            state->invalid_samples = 0u; /* the sample before was valid */
        }
        state->invalid_samples++;
        if (state->invalid_samples >= 8u) {
            state->mode = ONE_MASS_HOLDING;
        }
    }
}

/* Set the state from a valid sample so that the estimates equal the held ones. */
static void one_mass_resume(one_mass_state *state, const one_mass_parameters *parameters,
    const one_mass_inputs *inputs, const one_mass_outputs *outputs)
{
    state->z_v = outputs->v_hat - parameters->K_v * (inputs->x + parameters->sample_time * outputs->v_hat);
    state->z_rail = outputs->a_hat_rail + parameters->K_F * fabs(outputs->v_hat);
    state->mode = ONE_MASS_RUNNING;
    state->invalid_samples = 0u;
}

/* Handle an invalid sample, or an invalid state: hold the last estimates, and set the state for the next sample. */
static ONE_MASS_COLD void one_mass_handle_fault(one_mass_state *state,
    const one_mass_parameters *parameters, const one_mass_inputs *inputs, one_mass_outputs *outputs)
{
    const double given = fabs(inputs->x) + fabs(inputs->w);
    if (!(fabs(given) <= 1e+150)) {
        /* invalid sample */
        if (state->mode != ONE_MASS_STARTING) {
            one_mass_predict(state, parameters, outputs);
        }
    } else if (state->mode == ONE_MASS_HOLDING) {
        /* first valid sample after many invalid ones */
        one_mass_resume(state, parameters, inputs, outputs);
    } else {
        /* first valid sample of all, or an invalid state */
        one_mass_init(state, parameters, inputs);
    }
    outputs->fault = 1;
}

void one_mass_step(one_mass_state *state, const one_mass_parameters *parameters,
    const one_mass_inputs *inputs, one_mass_outputs *outputs)
{
    /* velocity estimate, (4.25) */
    const double v_hat = state->z_v + parameters->K_v * inputs->x; /* m/s */

    /* slip sign, (4.13) */
    const double sign_rail = one_mass_sign(v_hat); /* 1 */

    /* friction level, (4.11) */
    const double a_hat_rail = state->z_rail - parameters->K_F * fabs(v_hat); /* N */

    /* contact friction, (4.10) */
    const double F_hat_rail = sign_rail * a_hat_rail; /* N */

    /* acceleration, (4.2) */
    const double v_dot_hat = parameters->one_over_m * (inputs->w - F_hat_rail); /* m/s^2 */

    /* states one sample later (explicit Euler) */
    const double z_v_next = state->z_v + parameters->sample_time * (v_dot_hat - parameters->K_v * v_hat);
    const double z_rail_next = state->z_rail + parameters->h_K_F * sign_rail * v_dot_hat;

    /* this sum is too large or NaN if a next state is, or an input or output on which no next state depends */
    const double check = z_v_next + z_rail_next;
    if (fabs(check) <= 1e+150 && state->mode == ONE_MASS_RUNNING) {
        outputs->v_hat = v_hat;
        outputs->a_hat_rail = a_hat_rail;
        outputs->F_hat_rail = F_hat_rail;
        outputs->F_hat_on_x = F_hat_rail;

        state->z_v = z_v_next;
        state->z_rail = z_rail_next;
        outputs->fault = 0;
    } else {
        one_mass_handle_fault(state, parameters, inputs, outputs);
    }
}
