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

/* Set the state from a measurement, at the first sample or anew. */
static void one_mass_dfo_start(one_mass_dfo_state *state, const one_mass_dfo_parameters *parameters,
    const one_mass_dfo_inputs *inputs)
{
    state->z_v = -(parameters->K_v * inputs->x);
    state->z_f_rail = -(parameters->K_f1 * inputs->x);
    state->z_a_rail = parameters->rail_a;

    /* where that cannot be used, wait for a good sample */
    const double check = inputs->x + inputs->w + state->z_v + state->z_f_rail + state->z_a_rail;
    state->waiting = 0.0;
    if (!(fabs(check) <= 1e+150)) {
        state->z_v = 0.0;
        state->z_f_rail = 0.0;
        state->z_a_rail = 0.0;
        state->waiting = 1.0;
    }
}

void one_mass_dfo_init(one_mass_dfo_state *state, const one_mass_dfo_parameters *parameters,
    const one_mass_dfo_inputs *inputs)
{
    one_mass_dfo_start(state, parameters, inputs);
}

/* A sample is lost: the machine is taken to go on with the velocity that is held, and the states with it. */
static void one_mass_dfo_miss(one_mass_dfo_state *state, const one_mass_dfo_parameters *parameters,
    const one_mass_dfo_outputs *outputs)
{
    state->z_v = state->z_v - parameters->sample_time * parameters->K_v * outputs->v_hat;
    state->z_f_rail = state->z_f_rail - parameters->sample_time * parameters->K_f1 * outputs->v_hat;

    /* after 8 in a row, wait for a good sample that sets the states anew */
    if (state->waiting < 0.5) {
        state->waiting = ((outputs->fault != 0) ? state->waiting : 0.0) + 0.0625;
    }
}

/* Set the state from a good sample after many that were lost, so that the estimates go on from those that are held. */
static void one_mass_dfo_resume(one_mass_dfo_state *state, const one_mass_dfo_parameters *parameters,
    const one_mass_dfo_inputs *inputs, const one_mass_dfo_outputs *outputs)
{
    const double resumed_1 = inputs->x + parameters->sample_time * outputs->v_hat;
    state->z_v = outputs->v_hat - parameters->K_v * resumed_1;
    state->z_f_rail = outputs->f_hat_rail - parameters->K_f1 * resumed_1 - parameters->K_f2 * outputs->v_hat;
    state->z_a_rail = outputs->a_hat_rail - parameters->K_a * outputs->v_hat * outputs->f_hat_rail;
    state->waiting = 0.0;
}

/* What becomes of the state where a sample is not used. */
static ONE_MASS_DFO_COLD void one_mass_dfo_set_anew(one_mass_dfo_state *state,
    const one_mass_dfo_parameters *parameters, const one_mass_dfo_inputs *inputs, one_mass_dfo_outputs *outputs)
{
    const double given = inputs->x + inputs->w;
    if (!(fabs(given) <= 1e+150)) {
        if (state->waiting < 0.75) {
            one_mass_dfo_miss(state, parameters, outputs);
        }
    } else if ((state->waiting < 0.5) || (state->waiting > 0.75)) {
        one_mass_dfo_start(state, parameters, inputs); /* the state cannot be used, or waits for its first sample */
    } else {
        one_mass_dfo_resume(state, parameters, inputs, outputs);
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

    /* hold the last state and estimates where a next state, or an input that it does not show, is too large or NaN */
    const double check = z_v_next + z_f_rail_next + z_a_rail_next;
    if (fabs(check) <= 1e+150 && state->waiting < 0.5) {
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
        one_mass_dfo_set_anew(state, parameters, inputs, outputs);
    }
}
