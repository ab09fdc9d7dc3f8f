/*
 * A complete program around two_mass_gdfo: build with
 *     cc -std=c99 -O2 example_main.c two_mass_gdfo.c -lm -o example
 * Reads one sample a line (x1, x2, w) and prints the estimates.
 */
#include "two_mass_gdfo.h"

#include <stdio.h>

int main(void)
{
    const two_mass_gdfo_parameters parameters = TWO_MASS_GDFO_PARAMETERS;
    two_mass_gdfo_state state;
    two_mass_gdfo_inputs inputs;
    two_mass_gdfo_outputs outputs;
    int first = 1;

    while (scanf("%lf %lf %lf", &inputs.x1, &inputs.x2, &inputs.w) == 3) {
        if (first) {
            two_mass_gdfo_init(&state, &parameters, &inputs);
            first = 0;
        }
        two_mass_gdfo_step(&state, &parameters, &inputs, &outputs);
        printf("%.17g %.17g %.17g %.17g %.17g %.17g %.17g %.17g %.17g %.17g\n", outputs.v1_hat, outputs.v2_hat, outputs.f_hat_between, outputs.f_hat_ground, outputs.a_hat_between, outputs.a_hat_ground, outputs.F_hat_between, outputs.F_hat_ground, outputs.F_hat_on_x1, outputs.F_hat_on_x2);
    }
    return 0;
}
