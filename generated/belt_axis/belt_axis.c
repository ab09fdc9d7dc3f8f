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

/* Set the state from a measurement, at the first sample or anew. */
static void belt_axis_start(belt_axis_state *state, const belt_axis_parameters *parameters,
    const belt_axis_inputs *inputs)
{
    state->z_v = -(parameters->K_v * inputs->x);
    state->z_guide = parameters->guide_a;

    /* where that cannot be used, wait for a good sample */
    const double check = inputs->x + inputs->u + state->z_v + state->z_guide;
    state->waiting = 0.0;
    if (!(fabs(check) <= 1e+150)) {
        state->z_v = 0.0;
        state->z_guide = 0.0;
        state->waiting = 1.0;
    }
}

void belt_axis_init(belt_axis_state *state, const belt_axis_parameters *parameters,
    const belt_axis_inputs *inputs)
{
    belt_axis_start(state, parameters, inputs);
}

/* A sample is lost: the machine is taken to go on with the velocity that is held, and the states with it. */
static void belt_axis_miss(belt_axis_state *state, const belt_axis_parameters *parameters,
    const belt_axis_outputs *outputs)
{
    state->z_v = state->z_v - parameters->sample_time * parameters->K_v * outputs->v_hat;

    /* after 8 in a row, wait for a good sample that sets the states anew */
    if (state->waiting < 0.5) {
        state->waiting = ((outputs->fault != 0) ? state->waiting : 0.0) + 0.0625;
    }
}

/* Set the state from a good sample after many that were lost, so that the estimates go on from those that are held. */
static void belt_axis_resume(belt_axis_state *state, const belt_axis_parameters *parameters,
    const belt_axis_inputs *inputs, const belt_axis_outputs *outputs)
{
    state->z_v = outputs->v_hat - parameters->K_v * (inputs->x + parameters->sample_time * outputs->v_hat);
    state->z_guide = outputs->a_hat_guide + parameters->K_F * fabs(outputs->v_hat);
    state->waiting = 0.0;
}

/* What becomes of the state where a sample is not used. */
static BELT_AXIS_COLD void belt_axis_set_anew(belt_axis_state *state,
    const belt_axis_parameters *parameters, const belt_axis_inputs *inputs, belt_axis_outputs *outputs)
{
    const double given = inputs->x + inputs->u;
    if (!(fabs(given) <= 1e+150)) {
        if (state->waiting < 0.75) {
            belt_axis_miss(state, parameters, outputs);
        }
    } else if ((state->waiting < 0.5) || (state->waiting > 0.75)) {
        belt_axis_start(state, parameters, inputs); /* the state cannot be used, or waits for its first sample */
    } else {
        belt_axis_resume(state, parameters, inputs, outputs);
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

    /* hold the last state and estimates where a next state, or an input that it does not show, is too large or NaN */
    const double check = z_v_next + z_guide_next;
    if (fabs(check) <= 1e+150 && state->waiting < 0.5) {
        outputs->v_hat = v_hat;
        outputs->a_hat_guide = a_hat_guide;
        outputs->F_hat_guide = F_hat_guide;
        outputs->F_hat_on_x = F_hat_guide;

        state->z_v = z_v_next;
        state->z_guide = z_guide_next;
        outputs->fault = 0;
    } else {
        belt_axis_set_anew(state, parameters, inputs, outputs);
    }
}
