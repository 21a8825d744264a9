#pragma once

#include <memory>
#include <vector>

#include "dynamics/ground_motion.hpp"

namespace redysim {

// The terms of the equations of motion of the tree,
//   M v' + bias = tau + passive + J^T lambda, bias = coriolis + gravity,
// in the velocities v: qd of a joint with one DOF, or the angular velocity in link axes of a spherical joint,
// in the order of the plan. Each term is computed when it is first read at a point. Neither throws nor
// allocates after construction.
template <class Scalar>
class EquationTerms {
 public:
  enum Term { gravity, coriolis, bias, passive, mass, count };

  static bool needed(const Model& model);
  EquationTerms(const Model& model, const Plan<Scalar>& plan);  // the plan must outlive this object

  const Plan<Scalar>& plan() const { return plan_; }
  int velocities() const { return plan_.nv - static_cast<int>(plan_.balls.size()); }
  // Sets the evaluation point: q, qd, qdd of all joints of the plan, wrenches (moment, force) of its ports,
  // and multipliers of its rows.
  void go_to(const Scalar* q, const Scalar* qd, const Scalar* qdd, const Scalar* ports,
             const std::vector<Scalar>& lambda);
  // An entry of a vector, or of M, row-major.
  const Scalar& entry(Term term, int element);
  // Entry of the Jacobian of angular velocity (rows 0 to 2) and velocity (rows 3 to 5) of a point of a body,
  // in ground axes, with respect to v: 6 x n, row-major; or of its time derivative. `point`: in body axes.
  Scalar jacobian(int body, const Vec3<double>& point, int element, bool rate);
  // Entry of J M^-1 J^T with the same Jacobian, 6 x 6, row-major; prescribed joints keep their motion.
  Scalar inverse_inertia(int body, const Vec3<double>& point, int element);
  // Derivative of the force along velocity `element / 10` with respect to inertial parameter `element % 10`
  // of a link: mass, first moment (3), inertia about the link's origin (xx, yy, zz, xy, xz, yz), in link
  // axes.
  Scalar regressor(int link, int element);
  // Entry of J: index of the loop in the plan, row index among those of all loops.
  Scalar constraint_jacobian(int loop, int row, int velocity);
  // Wrench that a joint transmits to its link, at the origin and in axes of the link. For a spherical joint
  // pass its chart joint.
  Force<Scalar> reaction(int joint) const;

 private:
  // whether it is the chart joint of a spherical joint, whose velocities are those of the next three joints
  bool is_chart(int joint) const { return plan_.joints[joint].of_ball && plan_.joints[joint].prescribed; }
  struct Velocity {
    int joint, chart;  // indices into the plan; chart: of a spherical joint, otherwise ground
  };
  Velocity velocity_at(int k) const;
  void compute(Term term);
  void set_mass(Scalar* M);
  void factor_mass();
  void solve_lower(int body, const Vec3<double>& point, int row, Scalar* x);
  void set_passive(Scalar* forces);
  void set_inertial(const Vec3<Scalar>& weight, const Scalar* qd, Scalar* forces);
  void accelerate_ball(int chart, const Vec3<Scalar>& alpha);
  void collect(Scalar* forces);
  void set_bodies();
  bool renew(unsigned what);
  Scalar along(int velocity, int body, int root, Force<Scalar> wrench) const;

  const Plan<Scalar>& plan_;
  Workspace<Scalar> workspace_;
  std::vector<Scalar> numbers_;                    // storage of all arrays below
  Scalar *rest_, *q_, *qd_, *now_, *qdd_;          // of all joints; rest_: zeros; now_: qdd
  Scalar* terms_[count];                           // empty if not requested
  Scalar* factor_;                                 // L of M = L L^T, row-major, and two vectors; or empty
  std::unique_ptr<GroundState<Scalar>[]> bodies_;  // null if no Jacobian is requested
  std::unique_ptr<Force<Scalar>[]> reactions_;     // of all joints; null if not requested
  // further items of current_: bodies_, accelerations and loop rows in the workspace, factor_
  static constexpr unsigned bodies = 1u << count, accelerations = bodies << 1, rows = bodies << 2,
                            factors = bodies << 3;
  unsigned current_ = 0;  // bits of the up-to-date items
};

}  // namespace redysim
