/*
 * A complete program around two_link_arm: build with
 *     cc -std=c99 -O2 example_main.c two_link_arm.c -lm -o example
 * Reads one sample a line and prints the estimates and the fault flag. A sample is
 * theta1, theta2, w1, w2.
 */
#include "two_link_arm.h"

#include <stdio.h>
#include <string.h>

static int read_sample(two_link_arm_inputs *inputs)
{
    int count = 0;

    count += scanf("%lf", &inputs->theta1);
    count += scanf("%lf", &inputs->theta2);
    count += scanf("%lf", &inputs->w1);
    count += scanf("%lf", &inputs->w2);
    return count == 4;
}

int main(void)
{
    const two_link_arm_parameters parameters = TWO_LINK_ARM_PARAMETERS;
    two_link_arm_state state;
    two_link_arm_inputs inputs;
    two_link_arm_outputs outputs;
    unsigned long samples = 0;

    memset(&outputs, 0, sizeof outputs);
    while (read_sample(&inputs)) {
        if (samples++ == 0) {
            two_link_arm_init(&state, &parameters, &inputs);
        }
        two_link_arm_step(&state, &parameters, &inputs, &outputs);
        printf("%.17g ", outputs.omega1_hat);
        printf("%.17g ", outputs.omega2_hat);
        printf("%.17g ", outputs.a_hat_shoulder);
        printf("%.17g ", outputs.a_hat_elbow);
        printf("%.17g ", outputs.F_hat_shoulder);
        printf("%.17g ", outputs.F_hat_elbow);
        printf("%.17g ", outputs.F_hat_on_theta1);
        printf("%.17g ", outputs.F_hat_on_theta2);
        printf("%d\n", outputs.fault);
    }
    if (!feof(stdin)) { /* such as a header line */
        (void)fprintf(stderr, "sample %lu is not 4 numbers\n", samples + 1);
        return 1;
    }
    return 0;
}
