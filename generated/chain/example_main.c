/*
 * A complete program around chain: build with
 *     cc -std=c99 -O2 example_main.c chain.c -lm -o example
 * Reads one sample a line and prints the estimates and the fault flag. A sample is
 * x[16], w.
 */
#include "chain.h"

#include <stdio.h>
#include <string.h>

static int read_sample(chain_inputs *inputs)
{
    int count = 0;

    for (int i = 0; i < 16; i++) {
        count += scanf("%lf", &inputs->x[i]);
    }
    count += scanf("%lf", &inputs->w);
    return count == 17;
}

int main(void)
{
    const chain_parameters parameters = CHAIN_PARAMETERS;
    chain_state state;
    chain_inputs inputs;
    chain_outputs outputs;
    unsigned long samples = 0;

    memset(&outputs, 0, sizeof outputs);
    while (read_sample(&inputs)) {
        if (samples++ == 0) {
            chain_init(&state, &parameters, &inputs);
        }
        chain_step(&state, &parameters, &inputs, &outputs);
        for (int i = 0; i < 16; i++) {
            printf("%.17g ", outputs.v_hat[i]);
        }
        for (int i = 0; i < 16; i++) {
            printf("%.17g ", outputs.a_hat_ground[i]);
        }
        for (int i = 0; i < 16; i++) {
            printf("%.17g ", outputs.F_hat_ground[i]);
        }
        for (int i = 0; i < 16; i++) {
            printf("%.17g ", outputs.F_hat_on_x[i]);
        }
        printf("%d\n", outputs.fault);
    }
    if (!feof(stdin)) { /* such as a header line */
        (void)fprintf(stderr, "sample %lu is not 17 numbers\n", samples + 1);
        return 1;
    }
    return 0;
}
