#pragma once

#include <memory>
#include <vector>

#include "dynamics/plan.hpp"
#include "dynamics/workspace.hpp"
#include "integrate/system/reference.hpp"
#include "model/model.hpp"

namespace redysim {

// A model whose controlled joints are prescribed: the plant that a controller knows.
Model with_controlled_motions(Model model);

// Trajectories of prescribed joints and the law that drives the controlled ones, at any time and state. What
// it remembers is the phase of each trajectory, which its owner keeps as numbers among the inputs.
// Neither throws nor allocates after construction.
class Control {
 public:
  Control(const Model& model, const Plan<double>& plan);
  ~Control();

  // Takes over changed gains, targets and parameters of the controller's own model.
  void update(const Model& model);

  // Phases, one number a trajectory. `enter` sets those of a time and tells whether one changed.
  std::size_t phase_count() const { return trajectories_.size(); }
  bool enter(double time, double* phases) const;
  double next_border(double time,
                     const double* phases) const;  // the first end of a phase or point of a table

  bool prescribes(int joint) const { return trajectory_of_[joint] >= 0 && prescribed_[joint] != 0; }
  bool controls(int joint) const;
  bool follows(int joint) const { return trajectory_of_[joint] >= 0; }  // a trajectory
  int joint_count() const { return static_cast<int>(trajectory_of_.size()); }
  Law law() const { return law_; }

  // q, qd of the joints that a trajectory prescribes.
  void set_motions(double time, const double* phases, double* q, double* qd) const;

  // What the recursion takes: qdd of the joints that a trajectory prescribes in their places of `inputs`, and
  // the law's torques added to those of the controlled joints. `q`, `qd`: of all joints.
  void apply(double time, const double* phases, const double* q, const double* qd, double* inputs);

  // The reference of a controlled joint.
  JointMotion reference(int joint, double time, const double* phases) const;
  double jerk(int joint, double time, const double* phases) const;  // along its trajectory

  // The columns of `dynamics/derivatives.hpp` at held torques become those of the controlled plant:
  // d qdd += d qdd / d tau . d tau, with exact gains and, for the laws that hold a model, differences.
  // `variables` as there, followed by the forces of joints(); columns nv + 1 apart.
  // What `inputs` holds for the controlled joints does not matter.
  const std::vector<int>& joints() const { return joints_; }  // the controlled ones
  void close(double time, const double* phases, const double* q, const double* qd, const double* inputs,
             const std::vector<int>& variables, double* columns);

 private:
  void model_torques(double time, const double* phases, const double* q, const double* qd,
                     const double* inputs, double* tau);
  void computed_torque(double time, const double* phases, const double* q, const double* qd,
                       const double* inputs, double* tau);

  Law law_;
  std::vector<Trajectory> trajectories_;
  std::vector<int> trajectory_of_;  // per joint: index of its trajectory or -1
  std::vector<char> prescribed_;    // per joint
  std::vector<int> joints_;         // the controlled ones, as in the model's order
  std::vector<ControlledJoint> gains_;

  // the controller's own model, for laws that have one
  struct Twin;
  std::unique_ptr<Twin> twin_;
};

}  // namespace redysim
