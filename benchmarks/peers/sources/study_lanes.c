#include "study.h"

#include "two_mass_lanes.c"

enum { LANES = TWO_MASS_LANES };

/* sets: a multiple of LANES. */
void study(const REAL *gains, long sets, const REAL *rows, long samples, REAL *result)
{
    for (long n = 0; n < sets; n += LANES) {
        two_mass_lane_parameters p;
        two_mass_lane_state state;
        two_mass_lane_outputs out = {0};
        REAL sum[LANES] = {0};
        two_mass_fill_lanes(&p);
        for (int lane = 0; lane < LANES; lane++, gains += STUDY_GAINS) {
            p.K_F_between[lane] = gains[0];
            p.K_F_ground[lane] = gains[1];
            p.K_v_v1[lane] = gains[2];
            p.K_v_v2[lane] = gains[3];
        }
        two_mass_prepare_lanes(&p);
        for (long k = 0; k < samples; k++) {
            two_mass_lane_inputs in;
            for (int lane = 0; lane < LANES; lane++) {
                in.x1[lane] = rows[k * STUDY_WIDTH];
                in.x2[lane] = rows[k * STUDY_WIDTH + 1];
                in.w[lane] = rows[k * STUDY_WIDTH + 2];
            }
            if (k == 0) {
                two_mass_init_lanes(&state, &p, &in);
                for (int lane = 0; lane < LANES; lane++) {
                    state.z_v1[lane] += NUDGE;
                    state.z_v2[lane] += 2 * NUDGE;
                }
            }
            two_mass_step_lanes(&state, &p, &in, &out);
            for (int lane = 0; lane < LANES; lane++) sum[lane] += out.F_hat_ground[lane] * out.F_hat_ground[lane];
        }
        for (int lane = 0; lane < LANES; lane++) result[n + lane] = sum[lane];
    }
}
