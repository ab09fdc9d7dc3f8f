/* A study of gains: the observer of the two masses over one log, once for each set of gains. */
#ifndef STUDY_H
#define STUDY_H

/* gains: K_F_between, K_F_ground, K_v_v1, K_v_v2 of every set; rows: x1, x2, w; result: sum of squared ground friction. */
enum { STUDY_GAINS = 4, STUDY_WIDTH = 3 };
void study(const REAL *gains, long sets, const REAL *rows, long samples, REAL *result);

#endif
