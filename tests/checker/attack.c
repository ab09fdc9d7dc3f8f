/*
 * Runs of a generated step beside a linear machine without a drive, disturbed as a table says. test_worst_runs.py
 * compiles it with the names of the generated code as macros. The generated structs begin with their doubles, and are
 * read and written as arrays of these.
 */
#include HEADER
#include <math.h>
#include <stdint.h>
#include <string.h>

enum { MOST = 64 };

typedef struct {
    long positions, frictions, states, errors, semi_implicit;
    const long *input_of;            /* which input is the measurement of a position */
    const long *estimate_of;         /* which output is the estimate of an error */
    const double *acceleration;      /* velocities by (positions, velocities, frictions times sign, 1) */
    const double *slip;              /* signed frictions by velocities; zeros for a force without a sign */
    double h;
} machine;

/* Disturbances of a sample: noise, moves, pushes, changes of friction, friction of this sample alone. */
static long width(const machine *m) { return 3 * m->positions + 2 * m->frictions; }

/*
 * errors: samples x errors, sign (truth - estimate). begun: positions, velocities, frictions, states.
 * Returns how many samples had a fault, or a slip whose estimate has another sign.
 */
long follow(const machine *m, const double *begun, long samples, const double *disturbed, double *errors)
{
    const PARAMETERS_TYPE parameters = PARAMETERS;
    const long n = m->positions, f = m->frictions;
    double x[MOST], v[MOST], force[MOST], now[MOST], sign[MOST], next[MOST];
    STATE state;
    INPUTS inputs;
    OUTPUTS outputs;
    long lost = 0;
    memset(&state, 0, sizeof state);
    memset(&inputs, 0, sizeof inputs);
    memset(&outputs, 0, sizeof outputs);
    memcpy(x, begun, sizeof(double) * n);
    memcpy(v, begun + n, sizeof(double) * n);
    memcpy(force, begun + 2 * n, sizeof(double) * f);
    memcpy(&state, begun + 2 * n + f, sizeof(double) * m->states);
    for (long k = 0; k < samples; k++) {
        const double *noise = disturbed + k * width(m), *move = noise + n, *push = move + n, *change = push + n;
        for (long i = 0; i < n; i++) ((double *)&inputs)[m->input_of[i]] = x[i] + noise[i];
        STEP(&state, &parameters, &inputs, &outputs);
        lost += outputs.fault != 0;
        for (long j = 0; j < f; j++) {
            double true_slip = 0.0, seen = 0.0, signed_at_all = 0.0;
            for (long i = 0; i < n; i++) {
                true_slip += m->slip[j * n + i] * v[i];
                seen += m->slip[j * n + i] * ((double *)&outputs)[m->estimate_of[i]];
                signed_at_all += fabs(m->slip[j * n + i]);
            }
            sign[j] = signed_at_all > 0.0 ? (true_slip > 0.0) - (true_slip < 0.0) : 1.0;
            lost += signed_at_all > 0.0 && !(true_slip * seen > 0.0);
            now[j] = force[j] + change[f + j];
        }
        for (long e = 0; e < m->errors; e++) {
            const double estimate = ((double *)&outputs)[m->estimate_of[e]];
            errors[k * m->errors + e] = e < n ? v[e] - estimate : sign[e - n] * (now[e - n] - estimate);
        }
        for (long i = 0; i < n; i++) {
            const double *row = m->acceleration + i * (2 * n + f + 1);
            double a = row[2 * n + f];
            for (long j = 0; j < n; j++) a += row[j] * x[j] + row[n + j] * v[j];
            for (long j = 0; j < f; j++) a += row[2 * n + j] * sign[j] * now[j];
            next[i] = v[i] + m->h * a + push[i];
        }
        for (long i = 0; i < n; i++) {
            x[i] += m->h * (m->semi_implicit ? next[i] : v[i]) + move[i];
            v[i] = next[i];
        }
        for (long j = 0; j < f; j++) force[j] += change[j];
    }
    return lost;
}

static uint64_t drawn(uint64_t *dice) /* xorshift64* */
{
    *dice ^= *dice >> 12;
    *dice ^= *dice << 25;
    *dice ^= *dice >> 27;
    return *dice * UINT64_C(2685821657736338717);
}

/*
 * Runs about the worst one, which `worst` is: all of it; its sign turned; ended early, so that it is aligned with an
 * earlier sample; and a share of its signs turned at random. found: the largest |row errors| of the runs over bound,
 * at a sample that is not before `from`.
 */
long attack(const machine *m, const double *begun, const double *begun_turned, long samples, const double *worst,
    const double *row, long from, double bound, long runs, uint64_t dice, double *disturbed, double *errors,
    double *found)
{
    const long all = width(m);
    long lost = 0;
    for (long run = 0; run < runs; run++) {
        const double side = run & 1 ? -1.0 : 1.0;
        const long early = run < 2 || from > 0 ? 0 : (long)(drawn(&dice) % (uint64_t)(samples / 4));
        const uint64_t turned = run < 2 ? 0 : UINT64_C(1) << (drawn(&dice) % 13); /* of 2^16 */
        for (long k = 0; k < samples * all; k += 4) {
            uint64_t bits = drawn(&dice);
            for (long j = k; j < k + 4 && j < samples * all; j++, bits >>= 16) {
                const long at = j + early * all;
                const double given = at < samples * all ? worst[at] : worst[j];
                const int kept = from > 0 && j < all; /* the first noise is in the error that is assumed */
                disturbed[j] = !kept && (bits & 65535) < turned ? -side * given : side * given;
            }
        }
        lost += follow(m, run & 1 ? begun_turned : begun, samples, disturbed, errors);
        for (long k = from; k < samples; k++) {
            double error = 0.0;
            for (long e = 0; e < m->errors; e++) error += row[e] * errors[k * m->errors + e];
            if (!(fabs(error) <= *found * bound)) *found = fabs(error) / bound;
        }
    }
    return lost;
}
