#include "dynamics/assembly/freedom.hpp"

#include <algorithm>
#include <numeric>

#include "dynamics/compiled.hpp"
#include "math/complete_pivoting.hpp"
#include "math/least_norm.hpp"

namespace redysim {
namespace {

constexpr double dependent = 1e-8;  // as in the assembly

}  // namespace

ConstraintRanks constraint_ranks(const Model& model, const Plan<double>& plan, const double* q,
                                 FreeJoints free, double smallest) {
  ConstraintRanks found;
  Workspace<double> workspace(plan);
  const std::vector<double> rest(static_cast<std::size_t>(plan.nv));
  compiled_ground_motion(plan, workspace, q, rest.data());
  for (const ClusterPlan& cluster : plan.clusters) {
    ClusterRows<double> rows(model, plan, workspace, cluster, free);
    rows.set_pose(q);
    rows.measure();
    rows.set_rows();
    const auto& J = rows.jacobian();
    const bool independent = RowFactor(J, 0, RowFactor::independent, 100 * smallest * smallest).is_complete();
    const Eigen::Index rank =
        independent ? J.rows() : CompletePivoting(J, J.cols(), smallest, J.cols()).rank();
    found.ranks.push_back(static_cast<int>(rank));
    found.joints.push_back(static_cast<int>(J.cols()));
    found.are_full = found.are_full && rank == std::min(J.rows(), J.cols());
    found.gap = std::max(found.gap, rows.residuals().lpNorm<Eigen::Infinity>());
  }
  return found;
}

Freedom freedom(const Model& model, const Plan<double>& plan, const double* q) {
  const auto rank = [&](FreeJoints free) {
    const std::vector<int> ranks = constraint_ranks(model, plan, q, free, dependent).ranks;
    return std::accumulate(ranks.begin(), ranks.end(), 0);
  };
  // the chart joint of a spherical joint is prescribed, but not a degree of freedom
  const int charts = static_cast<int>(plan.balls.size());
  Freedom result;
  result.motions = plan.prescribed_count - charts;
  result.left = plan.nv - plan.prescribed_count - rank(FreeJoints::integrated);
  result.system = plan.nv - charts - rank(FreeJoints::all);
  result.surplus = result.motions + result.left - result.system;
  return result;
}

}  // namespace redysim
