/*
 * rig_to: friction observer TO, velocity estimated, double precision.
 * Source: Mentzelopoulou 1994, (8.6)-(8.7), tracking observer.
 *
 * Made by stiction 0.1.0 from rig_to.yaml
 * sha256 3f8a34b28bf62f6eba9ec73e43a7a6df1bc1671345b852be96b034354d84bb91
 * with: stiction generate rig_to.yaml
 *
 * C99, no heap, no statics, no globals, re-entrant. Division by a constant is a multiplication by its reciprocal, which
 * the parameters hold; the Python twin does the same. Compile with -std=c99 (or -ffp-contract=off) for results that are
 * bit-identical to the twin's. Do not edit: change the spec and generate again.
 */
#ifndef STICTION_RIG_TO_H
#define STICTION_RIG_TO_H

#ifdef __cplusplus
extern "C" {
#endif

/* Model constants and gains; RIG_TO_PARAMETERS has the spec's values. */
typedef struct {
    double J; /* kg*m^2: model parameter */
    double K_1; /* N*m/rad: observer gain */
    double K_2; /* N*m*s/rad: observer gain */
    double K_v; /* 1/s: observer gain */
    double sample_time; /* s: sample time */
    /* derived: rig_to_prepare computes them from those above */
    double one_over_J; /* 1.0 / J */
    double h_K_1; /* sample_time * K_1 */
    double h_K_2; /* sample_time * K_2 */
} rig_to_parameters;

#define RIG_TO_PARAMETERS \
    { \
        1.0, /* J */ \
        0.0, /* K_1 */ \
        -10.0, /* K_2 */ \
        50.0, /* K_v */ \
        0.01, /* sample_time */ \
        1.0, /* one_over_J */ \
        0.0, /* h_K_1 */ \
        -0.1 /* h_K_2 */ \
    }

/* Modes: what the next valid sample does. */
typedef enum {
    RIG_TO_RUNNING, /* gives new estimates */
    RIG_TO_HOLDING, /* after 2 invalid samples in a row: sets the state so that the estimates equal the held ones */
    RIG_TO_STARTING /* no sample was valid so far: initialises the state */
} rig_to_mode;

/* State of the observer between two samples. */
typedef struct {
    double z_omega; /* rad/s: observer state */
    double z_theta; /* N*m: observer state */
    rig_to_mode mode;
    unsigned char invalid_samples; /* in a row; the count restarts after a valid one */
} rig_to_state;

/* Measurements and commands at a sample. */
typedef struct {
    double theta; /* rad: measured position */
    double w; /* N*m: input */
} rig_to_inputs;

/* Estimates at a sample. */
typedef struct {
    double omega_hat; /* rad/s: velocity estimate, (4.25) */
    double tracked_theta; /* N*m: tracked friction, (4.16) */
    double F_hat_on_theta; /* N*m: friction force, (4.16) */
    int fault; /* 1 if this sample was not used, 0 otherwise */
} rig_to_outputs;

/* Compute the derived constants: call it after a parameter was changed; RIG_TO_PARAMETERS includes them. */
void rig_to_prepare(rig_to_parameters *parameters);

/*
 * Initialise the state from the first measurement. If that is invalid, the state is zero and its mode is
 * RIG_TO_STARTING: the step then sets fault to 1, and its first valid sample initialises the state.
 */
void rig_to_init(rig_to_state *state, const rig_to_parameters *parameters,
    const rig_to_inputs *inputs);

/*
 * One sample: estimates from the state and this measurement, then the state of the next sample.
 * A sample is invalid if an input is NaN or infinite, or if the inputs in sum, and the next states that they give, are
 * beyond 1e+150: the outputs then hold the last estimates, fault is 1, and the state is predicted with the held
 * velocity. If the inputs are valid but the state is not, or its mode is not RIG_TO_RUNNING,
 * the estimates are held too, fault is 1, and the state is set from this sample.
 * Set the outputs to zero before the first step, and pass the same ones to each: the held estimates are read from them.
 */
void rig_to_step(rig_to_state *state, const rig_to_parameters *parameters,
    const rig_to_inputs *inputs, rig_to_outputs *outputs);

#ifdef __cplusplus
}
#endif

#endif
