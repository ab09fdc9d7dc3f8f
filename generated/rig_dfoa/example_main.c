/*
 * A complete program around rig_dfoa: build with
 *     cc -std=c99 -O2 example_main.c rig_dfoa.c -lm -o example
 * Reads one sample a line (theta, w) and prints the estimates.
 */
#include "rig_dfoa.h"

#include <stdio.h>

int main(void)
{
    const rig_dfoa_parameters parameters = RIG_DFOA_PARAMETERS;
    rig_dfoa_state state;
    rig_dfoa_inputs inputs;
    rig_dfoa_outputs outputs;
    int first = 1;

    while (scanf("%lf %lf", &inputs.theta, &inputs.w) == 2) {
        if (first) {
            rig_dfoa_init(&state, &parameters, &inputs);
            first = 0;
        }
        rig_dfoa_step(&state, &parameters, &inputs, &outputs);
        printf("%.17g %.17g %.17g %.17g %.17g\n", outputs.omega_hat, outputs.f_hat_plates, outputs.a_hat_plates, outputs.F_hat_plates, outputs.F_hat_on_theta);
    }
    return 0;
}
