#include "fmi/variables/frame_values.hpp"

namespace redysim {

double frame_value(const Variable& variable, const GroundState<double>& body, const Pose& frame_in_body) {
  const int element = variable.element;
  switch (variable.role) {
    case Role::frame_position:
      return point_motion(body, frame_in_body.position).position[element];
    case Role::frame_velocity:
      return point_motion(body, frame_in_body.position).velocity[element];
    case Role::frame_angular_velocity:
      return body.omega[element];
    default:
      break;
  }
  const Mat3<double> rotation = body.rotation * frame_in_body.rotation;
  if (variable.role == Role::frame_rotation) return rotation(element / 3, element % 3);
  const Eigen::Quaterniond quaternion(rotation);
  const double sign = quaternion.w() < 0 ? -1 : 1;
  return sign * (element == 0 ? quaternion.w() : quaternion.vec()[element - 1]);
}

}  // namespace redysim
