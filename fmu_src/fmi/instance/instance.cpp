#include "fmi/instance/instance.hpp"

#include <algorithm>
#include <utility>

#include "fmi/boundary/arrays.hpp"
#include "fmi/boundary/assembly_messages.hpp"
#include "fmi/instance/contact_warnings.hpp"
#include "integrate/methods/force_corners.hpp"
#include "integrate/system/start.hpp"
#include "model/number.hpp"
#include "model/solver_methods.hpp"

namespace redysim {

Instance::Instance(const Log& log, Model model, std::string guid, bool model_exchange)
    : log_(log),
      guid_(std::move(guid)),
      simulation_(std::move(model), model_exchange),
      state_(simulation_),
      parameters_(simulation_, state_),
      motion_(simulation_),
      values_(simulation_, state_, parameters_, motion_),
      derivatives_(simulation_, state_, values_),
      applied_inputs_(simulation_.system.inputs().size(), 0.0) {}

fmi2Status Instance::refuse(Function function, const std::string& why) {
  log_.error(name_of(function) + ": " + why);
  return fmi2Error;
}

fmi2Status Instance::discard(Function function, const std::string& why, double* values, std::size_t count) {
  log_.warning(name_of(function) + ": " + why, fmi2Discard);
  std::fill_n(values, count, std::numeric_limits<double>::quiet_NaN());
  return fmi2Discard;
}

fmi2Status Instance::set_debug_logging(bool on, std::size_t count, const fmi2String* categories) {
  if (const char* why = objection_to_arrays(count, {categories}))
    return refuse(Function::set_debug_logging, why);
  if (const char* unknown = log_.set(on, count, categories))
    return refuse(Function::set_debug_logging, "unknown log category '" + std::string(unknown) + "'");
  return fmi2OK;
}

fmi2Status Instance::setup_experiment(bool has_tolerance, double tolerance, double start, bool has_stop,
                                      double stop) {
  const std::string why = life_.set_up(has_tolerance, tolerance, start, has_stop, stop);
  if (!why.empty()) return refuse(Function::setup_experiment, why);
  simulation_.time = start;
  simulation_.system.anchor_input_slopes(start);
  motion_.begin();
  if (simulation_.system.control()) state_.start_changed();
  return fmi2OK;
}

fmi2Status Instance::enter_initialization_mode() {
  life_.state = State::initialization;
  return fmi2OK;
}

fmi2Status Instance::exit_initialization_mode() {
  constexpr Function function = Function::exit_initialization_mode;
  for (std::size_t k = 0; k < simulation_.model.balls.size(); ++k)
    if (!has_orientation(simulation_.parameters.balls[k].quaternion.data()))
      return refuse(function, simulation_.model.balls[k].name +
                                  ".quaternion0 must not be zero, its length at most 1e100");
  // a singular mass matrix is reported here, not in the first step
  std::string why = values_.update(Needs::parameters);
  if (why.empty()) why = parameters_.immovable();
  if (why.empty()) why = assemble_start();
  if (why.empty()) why = immovable_at_start();
  if (why.empty()) why = values_.update(Needs::accelerations);
  if (why.empty()) why = start_integrator();
  if (!why.empty()) return refuse(function, why);
  applied_inputs_ = simulation_.system.inputs();
  travel_.begin(simulation_);
  simulation_.time = life_.start_time;
  why = parameters_.bring_into_force();
  values_.changed();
  if (!why.empty()) {
    simulation_.integrator.reset();  // still in initialization
    return refuse(function, why);
  }
  parameters_.stepped();
  life_.state = simulation_.model_exchange ? State::event : State::step;
  if (simulation_.model_exchange) states_given();
  nominals_are_new_ = true;
  if (log_.events())
    log_.event("start at " + shown(life_.start_time) + " s, solver " + simulation_.integrator->name() +
               (simulation_.model_exchange ? "" : ", rtol " + shown(simulation_.integrator_settings.rtol)));
  report_drives();
  report_contacts();
  report_corners();
  return fmi2OK;
}

std::string Instance::assemble_start() {
  const Model& model = simulation_.model;
  if (!simulation_.system.has_constraints() && !model.starts_in_equilibrium) return {};
  state_.y();
  const Assembly& assembly = state_.how_started().assembly;
  std::string why = failure(model, assembly);
  if (!why.empty()) return why;
  for (const std::string& text : corrections(model, simulation_.plan, assembly)) log_.warning(text);
  return failure(model, simulation_.plan, state_.how_started().rest);
}

std::string Instance::immovable_at_start() {
  const double* q = values_.coordinates().q;
  const int joint = singular_joint(simulation_.plan, simulation_.system.workspace(), q);
  return joint < 0 ? std::string()
                   : singular_sentence(simulation_.model, simulation_.plan, joint, " at the start pose");
}

std::string Instance::start_integrator() {
  System& system = simulation_.system;
  const SolverSettings settings = life_.effective(simulation_.parameters.solver);
  if (std::string why = objection_to_method(settings.method); !why.empty()) return why;
  if (std::string why = objection_to_max_rhs(settings); !why.empty()) return "solver." + why;
  simulation_.integrator_settings = settings;
  system.set_scales(simulation_.model, simulation_.parameters);
  std::unique_ptr<Integrator> integrator = simulation_.make_integrator(settings);
  Outcome outcome = integrator->start(life_.start_time, state_.y());
  if (!outcome.ok) return std::move(outcome.message);
  if (system.with_work()) {
    std::string why = values_.update(Needs::energies);
    if (!why.empty()) return why;
    parameters_.energy_offset =
        values_.kinetic_energy() + values_.potential_energy() - system.work(state_.y());
  }
  simulation_.integrator = std::move(integrator);
  return {};
}

fmi2Status Instance::do_step(double current, double size) {
  constexpr Function function = Function::do_step;
  if (const std::string why = life_.objection_to_step(simulation_.time, current, size); !why.empty())
    return refuse(function, why);
  double end = current + size;
  StepJacobian* const jacobian = values_.step_jacobian();
  if (is_empty_step(simulation_.time, end)) {
    if (jacobian) jacobian->forget();
    return fmi2OK;
  }
  if (!parameters_.in_force())
    if (const std::string why = parameters_.bring_into_force(); !why.empty()) return refuse(function, why);
  if (!motion_.is_reported()) report_unset_motion();

  System& system = simulation_.system;
  Integrator& integrator = *simulation_.integrator;
  const bool inputs_changed = inputs_have_changed();
  system.forget_failure();
  integrator.begin_communication_step();
  const std::int64_t decisions = integrator.decisions();
  if (jacobian) jacobian->begin_step(parameters_);
  const Outcome outcome = advance_to(end, inputs_changed);
  if (integrator.decisions() != decisions && log_.events()) log_.event(integrator.last_decision());
  applied_inputs_ = system.inputs();  // with phases, samples and followed jumps of the step
  end_input_slopes(outcome.ok ? end : integrator.time());
  parameters_.stepped();
  state_.stepped();
  values_.changed();
  travel_.note(simulation_);
  simulation_.time = outcome.ok ? end : integrator.time();
  if (jacobian) jacobian->end_step(outcome.ok);
  if (outcome.ok) return fmi2OK;
  life_.state = State::failed;
  return refuse(function, failed_step(outcome));
}

Outcome Instance::advance_to(double& end, bool inputs_changed) {
  try {
    return update_.callback ? advance_with_updates(end, inputs_changed)
                            : advance(*simulation_.integrator, simulation_.system, end, inputs_changed);
  } catch (...) {  // out of memory: the integrator may be between two states
    life_.state = State::failed;
    throw;
  }
}

// Whether the inputs differ from those at the end of the last step, or the solver's history is invalid.
bool Instance::inputs_have_changed() {
  return parameters_.void_history() || applied_inputs_ != simulation_.system.inputs();
}

// Integrator::advance with a callback after each internal step; an early return changes `end`.
Outcome Instance::advance_with_updates(double& end, bool inputs_changed) {
  Integrator& integrator = *simulation_.integrator;
  integrator.pause_after(1);
  for (;;) {
    Outcome outcome = advance(integrator, simulation_.system, end, inputs_changed);
    simulation_.time = integrator.time();
    if (!outcome.ok || !(simulation_.time < end)) return outcome;
    inputs_changed = false;
    state_.stepped();
    values_.changed();
    bool early = false;
    double at = end;
    life_.state = State::intermediate;
    update_.callback(update_.environment, simulation_.time, false, true, true, update_.may_return_early,
                     &early, &at);
    life_.state = State::step;
    if (!early || !update_.may_return_early) continue;
    if (at < end) end = at;
    if (!is_empty_step(simulation_.time, end)) continue;
    end = simulation_.time;
    return outcome;
  }
}

std::string Instance::failed_step(const Outcome& outcome) {
  const std::string joint = simulation_.failed_joint();
  const bool named = joint.empty() || outcome.message.find(joint) != std::string::npos;
  const Plan<double>& plan = simulation_.plan;
  // at a dead point velocities grow without bound, and no step is short enough; so do computed torques
  const bool moves = plan.prescribed_count > static_cast<int>(plan.balls.size());
  const bool computes = simulation_.model.controller.law == Law::computed_torque;
  const char* possible_cause = "";
  if (plan.has_constraints() && moves)
    possible_cause = "; the prescribed motions may contradict the loops or couplings, or reach a dead point";
  else if (plan.has_constraints() && computes)
    possible_cause = "; the controlled joints may depend on each other in this pose";
  return outcome.message + (named ? "" : " (joint '" + joint + "')") + possible_cause +
         "; the state is the one at " + shown(simulation_.time) + " s";
}

// The inputs keep their final values, which replace the values last set.
void Instance::end_input_slopes(double time) {
  System& system = simulation_.system;
  if (!system.has_input_slopes()) return;
  system.end_input_slopes(time);
  for (int i = 0; i < simulation_.plan.nv; ++i)
    if (simulation_.plan.joints[i].prescribed) motion_.inputs_ended(i, system.inputs()[i]);
}

fmi2Status Instance::terminate() {
  life_.state = State::terminated;
  if (simulation_.integrator && log_.warnings())
    for (const std::string& text : travel_.unresolved(simulation_)) log_.warning(text);
  if (simulation_.integrator && simulation_.integrator->statistics().loosened > 0)
    log_.warning("solver.max_rhs loosened the tolerance in " +
                 std::to_string(simulation_.integrator->statistics().loosened) +
                 " communication steps: raise it, or ask for less accuracy");
  log_.event("terminated at " + shown(simulation_.time) + " s");
  return fmi2OK;
}

fmi2Status Instance::reset() {
  System& system = simulation_.system;
  parameters_.reset();
  system.resize_inputs(system.base_size());
  std::fill(system.inputs().begin(), system.inputs().end(), 0.0);
  applied_inputs_ = system.inputs();
  simulation_.integrator.reset();
  simulation_.time = 0;
  singular_is_reported_ = false;
  travel_ = {};
  life_ = {};
  system.set_scales(simulation_.model, simulation_.parameters);
  motion_.reset();
  state_.reset();
  values_.changed();
  if (values_.step_jacobian()) values_.step_jacobian()->forget();
  log_.event("reset");
  return fmi2OK;
}

// Compares the prescribed motions with the degrees of freedom of closed loops and logs the result.
void Instance::report_drives() {
  if (!simulation_.plan.has_constraints() || !simulation_.plan.has_motion()) return;
  if (!log_.events() && !log_.warnings()) return;
  const Freedom found = freedom(simulation_.model, simulation_.plan, values_.coordinates().q);
  if (found.surplus > 0)
    log_.warning(sentence(found));
  else
    log_.event(sentence(found));
  const Tangent::Misfit misfits = misfit_of_accelerations(simulation_.model, simulation_.parameters,
                                                          simulation_.system, simulation_.time, state_.y());
  if (misfits.constraint >= 0)
    log_.warning(misfit(simulation_.model, misfits.constraint, misfits.acceleration));
}

void Instance::report_contacts() {
  if (!simulation_.plan.has_contacts() || !log_.warnings()) return;
  for (const ContactWarning& warning :
       contact_warnings(simulation_.model, simulation_.plan, simulation_.system.workspace()))
    log_.warning(warning.sentence);
}

// A step of `exponential` lasts many periods of a vibration; corners of forces within it remain unnoticed.
void Instance::report_corners() {
  if (simulation_.model_exchange || simulation_.integrator->method() != SolverMethod::exponential) return;
  if (corners_of(simulation_.system) != 0)
    log_.warning(
        "method exponential may pass stops, friction, backlash, contacts and limits of actuators within a "
        "step: compare with shorter communication steps, or use auto");
}

void Instance::report_unset_motion() {
  const std::string names = motion_.never_set();
  if (names.empty()) return;
  log_.warning("inputs of prescribed motions that were never set: " + names +
               "; each follows from its start value and the other inputs of its joint. Set q, qd and qdd of "
               "every prescribed joint");
}

}  // namespace redysim
