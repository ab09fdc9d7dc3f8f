/*
 * rig: friction observer CFO, velocity estimated, double precision.
 * A step: 6 additions, 8 multiplications, 0 divisions, 0 calls, 2 of sign or magnitude.
 *
 * Made by stiction 0.1.0 from rig.yaml
 * sha256 f86bd8b1a92165fc8be5068dad91ef4dc02dd84ee43c29f9621a6f3ae7dc1e8a
 * with: stiction generate rig.yaml
 */
#include "rig.h"

#include <math.h>

#if defined(__clang__)
#pragma STDC FP_CONTRACT OFF
#endif

#if defined(__GNUC__)
#define RIG_COLD __attribute__((noinline, cold))
#else
#define RIG_COLD
#endif

static inline double rig_sign(double u)
{
    return (u > 0.0) ? 1.0 : ((u < 0.0) ? -1.0 : 0.0);
}

void rig_prepare(rig_parameters *parameters)
{
    parameters->one_over_J = 1.0 / parameters->J;
    parameters->h_K_F = parameters->sample_time * parameters->K_F;
}

/* Set the state from a measurement, at the first sample or anew. */
static void rig_start(rig_state *state, const rig_parameters *parameters,
    const rig_inputs *inputs)
{
    state->z_omega = -(parameters->K_v * inputs->theta);
    state->z_plates = parameters->plates_a;

    /* where that cannot be used, wait for a good sample */
    const double check = inputs->theta + inputs->w + state->z_omega + state->z_plates;
    state->waiting = 0.0;
    if (!(fabs(check) <= 1e+150)) {
        state->z_omega = 0.0;
        state->z_plates = 0.0;
        state->waiting = 1.0;
    }
}

void rig_init(rig_state *state, const rig_parameters *parameters,
    const rig_inputs *inputs)
{
    rig_start(state, parameters, inputs);
}

/* A sample is lost: the machine is taken to go on with the velocity that is held, and the states with it. */
static void rig_miss(rig_state *state, const rig_parameters *parameters,
    const rig_outputs *outputs)
{
    state->z_omega = state->z_omega - parameters->sample_time * parameters->K_v * outputs->omega_hat;

    /* after 2 in a row, wait for a good sample that sets the states anew */
    if (state->waiting < 0.5) {
        state->waiting = ((outputs->fault != 0) ? state->waiting : 0.0) + 0.25;
    }
}

/* Set the state from a good sample after many that were lost, so that the estimates go on from those that are held. */
static void rig_resume(rig_state *state, const rig_parameters *parameters,
    const rig_inputs *inputs, const rig_outputs *outputs)
{
    state->z_omega = outputs->omega_hat - parameters->K_v * (inputs->theta + parameters->sample_time
        * outputs->omega_hat);
    state->z_plates = outputs->a_hat_plates + parameters->K_F * fabs(outputs->omega_hat);
    state->waiting = 0.0;
}

/* What becomes of the state where a sample is not used. */
static RIG_COLD void rig_set_anew(rig_state *state,
    const rig_parameters *parameters, const rig_inputs *inputs, rig_outputs *outputs)
{
    const double given = inputs->theta + inputs->w;
    if (!(fabs(given) <= 1e+150)) {
        if (state->waiting < 0.75) {
            rig_miss(state, parameters, outputs);
        }
    } else if ((state->waiting < 0.5) || (state->waiting > 0.75)) {
        rig_start(state, parameters, inputs); /* the state cannot be used, or waits for its first sample */
    } else {
        rig_resume(state, parameters, inputs, outputs);
    }
    outputs->fault = 1;
}

void rig_step(rig_state *state, const rig_parameters *parameters,
    const rig_inputs *inputs, rig_outputs *outputs)
{
    /* velocity estimate, (4.25) */
    const double omega_hat = state->z_omega + parameters->K_v * inputs->theta; /* rad/s */

    /* slip sign, (4.13) */
    const double sign_plates = rig_sign(omega_hat); /* 1 */

    /* friction level, (4.11) */
    const double a_hat_plates = state->z_plates - parameters->K_F * fabs(omega_hat); /* N*m */

    /* contact friction, (4.10) */
    const double F_hat_plates = sign_plates * a_hat_plates; /* N*m */

    /* acceleration, (4.2) */
    const double omega_dot_hat = parameters->one_over_J * (inputs->w - F_hat_plates); /* rad/s^2 */

    /* states one sample later (explicit Euler) */
    const double z_omega_next = state->z_omega + parameters->sample_time * (omega_dot_hat - parameters->K_v
        * omega_hat);
    const double z_plates_next = state->z_plates + parameters->h_K_F * sign_plates * omega_dot_hat;

    /* hold the last state and estimates where a next state, or an input that it does not show, is too large or NaN */
    const double check = z_omega_next + z_plates_next;
    if (fabs(check) <= 1e+150 && state->waiting < 0.5) {
        outputs->omega_hat = omega_hat;
        outputs->a_hat_plates = a_hat_plates;
        outputs->F_hat_plates = F_hat_plates;
        outputs->F_hat_on_theta = F_hat_plates;

        state->z_omega = z_omega_next;
        state->z_plates = z_plates_next;
        outputs->fault = 0;
    } else {
        rig_set_anew(state, parameters, inputs, outputs);
    }
}
