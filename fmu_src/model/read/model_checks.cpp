#include "model/read/model_checks.hpp"

#include "model/any_of.hpp"
#include "model/inertia.hpp"

namespace redysim {
namespace {

bool has_inertia(const Link& link) { return !inertia_matrix(link.inertia).isZero(0); }

// Rotation and translation from link frame to parent frame of a fixed joint.
Eigen::Isometry3d placement(const DhParameters& dh) {
  using Eigen::AngleAxisd, Eigen::Translation3d, Eigen::Vector3d;
  return Eigen::Isometry3d(AngleAxisd(dh.gamma, Vector3d::UnitZ())) * Translation3d(0, 0, dh.b) *
         AngleAxisd(dh.alpha, Vector3d::UnitX()) * Translation3d(dh.a, 0, 0) *
         AngleAxisd(dh.theta, Vector3d::UnitZ()) * Translation3d(0, 0, dh.d);
}

// Inertia of one link about the origin of a frame in which the link has this pose.
Mat3<double> inertia_about_origin(const Link& link, const Eigen::Isometry3d& pose) {
  const Vec3<double> com = pose * link.com;
  const Mat3<double> rotation = pose.linear();
  return rotation * inertia_matrix(link.inertia) * rotation.transpose() +
         link.mass * (com.squaredNorm() * Mat3<double>::Identity() - com * com.transpose());
}

// Everything that a joint moves.
struct Outboard {
  double mass = 0;
  bool inertia = false;                           // whether any link has inertia
  bool rigid = true;                              // whether no further joint moves
  Mat3<double> at_origin = Mat3<double>::Zero();  // inertia of the rigid part about the link frame's origin
};

std::vector<Outboard> outboards(const std::vector<LinkDraft>& drafts) {
  const std::vector<int> carrier = rigid_carriers(drafts);
  std::vector<Outboard> outboards(drafts.size());
  std::vector<Eigen::Isometry3d> pose(drafts.size(), Eigen::Isometry3d::Identity());  // in the carrier
  for (std::size_t i = 0; i < drafts.size(); ++i) {
    const Link& link = drafts[i].link;
    if (carrier[i] == ground) continue;
    if (carrier[i] != static_cast<int>(i)) pose[i] = pose[link.parent] * placement(link.joint.dh);
    outboards[carrier[i]].at_origin += inertia_about_origin(link, pose[i]);
  }
  for (std::size_t i = drafts.size(); i-- > 0;) {
    const Link& link = drafts[i].link;
    outboards[i].mass += link.mass;
    outboards[i].inertia = outboards[i].inertia || has_inertia(link);
    if (link.parent == ground) continue;
    Outboard& parent = outboards[link.parent];
    parent.mass += outboards[i].mass;
    parent.inertia = parent.inertia || outboards[i].inertia;
    parent.rigid = parent.rigid && outboards[i].rigid && !moves(link.joint);
  }
  return outboards;
}

std::string immovable(const Joint& joint, const Outboard& outboard) {
  const std::string remedy = "; give its link mass or inertia, or the joint an armature";
  const std::string name = "joint '" + joint.name + "' ";
  if (outboard.mass == 0 && (!outboard.inertia || !turns(joint))) return name + "moves no mass" + remedy;
  // S^T M S of a rigid body, compared with its value if the full trace of inertia acted about the axis
  const MotionSubspace S = motion_subspace(joint);
  const double moved = S.angular * S.angular * outboard.at_origin(2, 2) + S.linear * S.linear * outboard.mass;
  const double most =
      S.angular * S.angular * outboard.at_origin.trace() + S.linear * S.linear * outboard.mass;
  if (outboard.rigid && moved <= 1e-14 * most)
    return name + "moves no inertia, because all its mass lies on its own axis" + remedy;
  return {};
}

}  // namespace

void check_inertia(const Link& link, Section& section) {
  const Vec3<double> moments = principal_moments(link.inertia);
  const auto list = [&] {
    return " (" + rounded(moments[0]) + ", " + rounded(moments[1]) + ", " + rounded(moments[2]) + ")";
  };
  if (has_negative_moment(moments))
    section.error("inertia", "inertia has a negative principal moment" + list());
  else if (moments[2] > moments[0] + moments[1] + 1e-9 * moments.cwiseAbs().maxCoeff())
    section.warn(
        "inertia",
        "inertia is not physically possible: its largest principal moment exceeds the sum of the others" +
            list());
}

std::vector<int> rigid_carriers(const std::vector<LinkDraft>& drafts) {
  std::vector<int> carrier(drafts.size());
  for (std::size_t i = 0; i < drafts.size(); ++i) {
    const Link& link = drafts[i].link;
    if (moves(link.joint))
      carrier[i] = static_cast<int>(i);
    else
      carrier[i] = link.parent == ground ? ground : carrier[link.parent];
  }
  return carrier;
}

void check_movable(std::vector<LinkDraft>& drafts, Section& top) {
  bool movable = false;
  const std::vector<Outboard> outboard = outboards(drafts);
  const bool massless =
      !any_of(drafts, [](const LinkDraft& draft) { return draft.link.mass != 0 || has_inertia(draft.link); });
  for (std::size_t i = 0; i < drafts.size(); ++i) {
    const Joint& joint = drafts[i].link.joint;
    if (!moves(joint)) continue;
    movable = true;
    if (joint.armature > 0 || joint.drive == Drive::motion || joint.drive == Drive::locked) continue;
    const std::string message = immovable(joint, outboard[i]);
    if (!message.empty() && massless) {
      drafts[i].section.error(
          drafts[i].section.place(),
          "no link has mass or inertia; give the links masses, or the joints drive 'motion'");
      return;
    }
    if (!message.empty()) drafts[i].section.error(drafts[i].section.place(), message);
  }
  if (!movable) top.error("link", "all joints are fixed; at least one joint must move");
}

}  // namespace redysim
