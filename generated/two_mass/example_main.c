/*
 * A complete program around two_mass: build with
 *     cc -std=c99 -O2 example_main.c two_mass.c -lm -o example
 * Reads one sample a line (x1, x2, w) and prints the estimates.
 */
#include "two_mass.h"

#include <stdio.h>

int main(void)
{
    const two_mass_parameters parameters = TWO_MASS_PARAMETERS;
    two_mass_state state;
    two_mass_inputs inputs;
    two_mass_outputs outputs;
    int first = 1;

    while (scanf("%lf %lf %lf", &inputs.x1, &inputs.x2, &inputs.w) == 3) {
        if (first) {
            two_mass_init(&state, &parameters, &inputs);
            first = 0;
        }
        two_mass_step(&state, &parameters, &inputs, &outputs);
        printf("%.17g %.17g %.17g %.17g %.17g %.17g %.17g %.17g\n", outputs.v1_hat, outputs.v2_hat, outputs.a_hat_between, outputs.a_hat_ground, outputs.F_hat_between, outputs.F_hat_ground, outputs.F_hat_on_x1, outputs.F_hat_on_x2);
    }
    return 0;
}
