/*
 * A complete program around two_mass_gto: build with
 *     cc -std=c99 -O2 example_main.c two_mass_gto.c -lm -o example
 * Reads one sample a line (x1, x2, w) and prints the estimates.
 */
#include "two_mass_gto.h"

#include <stdio.h>

int main(void)
{
    const two_mass_gto_parameters parameters = TWO_MASS_GTO_PARAMETERS;
    two_mass_gto_state state;
    two_mass_gto_inputs inputs;
    two_mass_gto_outputs outputs;
    int first = 1;

    while (scanf("%lf %lf %lf", &inputs.x1, &inputs.x2, &inputs.w) == 3) {
        if (first) {
            two_mass_gto_init(&state, &parameters, &inputs);
            first = 0;
        }
        two_mass_gto_step(&state, &parameters, &inputs, &outputs);
        printf("%.17g %.17g %.17g %.17g %.17g %.17g\n", outputs.v1_hat, outputs.v2_hat, outputs.tracked_x1, outputs.tracked_x2, outputs.F_hat_on_x1, outputs.F_hat_on_x2);
    }
    return 0;
}
