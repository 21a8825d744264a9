#include "fmi/instance/instance.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

#include "dynamics/assembly/freedom.hpp"
#include "dynamics/assembly/movability.hpp"
#include "fmi/boundary/arrays.hpp"
#include "fmi/variables/parameters.hpp"
#include "integrate/system/start.hpp"
#include "model/read/number.hpp"

namespace redysim {
namespace {

constexpr double infinity = std::numeric_limits<double>::infinity();

// Times of a master compare with this relative tolerance: clocks add up and count nanoseconds.
constexpr double time_tolerance = 1e-9;

// s: shorter steps are no steps, or quotients by them would overflow.
constexpr double no_time = 1e-100;

// No method can do better in double precision.
constexpr double tightest_rtol = 1e-13;

// How far a step's start may lie off our own time: rounding, and never a noticeable part of the step.
double start_slack(double time, double size) {
  const double rounding = 4 * std::numeric_limits<double>::epsilon() * std::abs(time);
  return std::max({std::min(time_tolerance * std::max(std::abs(time), size), 0.1 * size), rounding, no_time});
}

// No negative principal moment, rounding aside: no negative principal minor.
bool is_possible_inertia(const std::array<double, 6>& inertia) {
  const auto& [xx, yy, zz, xy, xz, yz] = inertia;
  const double scale = xx + yy + zz, slack = 1e-12 * scale * scale;
  const double minor_x = yy * zz - yz * yz, minor_y = xx * zz - xz * xz, minor_z = xx * yy - xy * xy;
  const double determinant = xx * minor_x - xy * (xy * zz - yz * xz) + xz * (xy * yz - yy * xz);
  return xx >= 0 && yy >= 0 && zz >= 0 && minor_x >= -slack && minor_y >= -slack && minor_z >= -slack &&
         determinant >= -slack * scale;
}

}  // namespace

Instance::Instance(const Log& log, Model model, std::string guid)
    : log_(log),
      guid_(std::move(guid)),
      model_(std::move(model)),
      plan_(model_),
      table_(model_, plan_),
      system_(plan_, has_work(model_, plan_), &model_),
      start_method_(model_.solver.method),
      applied_inputs_(system_.inputs().size(), 0.0),
      motion_(3 * static_cast<std::size_t>(plan_.nv), 0.0),
      motion_set_(motion_.size(), 0),
      start_state_(system_.size(), 0.0),
      settled_state_(start_state_),
      qdd_(plan_.nv, 0.0),
      drive_(plan_.nv, 0.0),
      ball_alpha_(plan_.balls.size()) {
  for (const Variable& variable : table_.all())
    if (parameter(model_, variable)) start_values_.push_back(*parameter(model_, variable));
  take_start_motion();
}

void Instance::take_start_motion() {
  for (int i = 0; i < plan_.nv; ++i)
    if (plan_.joints[i].prescribed) {
      const auto start = start_motion(model_.links[plan_.joints[i].link].joint);
      std::copy(start.begin(), start.end(), &motion_[3 * i]);
    }
  anchor_motion();
}

// All prescribed motions begin now, as they were set last.
void Instance::anchor_motion() {
  system_.enter_phases(time_);
  for (int i = 0; i < plan_.nv; ++i)
    if (plan_.joints[i].prescribed)
      system_.set_motion(time_, i, motion_[3 * i], motion_[3 * i + 1], motion_[3 * i + 2]);
}

fmi2Status Instance::refuse(Function function, const std::string& why) {
  log_.error(std::string(name(function)) + ": " + why);
  return fmi2Error;
}

fmi2Status Instance::set_debug_logging(bool on, std::size_t count, const fmi2String* categories) {
  if (const char* why = objection_to_arrays(count, {categories}))
    return refuse(Function::set_debug_logging, why);
  if (const char* unknown = log_.set(on, count, categories))
    return refuse(Function::set_debug_logging, "there is no log category '" + std::string(unknown) + "'");
  return fmi2OK;
}

fmi2Status Instance::setup_experiment(bool has_tolerance, double tolerance, double start, bool has_stop,
                                      double stop) {
  constexpr Function function = Function::setup_experiment;
  if (has_tolerance && !(std::isfinite(tolerance) && tolerance > 0))
    return refuse(function, "the tolerance must be a finite number > 0, got " + shown(tolerance));
  if (!std::isfinite(start)) return refuse(function, "the start time must be finite, got " + shown(start));
  if (has_stop && !(std::isfinite(stop) && stop >= start))
    return refuse(function, "the stop time must be finite and not before the start time " + shown(start) +
                                ", got " + shown(stop));
  tolerance_ = has_tolerance ? tolerance : infinity;
  time_ = start_time_ = start;
  stop_time_ = has_stop ? stop : infinity;
  system_.anchor_input_slopes(time_);
  anchor_motion();
  if (system_.control()) start_state_current_ = false;
  return fmi2OK;
}

fmi2Status Instance::enter_initialization_mode() {
  state_ = State::initialization;
  return fmi2OK;
}

fmi2Status Instance::exit_initialization_mode() {
  constexpr Function function = Function::exit_initialization_mode;
  for (const Ball& ball : model_.balls)
    if (!(Eigen::Map<const Eigen::Vector4d>(ball.quaternion.data()).norm() > 1e-6))
      return refuse(function, ball.name + ".quaternion0 must not be zero");
  // a start that cannot move is found here, not in the first step
  if (!update_plan(function)) return fmi2Error;
  std::string immovable = why_immovable();
  if (immovable.empty() && !start_is_closed(function)) return fmi2Error;
  if (immovable.empty()) immovable = why_immovable_at_start();
  if (!immovable.empty()) return refuse(function, immovable);
  if (!update_accelerations(function)) return fmi2Error;
  integrator_settings_ = effective_settings();
  system_.set_scales(model_);
  std::unique_ptr<Integrator> integrator = make_integrator(system_, integrator_settings_);
  const Outcome outcome = integrator->start(start_time_, current_state());
  if (!outcome.ok) return refuse(function, outcome.message);
  if (system_.with_work()) {
    if (!update_energies(function)) return fmi2Error;
    energy_offset_ = kinetic_energy_ + potential_energy_ - system_.work(current_state());
  }
  integrator_ = std::move(integrator);
  applied_inputs_ = system_.inputs();
  travel_.clear();
  note_travel();
  parameters_changed_ = false;
  time_ = start_time_;
  state_ = State::step;
  if (log_.events())
    log_.event("start at " + shown(start_time_) + " s, solver " + integrator_->name() + ", rtol " +
               shown(integrator_settings_.rtol));
  report_drives();
  return fmi2OK;
}

// A master's tolerance tightens the model's, both parts alike, and never loosens it.
SolverSettings Instance::effective_settings() const {
  SolverSettings settings = model_.solver;
  const double wanted = std::max(tolerance_, tightest_rtol);
  if (wanted < settings.rtol) {
    settings.atol *= wanted / settings.rtol;
    settings.rtol = wanted;
  }
  return settings;
}

fmi2Status Instance::do_step(double current, double size) {
  constexpr Function function = Function::do_step;
  if (!(std::isfinite(size) && size >= 0))
    return refuse(function, "the step size must be finite and not negative, got " + shown(size));
  if (!(std::abs(current - time_) <= start_slack(time_, size)))
    return refuse(function,
                  "the step starts at " + shown(current) + " s, but the FMU is at " + shown(time_) + " s");
  const double end = current + size;
  if (!std::isfinite(end)) return refuse(function, "the end of the communication step is not finite");
  if (end > stop_time_ + time_tolerance * std::max(std::abs(stop_time_), size))
    return refuse(function,
                  "the step ends at " + shown(end) + " s, after the stop time " + shown(stop_time_) + " s");
  if (end <= time_ + no_time) return fmi2OK;  // no time passes
  if (!update_plan(function)) return fmi2Error;
  report_unset_motion();

  const bool inputs_changed = parameters_changed_ || applied_inputs_ != system_.inputs();
  system_.forget_failure();
  const Outcome outcome = advance(*integrator_, system_, end, inputs_changed);
  applied_inputs_ = system_.inputs();
  end_input_slopes(outcome.ok ? end : integrator_->time());
  parameters_changed_ = false;
  settled_ = true;
  values_changed();
  note_travel();
  if (outcome.ok) {
    time_ = end;
    return fmi2OK;
  }
  time_ = integrator_->time();
  state_ = State::failed;
  const std::string joint = failed_joint_name();
  const bool named = joint.empty() || outcome.message.find(joint) != std::string::npos;
  return refuse(function, outcome.message + (named ? "" : " (joint '" + joint + "')") +
                              "; the state is the one at " + shown(time_) + " s");
}

fmi2Status Instance::terminate() {
  state_ = State::terminated;
  report_short_travel();
  log_.event("terminated at " + shown(time_) + " s");
  return fmi2OK;
}

fmi2Status Instance::reset() {
  restore_start_values();
  system_.resize_inputs(system_.base_size());
  std::fill(system_.inputs().begin(), system_.inputs().end(), 0.0);
  applied_inputs_ = system_.inputs();
  integrator_.reset();
  state_ = State::instantiated;
  start_time_ = time_ = energy_offset_ = 0;
  take_start_motion();
  std::fill(motion_set_.begin(), motion_set_.end(), 0);
  motion_checked_ = false;
  stop_time_ = tolerance_ = infinity;
  parameters_changed_ = false;
  settled_ = true;
  values_changed();
  start_state_current_ = false;
  log_.event("reset");
  return fmi2OK;
}

void Instance::restore_start_values() {
  auto start = start_values_.begin();
  for (const Variable& variable : table_.all())
    if (double* value = parameter(model_, variable)) *value = *start++;
  model_.solver.method = start_method_;
  plan_current_ = false;
}

void Instance::values_changed() { qdd_current_ = energies_current_ = false; }

const double* Instance::current_state() {
  if (integrator_) return settled_ ? integrator_->state() : settle();
  if (!start_state_current_) {
    assembly_ = take_start(model_, system_, time_, start_state_.data());
    start_state_current_ = true;
  }
  return start_state_.data();
}

bool Instance::start_is_closed(Function function) {
  if (!system_.has_loops()) return true;
  current_state();
  const std::string why = failure(model_, assembly_);
  if (!why.empty()) {
    refuse(function, why);
    return false;
  }
  for (const std::string& text : corrections(model_, plan_, assembly_)) log_.warning(text);
  return true;
}

// What the integrator will do first thing in the next step: the state follows the prescribed motion.
const double* Instance::settle() {
  if (!settled_state_current_) {
    std::copy_n(integrator_->state(), settled_state_.size(), settled_state_.begin());
    landed_ = system_.follow_jumps(time_, settled_state_.data());
    settled_state_current_ = true;
  }
  return settled_state_.data();
}

bool Instance::update_plan(Function function) {
  if (plan_current_) return true;
  std::string why = impossible_parameter();
  if (why.empty()) {
    renew_plan();
    if (integrator_ && inertia_tuned_) why = why_immovable();
    inertia_tuned_ = !why.empty();
  }
  plan_current_ = why.empty();
  if (!plan_current_) refuse(function, why);
  return plan_current_;
}

// Which joint moves nothing at any pose; empty: none. Uses the workspace.
std::string Instance::why_immovable() {
  const int joint = always_singular_joint(plan_, system_.workspace());
  return joint < 0 ? std::string() : singular_sentence(model_, plan_, joint, "");
}

std::string Instance::why_immovable_at_start() {
  const double* q = system_.coordinates(time_, current_state()).q;
  const int joint = singular_joint(plan_, system_.workspace(), q);
  return joint < 0 ? std::string() : singular_sentence(model_, plan_, joint, " at the start pose");
}

// Which parameters contradict each other; empty: none.
std::string Instance::impossible_parameter() const {
  for (const Link& link : model_.links)
    if (!is_possible_inertia(link.inertia))
      return "the inertia of link '" + link.name + "' has a negative principal moment";
  for (const Link& link : model_.links)
    if (!(link.joint.lower < link.joint.upper))
      return link.joint.name + ".upper must be greater than " + link.joint.name + ".lower";
  return {};
}

// Brings tuned parameters into force. The balance goes on from its value: tuning is no energy error.
void Instance::renew_plan() {
  const bool rebase = integrator_ && system_.with_work();
  double before = 0;
  if (rebase)
    before =
        system_.kinetic_energy(time_, current_state()) + system_.potential_energy(time_, current_state());
  plan_.update(model_);
  system_.update_control(model_);
  if (rebase)
    energy_offset_ += system_.kinetic_energy(time_, current_state()) +
                      system_.potential_energy(time_, current_state()) - before;
  plan_current_ = true;
}

std::string Instance::failed_joint_name() const {
  const int joint = system_.failed_joint();
  if (joint < 0 || joint >= static_cast<int>(plan_.joints.size())) return {};
  for (std::size_t ball = 0; ball < plan_.balls.size(); ++ball)
    if (joint >= plan_.balls[ball] && joint < plan_.balls[ball] + 4) return model_.balls[ball].name;
  return model_.links[plan_.joints[joint].link].joint.name;
}

}  // namespace redysim
