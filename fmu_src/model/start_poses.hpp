#pragma once

#include <vector>

#include "model/dh.hpp"
#include "model/model.hpp"

namespace redysim {

// The last link of a Ball. Its pose includes the quaternion; the four joints before it are at zero.
int turned_link(const Ball& ball);

// Pose of each link at the start values, from link frame to ground frame.
std::vector<Pose> start_poses(const Model& model);

}  // namespace redysim
