#include "dynamics/sensed_wrench.hpp"

#include <algorithm>
#include <utility>

#include "dynamics/joint_wrenches.hpp"
#include "model/any_of.hpp"

namespace redysim {
namespace {

bool shows_wrench(const Frame& frame) { return frame.wrench; }

// The model with a locked joint at 0 instead of each fixed link with a sensor.
Model with_cuts(Model model) {
  for (const Frame& frame : model.frames) {
    Joint& joint = model.links[frame.link].joint;
    if (!frame.wrench || moves(joint)) continue;
    joint.type = JointType::revolute;
    joint.drive = Drive::locked;
    joint.q0 = joint.qd0 = 0;
  }
  return model;
}

std::vector<int> joints_by_link(const Plan<double>& plan, const Plan<double>& of) {
  std::vector<int> result;
  for (const auto& joint : plan.joints) {
    const auto same = [&joint](const auto& other) { return other.link == joint.link; };
    const auto found = std::find_if(of.joints.begin(), of.joints.end(), same);
    result.push_back(found == of.joints.end() ? -1 : static_cast<int>(found - of.joints.begin()));
  }
  return result;
}

// Omits rows that a planar loop does not have in `of`, and rows of couplings, which transmit no wrench.
std::vector<int> rows_by_loop(const Plan<double>& plan, const Plan<double>& of) {
  std::vector<int> result;
  for (const ClusterPlan& cluster : plan.clusters)
    result.resize(result.size() + static_cast<std::size_t>(cluster.row_count), -1);
  for (const auto& loop : plan.loops)
    for (std::size_t row = 0; row < loop.rows.size(); ++row)
      for (const auto& other : of.loops)
        for (std::size_t k = 0; other.loop == loop.loop && k < other.rows.size(); ++k)
          if (other.rows[k].index == loop.rows[row].index)
            result[static_cast<std::size_t>(loop.first_row) + row] = other.first_row + static_cast<int>(k);
  return result;
}

// A port on a link fixed to the ground exists only in `plan`.
std::vector<int> ports_by_frame(const Plan<double>& plan, const Plan<double>& of) {
  std::vector<int> result;
  for (const auto& port : plan.ports) {
    const auto same = [&port](const auto& other) { return other.frame == port.frame; };
    const auto found = std::find_if(of.ports.begin(), of.ports.end(), same);
    result.push_back(found == of.ports.end() ? -1 : static_cast<int>(found - of.ports.begin()));
  }
  return result;
}

template <class Scalar>
void take(const std::vector<int>& places, const Scalar* from, int width, std::vector<Scalar>& to) {
  for (std::size_t i = 0; i < places.size(); ++i)
    for (int k = 0; places[i] >= 0 && k < width; ++k)
      to[i * static_cast<std::size_t>(width) + static_cast<std::size_t>(k)] = from[places[i] * width + k];
}

}  // namespace

template <class Scalar>
bool SensedWrenches<Scalar>::needed(const Model& model) {
  return any_of(model.frames, shows_wrench);
}

template <class Scalar>
SensedWrenches<Scalar>::SensedWrenches(const Model& model, const Plan<double>& plan)
    : SensedWrenches(Plan<double>(with_cuts(model)), plan) {}

template <class Scalar>
SensedWrenches<Scalar>::SensedWrenches(Plan<double>&& cut, const Plan<double>& plan)
    : joint_(joints_by_link(cut, plan)),
      row_(rows_by_loop(cut, plan)),
      port_(ports_by_frame(cut, plan)),
      plan_(std::move(cut)),
      workspace_(plan_),
      q_(joint_.size(), Scalar(0)),
      qd_(q_),
      qdd_(q_),
      tau_(q_),
      ports_(6 * port_.size(), Scalar(0)),
      lambda_(row_.size(), Scalar(0)) {}

template <class Scalar>
void SensedWrenches<Scalar>::evaluate(const Scalar* q, const Scalar* qd, const Scalar* qdd,
                                      const Scalar* ports, const std::vector<Scalar>& lambda) {
  take(joint_, q, 1, q_);
  take(joint_, qd, 1, qd_);
  take(joint_, qdd, 1, qdd_);
  take(port_, ports, 6, ports_);
  take(row_, lambda.data(), 1, lambda_);
  set_joint_wrenches(plan_, workspace_, q_.data(), qd_.data(), qdd_.data(), ports_.data(), lambda_,
                     tau_.data());
}

template <class Scalar>
Force<Scalar> SensedWrenches<Scalar>::of(const Frame& frame) const {
  const Force<Scalar>& on_link = workspace_.joints[plan_.carrier[frame.link]].p;
  const Mat3<Scalar> into_frame = frame.rotation.transpose().template cast<Scalar>();
  const Vec3<Scalar> arm = frame.position.template cast<Scalar>();
  return {into_frame * (arm.cross(on_link.force) - on_link.moment), -(into_frame * on_link.force)};
}

template class SensedWrenches<double>;
template class SensedWrenches<Dual>;

}  // namespace redysim
