#include "fmi/instance/derivatives.hpp"
#include "fmi/instance/values.hpp"
#include "fmi/variables/entry.hpp"

// Terms of the equations of motion (dynamics/equation_terms.hpp) and forces in joints.

namespace redysim {
namespace {

using Terms = EquationTerms<double>;

void name_force(const Model& model, const Variable& v, Presentation& shown) {
  const TreeCoordinate at = tree_velocities(model)[v.element];
  shown.description += at.name;
  if (at.slides) shown.quantity = quantity::force;
}

void name_mass(const Model& model, const Variable& v, Presentation& shown) {
  const std::vector<TreeCoordinate> all = tree_velocities(model);
  const TreeCoordinate &row = all[v.element / all.size()], &column = all[v.element % all.size()];
  shown.description += row.name + ", " + column.name;
  constexpr Quantity quantities[] = {quantity::moment_of_inertia, {&units::kilogram_metre}, quantity::mass};
  shown.quantity = quantities[row.slides + column.slides];
}

// The terms of the rows of `entries`.
constexpr Terms::Term terms[] = {Terms::mass, Terms::bias, Terms::gravity, Terms::coriolis, Terms::passive};

double read(Values& at, const Variable& v) { return at.terms().entry(terms[v.row_index()], v.element); }

double derivative(OutputDerivatives& of, const Variable& v) {
  const int term = terms[v.row_index()];
  return of.tangent().terms().entry(static_cast<EquationTerms<Dual>::Term>(term), v.element).derivative;
}

constexpr Entry term(const char* name, OutputGroup group, const char* text) {
  return output(Owner::model, name)
      .array(per_velocity)
      .in(group)
      .reads(read, Needs::accelerations)
      .derivative(derivative)
      .depends(at_point::all_jumps, initially::anything)
      .measures(quantity::torque)
      .says(text)
      .adapted(name_force);
}

constexpr Entry entries[] = {
    term("mass_matrix", OutputGroup::mass_matrix, "Joint-space inertia, armatures included: ")
        .array(per_velocity, per_velocity)
        .adapted(name_mass),
    term("bias", OutputGroup::bias,
         "Inverse dynamics at zero acceleration (Coriolis, centrifugal, gravity): "),
    term("gravity_torque", OutputGroup::gravity_torque, "Inverse dynamics at rest (gravity): "),
    term("coriolis", OutputGroup::coriolis,
         "Inverse dynamics at zero acceleration without gravity (Coriolis, centrifugal): "),
    term("passive", OutputGroup::passive,
         "Generalized force of springs, dampers, friction, stops and contact: "),
};

// Row 0 of the group is the force, row 1 the moment.
int reaction_index(const Model& model, const Variable& v) {
  int axis = v.element + model.links[v.link].joint.turned;
  if (axis > 2) axis -= 3;
  return axis + (v.row_index() == 0 ? 3 : 0);
}
double read_reaction(Values& at, const Variable& v) {
  return component(at.terms().reaction(v.joint), reaction_index(at.model(), v));
}
double reaction_derivative(OutputDerivatives& of, const Variable& v) {
  return component(of.tangent().terms().reaction(v.joint), reaction_index(of.model(), v)).derivative;
}

constexpr Entry reaction(const char* name, const Quantity& quantity, const char* text) {
  return output(Owner::joint, name)
      .array(3)
      .in(OutputGroup::reaction)
      .reads(read_reaction, Needs::accelerations)
      .derivative(reaction_derivative)
      .depends(at_point::accelerations, initially::accelerations)
      .measures(quantity)
      .says(text)
      .labels(axes);
}
constexpr Entry reaction_force =
    reaction("reaction_force", quantity::force, "Force on the link through %, $ in link axes");
constexpr Entry reaction_torque = reaction("reaction_torque", quantity::torque,
                                           "Moment on the link through %, drive included, $ in link axes");

constexpr Entry joint_entries[] = {reaction_force, reaction_torque};
constexpr Entry ball_entries[] = {reaction_force.of(Owner::ball), reaction_torque.of(Owner::ball)};

void name_regressor(const Model& model, const Variable& v, Presentation& shown) {
  constexpr const char* parameters[] = {"mass", "m cx", "m cy", "m cz", "Ixx",
                                        "Iyy",  "Izz",  "Ixy",  "Ixz",  "Iyz"};
  shown.description +=
      std::string(parameters[v.element % 10]) + " on " + tree_velocities(model)[v.element / 10].name;
}

constexpr Entry link_entries[] = {
    output(Owner::link, "regressor")
        .array(per_velocity, 10)
        .in(OutputGroup::regressor)
        .reads([](Values& at, const Variable& v) { return at.terms().regressor(v.link, v.element); },
               Needs::accelerations)
        .derivative([](OutputDerivatives& of, const Variable& v) {
          return of.tangent().terms().regressor(v.link, v.element).derivative;
        })
        .depends(at_point::accelerations, initially::accelerations)
        .says("Regressor of %: effect of ")
        .adapted(name_regressor),
};

}  // namespace

const RowGroup LinkRegressors::rows = rows_in<link_entries>;
const WordGroup LinkRegressors::words = words_in<link_entries>;
const RowGroup JointReactions::rows = rows_in<joint_entries>;
const WordGroup JointReactions::words = words_in<joint_entries>;
const RowGroup BallReactions::rows = rows_in<ball_entries>;
const WordGroup BallReactions::words = words_in<ball_entries>;
const RowGroup EquationVariables::rows = rows_in<entries>;
const WordGroup EquationVariables::words = words_in<entries>;

}  // namespace redysim
