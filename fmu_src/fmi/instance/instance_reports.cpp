#include <algorithm>
#include <cmath>

#include "dynamics/assembly/assembly.hpp"
#include "dynamics/assembly/freedom.hpp"
#include "dynamics/motion_subspace.hpp"
#include "fmi/instance/instance.hpp"
#include "integrate/system/start.hpp"
#include "model/read/number.hpp"

// What the log says about a model or about how it is used, beside errors.

namespace redysim {

// Whether the prescribed motions miss or outnumber the freedom of closed loops.
void Instance::report_drives() {
  if (!plan_.has_loops() || !plan_.has_motion()) return;
  if (!log_.events() && !log_.warnings()) return;
  const Freedom found = freedom(model_, system_.coordinates(time_, current_state()).q);
  if (found.surplus > 0)
    log_.warning(sentence(found));
  else
    log_.event(sentence(found));
  const Tangent::Misfit misfits = misfit_of_accelerations(model_, system_, time_, current_state());
  if (misfits.loop >= 0) log_.warning(misfit(model_, misfits.loop, misfits.acceleration));
}

// Which parts of prescribed motions the master has left alone until the first step.
void Instance::report_unset_motion() {
  if (motion_checked_) return;
  motion_checked_ = true;
  constexpr int listed = 6;
  std::string names;
  int count = 0;
  for (const Variable& variable : table_.all()) {
    const int part = static_cast<int>(variable.role) - static_cast<int>(Role::motion_q);
    if (part < 0 || part > 2 || motion_set_[3 * variable.joint + part] != 0) continue;
    if (++count <= listed) names += (count == 1 ? "" : ", ") + variable.name;
  }
  if (count == 0) return;
  if (count > listed) names += " and " + std::to_string(count - listed) + " more";
  log_.warning("inputs of prescribed motions that were never set: " + names +
               "; each follows from its start value and the other inputs of its joint. Set q, qd and qdd of "
               "every prescribed joint");
}

// How far joints have come from where they started.
void Instance::note_travel() {
  const double* y = integrator_->state();
  if (travel_.empty())
    for (int k = 0; k < system_.simple(); ++k) travel_.push_back({y[k], 0});
  for (int k = 0; k < system_.simple(); ++k)
    travel_[k].farthest = std::max(travel_[k].farthest, std::abs(y[k] - travel_[k].start));
}

// Slides whose whole motion is hardly larger than its tolerance. What is far below it may be rounding.
void Instance::report_short_travel() {
  if (!integrator_ || !log_.warnings()) return;
  constexpr double resolved = 100, rounding = 1e-6;
  for (std::size_t k = 0; k < travel_.size(); ++k) {
    const JointPlan<double>& joint = plan_.joints[system_.joint_of(static_cast<int>(k))];
    const auto [start, farthest] = travel_[k];
    const double tolerance =
        integrator_settings_.rtol * std::abs(start) + integrator_settings_.atol * system_.scales()[k];
    if (turns(joint) || farthest < rounding * tolerance || farthest > resolved * tolerance) continue;
    log_.warning("joint '" + model_.links[joint.link].joint.name + "' moved by " + rounded(farthest) +
                 " m at most, and the solver's tolerance is " + rounded(tolerance) +
                 " m: lower solver.rtol and solver.atol to resolve this motion");
  }
}

}  // namespace redysim
