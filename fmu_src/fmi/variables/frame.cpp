#include "dynamics/ground_motion.hpp"
#include "fmi/instance/derivatives.hpp"
#include "fmi/instance/values.hpp"
#include "fmi/variables/entry.hpp"

// Variables of a frame on a link: its motion in the ground frame, and the wrench of a port.

namespace redysim {
namespace {

bool shows_pose(const Scene& scene, const Variable& v) { return scene.model.frames[v.frame].pose; }
bool shows_rotation(const Scene& scene, const Variable& v) {
  return scene.model.frames[v.frame].rotation_matrix;
}
bool shows_velocity(const Scene& scene, const Variable& v) { return scene.model.frames[v.frame].velocity; }
bool shows_acceleration(const Scene& scene, const Variable& v) {
  return scene.model.frames[v.frame].acceleration;
}
bool is_imu(const Scene& scene, const Variable& v) { return scene.model.frames[v.frame].imu; }
bool is_wrist(const Scene& scene, const Variable& v) { return scene.model.frames[v.frame].wrench; }

// A port on the ground has no effect.
bool is_port(const Scene& scene, const Variable& v) {
  return scene.model.frames[v.frame].port != Frame::Port::none && scene.plan.carrier[v.link] != ground;
}

bool shows_power(const Scene& scene, const Variable& v) {
  return scene.model.frames[v.frame].power && is_port(scene, v);
}

// Number of the frame's port in the plan.
int port_of(const Plan<double>& plan, const Variable& v) {
  int port = 0;
  while (plan.ports[port].frame != v.frame) ++port;
  return port;
}

// Index of its wrench (moment, force) in System::inputs().
int wrench_of(const System& system, const Variable& v) {
  return system.input_layout().port_wrench[port_of(system.plan(), v)];
}

bool power_at_point(const Variable& unknown, const Variable& known, const Components& components) {
  return known.frame == unknown.frame || at_point::jumps(unknown, known, components);
}

Pose in_body(const Model& model, const Plan<double>& plan, const Variable& v) {
  const Frame& frame = model.frames[v.frame];
  return plan.frame_in_carrier[frame.link] * Pose{frame.rotation, frame.position};
}

template <class Scalar>
struct FrameMotion {
  AcceleratedBody<Scalar> body;
  Pose frame;  // in the body
  Vec3<Scalar> gravity;
  PointMotion<Scalar> origin() const {
    return point_motion(body.state, Vec3<Scalar>(frame.position.template cast<Scalar>()));
  }
  Mat3<Scalar> rotation() const {
    return body.state.rotation * Mat3<Scalar>(frame.rotation.template cast<Scalar>());
  }
  Vec3<Scalar> acceleration() const { return point_acceleration(body, origin().arm); }
  // as an inertial sensor measures it, in frame axes
  Vec3<Scalar> proper_acceleration() const {
    return rotation().transpose() * Vec3<Scalar>(acceleration() - gravity);
  }
  Vec3<Scalar> angular_rate() const { return rotation().transpose() * body.state.omega; }
};

FrameMotion<double> motion(Values& at, const Variable& v) {
  return {at.body(at.plan().carrier[v.link]), in_body(at.model(), at.plan(), v), at.plan().gravity};
}

// The same with derivatives.
FrameMotion<Dual> change(OutputDerivatives& of, const Variable& v) {
  const Plan<double>& plan = of.values().plan();
  return {of.tangent().body(plan.carrier[v.link]), in_body(of.model(), plan, v),
          of.tangent().parameters.gravity};
}

// A component of the quaternion with w >= 0.
double read_quaternion(Values& at, const Variable& v) {
  const Eigen::Quaterniond quaternion(motion(at, v).rotation());
  const double sign = quaternion.w() < 0 ? -1 : 1;
  return sign * (v.element == 0 ? quaternion.w() : quaternion.vec()[v.element - 1]);
}

double quaternion_derivative(OutputDerivatives& of, const Variable& v) {
  const Mat3<Dual> R = change(of, v).rotation();
  Mat3<double> value, spin;  // spin = R^T dR
  for (int i = 0; i < 9; ++i) value(i / 3, i % 3) = R(i / 3, i % 3).value;
  for (int i = 0; i < 3; ++i)
    for (int j = 0; j < 3; ++j) {
      spin(i, j) = 0;
      for (int k = 0; k < 3; ++k) spin(i, j) += value(k, i) * R(k, j).derivative;
    }
  const Eigen::Quaterniond q(value);
  const double sign = q.w() < 0 ? -1 : 1;
  return sign *
         quaternion_change({q.w(), q.x(), q.y(), q.z()}, {spin(2, 1), spin(0, 2), spin(1, 0)}, v.element);
}

double read_inverse_inertia(Values& at, const Variable& v) {
  const Plan<double>& plan = at.plan();
  return at.terms().inverse_inertia(plan.carrier[v.link], in_body(at.model(), plan, v).position, v.element);
}

double inverse_inertia_derivative(OutputDerivatives& of, const Variable& v) {
  const Plan<double>& plan = of.values().plan();
  return of.tangent()
      .terms()
      .inverse_inertia(plan.carrier[v.link], in_body(of.model(), plan, v).position, v.element)
      .derivative;
}

void name_inverse_inertia(const Model&, const Variable& v, Presentation& shown) {
  const auto name = [](int row, const char* turning, const char* moving) {
    return std::string(row < 3 ? turning : moving) + " " + axes[row % 3];
  };
  shown.description += name(v.element / 6, "angular acceleration", "acceleration") + " by " +
                       name(v.element % 6, "torque", "force");
}

void name_port_axes(const Model& model, const Variable& v, Presentation& shown) {
  const bool own = model.frames[v.frame].port == Frame::Port::frame_axes;
  shown.description += own ? "frame's axes" : "ground frame";
}

bool is_rate(const Variable& v) { return v.row->name.text[sizeof "jacobian" - 1] != 0; }

double read_jacobian(Values& at, const Variable& v) {
  const Plan<double>& plan = at.plan();
  return at.terms().jacobian(plan.carrier[v.link], in_body(at.model(), plan, v).position, v.element,
                             is_rate(v));
}

double jacobian_derivative(OutputDerivatives& of, const Variable& v) {
  const Plan<double>& plan = of.values().plan();
  return of.tangent()
      .terms()
      .jacobian(plan.carrier[v.link], in_body(of.model(), plan, v).position, v.element, is_rate(v))
      .derivative;
}

void name_jacobian(const Model& model, const Variable& v, Presentation& shown) {
  const std::vector<TreeCoordinate> all = tree_velocities(model);
  const std::size_t row = static_cast<std::size_t>(v.element) / all.size();
  shown.description += std::string(row < 3 ? "angular velocity " : "velocity ") + axes[row % 3] + " by " +
                       all[static_cast<std::size_t>(v.element) % all.size()].name;
}

constexpr Entry entries[] = {
    input(Owner::frame, "force")
        .array(3)
        .there_if(is_port)
        .input_at(
            [](const System& system, const Variable& v) { return wrench_of(system, v) + 3 + v.element; })
        .measures(quantity::force)
        .says("Force on the link at the origin of %, $ in the ")
        .labels(axes)
        .adapted(name_port_axes),
    input(Owner::frame, "torque")
        .array(3)
        .there_if(is_port)
        .input_at([](const System& system, const Variable& v) { return wrench_of(system, v) + v.element; })
        .measures(quantity::torque)
        .says("Torque on the link at the origin of %, $ in the ")
        .labels(axes)
        .adapted(name_port_axes),
    output(Owner::frame, "position")
        .array(3)
        .there_if(shows_pose)
        .reads([](Values& at, const Variable& v) { return motion(at, v).origin().position[v.element]; },
               Needs::accelerations)
        .derivative([](OutputDerivatives& of, const Variable& v) {
          return change(of, v).origin().position[v.element].derivative;
        })
        .depends(at_point::jumps, initially::accelerations)
        .measures(quantity::position)
        .says("Position of the origin of %, $ in the ground frame")
        .labels(axes),
    output(Owner::frame, "quaternion")
        .array(4)
        .there_if(shows_pose)
        .reads(read_quaternion, Needs::accelerations)
        .derivative(quaternion_derivative)
        .depends(at_point::jumps, initially::accelerations)
        .says("Orientation of %, quaternion component $ (w >= 0)")
        .labels(quaternion_components),
    output(Owner::frame, "rotation")
        .array(3, 3)
        .there_if(shows_rotation)
        .reads([](Values& at,
                  const Variable& v) { return motion(at, v).rotation()(v.element / 3, v.element % 3); },
               Needs::accelerations)
        .derivative([](OutputDerivatives& of, const Variable& v) {
          return change(of, v).rotation()(v.element / 3, v.element % 3).derivative;
        })
        .depends(at_point::jumps, initially::accelerations)
        .says("Rotation matrix: $ axis of %, & in the ground frame")
        .labels(axes),
    output(Owner::frame, "velocity")
        .array(3)
        .there_if(shows_velocity)
        .reads([](Values& at, const Variable& v) { return motion(at, v).origin().velocity[v.element]; },
               Needs::accelerations)
        .derivative([](OutputDerivatives& of, const Variable& v) {
          return change(of, v).origin().velocity[v.element].derivative;
        })
        .depends(at_point::jumps, initially::accelerations)
        .measures(quantity::velocity)
        .says("Velocity of the origin of %, $ in the ground frame")
        .labels(axes),
    output(Owner::frame, "angular_velocity")
        .array(3)
        .there_if(shows_velocity)
        .reads([](Values& at, const Variable& v) { return motion(at, v).body.state.omega[v.element]; },
               Needs::accelerations)
        .derivative([](OutputDerivatives& of, const Variable& v) {
          return change(of, v).body.state.omega[v.element].derivative;
        })
        .depends(at_point::jumps, initially::accelerations)
        .measures(quantity::angular_velocity)
        .says("Angular velocity of %, $ in the ground frame")
        .labels(axes),
    output(Owner::frame, "acceleration")
        .array(3)
        .there_if(shows_acceleration)
        .reads([](Values& at, const Variable& v) { return motion(at, v).acceleration()[v.element]; },
               Needs::accelerations)
        .derivative([](OutputDerivatives& of, const Variable& v) {
          return change(of, v).acceleration()[v.element].derivative;
        })
        .depends(at_point::accelerations, initially::accelerations)
        .measures(quantity::acceleration)
        .says("Acceleration of the origin of %, $ in the ground frame")
        .labels(axes),
    output(Owner::frame, "angular_acceleration")
        .array(3)
        .there_if(shows_acceleration)
        .reads(
            [](Values& at, const Variable& v) { return motion(at, v).body.acceleration.angular[v.element]; },
            Needs::accelerations)
        .derivative([](OutputDerivatives& of, const Variable& v) {
          return change(of, v).body.acceleration.angular[v.element].derivative;
        })
        .depends(at_point::accelerations, initially::accelerations)
        .measures(quantity::angular_acceleration)
        .says("Angular acceleration of %, $ in the ground frame")
        .labels(axes),
    output(Owner::frame, "proper_acceleration")
        .array(3)
        .there_if(is_imu)
        .reads([](Values& at, const Variable& v) { return motion(at, v).proper_acceleration()[v.element]; },
               Needs::accelerations)
        .derivative([](OutputDerivatives& of, const Variable& v) {
          return change(of, v).proper_acceleration()[v.element].derivative;
        })
        .depends(at_point::accelerations, initially::accelerations)
        .measures(quantity::acceleration)
        .says("Acceleration minus gravity at the origin of %, $ in the frame's axes")
        .labels(axes),
    output(Owner::frame, "angular_rate")
        .array(3)
        .there_if(is_imu)
        .reads([](Values& at, const Variable& v) { return motion(at, v).angular_rate()[v.element]; },
               Needs::accelerations)
        .derivative([](OutputDerivatives& of, const Variable& v) {
          return change(of, v).angular_rate()[v.element].derivative;
        })
        .depends(at_point::jumps, initially::accelerations)
        .measures(quantity::angular_velocity)
        .says("Angular velocity of %, $ in the frame's axes")
        .labels(axes),
    output(Owner::frame, "sensed_force")
        .array(3)
        .there_if(is_wrist)
        .reads([](Values& at, const Variable& v) { return at.sensed_wrench(v.frame).force[v.element]; },
               Needs::accelerations)
        .derivative([](OutputDerivatives& of, const Variable& v) {
          return of.tangent().sensed_wrench(of.model().frames[v.frame]).force[v.element].derivative;
        })
        .depends(at_point::sensed, initially::sensed)
        .measures(quantity::force)
        .says("Force of the outboard bodies through the fixed joint of %, $ in the frame's axes")
        .labels(axes),
    output(Owner::frame, "sensed_torque")
        .array(3)
        .there_if(is_wrist)
        .reads([](Values& at, const Variable& v) { return at.sensed_wrench(v.frame).moment[v.element]; },
               Needs::accelerations)
        .derivative([](OutputDerivatives& of, const Variable& v) {
          return of.tangent().sensed_wrench(of.model().frames[v.frame]).moment[v.element].derivative;
        })
        .depends(at_point::sensed, initially::sensed)
        .measures(quantity::torque)
        .says("Moment of the outboard bodies about the origin of %, $ in the frame's axes")
        .labels(axes),
    output(Owner::frame, "power")
        .there_if(shows_power)
        .reads(
            [](Values& at, const Variable& v) {
              at.moved_bodies();
              return at.system().port_power(at.coordinates(), port_of(at.plan(), v));
            },
            Needs::accelerations)
        .derivative([](OutputDerivatives& of, const Variable& v) {
          return of.tangent().port_power(port_of(of.values().plan(), v)).derivative;
        })
        .depends(power_at_point, initially::accelerations)
        .measures(quantity::power)
        .says("Power of the force and torque on %"),
    output(Owner::frame, "jacobian")
        .array(6, per_velocity)
        .there_if([](const Scene& scene, const Variable& v) { return scene.model.frames[v.frame].jacobian; })
        .reads(read_jacobian, Needs::accelerations)
        .derivative(jacobian_derivative)
        .depends(at_point::jumps, initially::accelerations)
        .says("Jacobian of %, ground frame: ")
        .adapted(name_jacobian),
    output(Owner::frame, "jacobian_rate")
        .array(6, per_velocity)
        .there_if(
            [](const Scene& scene, const Variable& v) { return scene.model.frames[v.frame].jacobian_rate; })
        .reads(read_jacobian, Needs::accelerations)
        .derivative(jacobian_derivative)
        .depends(at_point::jumps, initially::accelerations)
        .says("Time derivative of the Jacobian of %, ground frame: ")
        .adapted(name_jacobian),
    output(Owner::frame, "inverse_inertia")
        .array(6, 6)
        .there_if(
            [](const Scene& scene, const Variable& v) { return scene.model.frames[v.frame].inverse_inertia; })
        .reads(read_inverse_inertia, Needs::accelerations)
        .derivative(inverse_inertia_derivative)
        .depends(at_point::jumps, initially::accelerations)
        .says("Inverse of the operational-space inertia of %, ground frame: ")
        .adapted(name_inverse_inertia),
};

}  // namespace

const RowGroup FrameVariables::rows = rows_in<entries>;
const WordGroup FrameVariables::words = words_in<entries>;

}  // namespace redysim
