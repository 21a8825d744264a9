#pragma once

#include "dynamics/ball.hpp"
#include "integrate/system/system.hpp"

namespace redysim {

// Effect of a unit change of one state of a spherical joint while all other states are held: changes of the
// angles, rates and forces of the joints that represent it, and of its own slopes at held accelerations of
// these joints.
struct BallStateChange {
  Vec3<double> angles, rates, forces, alpha;
  Eigen::Vector4d quaternion_rate;
};

// `variable`: 0 to 3 of the quaternion, 4 to 6 of the angular velocity. Call after System::accelerations at
// y; `qdd`: its result.
BallStateChange ball_state_change(const System& system, int ball, const double* y, const double* qdd,
                                  int variable);

}  // namespace redysim
