#pragma once

#include <vector>

#include "support/evaluate.hpp"
#include "support/random_tree.hpp"

// Loops that are closed at a given pose of a given tree, and the dense solve they are compared with.

namespace redysim::test {

// Ground poses of all links at q (moving joints in order), by the products of DH displacements alone.
std::vector<Pose> poses_at(const Model& model, const Vector& q);

int moving_joints(const Model& model);

// The cut joint between links a and b (or ground) that is closed at `poses`.
Loop closed_loop(Random& random, LoopType type, int a, int b, const std::vector<Pose>& poses);

// The loop that joint `link` of a tree makes once more: the same axis, or for an open type a part of what it
// keeps.
Loop repeated_joint(Random& random, const Model& model, int link);

inline constexpr LoopType all_loop_types[] = {LoopType::point,     LoopType::spherical,   LoopType::revolute,
                                              LoopType::prismatic, LoopType::cylindrical, LoopType::universal,
                                              LoopType::fixed};

// A model with loops and a state in which they are closed.
struct ClosedCase {
  Model model;
  Vector q, qd, tau;
};

// A random tree with `loops` random cut joints, all closed at q.
ClosedCase random_case(Random& random, int links, int loops, const std::vector<LoopType>& types);

// Ends of `loop` on link a from those on link b, as they are at `poses`.
void match_ends(Loop& loop, const std::vector<Pose>& poses);

// The same scene in a unit of length that is `size` m: rotations stay, slides grow with it, as does gravity.
Model resized(Model model, double size);

// M qdd + bias = tau + J^T lambda, J qdd = -J' qd, with J from the derivatives of the residuals, M from
// composite bodies and the least-norm lambda from a dense pseudo-inverse.
struct DenseSolution {
  Matrix M, J, S;
  Vector bias, quadratic, qdd, lambda;
  Eigen::Index rank = 0;
};

Matrix loop_jacobian(const Model& model, const Vector& q);

DenseSolution dense_solution(const Model& model, const Vector& q, const Vector& qd, const Vector& tau);

// qd without its part across the constraints (mass metric).
Vector closed_velocity(const Model& model, const Vector& q, const Vector& qd);

}  // namespace redysim::test
