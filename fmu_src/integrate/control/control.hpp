#pragma once

#include <memory>
#include <vector>

#include "dynamics/derivatives.hpp"
#include "dynamics/plan.hpp"
#include "dynamics/workspace.hpp"
#include "integrate/control/reference.hpp"
#include "integrate/control/sampler.hpp"
#include "model/parameters.hpp"

namespace redysim {

template <class Scalar>
struct InternalModel;

// Trajectories of prescribed joints and the law that drives the controlled ones, at any time and state. Its
// memory, which its owner keeps among the inputs, is the phase of each trajectory and that of the Sampler.
// Neither throws nor allocates after construction.
class Control {
 public:
  Control(const Model& model, const Plan<double>& plan);
  ~Control();

  // Updates gains, targets and the parameters of the controller's own model.
  void update(const Parameters<double>& parameters);

  // Phases, one number a trajectory, then the memory of the sampler. `enter` sets the phases at `time` and
  // returns whether one changed.
  std::size_t memory_size() const { return trajectories_.size() + sampler_.memory_size(); }
  bool enter(double time, double* phases) const;
  // Sampled control: takes the sample that is due at `time`, and lets the torques that are due act. Returns
  // whether the torques changed. `inputs`: as of `apply`, which are changed.
  bool is_sampled() const { return sampler_.is_active(); }
  bool holds(const double* phases) const { return sampler_.holds(phases + trajectories_.size()); }
  bool enter_samples(double time, double* phases, const double* q, const double* qd, double* inputs);
  // Of all trajectories; and their first knot, sample or arrival of torques after `time`, s.
  StepLimits step_limits(double time, const double* phases) const;
  double next_breakpoint(double time, const double* phases) const;

  bool prescribes(int joint) const { return trajectory_of_[joint] >= 0 && prescribed_[joint] != 0; }
  bool controls(int joint) const;
  bool follows(int joint) const { return trajectory_of_[joint] >= 0; }  // a trajectory
  int joint_count() const { return static_cast<int>(trajectory_of_.size()); }
  Law law() const { return law_; }

  // q, qd of the joints that a trajectory prescribes.
  void set_motions(double time, const double* phases, double* q, double* qd) const;

  // Their constant accelerations that lead in `h` s to where the trajectories do, into qdd.
  void set_mean_accelerations(double time, double h, const double* phases, double* qdd) const;

  // Changes the inputs of the recursion: sets qdd of the joints that a trajectory prescribes and adds the
  // torques of the law to those of the controlled joints. `q`, `qd`: of all joints.
  void apply(double time, const double* phases, const double* q, const double* qd, double* inputs);

  const Plan<double>* internal_plan() const;  // null: the law has no model of the plant
  // The reference of a controlled joint.
  JointMotion reference(int joint, double time, const double* phases) const;
  double jerk(int joint, double time, const double* phases) const;  // along its trajectory

  // The columns of `dynamics/derivatives.hpp` at held torques become those of the controlled plant:
  // d qdd += d qdd / d tau . d tau, with exact gains and, for the laws that hold a model, differences.
  // `variables` as there, the last ones are the forces of joints(); columns are `length` apart. The entries
  // of `inputs` for the controlled joints do not matter.
  const std::vector<int>& joints() const { return joints_; }  // the controlled ones
  void add_feedback(double time, const double* phases, const double* q, const double* qd,
                    const double* inputs, const std::vector<JointVariable>& variables, double* columns,
                    std::size_t length);

 private:
  void set_accelerations(double time, const double* phases, double* inputs) const;
  void add_law(double time, const double* phases, const double* q, const double* qd, double* inputs);
  // What the law adds to PD control, or uses instead of it.
  void model_torques(double time, const double* phases, const double* q, const double* qd,
                     const double* inputs, double* torques);
  void add_gains(const std::vector<JointVariable>& variables, double* columns, std::size_t length) const;

  Law law_;
  std::vector<Trajectory> trajectories_;
  std::vector<int> trajectory_of_;  // per joint: index of its trajectory or -1
  std::vector<char> prescribed_;    // per joint
  std::vector<int> joints_;         // the controlled ones, as in the model's order
  std::vector<ControlledJoint> gains_;
  Sampler sampler_;
  std::vector<double> sampled_;  // torques of joints_

  std::unique_ptr<InternalModel<double>> internal_model_;  // of laws that have one
  struct Changed {
    std::vector<double> q, qd, inputs, torques;
    double& value(JointVariable variable);
  } changed_;  // for differences of that model
};

}  // namespace redysim
