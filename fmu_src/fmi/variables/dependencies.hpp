#pragma once

#include <vector>

#include "fmi/variables/variables.hpp"

// The model structure of the XML: which variables an output depends on. Used by `describe` only.

namespace redysim {

class IndependentCoordinates;

// Sets of coupled joints: those of one tree, and of trees connected by a loop or a spring. Connections to
// ground do not couple joints.
class Components {
 public:
  explicit Components(const Scene& scene);
  const Model& model() const { return scene_.model; }
  const Plan<double>& plan() const { return scene_.plan; }
  int of(int joint) const { return joint == ground ? ground : leader_[joint]; }
  int of(const Variable& known) const;  // component that a known acts on; ground: none
  bool has_constraints(int component) const { return has_constraint_[component]; }
  bool is_constrained(int joint) const { return joint != ground && has_constraints(of(joint)); }

 private:
  int leader_of(int joint) const;
  void join(int a, int b);
  Scene scene_;
  std::vector<int> leader_;
  std::vector<char> has_constraint_;  // of leaders
};

// Whether `unknown` depends on `known`, an input or (in initialization mode) a parameter.
using Rule = bool (*)(const Variable& unknown, const Variable& known, const Components& components);

// At a communication point the state is fixed: positions and energies depend on jumps of prescribed motions,
// accelerations also on forces.
namespace at_point {
bool jumps(const Variable& unknown, const Variable& known, const Components& components);
bool all_jumps(const Variable& unknown, const Variable& known, const Components& components);
bool accelerations(const Variable& unknown, const Variable& known, const Components& components);
bool sensed(const Variable& unknown, const Variable& known, const Components& components);
}  // namespace at_point

// In initialization mode outputs depend on start values, inputs and tunable parameters.
namespace initially {
bool anything(const Variable& unknown, const Variable& known, const Components& components);
bool target(const Variable& unknown, const Variable& known, const Components& components);
bool position(const Variable& unknown, const Variable& known, const Components& components);
bool velocity(const Variable& unknown, const Variable& known, const Components& components);
bool accelerations(const Variable& unknown, const Variable& known, const Components& components);
bool sensed(const Variable& unknown, const Variable& known, const Components& components);
bool kinetic(const Variable& unknown, const Variable& known, const Components& components);
bool potential(const Variable& unknown, const Variable& known, const Components& components);
bool energies(const Variable& unknown, const Variable& known, const Components& components);
}  // namespace initially

// Whether an output is a known times a constant factor.
enum class ConstantFactor { no, unless_assembled, always };

// Knowns by index into VariableTable::all(). `all`: depends on every known, or on too many to list; then
// `knowns` is empty.
struct Dependencies {
  int unknown = 0;
  bool all = false;
  std::vector<int> knowns;
  bool constant = false;
};

// The states of model exchange and their time derivatives, as indices into VariableTable::all(). Empty if the
// model does not support model exchange.
struct StateVariables {
  std::vector<int> states, slopes;
};
StateVariables state_variables(const VariableTable& table, const Model& model, const System& system,
                               const IndependentCoordinates& states);

// Direct dependencies on inputs and states of all outputs and all derivatives of states, at a communication
// point or, in model exchange, at any time.
std::vector<Dependencies> output_dependencies(const VariableTable& table, const Scene& scene,
                                              const StateVariables& states);
std::vector<Dependencies> slope_dependencies(const VariableTable& table, const Scene& scene,
                                             const StateVariables& states);

// Dependencies in initialization mode: on inputs, start values and tunable parameters.
std::vector<Dependencies> initial_dependencies(const VariableTable& table, const Scene& scene);

}  // namespace redysim
