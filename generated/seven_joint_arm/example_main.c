/*
 * A complete program around seven_joint_arm: build with
 *     cc -std=c99 -O2 example_main.c seven_joint_arm.c -lm -o example
 * Reads one sample a line and prints the estimates and the fault flag. A sample is
 * shoulder_yaw, shoulder_pitch, arm_roll, elbow_pitch, forearm_roll, wrist_pitch, hand_roll,
 * w_shoulder_yaw, w_shoulder_pitch, w_arm_roll, w_elbow_pitch, w_forearm_roll, w_wrist_pitch,
 * w_hand_roll.
 */
#include "seven_joint_arm.h"

#include <stdio.h>
#include <string.h>

static int read_sample(seven_joint_arm_inputs *inputs)
{
    int count = 0;

    count += scanf("%lf", &inputs->shoulder_yaw);
    count += scanf("%lf", &inputs->shoulder_pitch);
    count += scanf("%lf", &inputs->arm_roll);
    count += scanf("%lf", &inputs->elbow_pitch);
    count += scanf("%lf", &inputs->forearm_roll);
    count += scanf("%lf", &inputs->wrist_pitch);
    count += scanf("%lf", &inputs->hand_roll);
    count += scanf("%lf", &inputs->w_shoulder_yaw);
    count += scanf("%lf", &inputs->w_shoulder_pitch);
    count += scanf("%lf", &inputs->w_arm_roll);
    count += scanf("%lf", &inputs->w_elbow_pitch);
    count += scanf("%lf", &inputs->w_forearm_roll);
    count += scanf("%lf", &inputs->w_wrist_pitch);
    count += scanf("%lf", &inputs->w_hand_roll);
    return count == 14;
}

int main(void)
{
    const seven_joint_arm_parameters parameters = SEVEN_JOINT_ARM_PARAMETERS;
    seven_joint_arm_state state;
    seven_joint_arm_inputs inputs;
    seven_joint_arm_outputs outputs;
    unsigned long samples = 0;

    memset(&outputs, 0, sizeof outputs);
    while (read_sample(&inputs)) {
        if (samples++ == 0) {
            seven_joint_arm_init(&state, &parameters, &inputs);
        }
        seven_joint_arm_step(&state, &parameters, &inputs, &outputs);
        printf("%.17g ", outputs.v_shoulder_yaw_hat);
        printf("%.17g ", outputs.v_shoulder_pitch_hat);
        printf("%.17g ", outputs.v_arm_roll_hat);
        printf("%.17g ", outputs.v_elbow_pitch_hat);
        printf("%.17g ", outputs.v_forearm_roll_hat);
        printf("%.17g ", outputs.v_wrist_pitch_hat);
        printf("%.17g ", outputs.v_hand_roll_hat);
        printf("%.17g ", outputs.tracked_shoulder_yaw);
        printf("%.17g ", outputs.tracked_shoulder_pitch);
        printf("%.17g ", outputs.tracked_arm_roll);
        printf("%.17g ", outputs.tracked_elbow_pitch);
        printf("%.17g ", outputs.tracked_forearm_roll);
        printf("%.17g ", outputs.tracked_wrist_pitch);
        printf("%.17g ", outputs.tracked_hand_roll);
        printf("%.17g ", outputs.F_hat_on_shoulder_yaw);
        printf("%.17g ", outputs.F_hat_on_shoulder_pitch);
        printf("%.17g ", outputs.F_hat_on_arm_roll);
        printf("%.17g ", outputs.F_hat_on_elbow_pitch);
        printf("%.17g ", outputs.F_hat_on_forearm_roll);
        printf("%.17g ", outputs.F_hat_on_wrist_pitch);
        printf("%.17g ", outputs.F_hat_on_hand_roll);
        printf("%d\n", outputs.fault);
    }
    if (!feof(stdin)) { /* such as a header line */
        (void)fprintf(stderr, "sample %lu is not 14 numbers\n", samples + 1);
        return 1;
    }
    return 0;
}
