/* Times one observer step of the generated C and of CasADi's own C for the same function, in turn, in one process.
 * NAME, STATES, PARAMETERS, INPUTS, OUTPUTS, WORK come from the command line; the structs are arrays of double. */
#define _POSIX_C_SOURCE 199309L
#include <stdio.h>
#include <string.h>
#include <time.h>

#define JOIN_(a, b) a##b
#define JOIN(a, b) JOIN_(a, b)

void JOIN(NAME, _step)(double *state, const double *parameters, const double *inputs, double *outputs);
int casadi_step(const double **arg, double **res, long long *iw, double *w, int mem);

static double now(void)
{
    struct timespec t;
    clock_gettime(CLOCK_MONOTONIC, &t);
    return (double)t.tv_sec + 1e-9 * (double)t.tv_nsec;
}

int main(void)
{
    enum { COUNT = 1000000, ROUNDS = 9 };
    const double parameters[PARAMETERS] = {VALUES};
    double best[2] = {1e9, 1e9}, sink = 0.0;
    for (int round = 0; round < ROUNDS; round++) {
        for (int peer = 0; peer < 2; peer++) {
            double state[STATES] = {0}, next[STATES], inputs[INPUTS] = {0}, outputs[OUTPUTS], w[WORK + 1];
            const double *arg[3] = {state, parameters, inputs};
            double *res[2] = {next, outputs};
            double start = now();
            for (int k = 0; k < COUNT; k++) {
                inputs[0] = 1e-3 * (double)(k % 1000);
                if (peer) {
                    casadi_step(arg, res, 0, w, 0);
                    memcpy(state, next, sizeof state);
                } else {
                    JOIN(NAME, _step)(state, parameters, inputs, outputs);
                }
            }
            double spent = (now() - start) / COUNT;
            sink += outputs[0];
            if (spent < best[peer]) best[peer] = spent;
        }
    }
    printf("%.2f %.2f %g\n", 1e9 * best[0], 1e9 * best[1], sink);
    return 0;
}
