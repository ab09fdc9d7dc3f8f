/*
 * chain: friction observer GCFO, velocity estimated, double precision.
 * A step: 173 additions, 188 multiplications, 0 divisions, 0 calls, 32 of sign or magnitude.
 *
 * Made by stiction 0.1.0 from chain.yaml
 * sha256 b931a2bc6bd00bf64052ceced86f25ef4dcd72dd152d298eae1b835ca222581a
 * with: stiction generate chain.yaml
 */
#include "chain.h"

#include <math.h>

#if defined(__clang__)
#pragma STDC FP_CONTRACT OFF
#endif

#if defined(__GNUC__)
#define CHAIN_COLD __attribute__((noinline, cold))
#else
#define CHAIN_COLD
#endif

static inline double chain_sign(double u)
{
    return (u > 0.0) ? 1.0 : ((u < 0.0) ? -1.0 : 0.0);
}

void chain_prepare(chain_parameters *parameters)
{
    parameters->one_over_D16 = 1.0 / parameters->m;
    for (int i = 0; i < 16; i++) {
        parameters->h_K_F_ground[i] = parameters->sample_time * parameters->K_F_ground[i];
    }
}

void chain_init(chain_state *state, const chain_parameters *parameters,
    const chain_inputs *inputs)
{
    for (int i = 0; i < 16; i++) {
        state->z_v[i] = -(parameters->K_v_v[i] * inputs->x[i]);
        state->z_ground[i] = parameters->ground_a[i];
    }
    state->mode = CHAIN_RUNNING;
    state->invalid_samples = 0u;

    /* if the measurement is invalid, wait for the first valid one */
    double check = fabs(inputs->w);
    for (int i = 0; i < 16; i++) {
        check += fabs(inputs->x[i]) + fabs(state->z_v[i]) + fabs(state->z_ground[i]);
    }
    if (!(fabs(check) <= 1e+150)) {
        for (int i = 0; i < 16; i++) {
            state->z_v[i] = 0.0;
        }
        for (int i = 0; i < 16; i++) {
            state->z_ground[i] = 0.0;
        }
        state->mode = CHAIN_STARTING;
    }
}

/* Predict the state over an invalid sample, as if the machine moved at the held velocity estimate. */
static void chain_predict(chain_state *state, const chain_parameters *parameters,
    const chain_outputs *outputs)
{
    for (int i = 0; i < 16; i++) {
        state->z_v[i] = state->z_v[i] - parameters->sample_time * parameters->K_v_v[i] * outputs->v_hat[i];
    }

    /* after 8 invalid samples in a row, resume from the next valid one */
    if (state->mode == CHAIN_RUNNING) {
        if (outputs->fault == 0) {
            state->invalid_samples = 0u; /* the sample before was valid */
        }
        state->invalid_samples++;
        if (state->invalid_samples >= 8u) {
            state->mode = CHAIN_HOLDING;
        }
    }
}

/* Set the state from a valid sample so that the estimates equal the held ones. */
static void chain_resume(chain_state *state, const chain_parameters *parameters,
    const chain_inputs *inputs, const chain_outputs *outputs)
{
    for (int i = 0; i < 16; i++) {
        state->z_v[i] = outputs->v_hat[i] - parameters->K_v_v[i] * (inputs->x[i] + parameters->sample_time
            * outputs->v_hat[i]);
        state->z_ground[i] = outputs->a_hat_ground[i] + parameters->K_F_ground[i] * fabs(outputs->v_hat[i]);
    }
    state->mode = CHAIN_RUNNING;
    state->invalid_samples = 0u;
}

/* Handle an invalid sample, or an invalid state: hold the last estimates, and set the state for the next sample. */
static CHAIN_COLD void chain_handle_fault(chain_state *state,
    const chain_parameters *parameters, const chain_inputs *inputs, chain_outputs *outputs)
{
    double given = fabs(inputs->w);
    for (int i = 0; i < 16; i++) {
        given += fabs(inputs->x[i]);
    }
    if (!(fabs(given) <= 1e+150)) {
        /* invalid sample */
        if (state->mode != CHAIN_STARTING) {
            chain_predict(state, parameters, outputs);
        }
    } else if (state->mode == CHAIN_HOLDING) {
        /* first valid sample after many invalid ones */
        chain_resume(state, parameters, inputs, outputs);
    } else {
        /* first valid sample of all, or an invalid state */
        chain_init(state, parameters, inputs);
    }
    outputs->fault = 1;
}

void chain_step(chain_state *state, const chain_parameters *parameters,
    const chain_inputs *inputs, chain_outputs *outputs)
{
    double v_hat[16];
    double sign_ground[15];
    double a_hat_ground[16];
    double F_hat_ground[16];
    double z_v_next[16];
    double z_ground_next[16];

    /* velocity estimate, (4.25) */
    v_hat[0] = parameters->K_v_v[0] * inputs->x[0] + state->z_v[0]; /* m/s */
    v_hat[15] = parameters->K_v_v[15] * inputs->x[15] + state->z_v[15]; /* m/s */
    /* slip sign, (4.13) */
    const double sign_ground1 = chain_sign(v_hat[0]); /* 1 */
    const double sign_ground16 = chain_sign(v_hat[15]); /* 1 */
    /* friction level, (4.11) */
    a_hat_ground[0] = state->z_ground[0] - parameters->K_F_ground[0] * fabs(v_hat[0]); /* N */
    a_hat_ground[15] = state->z_ground[15] - parameters->K_F_ground[15] * fabs(v_hat[15]); /* N */
    /* contact friction, (4.10) */
    F_hat_ground[0] = sign_ground1 * a_hat_ground[0]; /* N */
    F_hat_ground[15] = sign_ground16 * a_hat_ground[15]; /* N */
    for (int i = 1; i < 15; i++) {
        /* velocity estimate, (4.25) */
        v_hat[i] = parameters->K_v_v[i] * inputs->x[i] + state->z_v[i]; /* m/s */
        /* slip sign, (4.13) */
        sign_ground[i] = chain_sign(v_hat[i]); /* 1 */
        /* friction level, (4.11) */
        a_hat_ground[i] = state->z_ground[i] - parameters->K_F_ground[i] * fabs(v_hat[i]); /* N */
        /* contact friction, (4.10) */
        F_hat_ground[i] = sign_ground[i] * a_hat_ground[i]; /* N */
    }
    /* acceleration, (4.2) */
    const double v1_dot_hat = parameters->one_over_D16 * (parameters->c * (v_hat[1] - v_hat[0]) + parameters->k
        * (inputs->x[1] - inputs->x[0]) - F_hat_ground[0] + inputs->w); /* m/s^2 */
    const double v16_dot_hat = parameters->one_over_D16 * (parameters->c * (v_hat[14] - v_hat[15])
        + parameters->k * (inputs->x[14] - inputs->x[15]) - F_hat_ground[15]); /* m/s^2 */
    /* states one sample later (explicit Euler) */
    z_v_next[0] = parameters->sample_time * (v1_dot_hat - parameters->K_v_v[0] * v_hat[0]) + state->z_v[0]; /* m/s */
    z_v_next[15] = parameters->sample_time * (v16_dot_hat - parameters->K_v_v[15] * v_hat[15]) + state->z_v[15]; /* m/s */
    z_ground_next[0] = parameters->h_K_F_ground[0] * sign_ground1 * v1_dot_hat + state->z_ground[0]; /* N */
    z_ground_next[15] = parameters->h_K_F_ground[15] * sign_ground16 * v16_dot_hat + state->z_ground[15]; /* N */
    for (int i = 1; i < 15; i++) {
        /* acceleration, (4.2) */
        const double v_dot_hat = parameters->one_over_D16 * (parameters->c * (v_hat[i - 1] - 2.0 * v_hat[i]
            + v_hat[i + 1]) + parameters->k * (inputs->x[i - 1] - 2.0 * inputs->x[i] + inputs->x[i + 1])
            - F_hat_ground[i]); /* m/s^2 */
        /* states one sample later (explicit Euler) */
        z_v_next[i] = parameters->sample_time * (v_dot_hat - parameters->K_v_v[i] * v_hat[i]) + state->z_v[i]; /* m/s */
        z_ground_next[i] = parameters->h_K_F_ground[i] * sign_ground[i] * v_dot_hat + state->z_ground[i]; /* N */
    }

    /* this sum is too large or NaN if a next state is, or an input or output on which no next state depends */
    double check = 0.0;
    for (int i = 0; i < 16; i++) {
        check += z_v_next[i] + z_ground_next[i];
    }
    if (fabs(check) <= 1e+150 && state->mode == CHAIN_RUNNING) {
        for (int i = 0; i < 16; i++) {
            outputs->v_hat[i] = v_hat[i];
        }
        for (int i = 0; i < 16; i++) {
            outputs->a_hat_ground[i] = a_hat_ground[i];
        }
        for (int i = 0; i < 16; i++) {
            outputs->F_hat_ground[i] = F_hat_ground[i];
        }
        for (int i = 0; i < 16; i++) {
            outputs->F_hat_on_x[i] = F_hat_ground[i];
        }
        for (int i = 0; i < 16; i++) {
            state->z_v[i] = z_v_next[i];
        }
        for (int i = 0; i < 16; i++) {
            state->z_ground[i] = z_ground_next[i];
        }
        outputs->fault = 0;
    } else {
        chain_handle_fault(state, parameters, inputs, outputs);
    }
}
