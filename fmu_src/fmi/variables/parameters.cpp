#include "fmi/variables/parameters.hpp"

#include <cmath>
#include <cstring>
#include <vector>

#include "model/read/number.hpp"
#include "model/read/suggest.hpp"
#include "model/solver_methods.hpp"

namespace redysim {

const ControlledJoint* controlled_joint(const Model& model, int link) {
  for (const ControlledJoint& joint : model.controller.joints)
    if (joint.link == link) return &joint;
  return nullptr;
}

double* parameter(Model& model, const Variable& variable) {
  Link* link = variable.link == ground ? nullptr : &model.links[variable.link];
  switch (variable.role) {
    case Role::ball_quaternion0:
      return &model.balls[variable.ball].quaternion[variable.element];
    case Role::ball_omega0:
      return &model.balls[variable.ball].omega[variable.element];
    case Role::q0:
      return &link->joint.q0;
    case Role::qd0:
      return &link->joint.qd0;
    case Role::damping:
      return &link->joint.damping;
    case Role::stiffness:
      return &link->joint.stiffness;
    case Role::rest:
      return &link->joint.rest;
    case Role::armature:
      return &link->joint.armature;
    case Role::friction:
      return &link->joint.friction;
    case Role::static_friction:
      return &link->joint.static_friction;
    case Role::friction_velocity:
      return &link->joint.friction_velocity;
    case Role::lower:
      return &link->joint.lower;
    case Role::upper:
      return &link->joint.upper;
    case Role::stop_stiffness:
      return &link->joint.stop_stiffness;
    case Role::stop_damping:
      return &link->joint.stop_damping;
    case Role::stop_width:
      return &link->joint.stop_width;
    case Role::kp:
    case Role::kd:
    case Role::target: {
      auto* joint = const_cast<ControlledJoint*>(controlled_joint(model, variable.link));
      return variable.role == Role::kp ? &joint->kp : variable.role == Role::kd ? &joint->kd : &joint->target;
    }
    case Role::mass:
      return &link->mass;
    case Role::com:
      return &link->com[variable.element];
    case Role::inertia:
      return &link->inertia[variable.element];
    case Role::gravity:
      return &model.gravity[variable.element];
    case Role::rtol:
      return &model.solver.rtol;
    case Role::atol:
      return &model.solver.atol;
    case Role::max_step:
      return &model.solver.max_step;
    default:
      return nullptr;
  }
}

double parameter(const Model& model, const Variable& variable) {
  return *parameter(const_cast<Model&>(model), variable);  // only read
}

const char* method_name(SolverMethod method) {
  for (const auto& [text, value] : solver_methods)
    if (value == method) return text;
  return solver_methods[0].first;
}

bool parse_method(const char* text, SolverMethod& method) {
  for (const auto& [legal, value] : solver_methods)
    if (std::strcmp(legal, text) == 0) {
      method = value;
      return true;
    }
  return false;
}

std::string method_names() {
  std::vector<std::string> names;
  for (const auto& [legal, value] : solver_methods) names.push_back(legal);
  return one_of(names);
}

std::string objection(const Variable& variable, double value) {
  if (!std::isfinite(value)) return variable.name + " must be a finite number, got " + shown(value);
  const std::string why = below(variable.min, value);
  if (!why.empty()) return variable.name + " " + why;
  if (value > variable.max)
    return variable.name + " must be <= " + shown(variable.max) + ", got " + shown(value);
  return {};
}

}  // namespace redysim
