#pragma once

#include "dynamics/ground_motion.hpp"
#include "fmi/variables/variables.hpp"

namespace redysim {

// One output of a frame, given its body's motion: position (m, ground frame), quaternion (w, x, y, z with
// w >= 0), rotation matrix (columns are the frame's axes in the ground's), velocity of its origin and
// angular velocity (ground axes).
double frame_value(const Variable& variable, const GroundState<double>& body, const Pose& frame_in_body);

}  // namespace redysim
