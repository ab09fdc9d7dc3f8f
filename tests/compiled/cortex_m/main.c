/*
 * The observer over the rows of rows.h: an init, a step for each row, another init after every EPISODE rows. Prints the
 * bit patterns of the outputs, a line each step; nothing with QUIET, when instructions are counted.
 */
#include "fields.h"
#include "rows.h"
#include "semihosting.h"

#include <string.h>

int main(void);

#ifndef QUIET
static void print_row(const real *row)
{
    static char line[OUTPUTS * (2 * sizeof(real) + 1) + 1];
    char *at = line;

    for (int k = 0; k < OUTPUTS; ++k) {
        row_bits bits;
        memcpy(&bits, row + k, sizeof bits);
        for (int shift = 8 * (int)sizeof bits - 4; shift >= 0; shift -= 4) {
            *at++ = "0123456789abcdef"[(bits >> shift) & 15u];
        }
        *at++ = k + 1 < OUTPUTS ? ' ' : '\n';
    }
    *at = '\0';
    host_write(line);
}
#endif

int main(void)
{
    static observer_parameters parameters = OBSERVER_PARAMETERS;
    static observer_state state;
    static observer_outputs outputs;

    observer_prepare(&parameters);
    for (int k = 0; k < SAMPLES; ++k) {
        real row[INPUTS];
        observer_inputs inputs;
        memcpy(row, rows[k], sizeof row);
        take_inputs(&inputs, row);
        if (k % EPISODE == 0) {
            memset(&outputs, 0, sizeof outputs);
            observer_init(&state, &parameters, &inputs);
        }
        observer_step(&state, &parameters, &inputs, &outputs);
#ifndef QUIET
        real found[OUTPUTS];
        give_outputs(&outputs, found);
        print_row(found);
#endif
    }
    return 0;
}
