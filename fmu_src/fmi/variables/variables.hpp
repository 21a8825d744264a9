#pragma once

#include <string>
#include <vector>

#include "fmi/variables/row.hpp"

// The table of all variables of a model, used for the XML (through `describe`) and in the running FMU.

namespace redysim {

// One variable: a row, its owner and the element of an array.
struct Variable {
  std::string name;
  const Row* row = nullptr;
  const RowGroup* group = nullptr;
  int link = ground;             // index into Model::links; ground: the whole model
  int joint = -1;                // index into Plan::joints; -1: not of a moving joint
  int frame = -1;                // index into Model::frames
  int ball = -1;                 // index into Model::balls
  int loop = -1;                 // index into Model::loops
  int plan_loop = -1;            // index of this loop in Plan::loops
  int coupling = -1;             // index into Model::couplings
  int contact = -1;              // index into Model::contacts
  int element = 0;               // index in an array
  unsigned value_reference = 0;  // in the table: 1, 2, ...

  int row_index() const { return static_cast<int>(row - group->rows); }
  VariableType type() const { return row->type; }
  Causality causality() const { return row->causality; }
  Variability variability() const { return row->variability; }
  bool is_motion() const { return row->storage == Storage::motion; }
  bool is_calculated() const { return causality() == Causality::output || causality() == Causality::local; }
  double min() const;
  double max() const;
};

// Value reference of an array variable: this plus the reference of its first element.
inline constexpr unsigned array_reference = 1u << 30;

class VariableTable {
 public:
  // `plan`: of `model`; `independent`: number of independent joints per cluster. Throws ModelError if a
  // tunable parameter does not exist.
  VariableTable(const Model& model, const Plan<double>& plan, const std::vector<int>& independent);

  const std::vector<Variable>& all() const { return all_; }
  const Lengths& lengths() const { return lengths_; }

  // The variable of the type with this value reference, or null. In FMI 3.0, reference 0 is the time.
  const Variable* real(unsigned reference) const { return find(VariableType::real, reference); }
  const Variable* integer(unsigned reference) const { return find(VariableType::integer, reference); }
  const Variable* string(unsigned reference) const { return find(VariableType::string, reference); }

  // The elements of the FMI 3.0 array variable that starts with this variable; empty: none. An array is a
  // vector or matrix of one owner, or one quantity of all joints; states and prescribed motions form separate
  // arrays.
  std::vector<unsigned> array(const Scene& scene, const Variable& first) const;

 private:
  void add(const Scene& scene, const RowGroup& group, const Row& row, Variable& owner);
  void add_of_all_owners(const Scene& scene, const RowGroup& group);
  void add_tunable(const Scene& scene);
  const Variable* find(VariableType type, unsigned reference) const {
    if (reference == 0 || reference > all_.size()) return nullptr;
    const Variable& variable = all_[reference - 1];
    return variable.type() == type ? &variable : nullptr;
  }

  std::vector<Variable> all_;
  Lengths lengths_;
};

// The knowns of a step Jacobian are force inputs (not prescribed motions) and tunable parameters.
inline bool is_force_input(const Variable& variable) {
  return variable.causality() == Causality::input && variable.row->storage == Storage::input;
}
inline bool is_differentiable_tunable(const Variable& variable) {
  return variable.variability() == Variability::tunable && variable.row->has_direction;
}

// Whether the work of drives and dampers is integrated: energies are outputs and the model has a state.
bool has_work(const Model& model, const Plan<double>& plan);

}  // namespace redysim
