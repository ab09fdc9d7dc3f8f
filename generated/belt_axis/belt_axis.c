/*
 * belt_axis: friction observer GCFO, velocity estimated; 20 operations a step.
 *
 * Made by stiction 0.1.0 from belt_axis.yaml
 * sha256 86f79aec1e97a2e042a4a218049bfc2c81c9121b32e6b6825b9fe7177cca10ed
 * with: stiction generate belt_axis.yaml
 */
#include "belt_axis.h"

#include <math.h>

static double signum(double u)
{
    return u > 0.0 ? 1.0 : (u < 0.0 ? -1.0 : 0.0);
}

void belt_axis_init(belt_axis_state *state, const belt_axis_parameters *parameters,
                             const belt_axis_inputs *inputs)
{
    (void)parameters;
    (void)inputs;
    /* states at the first sample */
    state->z_v = -(parameters->K_v * inputs->x);
    state->z_guide = parameters->guide_a;
}

void belt_axis_step(belt_axis_state *state, const belt_axis_parameters *parameters,
                             const belt_axis_inputs *inputs, belt_axis_outputs *outputs)
{
    /* velocity estimate, (4.25) */
    const double v_hat = state->z_v + parameters->K_v * inputs->x; /* m/s */

    /* slip velocity, U' v, (4.5) */
    const double slip_guide = v_hat; /* m/s */

    /* slip sign, (4.13) */
    const double sign_guide = signum(slip_guide); /* 1 */

    /* friction level, (4.11) */
    const double a_hat_guide = state->z_guide - parameters->K_F * fabs(slip_guide); /* N */

    /* contact friction, (4.10) */
    const double F_hat_guide = a_hat_guide * sign_guide; /* N */

    /* friction force, (4.10) */
    const double F_hat_on_x = F_hat_guide; /* N */

    /* acceleration, (4.2) */
    const double v_dot_hat = (parameters->kf * inputs->u - F_hat_on_x - parameters->b * v_hat) / parameters->m; /* m/s^2 */

    /* states one sample later (explicit Euler) */
    const double z_v_next = state->z_v + parameters->sample_time * (v_dot_hat - parameters->K_v * v_hat);
    const double z_guide_next = state->z_guide + parameters->sample_time * (parameters->K_F * sign_guide * v_dot_hat);
    state->z_v = z_v_next;
    state->z_guide = z_guide_next;

    outputs->v_hat = v_hat;
    outputs->a_hat_guide = a_hat_guide;
    outputs->F_hat_guide = F_hat_guide;
    outputs->F_hat_on_x = F_hat_on_x;
}
