/*
 * emps: friction observer GCFO, velocity estimated; 21 operations a step.
 *
 * Made by stiction 0.1.0 from emps.yaml
 * sha256 d12d46064ab668b52af346ac1f00c9207373a086bbfb7d2f3571a5090dba0d19
 * with: stiction generate emps.yaml
 */
#include "emps.h"

#include <math.h>

static double signum(double u)
{
    return u > 0.0 ? 1.0 : (u < 0.0 ? -1.0 : 0.0);
}

void emps_init(emps_state *state, const emps_parameters *parameters,
                             const emps_inputs *inputs)
{
    (void)parameters;
    (void)inputs;
    /* states at the first sample */
    state->z_v = -(parameters->K_v * inputs->x);
    state->z_rail = parameters->rail_a;
}

void emps_step(emps_state *state, const emps_parameters *parameters,
                             const emps_inputs *inputs, emps_outputs *outputs)
{
    /* velocity estimate, (4.25) */
    const double v_hat = state->z_v + parameters->K_v * inputs->x; /* m/s */

    /* slip velocity, U' v, (4.5) */
    const double slip_rail = v_hat; /* m/s */

    /* slip sign, (4.13) */
    const double sign_rail = signum(slip_rail); /* 1 */

    /* friction level, (4.11) */
    const double a_hat_rail = state->z_rail - parameters->K_F * fabs(slip_rail); /* N */

    /* contact friction, (4.10) */
    const double F_hat_rail = a_hat_rail * sign_rail; /* N */

    /* friction force, (4.10) */
    const double F_hat_on_x = F_hat_rail; /* N */

    /* acceleration, (4.2) */
    const double v_dot_hat = (parameters->gtau * inputs->u - F_hat_on_x - parameters->offset - parameters->Fv * v_hat) / parameters->M; /* m/s^2 */

    /* states one sample later (explicit Euler) */
    const double z_v_next = state->z_v + parameters->sample_time * (v_dot_hat - parameters->K_v * v_hat);
    const double z_rail_next = state->z_rail + parameters->sample_time * (parameters->K_F * sign_rail * v_dot_hat);
    state->z_v = z_v_next;
    state->z_rail = z_rail_next;

    outputs->v_hat = v_hat;
    outputs->a_hat_rail = a_hat_rail;
    outputs->F_hat_rail = F_hat_rail;
    outputs->F_hat_on_x = F_hat_on_x;
}
