#pragma once

#include <algorithm>
#include <cmath>
#include <limits>
#include <vector>

#include "dynamics/plan.hpp"
#include "math/dual.hpp"
#include "math/envelope_cholesky.hpp"

namespace redysim {

// Results of the recursions for one joint and its body, in body axes unless stated otherwise.
template <class Scalar>
struct JointState {
  Scalar cosine, sine;  // of the angle about z
  Scalar offset;        // along z, m
  Vec3<Scalar> omega;   // angular velocity of the body
  Motion<Scalar> c;     // acceleration of the body at qdd = 0 beyond its parent's (velocity products)
  ArticulatedInertia<Scalar> A;
  Force<Scalar> p;              // bias wrench: required at zero acceleration
  Force<Scalar> U;              // A S (DeNOC: psi-hat)
  Scalar D_inverse;             // 1 / (S^T A S + armature) (DeNOC: 1 / m-hat)
  Scalar u;                     // joint force - S^T p (DeNOC: phi-hat)
  Motion<Scalar> acceleration;  // of the origin, minus gravity

  // Passes without accelerations keep the body's velocity in the same place.
  Motion<Scalar>& twist() { return acceleration; }
};

// Mass (kg) and first moment (kg m) of a body and all that it carries, at its origin and in its axes.
template <class Scalar>
struct CompositeMass {
  Scalar mass;
  Vec3<Scalar> h;
};

// Pose and velocity along the ground's axes, positions from plan.origin, only for bodies with loops,
// springs or frames.
template <class Scalar>
struct GroundState {
  Mat3<Scalar> rotation;
  Vec3<Scalar> position, omega, velocity;
};

// Rank tolerances, relative to the levers that a row could have, squared. At distance s from a singular
// position the pivot is about s^2 and a gap of 1e-15 (rounding) turns the tangent by 1e-15 / s^2 and
// falsifies accelerations by 1e-15 / s^3: below s = 3e-5 leaving the row out is the smaller error, and
// corrections of q and qd must stop earlier, or they steer the motion into another branch.
// docs/derivations/loops.md has the runs.
inline constexpr double dynamics_rank_tolerance = 1e-9;
inline constexpr double projection_rank_tolerance = 1e-8;

// Rows times joints of a cluster up to which the factor may be taken from the levers themselves.
inline constexpr std::size_t largest_product = 65536;

// The links between a loop's point and the joints that its rows cross, one after the other.
template <class Scalar>
struct LinkPath {
  Vec3<Scalar> end;   // m, from plan.origin
  double length = 0;  // m

  void go_on_to(const Vec3<Scalar>& joint) {
    length += std::sqrt(value_of((joint - end).squaredNorm()));
    end = joint;
  }
};

// Scratch of the loop elimination; empty without loops.
template <class Scalar>
struct LoopState {
  std::vector<Force<Scalar>> wrench[2];   // per row and side, at the body reached, in its axes
  std::vector<Scalar> b;                  // right-hand side of S lambda = b - K a_root
  std::vector<Force<Scalar>> K;           // per row: wrench on the cluster's root
  std::vector<Scalar> passage_u;          // per passage (all clusters): S_j^T wrench
  std::vector<Scalar> scale;              // per row: its S_rr if each lever were as long as it could be
  std::vector<LinkPath<Scalar>> path[2];  // per row and side: of its wrench so far
  std::vector<Scalar> least_reach;        // per row: of the square of a lever, m^2
  std::vector<Scalar> length[2];      // per row: largest lever^2 of one side, on turning and sliding joints
  std::vector<Scalar> passage_scale;  // per passage (all clusters): its share in that
  std::vector<Scalar> lambda;
  std::vector<Scalar> residual;             // position residual per row
  std::vector<Scalar> rate;                 // velocity residual per row
  std::vector<EnvelopeCholesky<Scalar>> S;  // one per cluster
  std::vector<std::vector<Scalar>> Q;       // per cluster: S = L Q Q^T L^T, rows by joints; of small clusters
  std::vector<char> uses_Q;                 // per cluster: where S was factored so
  std::vector<Scalar> reach, longest;       // of one cluster: rows by joints, joints
  std::vector<Scalar> front_entries;        // matrices of all fronts: S, then [L; C L^-T]
  std::vector<Scalar> front_u;              // per passage of the fronts
  std::vector<Scalar> diagonal;             // per row of the fronts: of S before other rows are taken out
  bool early = false;                       // whether the last elimination went by fronts
  double rank_tolerance = dynamics_rank_tolerance;
  std::vector<double> residual_size,
      rate_size;  // per row: of the numbers that the residuals are differences of
};

// Everything a recursion writes. Sized once for a plan; filled with NaN, so that a missing pass is detected.
template <class Scalar>
struct Workspace {
  explicit Workspace(const Plan<Scalar>& plan);

  std::vector<JointState<Scalar>> joints;
  std::vector<CompositeMass<Scalar>> composite;  // per body; potential energy alone
  std::vector<GroundState<Scalar>> ground;
  GroundState<Scalar> base;  // the ground itself, seen from plan.origin
  LoopState<Scalar> loop;
};

template <class Scalar>
Workspace<Scalar>::Workspace(const Plan<Scalar>& plan) {
  const Scalar nan = std::numeric_limits<double>::quiet_NaN();
  JointState<Scalar> fresh;
  fresh.cosine = fresh.sine = fresh.offset = fresh.D_inverse = fresh.u = nan;
  fresh.omega.setConstant(nan);
  fresh.c.angular.setConstant(nan);
  fresh.c.linear.setConstant(nan);
  fresh.acceleration = fresh.c;
  fresh.A.xx = fresh.A.yy = fresh.A.zz = fresh.A.xy = fresh.A.xz = fresh.A.yz = Lanes<Scalar>::all(nan);
  joints.assign(plan.joints.size(), fresh);
  composite.assign(plan.joints.size(), {nan, fresh.omega});
  if (plan.has_poses()) ground.resize(plan.joints.size());
  base.rotation.setIdentity();
  base.position = -plan.origin;
  base.omega.setZero();
  base.velocity.setZero();
  std::size_t rows = 0, passages = 0;
  for (const auto& cluster : plan.clusters) {
    rows += static_cast<std::size_t>(cluster.row_count);
    passages += cluster.passages.size();
    loop.S.emplace_back(cluster.first_coupled);
  }
  for (const auto& cluster : plan.clusters) {
    const std::size_t size = static_cast<std::size_t>(cluster.row_count) * cluster.joints.size();
    loop.Q.emplace_back(size <= largest_product ? size : 0, nan);
    loop.reach.resize(std::max(loop.reach.size(), loop.Q.back().size()), nan);
    loop.longest.resize(std::max(loop.longest.size(), cluster.joints.size()), nan);
  }
  loop.uses_Q.assign(plan.clusters.size(), 0);
  for (auto& side : loop.wrench) side.resize(rows);
  loop.K.resize(rows);
  for (auto& side : loop.path) side.resize(rows);
  loop.b.assign(rows, nan);
  for (auto* measure : {&loop.scale, &loop.least_reach, &loop.length[0], &loop.length[1]})
    measure->assign(rows, nan);
  loop.passage_scale.assign(passages, nan);
  loop.lambda.assign(rows, Scalar(0));
  loop.residual.assign(rows, nan);
  loop.rate.assign(rows, nan);
  loop.residual_size.assign(rows, 0);
  loop.rate_size.assign(rows, 0);
  loop.passage_u.assign(passages, nan);
  if (plan.fronts.empty()) return;
  const FrontPlan& last = plan.fronts.back();
  loop.front_u.assign(last.first_passage + last.passages.size(), nan);
  loop.front_entries.assign(last.first_entry + (last.rows.size() + last.open.size()) * last.rows.size(), nan);
  loop.diagonal.assign(rows, nan);
}

}  // namespace redysim
