/*
 * A complete program around belt_axis: build with
 *     cc -std=c99 -O2 example_main.c belt_axis.c -lm -o example
 * Reads one sample a line and prints the estimates and the fault flag. A sample is
 * x, u.
 */
#include "belt_axis.h"

#include <stdio.h>
#include <string.h>

static int read_sample(belt_axis_inputs *inputs)
{
    int count = 0;

    count += scanf("%lf", &inputs->x);
    count += scanf("%lf", &inputs->u);
    return count == 2;
}

int main(void)
{
    const belt_axis_parameters parameters = BELT_AXIS_PARAMETERS;
    belt_axis_state state;
    belt_axis_inputs inputs;
    belt_axis_outputs outputs;
    unsigned long samples = 0;

    memset(&outputs, 0, sizeof outputs);
    while (read_sample(&inputs)) {
        if (samples++ == 0) {
            belt_axis_init(&state, &parameters, &inputs);
        }
        belt_axis_step(&state, &parameters, &inputs, &outputs);
        printf("%.17g ", outputs.v_hat);
        printf("%.17g ", outputs.a_hat_guide);
        printf("%.17g ", outputs.F_hat_guide);
        printf("%.17g ", outputs.F_hat_on_x);
        printf("%d\n", outputs.fault);
    }
    if (!feof(stdin)) { /* such as a header line */
        (void)fprintf(stderr, "sample %lu is not 2 numbers\n", samples + 1);
        return 1;
    }
    return 0;
}
