/*
 * A complete program around rig_to: build with
 *     cc -std=c99 -O2 example_main.c rig_to.c -lm -o example
 * Reads one sample a line and prints the estimates and the fault flag. A sample is
 * theta, w.
 */
#include "rig_to.h"

#include <stdio.h>
#include <string.h>

static int read_sample(rig_to_inputs *inputs)
{
    int count = 0;

    count += scanf("%lf", &inputs->theta);
    count += scanf("%lf", &inputs->w);
    return count == 2;
}

int main(void)
{
    const rig_to_parameters parameters = RIG_TO_PARAMETERS;
    rig_to_state state;
    rig_to_inputs inputs;
    rig_to_outputs outputs;
    unsigned long samples = 0;

    memset(&outputs, 0, sizeof outputs);
    while (read_sample(&inputs)) {
        if (samples++ == 0) {
            rig_to_init(&state, &parameters, &inputs);
        }
        rig_to_step(&state, &parameters, &inputs, &outputs);
        printf("%.17g ", outputs.omega_hat);
        printf("%.17g ", outputs.tracked_theta);
        printf("%.17g ", outputs.F_hat_on_theta);
        printf("%d\n", outputs.fault);
    }
    if (!feof(stdin)) { /* such as a header line */
        (void)fprintf(stderr, "sample %lu is not 2 numbers\n", samples + 1);
        return 1;
    }
    return 0;
}
