/* A chain of N masses on springs with friction to the ground, GCFO behind the velocity observer, by hand as loops. */
#ifndef HAND_CHAIN_H
#define HAND_CHAIN_H

typedef struct {
    double mass_reciprocal, spring, sample_time;
    double a[N], K_F[N], K_v[N];
} hand_chain_parameters;

#define HAND_CHAIN_PARAMETERS {1.0, 100.0, 0.001, {LEVELS}, {LEVEL_GAINS}, {VELOCITY_GAINS}}

typedef struct {
    double z_v[N], z[N];
} hand_chain_state;

typedef struct {
    double x[N], w;
} hand_chain_inputs;

typedef struct {
    double v[N], a[N], F[N], F_on[N];
    int fault;
} hand_chain_outputs;

void hand_chain_init(hand_chain_state *s, const hand_chain_parameters *p, const hand_chain_inputs *in);
void hand_chain_step(hand_chain_state *s, const hand_chain_parameters *p, const hand_chain_inputs *in,
                     hand_chain_outputs *out);

#endif
