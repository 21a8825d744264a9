#include "fmi/variables/presentation.hpp"

#include "fmi/variables/parameters.hpp"

namespace redysim {
namespace {

constexpr double degrees = 57.295779513082323;  // per radian

constexpr Unit radian{"rad", 0, 0, 0, 1, "deg", degrees};
constexpr Unit radian_per_second{"rad/s", 0, 0, -1, 1, "deg/s", degrees};
constexpr Unit radian_per_second2{"rad/s2", 0, 0, -2, 1, "deg/s2", degrees};
constexpr Unit metre{"m", 0, 1, 0, 0};
constexpr Unit metre_per_second{"m/s", 0, 1, -1, 0};
constexpr Unit metre_per_second2{"m/s2", 0, 1, -2, 0};
constexpr Unit newton_metre{"N.m", 1, 2, -2, 0};
constexpr Unit newton{"N", 1, 1, -2, 0};
constexpr Unit torsional_stiffness{"N.m/rad", 1, 2, -2, -1};
constexpr Unit torsional_damping{"N.m.s/rad", 1, 2, -1, -1};
constexpr Unit linear_stiffness{"N/m", 1, 0, -2, 0};
constexpr Unit linear_damping{"N.s/m", 1, 0, -1, 0};
constexpr Unit kilogram{"kg", 1, 0, 0, 0};
constexpr Unit kilogram_metre2{"kg.m2", 1, 2, 0, 0};
constexpr Unit joule{"J", 1, 2, -2, 0};
constexpr Unit newton_second{"N.s", 1, 1, -1, 0};
constexpr Unit newton_metre_second{"N.m.s", 1, 2, -1, 0};
constexpr Unit per_second{"1/s", 0, 0, -1, 0};
constexpr Unit per_second2{"1/s2", 0, 0, -2, 0};
constexpr Unit second{"s", 0, 0, 1, 0};
constexpr Unit second_per_radian{"s/rad", 0, 0, 1, -1};
constexpr Unit second_per_metre{"s/m", 0, -1, 1, 0};

constexpr const char* axes[] = {"x", "y", "z"};
constexpr const char* quaternion_components[] = {"w", "x", "y", "z"};
constexpr const char* inertia_entries[] = {"Ixx", "Iyy", "Izz", "Ixy", "Ixz", "Iyz"};

Presentation of_joint(const Joint& joint, Role role) {
  const bool turns = redysim::turns(joint);
  const std::string at = " of joint '" + joint.name + "'";
  switch (role) {
    case Role::reference_q:
    case Role::target:
      return turns ? Presentation{&radian, "Angle",
                                  (role == Role::target ? "Target angle" : "Reference angle") + at}
                   : Presentation{
                         &metre, "Position",
                         (role == Role::target ? "Target displacement" : "Reference displacement") + at};
    case Role::reference_qd:
      return turns ? Presentation{&radian_per_second, "AngularVelocity", "Reference angular velocity" + at}
                   : Presentation{&metre_per_second, "Velocity", "Reference velocity" + at};
    case Role::tau:
    case Role::motion_tau: {
      const std::string what = turns ? "torque" : "force";
      const std::string text = role == Role::tau || joint.drive == Drive::torque ? "Drive " + what + at
                               : joint.drive == Drive::locked
                                   ? "Holding " + what + at + " (locked)"
                                   : "Drive " + what + at + " for the prescribed motion";
      return turns ? Presentation{&newton_metre, "Torque", text} : Presentation{&newton, "Force", text};
    }
    case Role::motion_q:
      return turns ? Presentation{&radian, "Angle", "Prescribed angle" + at}
                   : Presentation{&metre, "Position", "Prescribed displacement" + at};
    case Role::motion_qd:
      return turns ? Presentation{&radian_per_second, "AngularVelocity", "Prescribed angular velocity" + at}
                   : Presentation{&metre_per_second, "Velocity", "Prescribed velocity" + at};
    case Role::motion_qdd:
      return turns ? Presentation{&radian_per_second2, "AngularAcceleration",
                                  "Prescribed angular acceleration" + at}
                   : Presentation{&metre_per_second2, "Acceleration", "Prescribed acceleration" + at};
    case Role::q:
      return turns ? Presentation{&radian, "Angle", "Angle" + at}
                   : Presentation{&metre, "Position", "Displacement" + at};
    case Role::qd:
      return turns ? Presentation{&radian_per_second, "AngularVelocity", "Angular velocity" + at}
                   : Presentation{&metre_per_second, "Velocity", "Velocity" + at};
    case Role::qdd:
      return turns ? Presentation{&radian_per_second2, "AngularAcceleration", "Angular acceleration" + at}
                   : Presentation{&metre_per_second2, "Acceleration", "Acceleration" + at};
    case Role::q0:
      return turns ? Presentation{&radian, "Angle", "Start angle" + at}
                   : Presentation{&metre, "Position", "Start displacement" + at};
    case Role::qd0:
      return turns ? Presentation{&radian_per_second, "AngularVelocity", "Start angular velocity" + at}
                   : Presentation{&metre_per_second, "Velocity", "Start velocity" + at};
    case Role::damping:
      return {turns ? &torsional_damping : &linear_damping, "Damping", "Viscous damping" + at};
    case Role::stiffness:
      return {turns ? &torsional_stiffness : &linear_stiffness, "Stiffness", "Spring stiffness" + at};
    case Role::rest:
      return turns ? Presentation{&radian, "Angle", "Angle of zero spring torque" + at}
                   : Presentation{&metre, "Position", "Displacement of zero spring force" + at};
    case Role::friction:
      return turns ? Presentation{&newton_metre, "Torque", "Sliding friction" + at}
                   : Presentation{&newton, "Force", "Sliding friction" + at};
    case Role::static_friction:
      return turns ? Presentation{&newton_metre, "Torque", "Maximum friction" + at}
                   : Presentation{&newton, "Force", "Maximum friction" + at};
    case Role::friction_velocity:
      return turns ? Presentation{&radian_per_second, "AngularVelocity", "Velocity of maximum friction" + at}
                   : Presentation{&metre_per_second, "Velocity", "Velocity of maximum friction" + at};
    case Role::lower:
    case Role::upper: {
      const std::string which = role == Role::lower ? "Lower stop" : "Upper stop";
      return turns ? Presentation{&radian, "Angle", which + at}
                   : Presentation{&metre, "Position", which + at};
    }
    case Role::stop_stiffness:
      return {turns ? &torsional_stiffness : &linear_stiffness, "Stiffness", "Stiffness of the stops" + at};
    case Role::stop_damping:
      return {turns ? &second_per_radian : &second_per_metre, nullptr,
              "Damping of the stops" + at + ", relative increase of their force per velocity"};
    case Role::stop_width:
      return {turns ? &radian : &metre, turns ? "Angle" : "Length",
              "Penetration depth at which the stops" + at + " reach full stiffness"};
    default:  // armature
      return turns ? Presentation{&kilogram_metre2, "MomentOfInertia",
                                  "Armature (reflected rotor inertia)" + at}
                   : Presentation{&kilogram, "Mass", "Armature (reflected mass of the drive)" + at};
  }
}

// Gains act on torques, those of computed torque on accelerations.
Presentation of_gain(const Joint& joint, Role role, Law law) {
  const bool turns = redysim::turns(joint), position = role == Role::kp;
  const Unit* unit = law == Law::computed_torque ? (position ? &per_second2 : &per_second)
                     : position                  ? (turns ? &torsional_stiffness : &linear_stiffness)
                                                 : (turns ? &torsional_damping : &linear_damping);
  return {unit, nullptr,
          std::string(position ? "Gain of the position error" : "Gain of the velocity error") +
              " of joint '" + joint.name + "'"};
}

Presentation of_ball(const Ball& ball, const Variable& variable) {
  const std::string at = " of joint '" + ball.name + "'";
  const std::string along = std::string(", ") + axes[variable.element % 3] + " in link axes";
  static constexpr const char* turns[] = {"z", "x", "y"};
  switch (variable.role) {
    case Role::ball_tau:
      return {&newton_metre, "Torque", "Drive torque" + at + along};
    case Role::ball_quaternion:
    case Role::ball_quaternion0:
      return {nullptr, nullptr,
              std::string(variable.role == Role::ball_quaternion ? "Orientation" : "Start orientation") + at +
                  ", quaternion component " + quaternion_components[variable.element]};
    case Role::ball_omega:
      return {&radian_per_second, "AngularVelocity", "Angular velocity" + at + along};
    case Role::ball_omega0:
      return {&radian_per_second, "AngularVelocity", "Start angular velocity" + at + along};
    case Role::ball_alpha:
      return {&radian_per_second2, "AngularAcceleration", "Angular acceleration" + at + along};
    default:  // ball_angle
      return {&radian, "Angle",
              std::string("Angle about ") + turns[variable.element] + at + ", rotation order z, x, y"};
  }
}

Presentation of_frame(const Frame& frame, const Variable& variable) {
  const std::string at = " of frame '" + frame.name + "'";
  const std::string along = std::string(", ") + axes[variable.element % 3] + " in the ";
  const std::string port_axes = frame.port == Frame::Port::frame_axes ? "frame's axes" : "ground frame";
  switch (variable.role) {
    case Role::frame_position:
      return {&metre, "Position", "Position of the origin" + at + along + "ground frame"};
    case Role::frame_quaternion:
      return {nullptr, nullptr,
              "Orientation" + at + ", quaternion component " + quaternion_components[variable.element] +
                  (variable.element == 0 ? ", never negative" : "")};
    case Role::frame_rotation:
      return {nullptr, nullptr,
              std::string("Rotation matrix: ") + axes[variable.element % 3] + " axis" + at + ", " +
                  axes[variable.element / 3] + " in the ground frame"};
    case Role::frame_velocity:
      return {&metre_per_second, "Velocity", "Velocity of the origin" + at + along + "ground frame"};
    case Role::frame_angular_velocity:
      return {&radian_per_second, "AngularVelocity", "Angular velocity" + at + along + "ground frame"};
    case Role::port_torque:
      return {&newton_metre, "Torque", "Torque on the link at the origin" + at + along + port_axes};
    default:  // port_force
      return {&newton, "Force", "Force on the link at the origin" + at + along + port_axes};
  }
}

// Multipliers of position rows are forces, those of rotation rows moments (order: loop_rows_of.hpp).
Presentation of_loop(const Loop& loop, const Variable& variable) {
  const std::string of = " of loop '" + loop.name + "'";
  const bool points_alone = loop.type == LoopType::point || loop.type == LoopType::spherical;
  if (variable.role == Role::gap)
    return {points_alone ? &metre : nullptr, points_alone ? "Length" : nullptr,
            "Constraint violation" + of + (points_alone ? "" : ", norm over its rows in m and rad")};
  const bool slides = loop.type == LoopType::prismatic || loop.type == LoopType::cylindrical;
  const bool is_force = loop.type == LoopType::point || variable.element < (slides ? 2 : 3);
  const std::string number = " (multiplier " + std::to_string(variable.element + 1) + ")" + of;
  return is_force ? Presentation{&newton, "Force", "Constraint force" + number}
                  : Presentation{&newton_metre, "Torque", "Constraint moment" + number};
}

}  // namespace

Presentation presentation(const Model& model, const Variable& variable) {
  const std::string of_link =
      variable.link == ground ? "" : " of link '" + model.links[variable.link].name + "'";
  if (variable.loop >= 0) return of_loop(model.loops[variable.loop], variable);
  if (variable.ball >= 0) return of_ball(model.balls[variable.ball], variable);
  if (variable.role == Role::linear_momentum)
    return {&newton_second, "Momentum",
            std::string("Linear momentum, ") + axes[variable.element] + " in the ground frame"};
  if (variable.role == Role::angular_momentum)
    return {&newton_metre_second, "AngularMomentum",
            std::string("Angular momentum about the ground's origin, ") + axes[variable.element] +
                " in the ground frame"};
  if (variable.frame >= 0) return of_frame(model.frames[variable.frame], variable);
  switch (variable.role) {
    case Role::tau: {
      Presentation tau = of_joint(model.links[variable.link].joint, Role::tau);
      if (controlled_joint(model, variable.link)) tau.description += ", added to the controller's";
      return tau;
    }
    case Role::kp:
    case Role::kd:
      return of_gain(model.links[variable.link].joint, variable.role, model.controller.law);
    case Role::mass:
      return {&kilogram, "Mass", "Mass" + of_link};
    case Role::com:
      return {&metre, "Length",
              std::string("Center of mass") + of_link + ", " + axes[variable.element] + " in the link frame"};
    case Role::inertia:
      return {&kilogram_metre2, "MomentOfInertia",
              std::string("Inertia matrix entry ") + inertia_entries[variable.element] + of_link +
                  " about its center of mass, link axes"};
    case Role::gravity:
      return {&metre_per_second2, "Acceleration",
              std::string("Gravitational acceleration, ") + axes[variable.element] + " in the ground frame"};
    case Role::rtol:
      return {nullptr, nullptr, "Relative tolerance of the solver"};
    case Role::atol:
      return {nullptr, nullptr, "Absolute tolerance of the solver, in units of each state"};
    case Role::max_step:
      return {&second, "Time", "Maximum internal step size (0: unlimited)"};
    case Role::method:
      return {nullptr, nullptr,
              "Integration method: erk, dirk (explicit, implicit Runge-Kutta), adams, bdf (multistep), auto"};
    case Role::kinetic_energy:
      return {&joule, "Energy", "Kinetic energy of links and armatures"};
    case Role::potential_energy:
      return {&joule, "Energy", "Potential energy of gravity, springs and stops"};
    case Role::total_energy:
      return {&joule, "Energy", "Sum of kinetic and potential energy"};
    case Role::work:
      return {&joule, "Energy", "Work of drives, ports, dampers and friction since the start"};
    case Role::energy_balance:
      return {&joule, "Energy",
              "Energy balance error: change of total energy minus work (zero in exact arithmetic)"};
    case Role::steps:
      return {nullptr, nullptr, "Accepted internal steps"};
    case Role::rejected:
      return {nullptr, nullptr, "Rejected internal steps"};
    case Role::rhs_evaluations:
      return {nullptr, nullptr, "Evaluations of the equations of motion by the solver"};
    case Role::error_estimate:
      return {nullptr, nullptr, "Estimated error of the last internal step relative to the tolerance"};
    case Role::active_method:
      return {nullptr, nullptr, "Method that auto uses now: 1 erk, 2 adams, 3 dirk, 4 bdf, 0 none"};
    default:
      return of_joint(model.links[variable.link].joint, variable.role);
  }
}

}  // namespace redysim
