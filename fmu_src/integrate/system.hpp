#pragma once

#include <vector>

#include "dynamics/plan.hpp"
#include "dynamics/workspace.hpp"

namespace redysim {

// What a right-hand side or a projection may say, in SUNDIALS' own order: 0 go on, > 0 try a smaller
// step, < 0 give up.
enum class Status { ok = 0, recoverable = 1, fatal = -1 };

// The ODE of one instance: state y = [q (nq); qd (nv); work (1, when asked for)], ydot = f(time, y; tau).
// Owns the inputs and the workspace; neither throws nor allocates after construction.
class System {
 public:
  // `plan` is used, not copied, and must outlive the system. `with_work` appends the work of inputs and
  // dampers (J) as the last state.
  System(const Plan<double>& plan, bool with_work);

  const Plan<double>& plan() const { return plan_; }
  int nq() const { return plan_.nq; }
  int nv() const { return plan_.nv; }
  int size() const { return plan_.nq + plan_.nv + (with_work_ ? 1 : 0); }
  bool with_work() const { return with_work_; }

  // The inputs: joint forces (N m or N), length nv, entries of undriven joints stay 0.
  std::vector<double>& tau() { return tau_; }

  // ydot = f(time, y). Fills the workspace for y. A non-finite result is recoverable.
  Status right_hand_side(double time, const double* y, double* ydot);

  // Closed loops: moves y to the nearest point (mass metric) with closed position and velocity
  // constraints. `error` (length size(), may be null) is an error estimate to be projected alike.
  bool has_loops() const { return !plan_.loops.empty(); }
  Status project(double time, double* y, double* error);

  // Accelerations at (time, y) into qdd (length nv): the same solve as the right-hand side.
  Status accelerations(double time, const double* y, double* qdd);

  double kinetic_energy(const double* y);
  double potential_energy(const double* y);
  double work(const double* y) const { return with_work_ ? y[plan_.nq + plan_.nv] : 0.0; }

  // Which joint made the last evaluation fail: index into plan().joints, or -1.
  int failed_joint() const { return failed_joint_; }
  long evaluations() const { return evaluations_; }

  Workspace<double>& workspace() { return workspace_; }

 private:
  void set_residuals(const double* q, const double* qd);
  Status project_within_rank(double time, double* y, double* error);
  void reduce_residual(const std::vector<double>& residual, double enough, double* part, const double* q,
                       const double* qd);
  void project_error(double* error);

  const Plan<double>& plan_;
  bool with_work_;
  std::vector<double> tau_;
  Workspace<double> workspace_;
  std::vector<double> scratch_;  // nv
  int failed_joint_ = -1;
  long evaluations_ = 0;
};

}  // namespace redysim
