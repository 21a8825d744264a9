#include <arkode/arkode_erkstep.h>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <limits>

#include "integrate/first_step.hpp"
#include "integrate/methods.hpp"
#include "integrate/state_bytes.hpp"
#include "integrate/step_control.hpp"
#include "integrate/sundials_objects.hpp"

// Explicit Runge-Kutta steps by SUNDIALS' ARKODE (ERKStep).
//
// Each advance is a fresh start of ERKStep at (time, y) with a stop time, so that nothing but y, the step
// control and, where the method can use it, the slope at the end lives on. Right-hand sides per step:
// exactly the stages; one fewer where the last stage's slope is the next step's first (same inputs).

namespace redysim {
namespace {

using namespace sundials;

struct Table {
  ARKODE_ERKTableID id;
  int error_order;          // local error estimate ~ h^error_order
  bool first_same_as_last;  // its last stage is f at the new state
  const char* name;
};

// By right-hand sides against error, on the KR5, the double pendulum and the SCARA: the fifth order serves
// the tolerances of daily use, above all when each communication step is one step (7 slopes, not 13); the
// eighth needs fewer from errors of 1e-6 down; the third costs 4 slopes where hardly any accuracy is asked
// for. Verner's 6(5) and Cash-Karp's 5(4) lie between without a range of their own.
Table table_for(double rtol) {
  if (rtol > 3e-4) return {ARKODE_BOGACKI_SHAMPINE_4_2_3, 3, true, "erk (Bogacki-Shampine 3(2))"};
  if (rtol > 1e-9) return {ARKODE_DORMAND_PRINCE_7_4_5, 5, true, "erk (Dormand-Prince 5(4))"};
  return {ARKODE_FEHLBERG_13_7_8, 8, false, "erk (Fehlberg 8(7))"};
}

constexpr double sundials_safety = 0.96;  // ERKStep multiplies what the adaptivity function proposes

struct ErkStepDeleter {
  void operator()(void* memory) const { ERKStepFree(&memory); }
};

class Erk final : public Integrator {
 public:
  Erk(System& system, const SolverSettings& settings);

  Outcome start(double time, const double* y) override;
  Outcome advance(double end, bool inputs_changed) override;

  double time() const override { return time_; }
  const double* state() const override { return y_.data(); }
  const Statistics& statistics() const override { return statistics_; }
  const char* name() const override { return table_.name; }

  void save(std::vector<unsigned char>& bytes) const override;
  bool restore(const unsigned char* bytes, std::size_t size) override;

 private:
  static int right_hand_side(double time, N_Vector y, N_Vector ydot, void* self);
  static int weights(N_Vector y, N_Vector weights, void* self);
  static int adapt(N_Vector y, double t, double h, double, double, double error, double, double, int, int,
                   double* next, void* self);
  static int complete_step(double time, N_Vector y, void* self);

  void build();
  bool first_step_from_here();
  int attempt(double end);
  Outcome explain(int flag);

  System& system_;
  SolverSettings settings_;
  Table table_;
  ErrorWeights error_weights_;
  StepControl control_;
  FirstStepRoom room_;
  double largest_step_;

  Context context_;
  LastMessage message_;
  Vector start_, result_;
  std::unique_ptr<void, ErkStepDeleter> memory_;

  // what the future depends on
  double time_ = 0;
  std::vector<double> y_;
  std::vector<double> slope_;  // f(time_, y_) of the last inputs, when slope_known_
  bool slope_known_ = false;
  bool fresh_ = true;  // the step size is to be found
  Statistics statistics_;

  // of the advance under way
  double end_ = 0;
  long allowed_ = 0;
  const double* last_slope_ = nullptr;  // where ERKStep keeps the last slope it asked for
  bool warming_up_ = false;
  bool serve_slope_ = false;   // the next slope asked for is slope_
  bool skip_slope_ = false;    // the next slope asked for is not used: the advance is over
  bool stage_failed_ = false;  // a stage had no slope: this attempt is to be rejected
  bool step_at_floor_ = false;
  bool projection_failed_ = false;
};

Erk::Erk(System& system, const SolverSettings& settings)
    : system_(system),
      settings_(settings),
      table_(table_for(settings.rtol)),
      error_weights_(system, settings.rtol, settings.atol),
      control_(table_.error_order, settings.max_step),
      room_(system.size()),
      largest_step_(settings.max_step > 0 ? settings.max_step : std::numeric_limits<double>::max()),
      start_(make_vector(system.size(), context_)),
      result_(make_vector(system.size(), context_)),
      y_(static_cast<std::size_t>(system.size())),
      slope_(y_) {
  build();
}

void Erk::build() {
  memory_.reset(created(ERKStepCreate(&Erk::right_hand_side, 0.0, start_.get(), context_)));
  void* erk = memory_.get();
  ERKStepSetErrHandlerFn(erk, &LastMessage::keep, &message_);
  ERKStepSetUserData(erk, this);
  ERKStepSetTableNum(erk, table_.id);
  ERKStepSetInterpolantDegree(erk, 1);  // never used between step ends; higher ones cost right-hand sides
  ERKStepWFtolerances(erk, &Erk::weights);
  ERKStepSetAdaptivityFn(erk, &Erk::adapt, this);
  ERKStepSetErrorBias(erk, 1.0);
  ERKStepSetSafetyFactor(erk, sundials_safety);
  ERKStepSetFixedStepBounds(erk, 1.0, 1.0);
  ERKStepSetMaxErrTestFails(erk, 100);  // step_control's floor is reached before
  if (settings_.max_step > 0) ERKStepSetMaxStep(erk, settings_.max_step);
  // ERKStep takes c = 1 in the last stage for "first same as last", which 8(7) is not, unless a step is
  // post-processed: then it asks for the slope at the new state
  if (!table_.first_same_as_last || system_.has_loops())
    ERKStepSetPostprocessStepFn(erk, &Erk::complete_step);

  // ERKStep allocates in its first step: take one of a system at rest
  warming_up_ = true;
  end_ = 1;
  control_.start(1);
  ERKStepSetInitStep(erk, 1.0);
  double reached = 0;
  ERKStepEvolve(erk, 1.0, result_.get(), &reached, ARK_ONE_STEP);
  warming_up_ = false;
  statistics_ = {};
}

int Erk::right_hand_side(double time, N_Vector y, N_Vector ydot, void* self_pointer) {
  Erk& self = *static_cast<Erk*>(self_pointer);
  double* slope = data(ydot);
  const std::size_t bytes = self.y_.size() * sizeof(double);
  if (self.skip_slope_) {
    self.skip_slope_ = false;
    return 0;
  }
  if (self.serve_slope_) {
    self.serve_slope_ = false;
    std::memcpy(slope, self.slope_.data(), bytes);
    return 0;
  }
  if (self.warming_up_) {
    std::memset(slope, 0, bytes);
    return 0;
  }
  self.last_slope_ = slope;
  if (!self.stage_failed_) {
    ++self.statistics_.evaluations;
    const Status status = self.system_.right_hand_side(time, data(y), slope);
    if (status == Status::ok) return 0;
    if (status == Status::fatal) return -1;
    self.stage_failed_ = true;
  }
  // ERKStep gives up at a stage without slope; a slope that is not a number makes it try a smaller step
  std::fill_n(slope, self.y_.size(), std::numeric_limits<double>::quiet_NaN());
  return 0;
}

int Erk::weights(N_Vector y, N_Vector weights, void* self) {
  static_cast<Erk*>(self)->error_weights_.evaluate(data(y), data(weights));
  return 0;
}

int Erk::adapt(N_Vector, double t, double h, double, double, double error, double, double, int, int,
               double* next, void* self_pointer) {
  Erk& self = *static_cast<Erk*>(self_pointer);
  if (error <= 1) {
    self.control_.accepted(h, error);
    ++self.statistics_.steps;
    self.statistics_.step_size = h;
    self.statistics_.error_estimate = error;
    const double remaining = self.end_ - t;
    *next = remaining > 0 ? self.control_.step_for(remaining) / sundials_safety : h;
    return 0;
  }
  // a slope that failed at the step's start stays failed, whatever the step
  self.stage_failed_ = false;
  ++self.statistics_.rejected;
  *next = self.control_.rejected(h, error) / sundials_safety;
  self.step_at_floor_ = *next < smallest_step(t, self.end_);
  return self.step_at_floor_ ? 1 : 0;
}

int Erk::complete_step(double time, N_Vector y, void* self_pointer) {
  Erk& self = *static_cast<Erk*>(self_pointer);
  self.skip_slope_ = time == self.end_;
  if (self.warming_up_ || !self.system_.has_loops()) return 0;
  const Status status = self.system_.project(time, data(y), nullptr);
  self.projection_failed_ = status != Status::ok;
  return static_cast<int>(status);
}

Outcome Erk::start(double time, const double* y) {
  time_ = time;
  std::copy_n(y, y_.size(), y_.begin());
  fresh_ = true;
  slope_known_ = false;
  statistics_ = {};
  if (!std::isfinite(time)) return failure(time, "the start time is not a number");
  for (double value : y_)
    if (!std::isfinite(value)) return failure(time, "the start state is not finite");
  return {};
}

bool Erk::first_step_from_here() {
  ++statistics_.evaluations;
  if (system_.right_hand_side(time_, y_.data(), slope_.data()) != Status::ok) return false;
  slope_known_ = true;
  ++statistics_.evaluations;
  const double step = first_step(system_, error_weights_, table_.error_order - 1, time_, y_.data(),
                                 slope_.data(), largest_step_, room_);
  if (!(step > 0)) return false;
  control_.start(step);
  return true;
}

// One run of ERKStep from (time_, y_) to `end`; its flag.
int Erk::attempt(double end) {
  void* erk = memory_.get();
  end_ = end;
  serve_slope_ = slope_known_;
  skip_slope_ = stage_failed_ = step_at_floor_ = projection_failed_ = false;
  const long allowed = allowed_steps(end - time_);
  if (allowed != allowed_) ERKStepSetMaxNumSteps(erk, allowed_ = allowed);
  std::copy(y_.begin(), y_.end(), data(start_));
  ERKStepSetInitStep(erk, control_.step_for(end - time_));
  ERKStepReset(erk, time_, start_.get());
  ERKStepSetStopTime(erk, end);
  double reached = time_;
  return ERKStepEvolve(erk, end, result_.get(), &reached, ARK_NORMAL);
}

Outcome Erk::advance(double end, bool inputs_changed) {
  if (end == time_) return {};
  if (!(end > time_) || !std::isfinite(end)) return failure(time_, "the end of the step is not a later time");
  if (inputs_changed) {
    slope_known_ = false;
    control_.forget_errors();
    if (!follow_motion(system_, time_, y_.data()))
      return failure(time_, "the loops cannot follow the prescribed motion");
  }
  if (fresh_ && !first_step_from_here())
    return failure(time_, "the accelerations cannot be computed at the start of the step");
  fresh_ = false;

  int flag = attempt(end);
  // a state too far off to be projected: shorter steps end closer to the closed loops
  for (int retry = 0; flag == ARK_POSTPROCESS_STEP_FAIL && retry < 12; ++retry) {
    ++statistics_.rejected;
    control_.start(0.25 * std::min(control_.wanted(), end - time_));
    flag = attempt(end);
  }
  if (flag < 0) {
    fresh_ = true;
    slope_known_ = false;
    return explain(flag);
  }

  std::copy_n(data(result_), y_.size(), y_.begin());
  time_ = end;
  slope_known_ = table_.first_same_as_last && !system_.has_loops();
  if (slope_known_) std::copy_n(last_slope_, slope_.size(), slope_.begin());
  return {};
}

Outcome Erk::explain(int flag) {
  double reached = time_;
  ERKStepGetCurrentTime(memory_.get(), &reached);
  if (step_at_floor_)
    return failure(reached, "no step is small enough for the tolerance, or the accelerations are not finite");
  if (projection_failed_) return failure(reached, "the loops cannot be closed");
  if (flag == ARK_RHSFUNC_FAIL) return failure(reached, "the accelerations cannot be computed");
  if (flag == ARK_TOO_MUCH_WORK)
    return failure(reached, std::to_string(allowed_) + " steps did not reach the end of the step");
  return failure(reached, message_.text);
}

void Erk::save(std::vector<unsigned char>& bytes) const {
  StateWriter writer(bytes);
  put(writer, state_header(system_, settings_, SolverMethod::erk));
  writer.put(time_);
  writer.put(control_.wanted());
  writer.put(control_.previous_error());
  writer.put(fresh_);
  writer.put(slope_known_);
  writer.put(y_.data(), y_.size());
  writer.put(slope_.data(), slope_.size());
  put(writer, statistics_);
}

bool Erk::restore(const unsigned char* bytes, std::size_t size) {
  StateReader reader(bytes, size);
  if (!matches(reader, state_header(system_, settings_, SolverMethod::erk))) return false;
  double time = 0, wanted = 0, previous_error = 0;
  unsigned char fresh = 0, slope_known = 0;
  std::vector<double> y(y_.size()), slope(slope_.size());
  Statistics statistics;
  reader.get(time);
  reader.get(wanted);
  reader.get(previous_error);
  reader.get(fresh);
  reader.get(slope_known);
  reader.get(y.data(), y.size());
  reader.get(slope.data(), slope.size());
  get(reader, statistics);
  const bool steps_possible = fresh == 1 || (wanted > 0 && previous_error > 0);
  if (!reader.finished() || !std::isfinite(time) || fresh > 1 || slope_known > 1 || !steps_possible)
    return false;

  time_ = time;
  control_.restore(wanted, previous_error);
  fresh_ = fresh;
  slope_known_ = slope_known;
  y_.swap(y);
  slope_.swap(slope);
  statistics_ = statistics;
  return true;
}

}  // namespace

std::unique_ptr<Integrator> make_erk(System& system, const SolverSettings& settings) {
  return std::make_unique<Erk>(system, settings);
}

}  // namespace redysim
