#pragma once

#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include "integrate/system/system.hpp"
#include "model/model.hpp"

namespace redysim {

struct Statistics {
  std::int64_t steps = 0;        // accepted internal steps
  std::int64_t rejected = 0;     // error-test and solver failures
  std::int64_t evaluations = 0;  // right-hand sides
  std::int64_t jacobians = 0;    // of the right-hand side; 0 for explicit methods
  std::int64_t loosened = 0;     // communication steps in which max_rhs loosened the tolerance
  // other CPU time, in right-hand sides of erk: matrix functions; with auto also the overhead of the method
  double other_work = 0;
  double step_size = 0;  // s, last accepted
  // weighted local error of the last step (1 = tolerance); with max_rhs the maximum in a communication step
  double error_estimate = 0;

  // Adds the counts of another method; the data of the last step remain.
  void add(const Statistics& more) {
    steps += more.steps;
    rejected += more.rejected;
    evaluations += more.evaluations;
    jacobians += more.jacobians;
    other_work += more.other_work;
  }
};

// Result of an advance. After a failure the state is that at time(), the last valid time.
struct Outcome {
  bool ok = true;
  std::string message;  // one sentence after a failure; empty when ok, so that nothing is allocated
};

// One time-stepping method for one System. It does not throw. A successful advance does not allocate, except
// when auto first uses an implicit method in a large system, or the exponential method.
class Integrator {
 public:
  virtual ~Integrator() = default;

  // Starts at (time, y) without history.
  virtual Outcome start(double time, const double* y) = 0;

  // Replaces the state at time(). The next advance is one with changed inputs.
  virtual void set_state(const double* y) = 0;

  // Call before the first of the advances in a communication step: max_rhs is judged by all of them.
  virtual void begin_communication_step() {}

  // Integrates from time() to exactly `end`. `inputs_changed`: the right-hand side differs from that of the
  // last advance, so the history is discarded; otherwise it is kept.
  virtual Outcome advance(double end, bool inputs_changed) = 0;

  // Whether `end` lies within the last step, so that an advance with unchanged inputs only interpolates.
  virtual bool reaches(double /*end*/) const { return false; }

  // From now on an advance returns successfully after at most `steps` internal steps; 0: only at its end. The
  // next advance does not continue an earlier one.
  virtual void pause_after(long steps) { pause_after_ = steps; }
  bool pauses() const { return pause_after_ > 0; }

  virtual double time() const = 0;
  virtual const double* state() const = 0;  // length System::size()
  virtual const Statistics& statistics() const = 0;
  virtual const char* name() const = 0;
  virtual SolverMethod method() const = 0;  // the method in use; automatic: none
  // Number of decisions so far (changes of the method, loosened tolerances), and the last one for the log.
  virtual std::int64_t decisions() const { return statistics().loosened; }
  virtual std::string last_decision() const { return {}; }

  // Appends all data that determine the continuation. After `restore`, in this or another process with the
  // same model, the run equals the uninterrupted run bit for bit.
  virtual void save(std::vector<unsigned char>& bytes) const = 0;
  virtual bool restore(const unsigned char* bytes, std::size_t size) = 0;  // false: invalid bytes, unchanged

 protected:
  long pause_after_ = 0;
};

// The next breakpoint of the system's trajectories and samples after `time`, at most `end`.
double next_halt(const System& system, double time, double end);

// Calls Integrator::advance up to each breakpoint of the system's trajectories and samples, then to `end`. An
// integrator that pauses also stops at each breakpoint.
Outcome advance_by_breakpoints(Integrator& integrator, System& system, double end, bool inputs_changed);
inline Outcome advance(Integrator& integrator, System& system, double end, bool inputs_changed) {
  return system.control() ? advance_by_breakpoints(integrator, system, end, inputs_changed)
                          : integrator.advance(end, inputs_changed);
}

// Throws only std::bad_alloc.
std::unique_ptr<Integrator> make_integrator(System& system, const SolverSettings& settings);

}  // namespace redysim
