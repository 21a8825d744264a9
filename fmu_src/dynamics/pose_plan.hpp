#pragma once

#include "model/model.hpp"

namespace redysim {

template <class Scalar>
struct Plan;

// One step of set_ground_motion. Each step fills one entry of Workspace::ground; those of the joints come
// first. The positions of an entry are relative to plan.origin. Those of the bodies of a cluster of loops on
// a moving root are relative to the origin of its root: they keep their digits on a root that is far larger
// than the loops.
struct PoseStep {
  enum class Kind {
    moved,  // a body from its parent
    root,   // the root of a cluster, seen from its own origin
    lifted  // a body of a cluster, seen from plan.origin
  };
  Kind kind = Kind::moved;
  int body = ground;
  int entry = ground;
  int from = ground;  // entry of the parent; root, lifted: another entry of the body
  int base = ground;  // lifted: entry of the root, seen from plan.origin
  // body whose origin the positions are relative to; ground: plan.origin
  int reference = ground;
};

// Sets plan.poses, and the entries that loops, springs, bushings, contacts and ports use.
void set_poses(Plan<double>& plan);

}  // namespace redysim
