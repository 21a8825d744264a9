#pragma once

#include <memory>
#include <vector>

#include "dynamics/ground_motion.hpp"

namespace redysim {

// The terms of the equations of motion of the tree,
//   M v' + bias = tau + passive + J^T lambda, bias = coriolis + gravity,
// in the velocities v: qd of a joint with one DOF, the angular velocity in link axes of a spherical one, in
// the order of the plan. Each term is computed when it is first read at a point. Neither throws nor allocates
// after construction.
template <class Scalar>
class EquationTerms {
 public:
  enum Term { gravity, coriolis, bias, passive, mass, count };

  static bool needed(const Model& model);
  EquationTerms(const Model& model, const Plan<Scalar>& plan);  // the plan must outlive it

  const Plan<Scalar>& plan() const { return plan_; }
  int velocities() const { return plan_.nv - static_cast<int>(plan_.balls.size()); }
  // A point: of all joints of the plan, of its ports (moments and forces) and its rows.
  void go_to(const Scalar* q, const Scalar* qd, const Scalar* qdd, const Scalar* ports,
             const std::vector<Scalar>& lambda);
  // Entries of a vector, or of M by rows.
  const Scalar& entry(Term term, int element);
  // Angular velocity (rows 0 to 2) and velocity of a point of a body in ground axes, by v: 6 x n, by rows; or
  // its time derivative.
  Scalar jacobian(int body, const Vec3<double>& point, int element, bool rate);
  // J M^-1 J^T of the same Jacobian, 6 x 6, by rows; prescribed joints keep their motion.
  Scalar inverse_inertia(int body, const Vec3<double>& point, int element);
  // Force along velocity `element / 10` by one of the ten inertial parameters of a link: mass, first moment
  // (3), inertia about the link's origin (xx, yy, zz, xy, xz, yz), in link axes.
  Scalar regressor(int link, int element);
  // Entry of J: loop of the plan, row among those of all loops.
  Scalar constraint_jacobian(int loop, int row, int velocity);
  // Wrench on the link of a joint through the joint, at the origin and in axes of the link. Of a spherical
  // joint: its chart.
  Force<Scalar> reaction(int joint) const;

 private:
  // chart joint of a spherical joint, whose velocities are those of the next three
  bool is_chart(int joint) const { return plan_.joints[joint].of_ball && plan_.joints[joint].prescribed; }
  struct Velocity {
    int joint, chart;  // of the plan; chart of a spherical joint, else ground
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
  std::vector<Scalar> numbers_;                    // all of the following
  Scalar *rest_, *q_, *qd_, *now_, *qdd_;          // of all joints; rest_: zeros; now_: qdd
  Scalar* terms_[count];                           // of no length if not requested
  Scalar* factor_;                                 // L of M = L L^T, by rows, and two vectors; likewise
  std::unique_ptr<GroundState<Scalar>[]> bodies_;  // null if no Jacobian is requested
  std::unique_ptr<Force<Scalar>[]> reactions_;     // of all joints; null if not requested
  // besides terms: bodies_, the accelerations and the loop rows in the workspace, and factor_
  static constexpr unsigned bodies = 1u << count, accelerations = bodies << 1, rows = bodies << 2,
                            factors = bodies << 3;
  unsigned current_ = 0;  // bits
};

}  // namespace redysim
