/*
 * The observer behind two calls on plain rows of reals, for Python to load: one state and one set of outputs, kept
 * between the calls.
 */
#include "fields.h"

#include <string.h>

void driver_start(const real *row);
void driver_run(long samples, const real *rows, real *outputs, real *states);

static observer_parameters parameters = OBSERVER_PARAMETERS;
static observer_state state;
static observer_outputs found;

void driver_start(const real *row)
{
    observer_inputs inputs;
    take_inputs(&inputs, row);
    observer_prepare(&parameters);
    memset(&found, 0, sizeof found);
    observer_init(&state, &parameters, &inputs);
}

void driver_run(long samples, const real *rows, real *outputs, real *states)
{
    for (long k = 0; k < samples; ++k) {
        observer_inputs inputs;
        take_inputs(&inputs, rows + k * INPUTS);
        observer_step(&state, &parameters, &inputs, &found);
        give_outputs(&found, outputs + k * OUTPUTS);
        give_state(&state, states + k * STATES);
    }
}
