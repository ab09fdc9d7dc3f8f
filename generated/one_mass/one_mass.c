/*
 * one_mass: friction observer CFO, velocity estimated; 17 operations a step.
 *
 * Made by stiction 0.1.0 from one_mass.yaml
 * sha256 e67cd56555665e4cb1932194e4d6ac3973199ae183caabde74369e4fecf4dea9
 * with: stiction generate one_mass.yaml
 */
#include "one_mass.h"

#include <math.h>

static double signum(double u)
{
    return u > 0.0 ? 1.0 : (u < 0.0 ? -1.0 : 0.0);
}

void one_mass_init(one_mass_state *state, const one_mass_parameters *parameters,
                             const one_mass_inputs *inputs)
{
    (void)parameters;
    (void)inputs;
    /* states at the first sample */
    state->z_v = -(parameters->K_v * inputs->x);
    state->z_rail = parameters->rail_a;
}

void one_mass_step(one_mass_state *state, const one_mass_parameters *parameters,
                             const one_mass_inputs *inputs, one_mass_outputs *outputs)
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
    const double v_dot_hat = (inputs->w - F_hat_on_x) / parameters->m; /* m/s^2 */

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
