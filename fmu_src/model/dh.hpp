#pragma once

#include "math/vec3.hpp"
#include "model/joint.hpp"

namespace redysim {

// Cosine and sine of an angle. Values within 1e-15 of 0 and +-1 are rounded, so right angles are exact.
struct Turn {
  double cosine, sine;
};
Turn turn_of(double angle);

// A rigid displacement: point_before = rotation * point_after + position.
struct Pose {
  Mat3<double> rotation = Mat3<double>::Identity();
  Vec3<double> position = Vec3<double>::Zero();
};

Pose operator*(const Pose& first, const Pose& second);
Pose inverse(const Pose& pose);

// T = Rz(gamma) Tz(b) Rx(alpha) Tx(a) Rz(theta) Tz(d): the frame of a link at q = 0 in the frame of its
// parent.
Pose pose_of(const DhParameters& dh);

// DH parameters of `pose`. They exist for every rigid displacement; for parallel z axes d = 0.
DhParameters dh_of(const Pose& pose);

}  // namespace redysim
