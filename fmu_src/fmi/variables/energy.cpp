#include "fmi/instance/derivatives.hpp"
#include "fmi/instance/values.hpp"
#include "fmi/variables/entry.hpp"

// Energies, work and momentum of all bodies.

namespace redysim {
namespace {

bool is_integrated(const Scene& scene, const Variable&) { return has_work(scene.model, scene.plan); }

bool has_contact_work(const Scene& scene, const Variable&) {
  return scene.plan.has_contacts() && has_work(scene.model, scene.plan);
}

constexpr Entry entries[] = {
    output(Owner::model, "energy.kinetic")
        .in(OutputGroup::energy)
        .bounds(Bounds::not_negative)
        .reads([](Values& at, const Variable&) { return at.kinetic_energy(); }, Needs::energies)
        .derivative(
            [](OutputDerivatives& of, const Variable&) { return of.tangent().kinetic_energy().derivative; })
        .depends(at_point::all_jumps, initially::kinetic)
        .measures(quantity::energy)
        .says("Kinetic energy of links and armatures"),
    output(Owner::model, "energy.potential")
        .in(OutputGroup::energy)
        .reads([](Values& at, const Variable&) { return at.potential_energy(); }, Needs::energies)
        .derivative(
            [](OutputDerivatives& of, const Variable&) { return of.tangent().potential_energy().derivative; })
        .depends(at_point::all_jumps, initially::potential)
        .measures(quantity::energy)
        .says("Potential energy of gravity, springs and stops"),
    output(Owner::model, "energy.total")
        .in(OutputGroup::energy)
        .reads([](Values& at, const Variable&) { return at.kinetic_energy() + at.potential_energy(); },
               Needs::energies)
        .derivative([](OutputDerivatives& of, const Variable&) { return of.energy(); })
        .depends(at_point::all_jumps, initially::energies)
        .measures(quantity::energy)
        .says("Sum of kinetic and potential energy"),
    output(Owner::model, "momentum.linear")
        .in(OutputGroup::momentum)
        .array(3)
        .reads([](Values& at, const Variable& v) { return at.momentum().force[v.element]; })
        .derivative([](OutputDerivatives& of, const Variable& v) {
          return of.tangent().momentum().force[v.element].derivative;
        })
        .depends(at_point::all_jumps, initially::kinetic)
        .measures(quantity::momentum)
        .says("Linear momentum, $ in the ground frame")
        .labels(axes),
    output(Owner::model, "momentum.angular")
        .in(OutputGroup::momentum)
        .array(3)
        .reads([](Values& at, const Variable& v) { return at.momentum().moment[v.element]; })
        .derivative([](OutputDerivatives& of, const Variable& v) {
          return of.tangent().momentum().moment[v.element].derivative;
        })
        .depends(at_point::all_jumps, initially::kinetic)
        .measures(quantity::angular_momentum)
        .says("Angular momentum about the ground's origin, $ in the ground frame")
        .labels(axes),
    output(Owner::model, "energy.work")
        .there_if(is_integrated)
        .is_state(StatePart::work)
        .reads([](Values& at, const Variable&) { return at.work(); })
        .derivative([](OutputDerivatives& of, const Variable&) { return of.work(); })
        .depends(at_point::all_jumps, nullptr)
        .measures(quantity::energy)
        .says("Work of drives, ports, dampers and friction since the start"),
    output(Owner::model, "energy.contact")
        .there_if(has_contact_work)
        .is_state(StatePart::contact_work)
        .reads([](Values& at, const Variable&) { return at.contact_work(); })
        .derivative([](OutputDerivatives& of, const Variable&) { return of.contact_work(); })
        .depends(nullptr, nullptr)
        .measures(quantity::energy)
        .says("Work of contact forces since the start, without the energy stored in contacts"),
    output(Owner::model, "energy.balance")
        .there_if(is_integrated)
        .reads([](Values& at, const Variable&) { return at.energy_balance(); }, Needs::energies)
        .derivative([](OutputDerivatives& of, const Variable&) { return of.balance(); })
        .depends(at_point::all_jumps, nullptr)
        .measures(quantity::energy)
        .says("Energy balance error: change of total energy minus work (zero in exact arithmetic)"),
};

constexpr Entry slope_entries[] = {
    output(Owner::model, "energy.power")
        .local()
        .there_if(is_integrated)
        .slope_of(StatePart::work)
        .reads([](Values& at, const Variable& v) { return at.slope(v); }, Needs::slopes)
        .derivative([](OutputDerivatives& of, const Variable&) { return of.tangent().power.derivative; })
        .depends(initially::anything, initially::anything)
        .measures(quantity::power)
        .says("Power of drives, ports, dampers and friction"),
    output(Owner::model, "energy.contact_power")
        .local()
        .there_if(has_contact_work)
        .slope_of(StatePart::contact_work)
        .reads([](Values& at, const Variable& v) { return at.slope(v); }, Needs::slopes)
        .derivative(
            [](OutputDerivatives& of, const Variable&) { return of.tangent().contact_power().derivative; })
        .depends(initially::anything, initially::anything)
        .measures(quantity::power)
        .says("Power of contact forces, without that of the energy stored in contacts"),
};

}  // namespace

const RowGroup WorkSlopes::rows = rows_in<slope_entries>;
const WordGroup WorkSlopes::words = words_in<slope_entries>;
const RowGroup EnergyVariables::rows = rows_in<entries>;
const WordGroup EnergyVariables::words = words_in<entries>;

}  // namespace redysim
