#include "fmi/instance/derivatives.hpp"
#include "fmi/instance/values.hpp"
#include "fmi/variables/drive.hpp"
#include "fmi/variables/entry.hpp"
#include "fmi/variables/parameters.hpp"
#include "integrate/system/control_tangent.hpp"

// Variables of a joint with one DOF: motion, drive and start. Parameters: joint_parameters.cpp.

namespace redysim {
namespace {

// Whether inputs prescribe the motion, not a trajectory.
bool takes_motion(const Scene& scene, const Variable& variable) {
  if (joint_of(scene.model, variable).drive != Drive::motion) return false;
  for (const Trajectory& trajectory : scene.model.trajectories)
    if (trajectory.link == variable.link) return false;
  return true;
}

bool has_voltage_input(const Scene& scene, const Variable& variable) {
  return takes_voltage(scene, variable) && (!is_controlled(scene, variable) || scene.model.controller.input);
}

bool shows_voltage(const Scene& scene, const Variable& variable) {
  return takes_voltage(scene, variable) && is_controlled(scene, variable);
}

bool takes_force(const Scene& scene, const Variable& variable) {
  return joint_of(scene.model, variable).drive == Drive::torque && !takes_voltage(scene, variable) &&
         (!is_controlled(scene, variable) || scene.model.controller.input);
}

bool shows_position(const Scene& scene, const Variable& variable) { return !takes_motion(scene, variable); }

bool shows_velocity(const Scene& scene, const Variable& variable) {
  return !takes_motion(scene, variable) && joint_of(scene.model, variable).drive != Drive::locked;
}

bool shows_force(const Scene& scene, const Variable& variable) {
  const Drive drive = joint_of(scene.model, variable).drive;
  if (ends_at_joint(scene, variable)) return false;
  return drive == Drive::motion || drive == Drive::locked ||
         (is_controlled(scene, variable) && !takes_voltage(scene, variable));
}

bool has_drive(const Scene& scene, const Variable& variable) {
  const Drive drive = joint_of(scene.model, variable).drive;
  return drive == Drive::torque || drive == Drive::motion;
}

bool starts_with_position(const Scene& scene, const Variable& variable) {
  return joint_of(scene.model, variable).drive != Drive::motion;
}

bool starts_with_velocity(const Scene& scene, const Variable& variable) {
  return starts_with_position(scene, variable) && joint_of(scene.model, variable).drive != Drive::locked;
}

double read_position(Values& at, const Variable& v) { return at.coordinates().q[v.joint]; }
double read_velocity(Values& at, const Variable& v) { return at.coordinates().qd[v.joint]; }
double read_acceleration(Values& at, const Variable& v) { return at.acceleration(v.joint); }

double start_position(const Model& model, const Variable& v) { return joint_of(model, v).q0; }
double start_velocity(const Model& model, const Variable& v) { return joint_of(model, v).qd0; }

void explain_drive(const Model& model, const Variable& variable, Presentation& shown) {
  if (controlled_joint(model.controller.joints, variable.link))
    shown.description += ", added to the controller's";
}

void explain_force(const Model& model, const Variable& variable, Presentation& shown) {
  const Drive drive = joint_of(model, variable).drive;
  if (drive == Drive::motion) shown.description += " for the prescribed motion";
  if (drive == Drive::locked) shown.description.replace(0, 5, "Holding").append(" (locked)");
}

// Whether the drive force is computed from accelerations or the state; otherwise it is an input.
bool force_follows(const Variable& variable, const Components& components) {
  return components.plan().joints[variable.joint].prescribed ||
         controlled_joint(components.model().controller.joints, variable.link) != nullptr;
}

bool is_own_force(const Variable& unknown, const Variable& known) {
  return known.row->storage == Storage::input && known.row->owner == Owner::joint &&
         known.joint == unknown.joint;
}

bool power_at_point(const Variable& unknown, const Variable& known, const Components& components) {
  if (force_follows(unknown, components)) return at_point::accelerations(unknown, known, components);
  return at_point::jumps(unknown, known, components) || is_own_force(unknown, known);
}

// The parameters of an actuator also affect its torque.
bool power_at_start(const Variable& unknown, const Variable& known, const Components& components) {
  if (force_follows(unknown, components) || actuator_of(components.model(), unknown))
    return initially::accelerations(unknown, known, components);
  return initially::velocity(unknown, known, components) || is_own_force(unknown, known);
}

// Derivative of Values::drive_input.
double input_derivative(OutputDerivatives& of, const Variable& v) {
  const Actuators* actuators = of.values().system().actuators();
  const int index = actuators ? actuators->at(v.joint) : -1;
  return (index < 0 ? of.tangent().drive[v.joint] : of.tangent().actuator_input(index)).derivative;
}

constexpr Entry acceleration_entry = output(Owner::joint, "qdd")
                                         .in(OutputGroup::acceleration)
                                         .there_if(shows_velocity)
                                         .slope_of(StatePart::qd)
                                         .reads(read_acceleration, Needs::accelerations)
                                         .derivative([](OutputDerivatives& of, const Variable& v) {
                                           return of.tangent().qdd[v.joint].derivative;
                                         })
                                         .depends(at_point::accelerations, initially::accelerations)
                                         .measures(quantity::angular_acceleration, quantity::acceleration)
                                         .says("Angular acceleration of %", "Acceleration of %");

constexpr Entry motion_entries[] = {
    input(Owner::joint, "tau")
        .adds_to_controller()
        .there_if(takes_force)
        .input_at([](const System& system, const Variable& v) { return system.input_layout().tau[v.joint]; })
        .measures(quantity::torque, quantity::force)
        .says("Drive torque of %", "Drive force of %")
        .adapted(explain_drive),
    input(Owner::joint, "voltage")
        .adds_to_controller()
        .there_if(has_voltage_input)
        .input_at([](const System& system, const Variable& v) { return system.input_layout().tau[v.joint]; })
        .measures(quantity::voltage)
        .says("Voltage of the motor of %")
        .adapted(explain_drive),
    input(Owner::joint, "q")
        .there_if(takes_motion)
        .motion(0)
        .acts_on(acts::position)
        .starts_at(start_position)
        .measures(quantity::angle, quantity::position)
        .says("Prescribed angle of %", "Prescribed displacement of %"),
    input(Owner::joint, "qd")
        .there_if(takes_motion)
        .motion(1)
        .acts_on(acts::velocity)
        .starts_at(start_velocity)
        .measures(quantity::angular_velocity, quantity::velocity)
        .says("Prescribed angular velocity of %", "Prescribed velocity of %"),
    input(Owner::joint, "qdd")
        .there_if(takes_motion)
        .motion(2)
        .acts_on(acts::force)
        .measures(quantity::angular_acceleration, quantity::acceleration)
        .says("Prescribed angular acceleration of %", "Prescribed acceleration of %"),
    output(Owner::joint, "q")
        .there_if(shows_position)
        .is_state(StatePart::q)
        .reads(read_position)
        .derivative(
            [](OutputDerivatives& of, const Variable& v) { return of.tangent().q[v.joint].derivative; })
        .rate_is_next()
        .depends(at_point::jumps, initially::position)
        .constant(ConstantFactor::unless_assembled)
        .measures(quantity::angle, quantity::position)
        .says("Angle of %", "Displacement of %"),
    output(Owner::joint, "qd")
        .there_if(shows_velocity)
        .is_state(StatePart::qd)
        .slope_of(StatePart::q)
        .reads(read_velocity)
        .derivative(
            [](OutputDerivatives& of, const Variable& v) { return of.tangent().qd[v.joint].derivative; })
        .rate_is_next()
        .depends(at_point::jumps, initially::velocity)
        .constant(ConstantFactor::unless_assembled)
        .measures(quantity::angular_velocity, quantity::velocity)
        .says("Angular velocity of %", "Velocity of %"),
    acceleration_entry,
};

bool is_integrated(const Scene& scene, const Variable& variable) {
  return !scene.plan.joints[variable.joint].prescribed && !scene.is_in_cluster(variable.joint);
}

constexpr Entry slope_entries[] = {acceleration_entry.local().there_if(is_integrated)};

constexpr Entry force_entries[] = {
    output(Owner::joint, "tau")
        .there_if(shows_force)
        .reads([](Values& at, const Variable& v) { return at.drive_input(v.joint); }, Needs::accelerations)
        .derivative(input_derivative)
        .depends(at_point::accelerations, initially::accelerations)
        .measures(quantity::torque, quantity::force)
        .says("Drive torque of %", "Drive force of %")
        .adapted(explain_force),
    output(Owner::joint, "voltage")
        .there_if(shows_voltage)
        .reads([](Values& at, const Variable& v) { return at.drive_input(v.joint); }, Needs::accelerations)
        .derivative(input_derivative)
        .depends(at_point::accelerations, initially::accelerations)
        .measures(quantity::voltage)
        .says("Voltage of the motor of %"),
    output(Owner::joint, "q_ref")
        .in(OutputGroup::reference)
        .there_if(is_controlled)
        .reads([](Values& at, const Variable& v) { return at.reference(v.joint).q; }, Needs::parameters)
        .derivative([](OutputDerivatives& of, const Variable& v) {
          return of.tangent().control()->reference(v.joint).q.derivative;
        })
        .depends(nullptr, initially::target)
        .constant(ConstantFactor::always)
        .measures(quantity::angle, quantity::position)
        .says("Reference angle of %", "Reference displacement of %"),
    output(Owner::joint, "qd_ref")
        .in(OutputGroup::reference)
        .there_if(is_controlled)
        .reads([](Values& at, const Variable& v) { return at.reference(v.joint).qd; })
        .derivative([](OutputDerivatives& of, const Variable& v) {
          return of.tangent().control()->reference(v.joint).qd.derivative;
        })
        .measures(quantity::angular_velocity, quantity::velocity)
        .says("Reference angular velocity of %", "Reference velocity of %"),
    output(Owner::joint, "power")
        .in(OutputGroup::power)
        .there_if(has_drive)
        .reads([](Values& at,
                  const Variable& v) { return at.drive_force(v.joint) * at.coordinates().qd[v.joint]; },
               Needs::accelerations)
        .derivative([](OutputDerivatives& of, const Variable& v) {
          const Tangent& at = of.tangent();
          return (at.drive[v.joint] * at.qd[v.joint]).derivative;
        })
        .depends(power_at_point, power_at_start)
        .measures(quantity::power)
        .says("Power of the drive torque of %, friction not included",
              "Power of the drive force of %, friction not included"),
};

constexpr Entry start_entries[] = {
    parameter(Owner::joint, "q0")
        .fixed()
        .there_if(starts_with_position)
        .sets([](auto& at, const Variable& v) -> auto& { return at.joints[v.link].q0; })
        .acts_on(acts::position)
        .measures(quantity::angle, quantity::position)
        .says("Start angle of %", "Start displacement of %"),
    parameter(Owner::joint, "qd0")
        .fixed()
        .there_if(starts_with_velocity)
        .sets([](auto& at, const Variable& v) -> auto& { return at.joints[v.link].qd0; })
        .acts_on(acts::velocity)
        .measures(quantity::angular_velocity, quantity::velocity)
        .says("Start angular velocity of %", "Start velocity of %"),
};

}  // namespace

const RowGroup JointMotionVariables::rows = rows_in<motion_entries>;
const WordGroup JointMotionVariables::words = words_in<motion_entries>;
const RowGroup JointSlopes::rows = rows_in<slope_entries>;
const WordGroup JointSlopes::words = words_in<slope_entries>;
const RowGroup JointDriveVariables::rows = rows_in<force_entries>;
const WordGroup JointDriveVariables::words = words_in<force_entries>;
const RowGroup JointStartValues::rows = rows_in<start_entries>;
const WordGroup JointStartValues::words = words_in<start_entries>;

}  // namespace redysim
