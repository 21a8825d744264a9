#pragma once

#include <memory>
#include <vector>

#include "dynamics/plan.hpp"
#include "dynamics/workspace.hpp"
#include "math/dual.hpp"

namespace redysim {

// A variable of differentiation.
struct JointVariable {
  enum class Kind { position, velocity, force };
  Kind kind;
  int joint;  // of the plan
};

// Exact derivatives of forward_dynamics by positions and velocities. The accelerations solve the equations
// of motion F(q, qd, qdd, lambda) = 0: inverse dynamics and loop rows. The derivative of F at constant qdd
// and lambda consists of closed forms for the bodies outboard of the joint, and of dual numbers for springs,
// ports and loops. The elimination of the last forward_dynamics solves for the derivative of qdd (implicit
// function theorem, docs/derivations/derivatives.md). A column costs less than a right-hand side, and the
// rank of the loops is that of forward_dynamics. Sized once for a plan; used by implicit methods only.
class Derivatives {
 public:
  explicit Derivatives(const Plan<double>& plan);

  // Requires `ws` of the last forward_dynamics(plan, ws, q, qd, inputs, qdd) and overwrites all but its
  // elimination. `tau`: forces of all drives, prescribed joints included; `ports`: 6 numbers each. Fills one
  // column per variable, `length` apart in `columns`: nv accelerations, then the external power (W) at
  // constant drive forces, without ports. `plan` may have other parameters than in the constructor, but the
  // same structure.
  void evaluate(const Plan<double>& plan, Workspace<double>& ws, const double* q, const double* qd,
                const double* qdd, const double* tau, const double* ports,
                const std::vector<JointVariable>& variables, double* columns, std::size_t length);

  // Row instead of columns: sums of the derivatives of accelerations and power.
  struct Gradient {
    std::vector<double> q, qd, tau;  // nv each
    std::vector<double> ports;       // 6 numbers each, without their power
  };
  // One sweep, whatever the number of variables. `weights`: of the accelerations. Requirements as above.
  void evaluate_row(const Plan<double>& plan, Workspace<double>& ws, const double* q, const double* qd,
                    const double* qdd, const double* tau, const double* ports, const double* weights,
                    double weight_of_power, Gradient& row);

 private:
  // One body at the point of evaluation, in its own axes.
  struct Body {
    Vec3<double> omega, omega_carried;  // rad/s; carried: without its own joint's part
    Vec3<double> arm;                   // from its parent's origin
    Motion<double> acceleration;        // minus gravity
    Force<double> wrench;               // through its joint
  };
  // Its derivative with respect to the variable.
  struct Change {
    bool moved = false;  // in the subtree of the variable's joint
    Vec3<double> omega;
    Motion<double> acceleration;
    Force<double> wrench;
  };
  // What acts between up to three bodies: one entry of the plan.
  struct Element {
    enum class Kind { spring, bushing, contact, port, loop } kind;
    std::size_t index;
    int bodies[3], entries[3];  // entries: of Workspace::ground
  };
  // Derivative of an entry of Workspace::ground by a position or velocity; turn: a rotation vector.
  struct GroundChange {
    Vec3<double> turn = Vec3<double>::Zero(), position = turn, omega = turn, velocity = turn;
  };
  // Weights of changes of an entry of Workspace::ground: rotation vector, position, omega, velocity.
  struct Pulled {  // NOLINT(bugprone-reserved-identifier): of an index that clang makes
    Vec3<double> of[4] = {Vec3<double>::Zero(), Vec3<double>::Zero(), Vec3<double>::Zero(),
                          Vec3<double>::Zero()};
  };

  void set_point(const Plan<double>& plan, Workspace<double>& ws, const double* q, const double* qd,
                 const double* qdd, const double* ports);
  void set_subtree(const Plan<double>& plan, const Workspace<double>& ws, const double* qd, int joint,
                   bool velocity);
  double set_elements(const Plan<double>& plan);
  void move_ground_states(const Plan<double>& plan, const Workspace<double>& ws, int joint, bool velocity);
  GroundChange ground_change(const Plan<double>& plan, const Workspace<double>& ws, int joint, int parent,
                             const PoseStep& step, bool velocity) const;
  void change_contacts();
  void change_loops(const Plan<double>& plan, Workspace<double>& ws, bool velocity);
  void change_row(const Plan<double>& plan, Workspace<double>& ws, std::size_t row, int of,
                  const Force<Dual>& wrench, bool velocity);
  void move_along(const Plan<double>& plan, const Workspace<double>& ws, Gradient& row);
  void sweep_back(const Plan<double>& plan, const Workspace<double>& ws, const double* qd, Gradient& row);
  double change_of_element(const Element& element, const Workspace<double>& ws, double weight);
  double change_of_loop(const Element& element, const Workspace<double>& ws);
  void pull_element(const Element& element, const Workspace<double>& ws, double weight);
  void weigh_loop(const Element& element, const Workspace<double>& ws);
  void pull_elements(const Plan<double>& plan, const Workspace<double>& ws, const double* qd, double weight,
                     Gradient& row);
  void push_ground_weights(const Plan<double>& plan, const Workspace<double>& ws, const double* qd,
                           Gradient& row);
  void pull_couplings(const Plan<double>& plan, const double* q, const double* qd, double weight,
                      Gradient& row);
  void collect_forces(const Plan<double>& plan, const Workspace<double>& ws, int joint, bool velocity);

  std::vector<Body> bodies_;
  std::vector<Change> changes_;
  std::vector<double> lambda_, forces_;
  std::vector<Force<double>> K_;
  // springs, contacts, ports and loops, with the constants of the plan and the motion of their bodies
  struct Elements {
    explicit Elements(const Plan<double>& of);
    Plan<Dual> plan;
    Workspace<Dual> workspace;
  };
  std::unique_ptr<Elements> elements_;  // null: there are none
  std::vector<Dual> port_wrenches_;
  // of a row
  std::vector<Pulled> pulled_;
  Vec3<double> gravity_;
};

}  // namespace redysim
