#pragma once

#include <vector>

#include "model/dh.hpp"
#include "model/model.hpp"

namespace redysim {

// Of a ball's links the last, which the turn carries; before it stand the chart and three angles, all at
// zero.
int turned_link(const Ball& ball);

// Ground to link frame of each link at the start values.
std::vector<Pose> start_poses(const Model& model);

}  // namespace redysim
