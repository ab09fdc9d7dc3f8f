#include "study.h"

#include "two_mass.c"

void study(const REAL *gains, long sets, const REAL *rows, long samples, REAL *result)
{
    for (long n = 0; n < sets; n++, gains += STUDY_GAINS) {
        two_mass_parameters p = TWO_MASS_PARAMETERS;
        two_mass_state state;
        two_mass_outputs out = {0};
        REAL sum = 0;
        p.K_F_between = gains[0];
        p.K_F_ground = gains[1];
        p.K_v_v1 = gains[2];
        p.K_v_v2 = gains[3];
        two_mass_prepare(&p);
        for (long k = 0; k < samples; k++) {
            const two_mass_inputs in = {rows[k * STUDY_WIDTH], rows[k * STUDY_WIDTH + 1], rows[k * STUDY_WIDTH + 2]};
            if (k == 0) {
                two_mass_init(&state, &p, &in);
                state.z_v1 += NUDGE;
                state.z_v2 += 2 * NUDGE;
            }
            two_mass_step(&state, &p, &in, &out);
            sum += out.F_hat_ground * out.F_hat_ground;
        }
        result[n] = sum;
    }
}
