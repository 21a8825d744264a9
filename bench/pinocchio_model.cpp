#include "pinocchio_model.hpp"

#include <pinocchio/multibody.hpp>
// require multibody.hpp
#include <pinocchio/algorithm/aba.hpp>
#include <pinocchio/algorithm/rnea.hpp>
#include <vector>

#include "model/dh.hpp"

namespace redysim::bench {

namespace pin = pinocchio;

struct PinocchioTree::Parts {
  pin::Model model;
  pin::Data data;
};

PinocchioTree::PinocchioTree(const Model& model) : parts_(std::make_unique<Parts>()) {
  pin::Model& to = parts_->model;
  to.gravity.linear() = model.gravity;
  std::vector<pin::JointIndex> joint_of;
  for (const Link& link : model.links) {
    const Pose pose = pose_of(link.joint.dh);
    const pin::JointIndex parent = link.parent == ground ? 0 : joint_of[link.parent];
    const pin::JointIndex joint =
        to.addJoint(parent, pin::JointModelRZ(), pin::SE3(pose.rotation, pose.position), link.joint.name);
    const auto& I = link.inertia;
    Eigen::Matrix3d about_com;
    about_com << I[0], I[3], I[4], I[3], I[1], I[5], I[4], I[5], I[2];
    to.appendBodyToJoint(joint, pin::Inertia(link.mass, link.com, about_com), pin::SE3::Identity());
    joint_of.push_back(joint);
  }
  parts_->data = pin::Data(to);
}

PinocchioTree::~PinocchioTree() = default;

const double* PinocchioTree::forward_dynamics(const double* q, const double* qd, const double* tau,
                                              bool world) {
  using Map = Eigen::Map<const Eigen::VectorXd>;
  const int n = parts_->model.nv;
  return pin::aba(parts_->model, parts_->data, Map(q, n), Map(qd, n), Map(tau, n),
                  world ? pin::Convention::WORLD : pin::Convention::LOCAL)
      .data();
}

const double* PinocchioTree::inverse_dynamics(const double* q, const double* qd, const double* qdd) {
  using Map = Eigen::Map<const Eigen::VectorXd>;
  const int n = parts_->model.nv;
  return pin::rnea(parts_->model, parts_->data, Map(q, n), Map(qd, n), Map(qdd, n)).data();
}

std::string PinocchioTree::version() { return PINOCCHIO_VERSION; }

}  // namespace redysim::bench
