#include "fmi/instance/step_jacobian.hpp"

#include "fmi/instance/values.hpp"
#include "fmi/variables/entry.hpp"

// Derivatives of a whole communication step. They are constant between two steps, so they have no
// dependencies.

namespace redysim {
namespace {

// The rows have the order of StepJacobian::Part.
double read(Values& at, const Variable& v) {
  return at.step_jacobian()->entry(static_cast<StepJacobian::Part>(v.row_index()), v.element);
}

constexpr Entry entries[] = {
    output(Owner::model, "step_jacobian.a")
        .array(per_coordinate, per_coordinate)
        .in(OutputGroup::step_jacobian)
        .discrete()
        .reads(read, Needs::step_jacobian)
        .says("Derivative of the state after the last communication step by that before it: positions and "
              "velocities of the tree, states of actuators"),
    output(Owner::model, "step_jacobian.b")
        .array(per_coordinate, per_input)
        .in(OutputGroup::step_jacobian)
        .discrete()
        .reads(read, Needs::step_jacobian_by_knowns)
        .says("Derivative of the state after the last communication step by a held input (columns: "
              "force inputs in the order of this file)"),
    output(Owner::model, "step_jacobian.c")
        .array(per_coordinate, per_tunable)
        .in(OutputGroup::parameter_jacobian)
        .discrete()
        .reads(read, Needs::step_jacobian_by_knowns)
        .says("Derivative of the state after the last communication step by a tunable parameter (columns: "
              "in the order of this file)"),
};

}  // namespace

const RowGroup StepJacobianVariables::rows = rows_in<entries>;
const WordGroup StepJacobianVariables::words = words_in<entries>;

}  // namespace redysim
