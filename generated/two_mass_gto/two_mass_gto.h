/*
 * two_mass_gto: friction observer GTO, velocity estimated, double precision.
 * Source: Mentzelopoulou 1994, section 7.7.
 *
 * Made by stiction 0.1.0 from two_mass_gto.yaml
 * sha256 932bc20815ec1ae32f63ada9d5584caefed2b8701438129d726e5f8582fcbdaf
 * with: stiction generate two_mass_gto.yaml
 *
 * C99, no heap, no statics, no globals, re-entrant. Division by a constant is a multiplication by its reciprocal, which
 * the parameters hold; the Python twin does the same. Compile with -std=c99 (or -ffp-contract=off) for results that are
 * bit-identical to the twin's. Do not edit: change the spec and generate again.
 */
#ifndef STICTION_TWO_MASS_GTO_H
#define STICTION_TWO_MASS_GTO_H

#ifdef __cplusplus
extern "C" {
#endif

/* Model constants and gains; TWO_MASS_GTO_PARAMETERS has the spec's values. */
typedef struct {
    double m1; /* kg: model parameter */
    double m2; /* kg: model parameter */
    double eta1; /* N/m: model parameter */
    double eta2; /* N/m: model parameter */
    double eta3; /* N/m: model parameter */
    double K_1_x1; /* N/m: observer gain */
    double K_1_x2; /* N/m: observer gain */
    double K_2_x1; /* N*s/m: observer gain */
    double K_2_x2; /* N*s/m: observer gain */
    double K_v_v1; /* 1/s: observer gain */
    double K_v_v2; /* 1/s: observer gain */
    double sample_time; /* s: sample time */
    /* derived: two_mass_gto_prepare computes them from those above */
    double eta2_plus_eta3; /* eta2 + eta3 */
    double eta1_plus_eta3; /* eta1 + eta3 */
    double one_over_m1; /* 1.0 / m1 */
    double one_over_m2; /* 1.0 / m2 */
    double h_K_1_x1; /* sample_time * K_1_x1 */
    double h_K_2_x1; /* sample_time * K_2_x1 */
    double h_K_1_x2; /* sample_time * K_1_x2 */
    double h_K_2_x2; /* sample_time * K_2_x2 */
} two_mass_gto_parameters;

#define TWO_MASS_GTO_PARAMETERS \
    { \
        10.0, /* m1 */ \
        50.0, /* m2 */ \
        100.0, /* eta1 */ \
        50.0, /* eta2 */ \
        20.0, /* eta3 */ \
        0.0, /* K_1_x1 */ \
        0.0, /* K_1_x2 */ \
        -1000.0, /* K_2_x1 */ \
        -5000.0, /* K_2_x2 */ \
        10.0, /* K_v_v1 */ \
        10.0, /* K_v_v2 */ \
        0.001, /* sample_time */ \
        70.0, /* eta2_plus_eta3 */ \
        120.0, /* eta1_plus_eta3 */ \
        0.1, /* one_over_m1 */ \
        0.02, /* one_over_m2 */ \
        0.0, /* h_K_1_x1 */ \
        -1.0, /* h_K_2_x1 */ \
        0.0, /* h_K_1_x2 */ \
        -5.0 /* h_K_2_x2 */ \
    }

/* Modes: what the next valid sample does. */
typedef enum {
    TWO_MASS_GTO_RUNNING, /* gives new estimates */
    TWO_MASS_GTO_HOLDING, /* after 8 invalid samples in a row: sets the state so that the estimates equal the held ones */
    TWO_MASS_GTO_STARTING /* no sample was valid so far: initialises the state */
} two_mass_gto_mode;

/* State of the observer between two samples. */
typedef struct {
    double z_v1; /* m/s: observer state */
    double z_v2; /* m/s: observer state */
    double z_x1; /* N: observer state */
    double z_x2; /* N: observer state */
    two_mass_gto_mode mode;
    unsigned char invalid_samples; /* in a row; the count restarts after a valid one */
} two_mass_gto_state;

/* Measurements and commands at a sample. */
typedef struct {
    double x1; /* m: measured position */
    double x2; /* m: measured position */
    double w; /* N: input */
} two_mass_gto_inputs;

/* Estimates at a sample. */
typedef struct {
    double v1_hat; /* m/s: velocity estimate, (4.25) */
    double v2_hat; /* m/s: velocity estimate, (4.25) */
    double tracked_x1; /* N: tracked friction, (4.16) */
    double tracked_x2; /* N: tracked friction, (4.16) */
    double F_hat_on_x1; /* N: friction force, (4.16) */
    double F_hat_on_x2; /* N: friction force, (4.16) */
    int fault; /* 1 if this sample was not used, 0 otherwise */
} two_mass_gto_outputs;

/* Compute the derived constants: call it after a parameter was changed; TWO_MASS_GTO_PARAMETERS includes them. */
void two_mass_gto_prepare(two_mass_gto_parameters *parameters);

/*
 * Initialise the state from the first measurement. If that is invalid, the state is zero and its mode is
 * TWO_MASS_GTO_STARTING: the step then sets fault to 1, and its first valid sample initialises the state.
 */
void two_mass_gto_init(two_mass_gto_state *state, const two_mass_gto_parameters *parameters,
    const two_mass_gto_inputs *inputs);

/*
 * One sample: estimates from the state and this measurement, then the state of the next sample.
 * A sample is invalid if an input is NaN or infinite, or if the inputs in sum, and the next states that they give, are
 * beyond 1e+150: the outputs then hold the last estimates, fault is 1, and the state is predicted with the held
 * velocity. If the inputs are valid but the state is not, or its mode is not TWO_MASS_GTO_RUNNING,
 * the estimates are held too, fault is 1, and the state is set from this sample.
 * Set the outputs to zero before the first step, and pass the same ones to each: the held estimates are read from them.
 */
void two_mass_gto_step(two_mass_gto_state *state, const two_mass_gto_parameters *parameters,
    const two_mass_gto_inputs *inputs, two_mass_gto_outputs *outputs);

#ifdef __cplusplus
}
#endif

#endif
