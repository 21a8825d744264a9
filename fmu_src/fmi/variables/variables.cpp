#include "fmi/variables/variables.hpp"

#include <map>
#include <set>
#include <utility>

#include "fmi/variables/parameters.hpp"
#include "model/loop_rows_of.hpp"
#include "model/read/model_error.hpp"
#include "model/read/number.hpp"

namespace redysim {
namespace {

struct RoleRow {
  Role role;
  const char* field;  // after "<joint>.", "<link>." or as the whole name
  VariableType type;
  Causality causality;
  Variability variability;
};

constexpr RoleRow role_rows[] = {
    {Role::tau, "tau", VariableType::real, Causality::input, Variability::continuous},
    {Role::q, "q", VariableType::real, Causality::output, Variability::continuous},
    {Role::qd, "qd", VariableType::real, Causality::output, Variability::continuous},
    {Role::qdd, "qdd", VariableType::real, Causality::output, Variability::continuous},
    {Role::motion_q, "q", VariableType::real, Causality::input, Variability::continuous},
    {Role::motion_qd, "qd", VariableType::real, Causality::input, Variability::continuous},
    {Role::motion_qdd, "qdd", VariableType::real, Causality::input, Variability::continuous},
    {Role::motion_tau, "tau", VariableType::real, Causality::output, Variability::continuous},
    {Role::reference_q, "q_ref", VariableType::real, Causality::output, Variability::continuous},
    {Role::reference_qd, "qd_ref", VariableType::real, Causality::output, Variability::continuous},
    {Role::frame_position, "position", VariableType::real, Causality::output, Variability::continuous},
    {Role::frame_quaternion, "quaternion", VariableType::real, Causality::output, Variability::continuous},
    {Role::frame_rotation, "rotation", VariableType::real, Causality::output, Variability::continuous},
    {Role::frame_velocity, "velocity", VariableType::real, Causality::output, Variability::continuous},
    {Role::frame_angular_velocity, "angular_velocity", VariableType::real, Causality::output,
     Variability::continuous},
    {Role::port_torque, "torque", VariableType::real, Causality::input, Variability::continuous},
    {Role::port_force, "force", VariableType::real, Causality::input, Variability::continuous},
    {Role::gap, "gap", VariableType::real, Causality::output, Variability::continuous},
    {Role::lambda, "lambda", VariableType::real, Causality::output, Variability::continuous},
    {Role::ball_tau, "tau", VariableType::real, Causality::input, Variability::continuous},
    {Role::ball_quaternion, "quaternion", VariableType::real, Causality::output, Variability::continuous},
    {Role::ball_omega, "omega", VariableType::real, Causality::output, Variability::continuous},
    {Role::ball_alpha, "alpha", VariableType::real, Causality::output, Variability::continuous},
    {Role::ball_angle, "angle", VariableType::real, Causality::output, Variability::continuous},
    {Role::ball_quaternion0, "quaternion0", VariableType::real, Causality::parameter, Variability::fixed},
    {Role::ball_omega0, "omega0", VariableType::real, Causality::parameter, Variability::fixed},
    {Role::linear_momentum, "momentum.linear", VariableType::real, Causality::output,
     Variability::continuous},
    {Role::angular_momentum, "momentum.angular", VariableType::real, Causality::output,
     Variability::continuous},
    {Role::q0, "q0", VariableType::real, Causality::parameter, Variability::fixed},
    {Role::qd0, "qd0", VariableType::real, Causality::parameter, Variability::fixed},
    {Role::damping, "damping", VariableType::real, Causality::parameter, Variability::tunable},
    {Role::stiffness, "stiffness", VariableType::real, Causality::parameter, Variability::tunable},
    {Role::rest, "rest", VariableType::real, Causality::parameter, Variability::tunable},
    {Role::armature, "armature", VariableType::real, Causality::parameter, Variability::tunable},
    {Role::friction, "friction", VariableType::real, Causality::parameter, Variability::tunable},
    {Role::static_friction, "static_friction", VariableType::real, Causality::parameter,
     Variability::tunable},
    {Role::friction_velocity, "friction_velocity", VariableType::real, Causality::parameter,
     Variability::tunable},
    {Role::lower, "lower", VariableType::real, Causality::parameter, Variability::tunable},
    {Role::upper, "upper", VariableType::real, Causality::parameter, Variability::tunable},
    {Role::stop_stiffness, "stop_stiffness", VariableType::real, Causality::parameter, Variability::tunable},
    {Role::stop_damping, "stop_damping", VariableType::real, Causality::parameter, Variability::tunable},
    {Role::stop_width, "stop_width", VariableType::real, Causality::parameter, Variability::tunable},
    {Role::kp, "kp", VariableType::real, Causality::parameter, Variability::tunable},
    {Role::kd, "kd", VariableType::real, Causality::parameter, Variability::tunable},
    {Role::target, "target", VariableType::real, Causality::parameter, Variability::tunable},
    {Role::mass, "mass", VariableType::real, Causality::parameter, Variability::tunable},
    {Role::com, "com", VariableType::real, Causality::parameter, Variability::tunable},
    {Role::inertia, "inertia", VariableType::real, Causality::parameter, Variability::tunable},
    {Role::gravity, "gravity", VariableType::real, Causality::parameter, Variability::tunable},
    {Role::rtol, "solver.rtol", VariableType::real, Causality::parameter, Variability::fixed},
    {Role::atol, "solver.atol", VariableType::real, Causality::parameter, Variability::fixed},
    {Role::max_step, "solver.max_step", VariableType::real, Causality::parameter, Variability::fixed},
    {Role::method, "solver.method", VariableType::string, Causality::parameter, Variability::fixed},
    {Role::kinetic_energy, "energy.kinetic", VariableType::real, Causality::output, Variability::continuous},
    {Role::potential_energy, "energy.potential", VariableType::real, Causality::output,
     Variability::continuous},
    {Role::total_energy, "energy.total", VariableType::real, Causality::output, Variability::continuous},
    {Role::work, "energy.work", VariableType::real, Causality::output, Variability::continuous},
    {Role::energy_balance, "energy.balance", VariableType::real, Causality::output, Variability::continuous},
    {Role::steps, "solver.steps", VariableType::integer, Causality::output, Variability::discrete},
    {Role::rejected, "solver.rejected", VariableType::integer, Causality::output, Variability::discrete},
    {Role::rhs_evaluations, "solver.rhs_evaluations", VariableType::integer, Causality::output,
     Variability::discrete},
    {Role::error_estimate, "solver.error_estimate", VariableType::real, Causality::output,
     Variability::discrete},
    {Role::active_method, "solver.active", VariableType::integer, Causality::output, Variability::discrete},
};

Variable make(Role role) {
  for (const RoleRow& row : role_rows)
    if (row.role == role) {
      Variable variable;
      variable.role = role;
      variable.name = row.field;
      variable.type = row.type;
      variable.causality = row.causality;
      variable.variability = row.variability;
      return variable;
    }
  return {};
}

bool has_trajectory(const Model& model, int link) {
  for (const Trajectory& trajectory : model.trajectories)
    if (trajectory.link == link) return true;
  return false;
}

// Which of its variables a joint shows: motion comes in where it is prescribed from outside, and the force
// goes out; so does that of a controller.
bool has(const Model& model, int link, Role role) {
  const Drive drive = model.links[link].joint.drive;
  const bool controlled = controlled_joint(model, link) != nullptr;
  const bool guided = drive == Drive::motion && has_trajectory(model, link);
  switch (role) {
    case Role::tau:
      return drive == Drive::torque && (!controlled || model.controller.input);
    case Role::motion_q:
    case Role::motion_qd:
    case Role::motion_qdd:
      return drive == Drive::motion && !guided;
    case Role::motion_tau:
      return drive == Drive::motion || drive == Drive::locked || controlled;
    case Role::reference_q:
    case Role::reference_qd:
      return controlled;
    case Role::q:
      return drive != Drive::motion || guided;
    case Role::q0:
      return drive != Drive::motion;
    case Role::qd:
    case Role::qdd:
      return (drive != Drive::motion || guided) && drive != Drive::locked;
    case Role::qd0:
      return drive != Drive::motion && drive != Drive::locked;
    default:
      return true;
  }
}

int elements(Role role) {
  return role == Role::inertia ? 6 : role == Role::com || role == Role::gravity ? 3 : 1;
}

bool is_of_controller(Role role) { return role == Role::kp || role == Role::kd || role == Role::target; }
bool is_of_joint(Role role) {
  return (role >= Role::damping && role <= Role::stop_width) || is_of_controller(role);
}

void set_bounds(Variable& variable) {
  switch (variable.role) {
    case Role::rtol:
      variable.min = minimum_positive;
      variable.max = 0.1;
      return;
    case Role::atol:
    case Role::max_step:
    case Role::mass:
    case Role::damping:
    case Role::stiffness:
    case Role::armature:
    case Role::friction:
    case Role::static_friction:
    case Role::stop_stiffness:
    case Role::stop_damping:
    case Role::kp:
    case Role::kd:
      variable.min = 0;
      return;
    case Role::gap:
    case Role::kinetic_energy:
    case Role::steps:
    case Role::rejected:
    case Role::rhs_evaluations:
    case Role::error_estimate:
    case Role::active_method:
      variable.min = 0;
      return;
    case Role::friction_velocity:
    case Role::stop_width:
      variable.min = minimum_positive;
      return;
    case Role::inertia:
      if (variable.element < 3) variable.min = 0;  // the moments; products have either sign
      return;
    default:
      return;
  }
}

// One parsed entry of model.fmu.tunable: "gravity[2]", "elbow.damping", "hand[1].damping", "link3.com".
struct Tunable {
  bool found = false;
  Role role = Role::gravity;
  int link = ground;
  int element = -1;  // -1: all
};

// Links by their own names and those of their joints.
struct LinkNames {
  explicit LinkNames(const Model& model) {
    for (std::size_t i = 0; i < model.links.size(); ++i) {
      links[model.links[i].name] = static_cast<int>(i);
      joints[model.links[i].joint.name] = static_cast<int>(i);
    }
  }
  std::map<std::string, int> links, joints;
};

// "elbow.damping": a parameter of a link, its joint or the joint's controller.
void find_parameter(const Model& model, const LinkNames& names, const std::string& name, Tunable& result) {
  const std::size_t dot = name.rfind('.');
  if (dot == std::string::npos) return;
  const std::string owner = name.substr(0, dot), field = name.substr(dot + 1);
  for (const RoleRow& row : role_rows) {
    if (!(is_of_joint(row.role) || is_of_link(row.role)) || row.field != field) continue;
    const std::map<std::string, int>& owners = is_of_joint(row.role) ? names.joints : names.links;
    const auto found = owners.find(owner);
    if (found == owners.end()) continue;
    if (is_of_controller(row.role) && !controlled_joint(model, found->second)) continue;
    result.found = true;
    result.role = row.role;
    result.link = found->second;
  }
}

Tunable parse_tunable(const Model& model, const LinkNames& names, const std::string& text) {
  Tunable result;
  std::string name = text;
  // the element in brackets at the end counts from 1
  const bool one = name.size() > 3 && name.back() == ']' && name[name.size() - 3] == '[';
  if (one) {
    result.element = name[name.size() - 2] - '1';
    name.resize(name.size() - 3);
  }
  if (name == "gravity")
    result.found = true;
  else
    find_parameter(model, names, name, result);
  const int count = elements(result.role);
  if (one && (count == 1 || result.element < 0 || result.element >= count)) result.found = false;
  return result;
}

}  // namespace

bool is_of_link(Role role) { return role == Role::mass || role == Role::com || role == Role::inertia; }

bool has_work(const Model& model, const Plan<double>& plan) {
  return model.fmu.energy && plan.prescribed_count < plan.nv;
}

VariableTable::VariableTable(const Model& model, const Plan<double>& plan) {
  for (Role role : {Role::tau, Role::motion_q, Role::motion_qd, Role::motion_qdd, Role::q, Role::qd})
    add_of_joints(model, plan, role);
  if (model.fmu.acceleration) add_of_joints(model, plan, Role::qdd);
  for (Role role : {Role::ball_tau, Role::ball_quaternion, Role::ball_omega}) add_of_balls(model, plan, role);
  if (model.fmu.acceleration) add_of_balls(model, plan, Role::ball_alpha);
  add_of_balls(model, plan, Role::ball_angle);

  add_of_joints(model, plan, Role::motion_tau);
  if (model.fmu.reference)
    for (Role role : {Role::reference_q, Role::reference_qd}) add_of_joints(model, plan, role);
  add_of_frames(model, plan);

  add_of_loops(model, plan);

  if (model.fmu.energy)
    for (Role role : {Role::kinetic_energy, Role::potential_energy, Role::total_energy}) add_of_model(role);
  if (model.fmu.momentum)
    for (Role role : {Role::linear_momentum, Role::angular_momentum}) add_array_of_model(role, 3);
  if (has_work(model, plan))
    for (Role role : {Role::work, Role::energy_balance}) add_of_model(role);
  if (model.fmu.solver)
    for (Role role : {Role::steps, Role::rejected, Role::rhs_evaluations, Role::error_estimate})
      add_of_model(role);
  if (model.fmu.solver && model.solver.method == SolverMethod::automatic) add_of_model(Role::active_method);

  add_of_joints(model, plan, Role::q0);
  add_of_joints(model, plan, Role::qd0);
  add_of_balls(model, plan, Role::ball_quaternion0);
  add_of_balls(model, plan, Role::ball_omega0);
  add_tunable(model, plan);
  for (Role role : {Role::method, Role::rtol, Role::atol, Role::max_step}) add_of_model(role);
}

void VariableTable::add(Variable variable) {
  std::vector<int>& index = variable.type == VariableType::real      ? reals_
                            : variable.type == VariableType::integer ? integers_
                                                                     : strings_;
  set_bounds(variable);
  variable.value_reference = static_cast<unsigned>(index.size());
  index.push_back(static_cast<int>(all_.size()));
  all_.push_back(std::move(variable));
}

void VariableTable::add_of_joints(const Model& model, const Plan<double>& plan, Role role) {
  for (std::size_t i = 0; i < plan.joints.size(); ++i) {
    Variable variable = make(role);
    variable.link = plan.joints[i].link;
    variable.joint = static_cast<int>(i);
    const Joint& joint = model.links[variable.link].joint;
    if (plan.joints[i].of_ball || !has(model, variable.link, role)) continue;
    if (role == Role::tau && controlled_joint(model, variable.link)) variable.name = "tau_added";
    variable.name = joint.name + "." + variable.name;
    add(std::move(variable));
  }
}

void VariableTable::add_of_balls(const Model& model, const Plan<double>& plan, Role role) {
  for (std::size_t k = 0; k < model.balls.size(); ++k) {
    const Ball& ball = model.balls[k];
    if (role == Role::ball_tau && !ball.driven) continue;
    const bool quaternion = role == Role::ball_quaternion || role == Role::ball_quaternion0;
    for (int i = 0; i < (quaternion ? 4 : 3); ++i) {
      Variable variable = make(role);
      variable.ball = static_cast<int>(k);
      variable.link = ball.chart_link;
      variable.joint = plan.balls[k];
      variable.element = i;
      variable.name = ball.name + "." + variable.name + "[" + std::to_string(i + 1) + "]";
      add(std::move(variable));
    }
  }
}

void VariableTable::add_array_of_model(Role role, int count) {
  for (int i = 0; i < count; ++i) {
    Variable variable = make(role);
    variable.element = i;
    variable.name += "[" + std::to_string(i + 1) + "]";
    add(std::move(variable));
  }
}

// <frame>.position[1] … on request, <frame>.torque[1] … and force[1] … where it is a port.
void VariableTable::add_of_frames(const Model& model, const Plan<double>& plan) {
  for (std::size_t k = 0; k < model.frames.size(); ++k) {
    const Frame& frame = model.frames[k];
    auto add_array = [&](bool wanted, Role role, int rows, int columns = 1) {
      for (int i = 0; wanted && i < rows * columns; ++i) {
        Variable variable = make(role);
        variable.frame = static_cast<int>(k);
        variable.link = frame.link;
        variable.joint = plan.carrier[frame.link];
        variable.element = i;
        const std::string index =
            columns == 1 ? std::to_string(i + 1)
                         : std::to_string(i / columns + 1) + "," + std::to_string(i % columns + 1);
        variable.name = frame.name + "." + variable.name + "[" + index + "]";
        add(std::move(variable));
      }
    };
    const bool port = frame.port != Frame::Port::none && plan.carrier[frame.link] != ground;
    add_array(port, Role::port_force, 3);
    add_array(port, Role::port_torque, 3);
    add_array(frame.pose, Role::frame_position, 3);
    add_array(frame.pose, Role::frame_quaternion, 4);
    add_array(frame.rotation_matrix, Role::frame_rotation, 3, 3);
    add_array(frame.velocity, Role::frame_velocity, 3);
    add_array(frame.velocity, Role::frame_angular_velocity, 3);
  }
}

// <loop>.gap and <loop>.lambda[1] …, in the model's order of loops.
void VariableTable::add_of_loops(const Model& model, const Plan<double>& plan) {
  for (std::size_t index = 0; index < model.loops.size(); ++index) {
    std::size_t k = 0;
    while (plan.loops[k].loop != static_cast<int>(index)) ++k;
    const LoopPlan<double>& loop = plan.loops[k];
    const auto add_to = [&](Variable variable, const std::string& ending) {
      variable.loop = static_cast<int>(index);
      variable.plan_loop = static_cast<int>(k);
      variable.joint = loop.body_a == ground ? loop.body_b : loop.body_a;
      variable.name = model.loops[index].name + "." + variable.name + ending;
      add(std::move(variable));
    };
    add_to(make(Role::gap), "");
    for (int i = 0; i < multiplier_count(model.loops[index]); ++i) {
      Variable variable = make(Role::lambda);
      variable.element = i;
      add_to(std::move(variable), "[" + std::to_string(i + 1) + "]");
    }
  }
}

void VariableTable::add_of_model(Role role) { add(make(role)); }

void VariableTable::add_tunable(const Model& model, const Plan<double>& plan) {
  const LinkNames names(model);
  std::vector<int> joint_of(model.links.size(), -1);
  for (std::size_t i = 0; i < plan.joints.size(); ++i) joint_of[plan.joints[i].link] = static_cast<int>(i);
  std::set<std::string> added;  // a list may name "arm.com" and "arm.com[1]"
  for (const std::string& name : model.fmu.tunable) {
    const Tunable tunable = parse_tunable(model, names, name);
    if (!tunable.found)
      throw ModelError(ModelError::Reason::invalid,
                       {{model.name, 0, 0, "tunable '" + name + "': the model has no such parameter"}});
    for (int element = 0; element < elements(tunable.role); ++element) {
      if (tunable.element >= 0 && element != tunable.element) continue;
      Variable variable = make(tunable.role);
      variable.link = tunable.link;
      variable.element = element;
      if (is_of_joint(tunable.role)) variable.joint = joint_of[tunable.link];
      if (tunable.role != Role::gravity) {
        const Link& link = model.links[tunable.link];
        variable.name = (is_of_joint(tunable.role) ? link.joint.name : link.name) + "." + variable.name;
      }
      if (elements(tunable.role) > 1) variable.name += "[" + std::to_string(element + 1) + "]";
      if (added.insert(variable.name).second) add(std::move(variable));
    }
  }
}

}  // namespace redysim
