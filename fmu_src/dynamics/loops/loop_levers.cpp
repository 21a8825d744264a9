#include "dynamics/loops/loop_levers.hpp"

#include <algorithm>
#include <cmath>

#include "dynamics/motion_subspace.hpp"

namespace redysim {
namespace {

constexpr double clear_pivot = 1e-4;  // squared sine of the angle between a row and the preceding ones

// A force through a point and a moment, in ground axes.
struct Line {
  Vec3<double> point, force, moment;
};

// Adds the levers of a wrench on a body to the column `row` of J^T, times the units of the joints.
void add_levers(const Plan<double>& plan, const Workspace<double>& ws, int body, int root, const Line& line,
                double sign, double* column, std::size_t rows) {
  for (; body != root; body = plan.joints[body].parent) {
    const JointPlan<double>& joint = plan.joints[body];
    if (joint.prescribed) continue;
    const GroundState<double>& state = ws.ground[body];
    const Vec3<double> axis = state.rotation.col(2);
    double lever = 0;
    if (turns(joint)) lever = axis.dot(line.moment + (line.point - state.position).cross(line.force));
    if (slides(joint)) lever += advance(joint) * axis.dot(line.force);
    column[static_cast<std::size_t>(body) * rows] += sign * plan.joint_units[body] * lever;
  }
}

void add_row(const Plan<double>& plan, const Workspace<double>& ws, const LoopPlan<double>& loop,
             const LoopGeometry<double>& g, const ConstraintRow<double>& row, double* column,
             std::size_t rows) {
  Line on_a{g.point_b.position, Vec3<double>::Zero(), Vec3<double>::Zero()}, on_b = on_a;
  if (row.kind == ConstraintRow<double>::Kind::rotation) {
    on_b.moment = product(g.b.rotation, row.v).cross(product(g.a.rotation, row.u));
    on_a.moment = on_b.moment;
  } else {
    const bool on_body = row.kind == ConstraintRow<double>::Kind::position_on_a;
    on_a.force = on_b.force = on_body ? product(g.a.rotation, row.u) : row.u;
    if (!on_body) on_a.point = g.point_a.position;
  }
  add_levers(plan, ws, loop.body_a, loop.root, on_a, -1, column, rows);
  add_levers(plan, ws, loop.body_b, loop.root, on_b, 1, column, rows);
}

// Replaces a symmetric matrix (lower part) by its Cholesky factor. False: a pivot is small compared with its
// diagonal.
bool factor(double* matrix, std::size_t n) {
  for (std::size_t i = 0; i < n; ++i) {
    double* const row = matrix + i * n;
    const double whole = row[i];
    for (std::size_t j = 0; j <= i; ++j) {
      const double* const other = matrix + j * n;
      for (std::size_t k = 0; k < j; ++k) row[j] -= row[k] * other[k];
      if (j < i) row[j] /= other[j];
    }
    if (!(row[i] > clear_pivot * whole)) return false;
    row[i] = std::sqrt(row[i]);
  }
  return true;
}

}  // namespace

bool factor_levers(const Plan<double>& plan, const Workspace<double>& ws, double* levers, double* gram) {
  const std::size_t rows = ws.loop.b.size(), joints = plan.joints.size();
  std::fill_n(levers, joints * rows, 0.0);
  std::fill_n(gram, rows * rows, 0.0);
  for (const LoopPlan<double>& loop : plan.loops) {
    const LoopGeometry<double> geometry = loop_geometry(loop, ws);
    for (std::size_t k = 0; k < loop.rows.size(); ++k)
      add_row(plan, ws, loop, geometry, loop.rows[k], levers + loop.first_row + k, rows);
  }
  for (std::size_t i = 0; i < joints; ++i)
    for (std::size_t r = 0; r < rows; ++r)
      for (std::size_t s = 0; s <= r; ++s) gram[r * rows + s] += levers[i * rows + r] * levers[i * rows + s];
  for (std::size_t i = 0; i < joints; ++i)
    for (std::size_t r = 0; r < rows; ++r) levers[i * rows + r] *= plan.joint_units[i];
  return factor(gram, rows);
}

void solve_levers(const double* gram, std::vector<double>& x) {
  const std::size_t n = x.size();
  for (std::size_t i = 0; i < n; ++i) {
    for (std::size_t k = 0; k < i; ++k) x[i] -= gram[i * n + k] * x[k];
    x[i] /= gram[i * n + i];
  }
  for (std::size_t i = n; i-- > 0;) {
    for (std::size_t k = i + 1; k < n; ++k) x[i] -= gram[k * n + i] * x[k];
    x[i] /= gram[i * n + i];
  }
}

}  // namespace redysim
