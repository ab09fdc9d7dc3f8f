/*
 * two_mass_gto: friction observer GTO, velocity estimated, double precision.
 * A step: 19 additions, 20 multiplications, 0 divisions, 0 calls, 0 of sign or magnitude.
 *
 * Made by stiction 0.1.0 from two_mass_gto.yaml
 * sha256 932bc20815ec1ae32f63ada9d5584caefed2b8701438129d726e5f8582fcbdaf
 * with: stiction generate two_mass_gto.yaml
 */
#include "two_mass_gto.h"

#include <math.h>

#if defined(__clang__)
#pragma STDC FP_CONTRACT OFF
#endif

#if defined(__GNUC__)
#define TWO_MASS_GTO_COLD __attribute__((noinline, cold))
#else
#define TWO_MASS_GTO_COLD
#endif

void two_mass_gto_prepare(two_mass_gto_parameters *parameters)
{
    parameters->eta2_plus_eta3 = parameters->eta2 + parameters->eta3;
    parameters->eta1_plus_eta3 = parameters->eta1 + parameters->eta3;
    parameters->one_over_m1 = 1.0 / parameters->m1;
    parameters->one_over_m2 = 1.0 / parameters->m2;
    parameters->h_K_1_x1 = parameters->sample_time * parameters->K_1_x1;
    parameters->h_K_2_x1 = parameters->sample_time * parameters->K_2_x1;
    parameters->h_K_1_x2 = parameters->sample_time * parameters->K_1_x2;
    parameters->h_K_2_x2 = parameters->sample_time * parameters->K_2_x2;
}

void two_mass_gto_init(two_mass_gto_state *state, const two_mass_gto_parameters *parameters,
    const two_mass_gto_inputs *inputs)
{
    state->z_v1 = -(parameters->K_v_v1 * inputs->x1);
    state->z_v2 = -(parameters->K_v_v2 * inputs->x2);
    state->z_x1 = -(parameters->K_1_x1 * inputs->x1);
    state->z_x2 = -(parameters->K_1_x2 * inputs->x2);
    state->mode = TWO_MASS_GTO_RUNNING;
    state->invalid_samples = 0u;

    /* if the measurement is invalid, wait for the first valid one */
    const double check = fabs(inputs->x1) + fabs(inputs->x2) + fabs(inputs->w) + fabs(state->z_v1)
        + fabs(state->z_v2) + fabs(state->z_x1) + fabs(state->z_x2);
    if (!(fabs(check) <= 1e+150)) {
        state->z_v1 = 0.0;
        state->z_v2 = 0.0;
        state->z_x1 = 0.0;
        state->z_x2 = 0.0;
        state->mode = TWO_MASS_GTO_STARTING;
    }
}

/* Predict the state over an invalid sample, as if the machine moved at the held velocity estimate. */
static void two_mass_gto_predict(two_mass_gto_state *state, const two_mass_gto_parameters *parameters,
    const two_mass_gto_outputs *outputs)
{
    state->z_v1 = state->z_v1 - parameters->sample_time * parameters->K_v_v1 * outputs->v1_hat;
    state->z_v2 = state->z_v2 - parameters->sample_time * parameters->K_v_v2 * outputs->v2_hat;
    state->z_x1 = state->z_x1 - parameters->h_K_1_x1 * outputs->v1_hat;
    state->z_x2 = state->z_x2 - parameters->h_K_1_x2 * outputs->v2_hat;

    /* after 8 invalid samples in a row, resume from the next valid one */
    if (state->mode == TWO_MASS_GTO_RUNNING) {
        if (outputs->fault == 0) {
            state->invalid_samples = 0u; /* the sample before was valid */
        }
        state->invalid_samples++;
        if (state->invalid_samples >= 8u) {
            state->mode = TWO_MASS_GTO_HOLDING;
        }
    }
}

/* Set the state from a valid sample so that the estimates equal the held ones. */
static void two_mass_gto_resume(two_mass_gto_state *state, const two_mass_gto_parameters *parameters,
    const two_mass_gto_inputs *inputs, const two_mass_gto_outputs *outputs)
{
    const double resumed_1 = inputs->x1 + parameters->sample_time * outputs->v1_hat;
    const double resumed_2 = inputs->x2 + parameters->sample_time * outputs->v2_hat;
    state->z_v1 = outputs->v1_hat - parameters->K_v_v1 * resumed_1;
    state->z_v2 = outputs->v2_hat - parameters->K_v_v2 * resumed_2;
    state->z_x1 = outputs->tracked_x1 - parameters->K_1_x1 * resumed_1 - parameters->K_2_x1 * outputs->v1_hat;
    state->z_x2 = outputs->tracked_x2 - parameters->K_1_x2 * resumed_2 - parameters->K_2_x2 * outputs->v2_hat;
    state->mode = TWO_MASS_GTO_RUNNING;
    state->invalid_samples = 0u;
}

/* Handle an invalid sample, or an invalid state: hold the last estimates, and set the state for the next sample. */
static TWO_MASS_GTO_COLD void two_mass_gto_handle_fault(two_mass_gto_state *state,
    const two_mass_gto_parameters *parameters, const two_mass_gto_inputs *inputs, two_mass_gto_outputs *outputs)
{
    const double given = fabs(inputs->x1) + fabs(inputs->x2) + fabs(inputs->w);
    if (!(fabs(given) <= 1e+150)) {
        /* invalid sample */
        if (state->mode != TWO_MASS_GTO_STARTING) {
            two_mass_gto_predict(state, parameters, outputs);
        }
    } else if (state->mode == TWO_MASS_GTO_HOLDING) {
        /* first valid sample after many invalid ones */
        two_mass_gto_resume(state, parameters, inputs, outputs);
    } else {
        /* first valid sample of all, or an invalid state */
        two_mass_gto_init(state, parameters, inputs);
    }
    outputs->fault = 1;
}

void two_mass_gto_step(two_mass_gto_state *state, const two_mass_gto_parameters *parameters,
    const two_mass_gto_inputs *inputs, two_mass_gto_outputs *outputs)
{
    /* velocity estimate, (4.25) */
    const double v1_hat = state->z_v1 + parameters->K_v_v1 * inputs->x1; /* m/s */
    const double v2_hat = state->z_v2 + parameters->K_v_v2 * inputs->x2; /* m/s */

    /* tracked friction, (4.16) */
    const double tracked_x1 = state->z_x1 + parameters->K_1_x1 * inputs->x1 + parameters->K_2_x1 * v1_hat; /* N */
    const double tracked_x2 = state->z_x2 + parameters->K_1_x2 * inputs->x2 + parameters->K_2_x2 * v2_hat; /* N */

    /* acceleration, (4.2) */
    const double v1_dot_hat = parameters->one_over_m1 * (parameters->eta3 * inputs->x2
        - parameters->eta2_plus_eta3 * inputs->x1 - tracked_x1); /* m/s^2 */
    const double v2_dot_hat = parameters->one_over_m2 * (inputs->w + parameters->eta3 * inputs->x1
        - tracked_x2 - parameters->eta1_plus_eta3 * inputs->x2); /* m/s^2 */

    /* states one sample later (explicit Euler) */
    const double z_v1_next = state->z_v1 + parameters->sample_time * (v1_dot_hat - parameters->K_v_v1 * v1_hat);
    const double z_v2_next = state->z_v2 + parameters->sample_time * (v2_dot_hat - parameters->K_v_v2 * v2_hat);
    const double z_x1_next = state->z_x1 - parameters->h_K_1_x1 * v1_hat - parameters->h_K_2_x1 * v1_dot_hat;
    const double z_x2_next = state->z_x2 - parameters->h_K_1_x2 * v2_hat - parameters->h_K_2_x2 * v2_dot_hat;

    /* this sum is too large or NaN if a next state is, or an input or output on which no next state depends */
    const double check = z_v1_next + z_v2_next + z_x1_next + z_x2_next;
    if (fabs(check) <= 1e+150 && state->mode == TWO_MASS_GTO_RUNNING) {
        outputs->v1_hat = v1_hat;
        outputs->v2_hat = v2_hat;
        outputs->tracked_x1 = tracked_x1;
        outputs->tracked_x2 = tracked_x2;
        outputs->F_hat_on_x1 = tracked_x1;
        outputs->F_hat_on_x2 = tracked_x2;

        state->z_v1 = z_v1_next;
        state->z_v2 = z_v2_next;
        state->z_x1 = z_x1_next;
        state->z_x2 = z_x2_next;
        outputs->fault = 0;
    } else {
        two_mass_gto_handle_fault(state, parameters, inputs, outputs);
    }
}
