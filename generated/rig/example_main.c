/*
 * A complete program around rig: build with
 *     cc -std=c99 -O2 example_main.c rig.c -lm -o example
 * Reads one sample a line (theta, w) and prints the estimates.
 */
#include "rig.h"

#include <stdio.h>

int main(void)
{
    const rig_parameters parameters = RIG_PARAMETERS;
    rig_state state;
    rig_inputs inputs;
    rig_outputs outputs;
    int first = 1;

    while (scanf("%lf %lf", &inputs.theta, &inputs.w) == 2) {
        if (first) {
            rig_init(&state, &parameters, &inputs);
            first = 0;
        }
        rig_step(&state, &parameters, &inputs, &outputs);
        printf("%.17g %.17g %.17g %.17g\n", outputs.omega_hat, outputs.a_hat_plates, outputs.F_hat_plates, outputs.F_hat_on_theta);
    }
    return 0;
}
