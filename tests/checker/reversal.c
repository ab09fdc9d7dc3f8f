/*
 * Reversals of a machine of one position and one contact beside a generated step. Used with attack.c, whose `machine`
 * and disturbances these are; the drive is an input that the code is given too.
 */
typedef struct {
    long drive;                   /* which input it is */
    double per_drive;             /* acceleration by it */
    long signed_level;            /* whether the error of the friction is that of a level, times the sign of slip */
    double side;                  /* of the slip before the reversal */
    long braked, ended;           /* the drive brakes from the one sample on, the run ends before the other */
    double braking, speeding;     /* before and after zero slip */
    double fastest;               /* the drive speeds up to this slip */
    long exact;                   /* the position moves as the velocity does; else as the proof's machine, with drift */
} reversal;

enum { AGREE = 1, TURNED = 2, FORWARD = 4 };

/*
 * Friction has the sign of the true slip at every moment: if the slip passes zero within a sample, it turns there, and
 * the slip stays zero for the rest of the sample if the drive is too weak. errors: as in attack.c, of samples before
 * `ended`. seen: whether the slip has turned, whether the estimated slip has its sign, and whether that is above 0.
 */
static void reverse(const machine *m, const reversal *r, const double *begun, const double *disturbed,
    double *errors, int *seen)
{
    const PARAMETERS_TYPE parameters = PARAMETERS;
    const double *row = m->acceleration; /* position, velocity, friction times sign, 1 */
    double x = begun[0], v = begun[1], level = begun[2], side = r->side;
    STATE state;
    INPUTS inputs;
    OUTPUTS outputs;
    memset(&state, 0, sizeof state);
    memset(&inputs, 0, sizeof inputs);
    memset(&outputs, 0, sizeof outputs);
    memcpy(&state, begun + 3, sizeof(double) * m->states);
    for (long k = 0; k < r->ended; k++) {
        const double *noise = disturbed + k * width(m);
        const int turned = side != r->side;
        double wanted = k < r->braked ? 0.0 : turned ? -r->side * r->speeding : -r->side * r->braking;
        if (turned && fabs(v) > r->fastest) wanted = 0.0;
        const double free = row[0] * x + row[1] * v + row[3];
        const double driven = wanted - free - row[2] * side * level; /* the part of the drive */
        ((double *)&inputs)[m->input_of[0]] = x + noise[0];
        ((double *)&inputs)[r->drive] = driven / r->per_drive;
        STEP(&state, &parameters, &inputs, &outputs);
        const double v_hat = ((double *)&outputs)[m->estimate_of[0]], f_hat = ((double *)&outputs)[m->estimate_of[1]];
        seen[k] = (turned ? TURNED : 0) | (side * v_hat > 0.0 || !r->signed_level ? AGREE : 0)
            | (v_hat > 0.0 ? FORWARD : 0);
        errors[2 * k] = v - v_hat;
        errors[2 * k + 1] = r->signed_level ? side * (level - f_hat) : side * level - f_hat;
        double next = v + m->h * wanted + (r->exact ? 0.0 : noise[2]), moved = m->h * (v + next) / 2.0;
        if (side * next < 0.0) {
            const double left = wanted != 0.0 ? fmin(m->h, fmax(0.0, m->h + v / wanted)) : 0.0;
            const double after = driven + free - row[2] * side * level; /* with the friction turned */
            next = side * after < 0.0 ? left * after : 0.0;
            moved = ((m->h - left) * v + left * next) / 2.0;
            side = -side;
        }
        x += r->exact ? moved : m->h * (m->semi_implicit ? next : v) + noise[1];
        v = next;
    }
}

/* What a claim says of a reversal, and its bounds on the friction's error since so many samples after it. */
typedef struct {
    const double *before, *after;
    long samples, turns;          /* samples 0: after any number of samples with any number of turns */
    long bounds;
    const long *since;
    const double *bound;
} claimed;

/*
 * Runs about the worst one, as in attack.c. The first sample of a reversal is the last before any with slips of two
 * signs; since `settled` they have one. found: the largest error of each over `after`, of runs as the claim says at its
 * last sample, and of all runs at the settled one; the largest friction's error over a bound, of both alike; the most
 * samples between the first and the settled one, and the most turns of the estimated slip's sign in these.
 * Returns how many runs are as the claim says.
 */
long reversals(const machine *m, const reversal *r, const claimed *c, const double *begun, const double *worst,
    long runs, uint64_t dice, double *disturbed, double *errors, int *seen, double *found)
{
    long within = 0;
    const long all = width(m);
    for (long run = 0; run < runs; run++) {
        const uint64_t turned = run < 1 ? 0 : UINT64_C(1) << (drawn(&dice) % 13); /* of 2^16 */
        for (long k = 0; k < r->ended * all; k += 4) {
            uint64_t bits = drawn(&dice);
            for (long j = k; j < k + 4 && j < r->ended * all; j++, bits >>= 16)
                disturbed[j] = (bits & 65535) < turned ? -worst[j] : worst[j];
        }
        reverse(m, r, begun, disturbed, errors, seen);
        long first = 0, settled = r->ended, turns = 0;
        while (first + 1 < r->ended && (seen[first + 1] & AGREE) && !(seen[first + 1] & TURNED)) first++;
        while (settled > first + 1 && (seen[settled - 1] & AGREE)) settled--;
        if (settled >= r->ended - 20) continue;
        const long last = c->samples ? first + c->samples : settled;
        for (long k = first; k < settled || k < last; k++) turns += ((seen[k] ^ seen[k + 1]) & FORWARD) != 0;
        int as_claimed = settled <= last && (turns <= c->turns || !c->samples);
        found[6] = fmax(found[6], (double)(settled - first));
        found[7] = fmax(found[7], (double)turns);
        for (long e = 0; e < 2; e++) as_claimed &= fabs(errors[2 * first + e]) <= c->before[e];
        within += as_claimed;
        for (long e = 0; e < 2; e++) {
            if (as_claimed) found[e] = fmax(found[e], fabs(errors[2 * last + e]) / c->after[e]);
            found[2 + e] = fmax(found[2 + e], fabs(errors[2 * settled + e]) / c->after[e]);
        }
        for (long b = 0; b < c->bounds; b++)
            for (long k = settled + c->since[b]; k < r->ended; k++) {
                const double share = fabs(errors[2 * k + 1]) / c->bound[b];
                found[5] = fmax(found[5], share);
                if (as_claimed && k >= last + c->since[b]) found[4] = fmax(found[4], share);
            }
    }
    return within;
}

/* Runs the step from a state over rows of inputs. outputs: samples x errors, the estimates. Returns the faults. */
long observe(const machine *m, const double *states, long samples, long inputs, const double *rows, double *outputs)
{
    const PARAMETERS_TYPE parameters = PARAMETERS;
    STATE state;
    INPUTS given;
    OUTPUTS shown;
    long faults = 0;
    memset(&state, 0, sizeof state);
    memset(&given, 0, sizeof given);
    memset(&shown, 0, sizeof shown);
    memcpy(&state, states, sizeof(double) * m->states);
    for (long k = 0; k < samples; k++) {
        memcpy(&given, rows + k * inputs, sizeof(double) * inputs);
        STEP(&state, &parameters, &given, &shown);
        faults += shown.fault != 0;
        for (long e = 0; e < m->errors; e++) outputs[k * m->errors + e] = ((double *)&shown)[m->estimate_of[e]];
    }
    return faults;
}
