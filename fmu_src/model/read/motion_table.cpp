#include "model/read/motion_table.hpp"

#include <algorithm>
#include <cmath>
#include <cstdlib>

#include "math/cubic_spline.hpp"
#include "model/number.hpp"
#include "model/read/csv.hpp"

namespace redysim {
namespace {

constexpr double rounding = 1e-12;  // relative to the maximum of a column

// Whether row k has the same time as row k - 1; the acceleration then jumps between them.
bool is_jump(const MotionTable& table, std::size_t k) {
  return k > 0 && k < table.time.size() && table.time[k] == table.time[k - 1];
}

// Weight of the interval after knot k in the averaged acceleration at k. If the acceleration differs by d
// from that of the cubic of an interval of length h, the polynomial deviates from the cubic by a multiple of
// d h^2. Weights proportional to h^4 minimize the sum of the squared deviations of both intervals, so that a
// long rest beside a short motion remains at rest.
double weight_after(const MotionTable& table, std::size_t k) {
  if (k == 0 || is_jump(table, k)) return 1;
  if (k + 1 == table.time.size() || is_jump(table, k + 1)) return 0;
  const double ratio = (table.time[k] - table.time[k - 1]) / (table.time[k + 1] - table.time[k]);
  return static_cast<float>(1 / (1 + std::pow(ratio, 4)));  // 1/2 for lengths that differ only by rounding
}

// At each knot, the weighted mean acceleration of the cubics before and after it, which match q and qd at
// both of their ends. At a jump, the acceleration of the cubic on the same side.
std::vector<double> mean_accelerations(const MotionTable& table) {
  const std::size_t n = table.time.size();
  std::vector<double> sum(n, 0.0);
  for (std::size_t k = 0; k + 1 < n; ++k) {
    if (is_jump(table, k + 1)) continue;
    const double h = table.time[k + 1] - table.time[k];
    const double slope = 6 * (table.q[k + 1] - table.q[k]) / (h * h);
    sum[k] += weight_after(table, k) * (slope - (4 * table.qd[k] + 2 * table.qd[k + 1]) / h);
    sum[k + 1] += (1 - weight_after(table, k + 1)) * ((2 * table.qd[k] + 4 * table.qd[k + 1]) / h - slope);
  }
  return sum;
}

// Column indices of a table; -1: absent.
struct Columns {
  int time = -1, q = -1, qd = -1, qdd = -1;
  std::string repeated;  // name of several columns

  Columns() = default;
  Columns(const std::vector<std::string>& names, const std::string& joint) {
    const auto find = [&](const std::string& name) {
      int found = -1;
      for (std::size_t i = 0; i < names.size(); ++i) {
        if (names[i] != name) continue;
        if (found >= 0) repeated = name;
        found = static_cast<int>(i);
      }
      return found;
    };
    const auto of_joint = [&](const std::string& what) {
      const int own = find(joint + "." + what);
      return own >= 0 ? own : find(what);
    };
    time = find("time");
    q = of_joint("q");
    qd = of_joint("qd");
    qdd = of_joint("qdd");
  }
};

// Error of rows k - 1 and k, which have the same time; empty if they are valid.
std::string jump_objection(const MotionTable& table, std::size_t k) {
  const std::string at = "at time " + shown(table.time[k]);
  if (is_jump(table, k - 1))
    return "a table must have at most two rows " + at + "; the acceleration jumps there";
  if (k == 1 || k + 1 == table.time.size())
    return "a table must have one row " + at + ", its " + (k == 1 ? "start" : "end") +
           "; the acceleration may jump there anyway";
  if (table.qd.empty()) return "two rows " + at + " require qd";
  const std::pair<const char*, const std::vector<double>*> columns[] = {{"q", &table.q}, {"qd", &table.qd}};
  for (const auto& [name, column] : columns) {
    const double one = (*column)[k - 1], other = (*column)[k];
    double largest = 0;
    for (double value : *column) largest = std::max(largest, std::abs(value));
    if (!(std::abs(other - one) <= rounding * largest))
      return "two rows " + at + " must have the same " + name + ", got " + shown(one) + " and " +
             shown(other) + "; only the acceleration may jump";
  }
  return {};
}

}  // namespace

std::string objection(const MotionTable& table) {
  const std::size_t n = table.time.size();
  if (n < 2) return "a table must have at least 2 rows, got " + std::to_string(n);
  const std::pair<const char*, const std::vector<double>*> columns[] = {
      {"time", &table.time}, {"q", &table.q}, {"qd", &table.qd}, {"qdd", &table.qdd}};
  for (const auto& [name, column] : columns) {
    const bool optional = column == &table.qd || column == &table.qdd;
    if (column->size() != n && !(optional && column->empty()))
      return std::string(name) + " must be as long as time, " + std::to_string(n) + " numbers, got " +
             std::to_string(column->size());
    for (double value : *column)
      if (!std::isfinite(value)) return std::string(name) + " must be finite, got " + shown(value);
  }
  if (table.qd.empty() && !table.qdd.empty()) return "qdd requires qd";
  for (std::size_t k = 1; k < n; ++k) {
    if (!(table.time[k] >= table.time[k - 1]))
      return "time must increase from row to row, got " + shown(table.time[k]) + " after " +
             shown(table.time[k - 1]);
    const std::string why = is_jump(table, k) ? jump_objection(table, k) : "";
    if (!why.empty()) return why;
  }
  return {};
}

std::vector<double> quintic(double h, const double (&start)[3], const double (&end)[3]) {
  // deviations at the end from the parabola through the start: position, h velocity and h^2 acceleration
  const double dq = end[0] - start[0] - h * (start[1] + 0.5 * h * start[2]);
  const double dqd = h * (end[1] - start[1] - h * start[2]);
  const double dqdd = h * h * (end[2] - start[2]);
  const double h3 = h * h * h;
  return {start[0],
          start[1],
          0.5 * start[2],
          (10 * dq - 4 * dqd + 0.5 * dqdd) / h3,
          (-15 * dq + 7 * dqd - dqdd) / (h3 * h),
          (6 * dq - 3 * dqd + 0.5 * dqdd) / (h3 * h * h)};
}

std::vector<double> cubic(double h, double q_start, double qd_start, double q_end, double qd_end) {
  const double miss = q_end - q_start - h * qd_start, rate = h * (qd_end - qd_start);
  return {q_start, qd_start, (3 * miss - rate) / (h * h), (rate - 2 * miss) / (h * h * h)};
}

void interpolate(const MotionTable& table, Trajectory& trajectory) {
  const std::vector<double>&t = table.time, &q = table.q;
  const std::vector<double> qd = table.qd.empty() ? spline_slopes(t, q) : table.qd;
  const std::vector<double> qdd = table.qd.empty()    ? std::vector<double>()
                                  : table.qdd.empty() ? mean_accelerations(table)
                                                      : table.qdd;
  trajectory.begin = t.front();
  trajectory.end = t.back();
  std::vector<Trajectory::Piece>& pieces = trajectory.pieces;
  for (std::size_t k = 0; k + 1 < t.size(); ++k) {
    if (is_jump(table, k + 1)) {
      trajectory.jumps.push_back(pieces.size());
      continue;
    }
    const double h = t[k + 1] - t[k];
    if (qdd.empty())
      pieces.push_back({t[k], cubic(h, q[k], qd[k], q[k + 1], qd[k + 1])});
    else
      pieces.push_back({t[k], quintic(h, {q[k], qd[k], qdd[k]}, {q[k + 1], qd[k + 1], qdd[k + 1]})});
  }
}

std::string read_csv(const std::string& text, const std::string& joint, MotionTable& table) {
  std::vector<std::string> names;
  Columns columns;
  std::size_t line_number = 0;
  for (std::size_t at = 0; at < text.size();) {
    const std::size_t end = std::min(text.find('\n', at), text.size());
    const std::vector<std::string> row = csv_cells(text.substr(at, end - at));
    at = end + 1;
    ++line_number;
    if (row.size() == 1 && row[0].empty()) continue;
    if (!row[0].empty() && row[0].front() == '#') continue;
    if (names.empty()) {
      names = row;
      columns = Columns(names, joint);
      continue;
    }
    if (columns.time < 0) return "has no column 'time' in its header";
    if (columns.q < 0) return "has no column '" + joint + ".q' or 'q' in its header";
    if (!columns.repeated.empty()) return "repeats column '" + columns.repeated + "'";
    const std::pair<int, std::vector<double>*> wanted[] = {{columns.time, &table.time},
                                                           {columns.q, &table.q},
                                                           {columns.qd, &table.qd},
                                                           {columns.qdd, &table.qdd}};
    for (const auto& [column, values] : wanted) {
      if (column < 0) continue;
      double value = 0;
      if (static_cast<std::size_t>(column) >= row.size() || !csv_number(row[column], value))
        return "has no number in column '" + names[column] + "' of line " + std::to_string(line_number);
      values->push_back(value);
    }
  }
  return {};
}

}  // namespace redysim
