#include <algorithm>
#include <cmath>

#include "dynamics/assembly/movability.hpp"
#include "dynamics/compiled.hpp"
#include "dynamics/loops/loop_levers.hpp"
#include "integrate/system/system.hpp"
#include "model/motion_scale.hpp"

// Construction of a System; optimised for size since it runs once.

namespace redysim {

[[gnu::cold]] System::System(const Plan<double>& plan, bool with_work, const Model* model)
    : plan_(plan),
      motion_slot_(static_cast<std::size_t>(plan.nv), -1),
      q_(static_cast<std::size_t>(plan.nv), 0.0),
      qd_(q_),
      qdd_(q_),
      drive_(q_),
      workspace_(plan),
      scratch_(q_),
      progress_(workspace_.loop.residual.size()) {
  if (features::control && model && (!model->trajectories.empty() || model->controller.law != Law::none))
    control_ = std::make_unique<Control>(*model, plan);
  if (plan.has_contacts()) {
    contact_search_ = std::make_unique<ContactSearch>(plan);
    searched_.assign(2 + q_.size(), NAN);
  }
  set_layouts(with_work, model);
  scales_.assign(integrated_.size() + static_cast<std::size_t>(layout_.actuators()), 1.0);
  angles_.resize(plan.balls.size());
  inputs_.assign(base_size(), 0.0);
  if (plan.has_motion()) {
    scratch_inputs_ = inputs_;
    unmoved_.resize(static_cast<std::size_t>(size()));
    sampled_state_ = unmoved_;
  }
  if (!plan.balls.empty() || control_ || actuators_)
    recursion_inputs_.assign(static_cast<std::size_t>(input_layout_.force_size()), 0.0);
  if (plan.has_constraints()) allocate_corrections();
  if (features::straight_line && !features::taylor && !plan.resistances.empty())
    line_inputs_.resize(static_cast<std::size_t>(input_layout_.recursion_size()));
  if (model) set_scales(*model, parameters_of(*model));
}

[[gnu::cold]] void System::allocate_corrections() {
  before_closing_.resize(static_cast<std::size_t>(size()));
  const std::size_t rows = workspace_.loop.b.size();
  if (!features::straight_line && !has_few_loop_rows(plan_)) return;
  corrections_.assign(q_.size() * rows, 0.0);
  gram_.resize((rows + 1) * rows);
}

// A joint is integrated, or its motion is held between settings, or a trajectory prescribes it.
[[gnu::cold]] void System::set_layouts(bool with_work, const Model* model) {
  int held_motions = 0;
  for (int i = 0; i < plan_.nv; ++i) {
    if (plan_.joints[i].of_ball) continue;
    if (!plan_.joints[i].prescribed)
      integrated_.push_back(i);
    else if (!control_ || !control_->prescribes(i))
      motion_slot_[i] = held_motions++;
  }
  const ActuatorCounts actuators = model ? place_actuators(*model) : ActuatorCounts();
  layout_ = StateLayout(static_cast<int>(integrated_.size()), static_cast<int>(plan_.balls.size()),
                        !features::energies || !with_work ? 0
                        : plan_.has_contacts()            ? 2
                                                          : 1,
                        actuators);
  if (actuators_) actuators_->set_layout(layout_);
  input_layout_ = InputLayout(plan_, held_motions, control_ ? static_cast<int>(control_->memory_size()) : 0);
}

[[gnu::cold]] ActuatorCounts System::place_actuators(const Model& model) {
  if (!features::actuators || model.actuators.empty()) return {};
  actuators_ = std::make_unique<Actuators>(model, integrated_, plan_.carrier);
  if (actuators_->empty()) actuators_.reset();
  return actuators_ ? actuators_->counts() : ActuatorCounts();
}

[[gnu::cold]] void System::set_scales(const Model& model, const Parameters<double>& parameters) {
  for (int k = 0; k < simple(); ++k)
    scales_[k] = motion_scale(model, parameters, plan_.joints[joint_of(k)].link);
  if (actuators()) set_actuator_scales(parameters);
}

[[gnu::cold]] void System::nominals(double* y) const {
  std::fill_n(y, size(), 1.0);
  std::copy_n(scales_.begin(), layout_.q.count, layout_.q.of(y));
  std::copy_n(scales_.begin(), layout_.q.count, layout_.qd.of(y));
  std::copy_n(scales_.begin() + layout_.q.count, layout_.actuators(), layout_.motor_q.of(y));
}

[[gnu::cold]] void System::difference_steps(const double* y, double* steps) const {
  // relative to the scale, to the size of a region, and to y (a change above the rounding error)
  constexpr double largest = 1e-7, of_scale = 1e-5, of_region = 1e-2, of_value = 1e-12;
  double position = largest, velocity = largest;
  for (const ContactLaw<double>& law : plan_.contact_laws) {
    position = std::min(position, of_region * law.width);
    velocity = std::min(velocity, of_region / std::max(law.per_velocity, law.per_spin));
  }
  nominals(steps);
  for (int i = 0; i < size(); ++i) steps[i] = std::min(of_scale * steps[i], i < nq() ? position : velocity);
  for (int k = 0; k < simple() && !plan_.resistances.empty(); ++k) {
    const Resistance<double>& of = plan_.resistances[static_cast<std::size_t>(joint_of(k))];
    double &of_q = steps[layout_.q[k]], &of_qd = steps[layout_.qd[k]];
    of_q = std::min(of_q, of_region * of.width);
    of_qd = std::min(of_qd, of_region / of.per_velocity);
  }
  for (int i = 0; i < size(); ++i) steps[i] = std::max(steps[i], of_value * std::fabs(y[i]));
}

// The scale of a motor is N times that of its joint, with N the gear ratio. A torque is scaled by the
// velocity that it gives the joint within its time constant. Where loops lock the joint, perhaps only at a
// dead point, the response is a rounding error: a tenth of the response without loops is the minimum.
[[gnu::cold]] void System::set_actuator_scales(const Parameters<double>& parameters) {
  Workspace<double> workspace(plan_);
  std::vector<double> q(q_), qd(q_.size(), 0.0), free(qd), moved(qd);
  std::vector<double> forces(static_cast<std::size_t>(input_layout_.recursion_size()), 0.0);
  for (int i = 0; i < plan_.nv; ++i) q[i] = parameters.joints[plan_.joints[i].link].q0;
  const std::vector<double> inertias = joint_inertias(plan_, workspace, q.data());
  const auto accelerate = [&](std::vector<double>& qdd) {
    compiled_forward_dynamics(plan_, workspace, q.data(), qd.data(), forces.data(), qdd.data());
  };
  accelerate(free);
  for (int k = 0; k < actuators_->size(); ++k) {
    const int joint = actuators_->joint(k);
    forces[joint] = 1;
    accelerate(moved);
    forces[joint] = 0;
    const auto place = std::find(integrated_.begin(), integrated_.end(), joint) - integrated_.begin();
    const double least = inertias[joint] > 0 ? 0.1 / inertias[joint] : 0;
    actuators_->set_scales(k, scales_[place], std::max(moved[joint] - free[joint], least),
                           &scales_[integrated_.size()]);
  }
}

}  // namespace redysim
