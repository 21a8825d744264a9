#include "fmi/variables/dependencies.hpp"

#include "fmi/variables/presentation.hpp"

namespace redysim {

Components::Components(const Scene& scene)
    : scene_(scene), leader_(plan().joints.size()), has_constraint_(plan().joints.size()) {
  for (std::size_t i = 0; i < leader_.size(); ++i) leader_[i] = static_cast<int>(i);
  for (std::size_t i = 0; i < leader_.size(); ++i) join(static_cast<int>(i), plan().joints[i].parent);
  for (const auto& spring : plan().springs) join(spring.body_a, spring.body_b);
  for (const auto& bushing : plan().bushings) join(bushing.body_a, bushing.body_b);
  for (const auto& pair : plan().contact_pairs) join(pair.ball_body, pair.surface_body);
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

// Longer lists are replaced by "all": the size of descriptions is linear in the number of variables.
constexpr std::size_t longest_list = 500;

bool may_matter(const Variable& known, bool initial) {
  if (known.causality() == Causality::input) return true;
  return initial && known.causality() == Causality::parameter && known.row->acts != 0;
}

// Applies the rule in `column` of the words of each output.
std::vector<Dependencies> collect(const VariableTable& table, const Components& components,
                                  Rule Words::*column, bool initial) {
  std::vector<Dependencies> result;
  const auto& all = table.all();
  std::vector<int> knowns;
  for (std::size_t k = 0; k < all.size(); ++k)
    if (may_matter(all[k], initial)) knowns.push_back(static_cast<int>(k));
  for (std::size_t u = 0; u < all.size(); ++u) {
    if (all[u].causality() != Causality::output) continue;
    const Rule depends = words_of(all[u]).*column;
    Dependencies row;
    row.unknown = static_cast<int>(u);
    for (std::size_t k = 0; depends && k < knowns.size() && row.knowns.size() <= longest_list; ++k)
      if (depends(all[u], all[knowns[k]], components)) row.knowns.push_back(knowns[k]);
    row.all = !knowns.empty() && (row.knowns.size() > longest_list || row.knowns.size() == knowns.size());
    if (row.all) row.knowns.clear();
    result.push_back(std::move(row));
  }
  return result;
}

}  // namespace

std::vector<Dependencies> output_dependencies(const VariableTable& table, const Scene& scene) {
  return collect(table, Components(scene), &Words::at_point, false);
}

std::vector<Dependencies> initial_dependencies(const VariableTable& table, const Scene& scene) {
  const Components components(scene);
  std::vector<Dependencies> rows = collect(table, components, &Words::at_start, true);
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
