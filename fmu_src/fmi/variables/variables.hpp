#pragma once

#include <limits>
#include <string>
#include <vector>

#include "dynamics/plan.hpp"
#include "model/model.hpp"

// The one table of what the FMU shows of a model. The XML (through `describe`) and the running FMU are
// made from it, so they cannot differ.

namespace redysim {

enum class VariableType { real, integer, string };
enum class Causality { parameter, input, output };
enum class Variability { fixed, tunable, discrete, continuous };

// What a variable stands for.
enum class Role {
  tau,
  q,
  qd,
  qdd,  // of a moving joint
  motion_q,
  motion_qd,
  motion_qdd,
  motion_tau,  // of a joint whose motion is prescribed or whose torque is controlled
  reference_q,
  reference_qd,  // of a controlled joint
  frame_position,
  frame_quaternion,
  frame_rotation,
  frame_velocity,
  frame_angular_velocity,
  port_torque,
  port_force,  // of a frame
  gap,
  lambda,  // of a loop
  ball_tau,
  ball_quaternion,
  ball_omega,
  ball_alpha,
  ball_angle,
  ball_quaternion0,
  ball_omega0,  // of a spherical joint
  linear_momentum,
  angular_momentum,  // of all bodies
  q0,
  qd0,  // of a moving joint
  damping,
  stiffness,
  rest,
  armature,
  friction,
  static_friction,
  friction_velocity,
  lower,
  upper,
  stop_stiffness,
  stop_damping,
  stop_width,  // of a link's joint
  kp,
  kd,
  target,  // of a controlled joint
  mass,
  com,
  inertia,  // of a link
  gravity,  //
  rtol,
  atol,
  max_step,
  method,  // solver settings
  kinetic_energy,
  potential_energy,
  total_energy,
  work,
  energy_balance,  //
  steps,
  rejected,
  rhs_evaluations,
  error_estimate,
  active_method  // solver health
};

struct Variable {
  std::string name;
  VariableType type = VariableType::real;
  Causality causality = Causality::output;
  Variability variability = Variability::continuous;
  Role role = Role::q;
  int link = ground;             // index into Model::links; ground: of the whole model
  int joint = -1;                // index into Plan::joints; -1: not of a moving joint
  int frame = -1;                // index into Model::frames
  int ball = -1;                 // index into Model::balls
  int loop = -1;                 // index into Model::loops
  int plan_loop = -1;            // the same one in Plan::loops
  int element = 0;               // of com, inertia, gravity and the arrays of a frame or a loop
  unsigned value_reference = 0;  // unique in its type
  double min = -std::numeric_limits<double>::infinity();
  double max = std::numeric_limits<double>::infinity();
};

class VariableTable {
 public:
  // `plan` is the plan of `model`. Throws ModelError if a tunable parameter does not exist.
  VariableTable(const Model& model, const Plan<double>& plan);

  const std::vector<Variable>& all() const { return all_; }

  // The variable of a type with this value reference, or null.
  const Variable* real(unsigned reference) const { return find(reals_, reference); }
  const Variable* integer(unsigned reference) const { return find(integers_, reference); }
  const Variable* string(unsigned reference) const { return find(strings_, reference); }

 private:
  void add(Variable variable);
  void add_of_joints(const Model& model, const Plan<double>& plan, Role role);
  void add_of_model(Role role);
  void add_of_balls(const Model& model, const Plan<double>& plan, Role role);
  void add_array_of_model(Role role, int count);
  void add_of_frames(const Model& model, const Plan<double>& plan);
  void add_of_loops(const Model& model, const Plan<double>& plan);
  void add_tunable(const Model& model, const Plan<double>& plan);
  const Variable* find(const std::vector<int>& index, unsigned reference) const {
    return reference < index.size() ? &all_[index[reference]] : nullptr;
  }

  std::vector<Variable> all_;
  std::vector<int> reals_, integers_, strings_;  // value reference -> index into all_
};

// A parameter of a link's body: mass, com or inertia.
bool is_of_link(Role role);

// Whether the work of drives and dampers is integrated: energies are shown and something is integrated.
bool has_work(const Model& model, const Plan<double>& plan);

}  // namespace redysim
