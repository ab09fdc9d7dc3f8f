/*
 * rig_dfoa: friction observer DFO, velocity estimated, double precision.
 * Source: Mentzelopoulou 1994, (8.8)-(8.10), DFOa, on the reset integrator.
 *
 * Made by stiction 0.1.0 from rig_dfoa.yaml
 * sha256 69aaea3018dec1cd2da8ec6c8a524dd0cbad32293aeaf657237465d01904a3f3
 * with: stiction generate rig_dfoa.yaml
 *
 * C99, no heap, no statics, no globals, re-entrant. Division by a constant is a multiplication by its reciprocal, which
 * the parameters hold; the Python twin does the same. Compile with -std=c99 (or -ffp-contract=off) for results that are
 * bit-identical to the twin's. Do not edit: change the spec and generate again.
 */
#ifndef STICTION_RIG_DFOA_H
#define STICTION_RIG_DFOA_H

#ifdef __cplusplus
extern "C" {
#endif

/* Model constants and gains; RIG_DFOA_PARAMETERS has the spec's values. */
typedef struct {
    double J; /* kg*m^2: model parameter */
    double plates_a; /* N*m: model parameter */
    double plates_c; /* 1/rad: model parameter */
    double plates_D1; /* rad/s: model parameter */
    double plates_D2; /* rad/s: model parameter */
    double K_a; /* N*m*s/rad: observer gain */
    double K_f1; /* 1/rad: observer gain */
    double K_f2; /* s/rad: observer gain */
    double K_v; /* 1/s: observer gain */
    double sample_time; /* s: sample time */
    /* derived: rig_dfoa_prepare computes them from those above */
    double one_over_J; /* 1.0 / J */
    double plates_D1_minus_plates_D2; /* plates_D1 - plates_D2 */
    double h_K_a; /* sample_time * K_a */
} rig_dfoa_parameters;

#define RIG_DFOA_PARAMETERS \
    { \
        1.0, /* J */ \
        30.0, /* plates_a */ \
        1.0, /* plates_c */ \
        100.0, /* plates_D1 */ \
        0.1, /* plates_D2 */ \
        -5.0, /* K_a */ \
        0.0, /* K_f1 */ \
        0.0, /* K_f2 */ \
        50.0, /* K_v */ \
        0.01, /* sample_time */ \
        1.0, /* one_over_J */ \
        99.9, /* plates_D1_minus_plates_D2 */ \
        -0.05 /* h_K_a */ \
    }

/* Modes: what the next valid sample does. */
typedef enum {
    RIG_DFOA_RUNNING, /* gives new estimates */
    RIG_DFOA_HOLDING, /* after 2 invalid samples in a row: sets the state so that the estimates equal the held ones */
    RIG_DFOA_STARTING /* no sample was valid so far: initialises the state */
} rig_dfoa_mode;

/* State of the observer between two samples. */
typedef struct {
    double z_omega; /* rad/s: observer state */
    double z_f_plates; /* 1: observer state */
    double z_a_plates; /* N*m: observer state */
    rig_dfoa_mode mode;
    unsigned char invalid_samples; /* in a row; the count restarts after a valid one */
} rig_dfoa_state;

/* Measurements and commands at a sample. */
typedef struct {
    double theta; /* rad: measured position */
    double w; /* N*m: input */
} rig_dfoa_inputs;

/* Estimates at a sample. */
typedef struct {
    double omega_hat; /* rad/s: velocity estimate, (4.25) */
    double f_hat_plates; /* 1: friction state, (7.11) */
    double a_hat_plates; /* N*m: friction level, (7.10) */
    double F_hat_plates; /* N*m: contact friction, (7.12) */
    double F_hat_on_theta; /* N*m: friction force, (7.12) */
    int fault; /* 1 if this sample was not used, 0 otherwise */
} rig_dfoa_outputs;

/* Compute the derived constants: call it after a parameter was changed; RIG_DFOA_PARAMETERS includes them. */
void rig_dfoa_prepare(rig_dfoa_parameters *parameters);

/*
 * Initialise the state from the first measurement. If that is invalid, the state is zero and its mode is
 * RIG_DFOA_STARTING: the step then sets fault to 1, and its first valid sample initialises the state.
 */
void rig_dfoa_init(rig_dfoa_state *state, const rig_dfoa_parameters *parameters,
    const rig_dfoa_inputs *inputs);

/*
 * One sample: estimates from the state and this measurement, then the state of the next sample.
 * A sample is invalid if an input is NaN or infinite, or if the inputs in sum, and the next states that they give, are
 * beyond 1e+150: the outputs then hold the last estimates, fault is 1, and the state is predicted with the held
 * velocity. If the inputs are valid but the state is not, or its mode is not RIG_DFOA_RUNNING,
 * the estimates are held too, fault is 1, and the state is set from this sample.
 * Set the outputs to zero before the first step, and pass the same ones to each: the held estimates are read from them.
 */
void rig_dfoa_step(rig_dfoa_state *state, const rig_dfoa_parameters *parameters,
    const rig_dfoa_inputs *inputs, rig_dfoa_outputs *outputs);

#ifdef __cplusplus
}
#endif

#endif
