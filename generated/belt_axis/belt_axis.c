/*
 * belt_axis: friction observer GCFO, velocity estimated, double precision.
 * A step: 7 additions, 10 multiplications, 0 divisions, 0 calls, 2 of sign or magnitude.
 *
 * Made by stiction 0.1.0 from belt_axis.yaml
 * sha256 011c159c52aff177b4ffacdfdb486cf7c777fa8381d977de25a0d69ba40ac64f
 * with: stiction generate belt_axis.yaml
 */
#include "belt_axis.h"

#include <math.h>

#if defined(__clang__)
#pragma STDC FP_CONTRACT OFF
#endif

#if defined(__GNUC__)
#define BELT_AXIS_COLD __attribute__((noinline, cold))
#else
#define BELT_AXIS_COLD
#endif

static inline double belt_axis_sign(double u)
{
    return (u > 0.0) ? 1.0 : ((u < 0.0) ? -1.0 : 0.0);
}

void belt_axis_prepare(belt_axis_parameters *parameters)
{
    parameters->one_over_m = 1.0 / parameters->m;
    parameters->h_K_F = parameters->sample_time * parameters->K_F;
}

void belt_axis_init(belt_axis_state *state, const belt_axis_parameters *parameters,
    const belt_axis_inputs *inputs)
{
    state->z_v = -(parameters->K_v * inputs->x);
    state->z_guide = parameters->guide_a;
    state->mode = BELT_AXIS_RUNNING;
    state->invalid_samples = 0u;

    /* if the measurement is invalid, wait for the first valid one */
    const double check = fabs(inputs->x) + fabs(inputs->u) + fabs(state->z_v) + fabs(state->z_guide);
    if (!(fabs(check) <= 1e+150)) {
        state->z_v = 0.0;
        state->z_guide = 0.0;
        state->mode = BELT_AXIS_STARTING;
    }
}

/* Predict the state over an invalid sample, as if the machine moved at the held velocity estimate. */
static void belt_axis_predict(belt_axis_state *state, const belt_axis_parameters *parameters,
    const belt_axis_outputs *outputs)
{
    state->z_v = state->z_v - parameters->sample_time * parameters->K_v * outputs->v_hat;

    /* after 8 invalid samples in a row, resume from the next valid one */
    if (state->mode == BELT_AXIS_RUNNING) {
        if (outputs->fault == 0) {
            state->invalid_samples = 0u; /* the sample before was valid */
        }
        state->invalid_samples++;
        if (state->invalid_samples >= 8u) {
            state->mode = BELT_AXIS_HOLDING;
        }
    }
}

/* Set the state from a valid sample so that the estimates equal the held ones. */
static void belt_axis_resume(belt_axis_state *state, const belt_axis_parameters *parameters,
    const belt_axis_inputs *inputs, const belt_axis_outputs *outputs)
{
    state->z_v = outputs->v_hat - parameters->K_v * (inputs->x + parameters->sample_time * outputs->v_hat);
    state->z_guide = outputs->a_hat_guide + parameters->K_F * fabs(outputs->v_hat);
    state->mode = BELT_AXIS_RUNNING;
    state->invalid_samples = 0u;
}

/* Handle an invalid sample, or an invalid state: hold the last estimates, and set the state for the next sample. */
static BELT_AXIS_COLD void belt_axis_handle_fault(belt_axis_state *state,
    const belt_axis_parameters *parameters, const belt_axis_inputs *inputs, belt_axis_outputs *outputs)
{
    const double given = fabs(inputs->x) + fabs(inputs->u);
    if (!(fabs(given) <= 1e+150)) {
        /* invalid sample */
        if (state->mode != BELT_AXIS_STARTING) {
            belt_axis_predict(state, parameters, outputs);
        }
    } else if (state->mode == BELT_AXIS_HOLDING) {
        /* first valid sample after many invalid ones */
        belt_axis_resume(state, parameters, inputs, outputs);
    } else {
        /* first valid sample of all, or an invalid state */
        belt_axis_init(state, parameters, inputs);
    }
    outputs->fault = 1;
}

void belt_axis_step(belt_axis_state *state, const belt_axis_parameters *parameters,
    const belt_axis_inputs *inputs, belt_axis_outputs *outputs)
{
    /* velocity estimate, (4.25) */
    const double v_hat = state->z_v + parameters->K_v * inputs->x; /* m/s */

    /* slip sign, (4.13) */
    const double sign_guide = belt_axis_sign(v_hat); /* 1 */

    /* friction level, (4.11) */
    const double a_hat_guide = state->z_guide - parameters->K_F * fabs(v_hat); /* N */

    /* contact friction, (4.10) */
    const double F_hat_guide = sign_guide * a_hat_guide; /* N */

    /* acceleration, (4.2) */
    const double v_dot_hat = parameters->one_over_m * (parameters->kf * inputs->u - F_hat_guide
        - parameters->b * v_hat); /* m/s^2 */

    /* states one sample later (explicit Euler) */
    const double z_v_next = state->z_v + parameters->sample_time * (v_dot_hat - parameters->K_v * v_hat);
    const double z_guide_next = state->z_guide + parameters->h_K_F * sign_guide * v_dot_hat;

    /* this sum is too large or NaN if a next state is, or an input or output on which no next state depends */
    const double check = z_v_next + z_guide_next;
    if (fabs(check) <= 1e+150 && state->mode == BELT_AXIS_RUNNING) {
        outputs->v_hat = v_hat;
        outputs->a_hat_guide = a_hat_guide;
        outputs->F_hat_guide = F_hat_guide;
        outputs->F_hat_on_x = F_hat_guide;

        state->z_v = z_v_next;
        state->z_guide = z_guide_next;
        outputs->fault = 0;
    } else {
        belt_axis_handle_fault(state, parameters, inputs, outputs);
    }
}
