/*
 * A complete program around one_mass: build with
 *     cc -std=c99 -O2 example_main.c one_mass.c -lm -o example
 * Reads one sample a line (x, w) and prints the estimates.
 */
#include "one_mass.h"

#include <stdio.h>

int main(void)
{
    const one_mass_parameters parameters = ONE_MASS_PARAMETERS;
    one_mass_state state;
    one_mass_inputs inputs;
    one_mass_outputs outputs;
    int first = 1;

    while (scanf("%lf %lf", &inputs.x, &inputs.w) == 2) {
        if (first) {
            one_mass_init(&state, &parameters, &inputs);
            first = 0;
        }
        one_mass_step(&state, &parameters, &inputs, &outputs);
        printf("%.17g %.17g %.17g %.17g\n", outputs.v_hat, outputs.a_hat_rail, outputs.F_hat_rail, outputs.F_hat_on_x);
    }
    return 0;
}
