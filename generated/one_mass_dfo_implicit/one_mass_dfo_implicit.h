/*
 * one_mass_dfo_implicit: friction observer DFO, velocity estimated, double precision.
 * Source: Mentzelopoulou 1994, section 6.7.
 *
 * Made by stiction 0.1.0 from one_mass_dfo_implicit.yaml
 * sha256 17681b16fcc2f3a9b534fe636ee6636e1a2e959da23f3b9cd0482eb72dad1be6
 * with: stiction generate one_mass_dfo_implicit.yaml
 *
 * C99, no heap, no statics, no globals, re-entrant. Division by a constant is a multiplication by its reciprocal, which
 * the parameters hold; the Python twin does the same. Compile with -std=c99 (or -ffp-contract=off) for results that are
 * bit-identical to the twin's. Do not edit: change the spec and generate again.
 */
#ifndef STICTION_ONE_MASS_DFO_IMPLICIT_H
#define STICTION_ONE_MASS_DFO_IMPLICIT_H

#ifdef __cplusplus
extern "C" {
#endif

/* Model constants and gains; ONE_MASS_DFO_IMPLICIT_PARAMETERS has the spec's values. */
typedef struct {
    double m; /* kg: model parameter */
    double rail_a; /* N: model parameter */
    double rail_c; /* 1/m: model parameter */
    double rail_D1; /* m/s: model parameter */
    double rail_D2; /* m/s: model parameter */
    double K_a; /* N*s/m: observer gain */
    double K_f1; /* 1/m: observer gain */
    double K_f2; /* s/m: observer gain */
    double K_v; /* 1/s: observer gain */
    double sample_time; /* s: sample time */
    /* derived: one_mass_dfo_implicit_prepare computes them from those above */
    double h_K_v; /* sample_time * K_v */
    double rail_D1_minus_rail_D2; /* rail_D1 - rail_D2 */
    double h_K_f2; /* sample_time * K_f2 */
    double K_a_K_f2; /* K_a * K_f2 */
    double constant_1; /* 1.0 / (h_K_v + 1.0) */
    double constant_2; /* h_K_v / (h_K_v + 1.0) */
    double constant_3; /* rail_c * (1.0 - rail_D2 * K_f2 - K_f2 * rail_D1_minus_rail_D2) */
    double constant_4; /* 0.5 * rail_c * K_f2 * rail_D1_minus_rail_D2 */
    double constant_5; /* sample_time / (h_K_v + 1.0) */
    double h_K_a; /* sample_time * K_a */
    double constant_6; /* h_K_a / (h_K_v + 1.0) */
    double constant_7; /* rail_c * (rail_D2 + rail_D1 - rail_D2) */
    double constant_8; /* 0.5 * rail_c * rail_D1_minus_rail_D2 */
} one_mass_dfo_implicit_parameters;

#define ONE_MASS_DFO_IMPLICIT_PARAMETERS \
    { \
        1.0, /* m */ \
        50.0, /* rail_a */ \
        100.0, /* rail_c */ \
        1000.0, /* rail_D1 */ \
        0.0001, /* rail_D2 */ \
        -10.0, /* K_a */ \
        -0.01, /* K_f1 */ \
        0.0, /* K_f2 */ \
        100.0, /* K_v */ \
        0.001, /* sample_time */ \
        0.1, /* h_K_v */ \
        999.9999, /* rail_D1_minus_rail_D2 */ \
        0.0, /* h_K_f2 */ \
        -0.0, /* K_a_K_f2 */ \
        0.9090909090909091, /* constant_1 */ \
        0.09090909090909091, /* constant_2 */ \
        100.0, /* constant_3 */ \
        0.0, /* constant_4 */ \
        0.0009090909090909091, /* constant_5 */ \
        -0.01, /* h_K_a */ \
        -0.00909090909090909, /* constant_6 */ \
        100000.0, /* constant_7 */ \
        49999.995 /* constant_8 */ \
    }

/* Modes: what the next valid sample does. */
typedef enum {
    ONE_MASS_DFO_IMPLICIT_RUNNING, /* gives new estimates */
    ONE_MASS_DFO_IMPLICIT_HOLDING, /* after 8 invalid samples in a row: sets the state so that the estimates equal the held ones */
    ONE_MASS_DFO_IMPLICIT_STARTING /* no sample was valid so far: initialises the state */
} one_mass_dfo_implicit_mode;

/* State of the observer between two samples. */
typedef struct {
    double z_v; /* m/s: observer state */
    double z_f_rail; /* 1: observer state */
    double z_a_rail; /* N: observer state */
    double w_held; /* N: w since the sample before */
    one_mass_dfo_implicit_mode mode;
    unsigned char invalid_samples; /* in a row; the count restarts after a valid one */
} one_mass_dfo_implicit_state;

/* Measurements and commands at a sample. */
typedef struct {
    double x; /* m: measured position */
    double w; /* N: input */
} one_mass_dfo_implicit_inputs;

/* Estimates at a sample. */
typedef struct {
    double v_hat; /* m/s: velocity estimate, (4.25) */
    double f_hat_rail; /* 1: friction state, (7.11) */
    double a_hat_rail; /* N: friction level, (7.10) */
    double F_hat_rail; /* N: contact friction, (7.12) */
    double F_hat_on_x; /* N: friction force, (7.12) */
    int fault; /* 1 if this sample was not used, 0 otherwise */
} one_mass_dfo_implicit_outputs;

/* Compute the derived constants: call it after a parameter was changed; ONE_MASS_DFO_IMPLICIT_PARAMETERS includes them. */
void one_mass_dfo_implicit_prepare(one_mass_dfo_implicit_parameters *parameters);

/*
 * Initialise the state from the first measurement. If that is invalid, the state is zero and its mode is
 * ONE_MASS_DFO_IMPLICIT_STARTING: the step then sets fault to 1, and its first valid sample initialises the state.
 */
void one_mass_dfo_implicit_init(one_mass_dfo_implicit_state *state, const one_mass_dfo_implicit_parameters *parameters,
    const one_mass_dfo_implicit_inputs *inputs);

/*
 * One sample: estimates from the state and this measurement, then the state of the next sample.
 * A sample is invalid if an input is NaN or infinite, or if the inputs in sum, and the next states that they give, are
 * beyond 1e+150: the outputs then hold the last estimates, fault is 1, and the state is predicted with the held
 * velocity. If the inputs are valid but the state is not, or its mode is not ONE_MASS_DFO_IMPLICIT_RUNNING,
 * the estimates are held too, fault is 1, and the state is set from this sample.
 * Set the outputs to zero before the first step, and pass the same ones to each: the held estimates are read from them.
 */
void one_mass_dfo_implicit_step(one_mass_dfo_implicit_state *state, const one_mass_dfo_implicit_parameters *parameters,
    const one_mass_dfo_implicit_inputs *inputs, one_mass_dfo_implicit_outputs *outputs);

#ifdef __cplusplus
}
#endif

#endif
