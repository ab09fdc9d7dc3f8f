/*
 * A complete program around rig: build with
 *     cc -std=c99 -O2 example_main.c rig.c -lm -o example
 * Reads one sample a line and prints the estimates and the fault flag. A sample is
 * theta, w.
 */
#include "rig.h"

#include <stdio.h>
#include <string.h>

static int read_sample(rig_inputs *inputs)
{
    int count = 0;

    count += scanf("%lf", &inputs->theta);
    count += scanf("%lf", &inputs->w);
    return count == 2;
}

int main(void)
{
    const rig_parameters parameters = RIG_PARAMETERS;
    rig_state state;
    rig_inputs inputs;
    rig_outputs outputs;
    unsigned long samples = 0;

    memset(&outputs, 0, sizeof outputs);
    while (read_sample(&inputs)) {
        if (samples++ == 0) {
            rig_init(&state, &parameters, &inputs);
        }
        rig_step(&state, &parameters, &inputs, &outputs);
        printf("%.17g ", outputs.omega_hat);
        printf("%.17g ", outputs.a_hat_plates);
        printf("%.17g ", outputs.F_hat_plates);
        printf("%.17g ", outputs.F_hat_on_theta);
        printf("%d\n", outputs.fault);
    }
    if (!feof(stdin)) { /* such as a header line */
        (void)fprintf(stderr, "sample %lu is not 2 numbers\n", samples + 1);
        return 1;
    }
    return 0;
}
