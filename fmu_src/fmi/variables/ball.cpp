#include "dynamics/ball.hpp"

#include "fmi/instance/derivatives.hpp"
#include "fmi/instance/values.hpp"
#include "fmi/variables/entry.hpp"

// Variables of a spherical joint.

namespace redysim {
namespace {

constexpr const char* angle_axes[] = {"z", "x", "y"};

bool is_driven(const Scene& scene, const Variable& variable) {
  return scene.model.balls[variable.ball].driven;
}

double read_quaternion(Values& at, const Variable& v) {
  if (at.is_integrated_outside()) return at.state(v);  // as set by the master, of any length
  return Eigen::Map<const Eigen::Vector4d>(at.ball_quaternion(v.ball)).normalized()[v.element];
}

double quaternion_derivative(OutputDerivatives& of, const Variable& v) {
  if (of.values().is_integrated_outside()) return of.tangent().balls[v.ball].quaternion[v.element];
  return quaternion_change(Eigen::Map<const Eigen::Vector4d>(of.values().ball_quaternion(v.ball)),
                           of.tangent().ball(v.ball).turn, v.element);
}

// ReDySim's angles of R = Rz(phi) Rx(theta) Ry(psi). At theta = +-90 deg only the sum or the difference of
// phi and psi is determined, so psi is that of Rz(-phi) R.
BallAngles zxy_angles(const double* quaternion) {
  const Mat3<double> R = rotation_of(quaternion);
  BallAngles angles = angles_in_chart(R, false);
  const double s = std::sin(angles.phi), c = std::cos(angles.phi);
  angles.psi = std::atan2(c * R(0, 2) + s * R(1, 2), c * R(0, 0) + s * R(1, 0));
  return angles;
}

double read_angle(Values& at, const Variable& v) {
  const BallAngles angles = zxy_angles(at.ball_quaternion(v.ball));
  return Vec3<double>(angles.phi, angles.theta, angles.psi)[v.element];
}

constexpr Entry acceleration_entry =
    output(Owner::ball, "alpha")
        .array(3)
        .in(OutputGroup::acceleration)
        .slope_of(StatePart::omega)
        .reads([](Values& at, const Variable& v) { return at.ball_acceleration(v.ball)[v.element]; },
               Needs::accelerations)
        .derivative([](OutputDerivatives& of, const Variable& v) {
          return of.tangent().ball(v.ball).alpha[v.element].derivative;
        })
        .depends(at_point::accelerations, initially::accelerations)
        .measures(quantity::angular_acceleration)
        .says("Angular acceleration of %, $ in link axes")
        .labels(axes);

constexpr Entry motion_entries[] = {
    input(Owner::ball, "tau")
        .array(3)
        .there_if(is_driven)
        .input_at([](const System& system, const Variable& v) {
          return system.input_layout().ball_torque[v.ball] + v.element;
        })
        .measures(quantity::torque)
        .says("Drive torque of %, $ in link axes")
        .labels(axes),
    output(Owner::ball, "quaternion")
        .array(4)
        .is_state(StatePart::quaternion)
        .reads(read_quaternion)
        .derivative(quaternion_derivative)
        .depends(at_point::jumps, initially::position)
        .says("Orientation of %, quaternion component $")
        .labels(quaternion_components),
    output(Owner::ball, "omega")
        .array(3)
        .is_state(StatePart::omega)
        .reads([](Values& at, const Variable& v) { return at.state(v); })
        .derivative([](OutputDerivatives& of, const Variable& v) {
          return of.tangent().ball(v.ball).omega[v.element].derivative;
        })
        .depends(at_point::jumps, initially::velocity)
        .constant(ConstantFactor::unless_assembled)
        .measures(quantity::angular_velocity)
        .says("Angular velocity of %, $ in link axes")
        .labels(axes),
    acceleration_entry,
    output(Owner::ball, "angle")
        .array(3)
        .reads(read_angle)
        .derivative([](OutputDerivatives& of, const Variable& v) {
          return angle_rates(zxy_angles(of.values().ball_quaternion(v.ball)),
                             of.tangent().ball(v.ball).turn)[v.element];
        })
        .depends(at_point::jumps, initially::position)
        .measures(quantity::angle)
        .says("Angle about $ of %, rotation order z, x, y")
        .labels(angle_axes),
};

// Spherical joints in loops follow from independent coordinates.
bool is_integrated(const Scene& scene, const Variable& variable) {
  return !scene.is_in_cluster(variable.joint + 1);
}

constexpr Entry slope_entries[] = {
    output(Owner::ball, "quaternion_rate")
        .local()
        .there_if(is_integrated)
        .array(4)
        .slope_of(StatePart::quaternion)
        .reads([](Values& at, const Variable& v) { return at.slope(v); }, Needs::slopes)
        .derivative([](OutputDerivatives& of, const Variable& v) {
          return of.tangent().quaternion_slope(v.ball)[v.element];
        })
        .depends(at_point::jumps, initially::accelerations)
        .measures({&units::per_second})
        .says("Time derivative of the orientation of %, quaternion component $")
        .labels(quaternion_components),
    acceleration_entry.local().there_if(is_integrated),
};

constexpr Entry start_entries[] = {
    parameter(Owner::ball, "quaternion0")
        .fixed()
        .array(4)
        .sets([](auto& at, const Variable& v) -> auto& { return at.balls[v.ball].quaternion[v.element]; })
        .acts_on(acts::position)
        .says("Start orientation of %, quaternion component $")
        .labels(quaternion_components),
    parameter(Owner::ball, "omega0")
        .fixed()
        .array(3)
        .sets([](auto& at, const Variable& v) -> auto& { return at.balls[v.ball].omega[v.element]; })
        .acts_on(acts::velocity)
        .measures(quantity::angular_velocity)
        .says("Start angular velocity of %, $ in link axes")
        .labels(axes),
};

}  // namespace

const RowGroup BallMotionVariables::rows = rows_in<motion_entries>;
const WordGroup BallMotionVariables::words = words_in<motion_entries>;
const RowGroup BallSlopes::rows = rows_in<slope_entries>;
const WordGroup BallSlopes::words = words_in<slope_entries>;
const RowGroup BallStartValues::rows = rows_in<start_entries>;
const WordGroup BallStartValues::words = words_in<start_entries>;

}  // namespace redysim
