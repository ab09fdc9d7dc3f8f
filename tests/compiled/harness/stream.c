/*
 * Rows of reals on standard input, outputs on standard output. Every struct is a block of its own on the heap, so that
 * AddressSanitizer sees the first byte beside it; the first argument is how many samples there are between two inits.
 */
#include "fields.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

int main(int count, char **words)
{
    const long episode = count > 1 ? atol(words[1]) : 0;
    const observer_parameters values = OBSERVER_PARAMETERS;
    observer_parameters *parameters = malloc(sizeof *parameters);
    observer_state *state = malloc(sizeof *state);
    observer_inputs *inputs = malloc(sizeof *inputs);
    observer_outputs *outputs = malloc(sizeof *outputs);
    real row[INPUTS], found[OUTPUTS];

    *parameters = values;
    observer_prepare(parameters);
    for (long k = 0; fread(row, sizeof row, 1, stdin) == 1; ++k) {
        take_inputs(inputs, row);
        if (k == 0 || (episode > 0 && k % episode == 0)) {
            memset(outputs, 0, sizeof *outputs);
            observer_init(state, parameters, inputs);
        }
        observer_step(state, parameters, inputs, outputs);
        give_outputs(outputs, found);
        fwrite(found, sizeof found, 1, stdout);
    }
    free(parameters);
    free(state);
    free(inputs);
    free(outputs);
    return 0;
}
