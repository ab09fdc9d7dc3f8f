/*
 * A complete program around rig_dfob: build with
 *     cc -std=c99 -O2 example_main.c rig_dfob.c -lm -o example
 * Reads one sample a line (theta, w) and prints the estimates.
 */
#include "rig_dfob.h"

#include <stdio.h>

int main(void)
{
    const rig_dfob_parameters parameters = RIG_DFOB_PARAMETERS;
    rig_dfob_state state;
    rig_dfob_inputs inputs;
    rig_dfob_outputs outputs;
    int first = 1;

    while (scanf("%lf %lf", &inputs.theta, &inputs.w) == 2) {
        if (first) {
            rig_dfob_init(&state, &parameters, &inputs);
            first = 0;
        }
        rig_dfob_step(&state, &parameters, &inputs, &outputs);
        printf("%.17g %.17g %.17g %.17g %.17g\n", outputs.omega_hat, outputs.f_hat_plates, outputs.a_hat_plates, outputs.F_hat_plates, outputs.F_hat_on_theta);
    }
    return 0;
}
