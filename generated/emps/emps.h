/*
 * emps: friction observer GCFO, velocity estimated, double precision.
 * Source: Janot, Gautier and Brunot 2019, Data set and reference models of EMPS; symmetric model.
 *
 * Made by stiction 0.1.0 from emps.yaml
 * sha256 6af290046ff97bda38cdd6b999da2562985f0f24de93aee566995a6b17c119de
 * with: stiction generate emps.yaml
 *
 * C99, no heap, no statics, no globals, re-entrant. Division by a constant is a multiplication by its reciprocal, which
 * the parameters hold; the Python twin does the same. Compile with -std=c99 (or -ffp-contract=off) for results that are
 * bit-identical to the twin's. Do not edit: change the spec and generate again.
 */
#ifndef STICTION_EMPS_H
#define STICTION_EMPS_H

#ifdef __cplusplus
extern "C" {
#endif

/* Model constants and gains; EMPS_PARAMETERS has the spec's values. */
typedef struct {
    double M; /* kg: model parameter */
    double gtau; /* N/V: model parameter */
    double Fv; /* N*s/m: model parameter */
    double offset; /* N: model parameter */
    double rail_a; /* N: model parameter */
    double K_F; /* N*s/m: observer gain */
    double K_v; /* 1/s: observer gain */
    double sample_time; /* s: sample time */
    /* derived: emps_prepare computes them from those above */
    double one_over_M; /* 1.0 / M */
    double h_K_F; /* sample_time * K_F */
} emps_parameters;

#define EMPS_PARAMETERS \
    { \
        95.1089, /* M */ \
        35.1507, /* gtau */ \
        203.5034, /* Fv */ \
        -3.1648, /* offset */ \
        20.3935, /* rail_a */ \
        4000.0, /* K_F */ \
        150.0, /* K_v */ \
        0.001, /* sample_time */ \
        0.010514263123640373, /* one_over_M */ \
        4.0 /* h_K_F */ \
    }

/* Modes: what the next valid sample does. */
typedef enum {
    EMPS_RUNNING, /* gives new estimates */
    EMPS_HOLDING, /* after 8 invalid samples in a row: sets the state so that the estimates equal the held ones */
    EMPS_STARTING /* no sample was valid so far: initialises the state */
} emps_mode;

/* State of the observer between two samples. */
typedef struct {
    double z_v; /* m/s: observer state */
    double z_rail; /* N: observer state */
    emps_mode mode;
    unsigned char invalid_samples; /* in a row; the count restarts after a valid one */
} emps_state;

/* Measurements and commands at a sample. */
typedef struct {
    double x; /* m: measured position */
    double u; /* V: input */
} emps_inputs;

/* Estimates at a sample. */
typedef struct {
    double v_hat; /* m/s: velocity estimate, (4.25) */
    double a_hat_rail; /* N: friction level, (4.11) */
    double F_hat_rail; /* N: contact friction, (4.10) */
    double F_hat_on_x; /* N: friction force, (4.10) */
    int fault; /* 1 if this sample was not used, 0 otherwise */
} emps_outputs;

/* Compute the derived constants: call it after a parameter was changed; EMPS_PARAMETERS includes them. */
void emps_prepare(emps_parameters *parameters);

/*
 * Initialise the state from the first measurement. If that is invalid, the state is zero and its mode is
 * EMPS_STARTING: the step then sets fault to 1, and its first valid sample initialises the state.
 */
void emps_init(emps_state *state, const emps_parameters *parameters,
    const emps_inputs *inputs);

/*
 * One sample: estimates from the state and this measurement, then the state of the next sample.
 * A sample is invalid if an input is NaN or infinite, or if the inputs in sum, and the next states that they give, are
 * beyond 1e+150: the outputs then hold the last estimates, fault is 1, and the state is predicted with the held
 * velocity. If the inputs are valid but the state is not, or its mode is not EMPS_RUNNING,
 * the estimates are held too, fault is 1, and the state is set from this sample.
 * Set the outputs to zero before the first step, and pass the same ones to each: the held estimates are read from them.
 */
void emps_step(emps_state *state, const emps_parameters *parameters,
    const emps_inputs *inputs, emps_outputs *outputs);

#ifdef __cplusplus
}
#endif

#endif
