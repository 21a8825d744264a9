#include "fmi/instance/derivatives.hpp"
#include "fmi/instance/values.hpp"
#include "fmi/variables/entry.hpp"

// Tunable parameters of links, and gravity.

namespace redysim {
namespace {

constexpr const char* inertia_entries[] = {"Ixx", "Iyy", "Izz", "Ixy", "Ixz", "Iyz"};

Mat3<double> inertia_direction(int element, double change) {
  constexpr int rows[] = {0, 1, 2, 0, 0, 1}, columns[] = {0, 1, 2, 1, 2, 2};
  Mat3<double> direction = Mat3<double>::Zero();
  direction(rows[element], columns[element]) = direction(columns[element], rows[element]) = change;
  return direction;
}

void change_body(OutputDerivatives& of, const Variable& v, double mass, const Vec3<double>& com,
                 const Mat3<double>& inertia) {
  const Link& link = of.model().links[v.link];
  const Plan<double>& plan = of.values().plan();
  of.tangent().change_mass(plan.carrier[v.link], plan.frame_in_carrier[v.link], link.com, link.mass, mass,
                           com, inertia);
}

constexpr Entry entries[] = {
    parameter(Owner::link, "mass")
        .bounds(Bounds::not_negative)
        .lives_at([](Model& model, const Variable& v) -> double& { return model.links[v.link].mass; })
        .acts_on(acts::mass | acts::weight)
        .direction([](OutputDerivatives& of, const Variable& v, double direction) {
          change_body(of, v, direction, Vec3<double>::Zero(), Mat3<double>::Zero());
        })
        .measures(quantity::mass)
        .says("Mass of %"),
    parameter(Owner::link, "com")
        .array(3)
        .lives_at(
            [](Model& model, const Variable& v) -> double& { return model.links[v.link].com[v.element]; })
        .acts_on(acts::mass | acts::weight)
        .direction([](OutputDerivatives& of, const Variable& v, double direction) {
          Vec3<double> com = Vec3<double>::Zero();
          com[v.element] = direction;
          change_body(of, v, 0, com, Mat3<double>::Zero());
        })
        .measures(quantity::length)
        .says("Center of mass of %, $ in the link frame")
        .labels(axes),
    parameter(Owner::link, "inertia")
        .array(6)
        .bounds(Bounds::not_negative, 3)  // the moments; products may be negative
        .lives_at(
            [](Model& model, const Variable& v) -> double& { return model.links[v.link].inertia[v.element]; })
        .acts_on(acts::mass)
        .direction([](OutputDerivatives& of, const Variable& v, double direction) {
          change_body(of, v, 0, Vec3<double>::Zero(), inertia_direction(v.element, direction));
        })
        .measures(quantity::moment_of_inertia)
        .says("Inertia matrix entry $ of % about its center of mass, link axes")
        .labels(inertia_entries),
    parameter(Owner::model, "gravity")
        .array(3)
        .lives_at([](Model& model, const Variable& v) -> double& { return model.gravity[v.element]; })
        .acts_on(acts::gravity)
        .direction([](OutputDerivatives& of, const Variable& v, double direction) {
          for (Plan<Dual>* plan : of.tangent().plans()) plan->gravity[v.element].derivative += direction;
        })
        .measures(quantity::acceleration)
        .says("Gravitational acceleration, $ in the ground frame")
        .labels(axes),
};

}  // namespace

const RowGroup LinkParameters::rows = rows_in<entries>;
const WordGroup LinkParameters::words = words_in<entries>;

}  // namespace redysim
