#include "dynamics/elastic_coupling.hpp"
#include "fmi/instance/derivatives.hpp"
#include "fmi/instance/values.hpp"
#include "fmi/variables/entry.hpp"

// Variables of a coupling: its sum and its force.

namespace redysim {
namespace {

template <class Scalar, class Coordinate>
Scalar sum_of(const Coupling& coupling, const Plan<double>& plan, Coordinate coordinate, double offset) {
  Scalar sum(-offset);
  for (std::size_t k = 0; k < coupling.links.size(); ++k)
    sum += coupling.ratios[k] * coordinate(plan.carrier[coupling.links[k]]);
  return sum;
}

double read_gap(Values& at, const Variable& v) {
  const Coupling& coupling = at.model().couplings[v.coupling];
  const System::Coordinates now = at.coordinates();
  return sum_of<double>(
      coupling, at.plan(), [&](int joint) { return now.q[joint]; }, coupling.offset);
}

double gap_derivative(OutputDerivatives& of, const Variable& v) {
  const Coupling& coupling = of.model().couplings[v.coupling];
  if (coupling.rigid()) return 0;
  const Tangent& tangent = of.tangent();
  return sum_of<double>(
      coupling, of.values().plan(), [&](int joint) { return tangent.q[joint].derivative; }, 0);
}

const ElasticCouplingPlan& elastic_plan(const Plan<double>& plan, const Variable& v) {
  std::size_t k = 0;
  while (plan.elastic_couplings[k].coupling != v.coupling) ++k;
  return plan.elastic_couplings[k];
}

template <class Scalar>
Scalar multiplier(const Plan<double>& plan, const std::vector<Scalar>& lambda, const Variable& v) {
  Scalar sum(0);
  for (const MultiplierPart& part : plan.coupling_multipliers[v.coupling])
    sum += part.factor * lambda[part.row];
  return sum;
}

double read_force(Values& at, const Variable& v) {
  const Plan<double>& plan = at.plan();
  if (at.model().couplings[v.coupling].rigid())
    return multiplier(plan, at.system().workspace().loop.lambda, v);
  const System::Coordinates now = at.coordinates();
  return -coupling_force(elastic_plan(plan, v), now.q, now.qd).sum();
}

double force_derivative(OutputDerivatives& of, const Variable& v) {
  const Plan<double>& plan = of.values().plan();
  const Tangent& tangent = of.tangent();
  if (of.model().couplings[v.coupling].rigid()) return multiplier(plan, tangent.multipliers, v).derivative;
  const ElasticCouplingPlan& coupling = elastic_plan(plan, v);
  return -coupling_force(coupling, tangent.q.data(), tangent.qd.data()).sum().derivative;
}

// Depends on the positions of all its joints; the variable itself stores the first joint only.
bool depends_on_positions(const Variable& unknown, const Variable& known, const Components& components) {
  Variable at = unknown;
  for (int link : components.model().couplings[unknown.coupling].links) {
    at.joint = components.plan().carrier[link];
    if (initially::position(at, known, components)) return true;
  }
  return false;
}

// Unit: radian if all joints turn, metre if all slide.
void measure(const Model& model, const Variable& v, Presentation& shown, const Quantity& turning,
             const Quantity& sliding) {
  int turns_count = 0;
  const std::vector<int>& links = model.couplings[v.coupling].links;
  for (int link : links) turns_count += turns(model.links[link].joint) ? 1 : 0;
  if (turns_count == static_cast<int>(links.size())) shown.quantity = turning;
  if (turns_count == 0) shown.quantity = sliding;
}

void measure_gap(const Model& model, const Variable& v, Presentation& shown) {
  measure(model, v, shown, quantity::angle, quantity::length);
}

void measure_force(const Model& model, const Variable& v, Presentation& shown) {
  measure(model, v, shown, quantity::torque, quantity::force);
}

constexpr Entry entries[] = {
    output(Owner::coupling, "gap")
        .reads(read_gap)
        .derivative(gap_derivative)
        .depends(at_point::jumps, depends_on_positions)
        .says("Sum of ratios times positions minus offset of %")
        .adapted(measure_gap),
    output(Owner::coupling, "lambda")
        .reads(read_force, Needs::accelerations)
        .derivative(force_derivative)
        .depends(at_point::accelerations, initially::accelerations)
        .says("Force of %: acts on each joint with its ratio")
        .adapted(measure_force),
};

}  // namespace

const RowGroup CouplingVariables::rows = rows_in<entries>;
const WordGroup CouplingVariables::words = words_in<entries>;

}  // namespace redysim
