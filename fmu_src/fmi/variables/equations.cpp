#include "fmi/instance/derivatives.hpp"
#include "fmi/instance/values.hpp"
#include "fmi/variables/entry.hpp"

// Terms of the equations of motion (dynamics/equation_terms.hpp).

namespace redysim {
namespace {

using Terms = EquationTerms<double>;

// The velocities as the links of the model have them.
struct Velocity {
  std::string name;
  bool slides = false;
};
std::vector<Velocity> velocities(const Model& model) {
  std::vector<Velocity> found;
  for (std::size_t i = 0; i < model.links.size(); ++i) {
    const Joint& joint = model.links[i].joint;
    if (!moves(joint)) continue;
    Velocity velocity{"joint '" + joint.name + "'", !turns(joint)};
    int part = -2;  // of no spherical joint
    for (const Ball& ball : model.balls)
      if (const int k = static_cast<int>(i) - ball.chart_link - 1; - 1 <= k && k < 3) {
        part = k;
        velocity.name = "joint '" + ball.name + "' (" + (k < 0 ? "" : axes[k]) + ")";
      }
    if (part != -1) found.push_back(velocity);
  }
  return found;
}

void name_force(const Model& model, const Variable& v, Presentation& shown) {
  const Velocity at = velocities(model)[v.element];
  shown.description += at.name;
  if (at.slides) shown.quantity = quantity::force;
}

void name_mass(const Model& model, const Variable& v, Presentation& shown) {
  const std::vector<Velocity> all = velocities(model);
  const Velocity &row = all[v.element / all.size()], &column = all[v.element % all.size()];
  shown.description += row.name + ", " + column.name;
  constexpr Quantity quantities[] = {quantity::moment_of_inertia, {&units::kilogram_metre}, quantity::mass};
  shown.quantity = quantities[row.slides + column.slides];
}

template <Terms::Term term>
double read(Values& at, const Variable& v) {
  return at.terms().entry(term, v.element);
}

template <EquationTerms<Dual>::Term term>
double derivative(OutputDerivatives& of, const Variable& v) {
  return of.tangent().terms().entry(term, v.element).derivative;
}

using Duals = EquationTerms<Dual>;

constexpr Entry entries[] = {
    output(Owner::model, "mass_matrix")
        .array(per_velocity, per_velocity)
        .in(OutputGroup::mass_matrix)
        .reads(read<Terms::mass>, Needs::accelerations)
        .derivative(derivative<Duals::mass>)
        .depends(at_point::all_jumps, initially::anything)
        .says("Joint-space inertia, armatures included: ")
        .adapted(name_mass),
    output(Owner::model, "bias")
        .array(per_velocity)
        .in(OutputGroup::bias)
        .reads(read<Terms::bias>, Needs::accelerations)
        .derivative(derivative<Duals::bias>)
        .depends(at_point::all_jumps, initially::anything)
        .measures(quantity::torque)
        .says("Inverse dynamics at zero acceleration (Coriolis, centrifugal, gravity): ")
        .adapted(name_force),
    output(Owner::model, "gravity_torque")
        .array(per_velocity)
        .in(OutputGroup::gravity_torque)
        .reads(read<Terms::gravity>, Needs::accelerations)
        .derivative(derivative<Duals::gravity>)
        .depends(at_point::all_jumps, initially::anything)
        .measures(quantity::torque)
        .says("Inverse dynamics at rest (gravity): ")
        .adapted(name_force),
    output(Owner::model, "coriolis")
        .array(per_velocity)
        .in(OutputGroup::coriolis)
        .reads(read<Terms::coriolis>, Needs::accelerations)
        .derivative(derivative<Duals::coriolis>)
        .depends(at_point::all_jumps, initially::anything)
        .measures(quantity::torque)
        .says("Inverse dynamics at zero acceleration without gravity (Coriolis, centrifugal): ")
        .adapted(name_force),
    output(Owner::model, "passive")
        .array(per_velocity)
        .in(OutputGroup::passive)
        .reads(read<Terms::passive>, Needs::accelerations)
        .derivative(derivative<Duals::passive>)
        .depends(at_point::all_jumps, initially::anything)
        .measures(quantity::torque)
        .says("Generalized force of springs, dampers, friction, stops and contact: ")
        .adapted(name_force),
};

}  // namespace

const RowGroup EquationVariables::rows = rows_in<entries>;
const WordGroup EquationVariables::words = words_in<entries>;

}  // namespace redysim
