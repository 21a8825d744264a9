#include "integrate/methods/slope_time.hpp"

#include "model/features.hpp"

namespace redysim {
namespace {

// Overhead of a step per right-hand side, in right-hand sides: fixed / size + share, plus `loops` if there
// are constraints. Measured with bench/stepping.
struct Surroundings {
  double fixed, share, loops;
};

constexpr Surroundings of_erk = {0.9, 0.02, 0.3}, of_adams = {5.2, 0.2, 1.5}, of_bdf = {5.2, 0.6, 2.4},
                       of_dirk = {2.5, 0.65, 0};
// cost of a constraint row, or a force between bodies, in joints
constexpr std::size_t row = 3;
// cost of straight-line code relative to the recursion (docs/specialise.md)
constexpr double straight = !features::straight_line ? 1 : features::loops ? 0.12 : 0.35;
constexpr double of_series = 0.8;  // cost of one order of a Taylor series

double with_surroundings(const System& system, const Surroundings& of) {
  const Plan<double>& plan = system.plan();
  std::size_t rows = plan.springs.size() + plan.bushings.size() + plan.contact_pairs.size();
  double share = 1 + of.share;
  if (plan.has_constraints()) {
    rows += static_cast<std::size_t>(plan.clusters.back().first_row + plan.clusters.back().row_count);
    share += of.loops;
  }
  return share + of.fixed / (straight * static_cast<double>(plan.joints.size() + row * rows));
}

}  // namespace

double slope_time(const System& system, SolverMethod method) {
  if (method == SolverMethod::taylor) return of_series;
  const Surroundings* of = method == SolverMethod::adams  ? &of_adams
                           : method == SolverMethod::bdf  ? &of_bdf
                           : method == SolverMethod::dirk ? &of_dirk
                                                          : &of_erk;
  return with_surroundings(system, *of) / with_surroundings(system, of_erk);
}

}  // namespace redysim
