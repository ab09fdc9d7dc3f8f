/*
 * A complete program around two_mass: build with
 *     cc -std=c99 -O2 example_main.c two_mass.c -lm -o example
 * Reads one sample a line and prints the estimates and the fault flag. A sample is
 * x1, x2, w.
 */
#include "two_mass.h"

#include <stdio.h>
#include <string.h>

static int read_sample(two_mass_inputs *inputs)
{
    int count = 0;

    count += scanf("%lf", &inputs->x1);
    count += scanf("%lf", &inputs->x2);
    count += scanf("%lf", &inputs->w);
    return count == 3;
}

int main(void)
{
    const two_mass_parameters parameters = TWO_MASS_PARAMETERS;
    two_mass_state state;
    two_mass_inputs inputs;
    two_mass_outputs outputs;
    unsigned long samples = 0;

    memset(&outputs, 0, sizeof outputs);
    while (read_sample(&inputs)) {
        if (samples++ == 0) {
            two_mass_init(&state, &parameters, &inputs);
        }
        two_mass_step(&state, &parameters, &inputs, &outputs);
        printf("%.17g ", outputs.v1_hat);
        printf("%.17g ", outputs.v2_hat);
        printf("%.17g ", outputs.a_hat_between);
        printf("%.17g ", outputs.a_hat_ground);
        printf("%.17g ", outputs.F_hat_between);
        printf("%.17g ", outputs.F_hat_ground);
        printf("%.17g ", outputs.F_hat_on_x1);
        printf("%.17g ", outputs.F_hat_on_x2);
        printf("%d\n", outputs.fault);
    }
    if (!feof(stdin)) { /* such as a header line */
        (void)fprintf(stderr, "sample %lu is not 3 numbers\n", samples + 1);
        return 1;
    }
    return 0;
}
