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

// A port on the ground has no effect.
bool is_port(const Scene& scene, const Variable& v) {
  return scene.model.frames[v.frame].port != Frame::Port::none && scene.plan.carrier[v.link] != ground;
}

// Index of its wrench (moment, force) in System::inputs().
int wrench_of(const System& system, const Variable& v) {
  int port = 0;
  while (system.plan().ports[port].frame != v.frame) ++port;
  return system.input_layout().port_wrench[port];
}

Pose in_body(const Model& model, const Plan<double>& plan, const Variable& v) {
  const Frame& frame = model.frames[v.frame];
  return plan.frame_in_carrier[frame.link] * Pose{frame.rotation, frame.position};
}

struct Motion {
  GroundState<double> body;
  Pose frame;  // in the body
  PointMotion<double> origin() const { return point_motion(body, frame.position); }
  Mat3<double> rotation() const { return body.rotation * frame.rotation; }
};

Motion motion(Values& at, const Variable& v) {
  const Pose frame = in_body(at.model(), at.plan(), v);
  return {body_motion(at.plan(), at.system().workspace(), at.plan().carrier[v.link], at.coordinates().qd),
          frame};
}

// The same with derivatives.
struct MotionChange {
  GroundState<Dual> body;
  Pose frame;
  PointMotion<Dual> origin() const {
    return point_motion(body, Vec3<Dual>(frame.position.template cast<Dual>()));
  }
  Mat3<Dual> rotation() const { return body.rotation * Mat3<Dual>(frame.rotation.template cast<Dual>()); }
};

MotionChange change(OutputDerivatives& of, const Variable& v) {
  const Plan<double>& plan = of.values().plan();
  return {of.tangent().body(plan.carrier[v.link]), in_body(of.model(), plan, v)};
}

// The quaternion with w >= 0.
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

void name_port_axes(const Model& model, const Variable& v, Presentation& shown) {
  const bool own = model.frames[v.frame].port == Frame::Port::frame_axes;
  shown.description += own ? "frame's axes" : "ground frame";
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
        .reads([](Values& at, const Variable& v) { return motion(at, v).body.omega[v.element]; },
               Needs::accelerations)
        .derivative([](OutputDerivatives& of, const Variable& v) {
          return of.tangent().body(of.values().plan().carrier[v.link]).omega[v.element].derivative;
        })
        .depends(at_point::jumps, initially::accelerations)
        .measures(quantity::angular_velocity)
        .says("Angular velocity of %, $ in the ground frame")
        .labels(axes),
};

}  // namespace

const RowGroup FrameVariables::rows = rows_in<entries>;
const WordGroup FrameVariables::words = words_in<entries>;

}  // namespace redysim
