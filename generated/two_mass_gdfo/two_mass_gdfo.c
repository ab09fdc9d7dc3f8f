/*
 * two_mass_gdfo: friction observer GDFO, velocity estimated, double precision.
 * A step: 42 additions, 44 multiplications, 0 divisions, 0 calls, 4 of sign or magnitude.
 *
 * Made by stiction 0.1.0 from two_mass_gdfo.yaml
 * sha256 7d02c83e0b5f919a9fb44a751f66f366eab47db73186cc4e84137a69465b93fc
 * with: stiction generate two_mass_gdfo.yaml
 */
#include "two_mass_gdfo.h"

#include <math.h>

#if defined(__clang__)
#pragma STDC FP_CONTRACT OFF
#endif

#if defined(__GNUC__)
#define TWO_MASS_GDFO_COLD __attribute__((noinline, cold))
#else
#define TWO_MASS_GDFO_COLD
#endif

void two_mass_gdfo_prepare(two_mass_gdfo_parameters *parameters)
{
    parameters->eta2_plus_eta3 = parameters->eta2 + parameters->eta3;
    parameters->eta1_plus_eta3 = parameters->eta1 + parameters->eta3;
    parameters->one_over_m1 = 1.0 / parameters->m1;
    parameters->one_over_m2 = 1.0 / parameters->m2;
    parameters->between_D1_minus_between_D2 = parameters->between_D1 - parameters->between_D2;
    parameters->ground_D1_minus_ground_D2 = parameters->ground_D1 - parameters->ground_D2;
    parameters->h_K_a_between = parameters->sample_time * parameters->K_a_between;
    parameters->h_K_a_ground = parameters->sample_time * parameters->K_a_ground;
}

void two_mass_gdfo_init(two_mass_gdfo_state *state, const two_mass_gdfo_parameters *parameters,
    const two_mass_gdfo_inputs *inputs)
{
    state->z_v1 = -(parameters->K_v_v1 * inputs->x1);
    state->z_v2 = -(parameters->K_v_v2 * inputs->x2);
    state->z_f_between = -(parameters->K_f1_between * inputs->x1);
    state->z_f_ground = -(parameters->K_f1_ground * inputs->x2);
    state->z_a_between = parameters->between_a;
    state->z_a_ground = parameters->ground_a;
    state->mode = TWO_MASS_GDFO_RUNNING;
    state->invalid_samples = 0u;

    /* if the measurement is invalid, wait for the first valid one */
    const double check = fabs(inputs->x1) + fabs(inputs->x2) + fabs(inputs->w) + fabs(state->z_v1)
        + fabs(state->z_v2) + fabs(state->z_f_between) + fabs(state->z_f_ground) + fabs(state->z_a_between)
        + fabs(state->z_a_ground);
    if (!(fabs(check) <= 1e+150)) {
        state->z_v1 = 0.0;
        state->z_v2 = 0.0;
        state->z_f_between = 0.0;
        state->z_f_ground = 0.0;
        state->z_a_between = 0.0;
        state->z_a_ground = 0.0;
        state->mode = TWO_MASS_GDFO_STARTING;
    }
}

/* Predict the state over an invalid sample, as if the machine moved at the held velocity estimate. */
static void two_mass_gdfo_predict(two_mass_gdfo_state *state, const two_mass_gdfo_parameters *parameters,
    const two_mass_gdfo_outputs *outputs)
{
    state->z_v1 = state->z_v1 - parameters->sample_time * parameters->K_v_v1 * outputs->v1_hat;
    state->z_v2 = state->z_v2 - parameters->sample_time * parameters->K_v_v2 * outputs->v2_hat;
    state->z_f_between = state->z_f_between - parameters->sample_time * parameters->K_f1_between
        * outputs->v1_hat;
    state->z_f_ground = state->z_f_ground - parameters->sample_time * parameters->K_f1_ground * outputs->v2_hat;

    /* after 8 invalid samples in a row, resume from the next valid one */
    if (state->mode == TWO_MASS_GDFO_RUNNING) {
        if (outputs->fault == 0) {
            state->invalid_samples = 0u; /* the sample before was valid */
        }
        state->invalid_samples++;
        if (state->invalid_samples >= 8u) {
            state->mode = TWO_MASS_GDFO_HOLDING;
        }
    }
}

/* Set the state from a valid sample so that the estimates equal the held ones. */
static void two_mass_gdfo_resume(two_mass_gdfo_state *state, const two_mass_gdfo_parameters *parameters,
    const two_mass_gdfo_inputs *inputs, const two_mass_gdfo_outputs *outputs)
{
    const double resumed_1 = inputs->x1 + parameters->sample_time * outputs->v1_hat;
    const double resumed_2 = inputs->x2 + parameters->sample_time * outputs->v2_hat;
    state->z_v1 = outputs->v1_hat - parameters->K_v_v1 * resumed_1;
    state->z_v2 = outputs->v2_hat - parameters->K_v_v2 * resumed_2;
    state->z_f_between = outputs->f_hat_between - parameters->K_f1_between * resumed_1
        - parameters->K_f2_between * outputs->v1_hat;
    state->z_f_ground = outputs->f_hat_ground - parameters->K_f1_ground * resumed_2 - parameters->K_f2_ground
        * outputs->v2_hat;
    state->z_a_between = outputs->a_hat_between - parameters->K_a_between * outputs->f_hat_between
        * (outputs->v1_hat - outputs->v2_hat);
    state->z_a_ground = outputs->a_hat_ground - parameters->K_a_ground * outputs->v2_hat * outputs->f_hat_ground;
    state->mode = TWO_MASS_GDFO_RUNNING;
    state->invalid_samples = 0u;
}

/* Handle an invalid sample, or an invalid state: hold the last estimates, and set the state for the next sample. */
static TWO_MASS_GDFO_COLD void two_mass_gdfo_handle_fault(two_mass_gdfo_state *state,
    const two_mass_gdfo_parameters *parameters, const two_mass_gdfo_inputs *inputs, two_mass_gdfo_outputs *outputs)
{
    const double given = fabs(inputs->x1) + fabs(inputs->x2) + fabs(inputs->w);
    if (!(fabs(given) <= 1e+150)) {
        /* invalid sample */
        if (state->mode != TWO_MASS_GDFO_STARTING) {
            two_mass_gdfo_predict(state, parameters, outputs);
        }
    } else if (state->mode == TWO_MASS_GDFO_HOLDING) {
        /* first valid sample after many invalid ones */
        two_mass_gdfo_resume(state, parameters, inputs, outputs);
    } else {
        /* first valid sample of all, or an invalid state */
        two_mass_gdfo_init(state, parameters, inputs);
    }
    outputs->fault = 1;
}

void two_mass_gdfo_step(two_mass_gdfo_state *state, const two_mass_gdfo_parameters *parameters,
    const two_mass_gdfo_inputs *inputs, two_mass_gdfo_outputs *outputs)
{
    /* velocity estimate, (4.25) */
    const double v1_hat = state->z_v1 + parameters->K_v_v1 * inputs->x1; /* m/s */
    const double v2_hat = state->z_v2 + parameters->K_v_v2 * inputs->x2; /* m/s */

    /* slip velocity, U' v, (4.5) */
    const double slip_between = v1_hat - v2_hat; /* m/s */

    /* friction state, (7.11) */
    const double f_hat_between = state->z_f_between + parameters->K_f1_between * inputs->x1
        + parameters->K_f2_between * v1_hat; /* 1 */
    const double f_hat_ground = state->z_f_ground + parameters->K_f1_ground * inputs->x2
        + parameters->K_f2_ground * v2_hat; /* 1 */

    /* friction level, (7.10) */
    const double a_hat_between = state->z_a_between + parameters->K_a_between * slip_between * f_hat_between; /* N */
    const double a_hat_ground = state->z_a_ground + parameters->K_a_ground * v2_hat * f_hat_ground; /* N */

    /* contact friction, (7.12) */
    const double F_hat_between = f_hat_between * a_hat_between; /* N */
    const double F_hat_ground = f_hat_ground * a_hat_ground; /* N */

    /* friction force, (7.12) */
    const double F_hat_on_x2 = F_hat_ground - F_hat_between; /* N */

    /* acceleration, (4.2) */
    const double v1_dot_hat = parameters->one_over_m1 * (parameters->eta3 * inputs->x2
        - parameters->eta2_plus_eta3 * inputs->x1 - F_hat_between); /* m/s^2 */
    const double v2_dot_hat = parameters->one_over_m2 * (inputs->w + parameters->eta3 * inputs->x1
        - F_hat_on_x2 - parameters->eta1_plus_eta3 * inputs->x2); /* m/s^2 */

    /* friction state rate, xi_1 of (6.5), (6.6) */
    const double f_rate_between = parameters->between_c * (slip_between - parameters->between_D2
        * f_hat_between - parameters->between_D1_minus_between_D2 * (f_hat_between + 0.5 * fabs(f_hat_between
        - 1.0) - 0.5 * fabs(1.0 + f_hat_between))); /* 1/s */
    const double f_rate_ground = parameters->ground_c * (v2_hat - parameters->ground_D2 * f_hat_ground
        - parameters->ground_D1_minus_ground_D2 * (f_hat_ground + 0.5 * fabs(f_hat_ground - 1.0) - 0.5
        * fabs(1.0 + f_hat_ground))); /* 1/s */

    /* states one sample later (explicit Euler) */
    const double z_v1_next = state->z_v1 + parameters->sample_time * (v1_dot_hat - parameters->K_v_v1 * v1_hat);
    const double z_v2_next = state->z_v2 + parameters->sample_time * (v2_dot_hat - parameters->K_v_v2 * v2_hat);
    const double z_f_between_next = state->z_f_between + parameters->sample_time * (f_rate_between
        - parameters->K_f1_between * v1_hat - parameters->K_f2_between * v1_dot_hat);
    const double z_f_ground_next = state->z_f_ground + parameters->sample_time * (f_rate_ground
        - parameters->K_f1_ground * v2_hat - parameters->K_f2_ground * v2_dot_hat);
    const double z_a_between_next = state->z_a_between - parameters->h_K_a_between * (f_hat_between
        * (v1_dot_hat - v2_dot_hat) + slip_between * f_rate_between);
    const double z_a_ground_next = state->z_a_ground - parameters->h_K_a_ground * (f_hat_ground * v2_dot_hat
        + v2_hat * f_rate_ground);

    /* this sum is too large or NaN if a next state is, or an input or output on which no next state depends */
    const double check = z_v1_next + z_v2_next + z_f_between_next + z_f_ground_next + z_a_between_next
        + z_a_ground_next;
    if (fabs(check) <= 1e+150 && state->mode == TWO_MASS_GDFO_RUNNING) {
        outputs->v1_hat = v1_hat;
        outputs->v2_hat = v2_hat;
        outputs->f_hat_between = f_hat_between;
        outputs->f_hat_ground = f_hat_ground;
        outputs->a_hat_between = a_hat_between;
        outputs->a_hat_ground = a_hat_ground;
        outputs->F_hat_between = F_hat_between;
        outputs->F_hat_ground = F_hat_ground;
        outputs->F_hat_on_x1 = F_hat_between;
        outputs->F_hat_on_x2 = F_hat_on_x2;

        state->z_v1 = z_v1_next;
        state->z_v2 = z_v2_next;
        state->z_f_between = z_f_between_next;
        state->z_f_ground = z_f_ground_next;
        state->z_a_between = z_a_between_next;
        state->z_a_ground = z_a_ground_next;
        outputs->fault = 0;
    } else {
        two_mass_gdfo_handle_fault(state, parameters, inputs, outputs);
    }
}
