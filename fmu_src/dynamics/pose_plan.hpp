#pragma once

#include "model/model.hpp"

namespace redysim {

template <class Scalar>
struct Plan;

// One step of set_ground_motion, which fills one entry of Workspace::ground; the entries of the joints come
// first. Positions are relative to plan.origin. Only the bodies of a loop cluster on a moving root have
// positions relative to the root's origin, which preserves accuracy if the root is far larger than the loops.
struct PoseStep {
  enum class Kind {
    moved,  // a body from its parent
    root,   // the root of a cluster, relative to its own origin
    lifted  // a body of a cluster, relative to plan.origin
  };
  Kind kind = Kind::moved;
  int body = ground;
  int entry = ground;
  int from = ground;  // entry of the parent; root and lifted: another entry of the same body
  int base = ground;  // lifted: entry of the root, relative to plan.origin
  // body to whose origin the positions are relative; ground: plan.origin
  int reference = ground;
};

// Sets plan.poses, and the entries used by loops, springs, bushings, contacts and ports.
void set_poses(Plan<double>& plan);

}  // namespace redysim
