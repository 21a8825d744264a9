#pragma once

#include <memory>
#include <vector>

#include "integrate/system/system.hpp"
#include "math/dual.hpp"

namespace redysim {

// The law of a controller and the trajectories of a System at one point with one direction of change: the
// part of Tangent that scenes with neither do without. The equations are those of Control.
class ControlTangent {
 public:
  ControlTangent(const Model& model, const Control& control);
  ~ControlTangent();

  // Goes to `time` with no direction; parameters of `model`. Directions of parameters are then set by the
  // caller.
  void go_to(const Model& model, System& system, double time);
  struct Gains {
    Dual kp, kd, target;
  };
  Gains* gains(int joint);  // null: not controlled
  Plan<Dual>* plan();       // of the controller's own model; null: it has none

  // The direction is time: references and accelerations along trajectories go on.
  void go_with_time(System& system, double time, std::vector<Dual>& force);

  // Adds to the directions of the controlled joints' forces what the law answers to q, qd and its own
  // parameters. `force`: as System::forces(), those of the other joints as they are.
  void answer(const std::vector<Dual>& q, const std::vector<Dual>& qd, std::vector<Dual>& force);

  // The reference of a controlled joint.
  Dual reference_q(int joint) const;
  Dual reference_qd(int joint) const;

 private:
  struct Reference {
    Dual q, qd, qdd;
  };
  struct Twin;
  std::size_t place(int joint) const;
  Reference reference(std::size_t k) const;
  std::vector<Dual> model_forces(const std::vector<Dual>& q, const std::vector<Dual>& qd,
                                 const std::vector<Dual>& force);

  const Law law_;
  const std::vector<int> joints_;     // the controlled ones
  std::vector<char> follows_;         // per place: a trajectory
  std::vector<int> on_trajectories_;  // joints that trajectories prescribe
  std::vector<Gains> gains_;
  std::vector<Reference> references_;
  std::unique_ptr<Twin> twin_;
};

}  // namespace redysim
