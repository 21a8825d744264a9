#include "fmi/instance/prescribed_motion.hpp"

#include <algorithm>

#include "integrate/system/start.hpp"

namespace redysim {

PrescribedMotion::PrescribedMotion(Simulation& simulation)
    : simulation_(simulation),
      values_(3 * static_cast<std::size_t>(simulation.plan.nv)),
      was_set_(values_.size()) {
  reset_to_start();
}

void PrescribedMotion::reset_to_start() {
  const Plan<double>& plan = simulation_.plan;
  for (int i = 0; i < plan.nv; ++i)
    if (plan.joints[i].prescribed) {
      const int link = plan.joints[i].link;
      const auto start =
          start_motion(simulation_.model.links[link].joint, simulation_.parameters.joints[link]);
      std::copy(start.begin(), start.end(), &values_[3 * i]);
    }
  begin();
}

void PrescribedMotion::reset() {
  reset_to_start();
  std::fill(was_set_.begin(), was_set_.end(), 0);
  reported_ = false;
}

void PrescribedMotion::begin() {
  const double time = simulation_.time;
  simulation_.system.enter_phases(time);
  for (int i = 0; i < simulation_.plan.nv; ++i)
    if (simulation_.plan.joints[i].prescribed)
      simulation_.system.set_motion(time, i, values_[3 * i], values_[3 * i + 1], values_[3 * i + 2]);
}

void PrescribedMotion::hold() {
  for (int i = 0; i < simulation_.plan.nv; ++i) {
    const auto was_set = was_set_.begin() + 3 * i;
    if (!simulation_.plan.joints[i].prescribed || std::find(was_set, was_set + 3, 1) == was_set + 3) continue;
    simulation_.system.set_motion(simulation_.time, i, values_[3 * i], values_[3 * i + 1],
                                  values_[3 * i + 2]);
  }
}

bool PrescribedMotion::set(int joint, int order, double value) {
  double* values = &values_[3 * joint];
  const bool is_new = simulation_.model_exchange && was_set_[3 * joint + order] == 0;
  was_set_[3 * joint + order] = 1;
  if (values[order] == value && !is_new) return false;
  values[order] = value;
  if (simulation_.integrator && !simulation_.model_exchange)
    simulation_.system.change_motion(simulation_.time, joint, order, value);
  else
    simulation_.system.set_motion(simulation_.time, joint, values[0], values[1], values[2]);
  return true;
}

void PrescribedMotion::set_locked(const Variable& variable, double value) {
  if (variable.row->owner != Owner::joint || !simulation_.plan.joints[variable.joint].prescribed) return;
  values_[3 * variable.joint] = value;
  begin();
}

std::string PrescribedMotion::never_set() {
  reported_ = true;
  constexpr int listed = 6;
  std::string names;
  int count = 0;
  for (const Variable& variable : simulation_.table.all()) {
    if (!variable.is_motion() || was_set_[3 * variable.joint + variable.row->motion_order]) continue;
    if (++count <= listed) names += (count == 1 ? "" : ", ") + variable.name;
  }
  if (count > listed) names += " and " + std::to_string(count - listed) + " more";
  return names;
}

void PrescribedMotion::restore(Saved&& saved) {
  values_.swap(saved.values);
  was_set_.swap(saved.was_set);
}

}  // namespace redysim
