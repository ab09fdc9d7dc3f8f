/*
 * belt_axis: friction observer GCFO, velocity estimated, double precision.
 * Source: the project’s own example.
 *
 * Made by stiction 0.1.0 from belt_axis.yaml
 * sha256 011c159c52aff177b4ffacdfdb486cf7c777fa8381d977de25a0d69ba40ac64f
 * with: stiction generate belt_axis.yaml
 *
 * C99, no heap, no statics, no globals, re-entrant. Division by a constant is a multiplication by its reciprocal, which
 * the parameters hold; the Python twin does the same. Compile with -std=c99 (or -ffp-contract=off) for results that are
 * bit-identical to the twin's. Do not edit: change the spec and generate again.
 */
#ifndef STICTION_BELT_AXIS_H
#define STICTION_BELT_AXIS_H

#ifdef __cplusplus
extern "C" {
#endif

/* Model constants and gains; BELT_AXIS_PARAMETERS has the spec's values. */
typedef struct {
    double m; /* kg: model parameter */
    double kf; /* N/V: model parameter */
    double b; /* N*s/m: model parameter */
    double guide_a; /* N: model parameter */
    double K_F; /* N*s/m: observer gain */
    double K_v; /* 1/s: observer gain */
    double sample_time; /* s: sample time */
    /* derived: belt_axis_prepare computes them from those above */
    double one_over_m; /* 1.0 / m */
    double h_K_F; /* sample_time * K_F */
} belt_axis_parameters;

#define BELT_AXIS_PARAMETERS \
    { \
        4.2, /* m */ \
        18.5, /* kf */ \
        12.0, /* b */ \
        9.0, /* guide_a */ \
        250.0, /* K_F */ \
        120.0, /* K_v */ \
        0.001, /* sample_time */ \
        0.23809523809523808, /* one_over_m */ \
        0.25 /* h_K_F */ \
    }

/* Modes: what the next valid sample does. */
typedef enum {
    BELT_AXIS_RUNNING, /* gives new estimates */
    BELT_AXIS_HOLDING, /* after 8 invalid samples in a row: sets the state so that the estimates equal the held ones */
    BELT_AXIS_STARTING /* no sample was valid so far: initialises the state */
} belt_axis_mode;

/* State of the observer between two samples. */
typedef struct {
    double z_v; /* m/s: observer state */
    double z_guide; /* N: observer state */
    belt_axis_mode mode;
    unsigned char invalid_samples; /* in a row; the count restarts after a valid one */
} belt_axis_state;

/* Measurements and commands at a sample. */
typedef struct {
    double x; /* m: measured position */
    double u; /* V: input */
} belt_axis_inputs;

/* Estimates at a sample. */
typedef struct {
    double v_hat; /* m/s: velocity estimate, (4.25) */
    double a_hat_guide; /* N: friction level, (4.11) */
    double F_hat_guide; /* N: contact friction, (4.10) */
    double F_hat_on_x; /* N: friction force, (4.10) */
    int fault; /* 1 if this sample was not used, 0 otherwise */
} belt_axis_outputs;

/* Compute the derived constants: call it after a parameter was changed; BELT_AXIS_PARAMETERS includes them. */
void belt_axis_prepare(belt_axis_parameters *parameters);

/*
 * Initialise the state from the first measurement. If that is invalid, the state is zero and its mode is
 * BELT_AXIS_STARTING: the step then sets fault to 1, and its first valid sample initialises the state.
 */
void belt_axis_init(belt_axis_state *state, const belt_axis_parameters *parameters,
    const belt_axis_inputs *inputs);

/*
 * One sample: estimates from the state and this measurement, then the state of the next sample.
 * A sample is invalid if an input is NaN or infinite, or if the inputs in sum, and the next states that they give, are
 * beyond 1e+150: the outputs then hold the last estimates, fault is 1, and the state is predicted with the held
 * velocity. If the inputs are valid but the state is not, or its mode is not BELT_AXIS_RUNNING,
 * the estimates are held too, fault is 1, and the state is set from this sample.
 * Set the outputs to zero before the first step, and pass the same ones to each: the held estimates are read from them.
 */
void belt_axis_step(belt_axis_state *state, const belt_axis_parameters *parameters,
    const belt_axis_inputs *inputs, belt_axis_outputs *outputs);

#ifdef __cplusplus
}
#endif

#endif
