/*
 * emps: friction observer GCFO, velocity estimated, double precision.
 * A step: 8 additions, 10 multiplications, 0 divisions, 0 calls, 2 of sign or magnitude.
 *
 * Made by stiction 0.1.0 from emps.yaml
 * sha256 6af290046ff97bda38cdd6b999da2562985f0f24de93aee566995a6b17c119de
 * with: stiction generate emps.yaml
 */
#include "emps.h"

#include <math.h>

#if defined(__clang__)
#pragma STDC FP_CONTRACT OFF
#endif

#if defined(__GNUC__)
#define EMPS_COLD __attribute__((noinline, cold))
#else
#define EMPS_COLD
#endif

static inline double emps_sign(double u)
{
    return (u > 0.0) ? 1.0 : ((u < 0.0) ? -1.0 : 0.0);
}

void emps_prepare(emps_parameters *parameters)
{
    parameters->one_over_M = 1.0 / parameters->M;
    parameters->h_K_F = parameters->sample_time * parameters->K_F;
}

void emps_init(emps_state *state, const emps_parameters *parameters,
    const emps_inputs *inputs)
{
    state->z_v = -(parameters->K_v * inputs->x);
    state->z_rail = parameters->rail_a;
    state->mode = EMPS_RUNNING;
    state->invalid_samples = 0u;

    /* if the measurement is invalid, wait for the first valid one */
    const double check = fabs(inputs->x) + fabs(inputs->u) + fabs(state->z_v) + fabs(state->z_rail);
    if (!(fabs(check) <= 1e+150)) {
        state->z_v = 0.0;
        state->z_rail = 0.0;
        state->mode = EMPS_STARTING;
    }
}

/* Predict the state over an invalid sample, as if the machine moved at the held velocity estimate. */
static void emps_predict(emps_state *state, const emps_parameters *parameters,
    const emps_outputs *outputs)
{
    state->z_v = state->z_v - parameters->sample_time * parameters->K_v * outputs->v_hat;

    /* after 8 invalid samples in a row, resume from the next valid one */
    if (state->mode == EMPS_RUNNING) {
        if (outputs->fault == 0) {
            state->invalid_samples = 0u; /* the sample before was valid */
        }
        state->invalid_samples++;
        if (state->invalid_samples >= 8u) {
            state->mode = EMPS_HOLDING;
        }
    }
}

/* Set the state from a valid sample so that the estimates equal the held ones. */
static void emps_resume(emps_state *state, const emps_parameters *parameters,
    const emps_inputs *inputs, const emps_outputs *outputs)
{
    state->z_v = outputs->v_hat - parameters->K_v * (inputs->x + parameters->sample_time * outputs->v_hat);
    state->z_rail = outputs->a_hat_rail + parameters->K_F * fabs(outputs->v_hat);
    state->mode = EMPS_RUNNING;
    state->invalid_samples = 0u;
}

/* Handle an invalid sample, or an invalid state: hold the last estimates, and set the state for the next sample. */
static EMPS_COLD void emps_handle_fault(emps_state *state,
    const emps_parameters *parameters, const emps_inputs *inputs, emps_outputs *outputs)
{
    const double given = fabs(inputs->x) + fabs(inputs->u);
    if (!(fabs(given) <= 1e+150)) {
        /* invalid sample */
        if (state->mode != EMPS_STARTING) {
            emps_predict(state, parameters, outputs);
        }
    } else if (state->mode == EMPS_HOLDING) {
        /* first valid sample after many invalid ones */
        emps_resume(state, parameters, inputs, outputs);
    } else {
        /* first valid sample of all, or an invalid state */
        emps_init(state, parameters, inputs);
    }
    outputs->fault = 1;
}

void emps_step(emps_state *state, const emps_parameters *parameters,
    const emps_inputs *inputs, emps_outputs *outputs)
{
    /* velocity estimate, (4.25) */
    const double v_hat = state->z_v + parameters->K_v * inputs->x; /* m/s */

    /* slip sign, (4.13) */
    const double sign_rail = emps_sign(v_hat); /* 1 */

    /* friction level, (4.11) */
    const double a_hat_rail = state->z_rail - parameters->K_F * fabs(v_hat); /* N */

    /* contact friction, (4.10) */
    const double F_hat_rail = sign_rail * a_hat_rail; /* N */

    /* acceleration, (4.2) */
    const double v_dot_hat = parameters->one_over_M * (parameters->gtau * inputs->u - F_hat_rail
        - parameters->offset - parameters->Fv * v_hat); /* m/s^2 */

    /* states one sample later (explicit Euler) */
    const double z_v_next = state->z_v + parameters->sample_time * (v_dot_hat - parameters->K_v * v_hat);
    const double z_rail_next = state->z_rail + parameters->h_K_F * sign_rail * v_dot_hat;

    /* this sum is too large or NaN if a next state is, or an input or output on which no next state depends */
    const double check = z_v_next + z_rail_next;
    if (fabs(check) <= 1e+150 && state->mode == EMPS_RUNNING) {
        outputs->v_hat = v_hat;
        outputs->a_hat_rail = a_hat_rail;
        outputs->F_hat_rail = F_hat_rail;
        outputs->F_hat_on_x = F_hat_rail;

        state->z_v = z_v_next;
        state->z_rail = z_rail_next;
        outputs->fault = 0;
    } else {
        emps_handle_fault(state, parameters, inputs, outputs);
    }
}
