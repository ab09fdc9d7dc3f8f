/*
 * rig: friction observer CFO, velocity estimated, double precision.
 * Source: Mentzelopoulou 1994, chapter 8; the signs of (8.4)-(8.5) as in (3.8)-(3.10).
 *
 * Made by stiction 0.1.0 from rig.yaml
 * sha256 f86bd8b1a92165fc8be5068dad91ef4dc02dd84ee43c29f9621a6f3ae7dc1e8a
 * with: stiction generate rig.yaml
 *
 * C99, no heap, no statics, no globals, re-entrant. Division by a constant is a product with its reciprocal, which the
 * parameters hold; the Python twin does the same. Compile with -std=c99 (or -ffp-contract=off) to get the bits of the
 * twin. Do not edit: change the spec and generate again.
 */
#ifndef STICTION_RIG_H
#define STICTION_RIG_H

#ifdef __cplusplus
extern "C" {
#endif

/* Constants of the model and gains; RIG_PARAMETERS holds the spec's values. */
typedef struct {
    double J; /* kg*m^2: model parameter */
    double plates_a; /* N*m: model parameter */
    double K_F; /* N*m*s/rad: observer gain */
    double K_v; /* 1/s: observer gain */
    double sample_time; /* s: sample time */
    /* derived: rig_prepare computes them from those above */
    double one_over_J; /* 1.0 / J */
    double h_K_F; /* sample_time * K_F */
} rig_parameters;

#define RIG_PARAMETERS \
    { \
        1.0, /* J */ \
        30.0, /* plates_a */ \
        10.0, /* K_F */ \
        50.0, /* K_v */ \
        0.01, /* sample_time */ \
        1.0, /* one_over_J */ \
        0.1 /* h_K_F */ \
    }

/* What the observer remembers from sample to sample. */
typedef struct {
    double z_omega; /* rad/s: observer state */
    double z_plates; /* N*m: observer state */
    double waiting; /* 1 until a good sample has set the state; below 1/2 in use, with a count of lost samples */
} rig_state;

/* What is measured and commanded at a sample. */
typedef struct {
    double theta; /* rad: measured position */
    double w; /* N*m: input */
} rig_inputs;

/* What is estimated. */
typedef struct {
    double omega_hat; /* rad/s: velocity estimate, (4.25) */
    double a_hat_plates; /* N*m: friction level, (4.11) */
    double F_hat_plates; /* N*m: contact friction, (4.10) */
    double F_hat_on_theta; /* N*m: friction force, (4.10) */
    int fault; /* 1 if this sample was not used, 0 otherwise */
} rig_outputs;

/* Compute the derived constants anew: call it after a parameter was changed; RIG_PARAMETERS has them. */
void rig_prepare(rig_parameters *parameters);

/*
 * Set the state from the first measurement. Where that cannot be used the state is zero and waiting is 1: the step then gives
 * fault 1, and its first good sample sets the state.
 */
void rig_init(rig_state *state, const rig_parameters *parameters,
    const rig_inputs *inputs);

/*
 * One sample: estimates from the state and this measurement, then the state of the next sample.
 * Where an input is NaN or infinite, or a next state would be or lie beyond 1e+150, the estimates in outputs
 * stay as they are and fault is 1; the state goes along as if the machine went on with the velocity that is held. Where the
 * inputs are good, it is the state that cannot be used or waits: it is set from them, and the next sample is estimated again.
 * Set the outputs to zero before the first step, and hand in the same at each: the held estimates are read from them.
 */
void rig_step(rig_state *state, const rig_parameters *parameters,
    const rig_inputs *inputs, rig_outputs *outputs);

#ifdef __cplusplus
}
#endif

#endif
