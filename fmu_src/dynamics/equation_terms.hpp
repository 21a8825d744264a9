#pragma once

#include <vector>

#include "dynamics/workspace.hpp"

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

  int size() const { return static_cast<int>(velocities_.size()); }
  void go_to(const Scalar* q, const Scalar* qd);  // of all joints of the plan
  // Entries of a vector, or of M by rows.
  const Scalar& entry(Term term, int element);

 private:
  struct Velocity {
    int joint, part;  // of the plan; part of an angular velocity, -1: qd
  };
  void compute(Term term);
  void set_mass(Scalar* M);
  void set_inertial(const Vec3<Scalar>& weight, const Scalar* qd, Scalar* forces);
  void set_passive(Scalar* forces);
  void accelerate_ball(int chart, const Vec3<Scalar>& alpha);
  void collect(Scalar* forces);

  const Plan<Scalar>& plan_;
  Workspace<Scalar> workspace_;
  std::vector<Velocity> velocities_;
  std::vector<Scalar> q_, qd_, qdd_, rest_;  // of all joints; rest_: zeros
  std::vector<Scalar> terms_[count];         // empty if not requested
  unsigned current_ = 0;                     // bits of terms
};

}  // namespace redysim
