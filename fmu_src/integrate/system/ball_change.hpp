#pragma once

#include "dynamics/ball.hpp"
#include "integrate/system/system.hpp"

namespace redysim {

// What one entry of the state of a spherical joint changes at held coordinates of all others: coordinates and
// forces of the joints that represent it; its slopes at held accelerations of these.
struct BallStateChange {
  Vec3<double> angles, rates, forces, alpha;
  Eigen::Vector4d quaternion_rate;
};

// `variable`: 0 to 3 of the quaternion, 4 to 6 of the angular velocity. After System::accelerations at y.
BallStateChange ball_state_change(const System& system, int ball, const double* y, const double* qdd,
                                  int variable);

}  // namespace redysim
