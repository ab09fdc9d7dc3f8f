/*
 * one_mass_dfo: friction observer DFO, velocity estimated; 42 operations a step.
 *
 * Made by stiction 0.1.0 from one_mass_dfo.yaml
 * sha256 e39923b63c195b3ca7d1eb762acfc92ae45defa43d4e36b2c550d479270222f0
 * with: stiction generate one_mass_dfo.yaml
 */
#include "one_mass_dfo.h"

#include <math.h>

void one_mass_dfo_init(one_mass_dfo_state *state, const one_mass_dfo_parameters *parameters,
                             const one_mass_dfo_inputs *inputs)
{
    (void)parameters;
    (void)inputs;
    /* states at the first sample */
    state->z_v = -(parameters->K_v * inputs->x);
    state->z_f_rail = -(parameters->K_f1 * inputs->x);
    state->z_a_rail = parameters->rail_a;
}

void one_mass_dfo_step(one_mass_dfo_state *state, const one_mass_dfo_parameters *parameters,
                             const one_mass_dfo_inputs *inputs, one_mass_dfo_outputs *outputs)
{
    /* velocity estimate, (4.25) */
    const double v_hat = state->z_v + parameters->K_v * inputs->x; /* m/s */

    /* slip velocity, U' v, (4.5) */
    const double slip_rail = v_hat; /* m/s */

    /* friction state, (7.11) */
    const double f_hat_rail = state->z_f_rail + parameters->K_f1 * inputs->x + parameters->K_f2 * v_hat; /* 1 */

    /* friction level, (7.10) */
    const double a_hat_rail = state->z_a_rail + parameters->K_a * f_hat_rail * slip_rail; /* N */

    /* unit friction, the law's force at level 1; f of (7.12) */
    const double phi_hat_rail = f_hat_rail; /* N/N */

    /* contact friction, (7.12) */
    const double F_hat_rail = a_hat_rail * phi_hat_rail; /* N */

    /* friction force, (7.12) */
    const double F_hat_on_x = F_hat_rail; /* N */

    /* acceleration, (4.2) */
    const double v_dot_hat = (inputs->w - F_hat_on_x) / parameters->m; /* m/s^2 */

    /* friction state rate, xi_1 of (6.5), (6.6) */
    const double f_rate_rail = parameters->rail_c * (slip_rail - f_hat_rail * parameters->rail_D2 - (parameters->rail_D1 - parameters->rail_D2) * (f_hat_rail + fabs(f_hat_rail - 1.0) / 2.0 - fabs(1.0 + f_hat_rail) / 2.0)); /* 1/s */

    /* states one sample later (explicit Euler) */
    const double z_v_next = state->z_v + parameters->sample_time * (v_dot_hat - parameters->K_v * v_hat);
    const double z_f_rail_next = state->z_f_rail + parameters->sample_time * (f_rate_rail - parameters->K_f1 * v_hat - parameters->K_f2 * v_dot_hat);
    const double z_a_rail_next = state->z_a_rail - parameters->sample_time * (parameters->K_a * (f_hat_rail * v_dot_hat + f_rate_rail * slip_rail));
    state->z_v = z_v_next;
    state->z_f_rail = z_f_rail_next;
    state->z_a_rail = z_a_rail_next;

    outputs->v_hat = v_hat;
    outputs->f_hat_rail = f_hat_rail;
    outputs->a_hat_rail = a_hat_rail;
    outputs->F_hat_rail = F_hat_rail;
    outputs->F_hat_on_x = F_hat_on_x;
}
