#include "fmi/instance/derivatives.hpp"
#include "fmi/instance/values.hpp"
#include "fmi/variables/entry.hpp"
#include "fmi/variables/presentation.hpp"

// Independent coordinates of the joints in loops and rigid couplings: states of model exchange.

namespace redysim {
namespace {

void number(const Model&, const Variable& v, Presentation& shown) {
  shown.description += std::to_string(v.element + 1) + " of loops and rigid couplings";
}

constexpr Entry entries[] = {
    output(Owner::model, "independent.joint")
        .local()
        .array(per_independent)
        .discrete(VariableType::string)
        .says("Joint of independent coordinate ")
        .adapted(number),
    output(Owner::model, "independent.q")
        .local()
        .array(per_independent)
        .is_state(StatePart::independent_q)
        .reads([](Values& at, const Variable& v) { return at.independent(v.element).q; })
        .derivative(
            [](OutputDerivatives& of, const Variable& v) { return of.independent(v.element).q.derivative; })
        .depends(at_point::all_jumps, initially::anything)
        .says("Position (rad or m) of independent coordinate ")
        .adapted(number),
    output(Owner::model, "independent.qd")
        .local()
        .array(per_independent)
        .is_state(StatePart::independent_qd)
        .slope_of(StatePart::independent_q)
        .reads([](Values& at, const Variable& v) { return at.independent(v.element).qd; })
        .derivative(
            [](OutputDerivatives& of, const Variable& v) { return of.independent(v.element).qd.derivative; })
        .depends(at_point::all_jumps, initially::anything)
        .says("Velocity (rad/s or m/s) of independent coordinate ")
        .adapted(number),
    output(Owner::model, "independent.qdd")
        .local()
        .array(per_independent)
        .slope_of(StatePart::independent_qd)
        .reads([](Values& at, const Variable& v) { return at.independent(v.element).qdd; }, Needs::slopes)
        .derivative(
            [](OutputDerivatives& of, const Variable& v) { return of.independent(v.element).qdd.derivative; })
        .depends(initially::anything, initially::anything)
        .says("Acceleration (rad/s^2 or m/s^2) of independent coordinate ")
        .adapted(number),
    output(Owner::model, "independent.margin")
        .local()
        .event_indicator()
        .there_if([](const Scene& scene, const Variable&) { return scene.plan.has_constraints(); })
        .reads([](Values& at, const Variable&) { return at.margin(); })
        .depends(initially::anything, initially::anything)
        .says("Event indicator: negative where other independent coordinates should be chosen"),
};

}  // namespace

const RowGroup IndependentVariables::rows = rows_in<entries>;
const WordGroup IndependentVariables::words = words_in<entries>;

}  // namespace redysim
