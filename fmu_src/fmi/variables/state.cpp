#include "fmi/variables/entry.hpp"

// The state that the master applies between two steps. It does not affect the start, so it has no
// dependencies.

namespace redysim {
namespace {

template <std::vector<double> StateToApply::*part>
double& of_state(Parameters<double>& parameters, const Variable& v) {
  return (parameters.state.*part)[static_cast<std::size_t>(v.element)];
}

double& number(Parameters<double>& parameters, const Variable&) { return parameters.state.number; }

void name_position(const Model& model, const Variable& v, Presentation& shown) {
  const TreeCoordinate at = tree_positions(model)[v.element];
  shown.description += at.name;
  shown.quantity = at.is_quaternion ? quantity::none : at.slides ? quantity::position : quantity::angle;
}

void name_velocity(const Model& model, const Variable& v, Presentation& shown) {
  const TreeCoordinate at = tree_velocities(model)[v.element];
  shown.description += at.name;
  shown.quantity = at.slides ? quantity::velocity : quantity::angular_velocity;
}

constexpr Entry entries[] = {
    parameter(Owner::model, "state.q")
        .array(per_position)
        .in(OutputGroup::state)
        .sets(of_state<&StateToApply::q>)
        .says("Position to apply (without effect on a prescribed joint): ")
        .adapted(name_position),
    parameter(Owner::model, "state.qd")
        .array(per_velocity)
        .in(OutputGroup::state)
        .sets(of_state<&StateToApply::qd>)
        .says("Velocity to apply (without effect on a prescribed joint): ")
        .adapted(name_velocity),
    parameter(Owner::model, "state.actuator")
        .array(per_actuator_state)
        .in(OutputGroup::state)
        .sets(of_state<&StateToApply::actuator>)
        .says("State of an actuator to apply: motor angles, motor velocities, currents, lagged inputs"),
    parameter(Owner::model, "state.apply")
        .integer()
        .in(OutputGroup::state)
        .sets(number)
        .says("When it changes, state.q, state.qd and state.actuator become the state, moved to the "
              "nearest one that satisfies the loop constraints"),
};

}  // namespace

const RowGroup StateParameters::rows = rows_in<entries>;
const WordGroup StateParameters::words = words_in<entries>;

}  // namespace redysim
