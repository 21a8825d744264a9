#include "fmi/variables/variables.hpp"

#include <array>
#include <limits>
#include <map>
#include <numeric>
#include <set>
#include <utility>

#include "fmi/instance/step_jacobian.hpp"
#include "fmi/variables/drive.hpp"
#include "fmi/variables/groups.hpp"
#include "fmi/variables/parameters.hpp"
#include "integrate/actuator/actuators.hpp"
#include "model/model_exchange.hpp"
#include "model/number.hpp"
#include "model/read/model_error.hpp"

namespace redysim {
namespace {

template <class... Group>
std::array<const RowGroup*, sizeof...(Group)> all_groups(const std::tuple<Group...>*) {
  return {&Group::rows...};
}
auto all_groups() { return all_groups(static_cast<const Groups*>(nullptr)); }

// Whether the model file must list it to make it tunable.
bool is_tunable(const Row& row) { return row.variability == Variability::tunable && !row.in_group; }

// Whether it is requested. A local variable exists if the output of its group does not.
bool is_requested(const Model& model, const Row& row) {
  const bool local = row.causality == Causality::local;
  if (local && objection_to_model_exchange(model)) return false;
  return !row.in_group || model.fmu.shows(row.group) != local;
}

// The order of the XML: the variables of one frame, loop, coupling, contact or link are adjacent; for joints,
// each variable is listed for all joints.
bool by_owner(Owner owner) {
  return owner == Owner::frame || owner == Owner::loop || owner == Owner::coupling ||
         owner == Owner::contact || owner == Owner::link;
}

int plan_loop_of(const Plan<double>& plan, int loop) {
  std::size_t k = 0;
  while (plan.loops[k].loop != loop) ++k;
  return static_cast<int>(k);
}

// The joint that carries one of the bodies of a contact.
int joint_at(const Scene& scene, const Contact& contact) {
  const auto carrier = [&](int link) { return link == ground ? ground : scene.plan.carrier[link]; };
  const int a = carrier(contact.a.link);
  return a == ground ? carrier(contact.b.link) : a;
}

// All joints except those that represent spherical joints.
std::vector<Variable> simple_joints(const Plan<double>& plan) {
  std::vector<Variable> found;
  Variable owner;
  for (std::size_t i = 0; i < plan.joints.size(); ++i) {
    if (plan.joints[i].of_ball) continue;
    owner.link = plan.joints[i].link;
    owner.joint = static_cast<int>(i);
    found.push_back(owner);
  }
  return found;
}

// All moving links except those between the DOFs of a joint.
std::vector<Variable> moving_links(const Scene& scene) {
  std::vector<Variable> found;
  Variable owner;
  for (std::size_t k = 0; k < scene.model.links.size(); ++k) {
    owner.link = static_cast<int>(k);
    owner.joint = scene.plan.carrier[k];
    if (owner.joint != ground && scene.model.links[k].name.back() != ']') found.push_back(owner);
  }
  return found;
}

Variable loop_owner(const Plan<double>& plan, int loop) {
  Variable owner;
  owner.loop = loop;
  owner.plan_loop = plan_loop_of(plan, loop);
  const LoopPlan<double>& of = plan.loops[static_cast<std::size_t>(owner.plan_loop)];
  owner.joint = of.body_a == ground ? of.body_b : of.body_a;
  return owner;
}

std::vector<Variable> owners(const Scene& scene, Owner kind) {
  const auto& [model, plan] = scene;
  std::vector<Variable> found;
  Variable owner;
  switch (kind) {
    case Owner::joint:
      return simple_joints(plan);
    case Owner::ball:
      for (std::size_t k = 0; k < model.balls.size(); ++k) {
        owner.ball = static_cast<int>(k);
        owner.link = model.balls[k].chart_link;
        owner.joint = plan.balls[k];
        found.push_back(owner);
      }
      break;
    case Owner::frame:
      for (std::size_t k = 0; k < model.frames.size(); ++k) {
        owner.frame = static_cast<int>(k);
        owner.link = model.frames[k].link;
        owner.joint = plan.carrier[owner.link];
        found.push_back(owner);
      }
      break;
    case Owner::loop:
      for (std::size_t k = 0; k < model.loops.size(); ++k)
        found.push_back(loop_owner(plan, static_cast<int>(k)));
      break;
    case Owner::coupling:
      for (std::size_t k = 0; k < model.couplings.size(); ++k) {
        owner.coupling = static_cast<int>(k);
        owner.joint = plan.carrier[model.couplings[k].links.front()];
        found.push_back(owner);
      }
      break;
    case Owner::contact:
      for (std::size_t k = 0; k < model.contacts.size(); ++k) {
        owner.contact = static_cast<int>(k);
        owner.joint = joint_at(scene, model.contacts[k]);
        found.push_back(owner);
      }
      break;
    case Owner::link:
      return moving_links(scene);
    case Owner::model:
      found.push_back(owner);
  }
  return found;
}

std::string owner_name(const Model& model, const Row& row, const Variable& variable) {
  switch (row.owner) {
    case Owner::model:
      return {};
    case Owner::joint:
      return model.links[variable.link].joint.name + ".";
    case Owner::ball:
      return model.balls[variable.ball].name + ".";
    case Owner::frame:
      return model.frames[variable.frame].name + ".";
    case Owner::loop:
      return model.loops[variable.loop].name + ".";
    case Owner::coupling:
      return model.couplings[variable.coupling].name + ".";
    case Owner::contact:
      return model.contacts[variable.contact].name + ".";
    case Owner::link:
      return model.links[variable.link].name + ".";
  }
  return {};
}

// "[3]", or "[1,3]" of a matrix.
std::string index_of(const Row& row, int element, const Lengths& lengths) {
  if (!row.is_array()) return {};
  const int columns = lengths.of(row.columns);
  if (columns == 0) return "[" + std::to_string(element + 1) + "]";
  return "[" + std::to_string(element / columns + 1) + "," + std::to_string(element % columns + 1) + "]";
}

std::string name_of(const Scene& scene, const Lengths& lengths, const Row& row, const Variable& variable) {
  const Model& model = scene.model;
  const bool added = row.adds_to_controller && controlled_joint(model.controller.joints, variable.link);
  return owner_name(model, row, variable) + row.name.text + (added ? "_added" : "") +
         index_of(row, variable.element, lengths);
}

// One parsed entry of model.fmu.tunable: "gravity[2]", "elbow.damping", "hand[1].damping", "link3.com".
struct Tunable {
  const RowGroup* group = nullptr;
  const Row* row = nullptr;  // null: there is no such parameter
  int owner = ground;        // link or contact
  int element = -1;          // -1: all
};

// Finds links by their names or those of their joints, and contacts.
struct OwnerNames {
  explicit OwnerNames(const Model& model) {
    for (std::size_t i = 0; i < model.contacts.size(); ++i)
      contacts[model.contacts[i].name] = static_cast<int>(i);
    for (std::size_t i = 0; i < model.links.size(); ++i) {
      links[model.links[i].name] = static_cast<int>(i);
      joints[model.links[i].joint.name] = static_cast<int>(i);
    }
  }
  int find(Owner owner, const std::string& name) const {
    const std::map<std::string, int>& named = owner == Owner::joint     ? joints
                                              : owner == Owner::contact ? contacts
                                                                        : links;
    const auto found = named.find(name);
    return found == named.end() ? ground : found->second;
  }
  std::map<std::string, int> links, joints, contacts;
};

// Finds the row of "elbow.damping" or "gravity".
void find_parameter(const Scene& scene, const OwnerNames& names, const std::string& name, Tunable& result) {
  const std::size_t dot = name.rfind('.');
  const std::string owner = dot == name.npos ? "" : name.substr(0, dot);
  const std::string field = dot == name.npos ? name : name.substr(dot + 1);
  for (const RowGroup* group : all_groups())
    for (const Row& row : *group) {
      if (!is_tunable(row) || row.name.text != field || (row.owner == Owner::model) != owner.empty())
        continue;
      Variable variable;
      const int found = names.find(row.owner, owner);
      if (row.owner != Owner::model && found == ground) continue;
      (row.owner == Owner::contact ? variable.contact : variable.link) = found;
      const int index = static_cast<int>(&row - group->rows);
      if (group->exists && !group->exists(index, scene, variable)) continue;
      result.group = group;
      result.row = &row;
      result.owner = found;
    }
}

Tunable parse_tunable(const Scene& scene, const OwnerNames& names, const std::string& text) {
  Tunable result;
  std::string name = text;
  // the index in brackets starts at 1
  const bool one = name.size() > 3 && name.back() == ']' && name[name.size() - 3] == '[';
  if (one) {
    result.element = name[name.size() - 2] - '1';
    name.resize(name.size() - 3);
  }
  find_parameter(scene, names, name, result);
  if (one && result.row &&
      (!result.row->is_array() || result.element < 0 || result.element >= result.row->elements({})))
    result.row = nullptr;
  return result;
}

int actuator_states(const Scene& scene) {
  std::vector<int> integrated;
  for (int i = 0; i < scene.plan.nv; ++i)
    if (!scene.plan.joints[i].prescribed && !scene.plan.joints[i].of_ball) integrated.push_back(i);
  const ActuatorCounts states = Actuators(scene.model, integrated, scene.plan.carrier).counts();
  return 2 * states.motors + states.currents + states.lags;
}

bool forms_arrays(const Row& row) {
  return row.type == VariableType::real &&
         (row.is_array() || (row.owner == Owner::joint && !is_tunable(row)));
}

// Kind of the variables that may form one array: states, or one kind of variables that are not states.
int array_kind(const Scene& scene, const Variable& v) {
  if (!v.row->has_state()) return 0;
  return scene.plan.joints[v.joint].prescribed | is_dependent(scene, v) << 1 | is_algebraic(scene, v) << 2;
}

}  // namespace

double Variable::min() const {
  if (element >= row->bounded || row->bounds == Bounds::none) return -std::numeric_limits<double>::infinity();
  return row->bounds == Bounds::not_negative ? 0 : minimum_positive;
}

double Variable::max() const {
  return row->bounds == Bounds::tolerance ? 0.1 : std::numeric_limits<double>::infinity();
}

bool has_work(const Model& model, const Plan<double>& plan) {
  return model.fmu.shows(OutputGroup::energy) && plan.prescribed_count < plan.nv;
}

VariableTable::VariableTable(const Model& model, const Plan<double>& plan,
                             const std::vector<int>& independent) {
  const Scene scene{model, plan};
  lengths_.independent = std::accumulate(independent.begin(), independent.end(), 0);
  lengths_.velocities = scene.velocities();
  lengths_.positions = scene.positions();
  if (StepJacobian::needed(model) || model.fmu.shows(OutputGroup::state))
    lengths_.actuator_states = actuator_states(scene);
  bool tunables_are_there = false;
  for (const RowGroup* group : all_groups())
    if (!is_tunable(*group->begin()))
      add_of_all_owners(scene, *group);
    else if (!std::exchange(tunables_are_there, true))
      add_tunable(scene);
  all_.shrink_to_fit();
}

void VariableTable::add_of_all_owners(const Scene& scene, const RowGroup& group) {
  const Owner kind = group.begin()->owner;
  std::vector<Variable> all = owners(scene, kind);
  const auto add_of = [&](const Row& row, Variable& owner) {
    if (!is_requested(scene.model, row)) return;
    const int elements = row.elements(lengths_);
    for (owner.element = 0; owner.element < elements; ++owner.element) add(scene, group, row, owner);
  };
  if (by_owner(kind)) {
    for (Variable& owner : all)
      for (const Row& row : group) add_of(row, owner);
  } else {
    for (const Row& row : group)
      for (Variable& owner : all) add_of(row, owner);
  }
}

// Adds the variable of a row for its owner and element if it exists.
void VariableTable::add(const Scene& scene, const RowGroup& group, const Row& row, Variable& owner) {
  owner.group = &group;
  owner.row = &row;
  if (group.exists && !group.exists(owner.row_index(), scene, owner)) return;
  all_.push_back(owner);
  Variable& variable = all_.back();
  variable.name = name_of(scene, lengths_, row, variable);
  variable.value_reference = static_cast<unsigned>(all_.size());
  lengths_.inputs += is_force_input(variable);
  lengths_.tunables += is_differentiable_tunable(variable);
}

std::vector<unsigned> VariableTable::array(const Scene& scene, const Variable& first) const {
  const Row& row = *first.row;
  if (first.element > 0 || !forms_arrays(row)) return {};
  std::size_t k = first.value_reference - 1;
  // the variables of one row are adjacent
  while (!row.is_array() && k > 0 && all_[k - 1].row == &row) --k;
  std::vector<unsigned> elements;
  for (; k < all_.size() && all_[k].row == &row; ++k) {
    const bool next = row.is_array() ? all_[k].element == static_cast<int>(elements.size())
                                     : array_kind(scene, all_[k]) == array_kind(scene, first);
    if (next)
      elements.push_back(static_cast<unsigned>(k + 1));
    else if (row.is_array())
      break;
  }
  // a model file may make only some elements tunable
  if (is_tunable(row) && static_cast<int>(elements.size()) < row.elements({})) return {};
  if (elements.front() != first.value_reference) return {};
  return elements;
}

// Adds the tunable parameters in the order of the model file.
void VariableTable::add_tunable(const Scene& scene) {
  const auto& [model, plan] = scene;
  const OwnerNames names(model);
  std::vector<int> joint_of(model.links.size(), -1);
  for (std::size_t i = 0; i < plan.joints.size(); ++i) joint_of[plan.joints[i].link] = static_cast<int>(i);
  std::set<std::string> added;  // the list may contain "arm.com" and "arm.com[1]"
  for (const std::string& name : model.fmu.tunable) {
    const Tunable tunable = parse_tunable(scene, names, name);
    if (!tunable.row)
      throw ModelError(ModelError::Reason::invalid,
                       {{model.name, 0, 0, "tunable '" + name + "': the model has no such parameter"}});
    const Row& row = *tunable.row;
    Variable variable;
    (row.owner == Owner::contact ? variable.contact : variable.link) = tunable.owner;
    if (row.owner == Owner::joint) variable.joint = joint_of[tunable.owner];
    if (row.owner == Owner::contact) variable.joint = joint_at(scene, model.contacts[tunable.owner]);
    for (int element = 0; element < row.elements({}); ++element) {
      if (tunable.element >= 0 && element != tunable.element) continue;
      variable.element = element;
      if (added.insert(name_of(scene, lengths_, row, variable)).second)
        add(scene, *tunable.group, row, variable);
    }
  }
}

}  // namespace redysim
