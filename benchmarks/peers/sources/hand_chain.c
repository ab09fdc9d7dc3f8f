#include "hand_chain.h"

#include <float.h>
#include <math.h>

void hand_chain_init(hand_chain_state *s, const hand_chain_parameters *p, const hand_chain_inputs *in)
{
    for (int i = 0; i < N; i++) {
        s->z_v[i] = -p->K_v[i] * in->x[i];
        s->z[i] = p->a[i];
    }
}

void hand_chain_step(hand_chain_state *restrict s, const hand_chain_parameters *restrict p,
                     const hand_chain_inputs *restrict in, hand_chain_outputs *restrict out)
{
    double z_v[N], z[N], check = 0.0, left = -in->w; /* pull of the spring on the left, outside the chain the input */
    for (int i = 0; i < N; i++) {
        const double right = i + 1 < N ? p->spring * (in->x[i + 1] - in->x[i]) : 0.0;
        const double v = s->z_v[i] + p->K_v[i] * in->x[i];
        const double sign = v > 0.0 ? 1.0 : v < 0.0 ? -1.0 : 0.0;
        const double gain = p->K_F[i] * sign;
        const double a = s->z[i] - gain * v;
        const double F = sign * a;
        const double dv = p->sample_time * p->mass_reciprocal * (right - left - F);
        z_v[i] = s->z_v[i] + dv - p->sample_time * p->K_v[i] * v;
        z[i] = s->z[i] + gain * dv;
        check += z_v[i] + z[i];
        out->v[i] = v;
        out->a[i] = a;
        out->F[i] = F;
        out->F_on[i] = F;
        left = right;
    }
    out->fault = !(fabs(check) <= DBL_MAX);
    if (out->fault) return;
    for (int i = 0; i < N; i++) {
        s->z_v[i] = z_v[i];
        s->z[i] = z[i];
    }
}
