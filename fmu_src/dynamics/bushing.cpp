#include "dynamics/bushing.hpp"

#include "dynamics/ground_motion.hpp"
#include "math/rotation_vector.hpp"

namespace redysim {
namespace {

// Motion of frame b relative to frame a, in axes of a; the arms are in ground axes.
template <class Scalar>
struct BushingMotion {
  Mat3<Scalar> axes;
  Vec3<Scalar> arm_a, arm_b;  // from the origins of both bodies to the origin of frame b
  Vec3<Scalar> d, rate, omega;
  Mat3<Scalar> rotation;
};

template <class Scalar>
[[gnu::noinline]] BushingMotion<Scalar> bushing_motion(const BushingPlan<Scalar>& bushing,
                                                       const Workspace<Scalar>& ws) {
  const GroundState<Scalar>& a = ground_state(ws, bushing.entry_a);
  const GroundState<Scalar>& b = ground_state(ws, bushing.entry_b);
  const PointMotion<Scalar> at_a = point_motion(a, bushing.point_a), at_b = point_motion(b, bushing.point_b);
  const Vec3<Scalar> between = at_b.position - at_a.position;
  BushingMotion<Scalar> m;
  m.axes = product(a.rotation, bushing.rotation_a);
  m.arm_a = at_a.arm + between;
  m.arm_b = at_b.arm;
  const auto into_a = m.axes.transpose();
  m.d = into_a * between;
  m.rate = into_a * Vec3<Scalar>(at_b.velocity - at_a.velocity - a.omega.cross(between));
  m.omega = into_a * Vec3<Scalar>(b.omega - a.omega);
  m.rotation = into_a * product(b.rotation, bushing.rotation_b);
  return m;
}

template <class Scalar>
[[gnu::noinline]] void act_on(Workspace<Scalar>& ws, int body, const Vec3<Scalar>& arm,
                              const Vec3<Scalar>& force, const Vec3<Scalar>& moment) {
  if (body == ground) return;
  subtract_force(ws, body, arm, force);
  ws.joints[body].p.moment -= transposed_product(ws.ground[body].rotation, moment);
}

template <class Scalar>
Scalar weighted(const Vec3<Scalar>& v, const Vec3<Scalar>& weights) {
  return v.dot(weights.cwiseProduct(v));
}

}  // namespace

template <class Scalar>
void add_bushing_wrench(const BushingPlan<Scalar>& bushing, Workspace<Scalar>& ws) {
  const BushingMotion<Scalar> m = bushing_motion(bushing, ws);
  const RotationVector<Scalar> phi(m.rotation);
  const Vec3<Scalar> pull =
      m.axes * Vec3<Scalar>(bushing.stiffness.cwiseProduct(m.d) + bushing.damping.cwiseProduct(m.rate));
  const Vec3<Scalar> gradient = bushing.turning_stiffness.cwiseProduct(phi.value());
  const Vec3<Scalar> twist =
      m.axes * Vec3<Scalar>(phi.moment(gradient) + bushing.turning_damping.cwiseProduct(m.omega));
  act_on(ws, bushing.body_a, m.arm_a, pull, twist);
  act_on(ws, bushing.body_b, m.arm_b, Vec3<Scalar>(-pull), Vec3<Scalar>(-twist));
}

template <class Scalar>
void add_bushing_wrenches(const Plan<Scalar>& plan, Workspace<Scalar>& ws) {
  for (const BushingPlan<Scalar>& bushing : plan.bushings) add_bushing_wrench(bushing, ws);
}

template <class Scalar>
Scalar bushing_energy(const Plan<Scalar>& plan, const Workspace<Scalar>& ws) {
  Scalar twice(0);
  for (const BushingPlan<Scalar>& bushing : plan.bushings) {
    const BushingMotion<Scalar> m = bushing_motion(bushing, ws);
    twice += weighted(m.d, bushing.stiffness) +
             weighted(RotationVector<Scalar>(m.rotation).value(), bushing.turning_stiffness);
  }
  return Scalar(0.5) * twice;
}

template <class Scalar>
Scalar bushing_loss(const BushingPlan<Scalar>& bushing, const Workspace<Scalar>& ws) {
  const BushingMotion<Scalar> m = bushing_motion(bushing, ws);
  return -(weighted(m.rate, bushing.damping) + weighted(m.omega, bushing.turning_damping));
}

template <class Scalar>
Scalar bushing_loss(const Plan<Scalar>& plan, const Workspace<Scalar>& ws) {
  Scalar loss(0);
  for (const BushingPlan<Scalar>& bushing : plan.bushings) loss += bushing_loss(bushing, ws);
  return loss;
}

template void add_bushing_wrenches(const Plan<double>&, Workspace<double>&);
template double bushing_energy(const Plan<double>&, const Workspace<double>&);
template double bushing_loss(const Plan<double>&, const Workspace<double>&);
template void add_bushing_wrenches(const Plan<Dual>&, Workspace<Dual>&);
template Dual bushing_energy(const Plan<Dual>&, const Workspace<Dual>&);
template Dual bushing_loss(const Plan<Dual>&, const Workspace<Dual>&);
template void add_bushing_wrench(const BushingPlan<Dual>&, Workspace<Dual>&);
template Dual bushing_loss(const BushingPlan<Dual>&, const Workspace<Dual>&);

}  // namespace redysim
