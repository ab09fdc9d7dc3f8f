/* As stream.c, for what is behind the driver's two calls: rows of reals on standard input, outputs on standard output. */
#include "fields.h"

#include <stdio.h>
#include <stdlib.h>

void driver_start(const real *row);
void driver_run(long samples, const real *rows, real *outputs, real *states);

int main(int count, char **words)
{
    const long episode = count > 1 ? atol(words[1]) : 0;
    real row[INPUTS], found[OUTPUTS], states[STATES];

    for (long k = 0; fread(row, sizeof row, 1, stdin) == 1; ++k) {
        if (k == 0 || (episode > 0 && k % episode == 0))
            driver_start(row);
        driver_run(1, row, found, states);
        fwrite(found, sizeof found, 1, stdout);
    }
    return 0;
}
