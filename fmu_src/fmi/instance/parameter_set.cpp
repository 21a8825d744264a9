#include "fmi/instance/parameter_set.hpp"

#include <algorithm>
#include <utility>

#include "fmi/boundary/assembly_messages.hpp"
#include "fmi/variables/groups.hpp"
#include "fmi/variables/parameters.hpp"
#include "fmi/variables/state_place.hpp"
#include "integrate/methods/given_state.hpp"
#include "model/number.hpp"

namespace redysim {
namespace {

// No negative principal moment, up to rounding: no negative principal minor.
bool is_possible_inertia(const std::array<double, 6>& inertia) {
  const auto& [xx, yy, zz, xy, xz, yz] = inertia;
  const double scale = xx + yy + zz, slack = 1e-12 * scale * scale;
  const double minor_x = yy * zz - yz * yz, minor_y = xx * zz - xz * xz, minor_z = xx * yy - xy * xy;
  const double determinant = xx * minor_x - xy * (xy * zz - yz * xz) + xz * (xy * yz - yy * xz);
  return xx >= 0 && yy >= 0 && zz >= 0 && minor_x >= -slack && minor_y >= -slack && minor_z >= -slack &&
         determinant >= -slack * scale;
}

}  // namespace

std::vector<double> ParameterSet::values() const {
  std::vector<double> result;
  for (const Variable& variable : simulation_.table.all())
    if (const double* value = parameter(simulation_.parameters, variable)) result.push_back(*value);
  return result;
}

void ParameterSet::exchange(std::vector<double>& values, SolverMethod& method) {
  auto other = values.begin();
  for (const Variable& variable : simulation_.table.all())
    if (double* value = parameter(simulation_.parameters, variable)) std::swap(*value, *other++);
  std::swap(simulation_.parameters.solver.method, method);
}

void ParameterSet::reset() {
  simulation_.parameters = parameters_of(simulation_.model);
  energy_offset = 0;
  in_force_ = changed_ = false;
  given_ = Given::none;
}

void ParameterSet::set(const Variable& variable) {
  if (variable.variability() != Variability::tunable) return;
  if (variable.group == &StateParameters::rows) {
    if (variable.type() == VariableType::integer) given_ = Given::due;
    return;
  }
  in_force_ = false;
  changed_ = true;
  inertia_tuned_ = inertia_tuned_ || (variable.row->acts & (acts::mass | acts::armature)) != 0;
}

std::string ParameterSet::bring_into_force() {
  if (!in_force_) {
    std::string why = impossible();
    if (why.empty()) {
      renew_plan();
      if (simulation_.integrator && inertia_tuned_) why = immovable();
      inertia_tuned_ = !why.empty();
    }
    if (!why.empty()) return why;
    in_force_ = true;
  }
  return state_is_due() ? apply_state() : std::string();
}

void ParameterSet::bring_into_force_if_possible() {
  if (!in_force_) {
    if (!impossible().empty()) return;
    renew_plan();
    in_force_ = true;
  }
  if (state_is_due()) apply_state();
}

void ParameterSet::restored(bool changed, Given given) {
  in_force_ = impossible().empty();
  changed_ = changed;
  given_ = given;
}

void ParameterSet::renew_plan() {
  const bool balanced = simulation_.integrator && simulation_.system.with_work();
  const double before = balanced ? simulation_.mechanical_energy(state_.y()) : 0;
  simulation_.plan.update(simulation_.parameters);
  simulation_.system.update_drives(simulation_.parameters);
  if (balanced) energy_offset += simulation_.mechanical_energy(state_.y()) - before;
}

// The energy balance keeps its value, as when a parameter is tuned.
std::string ParameterSet::apply_state() {
  const StateToApply& wanted = simulation_.parameters.state;
  System& system = simulation_.system;
  const double* now = state_.y();
  std::vector<double> y(now, now + system.size());
  const double* q = wanted.q.data();
  const double* qd = wanted.qd.data();
  for (const CoordinatePlace& at : coordinate_places(system)) {
    const int positions = at.ball < 0 ? 1 : at.axis == 0 ? 4 : 0;
    if (at.position >= 0) {
      std::copy_n(q, positions, y.begin() + at.position);
      y[at.velocity] = *qd;
    }
    q += positions;
    ++qd;
  }
  std::copy(wanted.actuator.begin(), wanted.actuator.end(), y.begin() + system.layout().motor_q.begin);
  if (!GivenState::has_orientations(system.layout(), y.data()))
    return "state.apply: a quaternion of state.q is zero: it has no orientation";
  const double before = system.with_work() ? simulation_.mechanical_energy(now) : 0;
  if (!state_.replace(y.data()))
    return "state.apply: the loop constraints cannot be satisfied near state.q at " +
           shown(simulation_.time) + " s";
  if (system.with_work()) energy_offset += simulation_.mechanical_energy(state_.y()) - before;
  given_ = Given::applied;
  return {};
}

std::string ParameterSet::impossible() const {
  for (std::size_t i = 0; i < simulation_.model.links.size(); ++i) {
    const Link& link = simulation_.model.links[i];
    const JointParameters<double>& joint = simulation_.parameters.joints[i];
    if (!is_possible_inertia(simulation_.parameters.links[i].inertia))
      return "the inertia of link '" + link.name + "' has a negative principal moment";
    if (!(joint.lower < joint.upper))
      return link.joint.name + ".upper must be greater than " + link.joint.name + ".lower, got " +
             shown(joint.upper) + " and " + shown(joint.lower);
  }
  for (const Actuator& actuator : simulation_.parameters.actuators) {
    const std::string joint = simulation_.model.links[actuator.link].joint.name;
    if (actuator.limits_torque() && actuator.torque_limit_width > actuator.torque_limit)
      return joint + ".torque_limit_width must be <= " + joint + ".torque_limit";
    if (actuator.limits_speed() && actuator.speed_limit_width > actuator.speed_limit)
      return joint + ".speed_limit_width must be <= " + joint + ".speed_limit";
  }
  return {};
}

std::string ParameterSet::immovable() {
  const int joint = always_singular_joint(simulation_.plan, simulation_.system.workspace());
  return joint < 0 ? std::string() : singular_sentence(simulation_.model, simulation_.plan, joint, "");
}

}  // namespace redysim
