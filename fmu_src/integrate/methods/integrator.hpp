#pragma once

#include <memory>
#include <string>
#include <vector>

#include "integrate/system/system.hpp"
#include "model/model.hpp"

namespace redysim {

struct Statistics {
  long steps = 0;        // accepted internal steps
  long rejected = 0;     // error-test and solver failures
  long evaluations = 0;  // right-hand sides
  long jacobians = 0;    // of the right-hand side; none with an explicit method
  long loosened = 0;     // advances in which max_rhs loosened the tolerance
  // time of matrix functions, of auto also what surrounds the right-hand sides, as a number of those of erk
  double other_work = 0;
  double step_size = 0;  // s, last accepted
  // weighted local error of the last step, 1 = the tolerance; with max_rhs the largest of an advance
  double error_estimate = 0;

  // The counts of another method; the last step remains.
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
  std::string message;  // the reason of a failure, one sentence; empty when ok, which does not allocate
};

// One time-stepping method over one System. Neither throws nor allocates in a successful advance, except
// where auto first uses an implicit method in a large system, or the exponential one.
class Integrator {
 public:
  virtual ~Integrator() = default;

  // Starts at (time, y) without history.
  virtual Outcome start(double time, const double* y) = 0;

  // Replaces the state at time(). The next advance is one with changed inputs.
  virtual void set_state(const double* y) = 0;

  // Integrates from time() to exactly `end`. `inputs_changed`: the right-hand side differs from that of the
  // last advance, so the history is discarded; otherwise it is kept.
  virtual Outcome advance(double end, bool inputs_changed) = 0;

  // Whether `end` lies in a step that was taken before, unless inputs have changed: then an advance is an
  // interpolation.
  virtual bool reaches(double /*end*/) const { return false; }

  // From now on an advance ends after so many internal steps at the latest, successful; 0: at its end only.
  // The next one does not continue an earlier one.
  virtual void pause_after(long steps) { pause_after_ = steps; }

  virtual double time() const = 0;
  virtual const double* state() const = 0;  // length System::size()
  virtual const Statistics& statistics() const = 0;
  virtual const char* name() const = 0;
  virtual SolverMethod method() const = 0;  // in use; automatic: none
  // Number of decisions so far, between methods or to loosen the tolerance, and the last, for a log.
  virtual long decisions() const { return statistics().loosened; }
  virtual std::string last_decision() const { return {}; }

  // Appends all that the continuation depends on, as bytes. The run after `restore`, here or in another
  // process with the same model, equals the uninterrupted run bit for bit.
  virtual void save(std::vector<unsigned char>& bytes) const = 0;
  virtual bool restore(const unsigned char* bytes, std::size_t size) = 0;  // false: invalid bytes, unchanged

 protected:
  long pause_after_ = 0;
};

// Integrator::advance, interrupted at each breakpoint of the system's trajectories and samples.
Outcome advance_by_breakpoints(Integrator& integrator, System& system, double end, bool inputs_changed);
inline Outcome advance(Integrator& integrator, System& system, double end, bool inputs_changed) {
  return system.control() ? advance_by_breakpoints(integrator, system, end, inputs_changed)
                          : integrator.advance(end, inputs_changed);
}

// Throws std::bad_alloc only.
std::unique_ptr<Integrator> make_integrator(System& system, const SolverSettings& settings);

}  // namespace redysim
