/*
 * A complete program around one_mass: build with
 *     cc -std=c99 -O2 example_main.c one_mass.c -lm -o example
 * Reads one sample a line and prints the estimates and the fault flag. A sample is
 * x, w.
 */
#include "one_mass.h"

#include <stdio.h>
#include <string.h>

static int read_sample(one_mass_inputs *inputs)
{
    int count = 0;

    count += scanf("%lf", &inputs->x);
    count += scanf("%lf", &inputs->w);
    return count == 2;
}

int main(void)
{
    const one_mass_parameters parameters = ONE_MASS_PARAMETERS;
    one_mass_state state;
    one_mass_inputs inputs;
    one_mass_outputs outputs;
    unsigned long samples = 0;

    memset(&outputs, 0, sizeof outputs);
    while (read_sample(&inputs)) {
        if (samples++ == 0) {
            one_mass_init(&state, &parameters, &inputs);
        }
        one_mass_step(&state, &parameters, &inputs, &outputs);
        printf("%.17g ", outputs.v_hat);
        printf("%.17g ", outputs.a_hat_rail);
        printf("%.17g ", outputs.F_hat_rail);
        printf("%.17g ", outputs.F_hat_on_x);
        printf("%d\n", outputs.fault);
    }
    if (!feof(stdin)) { /* such as a header line */
        (void)fprintf(stderr, "sample %lu is not 2 numbers\n", samples + 1);
        return 1;
    }
    return 0;
}
