/*
 * A complete program around seven_joint_arm: build with
 *     cc -std=c99 -O2 example_main.c seven_joint_arm.c -lm -o example
 * Reads one sample a line (shoulder_yaw, shoulder_pitch, arm_roll, elbow_pitch, forearm_roll, wrist_pitch, hand_roll, w_shoulder_yaw, w_shoulder_pitch, w_arm_roll, w_elbow_pitch, w_forearm_roll, w_wrist_pitch, w_hand_roll) and prints the estimates.
 */
#include "seven_joint_arm.h"

#include <stdio.h>

int main(void)
{
    const seven_joint_arm_parameters parameters = SEVEN_JOINT_ARM_PARAMETERS;
    seven_joint_arm_state state;
    seven_joint_arm_inputs inputs;
    seven_joint_arm_outputs outputs;
    int first = 1;

    while (scanf("%lf %lf %lf %lf %lf %lf %lf %lf %lf %lf %lf %lf %lf %lf", &inputs.shoulder_yaw, &inputs.shoulder_pitch, &inputs.arm_roll, &inputs.elbow_pitch, &inputs.forearm_roll, &inputs.wrist_pitch, &inputs.hand_roll, &inputs.w_shoulder_yaw, &inputs.w_shoulder_pitch, &inputs.w_arm_roll, &inputs.w_elbow_pitch, &inputs.w_forearm_roll, &inputs.w_wrist_pitch, &inputs.w_hand_roll) == 14) {
        if (first) {
            seven_joint_arm_init(&state, &parameters, &inputs);
            first = 0;
        }
        seven_joint_arm_step(&state, &parameters, &inputs, &outputs);
        printf("%.17g %.17g %.17g %.17g %.17g %.17g %.17g %.17g %.17g %.17g %.17g %.17g %.17g %.17g %.17g %.17g %.17g %.17g %.17g %.17g %.17g\n", outputs.v_shoulder_yaw_hat, outputs.v_shoulder_pitch_hat, outputs.v_arm_roll_hat, outputs.v_elbow_pitch_hat, outputs.v_forearm_roll_hat, outputs.v_wrist_pitch_hat, outputs.v_hand_roll_hat, outputs.tracked_shoulder_yaw, outputs.tracked_shoulder_pitch, outputs.tracked_arm_roll, outputs.tracked_elbow_pitch, outputs.tracked_forearm_roll, outputs.tracked_wrist_pitch, outputs.tracked_hand_roll, outputs.F_hat_on_shoulder_yaw, outputs.F_hat_on_shoulder_pitch, outputs.F_hat_on_arm_roll, outputs.F_hat_on_elbow_pitch, outputs.F_hat_on_forearm_roll, outputs.F_hat_on_wrist_pitch, outputs.F_hat_on_hand_roll);
    }
    return 0;
}
