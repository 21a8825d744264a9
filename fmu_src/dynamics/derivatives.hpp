#pragma once

#include <vector>

#include "dynamics/plan.hpp"
#include "dynamics/workspace.hpp"
#include "math/dual.hpp"

namespace redysim {

// What accelerations are differentiated by.
struct JointVariable {
  enum class Kind { position, velocity, force };
  Kind kind;
  int joint;  // of the plan
};

// Exact derivatives of forward_dynamics by positions and velocities. The accelerations solve the equations
// of motion F(q, qd, qdd, lambda) = 0, inverse dynamics and loop rows together. A variable moves F, at held
// qdd and lambda, by what its joint does to its subtree (closed form) and to springs, ports and loops (dual
// numbers); the elimination that forward_dynamics left behind gives the answer of qdd (implicit function
// theorem, docs/derivations/derivatives.md). So a column costs less than a right-hand side, and the rank of
// loops is the one that forward_dynamics decided on.
// Sized once for a plan; owned by implicit methods alone.
class Derivatives {
 public:
  explicit Derivatives(const Plan<double>& plan);

  // Uses `ws` as forward_dynamics(plan, ws, q, qd, inputs, qdd) has just left it, and overwrites all but its
  // elimination. `tau`: forces of all drives, prescribed ones as well; `ports`: 6 numbers each. Fills one
  // column for each variable, nv + 1 apart in `columns`: nv accelerations, then the external power (W) at
  // held drive forces, without that of ports. `plan` may have changed its parameters, but not its structure.
  void evaluate(const Plan<double>& plan, Workspace<double>& ws, const double* q, const double* qd,
                const double* qdd, const double* tau, const double* ports,
                const std::vector<JointVariable>& variables, double* columns);

 private:
  // One body at the point of evaluation, in its own axes.
  struct Body {
    Vec3<double> omega, omega_carried;  // rad/s; carried: without its own joint's part
    Vec3<double> arm;                   // from its parent's origin
    Motion<double> acceleration;        // minus gravity
    Force<double> wrench;               // through its joint
  };
  // How it changes with the variable.
  struct Change {
    bool moved = false;  // in the subtree of the variable's joint
    Vec3<double> omega;
    Motion<double> acceleration;
    Force<double> wrench;
  };

  void set_point(const Plan<double>& plan, Workspace<double>& ws, const double* q, const double* qd,
                 const double* qdd, const double* ports);
  void move_subtree(const Plan<double>& plan, const Workspace<double>& ws, const double* qd, int joint,
                    bool velocity);
  void move_ground_states(const Plan<double>& plan, const Workspace<double>& ws, int joint, bool velocity);
  double change_elements(const Plan<double>& plan);
  void change_loops(const Plan<double>& plan, Workspace<double>& ws);
  void collect_forces(const Plan<double>& plan, const Workspace<double>& ws, int joint, bool velocity);

  std::vector<Body> bodies_;
  std::vector<Change> changes_;
  std::vector<double> lambda_, forces_;
  std::vector<Force<double>> K_;
  // springs, ports and loops alone
  bool has_elements_;
  Plan<Dual> plan_;
  Workspace<Dual> workspace_;
  std::vector<Dual> port_wrenches_;
};

}  // namespace redysim
