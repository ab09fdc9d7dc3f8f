/*
 * A complete program around belt_axis: build with
 *     cc -std=c99 -O2 example_main.c belt_axis.c -lm -o example
 * Reads one sample a line (x, u) and prints the estimates.
 */
#include "belt_axis.h"

#include <stdio.h>

int main(void)
{
    const belt_axis_parameters parameters = BELT_AXIS_PARAMETERS;
    belt_axis_state state;
    belt_axis_inputs inputs;
    belt_axis_outputs outputs;
    int first = 1;

    while (scanf("%lf %lf", &inputs.x, &inputs.u) == 2) {
        if (first) {
            belt_axis_init(&state, &parameters, &inputs);
            first = 0;
        }
        belt_axis_step(&state, &parameters, &inputs, &outputs);
        printf("%.17g %.17g %.17g %.17g\n", outputs.v_hat, outputs.a_hat_guide, outputs.F_hat_guide, outputs.F_hat_on_x);
    }
    return 0;
}
