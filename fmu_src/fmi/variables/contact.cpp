#include "dynamics/contact/contact_force.hpp"
#include "fmi/instance/derivatives.hpp"
#include "fmi/instance/values.hpp"
#include "fmi/variables/entry.hpp"

// Variables of a contact: resultant on link a, its deepest point, and tunable parameters.

namespace redysim {
namespace {

template <bool Contact::*shown>
bool shows(const Scene& scene, const Variable& v) {
  return scene.model.contacts[v.contact].*shown;
}

ContactResult<Dual> change(OutputDerivatives& of, const Variable& v) {
  return of.tangent().contact(v.contact, of.model().contacts[v.contact].a.link);
}

template <Vec3<double> ContactResult<double>::*part>
double read_vector(Values& at, const Variable& v) {
  return (at.contact(v.contact).*part)[v.element];
}

template <Vec3<Dual> ContactResult<Dual>::*part>
double vector_derivative(OutputDerivatives& of, const Variable& v) {
  return (change(of, v).*part)[v.element].derivative;
}

constexpr Entry entries[] = {
    output(Owner::contact, "force")
        .array(3)
        .there_if(shows<&Contact::shows_force>)
        .reads(read_vector<&ContactResult<double>::force>, Needs::accelerations)
        .derivative(vector_derivative<&ContactResult<Dual>::force>)
        .depends(at_point::jumps, initially::accelerations)
        .measures(quantity::force)
        .says("Force of % on its link_a, $ in the ground frame")
        .labels(axes),
    output(Owner::contact, "torque")
        .array(3)
        .there_if(shows<&Contact::shows_torque>)
        .reads(read_vector<&ContactResult<double>::moment>, Needs::accelerations)
        .derivative(vector_derivative<&ContactResult<Dual>::moment>)
        .depends(at_point::jumps, initially::accelerations)
        .measures(quantity::torque)
        .says("Torque of % on its link_a about the origin of the link's frame, $ in the ground frame")
        .labels(axes),
    output(Owner::contact, "depth")
        .there_if(shows<&Contact::shows_depth>)
        .reads([](Values& at, const Variable& v) { return at.contact(v.contact).depth; },
               Needs::accelerations)
        .derivative([](OutputDerivatives& of, const Variable& v) { return change(of, v).depth.derivative; })
        .depends(at_point::jumps, initially::accelerations)
        .measures(quantity::length)
        .says("Largest penetration depth of %; negative: distance"),
    output(Owner::contact, "point")
        .array(3)
        .there_if(shows<&Contact::shows_point>)
        .reads(read_vector<&ContactResult<double>::point>, Needs::accelerations)
        .derivative(vector_derivative<&ContactResult<Dual>::point>)
        .depends(at_point::jumps, initially::accelerations)
        .measures(quantity::position)
        .says("Deepest contact point of %, $ in the ground frame")
        .labels(axes),
    output(Owner::contact, "slip")
        .there_if(shows<&Contact::shows_slip>)
        .reads([](Values& at, const Variable& v) { return at.contact(v.contact).slip; }, Needs::accelerations)
        .derivative([](OutputDerivatives& of, const Variable& v) { return change(of, v).slip.derivative; })
        .depends(at_point::jumps, initially::accelerations)
        .measures(quantity::velocity)
        .says("Slip velocity at the deepest contact point of %"),
};

bool is_smooth(const Scene& scene, const Variable& v) {
  return scene.model.contacts[v.contact].law == Contact::Law::smooth;
}

constexpr Entry parameter_entries[] = {
    parameter(Owner::contact, "stiffness")
        .bounds(Bounds::positive)
        .sets([](auto& at, const Variable& v) -> auto& { return at.contacts[v.contact].stiffness; })
        .acts_on(acts::potential)
        .measures(quantity::linear_stiffness)
        .says("Stiffness of each point of %"),
    parameter(Owner::contact, "damping")
        .there_if(is_smooth)
        .bounds(Bounds::not_negative)
        .sets([](auto& at, const Variable& v) -> auto& { return at.contacts[v.contact].damping; })
        .acts_on(acts::resistance)
        .measures({&units::second_per_metre, nullptr})
        .says("Damping of %, relative increase of its force per depth rate"),
    parameter(Owner::contact, "friction")
        .bounds(Bounds::not_negative)
        .sets([](auto& at, const Variable& v) -> auto& { return at.contacts[v.contact].friction; })
        .acts_on(acts::resistance)
        .says("Coefficient of sliding friction of %"),
    parameter(Owner::contact, "static_friction")
        .there_if(is_smooth)
        .bounds(Bounds::not_negative)
        .sets([](auto& at, const Variable& v) -> auto& { return at.contacts[v.contact].static_friction; })
        .acts_on(acts::resistance)
        .says("Maximum coefficient of friction of %"),
    parameter(Owner::contact, "friction_velocity")
        .there_if(is_smooth)
        .bounds(Bounds::positive)
        .sets([](auto& at, const Variable& v) -> auto& { return at.contacts[v.contact].friction_velocity; })
        .acts_on(acts::resistance)
        .measures(quantity::velocity)
        .says("Slip velocity of maximum friction of %"),
};

}  // namespace

const RowGroup ContactVariables::rows = rows_in<entries>;
const WordGroup ContactVariables::words = words_in<entries>;

const RowGroup ContactParameterVariables::rows = rows_in<parameter_entries>;
const WordGroup ContactParameterVariables::words = words_in<parameter_entries>;

}  // namespace redysim
