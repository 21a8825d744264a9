#include <cvode/cvode.h>
#include <cvode/cvode_proj.h>
#include <sunlinsol/sunlinsol_dense.h>
#include <sunmatrix/sunmatrix_dense.h>
#include <sunnonlinsol/sunnonlinsol_fixedpoint.h>
#include <sunnonlinsol/sunnonlinsol_newton.h>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <limits>

#include "integrate/methods/first_step.hpp"
#include "integrate/methods/methods.hpp"
#include "integrate/methods/step_work.hpp"
#include "integrate/methods/sundials_objects.hpp"
#include "integrate/system/dense_jacobian.hpp"
#include "integrate/system/state_bytes.hpp"

// Variable-order multistep methods by SUNDIALS' CVODE: Adams (functional iteration) and BDF (Newton).
//
// CVODE counts time from where it last began, so that its steps may be shorter than the rounding of a large
// time. It runs ahead of time() in steps of its own; states at communication points are interpolated, so that
// a run with unchanged inputs does not depend on where it is cut. Changed inputs restart it at time().
// CVODE's memory is opaque: a saved state is its last restart and the number of steps since, and restoring
// repeats these steps. To bound them CVODE is restarted every steps_between_restarts steps.

namespace redysim {
namespace {

using namespace sundials;

constexpr int steps_between_restarts = 4000;

// A multistep method's errors add up where a Runge-Kutta step's are damped or overestimated, so the user's
// tolerance is tightened inside, to the global error that the one-step methods have at the same rtol: on the
// public scenes at 1e-8 all stay within 4e-6 (docs/solvers.md). Each beginning climbs from order one: the
// first steps after changed inputs are kept tighter still, or a restart each millisecond would add up to a
// hundred tolerances. The one beginning of a run need not be.
constexpr double adams_tightening = 1.0 / 30;
constexpr double bdf_tightening = 1.0 / 100;
constexpr double beginning_tightening = 0.1;
constexpr int beginning_steps = 6;
constexpr double newton_tolerance =
    0.03;  // of the error test; CVODE's 0.1 costs accuracy, an iteration is cheap

double tightened(double tolerance, SolverMethod method) {
  return tolerance * (method == SolverMethod::bdf ? bdf_tightening : adams_tightening);
}

struct CvodeDeleter {
  void operator()(void* memory) const { CVodeFree(&memory); }
};

class Cvode final : public Integrator {
 public:
  Cvode(System& system, const SolverSettings& settings, SolverMethod method);

  Outcome start(double time, const double* y) override;
  Outcome advance(double end, bool inputs_changed) override;

  double time() const override { return time_; }
  const double* state() const override { return y_.data(); }
  const Statistics& statistics() const override { return statistics_; }
  SolverMethod method() const override { return method_; }
  const char* name() const override { return method_ == SolverMethod::bdf ? "bdf" : "adams"; }

  void save(std::vector<unsigned char>& bytes) const override;
  bool restore(const unsigned char* bytes, std::size_t size) override;

 private:
  // Where CVODE last began, with what it needs to begin there again.
  struct Beginning {
    double time = 0, first_step = 0;
    bool careful = false;  // one of many
    std::vector<double> y, tau;
    long rejected_before = 0;  // statistics
  };

  static int right_hand_side(double time, N_Vector y, N_Vector ydot, void* self);
  static int weights(N_Vector y, N_Vector weights, void* self);
  static int jacobian(double time, N_Vector y, N_Vector slope, SUNMatrix matrix, void* self, N_Vector,
                      N_Vector, N_Vector);
  static int project(double time, N_Vector y, N_Vector correction, double, N_Vector error, void* self);
  static bool power(double time, void* self, double& power);

  void build();
  double absolute(double since) const { return beginning_.time + since; }  // CVODE's time for the system
  bool begin(double time, const double* y, bool careful);
  void reset_to_beginning();
  int take_step();
  void count_step();
  void count_work(double before);
  bool integrates_work() const { return system_.with_work() && system_.control(); }
  double& work_of(double* y) const { return y[y_.size() - 1]; }
  Outcome reach(double& end);
  double since_beginning(double end) const;
  Outcome explain(int flag);

  System& system_;
  SolverSettings settings_;
  SolverMethod method_;
  ErrorWeights error_weights_;
  FirstStepRoom room_;
  double largest_step_;

  Context context_;
  LastMessage message_;
  Vector ahead_, weights_, error_;           // ahead_: the state at ahead_time_
  std::unique_ptr<DenseJacobian> jacobian_;  // BDF alone
  Matrix matrix_;
  LinearSolver linear_solver_;
  NonlinearSolver nonlinear_solver_;
  std::unique_ptr<void, CvodeDeleter> memory_;

  // what the future depends on
  double time_ = 0;
  std::vector<double> y_;
  bool fresh_ = true;  // no beginning yet
  Beginning beginning_;
  double ahead_time_ = 0;         // end of CVODE's last step since the beginning; not before time_
  std::int32_t steps_taken_ = 0;  // since the beginning
  StepWork work_;                 // where the system has work
  Statistics statistics_;

  std::vector<double> slope_;  // f at the beginning, when serve_slope_
  bool serve_slope_ = false;
  bool warming_up_ = false;
  bool project_history_ = false;  // Adams with loops
  bool projection_failed_ = false;
};

Cvode::Cvode(System& system, const SolverSettings& settings, SolverMethod method)
    : system_(system),
      settings_(settings),
      method_(method),
      error_weights_(system, tightened(settings.rtol, method), tightened(settings.atol, method)),
      room_(system.size()),
      largest_step_(settings.max_step > 0 ? settings.max_step : std::numeric_limits<double>::max()),
      ahead_(make_vector(system.size(), context_)),
      weights_(make_vector(system.size(), context_)),
      error_(make_vector(system.size(), context_)),
      y_(static_cast<std::size_t>(system.size())),
      slope_(y_) {
  beginning_.y = y_;
  beginning_.tau = system.inputs();
  build();
}

void Cvode::build() {
  const bool bdf = method_ == SolverMethod::bdf;
  memory_.reset(created(CVodeCreate(bdf ? CV_BDF : CV_ADAMS, context_)));
  void* cvode = memory_.get();
  CVodeSetErrHandlerFn(cvode, &LastMessage::keep, &message_);
  CVodeInit(cvode, &Cvode::right_hand_side, 0.0, ahead_.get());
  CVodeSetUserData(cvode, this);
  CVodeWFtolerances(cvode, &Cvode::weights);
  if (settings_.max_step > 0) CVodeSetMaxStep(cvode, settings_.max_step);
  if (bdf) {
    jacobian_ = std::make_unique<DenseJacobian>(system_);
    matrix_.reset(created(SUNDenseMatrix(system_.size(), system_.size(), context_)));
    linear_solver_.reset(created(SUNLinSol_Dense(ahead_.get(), matrix_.get(), context_)));
    CVodeSetLinearSolver(cvode, linear_solver_.get(), matrix_.get());
    CVodeSetJacFn(cvode, &Cvode::jacobian);
    CVodeSetNonlinConvCoef(cvode, newton_tolerance);
    nonlinear_solver_.reset(created(SUNNonlinSol_Newton(ahead_.get(), context_)));
    if (system_.has_loops()) CVodeSetProjFn(cvode, &Cvode::project);
  } else {
    nonlinear_solver_.reset(created(SUNNonlinSol_FixedPoint(ahead_.get(), 0, context_)));
    project_history_ = system_.has_loops();
  }
  CVodeSetNonlinearSolver(cvode, nonlinear_solver_.get());

  // CVODE allocates in its first step: take one of a system at rest
  warming_up_ = true;
  CVodeSetInitStep(cvode, 1e-3);
  CVode(cvode, 1.0, ahead_.get(), &ahead_time_, CV_ONE_STEP);
  warming_up_ = false;
  statistics_ = {};
}

int Cvode::right_hand_side(double time, N_Vector y, N_Vector ydot, void* self_pointer) {
  Cvode& self = *static_cast<Cvode*>(self_pointer);
  if (self.warming_up_) {
    std::fill_n(data(ydot), self.y_.size(), 0.0);
    return 0;
  }
  if (self.serve_slope_) {
    self.serve_slope_ = false;
    std::copy(self.slope_.begin(), self.slope_.end(), data(ydot));
    return 0;
  }
  ++self.statistics_.evaluations;
  return static_cast<int>(self.system_.right_hand_side(self.absolute(time), data(y), data(ydot)));
}

// CVODE asks for the weights once before each step, for the newest entry of its history itself. Its own
// projection serves BDF only, so here is where Adams' history is put back on the closed loops: the state
// entry alone, since the others are right-hand sides (coordinate projection; Eich 1993).
int Cvode::weights(N_Vector y, N_Vector weights, void* self_pointer) {
  Cvode& self = *static_cast<Cvode*>(self_pointer);
  if (self.project_history_ && self.steps_taken_ > 0) {
    const Status status = self.system_.project(self.absolute(self.ahead_time_), data(y), nullptr);
    self.projection_failed_ = status != Status::ok;
    if (self.projection_failed_) return -1;
  }
  const bool careful = self.beginning_.careful && self.steps_taken_ < beginning_steps;
  self.error_weights_.evaluate(data(y), data(weights), careful ? beginning_tightening : 1);
  return 0;
}

int Cvode::jacobian(double time, N_Vector y, N_Vector, SUNMatrix matrix, void* self_pointer, N_Vector,
                    N_Vector, N_Vector) {
  Cvode& self = *static_cast<Cvode*>(self_pointer);
  if (self.warming_up_) return SUNMatZero(matrix);
  ++self.statistics_.jacobians;
  ++self.statistics_.evaluations;
  return static_cast<int>(self.jacobian_->evaluate(self.absolute(time), data(y), SM_DATA_D(matrix)));
}

int Cvode::project(double time, N_Vector y, N_Vector correction, double, N_Vector error, void* self_pointer) {
  Cvode& self = *static_cast<Cvode*>(self_pointer);
  N_VConst(0.0, correction);
  if (self.warming_up_) return 0;
  std::copy_n(data(y), self.y_.size(), data(correction));
  const Status status =
      self.system_.project(self.absolute(time), data(correction), error ? data(error) : nullptr);
  N_VLinearSum(1.0, correction, -1.0, y, correction);
  return static_cast<int>(status);
}

// Along the last step.
bool Cvode::power(double time, void* self_pointer, double& power) {
  Cvode& self = *static_cast<Cvode*>(self_pointer);
  if (CVodeGetDky(self.memory_.get(), time, 0, self.error_.get()) != CV_SUCCESS) return false;
  const Status status =
      self.system_.right_hand_side(self.absolute(time), data(self.error_), data(self.weights_));
  power = self.work_of(data(self.weights_));
  return status == Status::ok;
}

Outcome Cvode::start(double time, const double* y) {
  work_.start();
  time_ = time;
  std::copy_n(y, y_.size(), y_.begin());
  fresh_ = true;
  statistics_ = {};
  if (!std::isfinite(time)) return failure(time, "the start time is not a number");
  for (double value : y_)
    if (!std::isfinite(value)) return failure(time, "the start state is not finite");
  return {};
}

// A beginning at (time, y) with the inputs of now: two right-hand sides.
bool Cvode::begin(double time, const double* y, bool careful) {
  beginning_.careful = careful;
  beginning_.time = time;
  std::copy_n(y, y_.size(), beginning_.y.begin());
  beginning_.tau = system_.inputs();
  beginning_.rejected_before = statistics_.rejected;
  ++statistics_.evaluations;
  if (system_.right_hand_side(time, beginning_.y.data(), slope_.data()) != Status::ok) return false;
  ++statistics_.evaluations;
  beginning_.first_step =
      first_step(system_, error_weights_, 1, time, beginning_.y.data(), slope_.data(), largest_step_, room_);
  if (!(beginning_.first_step > 0)) return false;
  reset_to_beginning();
  if (integrates_work()) work_.begin(work_of(beginning_.y.data()));
  serve_slope_ = true;
  return true;
}

void Cvode::reset_to_beginning() {
  std::copy(beginning_.y.begin(), beginning_.y.end(), data(ahead_));
  CVodeReInit(memory_.get(), 0, ahead_.get());
  CVodeSetInitStep(memory_.get(), beginning_.first_step);
  ahead_time_ = 0;
  steps_taken_ = 0;
  serve_slope_ = projection_failed_ = false;
}

int Cvode::take_step() {
  // CVODE looks at the end time for its direction only
  const int flag =
      CVode(memory_.get(), ahead_time_ + 1 + ahead_time_, ahead_.get(), &ahead_time_, CV_ONE_STEP);
  if (flag >= 0) ++steps_taken_;
  return flag;
}

void Cvode::count_step() {
  ++statistics_.steps;
  long errors = 0, solver = 0;
  CVodeGetNumErrTestFails(memory_.get(), &errors);
  CVodeGetNumNonlinSolvConvFails(memory_.get(), &solver);
  statistics_.rejected = beginning_.rejected_before + errors + solver;
}

void Cvode::count_work(double before) {
  if (!integrates_work()) return;
  CVodeGetEstLocalErrors(memory_.get(), error_.get());
  work_.step(before, ahead_time_, work_of(data(ahead_)), work_of(data(error_)),
             tightened(settings_.rtol, method_), &Cvode::power, this);
}

// CVODE's time of an `end` that it has reached, or is to reach.
double Cvode::since_beginning(double end) const {
  return absolute(ahead_time_) == end ? ahead_time_ : end - beginning_.time;
}

// CVODE's steps until they pass `end`, which is where they stand when it is time for a pause.
Outcome Cvode::reach(double& end) {
  const long allowed = allowed_steps(end - time_);
  Pace pace(time_);
  for (long step = 0; ahead_time_ < since_beginning(end); ++step) {
    if (pause_after_ > 0 && step == pause_after_) {
      end = absolute(ahead_time_);
      break;
    }
    if (pace.is_hopeless(step, allowed, absolute(ahead_time_), end))
      return failure(absolute(ahead_time_), Pace::sentence(allowed, name()));
    if (step == allowed)
      return failure(absolute(ahead_time_),
                     too_many_steps(system_, allowed, name(), absolute(ahead_time_), data(ahead_)));
    if (steps_taken_ == steps_between_restarts) {
      const double time = absolute(ahead_time_);
      std::copy_n(data(ahead_), y_.size(), data(error_));
      if (integrates_work()) work_of(data(error_)) = work_.end();
      if (system_.project(time, data(error_), nullptr) != Status::ok)
        return failure(time, "the loops cannot be closed");
      if (!begin(time, data(error_), true)) return failure(time, "the accelerations cannot be computed");
    }
    const double before = ahead_time_;
    const int flag = take_step();
    if (flag < 0) return explain(flag);
    if (!(ahead_time_ > before))
      return failure(absolute(before), "no step is small enough for the tolerance");
    count_step();
    count_work(before);
  }
  return {};
}

Outcome Cvode::advance(double end, bool inputs_changed) {
  if (end == time_) return {};
  if (!(end > time_) || !std::isfinite(end)) return failure(time_, "the end of the step is not a later time");
  if (inputs_changed && system_.plan().has_motion() && !follow_motion(system_, time_, y_.data()))
    return failure(time_, "the joints cannot follow the prescribed motion");
  if (fresh_ || inputs_changed) {
    const bool first = fresh_;
    fresh_ = true;
    if (!begin(time_, y_.data(), !first))
      return failure(time_, "the accelerations cannot be computed at the start of the step");
    fresh_ = false;
  }

  const long steps_before = statistics_.steps;
  Outcome outcome = reach(end);
  if (outcome.ok) {
    double* y = data(error_);
    const double since = since_beginning(end);
    if (ahead_time_ == since)
      std::copy_n(data(ahead_), y_.size(), y);
    else
      CVodeGetDky(memory_.get(), since, 0, error_.get());
    if (integrates_work()) work_of(y) = work_.at(since, work_of(y));
    if (system_.has_loops() && (system_.project(end, y, nullptr) != Status::ok || system_.loops_are_lost()))
      outcome = failure(end, "the loops cannot be closed");
  }
  if (!outcome.ok) {
    fresh_ = true;
    return outcome;
  }
  std::copy_n(data(error_), y_.size(), y_.begin());
  time_ = end;
  if (statistics_.steps != steps_before && steps_taken_ > 0) {
    CVodeGetLastStep(memory_.get(), &statistics_.step_size);
    CVodeGetEstLocalErrors(memory_.get(), error_.get());
    CVodeGetErrWeights(memory_.get(), weights_.get());
    statistics_.error_estimate = error_weights_.norm(data(error_), data(weights_));
  }
  return outcome;
}

Outcome Cvode::explain(int flag) {
  const double time = absolute(ahead_time_);
  if (projection_failed_) return failure(time, "the loops cannot be closed");
  switch (flag) {
    case CV_ERR_FAILURE:
    case CV_CONV_FAILURE:
      return failure(time, "no step is small enough for the tolerance");
    case CV_RHSFUNC_FAIL:
    case CV_FIRST_RHSFUNC_ERR:
    case CV_REPTD_RHSFUNC_ERR:
    case CV_UNREC_RHSFUNC_ERR:
    case CV_LSETUP_FAIL:
      return failure(time, "the accelerations cannot be computed, or are not finite");
    case CV_PROJFUNC_FAIL:
    case CV_REPTD_PROJFUNC_ERR:
      return failure(time, "the loops cannot be closed");
    case CV_TOO_MUCH_ACC:
      return failure(time, tolerance_below_rounding);
    default:
      return failure(time, message_.reason());
  }
}

void Cvode::save(std::vector<unsigned char>& bytes) const {
  StateWriter writer(bytes);
  put(writer, state_header(system_, settings_, method_));
  writer.put(time_);
  writer.put(y_.data(), y_.size());
  writer.put(fresh_);
  writer.put(beginning_.time);
  writer.put(beginning_.first_step);
  writer.put(beginning_.careful);
  writer.put(beginning_.y.data(), beginning_.y.size());
  writer.put<std::uint64_t>(beginning_.tau.size());
  writer.put(beginning_.tau.data(), beginning_.tau.size());
  writer.put<std::int64_t>(beginning_.rejected_before);
  writer.put(ahead_time_);
  writer.put(steps_taken_);
  work_.put(writer);
  put(writer, statistics_);
}

bool Cvode::restore(const unsigned char* bytes, std::size_t size) {
  StateReader reader(bytes, size);
  if (!matches(reader, state_header(system_, settings_, method_))) return false;
  double time = 0, ahead_time = 0;
  std::vector<double> y(y_.size());
  unsigned char fresh = 0, careful = 0;
  Beginning beginning = beginning_;
  std::int64_t rejected_before = 0;
  std::uint64_t inputs = 0;
  std::int32_t steps_taken = 0;
  StepWork work;
  Statistics statistics;
  reader.get(time);
  reader.get(y.data(), y.size());
  reader.get(fresh);
  reader.get(beginning.time);
  reader.get(beginning.first_step);
  reader.get(careful);
  reader.get(beginning.y.data(), beginning.y.size());
  reader.get(inputs);
  if (!reader.good() || !system_.is_input_size(inputs)) return false;
  beginning.tau.resize(inputs);
  reader.get(beginning.tau.data(), inputs);
  reader.get(rejected_before);
  reader.get(ahead_time);
  reader.get(steps_taken);
  work.get(reader);
  get(reader, statistics);
  if (!reader.finished() || !std::isfinite(time) || fresh > 1) return false;
  beginning.careful = careful != 0;
  const bool repeatable = steps_taken >= 0 && steps_taken <= steps_between_restarts &&
                          std::isfinite(beginning.time) && beginning.first_step > 0;
  if (!fresh && !repeatable) return false;

  time_ = time;
  y_.swap(y);
  fresh_ = true;
  beginning_ = std::move(beginning);
  beginning_.rejected_before = static_cast<long>(rejected_before);
  if (!fresh) {
    // the same steps as then, under the inputs of then
    std::vector<double> tau_now = beginning_.tau;
    system_.swap_inputs(tau_now);
    reset_to_beginning();
    int flag = 0;
    while (steps_taken_ < steps_taken && flag >= 0) flag = take_step();
    system_.swap_inputs(tau_now);
    // another model or machine ends elsewhere: then begin anew from the state
    fresh_ = flag < 0 || ahead_time_ != ahead_time;
  }
  work_ = work;
  statistics_ = statistics;
  return true;
}

}  // namespace

std::unique_ptr<Integrator> make_adams(System& system, const SolverSettings& settings) {
  return std::make_unique<Cvode>(system, settings, SolverMethod::adams);
}

std::unique_ptr<Integrator> make_bdf(System& system, const SolverSettings& settings) {
  return std::make_unique<Cvode>(system, settings, SolverMethod::bdf);
}

}  // namespace redysim
