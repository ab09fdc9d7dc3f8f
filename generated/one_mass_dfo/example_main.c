/*
 * A complete program around one_mass_dfo: build with
 *     cc -std=c99 -O2 example_main.c one_mass_dfo.c -lm -o example
 * Reads one sample a line (x, w) and prints the estimates.
 */
#include "one_mass_dfo.h"

#include <stdio.h>

int main(void)
{
    const one_mass_dfo_parameters parameters = ONE_MASS_DFO_PARAMETERS;
    one_mass_dfo_state state;
    one_mass_dfo_inputs inputs;
    one_mass_dfo_outputs outputs;
    int first = 1;

    while (scanf("%lf %lf", &inputs.x, &inputs.w) == 2) {
        if (first) {
            one_mass_dfo_init(&state, &parameters, &inputs);
            first = 0;
        }
        one_mass_dfo_step(&state, &parameters, &inputs, &outputs);
        printf("%.17g %.17g %.17g %.17g %.17g\n", outputs.v_hat, outputs.f_hat_rail, outputs.a_hat_rail, outputs.F_hat_rail, outputs.F_hat_on_x);
    }
    return 0;
}
