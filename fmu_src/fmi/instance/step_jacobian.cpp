#include "fmi/instance/step_jacobian.hpp"

#include <algorithm>
#include <cmath>

#include "dynamics/ball.hpp"
#include "fmi/variables/groups.hpp"
#include "fmi/variables/parameters.hpp"
#include "integrate/methods/methods.hpp"

namespace redysim {
namespace {

constexpr double tightest = 1e-13;  // minimum rtol; the right-hand side has rounding errors

}  // namespace

StepJacobian::StepJacobian(Simulation& simulation)
    : simulation_(simulation),
      parameters_(simulation.parameters),
      plan_(simulation.model, parameters_),
      system_(plan_, false, &simulation.model),
      coordinates_(coordinate_places(system_)),
      velocities_(static_cast<int>(coordinates_.size())) {
  for (const Variable& variable : simulation.table.all()) {
    if (is_force_input(variable)) knowns_.push_back(&variable);
    if (parameter(parameters_, variable)) ++parameter_count_;
  }
  inputs_ = static_cast<int>(knowns_.size());
  if (!simulation.model.fmu.shows(OutputGroup::parameter_jacobian)) return;
  for (const Variable& variable : simulation.table.all())
    if (is_differentiable_tunable(variable)) knowns_.push_back(&variable);
}

void StepJacobian::begin_step(const ParameterSet& given) {
  const bool are_new = given.changed() || step_.empty();
  const double* y = simulation_.integrator->state();
  const std::vector<double>& held = simulation_.system.inputs();
  step_.resize(first_input());
  step_[0] = step_[1] = simulation_.time;
  for (std::size_t end = 0; end < 2; ++end) std::copy_n(y, size(), &step_[2 + end * size()]);
  if (are_new) {
    const std::vector<double> values = given.values();
    std::copy(values.begin(), values.end(), step_.begin() + static_cast<std::ptrdiff_t>(first_parameter()));
    set_parameters();
  }
  step_.insert(step_.end(), held.begin(), held.end());
  current_ = Current::none;
}

void StepJacobian::set_parameters() {
  const double* value = step_.data() + first_parameter();
  for (const Variable& variable : simulation_.table.all())
    if (double* place = parameter(parameters_, variable)) *place = *value++;
  plan_.update(parameters_);
  system_.update_drives(parameters_);
  has_parameters_ = false;
}

void StepJacobian::end_step(bool ok) {
  if (!ok) return forget();
  step_[1] = simulation_.time;
  std::copy_n(simulation_.integrator->state(), size(), &step_[2 + size()]);
  current_ = Current::none;
}

void StepJacobian::forget() { restore({}); }

bool StepJacobian::fits(const std::vector<double>& step) const {
  return step.empty() || (step.size() >= first_input() && step[1] > step[0] &&
                          system_.is_input_size(step.size() - first_input()));
}

void StepJacobian::restore(const std::vector<double>& step) {
  step_ = step;
  current_ = Current::none;
  if (!step_.empty()) set_parameters();
}

double StepJacobian::entry(Part part, int element) const {
  const auto rows = static_cast<std::size_t>(coordinates()), forces = static_cast<std::size_t>(inputs_);
  const std::size_t counts[] = {rows, forces, knowns_.size() - forces};
  const std::size_t firsts[] = {0, rows, rows + counts[inputs]};
  const auto at = static_cast<std::size_t>(element);
  return values_[(firsts[part] + at % counts[part]) * rows + at / counts[part]];
}

std::string StepJacobian::update(bool with_knowns) {
  if (!step_.empty() && !(step_[1] > step_[0])) return "step_jacobian: the communication step has not ended";
  const int rows = coordinates();
  const std::size_t knowns = with_knowns ? knowns_.size() : 0, all = static_cast<std::size_t>(rows) + knowns;
  std::vector<double> y(size());
  columns_.assign(all * size(), 0.0);
  values_.assign(all * static_cast<std::size_t>(rows), 0.0);
  if (step_.empty()) {
    for (int c = 0; c < rows; ++c)
      if (c >= 2 * velocities_ || coordinates_[c % velocities_].position >= 0)
        values_[static_cast<std::size_t>(c) * static_cast<std::size_t>(rows + 1)] = 1;
  } else {
    std::copy_n(&step_[2], size(), y.begin());
    if (const std::string why = go_to_start(y.data()); !why.empty()) return why;
    for (int c = 0; c < rows; ++c)
      lift(step_[0], y.data(), &columns_[static_cast<std::size_t>(c) * size()], c);
    if (const std::string why = integrate(transition(knowns), y.data()); !why.empty()) return why;
    for (std::size_t c = 0; c < all; ++c)
      for (int r = 0; r < rows; ++r)
        values_[c * static_cast<std::size_t>(rows) + static_cast<std::size_t>(r)] =
            lower(y.data(), &columns_[c * size()], r);
  }
  current_ = with_knowns ? Current::all : Current::by_state;
  return {};
}

Transition& StepJacobian::transition(std::size_t knowns) {
  std::unique_ptr<Transition>& found = transitions_[knowns > 0];
  if (!found)
    found = std::make_unique<Transition>(
        system_, coordinates() + static_cast<int>(knowns), static_cast<int>(knowns),
        [this](double time, const double* at, const DenseJacobian& jacobian, double* columns) {
          return by_knowns(time, at, jacobian, columns);
        });
  return *found;
}

// Sets system_ to the start of the step. Returns the reason of a failure, empty on success.
std::string StepJacobian::go_to_start(double* y) {
  const double time = step_[0];
  system_.resize_inputs(step_.size() - first_input());
  std::copy(step_.begin() + static_cast<std::ptrdiff_t>(first_input()), step_.end(),
            system_.inputs().begin());
  system_.scales() = simulation_.system.scales();
  if (system_.plan().has_motion() && !follow_motion(system_, time, y)) return reasons::motion_impossible;
  if (!tangent_) tangent_ = std::make_unique<Tangent>(simulation_.model, system_);
  if (system_.has_constraints()) {  // lift needs the elimination
    tangent_->go_to(parameters_, system_, time, y);
    if (!has_parameters_) tangent_->apply_parameters();
    has_parameters_ = true;
  }
  return {};
}

// Integrates in parts, as advance_by_breakpoints.
std::string StepJacobian::integrate(Transition& transition, double* y) {
  double time = step_[0];
  const double end = step_[1];
  const double rtol = std::max(simulation_.integrator_settings.rtol, tightest);
  const double* y_end = &step_[2 + size()];
  for (;;) {
    system_.enter_phases(time);
    const double halt = next_halt(system_, time, end);
    if (halt != end || time != step_[0]) y_end = nullptr;
    Outcome outcome = transition.advance(time, halt, rtol, y, columns_.data(), y_end);
    if (!outcome.ok) return "step_jacobian: " + outcome.message;
    if (halt == end) return {};
    time = halt;
  }
}

// Adds the change of the state by a unit change of a coordinate, projected onto the loop constraints.
void StepJacobian::lift(double time, const double* y, double* column, int coordinate) {
  const StateLayout& layout = system_.layout();
  if (coordinate >= 2 * velocities_) {
    column[layout.motor_q.begin + coordinate - 2 * velocities_] = 1;
    return;
  }
  const CoordinatePlace& at = coordinates_[coordinate % velocities_];
  if (at.position < 0) return;
  double* const velocities = column + layout.nq();
  if (coordinate >= velocities_) {
    velocities[at.velocity - layout.nq()] = 1;
    if (system_.has_constraints()) system_.project_velocity(velocities);
    return;
  }
  // positions and rotation vectors of spherical joints, as velocities that lead to them in unit time
  std::vector<double> positions(static_cast<std::size_t>(layout.nv()));
  positions[at.velocity - layout.nq()] = 1;
  if (system_.has_constraints()) system_.project_velocity(positions.data());
  for (int k = 0; k < system_.simple(); ++k) column[layout.q[k]] = positions[layout.qd[k] - layout.nq()];
  for (int ball = 0; ball < system_.balls(); ++ball)
    quaternion_rate(layout.quaternion.of(y, ball), &positions[layout.omega[ball] - layout.nq()],
                    layout.quaternion.of(column, ball));
  if (system_.has_constraints()) system_.cancel_rates(row_rates(time, y, column), column);
}

// Rates of the constraint rows along a change of the positions.
const std::vector<Dual>& StepJacobian::row_rates(double time, const double* y, const double* column) {
  const StateLayout& layout = system_.layout();
  for (int k = 0; k < system_.simple(); ++k)
    tangent_->q[system_.joint_of(k)].derivative = column[layout.q[k]];
  for (int ball = 0; ball < system_.balls(); ++ball)
    std::copy_n(layout.quaternion.of(column, ball), 4, tangent_->balls[ball].quaternion);
  return tangent_->row_rates(system_, time, y);
}

// The change of a coordinate that belongs to a change of the state at y.
double StepJacobian::lower(const double* y, const double* column, int coordinate) const {
  if (coordinate >= 2 * velocities_)
    return column[system_.layout().motor_q.begin + coordinate - 2 * velocities_];
  const CoordinatePlace& at = coordinates_[coordinate % velocities_];
  if (at.position < 0) return 0;
  if (coordinate >= velocities_) return column[at.velocity];
  if (at.ball < 0) return column[at.position];
  return rotation_vector(y + at.position, column + at.position)[at.axis];
}

Status StepJacobian::by_knowns(double time, const double* y, const DenseJacobian& jacobian, double* columns) {
  std::fill_n(columns, knowns_.size() * size(), 0.0);
  for (std::size_t k = 0; k < knowns_.size(); ++k) {
    const Variable& known = *knowns_[k];
    double* const column = columns + k * size();
    const bool of_drive = known.row->storage == Storage::input && known.row->owner == Owner::joint;
    if (!(of_drive && jacobian.by_input(known.joint, column)) && !by_known(known, time, y, column))
      return Status::recoverable;
  }
  return Status::ok;
}

// Sets the column of one known. False: not finite.
bool StepJacobian::by_known(const Variable& known, double time, const double* y, double* column) {
  const StateLayout& layout = system_.layout();
  Tangent& tangent = *tangent_;
  tangent.go_to(parameters_, system_, time, y);
  if (known.row->storage == Storage::input)
    tangent.force[known.group->input(known.row_index(), system_, known)].derivative = 1;
  else
    known.group->dual_place(known.row_index(), tangent.parameters, known)->derivative = 1;
  has_parameters_ = false;
  tangent.apply_parameters();
  if (!tangent.evaluate()) return false;
  for (int i = 0; i < system_.simple(); ++i)
    column[layout.qd[i]] = tangent.qdd[system_.joint_of(i)].derivative;
  for (int ball = 0; ball < system_.balls(); ++ball) {
    const Vec3<Dual> alpha = tangent.ball(ball).alpha;
    for (int axis = 0; axis < 3; ++axis) layout.omega.of(column, ball)[axis] = alpha[axis].derivative;
  }
  const Actuators* actuators = system_.actuators();
  for (int i = 0; actuators && i < actuators->size(); ++i) {
    const Actuators::Places places = actuators->places(i);
    const ActuatorResponse<Dual>& response = tangent.actuator(i);
    if (places.motor_qd >= 0) column[places.motor_qd] = response.motor_qdd.derivative;
    if (places.current >= 0) column[places.current] = response.current_rate.derivative;
    if (places.lagged >= 0) column[places.lagged] = response.lagged_rate.derivative;
  }
  return true;
}

}  // namespace redysim
