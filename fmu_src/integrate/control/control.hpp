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

// Trajectories of prescribed joints and the law of the controlled joints, at any time and state. Its memory
// consists of the phase of each trajectory and the memory of the Sampler; its owner stores it with the
// inputs. Neither throws nor allocates after construction.
class Control {
 public:
  Control(const Model& model, const Plan<double>& plan);
  ~Control();

  // Updates gains, targets and the parameters of the controller's own model.
  void update(const Parameters<double>& parameters);

  // Memory: one phase per trajectory, then the memory of the sampler. `enter` sets the phases at `time` and
  // returns whether one changed.
  std::size_t memory_size() const { return trajectories_.size() + sampler_.memory_size(); }
  bool enter(double time, double* phases) const;
  // Sampled control: takes the sample due at `time` and activates the torques that are due. Returns whether
  // the torques changed. `inputs`: as for `apply`; they are overwritten.
  bool is_sampled() const { return sampler_.is_active(); }
  bool holds(const double* phases) const { return sampler_.holds(phases + trajectories_.size()); }
  bool enter_samples(double time, double* phases, const double* q, const double* qd, double* inputs);
  // Step limits of all trajectories. Next breakpoint after `time`, s: a knot, a sample or an arrival of
  // torques.
  StepLimits step_limits(double time, const double* phases) const;
  double next_breakpoint(double time, const double* phases) const;

  bool prescribes(int joint) const { return trajectory_of_[joint] >= 0 && prescribed_[joint] != 0; }
  bool controls(int joint) const;
  bool follows(int joint) const { return trajectory_of_[joint] >= 0; }  // it has a trajectory
  int joint_count() const { return static_cast<int>(trajectory_of_.size()); }
  Law law() const { return law_; }

  // Sets q, qd of the joints prescribed by trajectories.
  void set_motions(double time, const double* phases, double* q, double* qd) const;

  // Sets their qdd to the constant accelerations that lead to the trajectories' positions after `h` s.
  void set_mean_accelerations(double time, double h, const double* phases, double* qdd) const;

  // Changes the inputs of the recursion: sets qdd of the joints prescribed by trajectories and adds the
  // torques of the law for the controlled joints. `q`, `qd`: of all joints.
  void apply(double time, const double* phases, const double* q, const double* qd, double* inputs);

  const Plan<double>* internal_plan() const;  // null: the law has no model of the plant
  // The reference of a controlled joint.
  JointMotion reference(int joint, double time, const double* phases) const;
  double jerk(int joint, double time, const double* phases) const;  // of its trajectory; 0: it has none

  // Replaces the columns of `dynamics/derivatives.hpp` at held torques by those of the controlled plant: d
  // qdd += d qdd / d tau . d tau, with exact gains; laws with an internal model use differences. `variables`
  // as there, the last ones are the forces of joints(); columns are `length` apart. The entries of `inputs`
  // for the controlled joints are ignored.
  const std::vector<int>& joints() const { return joints_; }  // the controlled joints
  void add_feedback(double time, const double* phases, const double* q, const double* qd,
                    const double* inputs, const std::vector<JointVariable>& variables, double* columns,
                    std::size_t length);

 private:
  void set_accelerations(double time, const double* phases, double* inputs) const;
  void add_law(double time, const double* phases, const double* q, const double* qd, double* inputs);
  // Torques of the internal model: added to PD control, or used instead of it.
  void model_torques(double time, const double* phases, const double* q, const double* qd,
                     const double* inputs, double* torques);
  void add_gains(const std::vector<JointVariable>& variables, double* columns, std::size_t length) const;

  Law law_;
  std::vector<Trajectory> trajectories_;
  std::vector<int> trajectory_of_;  // per joint: index of its trajectory or -1
  std::vector<char> prescribed_;    // per joint
  std::vector<int> joints_;         // controlled joints, in the model's order
  std::vector<ControlledJoint> gains_;
  Sampler sampler_;
  std::vector<double> sampled_;  // torques of joints_ in a sample

  std::unique_ptr<InternalModel<double>> internal_model_;  // null: the law has none
  struct Changed {
    std::vector<double> q, qd, inputs, torques;
    double& value(JointVariable variable);
  } changed_;  // for differences of the internal model
};

}  // namespace redysim
