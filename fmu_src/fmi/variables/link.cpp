#include "fmi/instance/derivatives.hpp"
#include "fmi/instance/values.hpp"
#include "fmi/variables/entry.hpp"

// Tunable parameters of links, and gravity.

namespace redysim {
namespace {

constexpr const char* inertia_entries[] = {"Ixx", "Iyy", "Izz", "Ixy", "Ixz", "Iyz"};

constexpr Entry entries[] = {
    parameter(Owner::link, "mass")
        .bounds(Bounds::not_negative)
        .sets([](auto& at, const Variable& v) -> auto& { return at.links[v.link].mass; })
        .acts_on(acts::mass | acts::weight)
        .measures(quantity::mass)
        .says("Mass of %"),
    parameter(Owner::link, "com")
        .array(3)
        .sets([](auto& at, const Variable& v) -> auto& { return at.links[v.link].com[v.element]; })
        .acts_on(acts::mass | acts::weight)
        .measures(quantity::length)
        .says("Center of mass of %, $ in the link frame")
        .labels(axes),
    parameter(Owner::link, "inertia")
        .array(6)
        .bounds(Bounds::not_negative, 3)  // the moments; products may be negative
        .sets([](auto& at, const Variable& v) -> auto& { return at.links[v.link].inertia[v.element]; })
        .acts_on(acts::mass)
        .measures(quantity::moment_of_inertia)
        .says("Inertia matrix entry $ of % about its center of mass, link axes")
        .labels(inertia_entries),
    parameter(Owner::model, "gravity")
        .array(3)
        .sets([](auto& at, const Variable& v) -> auto& { return at.gravity[v.element]; })
        .acts_on(acts::gravity)
        .measures(quantity::acceleration)
        .says("Gravitational acceleration, $ in the ground frame")
        .labels(axes),
};

}  // namespace

const RowGroup LinkParameterVariables::rows = rows_in<entries>;
const WordGroup LinkParameterVariables::words = words_in<entries>;

}  // namespace redysim
