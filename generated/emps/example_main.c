/*
 * A complete program around emps: build with
 *     cc -std=c99 -O2 example_main.c emps.c -lm -o example
 * Reads one sample a line (x, u) and prints the estimates.
 */
#include "emps.h"

#include <stdio.h>

int main(void)
{
    const emps_parameters parameters = EMPS_PARAMETERS;
    emps_state state;
    emps_inputs inputs;
    emps_outputs outputs;
    int first = 1;

    while (scanf("%lf %lf", &inputs.x, &inputs.u) == 2) {
        if (first) {
            emps_init(&state, &parameters, &inputs);
            first = 0;
        }
        emps_step(&state, &parameters, &inputs, &outputs);
        printf("%.17g %.17g %.17g %.17g\n", outputs.v_hat, outputs.a_hat_rail, outputs.F_hat_rail, outputs.F_hat_on_x);
    }
    return 0;
}
