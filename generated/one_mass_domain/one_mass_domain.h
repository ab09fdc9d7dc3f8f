/*
 * one_mass_domain: friction observer CFO, velocity estimated, double precision.
 * Source: Mentzelopoulou 1994, sections 2.3 and 3.3; the domain is ours (docs/certificate.md).
 *
 * Made by stiction 0.1.0 from one_mass_domain.yaml
 * sha256 8d460ce60843deab9a083d6f6e692c331d1ab3b95be9c9c28efa58c7ade55a45
 * with: stiction generate one_mass_domain.yaml
 *
 * C99, no heap, no statics, no globals, re-entrant. Division by a constant is a multiplication by its reciprocal, which
 * the parameters hold; the Python twin does the same. Compile with -std=c99 (or -ffp-contract=off) for results that are
 * bit-identical to the twin's. Do not edit: change the spec and generate again.
 */
#ifndef STICTION_ONE_MASS_DOMAIN_H
#define STICTION_ONE_MASS_DOMAIN_H

#ifdef __cplusplus
extern "C" {
#endif

/* Model constants and gains; ONE_MASS_DOMAIN_PARAMETERS has the spec's values. */
typedef struct {
    double m; /* kg: model parameter */
    double rail_a; /* N: model parameter */
    double K_F; /* N*s/m: observer gain */
    double K_v; /* 1/s: observer gain */
    double slip_speed; /* m/s: least slip speed of the domain */
    double a_low_rail; /* N: least level */
    double a_high_rail; /* N: largest level */
    double settle_samples; /* 1: samples until the estimate is in its domain */
    double restart_samples; /* 1: samples in which the level is held at a start */
    double largest_innovation; /* m: of the measured position, in the domain */
    double sample_time; /* s: sample time */
    /* derived: one_mass_domain_prepare computes them from those above */
    double one_over_m; /* 1.0 / m */
    double constant_1; /* 0.5 * a_high_rail + 0.5 * a_low_rail */
} one_mass_domain_parameters;

#define ONE_MASS_DOMAIN_PARAMETERS \
    { \
        1.0, /* m */ \
        50.0, /* rail_a */ \
        10.0, /* K_F */ \
        100.0, /* K_v */ \
        1.0, /* slip_speed */ \
        40.0, /* a_low_rail */ \
        60.0, /* a_high_rail */ \
        300.0, /* settle_samples */ \
        88.0, /* restart_samples */ \
        0.0003, /* largest_innovation */ \
        0.001, /* sample_time */ \
        1.0, /* one_over_m */ \
        50.0 /* constant_1 */ \
    }

/* Modes: what the next valid sample does. */
typedef enum {
    ONE_MASS_DOMAIN_RUNNING, /* gives new estimates */
    ONE_MASS_DOMAIN_HOLDING, /* after 8 invalid samples in a row: sets the state so that the estimates equal the held ones */
    ONE_MASS_DOMAIN_STARTING /* no sample was valid so far: initialises the state */
} one_mass_domain_mode;

/* State of the observer between two samples. */
typedef struct {
    double z_v; /* m/s: observer state */
    double z_rail; /* N: observer state */
    double direction_rail; /* 1: sign with which the level was updated, or 0 */
    double samples_held; /* 1: samples for which the level is held after a start */
    double samples_slid; /* 1: samples since the level is updated, counted up to settle_samples */
    double x_predicted; /* m: position predicted for this sample */
    one_mass_domain_mode mode;
    unsigned char invalid_samples; /* in a row; the count restarts after a valid one */
} one_mass_domain_state;

/* Measurements and commands at a sample. */
typedef struct {
    double x; /* m: measured position */
    double w; /* N: input */
} one_mass_domain_inputs;

/* Estimates at a sample. */
typedef struct {
    double v_hat; /* m/s: velocity estimate, (4.25) */
    double a_hat_rail; /* N: friction level, (4.11) */
    double F_hat_rail; /* N: contact friction, (4.10) */
    double F_hat_on_x; /* N: friction force, (4.10) */
    double in_domain; /* 1: in domain, 1 where the certificate's bound holds, if its assumptions do */
    int fault; /* 1 if this sample was not used, 0 otherwise */
} one_mass_domain_outputs;

/* Compute the derived constants: call it after a parameter was changed; ONE_MASS_DOMAIN_PARAMETERS includes them. */
void one_mass_domain_prepare(one_mass_domain_parameters *parameters);

/*
 * Initialise the state from the first measurement. If that is invalid, the state is zero and its mode is
 * ONE_MASS_DOMAIN_STARTING: the step then sets fault to 1, and its first valid sample initialises the state.
 */
void one_mass_domain_init(one_mass_domain_state *state, const one_mass_domain_parameters *parameters,
    const one_mass_domain_inputs *inputs);

/*
 * One sample: estimates from the state and this measurement, then the state of the next sample.
 * A sample is invalid if an input is NaN or infinite, or if the inputs in sum, and the next states that they give, are
 * beyond 1e+150: the outputs then hold the last estimates, fault is 1, and the state is predicted with the held
 * velocity. If the inputs are valid but the state is not, or its mode is not ONE_MASS_DOMAIN_RUNNING,
 * the estimates are held too, fault is 1, and the state is set from this sample.
 * Set the outputs to zero before the first step, and pass the same ones to each: the held estimates are read from them.
 */
void one_mass_domain_step(one_mass_domain_state *state, const one_mass_domain_parameters *parameters,
    const one_mass_domain_inputs *inputs, one_mass_domain_outputs *outputs);

#ifdef __cplusplus
}
#endif

#endif
