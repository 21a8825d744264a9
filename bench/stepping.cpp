// Right-hand sides against error: one model with one kind of inputs, several methods and tolerances.
//
//     stepping MODEL.toml [KEY=VALUE]...
//
//     method=erk,adams,dirk,bdf,auto,bdf-dq    methods; bdf-dq: CVODE BDF with its own difference Jacobian
//     rtol=1e-6,...                            relative tolerances
//     step=0.01                                time between outputs, s
//     end=1                                    end time, s
//     drive=rest|wave|square                   inputs: 0; amplitude sin(...) held over each step;
//                                              +-amplitude with alternating sign at each step
//     hold=1                                   communication steps between two changes of the inputs
//     arm=0.05                                 the amplitude holds the outboard mass at this lever arm, m
//     after=T                                  the error is evaluated from this time on
//     reference=erk                            method of the reference, at reference_rtol=1e-13
//     keep=FILE                                the reference is kept in this file
//     limit=N                                  a run with more right-hand sides is stopped, and those of the
//                                              same method at the tolerances after it; 0: none
//     log=on|off                               on: the last decision of auto in each communication step
//     clock=on|off                             off: work without a clock: a Jacobian counts as 1.5 right-hand
//                                              sides per state, a right-hand side as with slope_time.hpp
//
// One line per run: method, rtol, right-hand sides, Jacobians, work (right-hand sides, with Jacobians by CPU
// time, or without a clock), accepted and rejected steps, error of positions (maximum over joints and
// outputs), of velocities, energy balance error (relative to the maximum kinetic energy), CPU time in s, 50th
// and 99th percentile of the right-hand sides (with Jacobians) of a communication step.

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <ctime>
#include <fstream>
#include <map>
#include <sstream>
#include <stdexcept>
#include <string>
#include <vector>

#include "difference_bdf.hpp"
#include "integrate/methods/integrator.hpp"
#include "integrate/methods/slope_time.hpp"
#include "integrate/methods/tuning.hpp"
#include "integrate/system/dense_jacobian.hpp"
#include "integrate/system/start.hpp"
#include "model/read/model_file.hpp"
#include "model/solver_methods.hpp"

using namespace redysim;

namespace {

struct Options {
  std::map<std::string, std::string> values = {
      {"method", "erk"},    {"rtol", "1e-6"}, {"step", "0.01"}, {"end", "1"},
      {"drive", "rest"},    {"arm", "0.05"},  {"hold", "1"},    {"after", "0"},
      {"reference", "erk"}, {"keep", ""},     {"limit", "0"},   {"reference_rtol", "1e-13"},
      {"clock", "on"},      {"log", "off"}};

  double number(const std::string& key) const { return std::atof(values.at(key).c_str()); }
  std::vector<std::string> list(const std::string& key) const {
    std::vector<std::string> parts;
    std::istringstream text(values.at(key));
    for (std::string part; std::getline(text, part, ',');) parts.push_back(part);
    return parts;
  }
};

SolverMethod method_called(const std::string& name) {
  SolverMethod method;
  if (!parse_method(name.c_str(), method)) throw std::runtime_error("there is no method " + name);
  return method;
}

// The start state of the FMU.
std::vector<double> start_of(const Model& model, System& system) {
  std::vector<double> y(static_cast<std::size_t>(system.size()), 0.0);
  begin_motions(model, system, 0);
  if (!assemble_start(model, parameters_of(model), system, 0, y.data()).assembly.closed)
    throw std::runtime_error("the loops do not close at the start");
  return y;
}

struct Run {
  std::vector<std::vector<double>> states;  // at the outputs, from `after` on
  long evaluations = 0, jacobians = 0, steps = 0, rejected = 0;
  double work = 0;  // right-hand sides, see Account
  double balance = 0, seconds = 0;
  std::vector<double> costs;  // right-hand sides of each communication step
  std::string stopped;        // reason

  // The share of communication steps that cost at most this.
  double percentile(double share) const {
    if (costs.empty()) return 0;
    std::vector<double> sorted = costs;
    std::sort(sorted.begin(), sorted.end());
    return sorted[static_cast<std::size_t>(share * static_cast<double>(sorted.size() - 1))];
  }
};

// How work is counted.
struct Account {
  double jacobian = 0;   // in right-hand sides
  bool by_clock = true;  // false: what surrounds right-hand sides counts by estimate

  double slope(const System& system, SolverMethod method) const {
    return by_clock ? 1 : slope_time(system, method);
  }
  double work(const Statistics& statistics, double slope) const {
    return slope * static_cast<double>(statistics.evaluations) +
           jacobian * static_cast<double>(statistics.jacobians) + (by_clock ? 0 : statistics.other_work);
  }
};

const char* const limit_reached = "limit of right-hand sides";
constexpr long pause = 1000;  // internal steps between two looks at the limit

class Scene {
 public:
  Scene(const std::string& file, const Options& options)
      : model_(read_model_file(file).model),
        plan_(model_),
        step_(options.number("step")),
        after_(options.number("after")),
        steps_(std::lround(options.number("end") / step_)),
        hold_(std::max(1L, std::lround(options.number("hold")))),
        limit_(std::lround(options.number("limit"))),
        log_(options.values.at("log") == "on"),
        drive_(options.values.at("drive")) {
    std::vector<double> carried;
    for (const Link& link : model_.links) carried.push_back(link.mass);
    for (std::size_t i = carried.size(); i-- > 0;)
      if (model_.links[i].parent >= 0) carried[model_.links[i].parent] += carried[i];
    for (int i = 0; i < plan_.nv; ++i) {
      const JointPlan<double>& joint = plan_.joints[i];
      const bool driven =
          !joint.prescribed && !joint.of_ball && model_.links[joint.link].joint.drive == Drive::torque;
      amplitudes_.push_back(driven ? 9.81 * options.number("arm") * carried[joint.link] : 0);
    }
  }

  Run run(const std::string& method, double rtol, const Account& account) const {
    System system(plan_, true, &model_);
    SolverSettings settings = model_.solver;
    settings.method = method_called(method == "bdf-dq" ? "bdf" : method);
    settings.rtol = rtol;
    settings.atol = rtol / 100;
    const std::vector<double> y = start_of(model_, system);
    const std::unique_ptr<Integrator> integrator =
        method == "bdf-dq" ? make_difference_bdf(system, settings) : make_integrator(system, settings);
    Run result;
    const Statistics& statistics = integrator->statistics();
    const double slope = account.slope(system, settings.method);
    const auto work = [&] { return account.work(statistics, slope); };
    if (limit_ > 0) integrator->pause_after(pause);
    long decisions = 0;
    integrator->start(0, y.data());
    const double energy = system.kinetic_energy(0, y.data()) + system.potential_energy(0, y.data());
    double moving = 0, worst = 0;
    std::clock_t used = 0;
    for (long k = 1; k <= steps_; ++k) {
      bool changed = set_inputs(system, k) || k == 1;
      const double end = static_cast<double>(k) * step_, before = work();
      const std::clock_t begin = std::clock();
      Outcome outcome;
      while (outcome.ok && integrator->time() < end) {
        outcome = advance(*integrator, system, end, changed);
        changed = false;
        if (log_ && integrator->decisions() != decisions)
          std::printf("# %s\n", integrator->last_decision().c_str());
        decisions = integrator->decisions();
        if (limit_ > 0 && statistics.evaluations > limit_) outcome = {false, limit_reached};
      }
      used += std::clock() - begin;
      result.costs.push_back(work() - before);
      if (!outcome.ok) {
        result.stopped = outcome.message;
        break;
      }
      const double* now = integrator->state();
      if (end >= after_) result.states.emplace_back(now, now + system.layout().work.begin);
      const double kinetic = system.kinetic_energy(end, now);
      moving = std::max(moving, kinetic);
      worst =
          std::max(worst, std::fabs(kinetic + system.potential_energy(end, now) - energy - system.work(now)));
    }
    result.evaluations = statistics.evaluations;
    result.steps = statistics.steps;
    result.rejected = statistics.rejected;
    result.jacobians = statistics.jacobians;
    result.work = work();
    result.balance = moving > 0 ? worst / moving : 0;
    result.seconds = static_cast<double>(used) / CLOCKS_PER_SEC;
    return result;
  }

  // CPU time of an exact Jacobian in right-hand sides, without the one that it counts itself.
  double jacobian_cost() const {
    System system(plan_, true, &model_);
    const std::vector<double> y = start_of(model_, system);
    DenseJacobian jacobian(system);
    std::vector<double> slope(y.size()), matrix(y.size() * y.size());
    const double slope_time = quickest([&] { system.right_hand_side(0, y.data(), slope.data()); });
    std::printf("# a right-hand side takes %.0f ns\n", slope_time / 200 * 1e9 / CLOCKS_PER_SEC);
    const double matrix_time = quickest([&] { jacobian.evaluate(0, y.data(), matrix.data()); });
    return matrix_time / slope_time - 1;
  }

  int positions() const { return System(plan_, false, &model_).nq(); }
  int states() const { return System(plan_, false, &model_).size(); }

 private:
  template <class Call>
  static double quickest(const Call& call) {
    double best = 1e300;
    for (int repeat = 0; repeat < 20; ++repeat) {
      const std::clock_t begin = std::clock();
      for (int k = 0; k < 200; ++k) call();
      best = std::min(best, static_cast<double>(std::clock() - begin));
    }
    return best;
  }

  bool set_inputs(System& system, long k) const {
    if (drive_ == "rest" || (k - 1) % hold_ != 0) return false;
    const long change = (k - 1) / hold_ + 1;
    bool any = false;
    for (int i = 0; i < plan_.nv; ++i) {
      if (amplitudes_[i] == 0) continue;
      const double time = static_cast<double>(k - 1) * step_;
      system.tau(i) = drive_ == "square" ? ((change + i) % 2 ? amplitudes_[i] : -amplitudes_[i])
                                         : amplitudes_[i] * std::sin(6.3 * time * (1 + 0.3 * i) + i);
      any = true;
    }
    return any;
  }

  Model model_;
  Plan<double> plan_;
  double step_, after_;
  long steps_, hold_, limit_;
  bool log_;
  std::string drive_;
  std::vector<double> amplitudes_;
};

double largest_difference(const Run& a, const Run& b, std::size_t first, std::size_t last) {
  double largest = 0;
  for (std::size_t k = 0; k < std::min(a.states.size(), b.states.size()); ++k)
    for (std::size_t i = first; i < std::min(last, a.states[k].size()); ++i)
      largest = std::max(largest, std::fabs(a.states[k][i] - b.states[k][i]));
  return largest;
}

// States of a run as text, exact.
void write_states(const std::string& file, const Run& run) {
  std::ofstream text(file);
  text << std::hexfloat << run.stopped << '\n' << run.states.size() << '\n';
  for (const std::vector<double>& state : run.states) {
    text << state.size();
    for (double value : state) text << ' ' << value;
    text << '\n';
  }
}

bool read_states(const std::string& file, Run& run) {
  std::ifstream text(file);
  std::size_t rows = 0, size = 0;
  if (!std::getline(text, run.stopped) || !(text >> rows)) return false;
  run.states.resize(rows);
  for (std::vector<double>& state : run.states) {
    text >> size;
    state.resize(size);
    std::string number;
    for (double& value : state) {
      text >> number;
      value = std::strtod(number.c_str(), nullptr);
    }
  }
  return static_cast<bool>(text);
}

Run reference_of(const Scene& scene, const Options& options) {
  const std::string keep = options.values.at("keep");
  Run reference;
  if (!keep.empty() && read_states(keep, reference)) return reference;
  reference = scene.run(options.values.at("reference"), options.number("reference_rtol"), {});
  if (!keep.empty()) write_states(keep, reference);
  return reference;
}

int compare(const std::string& file, const Options& options) {
  const Scene scene(file, options);
  const Run reference = reference_of(scene, options);
  if (!reference.stopped.empty()) std::printf("# reference: %s\n", reference.stopped.c_str());
  const bool by_clock = options.values.at("clock") != "off";
  const Account account = {by_clock ? scene.jacobian_cost() : Tuning::jacobian_column * scene.states() - 1,
                           by_clock};
  const std::size_t positions = static_cast<std::size_t>(scene.positions());
  std::printf("# a Jacobian costs %.1f right-hand sides\n", account.jacobian + 1);
  for (const std::string& method : options.list("method"))
    for (const std::string& rtol : options.list("rtol")) {
      const Run run = scene.run(method, std::atof(rtol.c_str()), account);
      std::printf("%s %s %ld %ld %.0f %ld+%ld %.2e %.2e %.1e %.3g %.0f %.0f%s%s\n", method.c_str(),
                  rtol.c_str(), run.evaluations, run.jacobians, run.work, run.steps, run.rejected,
                  largest_difference(run, reference, 0, positions),
                  largest_difference(run, reference, positions, 1000000), run.balance, run.seconds,
                  run.percentile(0.5), run.percentile(0.99), run.stopped.empty() ? "" : " # ",
                  run.stopped.c_str());
      std::fflush(stdout);
      if (run.stopped == limit_reached) break;
    }
  return 0;
}

}  // namespace

int main(int count, char** arguments) try {
  Options options;
  for (int i = 2; i < count; ++i) {
    const std::string text = arguments[i];
    const std::size_t equals = text.find('=');
    if (equals == std::string::npos || options.values.count(text.substr(0, equals)) == 0)
      throw std::runtime_error("no option '" + text + "'");
    options.values[text.substr(0, equals)] = text.substr(equals + 1);
  }
  if (count < 2) throw std::runtime_error("stepping MODEL.toml [KEY=VALUE]...");
  return compare(arguments[1], options);
} catch (const std::exception& error) {
  std::fprintf(stderr, "%s\n", error.what());
  return 1;
}
