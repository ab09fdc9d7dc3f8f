/*
 * A complete program around rig_to: build with
 *     cc -std=c99 -O2 example_main.c rig_to.c -lm -o example
 * Reads one sample a line (theta, w) and prints the estimates.
 */
#include "rig_to.h"

#include <stdio.h>

int main(void)
{
    const rig_to_parameters parameters = RIG_TO_PARAMETERS;
    rig_to_state state;
    rig_to_inputs inputs;
    rig_to_outputs outputs;
    int first = 1;

    while (scanf("%lf %lf", &inputs.theta, &inputs.w) == 2) {
        if (first) {
            rig_to_init(&state, &parameters, &inputs);
            first = 0;
        }
        rig_to_step(&state, &parameters, &inputs, &outputs);
        printf("%.17g %.17g %.17g\n", outputs.omega_hat, outputs.tracked_theta, outputs.F_hat_on_theta);
    }
    return 0;
}
