/*
 * two_link_arm: friction observer GCFO, velocity estimated, double precision.
 * Source: Mentzelopoulou 1994, section 4.8.
 *
 * Made by stiction 0.1.0 from two_link_arm.yaml
 * sha256 b6da30848bfb88be36fdd088967c28eb76bff5115c2e0e2e130e666fe4a04476
 * with: stiction generate two_link_arm.yaml
 *
 * C99, no heap, no statics, no globals, re-entrant. Division by a constant is a multiplication by its reciprocal, which
 * the parameters hold; the Python twin does the same. Compile with -std=c99 (or -ffp-contract=off) for results that are
 * bit-identical to the twin's. Do not edit: change the spec and generate again.
 */
#ifndef STICTION_TWO_LINK_ARM_H
#define STICTION_TWO_LINK_ARM_H

#ifdef __cplusplus
extern "C" {
#endif

/* Model constants and gains; TWO_LINK_ARM_PARAMETERS has the spec's values. */
typedef struct {
    double m1; /* kg: model parameter */
    double m2; /* kg: model parameter */
    double l1; /* m: model parameter */
    double b1; /* m: model parameter */
    double b2; /* m: model parameter */
    double I1; /* kg*m^2: model parameter */
    double I2; /* kg*m^2: model parameter */
    double gravity; /* m/s^2: model parameter */
    double shoulder_a; /* N*m: model parameter */
    double elbow_a; /* N*m: model parameter */
    double K_F_shoulder_shoulder; /* N*m*s/rad: observer gain */
    double K_F_elbow_shoulder; /* N*m*s/rad: observer gain */
    double K_F_elbow_elbow; /* N*m*s/rad: observer gain */
    double K_v_omega1_omega1; /* 1/s: observer gain */
    double K_v_omega1_omega2; /* 1/s: observer gain */
    double K_v_omega2_omega1; /* 1/s: observer gain */
    double K_v_omega2_omega2; /* 1/s: observer gain */
    double sample_time; /* s: sample time */
    /* derived: two_link_arm_prepare computes them from those above */
    double constant_1; /* I1 + I2 + m1 * b1 * b1 + m2 * b2 * b2 + m2 * l1 * l1 */
    double twice_m2_l1_b2; /* 2.0 * m2 * l1 * b2 */
    double I2_plus_m2_b2_squared; /* I2 + m2 * b2 * b2 */
    double m2_l1_b2; /* m2 * l1 * b2 */
    double m2_b2_gravity; /* m2 * b2 * gravity */
    double m1_b1_gravity_plus_m2_l1_gravity; /* m1 * b1 * gravity + m2 * l1 * gravity */
    double h_K_F_shoulder_shoulder; /* sample_time * K_F_shoulder_shoulder */
    double h_K_F_elbow_elbow; /* sample_time * K_F_elbow_elbow */
    double h_K_F_elbow_shoulder; /* sample_time * K_F_elbow_shoulder */
} two_link_arm_parameters;

#define TWO_LINK_ARM_PARAMETERS \
    { \
        0.7718, /* m1 */ \
        0.2713, /* m2 */ \
        0.205, /* l1 */ \
        0.04, /* b1 */ \
        0.065, /* b2 */ \
        0.00863, /* I1 */ \
        0.00132, /* I2 */ \
        9.8, /* gravity */ \
        0.001, /* shoulder_a */ \
        0.005, /* elbow_a */ \
        0.01, /* K_F_shoulder_shoulder */ \
        0.01, /* K_F_elbow_shoulder */ \
        0.005, /* K_F_elbow_elbow */ \
        1.0, /* K_v_omega1_omega1 */ \
        0.5, /* K_v_omega1_omega2 */ \
        1.0, /* K_v_omega2_omega1 */ \
        10.0, /* K_v_omega2_omega2 */ \
        0.001, /* sample_time */ \
        0.023732505, /* constant_1 */ \
        0.0072301449999999995, /* twice_m2_l1_b2 */ \
        0.0024662425, /* I2_plus_m2_b2_squared */ \
        0.0036150724999999997, /* m2_l1_b2 */ \
        0.17281810000000003, /* m2_b2_gravity */ \
        0.8475873, /* m1_b1_gravity_plus_m2_l1_gravity */ \
        1e-05, /* h_K_F_shoulder_shoulder */ \
        5e-06, /* h_K_F_elbow_elbow */ \
        1e-05 /* h_K_F_elbow_shoulder */ \
    }

/* Modes: what the next valid sample does. */
typedef enum {
    TWO_LINK_ARM_RUNNING, /* gives new estimates */
    TWO_LINK_ARM_HOLDING, /* after 8 invalid samples in a row: sets the state so that the estimates equal the held ones */
    TWO_LINK_ARM_STARTING /* no sample was valid so far: initialises the state */
} two_link_arm_mode;

/* State of the observer between two samples. */
typedef struct {
    double z_omega1; /* rad/s: observer state */
    double z_omega2; /* rad/s: observer state */
    double z_shoulder; /* N*m: observer state */
    double z_elbow; /* N*m: observer state */
    two_link_arm_mode mode;
    unsigned char invalid_samples; /* in a row; the count restarts after a valid one */
} two_link_arm_state;

/* Measurements and commands at a sample. */
typedef struct {
    double theta1; /* rad: measured position */
    double theta2; /* rad: measured position */
    double w1; /* N*m: input */
    double w2; /* N*m: input */
} two_link_arm_inputs;

/* Estimates at a sample. */
typedef struct {
    double omega1_hat; /* rad/s: velocity estimate, (4.25) */
    double omega2_hat; /* rad/s: velocity estimate, (4.25) */
    double a_hat_shoulder; /* N*m: friction level, (4.11) */
    double a_hat_elbow; /* N*m: friction level, (4.11) */
    double F_hat_shoulder; /* N*m: contact friction, (4.10) */
    double F_hat_elbow; /* N*m: contact friction, (4.10) */
    double F_hat_on_theta1; /* N*m: friction force, (4.10) */
    double F_hat_on_theta2; /* N*m: friction force, (4.10) */
    int fault; /* 1 if this sample was not used, 0 otherwise */
} two_link_arm_outputs;

/* Compute the derived constants: call it after a parameter was changed; TWO_LINK_ARM_PARAMETERS includes them. */
void two_link_arm_prepare(two_link_arm_parameters *parameters);

/*
 * Initialise the state from the first measurement. If that is invalid, the state is zero and its mode is
 * TWO_LINK_ARM_STARTING: the step then sets fault to 1, and its first valid sample initialises the state.
 */
void two_link_arm_init(two_link_arm_state *state, const two_link_arm_parameters *parameters,
    const two_link_arm_inputs *inputs);

/*
 * One sample: estimates from the state and this measurement, then the state of the next sample.
 * A sample is invalid if an input is NaN or infinite, or if the inputs in sum, and the next states that they give, are
 * beyond 1e+150: the outputs then hold the last estimates, fault is 1, and the state is predicted with the held
 * velocity. If the inputs are valid but the state is not, or its mode is not TWO_LINK_ARM_RUNNING,
 * the estimates are held too, fault is 1, and the state is set from this sample.
 * Set the outputs to zero before the first step, and pass the same ones to each: the held estimates are read from them.
 */
void two_link_arm_step(two_link_arm_state *state, const two_link_arm_parameters *parameters,
    const two_link_arm_inputs *inputs, two_link_arm_outputs *outputs);

#ifdef __cplusplus
}
#endif

#endif
