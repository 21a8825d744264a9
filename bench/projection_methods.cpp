// Comparison of four stabilisation methods for closed loops: one embedded Runge-Kutta method (Dormand and
// Prince 1980, 5(4)) with elementary step size control and the same right-hand side. Prints the table of
// docs/derivations/loops.md.
//
//     projection_methods [MODEL [END [STEP]]]      default: four_bar, 10 s, communication step size 0.1 s

#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <string>
#include <vector>

#include "dynamics/loops/loop_correction.hpp"
#include "integrate/system/system.hpp"
#include "model/read/model_file.hpp"

using namespace redysim;

namespace {

enum class Treatment { none, baumgarte, communication_step, each_step };
constexpr const char* names[] = {"none", "Baumgarte 10", "once per communication step", "after each step"};

constexpr double c[7] = {0, 0.2, 0.3, 0.8, 8.0 / 9, 1, 1};
constexpr double a[7][6] = {{},
                            {0.2},
                            {3.0 / 40, 9.0 / 40},
                            {44.0 / 45, -56.0 / 15, 32.0 / 9},
                            {19372.0 / 6561, -25360.0 / 2187, 64448.0 / 6561, -212.0 / 729},
                            {9017.0 / 3168, -355.0 / 33, 46732.0 / 5247, 49.0 / 176, -5103.0 / 18656},
                            {35.0 / 384, 0, 500.0 / 1113, 125.0 / 192, -2187.0 / 6784, 11.0 / 84}};
constexpr double e[7] = {71.0 / 57600,      0,          -71.0 / 16695, 71.0 / 1920,
                         -17253.0 / 339200, 22.0 / 525, -1.0 / 40};

struct Run {
  double gap = 0, energy = 0, kinetic = 0, milliseconds = 0;
  long evaluations = 0;
  std::vector<double> y;
};

class Integration {
 public:
  Integration(const Plan<double>& plan, Treatment treatment, double rtol, double communication_step)
      : system_(plan, false),
        treatment_(treatment),
        rtol_(rtol),
        communication_step_(communication_step),
        delta_(static_cast<std::size_t>(plan.nv)) {}

  Run run(std::vector<double> y, double end) {
    Run result;
    const std::size_t n = y.size();
    std::vector<std::vector<double>> k(7, std::vector<double>(n));
    std::vector<double> stage(n), error(n);
    const double energy = total_energy(y);
    double h = 1e-4;
    const auto begin = std::chrono::steady_clock::now();
    const int outputs = static_cast<int>(std::lround(end / communication_step_));
    for (int output = 1; output <= outputs; ++output) {
      double time = (output - 1) * communication_step_;
      const double stop = output * communication_step_;
      slope(time, y, k[0]);
      while (time < stop) {
        const double step = std::min(h, stop - time);
        for (int s = 1; s < 7; ++s) {
          for (std::size_t i = 0; i < n; ++i) {
            stage[i] = y[i];
            for (int j = 0; j < s; ++j) stage[i] += step * a[s][j] * k[j][i];
          }
          slope(time + c[s] * step, stage, k[s]);
        }
        for (std::size_t i = 0; i < n; ++i) {
          error[i] = 0;
          for (int s = 0; s < 7; ++s) error[i] += step * e[s] * k[s][i];
        }
        std::vector<double> next = stage;
        if (treatment_ == Treatment::each_step) system_.project(time + step, next.data(), error.data());
        double norm = 0;
        for (std::size_t i = 0; i < n; ++i)
          norm +=
              std::pow(error[i] / (rtol_ * std::max(std::abs(y[i]), std::abs(next[i])) + 0.01 * rtol_), 2);
        norm = std::sqrt(norm / static_cast<double>(n));
        h = step * std::clamp(0.9 * std::pow(std::max(norm, 1e-10), -0.2), 0.2, 5.0);
        if (norm > 1) continue;
        time += step;
        if (stop - time < 1e-12) time = stop;
        y = next;
        if (treatment_ == Treatment::each_step)
          slope(time, y, k[0]);
        else
          k[0] = k[6];
      }
      if (treatment_ == Treatment::communication_step) system_.project(stop, y.data(), nullptr);
      slope(stop, y, k[0]);
      --extra_;
      for (double residual : system_.workspace().loop.residual)
        result.gap = std::max(result.gap, std::abs(residual));
      result.kinetic = std::max(result.kinetic, system_.kinetic_energy(stop, y.data()));
      result.energy = std::max(result.energy, std::abs(total_energy(y) - energy));
    }
    result.milliseconds =
        std::chrono::duration<double, std::milli>(std::chrono::steady_clock::now() - begin).count();
    result.evaluations = system_.evaluations() + extra_;
    result.y = y;
    return result;
  }

 private:
  void slope(double time, const std::vector<double>& y, std::vector<double>& ydot) {
    system_.right_hand_side(time, y.data(), ydot.data());
    if (treatment_ != Treatment::baumgarte) return;
    // phi'' + 2 alpha phi' + alpha^2 phi = 0 with alpha = 10 1/s
    constexpr double alpha = 10;
    LoopState<double>& loop = system_.workspace().loop;
    for (std::size_t row = 0; row < loop.b.size(); ++row)
      loop.b[row] = -2 * alpha * loop.rate[row] - alpha * alpha * loop.residual[row];
    correct_loops(system_.plan(), system_.workspace(), delta_.data());
    for (int i = 0; i < system_.nv(); ++i) ydot[system_.layout().qd[i]] += delta_[system_.joint_of(i)];
  }

  double total_energy(const std::vector<double>& y) {
    return system_.kinetic_energy(0, y.data()) + system_.potential_energy(0, y.data());
  }

  System system_;
  Treatment treatment_;
  double rtol_, communication_step_;
  std::vector<double> delta_;
  long extra_ = 0;  // evaluations for the output only
};

}  // namespace

int main(int count, char** arguments) {
  const std::string model_name = count > 1 ? arguments[1] : "four_bar";
  const double end = count > 2 ? std::atof(arguments[2]) : 10;
  const double step = count > 3 ? std::atof(arguments[3]) : 0.1;
  const Model model = read_model_file(std::string(REDYSIM_MODELS "/") + model_name + ".toml").model;
  const Plan<double> plan(model);
  std::vector<double> start;
  for (const auto& joint : plan.joints) start.push_back(model.links[joint.link].joint.q0);
  for (const auto& joint : plan.joints) start.push_back(model.links[joint.link].joint.qd0);
  // final q of a run at the tightest tolerance of double precision
  const std::vector<double> truth = Integration(plan, Treatment::each_step, 1e-13, step).run(start, end).y;
  std::printf(
      "| rtol | method | gap, m | energy error | error of q | evaluations | ms |\n| --- | --- | --- | "
      "--- | --- | --- | --- |\n");
  for (double rtol : {1e-4, 1e-6, 1e-8, 1e-10})
    for (Treatment treatment :
         {Treatment::none, Treatment::baumgarte, Treatment::communication_step, Treatment::each_step}) {
      Run best;
      best.milliseconds = 1e300;
      for (int repeat = 0; repeat < 5; ++repeat) {
        const Run run = Integration(plan, treatment, rtol, step).run(start, end);
        if (run.milliseconds < best.milliseconds) best = run;
      }
      double error = 0;
      for (int i = 0; i < plan.nv; ++i) error = std::max(error, std::abs(best.y[i] - truth[i]));
      std::printf("| %.0e | %s | %.1e | %.1e | %.1e | %ld | %.2f |\n", rtol,
                  names[static_cast<int>(treatment)], best.gap, best.energy / best.kinetic, error,
                  best.evaluations, best.milliseconds);
    }
}
