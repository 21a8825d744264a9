#include "dynamics/contact/separation.hpp"

#include <algorithm>
#include <cmath>

#include "dynamics/ground_motion.hpp"

namespace redysim {

template <class Scalar>
Scalar separation(const ContactPair<Scalar>& pair, const Workspace<Scalar>& ws) {
  using std::abs;
  const GroundState<Scalar>& body = ground_state(ws, pair.sphere_entry);
  const GroundState<Scalar>& carrier = ground_state(ws, pair.surface_entry);
  const Surface<Scalar>& surface = pair.surface;
  const Vec3<Scalar> between = body.position + body.rotation * pair.middle - carrier.position;
  if (!surface.is_finite()) {
    const Vec3<Scalar> normal = carrier.rotation * surface.rotation.col(2);
    return normal.dot(between) - surface.level - pair.extent;
  }
  const Vec3<Scalar> in_carrier = carrier.rotation.transpose() * between;
  const Vec3<Scalar> place = surface.rotation.transpose() * Vec3<Scalar>(in_carrier - surface.position);
  Scalar largest = abs(place.x()) - surface.bound.x();
  for (int k = 1; k < 3; ++k) largest = std::max(largest, Scalar(abs(place[k]) - surface.bound[k]));
  return largest - pair.extent;
}

template double separation(const ContactPair<double>&, const Workspace<double>&);
template Dual separation(const ContactPair<Dual>&, const Workspace<Dual>&);

}  // namespace redysim
