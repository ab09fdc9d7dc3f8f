/*
 * A complete program around two_link_arm: build with
 *     cc -std=c99 -O2 example_main.c two_link_arm.c -lm -o example
 * Reads one sample a line (theta1, theta2, w1, w2) and prints the estimates.
 */
#include "two_link_arm.h"

#include <stdio.h>

int main(void)
{
    const two_link_arm_parameters parameters = TWO_LINK_ARM_PARAMETERS;
    two_link_arm_state state;
    two_link_arm_inputs inputs;
    two_link_arm_outputs outputs;
    int first = 1;

    while (scanf("%lf %lf %lf %lf", &inputs.theta1, &inputs.theta2, &inputs.w1, &inputs.w2) == 4) {
        if (first) {
            two_link_arm_init(&state, &parameters, &inputs);
            first = 0;
        }
        two_link_arm_step(&state, &parameters, &inputs, &outputs);
        printf("%.17g %.17g %.17g %.17g %.17g %.17g %.17g %.17g\n", outputs.omega1_hat, outputs.omega2_hat, outputs.a_hat_shoulder, outputs.a_hat_elbow, outputs.F_hat_shoulder, outputs.F_hat_elbow, outputs.F_hat_on_theta1, outputs.F_hat_on_theta2);
    }
    return 0;
}
