#include "fmi/variables/dependencies.hpp"

#include <algorithm>
#include <stdexcept>
#include <string_view>

#include "fmi/variables/presentation.hpp"
#include "fmi/variables/state_place.hpp"
#include "model/model_exchange.hpp"

namespace redysim {

Components::Components(const Scene& scene)
    : scene_(scene), leader_(plan().joints.size()), has_constraint_(plan().joints.size()) {
  for (std::size_t i = 0; i < leader_.size(); ++i) leader_[i] = static_cast<int>(i);
  for (std::size_t i = 0; i < leader_.size(); ++i) join(static_cast<int>(i), plan().joints[i].parent);
  for (const auto& spring : plan().springs) join(spring.body_a, spring.body_b);
  for (const auto& bushing : plan().bushings) join(bushing.body_a, bushing.body_b);
  for (const auto& pair : plan().contact_pairs) join(pair.sphere_body, pair.surface_body);
  for (const auto& loop : plan().loops) join(loop.body_a, loop.body_b);
  for (const Coupling& coupling : scene.model.couplings)
    for (int link : coupling.links) join(plan().carrier[coupling.links.front()], plan().carrier[link]);
  for (std::size_t i = 0; i < leader_.size(); ++i) leader_[i] = leader_of(static_cast<int>(i));
  for (const auto& loop : plan().loops)
    for (int body : {loop.body_a, loop.body_b})
      if (body != ground) has_constraint_[of(body)] = 1;
  for (const auto& coupling : plan().couplings) has_constraint_[of(coupling.joints.front())] = 1;
}

int Components::leader_of(int joint) const {
  while (leader_[joint] != joint) joint = leader_[joint];
  return joint;
}

void Components::join(int a, int b) {
  if (a != ground && b != ground) leader_[leader_of(a)] = leader_of(b);
}

int Components::of(const Variable& known) const {
  if (known.joint >= 0) return of(known.joint);
  return known.row->owner == Owner::link ? of(plan().carrier[known.link]) : ground;
}

namespace at_point {

bool jumps(const Variable& unknown, const Variable& known, const Components& components) {
  return all_jumps(unknown, known, components) && accelerations(unknown, known, components);
}

bool all_jumps(const Variable&, const Variable& known, const Components&) {
  return (known.row->acts & (acts::position | acts::velocity)) != 0;
}

bool accelerations(const Variable& unknown, const Variable& known, const Components& components) {
  return components.of(unknown.joint) == components.of(known.joint);
}

// A sensor on the ground may carry any tree.
bool sensed(const Variable& unknown, const Variable& known, const Components& components) {
  return unknown.joint == ground || accelerations(unknown, known, components);
}

}  // namespace at_point

namespace initially {
namespace {

// In closed loops all start values of the component affect the assembled configuration.
bool assembled(const Variable& unknown, const Variable& known, const Components& components, bool velocity) {
  const unsigned position = known.row->acts & acts::position, speed = known.row->acts & acts::velocity;
  const int component = components.of(unknown.joint);
  if (components.has_constraints(component))
    return components.of(known) == component && (position || (velocity && speed));
  if (known.joint != unknown.joint) return false;
  return velocity ? speed && known.element == unknown.element : position != 0;
}

}  // namespace

bool anything(const Variable&, const Variable&, const Components&) { return true; }

bool target(const Variable& unknown, const Variable& known, const Components&) {
  return (known.row->acts & acts::target) && known.joint == unknown.joint;
}

bool position(const Variable& unknown, const Variable& known, const Components& components) {
  return assembled(unknown, known, components, false);
}

bool velocity(const Variable& unknown, const Variable& known, const Components& components) {
  return assembled(unknown, known, components, true);
}

bool accelerations(const Variable& unknown, const Variable& known, const Components& components) {
  return (known.row->acts & acts::gravity) || components.of(known) == components.of(unknown.joint);
}

bool sensed(const Variable& unknown, const Variable& known, const Components& components) {
  return unknown.joint == ground || accelerations(unknown, known, components);
}

bool kinetic(const Variable&, const Variable& known, const Components& components) {
  const unsigned what = known.row->acts;
  return (what & (acts::position | acts::velocity | acts::armature)) ||
         ((what & acts::mass) && components.of(known) != ground);
}

bool potential(const Variable&, const Variable& known, const Components&) {
  return (known.row->acts & (acts::position | acts::weight | acts::gravity | acts::potential)) != 0;
}

bool energies(const Variable& unknown, const Variable& known, const Components& components) {
  return kinetic(unknown, known, components) || potential(unknown, known, components);
}

}  // namespace initially

namespace {

// Whether a state depends on another one: only on itself. A quaternion depends on all its components, since
// its output may be normalised.
bool is_same_state(const Variable& unknown, const Variable& known) {
  return known.row == unknown.row && known.joint == unknown.joint && known.ball == unknown.ball &&
         (known.row->state == StatePart::quaternion || known.element == unknown.element);
}

bool is_independent(const Variable& variable) {
  return variable.row->state == StatePart::independent_q || variable.row->state == StatePart::independent_qd;
}

// Whether `unknown`, which is not a state, depends on the state `known`.
bool by_state(const Variable& unknown, const Variable& known, const Components& components) {
  const Row& row = *unknown.row;
  if (row.type != VariableType::real || row.variability == Variability::discrete) return false;
  if (is_independent(known))
    return row.owner == Owner::model || unknown.joint == ground || components.is_constrained(unknown.joint);
  if (known.row->owner == Owner::model) return std::string_view(row.name.text) == "energy.balance";
  if (row.slope_of == StatePart::quaternion) return known.ball == unknown.ball;
  return row.owner == Owner::model || at_point::sensed(unknown, known, components);
}

// Longer lists are replaced by "all": the size of descriptions is linear in the number of variables.
constexpr std::size_t longest_list = 500;
// Lists of states may be longer if there are few of them.
constexpr std::size_t listed_per_variable = 20;

// Applies rules to an unknown and all knowns.
class Collector {
 public:
  Collector(const VariableTable& table, const Scene& scene, const std::vector<int>& states, bool initial)
      : all_(table.all()), components_(scene), states_(states), initial_(initial) {
    for (std::size_t k = 0; k < all_.size(); ++k)
      if (may_matter(all_[k])) settable_.push_back(static_cast<int>(k));
    is_state_.resize(all_.size());
    for (int state : states_) is_state_[state] = 1;
  }
  const Components& components() const { return components_; }

  Dependencies of(int unknown) {
    const Variable& variable = all_[unknown];
    const Words& words = words_of(variable);
    const Rule depends = initial_ ? words.at_start : words.at_point;
    Dependencies row;
    row.unknown = unknown;
    // a matrix has more entries than all other variables together
    row.all = depends && variable.row->columns > 0;
    for (std::size_t k = 0; depends && !row.all && k < settable_.size(); ++k) {
      if (depends(variable, all_[settable_[k]], components_)) row.knowns.push_back(settable_[k]);
      row.all = row.knowns.size() > longest_list;
    }
    for (std::size_t k = 0; !row.all && k < states_.size(); ++k) {
      const Variable& state = all_[states_[k]];
      if (is_state_[unknown] ? is_same_state(variable, state) : by_state(variable, state, components_))
        row.knowns.push_back(states_[k]);
    }
    const std::size_t knowns = settable_.size() + states_.size();
    row.all = row.all || (knowns != 0 && row.knowns.size() == knowns) || is_too_long(row.knowns.size());
    if (row.all) row.knowns.clear();
    return row;
  }

 private:
  bool may_matter(const Variable& known) const {
    if (known.causality() == Causality::input) return true;
    return initial_ && known.causality() == Causality::parameter && known.row->acts != 0;
  }
  bool is_too_long(std::size_t count) {
    if (count <= longest_list) return false;
    listed_ += count;
    return listed_ > listed_per_variable * all_.size();
  }

  const std::vector<Variable>& all_;
  const Components components_;
  const std::vector<int>& states_;
  const bool initial_;
  std::vector<int> settable_;
  std::vector<char> is_state_;
  std::size_t listed_ = 0;  // in lists longer than longest_list
};

}  // namespace

StateVariables state_variables(const VariableTable& table, const Model& model, const System& system,
                               const IndependentCoordinates& states) {
  if (objection_to_model_exchange(model)) return {};
  StateVariables found;
  found.states.assign(static_cast<std::size_t>(states.size()), -1);
  found.slopes = found.states;
  for (std::size_t k = 0; k < table.all().size(); ++k) {
    const Variable& variable = table.all()[k];
    const int state = exchanged_place(system, states, variable.row->state, variable);
    const int slope = exchanged_place(system, states, variable.row->slope_of, variable);
    if (state >= 0) found.states[state] = static_cast<int>(k);
    if (slope >= 0) found.slopes[slope] = static_cast<int>(k);
  }
  for (const auto* places : {&found.states, &found.slopes})
    if (std::count(places->begin(), places->end(), -1) > 0)
      throw std::logic_error("a state or its derivative is not among the variables");
  return found;
}

std::vector<Dependencies> output_dependencies(const VariableTable& table, const Scene& scene,
                                              const StateVariables& states) {
  Collector collector(table, scene, states.states, false);
  std::vector<Dependencies> rows;
  for (std::size_t k = 0; k < table.all().size(); ++k)
    if (table.all()[k].causality() == Causality::output) rows.push_back(collector.of(static_cast<int>(k)));
  return rows;
}

std::vector<Dependencies> slope_dependencies(const VariableTable& table, const Scene& scene,
                                             const StateVariables& states) {
  Collector collector(table, scene, states.states, false);
  std::vector<Dependencies> rows;
  for (int slope : states.slopes) {
    rows.push_back(collector.of(slope));
    // the velocity of a joint is a state itself
    rows.back().constant = rows.back().knowns == std::vector<int>{slope};
  }
  return rows;
}

std::vector<Dependencies> initial_dependencies(const VariableTable& table, const Scene& scene) {
  const std::vector<int> no_states;
  Collector collector(table, scene, no_states, true);
  const Components& components = collector.components();
  std::vector<Dependencies> rows;
  for (std::size_t k = 0; k < table.all().size(); ++k)
    if (const Variable& variable = table.all()[k];
        variable.causality() == Causality::output ||
        (variable.causality() == Causality::local && variable.row->has_state()))
      rows.push_back(collector.of(static_cast<int>(k)));
  for (Dependencies& row : rows) {
    const Variable& unknown = table.all()[row.unknown];
    const ConstantFactor constant = words_of(unknown).constant;
    row.constant =
        constant == ConstantFactor::always || (constant == ConstantFactor::unless_assembled &&
                                               !components.has_constraints(components.of(unknown.joint)));
    if (!scene.model.starts_in_equilibrium) continue;
    row.knowns.clear();
    row.all = true;
    row.constant = false;
  }
  return rows;
}

}  // namespace redysim
