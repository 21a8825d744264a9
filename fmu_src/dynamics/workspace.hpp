#pragma once

#include <algorithm>
#include <cmath>
#include <cstdint>
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
  Motion<Scalar> c;     // acceleration of the body at qdd = 0 minus its parent's (velocity products)
  ArticulatedInertia<Scalar> A;
  Force<Scalar> p;              // bias wrench: the wrench required at zero acceleration
  Force<Scalar> U;              // A S (DeNOC: psi-hat)
  Scalar D_inverse;             // 1 / (S^T A S + armature) (DeNOC: 1 / m-hat)
  Scalar u;                     // joint force - S^T p (DeNOC: phi-hat)
  Motion<Scalar> acceleration;  // of the origin, minus gravity

  // Passes that do not use accelerations store the velocity of the body here.
  Motion<Scalar>& twist() { return acceleration; }
};

// Mass (kg) and first moment (kg m) of a body and all outboard bodies, at its origin and in its axes.
template <class Scalar>
struct CompositeMass {
  Scalar mass;
  Vec3<Scalar> h;
};

// Pose and velocity of a body in ground axes. See PoseStep for the reference of positions and velocities.
template <class Scalar>
struct GroundState {
  Mat3<Scalar> rotation;
  Vec3<Scalar> position, omega, velocity;
};

// Pivot tolerances of EnvelopeCholesky, squared sines. At distance s from a singular configuration the
// relative pivot is about s^2. A residual of 1e-15 (rounding) rotates the tangent by 1e-15 / s^2 and changes
// accelerations by 1e-15 / s^3: below s = 3e-5 omitting the row causes the smaller error. Corrections of q
// and qd omit it earlier, because they could move the mechanism to another branch
// (docs/derivations/loops.md).
inline constexpr double dynamics_pivot_tolerance = 1e-9;
inline constexpr double projection_pivot_tolerance = 1e-8;

// Maximum of rows times joints of a cluster for a decision on the rank by lever bounds.
inline constexpr std::size_t largest_product = 65536;

// The polyline from the point of a loop to the joints that its rows have crossed, in the order of the
// crossings.
template <class Scalar>
struct LinkPath {
  Vec3<Scalar> end;   // m
  double length = 0;  // m

  void extend_to(const Vec3<Scalar>& joint) {
    length += std::sqrt(value_of((joint - end).squaredNorm()));
    end = joint;
  }
};

// Results of the loop elimination; empty without loops.
template <class Scalar>
struct LoopState {
  std::vector<Force<Scalar>> wrench[2];  // per row and side: transmitted so far, in axes of that body
  // Couplings only, per crossing of the clusters, then of the fronts: wrench transmitted to its body.
  std::vector<Force<Scalar>> coupling_wrench;
  std::vector<Scalar> b;                        // right-hand side of S lambda = b - K a_root
  std::vector<Force<Scalar>> K;                 // per row: wrench on the root
  std::vector<Scalar> crossing_u;               // per crossing of the clusters: u_r of (5)
  std::vector<Scalar> scale;                    // per row: S_rr computed with the lever bounds
  std::vector<LinkPath<Scalar>> path[2];        // per loop and side: path of its wrenches so far
  std::vector<double> path_length[2];           // per joint, for each side of one loop, m; for lever_bound
  std::vector<Scalar> squared_moment_rounding;  // per row, m^2
  std::vector<Scalar> squared_bound[2];         // per row, for each side: bounds of moment and force
  std::vector<Scalar> crossing_scale;           // per crossing of the clusters: contribution to scale
  std::vector<Scalar> lambda;
  std::vector<Scalar> residual;             // position residual per row
  std::vector<Scalar> rate;                 // velocity residual per row
  std::vector<EnvelopeCholesky<Scalar>> S;  // per cluster
  std::vector<std::vector<Scalar>> Q;  // per cluster, rows by joints: S = L Q Q^T L^T; empty if too large
  std::vector<char> uses_Q;            // per cluster: whether S was factored by Q
  std::vector<double> lever, lever_bound, lever_variance;  // for one cluster, rows by joints
  std::vector<double> column_unit;                         // for one cluster, per joint: maximum lever bound
  std::vector<Scalar> front_entries;                       // frontal matrices: S and C, then L and C L^-T
  std::vector<Scalar> front_u;                             // per crossing of the fronts: u_r of (5)
  std::vector<Scalar> diagonal;  // per row of the fronts: S_rr before other rows are eliminated
  bool by_fronts = false;        // whether the last elimination used the fronts
  double pivot_tolerance = dynamics_pivot_tolerance;
  std::vector<double> residual_size, rate_size;  // per row: magnitude of the terms of residual and rate
};

// All results of the recursions. Sized once for a plan; initialised with NaN to detect missing passes.
template <class Scalar>
struct Workspace {
  [[gnu::cold]] explicit Workspace(const Plan<Scalar>& plan);

  std::vector<JointState<Scalar>> joints;
  std::vector<CompositeMass<Scalar>> composite;  // per body; for potential energy only
  std::vector<GroundState<Scalar>> ground;       // first the bodies' own entries, then those of PoseStep
  GroundState<Scalar> base;                      // the ground, relative to plan.origin
  Scalar contact_power;                          // power of all contacts without that of stored energy, W
  std::uint64_t contact_regions = 0;             // code of the regions between corners, for all contacts
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
  if (plan.has_poses()) ground.resize(static_cast<std::size_t>(plan.pose_count));
  base.rotation.setIdentity();
  base.position = -plan.origin;
  base.omega.setZero();
  base.velocity.setZero();
  contact_power = nan;
  std::size_t rows = 0, crossings = 0;
  for (const auto& cluster : plan.clusters) {
    rows += static_cast<std::size_t>(cluster.row_count);
    crossings += cluster.crossings.size();
    const std::size_t size = static_cast<std::size_t>(cluster.row_count) * cluster.joints.size();
    loop.Q.emplace_back(size <= largest_product ? size : 0, nan);
    loop.S.emplace_back(cluster.first_coupled, /*may_reorder=*/!loop.Q.back().empty());
    loop.lever_bound.resize(std::max(loop.lever_bound.size(), loop.Q.back().size()));
    loop.lever.resize(loop.lever_bound.size());
    loop.lever_variance.resize(loop.lever_bound.size());
    loop.column_unit.resize(std::max(loop.column_unit.size(), cluster.joints.size()));
  }
  loop.uses_Q.assign(plan.clusters.size(), 0);
  for (auto& side : loop.wrench) side.resize(rows);
  loop.K.resize(rows);
  for (auto& side : loop.path) side.resize(plan.loops.size());
  for (auto& side : loop.path_length) side.resize(rows > 0 ? plan.joints.size() : 0);
  loop.b.assign(rows, nan);
  for (auto* per_row :
       {&loop.scale, &loop.squared_moment_rounding, &loop.squared_bound[0], &loop.squared_bound[1]})
    per_row->assign(rows, nan);
  loop.crossing_scale.assign(crossings, nan);
  loop.lambda.assign(rows, Scalar(0));
  loop.residual.assign(rows, nan);
  loop.rate.assign(rows, nan);
  loop.residual_size.assign(rows, 0);
  loop.rate_size.assign(rows, 0);
  loop.crossing_u.assign(crossings, nan);
  if (!plan.couplings.empty()) loop.coupling_wrench.resize(crossings);
  if (plan.fronts.empty()) return;
  const FrontPlan& last = plan.fronts.back();
  loop.front_u.assign(last.first_crossing + last.crossings.size(), nan);
  if (!plan.couplings.empty()) loop.coupling_wrench.resize(crossings + loop.front_u.size());
  loop.front_entries.assign(last.first_entry + (last.rows.size() + last.open.size()) * last.rows.size(), nan);
  loop.diagonal.assign(rows, nan);
}

}  // namespace redysim
