#include "integrate/methods/cvode.hpp"

#include <cvode/cvode.h>
#include <cvode/cvode_proj.h>
#include <sunmatrix/sunmatrix_dense.h>
#include <sunnonlinsol/sunnonlinsol_fixedpoint.h>
#include <sunnonlinsol/sunnonlinsol_newton.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include "integrate/methods/step_budget.hpp"
#include "integrate/methods/step_control.hpp"
#include "model/any_of.hpp"

namespace redysim {
namespace {

using namespace sundials;

// The errors of a multistep method accumulate, those of Runge-Kutta steps are damped or overestimated. The
// user's tolerance is therefore tightened until the global error matches that of the one-step methods at the
// same rtol: on the public scenes at 1e-8 it stays within 4e-6 (docs/solver_measurements.md). The errors of
// Adams in a bounce have one sign and accumulate in the energy (docs/contact.md).
constexpr double adams_tightening = 1.0 / 30;
constexpr double adams_contact_tightening = 1.0 / 300;
constexpr double bdf_tightening = 1.0 / 100;
constexpr double rounding_of_energy = 1e-15;  // of a work, relative to System::energy_scale
// relative to the error test; CVODE's 0.1 is less accurate, and an iteration is cheap
constexpr double newton_tolerance = 0.03;

// With contacts, CVODE changes the step size at this growth factor. A foot that begins to stick reduces the
// step to a hundredth, and with CVODE's factor 1.5 it grows again too late. Smaller factors need no new
// factorization.
constexpr double contact_growth = 1.2;

// CVODE's limits of the step size growth.
constexpr double growth = 10, growth_of_first_step = 1e4;

// Maximum numbers of failures in a step. Each failure reduces the step by a factor of 0.1 to 0.25. The limit
// suffices to pass a jump of a force, unless the step reaches the rounding error. CVODE's limits of 7 and 10
// are too small where a contact with ReDySim's law begins.
constexpr int failures_in_a_step = 40;

double tightening(SolverMethod method, const System& system) {
  if (method == SolverMethod::bdf) return bdf_tightening;
  const auto& laws = system.plan().contact_laws;
  const bool bounces = any_of(laws, [](const ContactLaw<double>& law) { return !law.redysim; });
  return bounces ? adams_contact_tightening : adams_tightening;
}

}  // namespace

void CvodeDeleter::operator()(void* memory) const { CVodeFree(&memory); }

Cvode::Cvode(System& system, const SolverSettings& settings, Scratch scratch, SolverMethod method)
    : system_(system),
      settings_(settings),
      method_(method),
      error_weights_(system, tightening(method, system) * settings.rtol,
                     tightening(method, system) * settings.atol),
      scratch_(std::move(scratch)),
      weights_(scratch_->vectors[0]),
      error_(scratch_->vectors[1]),
      ahead_(make_vector(system.size(), scratch_->context)),
      y_(static_cast<std::size_t>(system.size())),
      slope_(y_) {
  restart_.y = y_;
  restart_.inputs = system.inputs();
  if (system.with_work() && (system.control() || system.actuators() || system.plan().has_motion()))
    works_.resize(static_cast<std::size_t>(system.layout().work.count));
  build();
}

void Cvode::build() {
  const bool bdf = method_ == SolverMethod::bdf;
  memory_.reset(created(CVodeCreate(bdf ? CV_BDF : CV_ADAMS, scratch_->context)));
  void* cvode = memory_.get();
  CVodeSetErrHandlerFn(cvode, &LastMessage::keep, &scratch_->message);
  CVodeInit(cvode, &Cvode::right_hand_side, 0.0, ahead_.get());
  CVodeSetUserData(cvode, this);
  CVodeWFtolerances(cvode, &Cvode::weights);
  if (settings_.max_step > 0) CVodeSetMaxStep(cvode, step_limit(settings_.max_step));
  CVodeSetMaxErrTestFails(cvode, failures_in_a_step);
  CVodeSetMaxConvFails(cvode, failures_in_a_step);
  if (bdf) {
    build_newton();
  } else {
    nonlinear_solver_.reset(created(SUNNonlinSol_FixedPoint(ahead_.get(), 0, scratch_->context)));
    project_history_ = system_.has_constraints();
  }
  CVodeSetNonlinearSolver(cvode, nonlinear_solver_.get());

  // CVODE allocates in its first step: take that step here, with a zero right-hand side
  warming_up_ = true;
  CVodeSetInitStep(cvode, 1e-3);
  CVode(cvode, 1.0, ahead_.get(), &ahead_time_, CV_ONE_STEP);
  warming_up_ = false;
  statistics_ = {};
}

void Cvode::build_newton() {
  void* cvode = memory_.get();
  jacobian_ = &scratch_->jacobian();
  matrix_ = make_matrix(system_.size(), scratch_->context);
  linear_solver_ = make_linear_solver(system_, scratch_->context);
  CVodeSetLinearSolver(cvode, linear_solver_.get(), matrix_.get());
  CVodeSetJacFn(cvode, &Cvode::jacobian);
  CVodeSetNonlinConvCoef(cvode, newton_tolerance);
  if (system_.plan().has_contacts()) CVodeSetEtaFixedStepBounds(cvode, 0, contact_growth);
  nonlinear_solver_.reset(created(SUNNonlinSol_Newton(ahead_.get(), scratch_->context)));
  if (system_.has_constraints()) CVodeSetProjFn(cvode, &Cvode::project);
}

Outcome Cvode::start(double time, const double* y) {
  for (StepWork& work : works_) work.start();
  time_ = time;
  std::copy_n(y, y_.size(), y_.begin());
  restart_due_ = Due::first;
  statistics_ = {};
  return check_start(time, y_);
}

void Cvode::set_state(const double* y) {
  std::copy_n(y, y_.size(), y_.begin());
  restart_due_ = Due::first;
}

template <class Visit>
void Cvode::each_work(double* y, const Visit& visit) {
  StepWork::Power power{&Cvode::power, this, 0};
  for (StepWork& work : works_) {
    visit(work, system_.layout().work.of(y)[power.part], std::as_const(power));
    ++power.part;
  }
}

// Restarts at (time, y) with the present inputs; needs two right-hand sides. False: a slope is not finite.
bool Cvode::restart(double time, const double* y, bool repeated) {
  restart_.repeated = repeated;
  restart_.time = time;
  restart_.touch = 0;
  std::copy_n(y, y_.size(), restart_.y.begin());
  restart_.inputs = system_.inputs();
  restart_.rejected_before = statistics_.rejected;
  ++statistics_.evaluations;
  if (system_.right_hand_side(time, restart_.y.data(), slope_.data()) != Status::ok) return false;
  ++statistics_.evaluations;
  restart_.first_step = first_step(system_, error_weights_, 1, time, restart_.y.data(), slope_.data(),
                                   step_limit(settings_.max_step), scratch_->first_step);
  if (!(restart_.first_step > 0)) return false;
  reset_cvode();
  each_work(restart_.y.data(), [](StepWork& work, double& value, auto&) { work.begin(value); });
  slope_known_ = true;
  return true;
}

void Cvode::reset_cvode() {
  std::copy(restart_.y.begin(), restart_.y.end(), data(ahead_));
  CVodeReInit(memory_.get(), 0, ahead_.get());
  CVodeSetInitStep(memory_.get(), restart_.first_step);
  CVodeSetStopTime(memory_.get(), std::numeric_limits<double>::max());  // not reset by CVodeReInit
  ahead_time_ = 0;
  steps_taken_ = 0;
  slope_known_ = projection_failed_ = false;
  if (!system_.searched().empty()) system_.searched()[0] = NAN;
}

// Restarts at the state y of a step's end, without the errors of loops and of the method's work.
Outcome Cvode::restart_between_steps(double time, const double* y) {
  std::copy_n(y, y_.size(), data(error_));
  each_work(data(error_), [](StepWork& work, double& value, auto& power) { value = work.end(power); });
  if (system_.project(time, data(error_), nullptr) != Status::ok) return failure(time, reasons::loops_open);
  if (!restart(time, data(error_), true)) return failure(time, reasons::not_finite);
  return {};
}

// Whether the last step, of Adams, passes a jump of a force at an order above 1. The error estimate then
// assumes that derivatives vary over the previous steps, which are longer by orders of magnitude.
bool Cvode::passes_jump() {
  int order = 0;
  CVodeGetLastOrder(memory_.get(), &order);
  return order > 1 && method_ == SolverMethod::adams && corners_.jumps(system_);
}

// Time of a short touch, or of a short reversal, that the last step misses; its start, if a restart there
// must precede it; infinity: neither. The first step after a restart is not repeated.
double Cvode::missed_touch() {
  if (passes_jump()) return corners_.begin_time();
  if (!corners_.expects_touches() || steps_taken_ == 1) return std::numeric_limits<double>::infinity();
  error_weights_.evaluate(data(ahead_), data(weights_));
  return corners_.time_of_short_touch(system_, absolute(ahead_time_), data(ahead_), data(weights_));
}

// Restarts at the start of the last step; a later step ends at the touch.
Outcome Cvode::return_to(double touch) {
  ++statistics_.rejected;
  Outcome outcome = restart_between_steps(corners_.begin_time(), corners_.begin_state());
  restart_.touch = touch - restart_.time;
  return outcome;
}

// End of the next step, in CVODE's time, for a step size of at most `step`. Steps end at the breakpoints of
// trajectories and are limited within motions, which the error estimate can miss at rest. Two equal steps
// lead to a breakpoint instead of a small remainder. The result depends only on the restart and the
// trajectories, so that the steps can be repeated.
double Cvode::end_of_step(double step) const {
  const double now = absolute(ahead_time_);
  const StepLimits limits = system_.step_limits(now);
  const double longest = std::min(step, limits.longest);
  if (!(limits.knot > passed(now))) return ahead_time_ + longest;  // no breakpoint ahead
  const double knot = since_restart(limits.knot), left = knot - ahead_time_;
  constexpr double rounding = 1e-9;
  if (left <= (1 + rounding) * longest) return knot;
  return ahead_time_ + std::min(longest, 0.5 * left);
}

// Upper bound of CVODE's next step size: after a stop CVODE does not report it.
double Cvode::next_step() const {
  if (steps_taken_ == 0) return restart_.first_step;
  double step = 0;
  if (!stopped_) {
    CVodeGetCurrentStep(memory_.get(), &step);
    return step;
  }
  CVodeGetLastStep(memory_.get(), &step);
  return (steps_taken_ == 1 ? growth_of_first_step : growth) * step;
}

// Stops the next step where it would miss a contact, a short touch of a stop or a prescribed motion.
void Cvode::set_stop() {
  const bool touches = system_.plan().has_contacts();
  if (!touches && !system_.control() && restart_.touch == 0) return;
  const double step = next_step(), planned = ahead_time_ + step;
  double end = system_.control() ? end_of_step(step) : planned;
  if (restart_.touch > ahead_time_) end = std::min(end, restart_.touch);
  if (touches) {
    const double h = end - ahead_time_,
                 touch = system_.step_to_touch(absolute(ahead_time_), data(ahead_), h, false);
    if (touch < h) end = ahead_time_ + touch;
  }
  CVodeSetStopTime(memory_.get(), end < planned ? end : std::numeric_limits<double>::max());
}

int Cvode::take_step() {
  set_stop();
  // CVODE uses only the direction of the end time
  const int flag =
      CVode(memory_.get(), ahead_time_ + 1 + ahead_time_, ahead_.get(), &ahead_time_, CV_ONE_STEP);
  if (flag >= 0) ++steps_taken_;
  stopped_ = flag == CV_TSTOP_RETURN;
  return flag;
}

void Cvode::count_step() {
  ++statistics_.steps;
  long errors = 0, solver = 0;
  CVodeGetNumErrTestFails(memory_.get(), &errors);
  CVodeGetNumNonlinSolvConvFails(memory_.get(), &solver);
  statistics_.rejected = restart_.rejected_before + errors + solver;
}

void Cvode::count_work(double before) {
  if (works_.empty()) return;
  CVodeGetEstLocalErrors(memory_.get(), error_.get());
  const double rtol = std::max(tightening(method_, system_) * settings_.rtol, ErrorWeights::finest);
  each_work(data(ahead_), [&](StepWork& work, double& value, auto& power) {
    const double error = system_.layout().work.of(data(error_))[power.part];
    if (work.step(before, ahead_time_, value, error, rtol))
      work.set_rounding(rounding_of_energy * system_.energy_scale(absolute(ahead_time_), data(ahead_)));
  });
}

// System time -> CVODE's time; exact at the end of the last step.
double Cvode::since_restart(double end) const {
  return absolute(ahead_time_) == end ? ahead_time_ : end - restart_.time;
}

// Takes CVODE's steps until they pass `end`. If a pause is due, `end` is set to the time reached.
Outcome Cvode::step_past(double& end) {
  StepBudget budget(time_, end);
  for (long step = 0; ahead_time_ < since_restart(end); ++step) {
    const double now = absolute(ahead_time_);
    if (pause_after_ > 0 && step == pause_after_) {
      end = now;
      break;
    }
    if (budget.is_hopeless(step, now, end)) return failure(now, budget.hopeless(name()));
    if (step == budget.steps())
      return failure(now, budget.exceeded(system_, name(), settings_, now, data(ahead_), step));
    if (steps_taken_ == steps_between_restarts) {
      Outcome outcome = restart_between_steps(now, data(ahead_));
      if (!outcome.ok) return outcome;
    }
    each_work(data(ahead_), [](StepWork& work, double&, auto& power) { work.end(power); });
    const double before = ahead_time_;
    corners_.begin(system_, absolute(before), data(ahead_));
    const int flag = take_step();
    if (flag < 0) return failed(flag);
    if (!(ahead_time_ > before)) return failure(absolute(before), reasons::step_too_small);
    if (const double touch = missed_touch(); std::isfinite(touch)) {
      Outcome outcome = return_to(touch);
      if (!outcome.ok) return outcome;
      continue;
    }
    count_step();
    count_work(before);
  }
  return {};
}

Outcome Cvode::advance(double end, bool inputs_changed) {
  if (end == time_) return {};
  if (!is_later(end, time_)) return failure(time_, reasons::end_not_later);
  if (inputs_changed && system_.plan().has_motion() && !follow_motion(system_, time_, y_.data()))
    return failure(time_, reasons::motion_impossible);
  if (restart_due_ != Due::no || inputs_changed) {
    const bool repeated = restart_due_ != Due::first;
    restart_due_ = Due::first;
    if (!restart(time_, y_.data(), repeated)) return failure(time_, reasons::not_finite_at_start);
    restart_due_ = Due::no;
  }

  const std::int64_t steps_before = statistics_.steps;
  Outcome outcome = step_past(end);
  if (outcome.ok) outcome = interpolate(end);
  if (!outcome.ok) {
    restart_due_ = Due::first;
    return outcome;
  }
  std::copy_n(data(error_), y_.size(), y_.begin());
  time_ = end;
  if (statistics_.steps != steps_before && steps_taken_ > 0) count_last_step();
  return outcome;
}

// Sets error_ to the state at `end`, which lies within the last step.
Outcome Cvode::interpolate(double end) {
  double* y = data(error_);
  const double since = since_restart(end);
  if (ahead_time_ == since)
    std::copy_n(data(ahead_), y_.size(), y);
  else
    CVodeGetDky(memory_.get(), since, 0, error_.get());
  each_work(y, [&](StepWork& work, double& value, auto& power) { value = work.at(since, value, power); });
  return system_.close_within_step(end, y) ? Outcome() : failure(end, reasons::loops_open);
}

void Cvode::count_last_step() {
  CVodeGetLastStep(memory_.get(), &statistics_.step_size);
  CVodeGetEstLocalErrors(memory_.get(), error_.get());
  CVodeGetErrWeights(memory_.get(), weights_.get());
  statistics_.error_estimate = error_weights_.norm(data(error_), data(weights_));
}

Outcome Cvode::failed(int flag) {
  const double time = absolute(ahead_time_);
  if (projection_failed_) return failure(time, reasons::loops_open);
  switch (flag) {
    case CV_ERR_FAILURE:
    case CV_CONV_FAILURE:
      return failure(time, reasons::step_too_small);
    case CV_RHSFUNC_FAIL:
    case CV_FIRST_RHSFUNC_ERR:
    case CV_REPTD_RHSFUNC_ERR:
    case CV_UNREC_RHSFUNC_ERR:
    case CV_LSETUP_FAIL:
      return failure(time, reasons::not_finite);
    case CV_PROJFUNC_FAIL:
    case CV_REPTD_PROJFUNC_ERR:
      return failure(time, reasons::loops_open);
    case CV_TOO_MUCH_ACC:
      return failure(time, reasons::tolerance_below_rounding);
    default:
      return failure(time, scratch_->message.reason());
  }
}

std::unique_ptr<Integrator> make_adams(System& system, const SolverSettings& settings, Scratch scratch) {
  return std::make_unique<Cvode>(system, settings, std::move(scratch), SolverMethod::adams);
}

std::unique_ptr<Integrator> make_bdf(System& system, const SolverSettings& settings, Scratch scratch) {
  return std::make_unique<Cvode>(system, settings, std::move(scratch), SolverMethod::bdf);
}

}  // namespace redysim
