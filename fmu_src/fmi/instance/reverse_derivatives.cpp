#include <cmath>

#include "dynamics/derivatives.hpp"
#include "fmi/instance/derivatives.hpp"

// Adjoint derivatives by one reverse sweep: open trees of simple joints whose drives are torques, without
// forces between bodies, actuators and controllers; states, their slopes and torques.

namespace redysim {

struct OutputDerivatives::Reverse {
  explicit Reverse(const Plan<double>& plan) : derivatives(plan) {}
  Derivatives derivatives;
  // weights of the states, of the accelerations and of the power
  std::vector<double> q, qd, qdd;
  double work = 0, power = 0;
  Derivatives::Gradient row;
  void begin(std::size_t joints) {
    for (std::vector<double>* weights : {&q, &qd, &qdd}) weights->assign(joints, 0.0);
    work = power = 0;
  }
};

OutputDerivatives::OutputDerivatives(Simulation& simulation, CurrentState& state, Values& values)
    : simulation_(simulation), state_(state), values_(values) {}

OutputDerivatives::~OutputDerivatives() = default;

// false: an unknown of another kind.
bool OutputDerivatives::add_weight(const Variable& unknown, double weight) {
  const Row& row = *unknown.row;
  if (row.state == StatePart::q)
    reverse_->q[unknown.joint] += weight;
  else if (row.state == StatePart::qd)
    reverse_->qd[unknown.joint] += weight;
  else if (row.slope_of == StatePart::qd)
    reverse_->qdd[unknown.joint] += weight;
  else if (row.state == StatePart::work)
    reverse_->work += weight;
  else if (row.slope_of == StatePart::work)
    reverse_->power += weight;
  else
    return false;
  return true;
}

// The place of the product; null: a known of another kind.
const double* OutputDerivatives::gradient(const Variable& known) const {
  const Reverse& reverse = *reverse_;
  switch (known.row->state) {
    case StatePart::q:
      return &reverse.row.q[known.joint];
    case StatePart::qd:
      return &reverse.row.qd[known.joint];
    case StatePart::work:
      return &reverse.work;
    default:
      break;
  }
  if (known.row->storage != Storage::input) return nullptr;
  const std::size_t input =
      static_cast<std::size_t>(known.group->input(known.row_index, simulation_.system, known));
  return input < reverse.row.tau.size() ? &reverse.row.tau[input] : nullptr;
}

// The products of all weights; false: the accelerations are not finite.
bool OutputDerivatives::sweep_back() {
  System& system = simulation_.system;
  const Plan<double>& plan = simulation_.plan;
  Reverse& reverse = *reverse_;
  const std::size_t n = static_cast<std::size_t>(plan.nv);
  std::vector<double> qdd(n), tau(n);
  if (!values_.update(Needs::parameters).empty()) return false;
  if (system.accelerations(simulation_.time, state_.y(), qdd.data()) != Status::ok) return false;
  const System::Coordinates at = system.coordinates(simulation_.time, state_.y());
  system.drive_forces(at, qdd.data(), tau.data());
  reverse.derivatives.evaluate_row(plan, system.workspace(), at.q, at.qd, qdd.data(), tau.data(),
                                   reverse.qdd.data(), reverse.power, reverse.row);
  values_.changed();  // the workspace has other contents
  for (std::size_t i = 0; i < n; ++i) {
    reverse.row.q[i] += reverse.q[i];
    reverse.row.qd[i] += reverse.qd[i];
  }
  return true;
}

bool OutputDerivatives::pull_back(const unsigned* unknowns, std::size_t unknown_count, const unsigned* knowns,
                                  std::size_t known_count, const double* seed, double* sensitivity) {
  const System& system = simulation_.system;
  const Plan<double>& plan = simulation_.plan;
  if (!plan.is_plain() || !plan.balls.empty() || system.control() || system.actuators()) return false;
  if (!reverse_) reverse_ = std::make_unique<Reverse>(plan);
  reverse_->begin(static_cast<std::size_t>(plan.nv));
  const VariableTable& table = simulation_.table;
  for (std::size_t i = 0; i < unknown_count; ++i) {
    const Variable* unknown = table.real(unknowns[i]);
    if (!unknown || !add_weight(*unknown, seed[i])) return false;
  }
  if (!sweep_back()) return false;
  for (std::size_t k = 0; k < known_count; ++k) {
    const Variable* known = table.real(knowns[k]);
    const double* product = known ? gradient(*known) : nullptr;
    if (!product || !std::isfinite(*product)) return false;
    sensitivity[k] = *product;
  }
  return true;
}

}  // namespace redysim
