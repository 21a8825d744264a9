#include "model/start_poses.hpp"

namespace redysim {
namespace {

Mat3<double> rotation_of(const std::array<double, 4>& q) {
  return Eigen::Quaterniond(q[0], q[1], q[2], q[3]).normalized().toRotationMatrix();
}

}  // namespace

int turned_link(const Ball& ball) { return ball.chart_link + 4; }

std::vector<Pose> start_poses(const Model& model) {
  std::vector<Pose> poses;
  poses.reserve(model.links.size());
  for (const Link& link : model.links) {
    const DhParameters dh = displaced(link.joint, link.joint.q0);
    poses.push_back(link.parent == ground ? pose_of(dh) : poses[link.parent] * pose_of(dh));
    for (const Ball& ball : model.balls)
      if (turned_link(ball) == static_cast<int>(poses.size()) - 1)
        poses.back().rotation *= rotation_of(ball.quaternion);
  }
  return poses;
}

}  // namespace redysim
