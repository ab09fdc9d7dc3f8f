/* The tracking observer's step on Pinocchio, as its documentation would have it: crba, nonLinearEffects, Eigen's LDLT.
 * robot.h builds the model joint by joint, since the wheel has no headers of the robot file's parser, and holds the
 * gains: (K_1, K_2, K_v, damping), a row a joint; K_1 is zero, and left out of the step as in ours. */
#include <Eigen/Cholesky>
#include <pinocchio/algorithm/crba.hpp>
#include <pinocchio/algorithm/rnea.hpp>
#include <pinocchio/multibody.hpp>

namespace {

constexpr int N = JOINTS;
using Column = Eigen::Matrix<double, N, 1>;

struct Observer {
    pinocchio::Model model;
    pinocchio::Data data;
    Eigen::Matrix<double, N, 4> gains;
    Column z_v, z;
    Eigen::VectorXd position, velocity;
    Eigen::Matrix<double, N, N> mass;
    Eigen::LDLT<Eigen::Matrix<double, N, N>> factor;
};

#include "robot.h"

Observer *make()
{
    Observer *o = new Observer;
    build(o->model);
    o->data = pinocchio::Data(o->model);
    for (int i = 0; i < N; i++)
        for (int j = 0; j < 4; j++) o->gains(i, j) = gain_rows[i][j];
    o->position = o->velocity = Eigen::VectorXd::Zero(N);
    return o;
}

Observer *observer = make();

}

/* inputs: x, w; outputs: velocity estimate, tracked friction, friction force. */
extern "C" __attribute__((noinline)) void pinocchio_step(Observer *o, const double *inputs, double *outputs)
{
    Eigen::Map<const Column> x(inputs), w(inputs + N);
    Eigen::Map<Column> v_hat(outputs), tracked(outputs + N), friction(outputs + 2 * N);
    const auto K_2 = o->gains.col(1).array(), K_v = o->gains.col(2).array();
    v_hat.array() = o->z_v.array() + K_v * x.array();
    tracked.array() = o->z.array() + K_2 * v_hat.array();
    friction.array() = tracked.array() + o->gains.col(3).array() * v_hat.array();
    o->position = x;
    o->velocity = v_hat;
    pinocchio::crba(o->model, o->data, o->position, pinocchio::Convention::WORLD);
    const auto &bias = pinocchio::nonLinearEffects(o->model, o->data, o->position, o->velocity);
    o->mass = o->data.M.selfadjointView<Eigen::Upper>();
    o->factor.compute(o->mass);
    const Column a = o->factor.solve(w - friction - bias);
    o->z_v.array() += STEP_TIME * (a.array() - K_v * v_hat.array());
    o->z.array() -= STEP_TIME * (K_2 * a.array());
}

extern "C" void peer_start(const double *row)
{
    Eigen::Map<const Column> x(row);
    observer->z_v.array() = -observer->gains.col(2).array() * x.array();
    observer->z.array() = -observer->gains.col(0).array() * x.array();
    for (int i = 0; i < N; i++) {
        observer->z_v(i) += NUDGE * (i + 1);
        observer->z(i) += NUDGE * (N + i + 1);
    }
}

extern "C" void peer_run(const double *rows, long samples, long passes, double *record)
{
    double outputs[3 * N];
    for (long pass = 0; pass < passes; pass++)
        for (long k = 0; k < samples; k++) {
            double *target = record ? record + k * 3 * N : outputs;
            pinocchio_step(observer, rows + k * 2 * N, target);
        }
}
