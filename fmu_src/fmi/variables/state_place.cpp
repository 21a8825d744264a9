#include "fmi/variables/state_place.hpp"

#include <algorithm>

#include "model/any_of.hpp"

namespace redysim {
namespace {

// Index among the integrated joints, in the order of the plan, of a joint with one DOF; -1: prescribed.
int integrated_place(const System& system, int joint) {
  for (int k = std::min(joint, system.simple() - 1); k >= 0; --k)
    if (system.joint_of(k) == joint) return k;
  return -1;
}

int actuator_place(const System& system, StatePart part, int joint) {
  const Actuators* actuators = system.actuators();
  const int index = actuators ? actuators->at(joint) : -1;
  if (index < 0) return -1;
  const Actuators::Places places = actuators->places(index);
  return part == StatePart::motor_q    ? places.motor_q
         : part == StatePart::motor_qd ? places.motor_qd
         : part == StatePart::current  ? places.current
                                       : places.lagged;
}

}  // namespace

int place_of(const System& system, StatePart part, const Variable& variable) {
  const StateLayout& layout = system.layout();
  const auto work = [&layout](int entry) { return entry < layout.work.count ? layout.work[entry] : -1; };
  switch (part) {
    case StatePart::none:
    case StatePart::independent_q:
    case StatePart::independent_qd:
      return -1;
    case StatePart::q:
    case StatePart::qd: {
      const int place = integrated_place(system, variable.joint);
      return place < 0 ? -1 : (part == StatePart::q ? layout.q : layout.qd)[place];
    }
    case StatePart::quaternion:
      return layout.quaternion[variable.ball] + variable.element;
    case StatePart::omega:
      return layout.omega[variable.ball] + variable.element;
    case StatePart::work:
      return work(0);
    case StatePart::contact_work:
      return work(1);
    default:
      return actuator_place(system, part, variable.joint);
  }
}

int exchanged_place(const System& system, const IndependentCoordinates& states, StatePart part,
                    const Variable& variable) {
  const std::vector<int>& kept = states.kept();
  const int first = static_cast<int>(kept.size());
  if (part == StatePart::independent_q) return first + variable.element;
  if (part == StatePart::independent_qd) return first + states.count() + variable.element;
  const int place = place_of(system, part, variable);
  if (first == system.size()) return place;
  const auto found = std::lower_bound(kept.begin(), kept.end(), place);
  return found == kept.end() || *found != place ? -1 : static_cast<int>(found - kept.begin());
}

std::vector<CoordinatePlace> coordinate_places(const System& system) {
  const Plan<double>& plan = system.plan();
  const StateLayout& layout = system.layout();
  std::vector<CoordinatePlace> places;
  int ball = -1;
  for (int i = 0; i < plan.nv; ++i) {
    if (!plan.joints[i].of_ball) {
      const int place = integrated_place(system, i);
      places.push_back({place < 0 ? -1 : layout.q[place], place < 0 ? -1 : layout.qd[place], i, -1, 0});
    } else if (contains(plan.balls, i)) {
      ++ball;
      for (int axis = 0; axis < 3; ++axis)
        places.push_back({layout.quaternion[ball], layout.omega[ball] + axis, i + 1 + axis, ball, axis});
    }
  }
  return places;
}

}  // namespace redysim
