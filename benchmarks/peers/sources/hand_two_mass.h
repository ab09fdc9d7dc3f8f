/* Two masses with two contacts, GCFO behind the velocity observer, by hand: the peer of generated/two_mass.
 * Gains times the sample time and reciprocals are constants; HOLD keeps the last estimate on a sample that is not finite. */
#ifndef HAND_TWO_MASS_H
#define HAND_TWO_MASS_H

typedef struct {
    double stiffness_1, stiffness_2, coupling; /* eta2 + eta3, eta1 + eta3, eta3 */
    double h_over_m1, h_over_m2;
    double K_F_between, K_F_ground;
    double K_v1, K_v2;     /* of the velocity observer */
    double h_K_v1, h_K_v2; /* times the sample time */
    double a_between, a_ground;
} hand_two_mass_parameters;

#ifndef LEVEL_GAIN
#define LEVEL_GAIN 500.0 /* K_F_between */
#endif

#define HAND_TWO_MASS_PARAMETERS \
    {70.0, 120.0, 20.0, 0.001 / 10.0, 0.001 / 50.0, LEVEL_GAIN, 700.0, 10.0, 10.0, 0.01, 0.01, 10.0, 20.0}

typedef struct {
    double z_v1, z_v2, z_between, z_ground;
} hand_two_mass_state;

typedef struct {
    double x1, x2, w;
} hand_two_mass_inputs;

typedef struct {
    double v1, v2, a_between, a_ground, F_between, F_ground, F_on_1, F_on_2;
    int fault;
} hand_two_mass_outputs;

void hand_two_mass_init(hand_two_mass_state *s, const hand_two_mass_parameters *p, const hand_two_mass_inputs *in);
void hand_two_mass_step(hand_two_mass_state *s, const hand_two_mass_parameters *p, const hand_two_mass_inputs *in,
                        hand_two_mass_outputs *out);

#endif
