#pragma once

#include <memory>
#include <vector>

#include "integrate/system/system.hpp"
#include "math/dual.hpp"

namespace redysim {

// Part of Tangent for scenes with a controller or trajectories: the equations of Control at one point with
// one direction of change.
class ControlTangent {
 public:
  explicit ControlTangent(const Control& control);
  ~ControlTangent();

  // Moves to `time` with direction 0. Torques held by a sampled controller do not depend on the state.
  void go_to(System& system, double time);
  void update(const Parameters<Dual>& parameters);

  // Sets the direction of time for references and for accelerations along trajectories.
  void go_with_time(System& system, double time, std::vector<Dual>& force);

  // Adds the derivatives of the law with respect to q, qd and its own parameters to the directions of the
  // forces of the controlled joints. `force`: as System::recursion_inputs().
  void answer(const std::vector<Dual>& q, const std::vector<Dual>& qd, std::vector<Dual>& force);

  struct Reference {
    Dual q, qd, qdd;
  };
  Reference reference(int joint) const;  // of a controlled joint

 private:
  Reference wanted(std::size_t k) const;  // reference of joints_[k]

  const Law law_;
  const std::vector<int> joints_;     // controlled joints
  std::vector<char> follows_;         // per controlled joint: it follows a trajectory
  std::vector<int> on_trajectories_;  // joints that trajectories prescribe
  std::vector<ControlledJointOf<Dual>> gains_;
  std::vector<Reference> references_;
  bool holds_ = false;
  std::unique_ptr<InternalModel<Dual>> internal_model_;
};

}  // namespace redysim
