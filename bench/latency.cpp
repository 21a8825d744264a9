// What a step, a reading of the outputs, a start and an instance cost, as a compiled master sees them.

#include <algorithm>
#include <chrono>
#include <cstdio>
#include <stdexcept>

#include "allocations.hpp"
#include "drive/computing_time.hpp"
#include "drive/run.hpp"

namespace {

using namespace redysim::drive;
using redysim::Json;
using redysim::bench::allocations;
using redysim::bench::heap_bytes;

using Clock = std::chrono::steady_clock;

constexpr int starts = 51;          // instantiations and initialisations whose median is taken
constexpr double waking = 3e8;      // ns: a processor that idled is slow at first
constexpr double most_bytes = 8e9;  // more instances at once are not measured

double ns_since(Clock::time_point begin) {
  return std::chrono::duration<double, std::nano>(Clock::now() - begin).count();
}

double quantile(std::vector<double> values, double part) {
  if (values.empty()) return 0;
  const auto place = values.begin() + static_cast<long>(part * static_cast<double>(values.size() - 1));
  std::nth_element(values.begin(), place, values.end());
  return *place;
}

// What two readings of the clock cost, to be taken off.
double clock_ns() {
  std::vector<double> costs(10001);
  for (double& cost : costs) {
    const auto begin = Clock::now();
    cost = ns_since(begin);
  }
  return quantile(std::move(costs), 0.5);
}

class Bench {
 public:
  Bench(const FmuLibrary& fmu, const Job& job, Watchdog& watchdog, Json& json)
      : fmu_(fmu), job_(job), watchdog_(watchdog), json_(json), clock_(clock_ns()) {}

  void all() {
    json_.member("status", "ok").member("clock_ns", clock_);
    for (const auto begin = Clock::now(); ns_since(begin) < waking;) start_and_free();
    start_cost();
    steps("constant", false);
    if (!job_.inputs.empty()) steps("changing", true);
    json_.key("many").begin_array();
    for (long count : job_.instances)
      if (static_cast<double>(count) * bytes_ <= most_bytes) many(static_cast<std::size_t>(count));
    json_.end_array();
  }

 private:
  fmi2Component make() {
    fmi2Component instance = fmu_.instantiate("timed", fmi2CoSimulation, job_.guid.c_str(),
                                              job_.resources.c_str(), &callbacks_, fmi2False, fmi2False);
    if (!instance) throw std::runtime_error("fmi2Instantiate failed");
    return instance;
  }

  void start(fmi2Component instance) {
    if (initialise(fmu_, instance, job_) > fmi2Warning)
      throw std::runtime_error(log_.lines().empty() ? "initialisation failed" : log_.lines().back());
  }

  void start_and_free() {
    fmi2Component instance = make();
    start(instance);
    fmu_.free_instance(instance);
  }

  void start_cost() {
    std::vector<double> instantiate, initialisation;
    for (int i = 0; i < starts; ++i) {
      const double before = heap_bytes();
      auto begin = Clock::now();
      fmi2Component instance = make();
      instantiate.push_back(ns_since(begin));
      begin = Clock::now();
      start(instance);
      initialisation.push_back(ns_since(begin));
      if (fmu_.do_step(instance, 0, job_.step, fmi2True) != fmi2OK)
        throw std::runtime_error("first step failed");
      bytes_ = heap_bytes() - before;
      fmu_.free_instance(instance);
    }
    json_.member("instantiate_ns", quantile(instantiate, 0.5))
        .member("initialise_ns", quantile(initialisation, 0.5));
    json_.member("bytes", bytes_);
  }

  // Steps one after the other, in runs that each begin at the start; every reading of the outputs is timed by
  // itself.
  void steps(const char* name, bool changing) {
    Timed timed;
    for (long run = 0; run <= job_.repeats; ++run) {
      fmi2Component instance = make();
      start(instance);
      this->run(instance, changing, timed);
      fmu_.free_instance(instance);
    }
    json_.key(name).begin_object();
    json_.member("median_ns", quantile(timed.step, 0.5)).member("p99_ns", quantile(timed.step, 0.99));
    const std::vector<double> fastest = timed.fastest(static_cast<std::size_t>(job_.steps));
    json_.member("fastest_median_ns", quantile(fastest, 0.5))
        .member("fastest_p99_ns", quantile(fastest, 0.99));
    json_.member("read_ns", quantile(timed.read, 0.5));
    json_.member("allocations", static_cast<double>(timed.allocations)).end_object();
  }

  struct Timed {
    std::vector<double> step, read;  // ns
    long allocations = 0;            // -1: not counted

    // Of each step of a run, the fastest repetition: without interruptions by the machine.
    std::vector<double> fastest(std::size_t steps) const {
      std::vector<double> least(step.begin(), step.begin() + static_cast<std::ptrdiff_t>(steps));
      for (std::size_t k = steps; k < step.size(); ++k)
        least[k % steps] = std::min(least[k % steps], step[k]);
      return least;
    }
  };

  // One run of a new instance, its first steps untimed.
  void run(fmi2Component instance, bool changing, Timed& timed) {
    const long warm = std::min(job_.steps, std::max(10L, job_.steps / 20));
    timed.step.reserve(timed.step.size() + static_cast<std::size_t>(job_.steps));
    timed.read.reserve(timed.step.capacity());
    std::vector<double> row(job_.outputs.size());
    long before = 0;
    for (long k = 0; k < warm + job_.steps; ++k) {
      if (k == warm) before = allocations();
      const double time = static_cast<double>(k) * job_.step, end = static_cast<double>(k + 1) * job_.step;
      watchdog_.at(end);
      const auto begin = Clock::now();
      if (changing) set_inputs(fmu_, instance, job_, k);
      const fmi2Status status = fmu_.do_step(instance, time, end - time, fmi2True);
      const auto middle = Clock::now();
      fmu_.get_real(instance, job_.outputs.data(), row.size(), row.data());
      if (status != fmi2OK)
        throw std::runtime_error(log_.lines().empty() ? "a step failed" : log_.lines().back());
      if (k < warm) continue;
      timed.read.push_back(ns_since(middle) - clock_);
      timed.step.push_back(std::chrono::duration<double, std::nano>(middle - begin).count() - clock_);
    }
    const long after = allocations();
    timed.allocations = after < 0 ? -1 : timed.allocations + after - before;
  }

  // Many at once, stepped in turn: what does not fit a cache shows.
  void many(std::size_t count) {
    watchdog_.at("many instances", static_cast<double>(count));
    std::vector<fmi2Component> instances;
    const double bytes = heap_bytes();
    double begin = computing_seconds();
    for (std::size_t i = 0; i < count; ++i) {
      instances.push_back(make());
      start(instances.back());
    }
    const double made = 1e9 * (computing_seconds() - begin);
    const long rounds = std::max(2L, 2000 / static_cast<long>(count));
    double stepped = 0;
    for (long k = 0; k <= rounds; ++k) {
      begin = computing_seconds();
      for (fmi2Component instance : instances)
        if (fmu_.do_step(instance, static_cast<double>(k) * job_.step, job_.step, fmi2True) != fmi2OK)
          throw std::runtime_error("a step failed");
      if (k > 0) stepped += 1e9 * (computing_seconds() - begin);
    }
    const double all = static_cast<double>(count);
    json_.begin_object().member("count", all).member("start_ns", made / all);
    json_.member("bytes", (heap_bytes() - bytes) / all);
    json_.member("step_ns", stepped / static_cast<double>(rounds) / all).end_object();
    for (fmi2Component instance : instances) fmu_.free_instance(instance);
  }

  const FmuLibrary& fmu_;
  const Job& job_;
  Watchdog& watchdog_;
  Json& json_;
  double clock_;
  double bytes_ = 0;  // heap memory of an instance
  MessageLog log_;
  fmi2CallbackFunctions callbacks_{MessageLog::callback, nullptr, nullptr, nullptr, &log_};
};

}  // namespace

int main() {
  return serve_job("latency_driver", [](const FmuLibrary& fmu, const Job& job, const std::string& why,
                                        Watchdog& watchdog, Json& json) {
    if (!why.empty()) throw std::runtime_error(why);
    Bench(fmu, job, watchdog, json).all();
  });
}
