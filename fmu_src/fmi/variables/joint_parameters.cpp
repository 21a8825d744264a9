#include "fmi/instance/derivatives.hpp"
#include "fmi/instance/values.hpp"
#include "fmi/variables/drive.hpp"
#include "fmi/variables/entry.hpp"
#include "fmi/variables/parameters.hpp"

// Tunable parameters of a joint with one DOF and of its controller.

namespace redysim {
namespace {

constexpr Unit volt_per_radian{"V/rad", 1, 2, -3, -1, nullptr, 1, -1};
constexpr Unit volt_second_per_radian{"V.s/rad", 1, 2, -2, -1, nullptr, 1, -1};
constexpr Unit volt_per_metre{"V/m", 1, 1, -3, 0, nullptr, 1, -1};
constexpr Unit volt_second_per_metre{"V.s/m", 1, 1, -2, 0, nullptr, 1, -1};

// Units of gains: force per error; acceleration per error for computed torque; voltage per error for DC
// motors.
template <const Unit& per_acceleration, const Unit& of_turning, const Unit& of_sliding>
void measure_gain(const Model& model, const Variable& v, Presentation& shown) {
  if (model.controller.law == Law::computed_torque) shown.quantity = {&per_acceleration, nullptr};
  const Actuator* actuator = actuator_of(model, v);
  if (actuator && actuator->is_electric())
    shown.quantity = {turns(joint_of(model, v)) ? &of_turning : &of_sliding, nullptr};
}

constexpr Quantity nameless(const Quantity& quantity) { return {quantity.unit, nullptr}; }

constexpr Entry parameter_entries[] = {
    parameter(Owner::joint, "damping")
        .bounds(Bounds::not_negative)
        .sets([](auto& at, const Variable& v) -> auto& { return at.joints[v.link].damping; })
        .acts_on(acts::resistance)
        .measures(quantity::torsional_damping, quantity::linear_damping)
        .says("Viscous damping of %"),
    parameter(Owner::joint, "stiffness")
        .bounds(Bounds::not_negative)
        .sets([](auto& at, const Variable& v) -> auto& { return at.joints[v.link].stiffness; })
        .acts_on(acts::potential)
        .measures(quantity::torsional_stiffness, quantity::linear_stiffness)
        .says("Spring stiffness of %"),
    parameter(Owner::joint, "rest")
        .sets([](auto& at, const Variable& v) -> auto& { return at.joints[v.link].rest; })
        .acts_on(acts::potential)
        .measures(quantity::angle, quantity::position)
        .says("Angle of zero spring torque of %", "Displacement of zero spring force of %"),
    parameter(Owner::joint, "armature")
        .bounds(Bounds::not_negative)
        .sets([](auto& at, const Variable& v) -> auto& { return at.joints[v.link].armature; })
        .acts_on(acts::armature)
        .measures(quantity::moment_of_inertia, quantity::mass)
        .says("Armature (reflected rotor inertia) of %", "Armature (reflected mass of the drive) of %"),
    parameter(Owner::joint, "friction")
        .bounds(Bounds::not_negative)
        .sets([](auto& at, const Variable& v) -> auto& { return at.joints[v.link].friction; })
        .acts_on(acts::resistance)
        .measures(quantity::torque, quantity::force)
        .says("Sliding friction of %"),
    parameter(Owner::joint, "static_friction")
        .bounds(Bounds::not_negative)
        .sets([](auto& at, const Variable& v) -> auto& { return at.joints[v.link].static_friction; })
        .acts_on(acts::resistance)
        .measures(quantity::torque, quantity::force)
        .says("Maximum friction of %"),
    parameter(Owner::joint, "friction_velocity")
        .bounds(Bounds::positive)
        .sets([](auto& at, const Variable& v) -> auto& { return at.joints[v.link].friction_velocity; })
        .acts_on(acts::resistance)
        .measures(quantity::angular_velocity, quantity::velocity)
        .says("Velocity of maximum friction of %"),
    parameter(Owner::joint, "lower")
        .sets([](auto& at, const Variable& v) -> auto& { return at.joints[v.link].lower; })
        .acts_on(acts::potential)
        .measures(quantity::angle, quantity::position)
        .says("Lower stop of %"),
    parameter(Owner::joint, "upper")
        .sets([](auto& at, const Variable& v) -> auto& { return at.joints[v.link].upper; })
        .acts_on(acts::potential)
        .measures(quantity::angle, quantity::position)
        .says("Upper stop of %"),
    parameter(Owner::joint, "stop_stiffness")
        .bounds(Bounds::not_negative)
        .sets([](auto& at, const Variable& v) -> auto& { return at.joints[v.link].stop_stiffness; })
        .acts_on(acts::potential)
        .measures(quantity::torsional_stiffness, quantity::linear_stiffness)
        .says("Stiffness of the stops of %"),
    parameter(Owner::joint, "stop_damping")
        .bounds(Bounds::not_negative)
        .sets([](auto& at, const Variable& v) -> auto& { return at.joints[v.link].stop_damping; })
        .acts_on(acts::resistance)
        .measures({&units::second_per_radian, nullptr}, {&units::second_per_metre, nullptr})
        .says("Damping of the stops of %, relative increase of their force per velocity"),
    parameter(Owner::joint, "stop_width")
        .bounds(Bounds::positive)
        .sets([](auto& at, const Variable& v) -> auto& { return at.joints[v.link].stop_width; })
        .acts_on(acts::potential)
        .measures(quantity::angle, quantity::length)
        .says("Penetration depth at which the stops of % reach full stiffness"),
    parameter(Owner::joint, "kp")
        .there_if(is_controlled)
        .bounds(Bounds::not_negative)
        .sets(
            [](auto& at, const Variable& v) -> auto& { return controlled_joint(at.controlled, v.link)->kp; })
        .acts_on(acts::gain)
        .measures(nameless(quantity::torsional_stiffness), nameless(quantity::linear_stiffness))
        .adapted(measure_gain<units::per_second2, volt_per_radian, volt_per_metre>)
        .says("Gain of the position error of %"),
    parameter(Owner::joint, "kd")
        .there_if(is_controlled)
        .bounds(Bounds::not_negative)
        .sets(
            [](auto& at, const Variable& v) -> auto& { return controlled_joint(at.controlled, v.link)->kd; })
        .acts_on(acts::gain)
        .measures(nameless(quantity::torsional_damping), nameless(quantity::linear_damping))
        .adapted(measure_gain<units::per_second, volt_second_per_radian, volt_second_per_metre>)
        .says("Gain of the velocity error of %"),
    parameter(Owner::joint, "target")
        .there_if(is_controlled)
        .sets([](auto& at, const Variable& v) -> auto& {
          return controlled_joint(at.controlled, v.link)->target;
        })
        .acts_on(acts::target)
        .measures(quantity::angle, quantity::position)
        .says("Target angle of %", "Target displacement of %"),
};

}  // namespace

const RowGroup JointParameterVariables::rows = rows_in<parameter_entries>;
const WordGroup JointParameterVariables::words = words_in<parameter_entries>;

}  // namespace redysim
