/*
 * one_mass_domain: friction observer CFO, velocity estimated, double precision.
 * A step: 30 additions, 29 multiplications, 0 divisions, 0 calls, 12 of sign or magnitude.
 *
 * Made by stiction 0.1.0 from one_mass_domain.yaml
 * sha256 8d460ce60843deab9a083d6f6e692c331d1ab3b95be9c9c28efa58c7ade55a45
 * with: stiction generate one_mass_domain.yaml
 */
#include "one_mass_domain.h"

#include <math.h>

#if defined(__clang__)
#pragma STDC FP_CONTRACT OFF
#endif

#if defined(__GNUC__)
#define ONE_MASS_DOMAIN_COLD __attribute__((noinline, cold))
#else
#define ONE_MASS_DOMAIN_COLD
#endif

static inline double one_mass_domain_sign(double u)
{
    return (u > 0.0) ? 1.0 : ((u < 0.0) ? -1.0 : 0.0);
}

void one_mass_domain_prepare(one_mass_domain_parameters *parameters)
{
    parameters->one_over_m = 1.0 / parameters->m;
    parameters->constant_1 = 0.5 * parameters->a_high_rail + 0.5 * parameters->a_low_rail;
}

void one_mass_domain_init(one_mass_domain_state *state, const one_mass_domain_parameters *parameters,
    const one_mass_domain_inputs *inputs)
{
    state->z_v = -(parameters->K_v * inputs->x);
    state->z_rail = parameters->rail_a;
    state->direction_rail = 0.0;
    state->samples_held = parameters->restart_samples;
    state->samples_slid = 0.0;
    state->x_predicted = inputs->x;
    state->mode = ONE_MASS_DOMAIN_RUNNING;
    state->invalid_samples = 0u;

    /* if the measurement is invalid, wait for the first valid one */
    const double check = fabs(inputs->x) + fabs(inputs->w) + fabs(state->z_v) + fabs(state->z_rail)
        + fabs(state->direction_rail) + fabs(state->samples_held) + fabs(state->samples_slid)
        + fabs(state->x_predicted);
    if (!(fabs(check) <= 1e+150)) {
        state->z_v = 0.0;
        state->z_rail = 0.0;
        state->direction_rail = 0.0;
        state->samples_held = 0.0;
        state->samples_slid = 0.0;
        state->x_predicted = 0.0;
        state->mode = ONE_MASS_DOMAIN_STARTING;
    }
}

/* Predict the state over an invalid sample, as if the machine moved at the held velocity estimate. */
static void one_mass_domain_predict(one_mass_domain_state *state, const one_mass_domain_parameters *parameters,
    const one_mass_domain_outputs *outputs)
{
    state->z_v = state->z_v - parameters->sample_time * parameters->K_v * outputs->v_hat;
    state->z_rail = outputs->a_hat_rail;
    state->direction_rail = 0.0;
    state->samples_held = parameters->restart_samples;
    state->samples_slid = 0.0;
    state->x_predicted = state->x_predicted + parameters->sample_time * outputs->v_hat;

    /* after 8 invalid samples in a row, resume from the next valid one */
    if (state->mode == ONE_MASS_DOMAIN_RUNNING) {
        if (outputs->fault == 0) {
            state->invalid_samples = 0u; /* the sample before was valid */
        }
        state->invalid_samples++;
        if (state->invalid_samples >= 8u) {
            state->mode = ONE_MASS_DOMAIN_HOLDING;
        }
    }
}

/* Set the state from a valid sample so that the estimates equal the held ones. */
static void one_mass_domain_resume(one_mass_domain_state *state, const one_mass_domain_parameters *parameters,
    const one_mass_domain_inputs *inputs, const one_mass_domain_outputs *outputs)
{
    state->z_v = outputs->v_hat - parameters->K_v * (inputs->x + parameters->sample_time * outputs->v_hat);
    state->z_rail = outputs->a_hat_rail;
    state->direction_rail = 0.0;
    state->samples_held = parameters->restart_samples;
    state->samples_slid = 0.0;
    state->x_predicted = inputs->x + parameters->sample_time * outputs->v_hat;
    state->mode = ONE_MASS_DOMAIN_RUNNING;
    state->invalid_samples = 0u;
}

/* Handle an invalid sample, or an invalid state: hold the last estimates, and set the state for the next sample. */
static ONE_MASS_DOMAIN_COLD void one_mass_domain_handle_fault(one_mass_domain_state *state,
    const one_mass_domain_parameters *parameters, const one_mass_domain_inputs *inputs, one_mass_domain_outputs *outputs)
{
    const double given = fabs(inputs->x) + fabs(inputs->w);
    if (!(fabs(given) <= 1e+150)) {
        /* invalid sample */
        if (state->mode != ONE_MASS_DOMAIN_STARTING) {
            one_mass_domain_predict(state, parameters, outputs);
        }
    } else if (state->mode == ONE_MASS_DOMAIN_HOLDING) {
        /* first valid sample after many invalid ones */
        one_mass_domain_resume(state, parameters, inputs, outputs);
    } else {
        /* first valid sample of all, or an invalid state */
        one_mass_domain_init(state, parameters, inputs);
    }
    outputs->fault = 1;
}

void one_mass_domain_step(one_mass_domain_state *state, const one_mass_domain_parameters *parameters,
    const one_mass_domain_inputs *inputs, one_mass_domain_outputs *outputs)
{
    /* velocity estimate, (4.25) */
    const double v_hat = state->z_v + parameters->K_v * inputs->x; /* m/s */

    /* slip sign, (4.13) */
    const double sign_rail = one_mass_domain_sign(v_hat); /* 1 */

    /* learning, 1 where the level is learnt */
    const double learning_1 = state->samples_held - 0.5;
    const double learning_2 = one_mass_domain_sign(fabs(v_hat) - parameters->slip_speed);
    const double learning_3 = state->direction_rail * sign_rail;
    const double learning_4 = 0.5 * one_mass_domain_sign(learning_1);
    const double learning = (0.5 - learning_4) * (0.5 * fabs(learning_2) + 0.5 * learning_2) * (1.0 + 0.5
        * learning_3 - 0.5 * fabs(learning_3)); /* 1 */

    /* level read, (4.11) */
    const double a_read_rail = state->z_rail - parameters->K_F * state->direction_rail * v_hat; /* N */

    /* friction level, (4.11) */
    const double a_hat_rail = a_read_rail + (1.0 - learning) * (parameters->constant_1 + 0.5 * fabs(a_read_rail
        - parameters->a_low_rail) - a_read_rail - 0.5 * fabs(a_read_rail - parameters->a_high_rail)); /* N */

    /* contact friction, (4.10) */
    const double F_hat_rail = sign_rail * a_hat_rail; /* N */

    /* acceleration, (4.2) */
    const double v_dot_hat = parameters->one_over_m * (inputs->w - F_hat_rail); /* m/s^2 */

    /* calm, 1 where the innovation is small */
    const double calm_1 = one_mass_domain_sign(fabs(inputs->x - state->x_predicted)
        - parameters->largest_innovation);
    const double calm = 1.0 - 0.5 * fabs(calm_1) - 0.5 * calm_1; /* 1 */

    /* in domain, 1 where the certificate's bound holds, if its assumptions do */
    const double in_domain_1 = 0.5 + state->samples_slid;
    const double in_domain_2 = learning * calm;
    const double in_domain_3 = 0.5 * one_mass_domain_sign(in_domain_1 - parameters->settle_samples);
    const double in_domain = in_domain_2 * (0.5 + in_domain_3); /* 1 */

    /* shared by the states */
    const double step_1 = sign_rail * learning;

    /* states one sample later (explicit Euler) */
    const double z_v_next = state->z_v + parameters->sample_time * (v_dot_hat - parameters->K_v * v_hat);
    const double z_rail_next = a_hat_rail + parameters->K_F * step_1 * (v_hat + parameters->sample_time
        * v_dot_hat);
    const double direction_rail_next = step_1;
    const double samples_held_next = learning_1 - learning_4;
    const double samples_slid_next = in_domain_2 * (in_domain_1 - in_domain_3);
    const double x_predicted_next = inputs->x + parameters->sample_time * v_hat;

    /* this sum is too large or NaN if a next state is, or an input or output on which no next state depends */
    const double check = z_v_next + z_rail_next + direction_rail_next + samples_held_next + samples_slid_next
        + x_predicted_next + in_domain;
    if (fabs(check) <= 1e+150 && state->mode == ONE_MASS_DOMAIN_RUNNING) {
        outputs->v_hat = v_hat;
        outputs->a_hat_rail = a_hat_rail;
        outputs->F_hat_rail = F_hat_rail;
        outputs->F_hat_on_x = F_hat_rail;
        outputs->in_domain = in_domain;

        state->z_v = z_v_next;
        state->z_rail = z_rail_next;
        state->direction_rail = direction_rail_next;
        state->samples_held = samples_held_next;
        state->samples_slid = samples_slid_next;
        state->x_predicted = x_predicted_next;
        outputs->fault = 0;
    } else {
        one_mass_domain_handle_fault(state, parameters, inputs, outputs);
    }
}
