#include "dynamics/assembly/freedom.hpp"

#include <vector>

#include "dynamics/compiled.hpp"
#include "dynamics/input_layout.hpp"
#include "dynamics/loops/loop_elimination.hpp"

namespace redysim {
namespace {

// Rank of the loop rows with respect to the joints that are not prescribed, that of J M^-1 J^T for any M > 0.
int rank_of_loops(const Model& model, const Parameters<double>& parameters, const double* q) {
  const Plan<double> plan(model, parameters);
  Workspace<double> ws(plan);
  const std::vector<double> rest(static_cast<std::size_t>(InputLayout(plan).recursion_size()), 0.0);
  std::vector<double> qdd(static_cast<std::size_t>(plan.nv));
  compiled_forward_dynamics(plan, ws, q, rest.data(), rest.data(), qdd.data());
  return loop_rank(plan, ws);
}

}  // namespace

Freedom freedom(const Model& model, const Parameters<double>& parameters, const double* q) {
  Model any = model;
  any.actuators.clear();  // rotors
  Parameters<double> with_armature = parameters;
  Freedom result;
  int joints = 0;
  // the chart joint of a spherical joint is not a degree of freedom
  std::vector<char> moving;
  for (const Link& link : any.links) moving.push_back(moves(link.joint));
  for (const Ball& ball : any.balls) moving[ball.chart_link] = false;
  for (std::size_t i = 0; i < any.links.size(); ++i) {
    Link& link = any.links[i];
    if (!moving[i]) continue;
    ++joints;
    if (link.joint.drive == Drive::motion || link.joint.drive == Drive::locked) ++result.motions;
    // M > 0: the rank is that of the rows alone
    with_armature.joints[i].armature = 1;
  }
  result.left = joints - result.motions - rank_of_loops(any, with_armature, q);
  for (std::size_t i = 0; i < any.links.size(); ++i)
    if (moving[i]) any.links[i].joint.drive = Drive::free;
  result.system = joints - rank_of_loops(any, with_armature, q);
  result.surplus = result.motions + result.left - result.system;
  return result;
}

}  // namespace redysim
