/*
 * chain: friction observer GCFO, velocity estimated, double precision.
 * Source: a train of masses; the thesis, A.1.1, with sixteen bodies in place of two.
 *
 * Made by stiction 0.1.0 from chain.yaml
 * sha256 b931a2bc6bd00bf64052ceced86f25ef4dcd72dd152d298eae1b835ca222581a
 * with: stiction generate chain.yaml
 *
 * C99, no heap, no statics, no globals, re-entrant. Division by a constant is a multiplication by its reciprocal, which
 * the parameters hold; the Python twin does the same. Compile with -std=c99 (or -ffp-contract=off) for results that are
 * bit-identical to the twin's. Do not edit: change the spec and generate again.
 */
#ifndef STICTION_CHAIN_H
#define STICTION_CHAIN_H

#ifdef __cplusplus
extern "C" {
#endif

/* Model constants and gains; CHAIN_PARAMETERS has the spec's values. */
typedef struct {
    double m; /* kg: model parameter */
    double k; /* N/m: model parameter */
    double c; /* N*s/m: model parameter */
    double ground_a[16]; /* N: ground1_a to ground16_a, model parameter */
    double K_F_ground[16]; /* N*s/m: K_F_ground1 to K_F_ground16, observer gain */
    double K_v_v[16]; /* 1/s: K_v_v1 to K_v_v16, observer gain */
    double sample_time; /* s: sample time */
    /* derived: chain_prepare computes them from those above */
    double one_over_D16; /* 1.0 / m */
    double h_K_F_ground[16]; /* sample_time * K_F_ground[0], ... */
} chain_parameters;

#define CHAIN_PARAMETERS \
    { \
        1.0, /* m */ \
        100.0, /* k */ \
        0.5, /* c */ \
        { \
            0.5, 0.5, 0.5, 0.5, 0.5, 0.5, 0.5, 0.5, 0.5, 0.5, 0.5, 0.5, 0.5, 0.5, 0.5, 0.5 \
        }, /* ground_a */ \
        { \
            20.0, 20.0, 20.0, 20.0, 20.0, 20.0, 20.0, 20.0, 20.0, 20.0, 20.0, 20.0, 20.0, 20.0, 20.0, 20.0 \
        }, /* K_F_ground */ \
        { \
            20.0, 20.0, 20.0, 20.0, 20.0, 20.0, 20.0, 20.0, 20.0, 20.0, 20.0, 20.0, 20.0, 20.0, 20.0, 20.0 \
        }, /* K_v_v */ \
        0.001, /* sample_time */ \
        1.0, /* one_over_D16 */ \
        { \
            0.02, 0.02, 0.02, 0.02, 0.02, 0.02, 0.02, 0.02, 0.02, 0.02, 0.02, 0.02, 0.02, 0.02, 0.02, 0.02 \
        } /* h_K_F_ground */ \
    }

/* Modes: what the next valid sample does. */
typedef enum {
    CHAIN_RUNNING, /* gives new estimates */
    CHAIN_HOLDING, /* after 8 invalid samples in a row: sets the state so that the estimates equal the held ones */
    CHAIN_STARTING /* no sample was valid so far: initialises the state */
} chain_mode;

/* State of the observer between two samples. */
typedef struct {
    double z_v[16]; /* m/s: z_v1 to z_v16, observer state */
    double z_ground[16]; /* N: z_ground1 to z_ground16, observer state */
    chain_mode mode;
    unsigned char invalid_samples; /* in a row; the count restarts after a valid one */
} chain_state;

/* Measurements and commands at a sample. */
typedef struct {
    double x[16]; /* m: x1 to x16, measured position */
    double w; /* N: input */
} chain_inputs;

/* Estimates at a sample. */
typedef struct {
    double v_hat[16]; /* m/s: v1_hat to v16_hat, velocity estimate, (4.25) */
    double a_hat_ground[16]; /* N: a_hat_ground1 to a_hat_ground16, friction level, (4.11) */
    double F_hat_ground[16]; /* N: F_hat_ground1 to F_hat_ground16, contact friction, (4.10) */
    double F_hat_on_x[16]; /* N: F_hat_on_x1 to F_hat_on_x16, friction force, (4.10) */
    int fault; /* 1 if this sample was not used, 0 otherwise */
} chain_outputs;

/* Compute the derived constants: call it after a parameter was changed; CHAIN_PARAMETERS includes them. */
void chain_prepare(chain_parameters *parameters);

/*
 * Initialise the state from the first measurement. If that is invalid, the state is zero and its mode is
 * CHAIN_STARTING: the step then sets fault to 1, and its first valid sample initialises the state.
 */
void chain_init(chain_state *state, const chain_parameters *parameters,
    const chain_inputs *inputs);

/*
 * One sample: estimates from the state and this measurement, then the state of the next sample.
 * A sample is invalid if an input is NaN or infinite, or if the inputs in sum, and the next states that they give, are
 * beyond 1e+150: the outputs then hold the last estimates, fault is 1, and the state is predicted with the held
 * velocity. If the inputs are valid but the state is not, or its mode is not CHAIN_RUNNING,
 * the estimates are held too, fault is 1, and the state is set from this sample.
 * Set the outputs to zero before the first step, and pass the same ones to each: the held estimates are read from them.
 */
void chain_step(chain_state *state, const chain_parameters *parameters,
    const chain_inputs *inputs, chain_outputs *outputs);

#ifdef __cplusplus
}
#endif

#endif
