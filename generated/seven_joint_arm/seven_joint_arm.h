/*
 * seven_joint_arm: friction observer GTO, velocity estimated, double precision.
 * Source: a robot description of our own, seven_joint_arm.urdf; observer of Mentzelopoulou 1994, section 4.6.
 *
 * Made by stiction 0.1.0 from seven_joint_arm.yaml
 * sha256 9fdf4378f6fb9e1b1c4b537e8ffc93bd7914598df7afed94c8c086353543ed8a
 * with: stiction generate seven_joint_arm.yaml
 *
 * C99, no heap, no statics, no globals, re-entrant. Division by a constant is a multiplication by its reciprocal, which
 * the parameters hold; the Python twin does the same. Compile with -std=c99 (or -ffp-contract=off) for results that are
 * bit-identical to the twin's. Do not edit: change the spec and generate again.
 */
#ifndef STICTION_SEVEN_JOINT_ARM_H
#define STICTION_SEVEN_JOINT_ARM_H

#ifdef __cplusplus
extern "C" {
#endif

/* Model constants and gains; SEVEN_JOINT_ARM_PARAMETERS has the spec's values. */
typedef struct {
    double viscous_shoulder_yaw_b; /* N*m*s/rad: model parameter */
    double viscous_shoulder_pitch_b; /* N*m*s/rad: model parameter */
    double viscous_arm_roll_b; /* N*m*s/rad: model parameter */
    double viscous_elbow_pitch_b; /* N*m*s/rad: model parameter */
    double viscous_forearm_roll_b; /* N*m*s/rad: model parameter */
    double viscous_wrist_pitch_b; /* N*m*s/rad: model parameter */
    double viscous_hand_roll_b; /* N*m*s/rad: model parameter */
    double K_2_shoulder_yaw; /* N*m*s/rad: observer gain */
    double K_2_shoulder_pitch; /* N*m*s/rad: observer gain */
    double K_2_arm_roll; /* N*m*s/rad: observer gain */
    double K_2_elbow_pitch; /* N*m*s/rad: observer gain */
    double K_2_forearm_roll; /* N*m*s/rad: observer gain */
    double K_2_wrist_pitch; /* N*m*s/rad: observer gain */
    double K_2_hand_roll; /* N*m*s/rad: observer gain */
    double K_v_v_shoulder_yaw; /* 1/s: observer gain */
    double K_v_v_shoulder_pitch; /* 1/s: observer gain */
    double K_v_v_arm_roll; /* 1/s: observer gain */
    double K_v_v_elbow_pitch; /* 1/s: observer gain */
    double K_v_v_forearm_roll; /* 1/s: observer gain */
    double K_v_v_wrist_pitch; /* 1/s: observer gain */
    double K_v_v_hand_roll; /* 1/s: observer gain */
    double sample_time; /* s: sample time */
    /* derived: seven_joint_arm_prepare computes them from those above */
    double h_K_2_shoulder_yaw; /* sample_time * K_2_shoulder_yaw */
    double h_K_2_shoulder_pitch; /* sample_time * K_2_shoulder_pitch */
    double h_K_2_arm_roll; /* sample_time * K_2_arm_roll */
    double h_K_2_elbow_pitch; /* sample_time * K_2_elbow_pitch */
    double h_K_2_forearm_roll; /* sample_time * K_2_forearm_roll */
    double h_K_2_wrist_pitch; /* sample_time * K_2_wrist_pitch */
    double h_K_2_hand_roll; /* sample_time * K_2_hand_roll */
} seven_joint_arm_parameters;

#define SEVEN_JOINT_ARM_PARAMETERS \
    { \
        0.9, /* viscous_shoulder_yaw_b */ \
        0.9, /* viscous_shoulder_pitch_b */ \
        0.6, /* viscous_arm_roll_b */ \
        0.5, /* viscous_elbow_pitch_b */ \
        0.3, /* viscous_forearm_roll_b */ \
        0.2, /* viscous_wrist_pitch_b */ \
        0.1, /* viscous_hand_roll_b */ \
        -25.0, /* K_2_shoulder_yaw */ \
        -40.0, /* K_2_shoulder_pitch */ \
        -8.0, /* K_2_arm_roll */ \
        -30.0, /* K_2_elbow_pitch */ \
        -1.5, /* K_2_forearm_roll */ \
        -12.0, /* K_2_wrist_pitch */ \
        -0.35, /* K_2_hand_roll */ \
        300.0, /* K_v_v_shoulder_yaw */ \
        300.0, /* K_v_v_shoulder_pitch */ \
        300.0, /* K_v_v_arm_roll */ \
        300.0, /* K_v_v_elbow_pitch */ \
        300.0, /* K_v_v_forearm_roll */ \
        300.0, /* K_v_v_wrist_pitch */ \
        300.0, /* K_v_v_hand_roll */ \
        0.0005, /* sample_time */ \
        -0.0125, /* h_K_2_shoulder_yaw */ \
        -0.02, /* h_K_2_shoulder_pitch */ \
        -0.004, /* h_K_2_arm_roll */ \
        -0.015, /* h_K_2_elbow_pitch */ \
        -0.00075, /* h_K_2_forearm_roll */ \
        -0.006, /* h_K_2_wrist_pitch */ \
        -0.000175 /* h_K_2_hand_roll */ \
    }

/* Modes: what the next valid sample does. */
typedef enum {
    SEVEN_JOINT_ARM_RUNNING, /* gives new estimates */
    SEVEN_JOINT_ARM_HOLDING, /* after 8 invalid samples in a row: sets the state so that the estimates equal the held ones */
    SEVEN_JOINT_ARM_STARTING /* no sample was valid so far: initialises the state */
} seven_joint_arm_mode;

/* State of the observer between two samples. */
typedef struct {
    double z_v_shoulder_yaw; /* rad/s: observer state */
    double z_v_shoulder_pitch; /* rad/s: observer state */
    double z_v_arm_roll; /* rad/s: observer state */
    double z_v_elbow_pitch; /* rad/s: observer state */
    double z_v_forearm_roll; /* rad/s: observer state */
    double z_v_wrist_pitch; /* rad/s: observer state */
    double z_v_hand_roll; /* rad/s: observer state */
    double z_shoulder_yaw; /* N*m: observer state */
    double z_shoulder_pitch; /* N*m: observer state */
    double z_arm_roll; /* N*m: observer state */
    double z_elbow_pitch; /* N*m: observer state */
    double z_forearm_roll; /* N*m: observer state */
    double z_wrist_pitch; /* N*m: observer state */
    double z_hand_roll; /* N*m: observer state */
    seven_joint_arm_mode mode;
    unsigned char invalid_samples; /* in a row; the count restarts after a valid one */
} seven_joint_arm_state;

/* Measurements and commands at a sample. */
typedef struct {
    double shoulder_yaw; /* rad: measured position */
    double shoulder_pitch; /* rad: measured position */
    double arm_roll; /* rad: measured position */
    double elbow_pitch; /* rad: measured position */
    double forearm_roll; /* rad: measured position */
    double wrist_pitch; /* rad: measured position */
    double hand_roll; /* rad: measured position */
    double w_shoulder_yaw; /* N*m: input */
    double w_shoulder_pitch; /* N*m: input */
    double w_arm_roll; /* N*m: input */
    double w_elbow_pitch; /* N*m: input */
    double w_forearm_roll; /* N*m: input */
    double w_wrist_pitch; /* N*m: input */
    double w_hand_roll; /* N*m: input */
} seven_joint_arm_inputs;

/* Estimates at a sample. */
typedef struct {
    double v_shoulder_yaw_hat; /* rad/s: velocity estimate, (4.25) */
    double v_shoulder_pitch_hat; /* rad/s: velocity estimate, (4.25) */
    double v_arm_roll_hat; /* rad/s: velocity estimate, (4.25) */
    double v_elbow_pitch_hat; /* rad/s: velocity estimate, (4.25) */
    double v_forearm_roll_hat; /* rad/s: velocity estimate, (4.25) */
    double v_wrist_pitch_hat; /* rad/s: velocity estimate, (4.25) */
    double v_hand_roll_hat; /* rad/s: velocity estimate, (4.25) */
    double tracked_shoulder_yaw; /* N*m: tracked friction, (4.16) */
    double tracked_shoulder_pitch; /* N*m: tracked friction, (4.16) */
    double tracked_arm_roll; /* N*m: tracked friction, (4.16) */
    double tracked_elbow_pitch; /* N*m: tracked friction, (4.16) */
    double tracked_forearm_roll; /* N*m: tracked friction, (4.16) */
    double tracked_wrist_pitch; /* N*m: tracked friction, (4.16) */
    double tracked_hand_roll; /* N*m: tracked friction, (4.16) */
    double F_hat_on_shoulder_yaw; /* N*m: friction force, (4.16) */
    double F_hat_on_shoulder_pitch; /* N*m: friction force, (4.16) */
    double F_hat_on_arm_roll; /* N*m: friction force, (4.16) */
    double F_hat_on_elbow_pitch; /* N*m: friction force, (4.16) */
    double F_hat_on_forearm_roll; /* N*m: friction force, (4.16) */
    double F_hat_on_wrist_pitch; /* N*m: friction force, (4.16) */
    double F_hat_on_hand_roll; /* N*m: friction force, (4.16) */
    int fault; /* 1 if this sample was not used, 0 otherwise */
} seven_joint_arm_outputs;

/* Compute the derived constants: call it after a parameter was changed; SEVEN_JOINT_ARM_PARAMETERS includes them. */
void seven_joint_arm_prepare(seven_joint_arm_parameters *parameters);

/*
 * Initialise the state from the first measurement. If that is invalid, the state is zero and its mode is
 * SEVEN_JOINT_ARM_STARTING: the step then sets fault to 1, and its first valid sample initialises the state.
 */
void seven_joint_arm_init(seven_joint_arm_state *state, const seven_joint_arm_parameters *parameters,
    const seven_joint_arm_inputs *inputs);

/*
 * One sample: estimates from the state and this measurement, then the state of the next sample.
 * A sample is invalid if an input is NaN or infinite, or if the inputs in sum, and the next states that they give, are
 * beyond 1e+150: the outputs then hold the last estimates, fault is 1, and the state is predicted with the held
 * velocity. If the inputs are valid but the state is not, or its mode is not SEVEN_JOINT_ARM_RUNNING,
 * the estimates are held too, fault is 1, and the state is set from this sample.
 * Set the outputs to zero before the first step, and pass the same ones to each: the held estimates are read from them.
 */
void seven_joint_arm_step(seven_joint_arm_state *state, const seven_joint_arm_parameters *parameters,
    const seven_joint_arm_inputs *inputs, seven_joint_arm_outputs *outputs);

#ifdef __cplusplus
}
#endif

#endif
