/*
 * two_mass: friction observer GCFO, velocity estimated, double precision.
 * A step: 18 additions, 20 multiplications, 0 divisions, 0 calls, 4 of sign or magnitude.
 *
 * Made by stiction 0.1.0 from two_mass.yaml
 * sha256 5d108a0c2b344775326f5cfaa6fd42c8eb9332c34c728456b6a6b3d0f61c8c7a
 * with: stiction generate two_mass.yaml
 */
#include "two_mass.h"

#include <math.h>

#if defined(__clang__)
#pragma STDC FP_CONTRACT OFF
#endif

#if defined(__GNUC__)
#define TWO_MASS_COLD __attribute__((noinline, cold))
#else
#define TWO_MASS_COLD
#endif

static inline double two_mass_sign(double u)
{
    return (u > 0.0) ? 1.0 : ((u < 0.0) ? -1.0 : 0.0);
}

void two_mass_prepare(two_mass_parameters *parameters)
{
    parameters->eta2_plus_eta3 = parameters->eta2 + parameters->eta3;
    parameters->eta1_plus_eta3 = parameters->eta1 + parameters->eta3;
    parameters->one_over_m1 = 1.0 / parameters->m1;
    parameters->one_over_m2 = 1.0 / parameters->m2;
    parameters->h_K_F_between = parameters->sample_time * parameters->K_F_between;
    parameters->h_K_F_ground = parameters->sample_time * parameters->K_F_ground;
}

void two_mass_init(two_mass_state *state, const two_mass_parameters *parameters,
    const two_mass_inputs *inputs)
{
    state->z_v1 = -(parameters->K_v_v1 * inputs->x1);
    state->z_v2 = -(parameters->K_v_v2 * inputs->x2);
    state->z_between = parameters->between_a;
    state->z_ground = parameters->ground_a;
    state->mode = TWO_MASS_RUNNING;
    state->invalid_samples = 0u;

    /* if the measurement is invalid, wait for the first valid one */
    const double check = fabs(inputs->x1) + fabs(inputs->x2) + fabs(inputs->w) + fabs(state->z_v1)
        + fabs(state->z_v2) + fabs(state->z_between) + fabs(state->z_ground);
    if (!(fabs(check) <= 1e+150)) {
        state->z_v1 = 0.0;
        state->z_v2 = 0.0;
        state->z_between = 0.0;
        state->z_ground = 0.0;
        state->mode = TWO_MASS_STARTING;
    }
}

/* Predict the state over an invalid sample, as if the machine moved at the held velocity estimate. */
static void two_mass_predict(two_mass_state *state, const two_mass_parameters *parameters,
    const two_mass_outputs *outputs)
{
    state->z_v1 = state->z_v1 - parameters->sample_time * parameters->K_v_v1 * outputs->v1_hat;
    state->z_v2 = state->z_v2 - parameters->sample_time * parameters->K_v_v2 * outputs->v2_hat;

    /* after 8 invalid samples in a row, resume from the next valid one */
    if (state->mode == TWO_MASS_RUNNING) {
        if (outputs->fault == 0) {
            state->invalid_samples = 0u; /* the sample before was valid */
        }
        state->invalid_samples++;
        if (state->invalid_samples >= 8u) {
            state->mode = TWO_MASS_HOLDING;
        }
    }
}

/* Set the state from a valid sample so that the estimates equal the held ones. */
static void two_mass_resume(two_mass_state *state, const two_mass_parameters *parameters,
    const two_mass_inputs *inputs, const two_mass_outputs *outputs)
{
    state->z_v1 = outputs->v1_hat - parameters->K_v_v1 * (inputs->x1 + parameters->sample_time
        * outputs->v1_hat);
    state->z_v2 = outputs->v2_hat - parameters->K_v_v2 * (inputs->x2 + parameters->sample_time
        * outputs->v2_hat);
    state->z_between = outputs->a_hat_between + parameters->K_F_between * fabs(outputs->v1_hat
        - outputs->v2_hat);
    state->z_ground = outputs->a_hat_ground + parameters->K_F_ground * fabs(outputs->v2_hat);
    state->mode = TWO_MASS_RUNNING;
    state->invalid_samples = 0u;
}

/* Handle an invalid sample, or an invalid state: hold the last estimates, and set the state for the next sample. */
static TWO_MASS_COLD void two_mass_handle_fault(two_mass_state *state,
    const two_mass_parameters *parameters, const two_mass_inputs *inputs, two_mass_outputs *outputs)
{
    const double given = fabs(inputs->x1) + fabs(inputs->x2) + fabs(inputs->w);
    if (!(fabs(given) <= 1e+150)) {
        /* invalid sample */
        if (state->mode != TWO_MASS_STARTING) {
            two_mass_predict(state, parameters, outputs);
        }
    } else if (state->mode == TWO_MASS_HOLDING) {
        /* first valid sample after many invalid ones */
        two_mass_resume(state, parameters, inputs, outputs);
    } else {
        /* first valid sample of all, or an invalid state */
        two_mass_init(state, parameters, inputs);
    }
    outputs->fault = 1;
}

void two_mass_step(two_mass_state *state, const two_mass_parameters *parameters,
    const two_mass_inputs *inputs, two_mass_outputs *outputs)
{
    /* velocity estimate, (4.25) */
    const double v1_hat = state->z_v1 + parameters->K_v_v1 * inputs->x1; /* m/s */
    const double v2_hat = state->z_v2 + parameters->K_v_v2 * inputs->x2; /* m/s */

    /* slip velocity, U' v, (4.5) */
    const double slip_between = v1_hat - v2_hat; /* m/s */

    /* slip sign, (4.13) */
    const double sign_between = two_mass_sign(slip_between); /* 1 */
    const double sign_ground = two_mass_sign(v2_hat); /* 1 */

    /* friction level, (4.11) */
    const double a_hat_between = state->z_between - parameters->K_F_between * fabs(slip_between); /* N */
    const double a_hat_ground = state->z_ground - parameters->K_F_ground * fabs(v2_hat); /* N */

    /* contact friction, (4.10) */
    const double F_hat_between = sign_between * a_hat_between; /* N */
    const double F_hat_ground = sign_ground * a_hat_ground; /* N */

    /* friction force, (4.10) */
    const double F_hat_on_x2 = F_hat_ground - F_hat_between; /* N */

    /* acceleration, (4.2) */
    const double v1_dot_hat = parameters->one_over_m1 * (parameters->eta3 * inputs->x2
        - parameters->eta2_plus_eta3 * inputs->x1 - F_hat_between); /* m/s^2 */
    const double v2_dot_hat = parameters->one_over_m2 * (inputs->w + parameters->eta3 * inputs->x1
        - F_hat_on_x2 - parameters->eta1_plus_eta3 * inputs->x2); /* m/s^2 */

    /* states one sample later (explicit Euler) */
    const double z_v1_next = state->z_v1 + parameters->sample_time * (v1_dot_hat - parameters->K_v_v1 * v1_hat);
    const double z_v2_next = state->z_v2 + parameters->sample_time * (v2_dot_hat - parameters->K_v_v2 * v2_hat);
    const double z_between_next = state->z_between + parameters->h_K_F_between * sign_between * (v1_dot_hat
        - v2_dot_hat);
    const double z_ground_next = state->z_ground + parameters->h_K_F_ground * sign_ground * v2_dot_hat;

    /* this sum is too large or NaN if a next state is, or an input or output on which no next state depends */
    const double check = z_v1_next + z_v2_next + z_between_next + z_ground_next;
    if (fabs(check) <= 1e+150 && state->mode == TWO_MASS_RUNNING) {
        outputs->v1_hat = v1_hat;
        outputs->v2_hat = v2_hat;
        outputs->a_hat_between = a_hat_between;
        outputs->a_hat_ground = a_hat_ground;
        outputs->F_hat_between = F_hat_between;
        outputs->F_hat_ground = F_hat_ground;
        outputs->F_hat_on_x1 = F_hat_between;
        outputs->F_hat_on_x2 = F_hat_on_x2;

        state->z_v1 = z_v1_next;
        state->z_v2 = z_v2_next;
        state->z_between = z_between_next;
        state->z_ground = z_ground_next;
        outputs->fault = 0;
    } else {
        two_mass_handle_fault(state, parameters, inputs, outputs);
    }
}
