#include "fmi/instance/derivatives.hpp"
#include "fmi/instance/values.hpp"
#include "fmi/variables/entry.hpp"
#include "fmi/variables/parameters.hpp"

// Tunable parameters of a joint with one DOF and of its controller.

namespace redysim {
namespace {

template <double Joint::*member>
double& of_joint(Model& model, const Variable& variable) {
  return model.links[variable.link].joint.*member;
}

template <double ControlledJoint::*member>
double& of_controller(Model& model, const Variable& variable) {
  return controlled_joint(model, variable.link)->*member;
}

bool is_controlled(const Scene& scene, const Variable& variable) {
  return controlled_joint(scene.model, variable.link) != nullptr;
}

// Springs and dampers of a moving joint.
template <Dual JointPlan<Dual>::*member>
void set_passive_direction(OutputDerivatives& of, const Variable& variable, double direction) {
  if (variable.joint < 0) return;
  for (Plan<Dual>* plan : of.tangent().plans()) {
    JointPlan<Dual>& joint = plan->joints[variable.joint];
    joint.has_passive_force = true;
    (joint.*member).derivative += direction;
  }
}

void set_armature_direction(OutputDerivatives& of, const Variable& variable, double direction) {
  if (variable.joint < 0) return;
  for (Plan<Dual>* plan : of.tangent().plans()) {
    JointPlan<Dual>& joint = plan->joints[variable.joint];
    joint.armature.derivative += direction;
    joint.axis_free = false;
  }
}

// Friction and stops; `change` sets the derivatives as the plan computes them from the joint's parameters.
template <class Change>
void change_resistance(OutputDerivatives& of, const Variable& variable, const Change& change) {
  if (variable.joint < 0) return;
  const Joint& given = of.model().links[variable.link].joint;
  for (Plan<Dual>* plan : of.tangent().plans()) {
    JointPlan<Dual>& joint = plan->joints[variable.joint];
    joint.has_passive_force = joint.has_resistance = joint.has_friction = true;
    joint.has_stops = has_stops(given);
    change(given, plan->resistances[variable.joint]);
  }
}

template <Dual Resistance<Dual>::*member>
void set_resistance_direction(OutputDerivatives& of, const Variable& variable, double direction) {
  change_resistance(of, variable, [direction](const Joint&, Resistance<Dual>& resistance) {
    (resistance.*member).derivative += direction;
  });
}

bool has_peak(const Joint& joint) { return joint.static_friction > joint.friction; }

void set_friction_direction(OutputDerivatives& of, const Variable& variable, double direction) {
  change_resistance(of, variable, [direction](const Joint& joint, Resistance<Dual>& resistance) {
    resistance.friction.derivative += direction;
    if (has_peak(joint)) resistance.excess.derivative -= direction;
  });
}

void set_static_friction_direction(OutputDerivatives& of, const Variable& variable, double direction) {
  change_resistance(of, variable, [direction](const Joint& joint, Resistance<Dual>& resistance) {
    if (has_peak(joint)) resistance.excess.derivative += direction;
  });
}

void set_friction_velocity_direction(OutputDerivatives& of, const Variable& variable, double direction) {
  change_resistance(of, variable, [direction](const Joint& joint, Resistance<Dual>& resistance) {
    resistance.per_velocity.derivative -= direction / (joint.friction_velocity * joint.friction_velocity);
  });
}

template <Dual ControlTangent::Gains::*member>
void set_gain_direction(OutputDerivatives& of, const Variable& variable, double direction) {
  (of.tangent().control()->gains(variable.joint)->*member).derivative += direction;
}

// Gains are forces per error; those of computed torque are accelerations per error.
template <const Unit& per_acceleration>
void measure_gain(const Model& model, const Variable&, Presentation& shown) {
  if (model.controller.law == Law::computed_torque) shown.quantity = {&per_acceleration, nullptr};
}

constexpr Quantity nameless(const Quantity& quantity) { return {quantity.unit, nullptr}; }

constexpr Entry parameter_entries[] = {
    parameter(Owner::joint, "damping")
        .bounds(Bounds::not_negative)
        .lives_at(of_joint<&Joint::damping>)
        .acts_on(acts::resistance)
        .direction(set_passive_direction<&JointPlan<Dual>::damping>)
        .measures(quantity::torsional_damping, quantity::linear_damping)
        .says("Viscous damping of %"),
    parameter(Owner::joint, "stiffness")
        .bounds(Bounds::not_negative)
        .lives_at(of_joint<&Joint::stiffness>)
        .acts_on(acts::potential)
        .direction(set_passive_direction<&JointPlan<Dual>::stiffness>)
        .measures(quantity::torsional_stiffness, quantity::linear_stiffness)
        .says("Spring stiffness of %"),
    parameter(Owner::joint, "rest")
        .lives_at(of_joint<&Joint::rest>)
        .acts_on(acts::potential)
        .direction(set_passive_direction<&JointPlan<Dual>::rest>)
        .measures(quantity::angle, quantity::position)
        .says("Angle of zero spring torque of %", "Displacement of zero spring force of %"),
    parameter(Owner::joint, "armature")
        .bounds(Bounds::not_negative)
        .lives_at(of_joint<&Joint::armature>)
        .acts_on(acts::armature)
        .direction(set_armature_direction)
        .measures(quantity::moment_of_inertia, quantity::mass)
        .says("Armature (reflected rotor inertia) of %", "Armature (reflected mass of the drive) of %"),
    parameter(Owner::joint, "friction")
        .bounds(Bounds::not_negative)
        .lives_at(of_joint<&Joint::friction>)
        .acts_on(acts::resistance)
        .direction(set_friction_direction)
        .measures(quantity::torque, quantity::force)
        .says("Sliding friction of %"),
    parameter(Owner::joint, "static_friction")
        .bounds(Bounds::not_negative)
        .lives_at(of_joint<&Joint::static_friction>)
        .acts_on(acts::resistance)
        .direction(set_static_friction_direction)
        .measures(quantity::torque, quantity::force)
        .says("Maximum friction of %"),
    parameter(Owner::joint, "friction_velocity")
        .bounds(Bounds::positive)
        .lives_at(of_joint<&Joint::friction_velocity>)
        .acts_on(acts::resistance)
        .direction(set_friction_velocity_direction)
        .measures(quantity::angular_velocity, quantity::velocity)
        .says("Velocity of maximum friction of %"),
    parameter(Owner::joint, "lower")
        .lives_at(of_joint<&Joint::lower>)
        .acts_on(acts::potential)
        .direction(set_resistance_direction<&Resistance<Dual>::lower>)
        .measures(quantity::angle, quantity::position)
        .says("Lower stop of %"),
    parameter(Owner::joint, "upper")
        .lives_at(of_joint<&Joint::upper>)
        .acts_on(acts::potential)
        .direction(set_resistance_direction<&Resistance<Dual>::upper>)
        .measures(quantity::angle, quantity::position)
        .says("Upper stop of %"),
    parameter(Owner::joint, "stop_stiffness")
        .bounds(Bounds::not_negative)
        .lives_at(of_joint<&Joint::stop_stiffness>)
        .acts_on(acts::potential)
        .direction(set_resistance_direction<&Resistance<Dual>::stiffness>)
        .measures(quantity::torsional_stiffness, quantity::linear_stiffness)
        .says("Stiffness of the stops of %"),
    parameter(Owner::joint, "stop_damping")
        .bounds(Bounds::not_negative)
        .lives_at(of_joint<&Joint::stop_damping>)
        .acts_on(acts::resistance)
        .direction(set_resistance_direction<&Resistance<Dual>::damping>)
        .measures({&units::second_per_radian, nullptr}, {&units::second_per_metre, nullptr})
        .says("Damping of the stops of %, relative increase of their force per velocity"),
    parameter(Owner::joint, "stop_width")
        .bounds(Bounds::positive)
        .lives_at(of_joint<&Joint::stop_width>)
        .acts_on(acts::potential)
        .direction(set_resistance_direction<&Resistance<Dual>::width>)
        .measures(quantity::angle, quantity::length)
        .says("Penetration depth at which the stops of % reach full stiffness"),
    parameter(Owner::joint, "kp")
        .there_if(is_controlled)
        .bounds(Bounds::not_negative)
        .lives_at(of_controller<&ControlledJoint::kp>)
        .acts_on(acts::gain)
        .direction(set_gain_direction<&ControlTangent::Gains::kp>)
        .measures(nameless(quantity::torsional_stiffness), nameless(quantity::linear_stiffness))
        .adapted(measure_gain<units::per_second2>)
        .says("Gain of the position error of %"),
    parameter(Owner::joint, "kd")
        .there_if(is_controlled)
        .bounds(Bounds::not_negative)
        .lives_at(of_controller<&ControlledJoint::kd>)
        .acts_on(acts::gain)
        .direction(set_gain_direction<&ControlTangent::Gains::kd>)
        .measures(nameless(quantity::torsional_damping), nameless(quantity::linear_damping))
        .adapted(measure_gain<units::per_second>)
        .says("Gain of the velocity error of %"),
    parameter(Owner::joint, "target")
        .there_if(is_controlled)
        .lives_at(of_controller<&ControlledJoint::target>)
        .acts_on(acts::target)
        .direction(set_gain_direction<&ControlTangent::Gains::target>)
        .measures(quantity::angle, quantity::position)
        .says("Target angle of %", "Target displacement of %"),
};

}  // namespace

const RowGroup JointParameters::rows = rows_in<parameter_entries>;
const WordGroup JointParameters::words = words_in<parameter_entries>;

}  // namespace redysim
