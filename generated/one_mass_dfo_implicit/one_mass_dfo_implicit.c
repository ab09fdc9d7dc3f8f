/*
 * one_mass_dfo_implicit: friction observer DFO, velocity estimated, double precision.
 * A step: 100 additions, 111 multiplications, 4 divisions, 0 calls, 8 of sign or magnitude.
 *
 * Made by stiction 0.1.0 from one_mass_dfo_implicit.yaml
 * sha256 17681b16fcc2f3a9b534fe636ee6636e1a2e959da23f3b9cd0482eb72dad1be6
 * with: stiction generate one_mass_dfo_implicit.yaml
 */
#include "one_mass_dfo_implicit.h"

#include <math.h>

#if defined(__clang__)
#pragma STDC FP_CONTRACT OFF
#endif

#if defined(__GNUC__)
#define ONE_MASS_DFO_IMPLICIT_COLD __attribute__((noinline, cold))
#else
#define ONE_MASS_DFO_IMPLICIT_COLD
#endif

static inline double one_mass_dfo_implicit_sign(double u)
{
    return (u > 0.0) ? 1.0 : ((u < 0.0) ? -1.0 : 0.0);
}

void one_mass_dfo_implicit_prepare(one_mass_dfo_implicit_parameters *parameters)
{
    parameters->h_K_v = parameters->sample_time * parameters->K_v;
    parameters->rail_D1_minus_rail_D2 = parameters->rail_D1 - parameters->rail_D2;
    parameters->h_K_f2 = parameters->sample_time * parameters->K_f2;
    parameters->K_a_K_f2 = parameters->K_a * parameters->K_f2;
    parameters->constant_1 = 1.0 / (parameters->h_K_v + 1.0);
    parameters->constant_2 = parameters->h_K_v / (parameters->h_K_v + 1.0);
    parameters->constant_3 = parameters->rail_c * (1.0 - parameters->rail_D2 * parameters->K_f2
        - parameters->K_f2 * parameters->rail_D1_minus_rail_D2);
    parameters->constant_4 = 0.5 * parameters->rail_c * parameters->K_f2 * parameters->rail_D1_minus_rail_D2;
    parameters->constant_5 = parameters->sample_time / (parameters->h_K_v + 1.0);
    parameters->h_K_a = parameters->sample_time * parameters->K_a;
    parameters->constant_6 = parameters->h_K_a / (parameters->h_K_v + 1.0);
    parameters->constant_7 = parameters->rail_c * (parameters->rail_D2 + parameters->rail_D1
        - parameters->rail_D2);
    parameters->constant_8 = 0.5 * parameters->rail_c * parameters->rail_D1_minus_rail_D2;
}

void one_mass_dfo_implicit_init(one_mass_dfo_implicit_state *state, const one_mass_dfo_implicit_parameters *parameters,
    const one_mass_dfo_implicit_inputs *inputs)
{
    state->z_v = -(parameters->K_v * inputs->x);
    state->z_f_rail = -(parameters->K_f1 * inputs->x);
    state->z_a_rail = parameters->rail_a;
    state->w_held = inputs->w;
    state->mode = ONE_MASS_DFO_IMPLICIT_RUNNING;
    state->invalid_samples = 0u;

    /* if the measurement is invalid, wait for the first valid one */
    const double check = fabs(inputs->x) + fabs(inputs->w) + fabs(state->z_v) + fabs(state->z_f_rail)
        + fabs(state->z_a_rail) + fabs(state->w_held);
    if (!(fabs(check) <= 1e+150)) {
        state->z_v = 0.0;
        state->z_f_rail = 0.0;
        state->z_a_rail = 0.0;
        state->w_held = 0.0;
        state->mode = ONE_MASS_DFO_IMPLICIT_STARTING;
    }
}

/* Predict the state over an invalid sample, as if the machine moved at the held velocity estimate. */
static void one_mass_dfo_implicit_predict(one_mass_dfo_implicit_state *state, const one_mass_dfo_implicit_parameters *parameters,
    const one_mass_dfo_implicit_outputs *outputs)
{
    state->z_v = state->z_v - parameters->h_K_v * outputs->v_hat;
    state->z_f_rail = state->z_f_rail - parameters->sample_time * parameters->K_f1 * outputs->v_hat;

    /* after 8 invalid samples in a row, resume from the next valid one */
    if (state->mode == ONE_MASS_DFO_IMPLICIT_RUNNING) {
        if (outputs->fault == 0) {
            state->invalid_samples = 0u; /* the sample before was valid */
        }
        state->invalid_samples++;
        if (state->invalid_samples >= 8u) {
            state->mode = ONE_MASS_DFO_IMPLICIT_HOLDING;
        }
    }
}

/* Set the state from a valid sample so that the estimates equal the held ones. */
static void one_mass_dfo_implicit_resume(one_mass_dfo_implicit_state *state, const one_mass_dfo_implicit_parameters *parameters,
    const one_mass_dfo_implicit_inputs *inputs, const one_mass_dfo_implicit_outputs *outputs)
{
    state->z_v = outputs->v_hat - parameters->K_v * inputs->x;
    state->z_f_rail = outputs->f_hat_rail - parameters->K_f1 * inputs->x - parameters->K_f2 * outputs->v_hat;
    state->z_a_rail = outputs->a_hat_rail - parameters->K_a * outputs->v_hat * outputs->f_hat_rail;
    state->w_held = inputs->w;
    state->mode = ONE_MASS_DFO_IMPLICIT_RUNNING;
    state->invalid_samples = 0u;
}

/* Handle an invalid sample, or an invalid state: hold the last estimates, and set the state for the next sample. */
static ONE_MASS_DFO_IMPLICIT_COLD void one_mass_dfo_implicit_handle_fault(one_mass_dfo_implicit_state *state,
    const one_mass_dfo_implicit_parameters *parameters, const one_mass_dfo_implicit_inputs *inputs, one_mass_dfo_implicit_outputs *outputs)
{
    const double given = fabs(inputs->x) + fabs(inputs->w);
    if (!(fabs(given) <= 1e+150)) {
        /* invalid sample */
        if (state->mode != ONE_MASS_DFO_IMPLICIT_STARTING) {
            one_mass_dfo_implicit_predict(state, parameters, outputs);
        }
    } else if (state->mode == ONE_MASS_DFO_IMPLICIT_HOLDING) {
        /* first valid sample after many invalid ones */
        one_mass_dfo_implicit_resume(state, parameters, inputs, outputs);
    } else {
        /* first valid sample of all, or an invalid state */
        one_mass_dfo_implicit_init(state, parameters, inputs);
    }
    outputs->fault = 1;
}

void one_mass_dfo_implicit_step(one_mass_dfo_implicit_state *state, const one_mass_dfo_implicit_parameters *parameters,
    const one_mass_dfo_implicit_inputs *inputs, one_mass_dfo_implicit_outputs *outputs)
{
    /* state now, z[k] = z[k-1] + h f(z[k]), first Newton step */
    const double state_now_1 = parameters->K_v * inputs->x;
    const double state_now_2 = parameters->K_f1 * inputs->x;
    const double z_start_1 = state->z_v - parameters->constant_2 * (state->z_v + state_now_1);
    const double state_now_3 = z_start_1 + state_now_1;
    const double f43 = state->z_f_rail + state_now_2 + parameters->K_f2 * state_now_3;
    const double state_now_4 = f43 - 1.0;
    const double sign_state_now_4 = one_mass_dfo_implicit_sign(state_now_4);
    const double state_now_5 = 1.0 + f43;
    const double sign_state_now_5 = one_mass_dfo_implicit_sign(state_now_5);
    const double state_now_6 = parameters->constant_3 - parameters->constant_4 * sign_state_now_4
        + parameters->constant_4 * sign_state_now_5;
    const double state_now_7 = parameters->constant_5 * (state_now_6 - parameters->K_f1);
    const double A24 = parameters->h_K_f2 - parameters->sample_time * state_now_7;
    const double state_now_8 = parameters->rail_c * (state_now_3 - parameters->rail_D2 * f43
        - parameters->rail_D1_minus_rail_D2 * (f43 + 0.5 * fabs(state_now_4) - 0.5 * fabs(state_now_5)));
    const double state_now_9 = z_start_1 - state->z_v + parameters->h_K_v * state_now_3;
    const double r2 = parameters->sample_time * (state_now_8 - parameters->K_f1 * state_now_3) - state_now_7
        * state_now_9;
    const double f31 = parameters->constant_6 * (state_now_3 * state_now_6 + state_now_8);
    const double state_now_10 = parameters->K_a * f43;
    const double state_now_11 = state->z_a_rail + state_now_3 * state_now_10;
    const double f41 = parameters->constant_1 * (f43 * (parameters->K_a_K_f2 * state_now_3 + state_now_10)
        + parameters->K_f2 * state_now_11);
    const double state_now_12 = parameters->constant_7 + parameters->constant_8 * sign_state_now_4
        - parameters->constant_8 * sign_state_now_5;
    const double one_over_p2 = 1.0 / (1.0 + parameters->sample_time * state_now_12);
    const double state_now_13 = parameters->h_K_a * state_now_3 * state_now_12 * one_over_p2;
    const double A34_ = parameters->sample_time * state_now_10 + parameters->sample_time * f31 + A24
        * state_now_13;
    const double r3_ = state_now_9 * f31 - parameters->h_K_a * state_now_3 * state_now_8 + r2 * state_now_13;
    const double f42 = one_over_p2 * (parameters->K_a * state_now_3 * f43 + state_now_11);
    const double d4 = (state->w_held + state_now_9 * f41 - r2 * f42 - f43 * (state_now_11 + r3_)) * (1.0
        / (parameters->m + parameters->sample_time * f41 - A24 * f42 - f43 * A34_));
    const double z_v_newton = z_start_1 + parameters->constant_1 * (parameters->sample_time * d4
        - state_now_9); /* m/s */
    const double z_f_rail_newton = state->z_f_rail + one_over_p2 * (r2 - A24 * d4); /* 1 */
    const double z_a_rail_newton = state->z_a_rail + r3_ - A34_ * d4; /* N */

    /* state now, z[k] = z[k-1] + h f(z[k]), second Newton step */
    const double state_now_14 = z_v_newton + state_now_1;
    const double f43_ = z_f_rail_newton + state_now_2 + parameters->K_f2 * state_now_14;
    const double state_now_15 = f43_ - 1.0;
    const double sign_state_now_15 = one_mass_dfo_implicit_sign(state_now_15);
    const double state_now_16 = 1.0 + f43_;
    const double sign_state_now_16 = one_mass_dfo_implicit_sign(state_now_16);
    const double state_now_17 = parameters->constant_3 - parameters->constant_4 * sign_state_now_15
        + parameters->constant_4 * sign_state_now_16;
    const double state_now_18 = parameters->constant_5 * (state_now_17 - parameters->K_f1);
    const double A24_ = parameters->h_K_f2 - parameters->sample_time * state_now_18;
    const double state_now_19 = z_v_newton - state->z_v - parameters->sample_time * (d4 - parameters->K_v
        * state_now_14);
    const double state_now_20 = parameters->rail_c * (state_now_14 - parameters->rail_D2 * f43_
        - parameters->rail_D1_minus_rail_D2 * (f43_ + 0.5 * fabs(state_now_15) - 0.5 * fabs(state_now_16)));
    const double state_now_21 = parameters->K_f2 * d4;
    const double r2_ = state->z_f_rail - state_now_18 * state_now_19 - z_f_rail_newton + parameters->sample_time
        * (state_now_20 - parameters->K_f1 * state_now_14 - state_now_21);
    const double f31_ = parameters->constant_6 * (state_now_21 + state_now_14 * state_now_17 + state_now_20);
    const double state_now_22 = parameters->K_a * f43_;
    const double state_now_23 = z_a_rail_newton + state_now_14 * state_now_22;
    const double f41_ = parameters->constant_1 * (f43_ * (parameters->K_a_K_f2 * state_now_14 + state_now_22)
        + parameters->K_f2 * state_now_23);
    const double state_now_24 = parameters->constant_7 + parameters->constant_8 * sign_state_now_15
        - parameters->constant_8 * sign_state_now_16;
    const double one_over_p2_ = 1.0 / (1.0 + parameters->sample_time * state_now_24);
    const double f32_ = parameters->h_K_a * one_over_p2_ * (d4 - state_now_14 * state_now_24);
    const double A34_3 = parameters->sample_time * state_now_22 + parameters->sample_time * f31_ - A24_ * f32_;
    const double r3_3 = state_now_19 * f31_ - z_a_rail_newton + state->z_a_rail - parameters->h_K_a * (d4 * f43_
        + state_now_14 * state_now_20) - r2_ * f32_;
    const double f42_ = one_over_p2_ * (parameters->K_a * state_now_14 * f43_ + state_now_23);
    const double d4_ = (state_now_19 * f41_ - parameters->m * d4 + state->w_held - r2_ * f42_ - f43_
        * (state_now_23 + r3_3)) * (1.0 / (parameters->m + parameters->sample_time * f41_ - A24_ * f42_ - f43_
        * A34_3));
    const double z_v_now = z_v_newton + parameters->constant_1 * (parameters->sample_time * d4_
        - state_now_19); /* m/s */
    const double z_f_rail_now = z_f_rail_newton + one_over_p2_ * (r2_ - A24_ * d4_); /* 1 */
    const double z_a_rail_now = z_a_rail_newton + r3_3 - A34_3 * d4_; /* N */

    /* velocity estimate, (4.25) */
    const double v_hat = z_v_now + state_now_1; /* m/s */

    /* friction state, (7.11) */
    const double f_hat_rail = z_f_rail_now + state_now_2 + parameters->K_f2 * v_hat; /* 1 */

    /* friction level, (7.10) */
    const double a_hat_rail = z_a_rail_now + parameters->K_a * v_hat * f_hat_rail; /* N */

    /* contact friction, (7.12) */
    const double F_hat_rail = f_hat_rail * a_hat_rail; /* N */

    /* states one sample later (backward Euler) */
    const double z_v_next = z_v_now;
    const double z_f_rail_next = z_f_rail_now;
    const double z_a_rail_next = z_a_rail_now;
    const double w_held_next = inputs->w;

    /* this sum is too large or NaN if a next state is, or an input or output on which no next state depends */
    const double check = z_v_next + z_f_rail_next + z_a_rail_next + w_held_next + a_hat_rail + F_hat_rail;
    if (fabs(check) <= 1e+150 && state->mode == ONE_MASS_DFO_IMPLICIT_RUNNING) {
        outputs->v_hat = v_hat;
        outputs->f_hat_rail = f_hat_rail;
        outputs->a_hat_rail = a_hat_rail;
        outputs->F_hat_rail = F_hat_rail;
        outputs->F_hat_on_x = F_hat_rail;

        state->z_v = z_v_next;
        state->z_f_rail = z_f_rail_next;
        state->z_a_rail = z_a_rail_next;
        state->w_held = w_held_next;
        outputs->fault = 0;
    } else {
        one_mass_dfo_implicit_handle_fault(state, parameters, inputs, outputs);
    }
}
