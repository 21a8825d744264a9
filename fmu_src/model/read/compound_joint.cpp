#include "model/read/compound_joint.hpp"

#include <algorithm>
#include <cmath>

#include "math/angles.hpp"
#include "model/dh.hpp"
#include "model/read/joint_parameters.hpp"

namespace redysim {
namespace {

// One DOF: its type and its axis in the DH frame (0 x, 1 y, 2 z).
struct Dof {
  JointType type;
  int axis;
};

std::vector<Dof> dofs_of(CompoundType type) {
  constexpr JointType turn = JointType::revolute, slide = JointType::prismatic;
  switch (type) {
    case CompoundType::universal:
      return {{turn, 2}, {turn, 1}};
    case CompoundType::cylindrical:
      return {{turn, 2}, {slide, 2}};
    case CompoundType::planar:
      return {{slide, 0}, {slide, 1}, {turn, 2}};
    case CompoundType::spherical:
      return {{turn, 0}, {turn, 2}, {turn, 0}, {turn, 1}};
    case CompoundType::free:
      return {{slide, 0}, {slide, 1}, {slide, 2}, {turn, 0}, {turn, 2}, {turn, 0}, {turn, 1}};
  }
  return {};
}

// Rotation to a frame whose z axis is the given axis, by cyclic permutation of the axes.
Pose z_along(int axis) {
  Pose pose;
  for (int k = 0; k < 3; ++k) pose.rotation.col(k) = Vec3<double>::Unit((k + axis + 1) % 3);
  return pose;
}

// R = Rz(phi) Rx(theta) Ry(psi) (ReDySim's order) as a quaternion (w, x, y, z).
std::array<double, 4> quaternion_of(double phi, double theta, double psi) {
  using Eigen::AngleAxisd;
  const Eigen::Quaterniond q = AngleAxisd(phi, Vec3<double>::UnitZ()) *
                               AngleAxisd(theta, Vec3<double>::UnitX()) *
                               AngleAxisd(psi, Vec3<double>::UnitY());
  return {q.w(), q.x(), q.y(), q.z()};
}

// Reads q of a joint with a Ball: translations, then a quaternion (4) or the angles phi, theta, psi (3).
void read_ball_position(LinkDraft& draft, double unit) {
  Section& section = draft.section;
  const std::size_t slides = draft.dofs.size();
  std::vector<double> given;
  if (!section.numbers("q", given)) return;
  std::array<double, 4> quaternion{};
  if (given.size() == slides + 3) {
    const double* angles = &given[slides];
    quaternion = quaternion_of(unit * angles[0], unit * angles[1], unit * angles[2]);
  } else if (given.size() == slides + 4) {
    std::copy_n(given.begin() + static_cast<std::ptrdiff_t>(slides), 4, quaternion.begin());
  } else {
    section.error("q", "q must be " + std::to_string(slides + 3) + " numbers (angles about z, x, y) or " +
                           std::to_string(slides + 4) + " (quaternion w, x, y, z), got " +
                           std::to_string(given.size()));
    return;
  }
  double norm = 0;
  for (double part : quaternion) norm += part * part;
  if (!(std::abs(norm - 1) < 1e-3)) {
    section.error("q", "the quaternion in q must have length 1, got " + shown(std::sqrt(norm)));
    return;
  }
  for (std::size_t k = 0; k < 4; ++k) draft.ball.quaternion[k] = quaternion[k] / std::sqrt(norm);
  for (std::size_t k = 0; k < slides; ++k) draft.dofs[k].q0 = given[k];
}

void read_ball_velocity(LinkDraft& draft, double unit) {
  const std::size_t slides = draft.dofs.size();
  std::vector<double> given;
  if (!draft.section.numbers("qd", given)) return;
  if (given.size() != slides + 3) {
    draft.section.error(
        "qd", "qd must be " + std::to_string(slides + 3) + " numbers, got " + std::to_string(given.size()));
    return;
  }
  for (std::size_t k = 0; k < slides; ++k) draft.dofs[k].qd0 = given[k];
  for (std::size_t k = 0; k < 3; ++k) draft.ball.omega[k] = unit * given[slides + k];
}

// A massless link with a joint of one DOF.
LinkDraft carrier(const LinkDraft& of, const Dof& dof, const Pose& frame, int parent,
                  const std::string& index) {
  LinkDraft draft{of.link, {}, of.section, {}, {}, {}};
  draft.link.name += index;
  draft.link.parent = parent;
  draft.link.mass = 0;
  draft.link.com.setZero();
  draft.link.inertia = {};
  draft.link.joint.name += index;
  draft.link.joint.type = dof.type;
  draft.link.joint.dh = dh_of(frame);
  return draft;
}

}  // namespace

bool has_ball(CompoundType type) { return type == CompoundType::spherical || type == CompoundType::free; }

void read_compound(LinkDraft& draft, bool degrees) {
  Section& section = draft.section;
  const bool ball = has_ball(*draft.compound);
  std::vector<Dof> dofs = dofs_of(*draft.compound);
  if (ball) dofs.resize(dofs.size() - 4);
  for (const Dof& dof : dofs) {
    draft.dofs.emplace_back();
    draft.dofs.back().type = dof.type;
    draft.dofs.back().drive = draft.link.joint.drive;
  }
  if (!ball) return read_joint_parameters(section, draft.dofs, degrees);
  const double unit = degrees ? degree : 1;
  read_ball_position(draft, unit);
  read_ball_velocity(draft, unit);
  const Drive drive = draft.link.joint.drive;
  if (drive == Drive::motion || drive == Drive::locked)
    section.error("drive", "a " + section.text("joint") + " joint takes drive 'torque' or 'free'");
}

namespace {

// Appends the massless links and the Ball of a compound joint; the link itself becomes fixed to the last one.
void add_carriers(LinkDraft& draft, std::vector<LinkDraft>& links, std::vector<Ball>& balls) {
  const bool with_ball = has_ball(*draft.compound);
  const std::vector<Dof> dofs = dofs_of(*draft.compound);
  const std::size_t ball_at = with_ball ? dofs.size() - 4 : dofs.size();
  int parent = draft.link.parent;
  Pose frame = pose_of(draft.link.joint.dh);  // of the next massless link relative to the previous one
  for (std::size_t k = 0; k < dofs.size(); ++k) {
    const bool of_ball = k >= ball_at;
    const std::string index = !of_ball       ? "[" + std::to_string(k + 1) + "]"
                              : k == ball_at ? "[chart]"
                                             : std::string("[") + "zxy"[k - ball_at - 1] + "]";
    links.push_back(carrier(draft, dofs[k], frame * z_along(dofs[k].axis), parent, index));
    parent = static_cast<int>(links.size()) - 1;
    frame = inverse(z_along(dofs[k].axis));
    Joint& joint = links.back().link.joint;
    if (of_ball) {
      joint.drive = k == ball_at ? Drive::locked : Drive::free;
      continue;
    }
    joint.turned = static_cast<unsigned char>(2 - dofs[k].axis);  // cyclic shift of z_along
    for (const JointParameter& parameter : joint_parameters)
      joint.*parameter.value = draft.dofs[k].*parameter.value;
  }
  if (with_ball) {
    Ball& ball = draft.ball;
    ball.name = draft.link.joint.name;
    ball.chart_link = parent - 3;
    ball.driven = draft.link.joint.drive == Drive::torque;
    balls.push_back(ball);
  }
  draft.compound.reset();
  draft.link.joint.dh = dh_of(frame);
  draft.link.parent = parent;
}

}  // namespace

std::vector<Ball> expand_compound_joints(std::vector<LinkDraft>& drafts) {
  std::vector<Ball> balls;
  std::vector<LinkDraft> expanded;
  std::vector<int> place(drafts.size());  // new index of a link
  for (std::size_t i = 0; i < drafts.size(); ++i) {
    LinkDraft& draft = drafts[i];
    if (draft.link.parent != ground) draft.link.parent = place[draft.link.parent];
    if (draft.compound) add_carriers(draft, expanded, balls);
    place[i] = static_cast<int>(expanded.size());
    expanded.push_back(std::move(draft));
  }
  drafts.swap(expanded);
  return balls;
}

}  // namespace redysim
