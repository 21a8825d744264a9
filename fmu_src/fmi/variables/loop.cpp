#include "dynamics/loops/loop_rows.hpp"
#include "fmi/instance/derivatives.hpp"
#include "fmi/instance/values.hpp"
#include "fmi/variables/entry.hpp"
#include "model/loop_rows_of.hpp"

// Variables of a loop: constraint violation and multipliers.

namespace redysim {
namespace {

bool has_multiplier(const Scene& scene, const Variable& v) {
  return v.element < multiplier_count(scene.model.loops[v.loop]);
}

// Index of a multiplier among all constraint rows; -1: omitted in a planar scene, with the value 0.
template <class Scalar>
int multiplier_row(const Plan<Scalar>& plan, const Variable& v) {
  const LoopPlan<Scalar>& loop = plan.loops[v.plan_loop];
  for (std::size_t k = 0; k < loop.rows.size(); ++k)
    if (loop.rows[k].index == v.element) return loop.first_row + static_cast<int>(k);
  return -1;
}

double read_multiplier(Values& at, const Variable& v) {
  const int row = multiplier_row(at.plan(), v);
  return row < 0 ? 0 : at.system().workspace().loop.lambda[row];
}

double multiplier_derivative(OutputDerivatives& of, const Variable& v) {
  const int row = multiplier_row(of.values().plan(), v);
  return row < 0 ? 0 : of.tangent().multipliers[row].derivative;
}

bool has_row(const Scene& scene, const Variable& v) {
  return v.element / scene.velocities() < multiplier_count(scene.model.loops[v.loop]);
}

template <class Scalar>
Scalar constraint_jacobian(EquationTerms<Scalar>& terms, Variable v) {
  const int n = terms.velocities(), column = v.element % n;
  v.element /= n;
  const int row = multiplier_row(terms.plan(), v);
  return row < 0 ? Scalar(0) : terms.constraint_jacobian(v.plan_loop, row, column);
}

void measure_gap(const Model& model, const Variable& v, Presentation& shown) {
  const LoopType type = model.loops[v.loop].type;
  if (type == LoopType::point || type == LoopType::spherical)
    shown.quantity = quantity::length;
  else
    shown.description += ", norm over its rows in m and rad";
}

// Multipliers of position rows are forces, those of rotation rows are moments (order: loop_rows_of.hpp).
void name_multiplier(const Model& model, const Variable& v, Presentation& shown) {
  const LoopType type = model.loops[v.loop].type;
  const bool slides = type == LoopType::prismatic || type == LoopType::cylindrical;
  const bool is_force = type == LoopType::point || v.element < (slides ? 2 : 3);
  shown.quantity = is_force ? quantity::force : quantity::torque;
  shown.description = "Constraint " + ((is_force ? "force" : "moment") + shown.description);
}

void name_constraint(const Model& model, const Variable& v, Presentation& shown) {
  const std::vector<TreeCoordinate> all = tree_velocities(model);
  const std::size_t element = static_cast<std::size_t>(v.element);
  shown.description += std::to_string(element / all.size() + 1) + " on " + all[element % all.size()].name;
}

constexpr const char* numbers[] = {"1", "2", "3", "4", "5", "6"};

constexpr Entry entries[] = {
    output(Owner::loop, "gap")
        .bounds(Bounds::not_negative)
        .reads(
            [](Values& at, const Variable& v) {
              return loop_gap(at.plan().loops[v.plan_loop], at.system().workspace());
            },
            Needs::accelerations)
        .depends(at_point::jumps, initially::position)  // derivative 0: the constraints hold
        .says("Constraint violation of %")
        .adapted(measure_gap),
    output(Owner::loop, "lambda")
        .array(6)
        .there_if(has_multiplier)
        .reads(read_multiplier, Needs::accelerations)
        .derivative(multiplier_derivative)
        .depends(at_point::accelerations, initially::accelerations)
        .says(" (multiplier $) of %")
        .labels(numbers)
        .adapted(name_multiplier),
    output(Owner::loop, "constraint_jacobian")
        .array(6, per_velocity)
        .in(OutputGroup::constraint_jacobian)
        .there_if(has_row)
        .reads([](Values& at, const Variable& v) { return constraint_jacobian(at.terms(), v); },
               Needs::accelerations)
        .derivative([](OutputDerivatives& of, const Variable& v) {
          return constraint_jacobian(of.tangent().terms(), v).derivative;
        })
        .depends(at_point::jumps, initially::accelerations)
        .says("Constraint Jacobian of %: multiplier ")
        .adapted(name_constraint),
};

}  // namespace

const RowGroup LoopVariables::rows = rows_in<entries>;
const WordGroup LoopVariables::words = words_in<entries>;

}  // namespace redysim
