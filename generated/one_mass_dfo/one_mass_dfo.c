/*
 * one_mass_dfo: friction observer DFO, velocity estimated, double precision.
 * A step: 18 additions, 20 multiplications, 0 divisions, 0 calls, 2 of sign or magnitude.
 *
 * Made by stiction 0.1.0 from one_mass_dfo.yaml
 * sha256 762cb0fe635cadf0ec9ed26bd15d18fe482c70acc287a26e516008fdf2427ed9
 * with: stiction generate one_mass_dfo.yaml
 */
#include "one_mass_dfo.h"

#include <math.h>

#if defined(__clang__)
#pragma STDC FP_CONTRACT OFF
#endif

#if defined(__GNUC__)
#define ONE_MASS_DFO_COLD __attribute__((noinline, cold))
#else
#define ONE_MASS_DFO_COLD
#endif

void one_mass_dfo_prepare(one_mass_dfo_parameters *parameters)
{
    parameters->one_over_m = 1.0 / parameters->m;
    parameters->rail_D1_minus_rail_D2 = parameters->rail_D1 - parameters->rail_D2;
    parameters->h_K_a = parameters->sample_time * parameters->K_a;
}

void one_mass_dfo_init(one_mass_dfo_state *state, const one_mass_dfo_parameters *parameters,
    const one_mass_dfo_inputs *inputs)
{
    state->z_v = -(parameters->K_v * inputs->x);
    state->z_f_rail = -(parameters->K_f1 * inputs->x);
    state->z_a_rail = parameters->rail_a;
    state->mode = ONE_MASS_DFO_RUNNING;
    state->invalid_samples = 0u;

    /* if the measurement is invalid, wait for the first valid one */
    const double check = fabs(inputs->x) + fabs(inputs->w) + fabs(state->z_v) + fabs(state->z_f_rail)
        + fabs(state->z_a_rail);
    if (!(fabs(check) <= 1e+150)) {
        state->z_v = 0.0;
        state->z_f_rail = 0.0;
        state->z_a_rail = 0.0;
        state->mode = ONE_MASS_DFO_STARTING;
    }
}

/* Predict the state over an invalid sample, as if the machine moved at the held velocity estimate. */
static void one_mass_dfo_predict(one_mass_dfo_state *state, const one_mass_dfo_parameters *parameters,
    const one_mass_dfo_outputs *outputs)
{
    state->z_v = state->z_v - parameters->sample_time * parameters->K_v * outputs->v_hat;
    state->z_f_rail = state->z_f_rail - parameters->sample_time * parameters->K_f1 * outputs->v_hat;

    /* after 8 invalid samples in a row, resume from the next valid one */
    if (state->mode == ONE_MASS_DFO_RUNNING) {
        if (outputs->fault == 0) {
            state->invalid_samples = 0u; /* the sample before was valid */
        }
        state->invalid_samples++;
        if (state->invalid_samples >= 8u) {
            state->mode = ONE_MASS_DFO_HOLDING;
        }
    }
}

/* Set the state from a valid sample so that the estimates equal the held ones. */
static void one_mass_dfo_resume(one_mass_dfo_state *state, const one_mass_dfo_parameters *parameters,
    const one_mass_dfo_inputs *inputs, const one_mass_dfo_outputs *outputs)
{
    const double resumed_1 = inputs->x + parameters->sample_time * outputs->v_hat;
    state->z_v = outputs->v_hat - parameters->K_v * resumed_1;
    state->z_f_rail = outputs->f_hat_rail - parameters->K_f1 * resumed_1 - parameters->K_f2 * outputs->v_hat;
    state->z_a_rail = outputs->a_hat_rail - parameters->K_a * outputs->v_hat * outputs->f_hat_rail;
    state->mode = ONE_MASS_DFO_RUNNING;
    state->invalid_samples = 0u;
}

/* Handle an invalid sample, or an invalid state: hold the last estimates, and set the state for the next sample. */
static ONE_MASS_DFO_COLD void one_mass_dfo_handle_fault(one_mass_dfo_state *state,
    const one_mass_dfo_parameters *parameters, const one_mass_dfo_inputs *inputs, one_mass_dfo_outputs *outputs)
{
    const double given = fabs(inputs->x) + fabs(inputs->w);
    if (!(fabs(given) <= 1e+150)) {
        /* invalid sample */
        if (state->mode != ONE_MASS_DFO_STARTING) {
            one_mass_dfo_predict(state, parameters, outputs);
        }
    } else if (state->mode == ONE_MASS_DFO_HOLDING) {
        /* first valid sample after many invalid ones */
        one_mass_dfo_resume(state, parameters, inputs, outputs);
    } else {
        /* first valid sample of all, or an invalid state */
        one_mass_dfo_init(state, parameters, inputs);
    }
    outputs->fault = 1;
}

void one_mass_dfo_step(one_mass_dfo_state *state, const one_mass_dfo_parameters *parameters,
    const one_mass_dfo_inputs *inputs, one_mass_dfo_outputs *outputs)
{
    /* velocity estimate, (4.25) */
    const double v_hat = state->z_v + parameters->K_v * inputs->x; /* m/s */

    /* friction state, (7.11) */
    const double f_hat_rail = state->z_f_rail + parameters->K_f1 * inputs->x + parameters->K_f2 * v_hat; /* 1 */

    /* friction level, (7.10) */
    const double a_hat_rail = state->z_a_rail + parameters->K_a * v_hat * f_hat_rail; /* N */

    /* contact friction, (7.12) */
    const double F_hat_rail = f_hat_rail * a_hat_rail; /* N */

    /* acceleration, (4.2) */
    const double v_dot_hat = parameters->one_over_m * (inputs->w - F_hat_rail); /* m/s^2 */

    /* friction state rate, xi_1 of (6.5), (6.6) */
    const double f_rate_rail = parameters->rail_c * (v_hat - parameters->rail_D2 * f_hat_rail
        - parameters->rail_D1_minus_rail_D2 * (f_hat_rail + 0.5 * fabs(f_hat_rail - 1.0) - 0.5 * fabs(1.0
        + f_hat_rail))); /* 1/s */

    /* states one sample later (explicit Euler) */
    const double z_v_next = state->z_v + parameters->sample_time * (v_dot_hat - parameters->K_v * v_hat);
    const double z_f_rail_next = state->z_f_rail + parameters->sample_time * (f_rate_rail - parameters->K_f1
        * v_hat - parameters->K_f2 * v_dot_hat);
    const double z_a_rail_next = state->z_a_rail - parameters->h_K_a * (f_hat_rail * v_dot_hat + v_hat
        * f_rate_rail);

    /* this sum is too large or NaN if a next state is, or an input or output on which no next state depends */
    const double check = z_v_next + z_f_rail_next + z_a_rail_next;
    if (fabs(check) <= 1e+150 && state->mode == ONE_MASS_DFO_RUNNING) {
        outputs->v_hat = v_hat;
        outputs->f_hat_rail = f_hat_rail;
        outputs->a_hat_rail = a_hat_rail;
        outputs->F_hat_rail = F_hat_rail;
        outputs->F_hat_on_x = F_hat_rail;

        state->z_v = z_v_next;
        state->z_f_rail = z_f_rail_next;
        state->z_a_rail = z_a_rail_next;
        outputs->fault = 0;
    } else {
        one_mass_dfo_handle_fault(state, parameters, inputs, outputs);
    }
}
