#include "fmi/variables/dependencies.hpp"

namespace redysim {
namespace {

// Joints that feel each other: those on one tree, and on trees that a loop or a spring ties together.
// Ties to ground couple nothing.
class Components {
 public:
  explicit Components(const Plan<double>& plan) : leader_(plan.joints.size()), closed_(plan.joints.size()) {
    for (std::size_t i = 0; i < leader_.size(); ++i) leader_[i] = static_cast<int>(i);
    for (std::size_t i = 0; i < leader_.size(); ++i) join(static_cast<int>(i), plan.joints[i].parent);
    for (const auto& spring : plan.springs) join(spring.body_a, spring.body_b);
    for (const auto& loop : plan.loops) join(loop.body_a, loop.body_b);
    for (std::size_t i = 0; i < leader_.size(); ++i) leader_[i] = leader_of(static_cast<int>(i));
    for (const auto& loop : plan.loops)
      for (int body : {loop.body_a, loop.body_b})
        if (body != ground) closed_[of(body)] = 1;
  }
  int of(int joint) const { return joint == ground ? ground : leader_[joint]; }
  bool has_loops(int component) const { return closed_[component]; }

 private:
  int leader_of(int joint) const {
    while (leader_[joint] != joint) joint = leader_[joint];
    return joint;
  }
  void join(int a, int b) {
    if (a != ground && b != ground) leader_[leader_of(a)] = leader_of(b);
  }
  std::vector<int> leader_;
  std::vector<char> closed_;  // of leaders
};

bool is_spring(Role role) {
  switch (role) {
    case Role::stiffness:
    case Role::rest:
    case Role::lower:
    case Role::upper:
    case Role::stop_stiffness:
    case Role::stop_width:
      return true;
    default:
      return false;
  }
}

// Where a known acts: its component, ground if nowhere.
int component_of(const Variable& known, const Plan<double>& plan, const Components& components) {
  if (known.joint >= 0) return components.of(known.joint);
  return is_of_link(known.role) ? components.of(plan.carrier[known.link]) : ground;
}

bool acts_on_acceleration(const Variable& known, int component, const Plan<double>& plan,
                          const Components& components) {
  return known.role == Role::gravity || component_of(known, plan, components) == component;
}

bool is_start_position(Role role) {
  return role == Role::q0 || role == Role::ball_quaternion0 || role == Role::motion_q;
}

bool is_start_velocity(Role role) {
  return role == Role::qd0 || role == Role::ball_omega0 || role == Role::motion_qd;
}

bool acts_on_kinetic(const Variable& known, const Plan<double>& plan, const Components& components) {
  return is_start_position(known.role) || is_start_velocity(known.role) || known.role == Role::armature ||
         (is_of_link(known.role) && component_of(known, plan, components) != ground);
}

bool acts_on_potential(const Variable& known) {
  return is_start_position(known.role) || known.role == Role::gravity || known.role == Role::mass ||
         known.role == Role::com || is_spring(known.role);
}

// A row that lists more says "all": descriptions grow with the number of variables, not with its square.
constexpr std::size_t longest_list = 500;

// Nothing depends on the settings of the solver.
bool may_matter(const Variable& known, bool initial) {
  if (known.causality == Causality::input) return true;
  return initial && known.causality == Causality::parameter && known.role != Role::method &&
         known.role != Role::rtol && known.role != Role::atol && known.role != Role::max_step;
}

// `depends(unknown, known)` for each output and what may matter to it.
template <class Rule>
std::vector<Dependencies> collect(const VariableTable& table, bool initial, const Rule& depends) {
  std::vector<Dependencies> result;
  const auto& all = table.all();
  std::vector<int> knowns;
  for (std::size_t k = 0; k < all.size(); ++k)
    if (may_matter(all[k], initial)) knowns.push_back(static_cast<int>(k));
  for (std::size_t u = 0; u < all.size(); ++u) {
    if (all[u].causality != Causality::output) continue;
    Dependencies row;
    row.unknown = static_cast<int>(u);
    for (std::size_t k = 0; k < knowns.size() && row.knowns.size() <= longest_list; ++k)
      if (depends(all[u], all[knowns[k]])) row.knowns.push_back(knowns[k]);
    row.all = !knowns.empty() && (row.knowns.size() > longest_list || row.knowns.size() == knowns.size());
    if (row.all) row.knowns.clear();
    result.push_back(std::move(row));
  }
  return result;
}

}  // namespace

std::vector<Dependencies> output_dependencies(const VariableTable& table, const Plan<double>& plan) {
  const Components components(plan);
  // positions and energies change with time and where a prescribed motion jumps; forces act at once on
  // accelerations
  return collect(table, false, [&](const Variable& unknown, const Variable& known) {
    const bool motion = known.role == Role::motion_q || known.role == Role::motion_qd;
    const bool together = components.of(unknown.joint) == components.of(known.joint);
    switch (unknown.role) {
      case Role::qdd:
      case Role::ball_alpha:
      case Role::motion_tau:
      case Role::lambda:
        return together;
      case Role::q:
      case Role::qd:
      case Role::ball_quaternion:
      case Role::ball_omega:
      case Role::ball_angle:
      case Role::gap:
        return motion && together;
      case Role::kinetic_energy:
      case Role::potential_energy:
      case Role::total_energy:
      case Role::work:
      case Role::energy_balance:
      case Role::linear_momentum:
      case Role::angular_momentum:
        return motion;
      default:
        return unknown.frame >= 0 && motion && together;
    }
  });
}

std::vector<Dependencies> initial_dependencies(const VariableTable& table, const Plan<double>& plan) {
  const Components components(plan);
  // a closed loop's start pose is assembled from all start values of its component
  const auto assembled = [&](const Variable& unknown, const Variable& known, bool velocity) {
    const int component = components.of(unknown.joint);
    if (components.has_loops(component))
      return component_of(known, plan, components) == component &&
             (is_start_position(known.role) || (velocity && is_start_velocity(known.role)));
    if (unknown.ball < 0)
      return known.joint == unknown.joint && known.role == (velocity ? Role::qd0 : Role::q0);
    if (known.ball != unknown.ball) return false;
    return velocity ? known.role == Role::ball_omega0 && known.element == unknown.element
                    : known.role == Role::ball_quaternion0;
  };
  std::vector<Dependencies> rows = collect(table, true, [&](const Variable& unknown, const Variable& known) {
    switch (unknown.role) {
      case Role::reference_q:
        return known.role == Role::target && known.joint == unknown.joint;
      case Role::q:
      case Role::gap:
      case Role::ball_quaternion:
      case Role::ball_angle:
        return assembled(unknown, known, false);
      case Role::qd:
      case Role::ball_omega:
        return assembled(unknown, known, true);
      case Role::linear_momentum:
      case Role::angular_momentum:
        return acts_on_kinetic(known, plan, components);
      case Role::ball_alpha:
      case Role::qdd:
      case Role::motion_tau:
      case Role::lambda:
        return acts_on_acceleration(known, components.of(unknown.joint), plan, components);
      case Role::kinetic_energy:
        return acts_on_kinetic(known, plan, components);
      case Role::potential_energy:
        return acts_on_potential(known);
      case Role::total_energy:
        return acts_on_kinetic(known, plan, components) || acts_on_potential(known);
      default:
        return unknown.frame >= 0 &&
               acts_on_acceleration(known, components.of(unknown.joint), plan, components);
    }
  });
  for (Dependencies& row : rows) {
    const Variable& unknown = table.all()[row.unknown];
    const bool copied =
        unknown.role == Role::q || unknown.role == Role::qd || unknown.role == Role::ball_omega;
    row.constant =
        unknown.role == Role::reference_q || (copied && !components.has_loops(components.of(unknown.joint)));
  }
  return rows;
}

}  // namespace redysim
