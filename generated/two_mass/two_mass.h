/*
 * two_mass: friction observer GCFO, velocity estimated, double precision.
 * Source: Mentzelopoulou 1994, section 4.7.
 *
 * Made by stiction 0.1.0 from two_mass.yaml
 * sha256 5d108a0c2b344775326f5cfaa6fd42c8eb9332c34c728456b6a6b3d0f61c8c7a
 * with: stiction generate two_mass.yaml
 *
 * C99, no heap, no statics, no globals, re-entrant. Division by a constant is a multiplication by its reciprocal, which
 * the parameters hold; the Python twin does the same. Compile with -std=c99 (or -ffp-contract=off) for results that are
 * bit-identical to the twin's. Do not edit: change the spec and generate again.
 */
#ifndef STICTION_TWO_MASS_H
#define STICTION_TWO_MASS_H

#ifdef __cplusplus
extern "C" {
#endif

/* Model constants and gains; TWO_MASS_PARAMETERS has the spec's values. */
typedef struct {
    double m1; /* kg: model parameter */
    double m2; /* kg: model parameter */
    double eta1; /* N/m: model parameter */
    double eta2; /* N/m: model parameter */
    double eta3; /* N/m: model parameter */
    double between_a; /* N: model parameter */
    double ground_a; /* N: model parameter */
    double K_F_between; /* N*s/m: observer gain */
    double K_F_ground; /* N*s/m: observer gain */
    double K_v_v1; /* 1/s: observer gain */
    double K_v_v2; /* 1/s: observer gain */
    double sample_time; /* s: sample time */
    /* derived: two_mass_prepare computes them from those above */
    double eta2_plus_eta3; /* eta2 + eta3 */
    double eta1_plus_eta3; /* eta1 + eta3 */
    double one_over_m1; /* 1.0 / m1 */
    double one_over_m2; /* 1.0 / m2 */
    double h_K_F_between; /* sample_time * K_F_between */
    double h_K_F_ground; /* sample_time * K_F_ground */
} two_mass_parameters;

#define TWO_MASS_PARAMETERS \
    { \
        10.0, /* m1 */ \
        50.0, /* m2 */ \
        100.0, /* eta1 */ \
        50.0, /* eta2 */ \
        20.0, /* eta3 */ \
        10.0, /* between_a */ \
        20.0, /* ground_a */ \
        500.0, /* K_F_between */ \
        700.0, /* K_F_ground */ \
        10.0, /* K_v_v1 */ \
        10.0, /* K_v_v2 */ \
        0.001, /* sample_time */ \
        70.0, /* eta2_plus_eta3 */ \
        120.0, /* eta1_plus_eta3 */ \
        0.1, /* one_over_m1 */ \
        0.02, /* one_over_m2 */ \
        0.5, /* h_K_F_between */ \
        0.7000000000000001 /* h_K_F_ground */ \
    }

/* Modes: what the next valid sample does. */
typedef enum {
    TWO_MASS_RUNNING, /* gives new estimates */
    TWO_MASS_HOLDING, /* after 8 invalid samples in a row: sets the state so that the estimates equal the held ones */
    TWO_MASS_STARTING /* no sample was valid so far: initialises the state */
} two_mass_mode;

/* State of the observer between two samples. */
typedef struct {
    double z_v1; /* m/s: observer state */
    double z_v2; /* m/s: observer state */
    double z_between; /* N: observer state */
    double z_ground; /* N: observer state */
    two_mass_mode mode;
    unsigned char invalid_samples; /* in a row; the count restarts after a valid one */
} two_mass_state;

/* Measurements and commands at a sample. */
typedef struct {
    double x1; /* m: measured position */
    double x2; /* m: measured position */
    double w; /* N: input */
} two_mass_inputs;

/* Estimates at a sample. */
typedef struct {
    double v1_hat; /* m/s: velocity estimate, (4.25) */
    double v2_hat; /* m/s: velocity estimate, (4.25) */
    double a_hat_between; /* N: friction level, (4.11) */
    double a_hat_ground; /* N: friction level, (4.11) */
    double F_hat_between; /* N: contact friction, (4.10) */
    double F_hat_ground; /* N: contact friction, (4.10) */
    double F_hat_on_x1; /* N: friction force, (4.10) */
    double F_hat_on_x2; /* N: friction force, (4.10) */
    int fault; /* 1 if this sample was not used, 0 otherwise */
} two_mass_outputs;

/* Compute the derived constants: call it after a parameter was changed; TWO_MASS_PARAMETERS includes them. */
void two_mass_prepare(two_mass_parameters *parameters);

/*
 * Initialise the state from the first measurement. If that is invalid, the state is zero and its mode is
 * TWO_MASS_STARTING: the step then sets fault to 1, and its first valid sample initialises the state.
 */
void two_mass_init(two_mass_state *state, const two_mass_parameters *parameters,
    const two_mass_inputs *inputs);

/*
 * One sample: estimates from the state and this measurement, then the state of the next sample.
 * A sample is invalid if an input is NaN or infinite, or if the inputs in sum, and the next states that they give, are
 * beyond 1e+150: the outputs then hold the last estimates, fault is 1, and the state is predicted with the held
 * velocity. If the inputs are valid but the state is not, or its mode is not TWO_MASS_RUNNING,
 * the estimates are held too, fault is 1, and the state is set from this sample.
 * Set the outputs to zero before the first step, and pass the same ones to each: the held estimates are read from them.
 */
void two_mass_step(two_mass_state *state, const two_mass_parameters *parameters,
    const two_mass_inputs *inputs, two_mass_outputs *outputs);

#ifdef __cplusplus
}
#endif

#endif
