#include "dynamics/loops/loop_levers.hpp"

#include <algorithm>
#include <cmath>

#include "dynamics/motion_subspace.hpp"

namespace redysim {
namespace {

constexpr double clear_pivot = 1e-4;  // squared sine of a row to the preceding ones, of a lever to its bound

// A force through a point and a moment, in ground axes.
struct Line {
  Vec3<double> point, force, moment;
};

// U J^T, nv x rows.
class Levers {
 public:
  Levers(const Plan<double>& plan, const Workspace<double>& ws, double* entries)
      : plan_(plan), ws_(ws), entries_(entries), rows_(ws.loop.b.size()) {}

  // Returns a squared bound of the levers, with the links stretched: the levers themselves may all be
  // rounding errors, for example across the plane of a mechanism.
  double add_row(const LoopPlan<double>& loop, const LoopGeometry<double>& g, std::size_t k) {
    squared_path_ = 0;
    const ConstraintRow<double>& row = loop.rows[k];
    column_ = entries_ + loop.first_row + k;
    Line on_a{g.point_b.position, Vec3<double>::Zero(), Vec3<double>::Zero()}, on_b = on_a;
    if (row.kind == ConstraintRow<double>::Kind::rotation) {
      on_b.moment = product(g.b.rotation, row.v).cross(product(g.a.rotation, row.u));
      on_a.moment = on_b.moment;
    } else {
      const bool on_body = row.kind == ConstraintRow<double>::Kind::position_on_a;
      on_a.force = on_b.force = on_body ? product(g.a.rotation, row.u) : row.u;
      if (!on_body) on_a.point = g.point_a.position;
    }
    add_path(loop.body_a, loop.root, on_a, -1);
    add_path(loop.body_b, loop.root, on_b, 1);
    return row.kind == ConstraintRow<double>::Kind::rotation ? 1 : squared_path_;
  }

 private:
  void add_path(int body, int root, const Line& line, double sign) {
    Vec3<double> end = line.point;
    for (; body != root; body = plan_.joints[body].parent) {
      const JointPlan<double>& joint = plan_.joints[body];
      const GroundState<double>& state = ws_.ground[body];
      squared_path_ += (state.position - end).squaredNorm();
      end = state.position;
      if (joint.prescribed) continue;
      const Vec3<double> axis = state.rotation.col(2);
      double lever = 0;
      if (turns(joint)) lever = axis.dot(line.moment + (line.point - state.position).cross(line.force));
      if (slides(joint)) lever += advance(joint) * axis.dot(line.force);
      column_[static_cast<std::size_t>(body) * rows_] += sign * plan_.joint_units[body] * lever;
    }
  }

  const Plan<double>& plan_;
  const Workspace<double>& ws_;
  double *entries_, *column_ = nullptr;
  std::size_t rows_;
  double squared_path_ = 0;  // sum over the links
};

// Replaces a symmetric matrix (lower part) by its Cholesky factor. False: a pivot is small compared with its
// diagonal or the bound of its row.
bool factor(double* matrix, std::size_t n) {
  const double* const squared_bound = matrix + n * n;
  for (std::size_t i = 0; i < n; ++i) {
    double* const row = matrix + i * n;
    const double whole = row[i];
    for (std::size_t j = 0; j <= i; ++j) {
      const double* const other = matrix + j * n;
      for (std::size_t k = 0; k < j; ++k) row[j] -= row[k] * other[k];
      if (j < i) row[j] /= other[j];
    }
    if (!(row[i] > clear_pivot * std::max(whole, squared_bound[i]))) return false;
    row[i] = std::sqrt(row[i]);
  }
  return true;
}

}  // namespace

bool factor_levers(const Plan<double>& plan, const Workspace<double>& ws, double* levers, double* gram) {
  const std::size_t rows = ws.loop.b.size(), joints = plan.joints.size();
  std::fill_n(levers, joints * rows, 0.0);
  std::fill_n(gram, rows * rows, 0.0);
  Levers scaled(plan, ws, levers);
  for (const LoopPlan<double>& loop : plan.loops) {
    const LoopGeometry<double> geometry = loop_geometry(loop, ws);
    for (std::size_t k = 0; k < loop.rows.size(); ++k)
      gram[rows * rows + loop.first_row + k] = scaled.add_row(loop, geometry, k);
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
