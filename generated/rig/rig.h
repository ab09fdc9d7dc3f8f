/*
 * rig: friction observer CFO, velocity estimated, double precision.
 * Source: Mentzelopoulou 1994, chapter 8; the signs of (8.4)-(8.5) as in (3.8)-(3.10).
 *
 * Made by stiction 0.1.0 from rig.yaml
 * sha256 f86bd8b1a92165fc8be5068dad91ef4dc02dd84ee43c29f9621a6f3ae7dc1e8a
 * with: stiction generate rig.yaml
 *
 * C99, no heap, no statics, no globals, re-entrant. Division by a constant is a multiplication by its reciprocal, which
 * the parameters hold; the Python twin does the same. Compile with -std=c99 (or -ffp-contract=off) for results that are
 * bit-identical to the twin's. Do not edit: change the spec and generate again.
 */
#ifndef STICTION_RIG_H
#define STICTION_RIG_H

#ifdef __cplusplus
extern "C" {
#endif

/* Model constants and gains; RIG_PARAMETERS has the spec's values. */
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

/* Modes: what the next valid sample does. */
typedef enum {
    RIG_RUNNING, /* gives new estimates */
    RIG_HOLDING, /* after 2 invalid samples in a row: sets the state so that the estimates equal the held ones */
    RIG_STARTING /* no sample was valid so far: initialises the state */
} rig_mode;

/* State of the observer between two samples. */
typedef struct {
    double z_omega; /* rad/s: observer state */
    double z_plates; /* N*m: observer state */
    rig_mode mode;
    unsigned char invalid_samples; /* in a row; the count restarts after a valid one */
} rig_state;

/* Measurements and commands at a sample. */
typedef struct {
    double theta; /* rad: measured position */
    double w; /* N*m: input */
} rig_inputs;

/* Estimates at a sample. */
typedef struct {
    double omega_hat; /* rad/s: velocity estimate, (4.25) */
    double a_hat_plates; /* N*m: friction level, (4.11) */
    double F_hat_plates; /* N*m: contact friction, (4.10) */
    double F_hat_on_theta; /* N*m: friction force, (4.10) */
    int fault; /* 1 if this sample was not used, 0 otherwise */
} rig_outputs;

/* Compute the derived constants: call it after a parameter was changed; RIG_PARAMETERS includes them. */
void rig_prepare(rig_parameters *parameters);

/*
 * Initialise the state from the first measurement. If that is invalid, the state is zero and its mode is
 * RIG_STARTING: the step then sets fault to 1, and its first valid sample initialises the state.
 */
void rig_init(rig_state *state, const rig_parameters *parameters,
    const rig_inputs *inputs);

/*
 * One sample: estimates from the state and this measurement, then the state of the next sample.
 * A sample is invalid if an input is NaN or infinite, or if the inputs in sum, and the next states that they give, are
 * beyond 1e+150: the outputs then hold the last estimates, fault is 1, and the state is predicted with the held
 * velocity. If the inputs are valid but the state is not, or its mode is not RIG_RUNNING,
 * the estimates are held too, fault is 1, and the state is set from this sample.
 * Set the outputs to zero before the first step, and pass the same ones to each: the held estimates are read from them.
 */
void rig_step(rig_state *state, const rig_parameters *parameters,
    const rig_inputs *inputs, rig_outputs *outputs);

#ifdef __cplusplus
}
#endif

#endif
