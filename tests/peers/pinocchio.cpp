// Accelerations by Pinocchio, for ctypes: a tree of hinges about x, loops as welds of a node to
// another, springs and dampers as torques.

#include <pinocchio/algorithm/aba.hpp>
#include <pinocchio/algorithm/constrained-dynamics.hpp>
#include <pinocchio/algorithm/loop-constrained-aba.hpp>
#include <pinocchio/multibody.hpp>

namespace pin = pinocchio;
using Rows = Eigen::Map<const Eigen::Matrix<double, 3, 3, Eigen::RowMajor>>;
using Vector = Eigen::VectorXd;

struct Robot {
    pin::Model model;
    pin::Data data;
    Vector stiffness, damping, rest, q, u, torque;
    std::vector<pin::RigidConstraintModel> loops;
    std::vector<pin::RigidConstraintData> loop_data;
    pin::ProximalSettings settings;
};

static pin::SE3 placement(const double *turn, const double *offset) {
    return pin::SE3(Rows(turn), Eigen::Map<const Eigen::Vector3d>(offset));
}

extern "C" {

// Nodes, parents first (-1: the ground): turn (rows) and offset of their frames in the parent's;
// mass, centre of mass, inertia about it. Per node: stiffness, damping, rest.
// Per loop: two nodes and the placement of the first in the second when closed.
void *create(int nodes, const int *parents, const double *turns, const double *offsets,
             const double *masses, const double *coms, const double *inertias,
             const double *stiffness, const double *damping, const double *rest,
             const double *gravity, int loops, const int *ends, const double *between_turns,
             const double *between_offsets, double mu, double accuracy, int iterations) {
    auto *robot = new Robot;
    pin::Model &model = robot->model;
    model.gravity.linear() = Eigen::Map<const Eigen::Vector3d>(gravity);
    for (int i = 0; i < nodes; i++) {
        auto joint = model.addJoint(parents[i] + 1, pin::JointModelRX(),
                                    placement(turns + 9 * i, offsets + 3 * i), std::to_string(i));
        pin::Inertia body(masses[i], Eigen::Map<const Eigen::Vector3d>(coms + 3 * i),
                          pin::Symmetric3(Eigen::Matrix3d(Rows(inertias + 9 * i))));
        model.appendBodyToJoint(joint, body);
    }
    for (int k = 0; k < loops; k++) {
        robot->loops.emplace_back(pin::CONTACT_6D, model, ends[2 * k] + 1, pin::SE3::Identity(),
                                  ends[2 * k + 1] + 1,
                                  placement(between_turns + 9 * k, between_offsets + 3 * k),
                                  pin::LOCAL);
    }
    robot->data = pin::Data(model);
    for (const auto &loop : robot->loops) robot->loop_data.emplace_back(loop);
    robot->settings = pin::ProximalSettings(accuracy, mu, iterations);
    robot->stiffness = Eigen::Map<const Vector>(stiffness, nodes);
    robot->damping = Eigen::Map<const Vector>(damping, nodes);
    robot->rest = Eigen::Map<const Vector>(rest, nodes);
    robot->q = robot->u = robot->torque = Vector::Zero(nodes);
    return robot;
}

void destroy(void *robot) { delete static_cast<Robot *>(robot); }

// Called once before the function with this number.
void prepare(void *handle, int function) {
    auto &robot = *static_cast<Robot *>(handle);
    if (function == 1) {
        pin::initConstraintDynamics(robot.model, robot.data, robot.loops, robot.loop_data);
    } else if (function == 2) {
        pin::computeJointMinimalOrdering(robot.model, robot.data, robot.loops);
    }
}

// 0: aba, of trees. 1: constraintDynamics. 2: lcaba. Rows of q, u, a: states, in the nodes' order.
void accelerations(void *handle, int function, const double *q, const double *u, double *a,
                   long states, long repeats) {
    auto &r = *static_cast<Robot *>(handle);
    const long n = r.model.nv;
    for (long repeat = 0; repeat < repeats; repeat++) {
        for (long state = 0; state < states; state++) {
            r.q = Eigen::Map<const Vector>(q + n * state, n);
            r.u = Eigen::Map<const Vector>(u + n * state, n);
            r.torque.array() = r.stiffness.array() * (r.rest - r.q).array() -
                               r.damping.array() * r.u.array();
            if (function == 0) {
                pin::aba(r.model, r.data, r.q, r.u, r.torque);
            } else if (function == 1) {
                pin::constraintDynamics(r.model, r.data, r.q, r.u, r.torque, r.loops, r.loop_data,
                                        r.settings);
            } else {
                pin::lcaba(r.model, r.data, r.q, r.u, r.torque, r.loops, r.loop_data, r.settings);
            }
            Eigen::Map<Vector>(a + n * state, n) = r.data.ddq;
        }
    }
}
}
