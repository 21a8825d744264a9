#include "fmi/instance/parameter_set.hpp"

#include <algorithm>
#include <utility>

#include "fmi/boundary/assembly_messages.hpp"
#include "fmi/variables/groups.hpp"
#include "fmi/variables/parameters.hpp"
#include "fmi/variables/state_place.hpp"
#include "integrate/methods/given_state.hpp"
#include "model/inertia.hpp"
#include "model/number.hpp"

namespace redysim {

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
  pending_ = {};
  pending_.in_force = false;
}

void ParameterSet::set(const Variable& variable) {
  if (variable.variability() != Variability::tunable) return;
  give_again();
  if (variable.group == &StateParameters::rows) {
    if (variable.type() == VariableType::integer) pending_.given = Given::due;
    return;
  }
  pending_.in_force = false;
  pending_.changed = true;
  pending_.inertia_tuned =
      pending_.inertia_tuned || (variable.row->acts & (acts::mass | acts::armature)) != 0;
}

std::string ParameterSet::bring_into_force() {
  if (!pending_.in_force) {
    std::string why = impossible();
    if (why.empty()) {
      renew_plan();
      if (simulation_.integrator && pending_.inertia_tuned) why = immovable();
      pending_.inertia_tuned = !why.empty();
    }
    if (!why.empty()) return why;
    pending_.in_force = true;
  }
  return state_is_due() ? apply_state() : std::string();
}

void ParameterSet::restored(const Pending& pending) {
  pending_ = pending;
  pending_.in_force = pending.in_force && impossible().empty();
}

// Updates the plan. The energy balance keeps its value: tuning is not an energy error.
void ParameterSet::renew_plan() {
  const double before = energy();
  simulation_.plan.update(simulation_.parameters);
  simulation_.system.update_drives(simulation_.parameters);
  state_.plan_changed();
  energy_offset += energy() - before;
}

// Energy, J, before pending jumps of prescribed motion; 0: the balance is not computed.
double ParameterSet::energy() {
  if (!simulation_.integrator || !simulation_.system.with_work()) return 0;
  return simulation_.system.energy_before_jumps(simulation_.time, state_.before_jumps());
}

// Replaces the state by the given one. The energy balance keeps its value, as when a parameter is tuned.
std::string ParameterSet::apply_state() {
  const StateToApply& wanted = simulation_.parameters.state;
  System& system = simulation_.system;
  const double* now = state_.before_jumps();
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
  const double before = energy();
  if (!state_.replace(y.data()))
    return "state.apply: the loop constraints cannot be satisfied near state.q at " +
           shown(simulation_.time) + " s";
  energy_offset += energy() - before;
  pending_.given = Given::applied;
  return {};
}

std::string ParameterSet::impossible() const {
  for (std::size_t i = 0; i < simulation_.model.links.size(); ++i) {
    const Link& link = simulation_.model.links[i];
    const JointParameters<double>& joint = simulation_.parameters.joints[i];
    if (has_negative_moment(principal_moments(simulation_.parameters.links[i].inertia)))
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
