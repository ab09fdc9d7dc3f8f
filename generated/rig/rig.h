/*
 * rig: friction observer CFO, velocity estimated.
 * Source: Mentzelopoulou 1994, chapter 8; the signs of (8.4)-(8.5) as in (3.8)-(3.10).
 *
 * Made by stiction 0.1.0 from rig.yaml
 * sha256 7251f4f1b617cc2038090d9dbaa1075a2eab900ef9bf816326a579f8bfb3dcf1
 * with: stiction generate rig.yaml
 *
 * C99, no heap, no statics, no globals, re-entrant. Compile with -std=c99 (or -ffp-contract=off) to get the
 * bits of the Python twin. Do not edit: change the spec and generate again.
 */
#ifndef STICTION_RIG_H
#define STICTION_RIG_H

#ifdef __cplusplus
extern "C" {
#endif

/* Constants of the model and gains; RIG_PARAMETERS holds the spec's values. */
typedef struct {
    double J; /* kg*m^2: model parameter */
    double plates_a; /* N*m: model parameter */
    double K_F; /* N*m*s/rad: observer gain */
    double K_v; /* 1/s: observer gain */
    double sample_time; /* s: sample time */
} rig_parameters;

#define RIG_PARAMETERS \
    { \
        1.0, /* J */ \
        30.0, /* plates_a */ \
        10.0, /* K_F */ \
        50.0, /* K_v */ \
        0.01 /* sample_time */ \
    }

/* What the observer remembers from sample to sample. */
typedef struct {
    double z_omega; /* rad/s: observer state */
    double z_plates; /* N*m: observer state */
} rig_state;

/* What is measured and commanded at a sample. */
typedef struct {
    double theta; /* rad: measured position */
    double w; /* N*m: input */
} rig_inputs;

/* What is estimated. */
typedef struct {
    double omega_hat; /* rad/s: velocity estimate, (4.25) */
    double a_hat_plates; /* N*m: friction level, (4.11) */
    double F_hat_plates; /* N*m: contact friction, (4.10) */
    double F_hat_on_theta; /* N*m: friction force, (4.10) */
} rig_outputs;

/* Set the state from the first measurement. */
void rig_init(rig_state *state, const rig_parameters *parameters,
                             const rig_inputs *inputs);

/* One sample: estimates from the state and this measurement, then the state of the next sample. */
void rig_step(rig_state *state, const rig_parameters *parameters,
                             const rig_inputs *inputs, rig_outputs *outputs);

#ifdef __cplusplus
}
#endif

#endif
