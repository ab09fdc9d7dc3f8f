#include "hand_two_mass.h"

#include <float.h>
#include <math.h>

void hand_two_mass_init(hand_two_mass_state *s, const hand_two_mass_parameters *p, const hand_two_mass_inputs *in)
{
    s->z_v1 = -p->K_v1 * in->x1;
    s->z_v2 = -p->K_v2 * in->x2;
    s->z_between = p->a_between;
    s->z_ground = p->a_ground;
}

static inline double sign(double u)
{
    return u > 0.0 ? 1.0 : u < 0.0 ? -1.0 : 0.0;
}

void hand_two_mass_step(hand_two_mass_state *s, const hand_two_mass_parameters *p, const hand_two_mass_inputs *in,
                        hand_two_mass_outputs *out)
{
    const double x1 = in->x1, x2 = in->x2;
    const double v1 = s->z_v1 + p->K_v1 * x1;
    const double v2 = s->z_v2 + p->K_v2 * x2;
    const double slip = v1 - v2;
    const double s_between = sign(slip), s_ground = sign(v2);
    const double g_between = p->K_F_between * s_between, g_ground = p->K_F_ground * s_ground; /* K_F |u| = g u */
    const double a_between = s->z_between - g_between * slip;
    const double a_ground = s->z_ground - g_ground * v2;
    const double F_between = s_between * a_between, F_ground = s_ground * a_ground;
    const double F_on_2 = F_ground - F_between;
    /* accelerations times the sample time */
    const double dv1 = p->h_over_m1 * (p->coupling * x2 - p->stiffness_1 * x1 - F_between);
    const double dv2 = p->h_over_m2 * (in->w + p->coupling * x1 - p->stiffness_2 * x2 - F_on_2);
    const double z_v1 = s->z_v1 + dv1 - p->h_K_v1 * v1;
    const double z_v2 = s->z_v2 + dv2 - p->h_K_v2 * v2;
    const double z_between = s->z_between + g_between * (dv1 - dv2);
    const double z_ground = s->z_ground + g_ground * dv2;
#ifdef HOLD
    out->fault = !(fabs(z_v1 + z_v2 + z_between + z_ground) <= DBL_MAX);
    if (out->fault) return;
#endif
    s->z_v1 = z_v1;
    s->z_v2 = z_v2;
    s->z_between = z_between;
    s->z_ground = z_ground;
    out->v1 = v1;
    out->v2 = v2;
    out->a_between = a_between;
    out->a_ground = a_ground;
    out->F_between = F_between;
    out->F_ground = F_ground;
    out->F_on_1 = F_between;
    out->F_on_2 = F_on_2;
}
