#include "model/compound_joint.hpp"

#include <cmath>

#include "model/dh.hpp"

namespace redysim {
namespace {

constexpr double pi = 3.14159265358979323846;

// One freedom: its type and the DH frame's axis it moves about or along (0 x, 1 y, 2 z).
struct Freedom {
  JointType type;
  int axis;
};

std::vector<Freedom> freedoms_of(JointType type) {
  constexpr JointType turn = JointType::revolute, slide = JointType::prismatic;
  switch (type) {
    case JointType::universal:
      return {{turn, 2}, {turn, 1}};
    case JointType::cylindrical:
      return {{turn, 2}, {slide, 2}};
    case JointType::planar:
      return {{slide, 0}, {slide, 1}, {turn, 2}};
    case JointType::spherical:
      return {{turn, 0}, {turn, 2}, {turn, 0}, {turn, 1}};
    case JointType::free:
      return {{slide, 0}, {slide, 1}, {slide, 2}, {turn, 0}, {turn, 2}, {turn, 0}, {turn, 1}};
    default:
      return {};
  }
}

bool has_ball(JointType type) { return type == JointType::spherical || type == JointType::free; }

// The frame whose z is the given axis: a cyclic exchange of axes.
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

void read_list(Section& section, const std::string& key, std::size_t count, std::vector<double>& values) {
  values.assign(count, 0.0);
  std::vector<double> given;
  if (!section.numbers(key, given)) return;
  if (given.size() == count)
    values = given;
  else
    section.error(
        key, key + " must be " + std::to_string(count) + " numbers, got " + std::to_string(given.size()));
}

// q of a ball: a quaternion (4) or the angles phi, theta, psi (3), after the translations.
void read_ball_start(LinkDraft& draft, std::size_t translations, double unit) {
  Section& section = draft.section;
  draft.q.assign(translations + 4, 0.0);
  draft.q[translations] = 1;
  std::vector<double> given;
  if (!section.numbers("q", given)) return;
  if (given.size() == translations + 3) {
    const double* angles = &given[translations];
    const auto quaternion = quaternion_of(unit * angles[0], unit * angles[1], unit * angles[2]);
    given.resize(translations);
    given.insert(given.end(), quaternion.begin(), quaternion.end());
  }
  if (given.size() != translations + 4) {
    section.error("q", "q must be " + std::to_string(translations + 3) +
                           " numbers (angles about z, x, y) or " + std::to_string(translations + 4) +
                           " (quaternion w, x, y, z), got " + std::to_string(given.size()));
    return;
  }
  double norm = 0;
  for (std::size_t k = translations; k < given.size(); ++k) norm += given[k] * given[k];
  if (!(std::abs(norm - 1) < 1e-3)) {
    section.error("q", "the quaternion in q must have length 1, got " + shown(std::sqrt(norm)));
    return;
  }
  for (std::size_t k = translations; k < given.size(); ++k) given[k] /= std::sqrt(norm);
  draft.q = given;
}

// A massless link that carries one freedom.
LinkDraft carrier(const LinkDraft& of, const Freedom& freedom, const Pose& frame, int parent,
                  const std::string& index) {
  LinkDraft draft{of.link, {}, of.section, {}, {}, {}, {}, {}, {}};
  draft.link.name += index;
  draft.link.parent = parent;
  draft.link.mass = 0;
  draft.link.com.setZero();
  draft.link.inertia = {};
  draft.link.joint.name += index;
  draft.link.joint.type = freedom.type;
  draft.link.joint.dh = dh_of(frame);
  return draft;
}

}  // namespace

bool is_compound(JointType type) { return !freedoms_of(type).empty(); }

void read_compound(LinkDraft& draft, bool degrees) {
  Section& section = draft.section;
  const JointType type = draft.link.joint.type;
  const double unit = degrees ? pi / 180 : 1;
  if (has_ball(type)) {
    const std::size_t translations = type == JointType::free ? 3 : 0;
    read_ball_start(draft, translations, unit);
    read_list(section, "qd", translations + 3, draft.qd);
    for (std::size_t k = translations; k < draft.qd.size(); ++k) draft.qd[k] *= unit;
    const Drive drive = draft.link.joint.drive;
    if (drive == Drive::motion || drive == Drive::locked)
      section.error("drive", "a " + section.text("joint") + " joint takes drive 'torque' or 'free'");
    return;
  }
  const std::vector<Freedom> freedoms = freedoms_of(type);
  read_list(section, "q", freedoms.size(), draft.q);
  read_list(section, "qd", freedoms.size(), draft.qd);
  read_list(section, "damping", freedoms.size(), draft.damping);
  read_list(section, "stiffness", freedoms.size(), draft.stiffness);
  read_list(section, "rest", freedoms.size(), draft.rest);
  read_list(section, "armature", freedoms.size(), draft.armature);
  for (const char* key : {"damping", "stiffness", "armature"})
    for (double value : std::string(key) == "damping"     ? draft.damping
                        : std::string(key) == "stiffness" ? draft.stiffness
                                                          : draft.armature)
      if (value < 0) section.error(key, std::string(key) + " must be >= 0, got " + shown(value));
  for (std::size_t k = 0; k < freedoms.size(); ++k)
    if (freedoms[k].type == JointType::revolute)
      for (double* angle : {&draft.q[k], &draft.qd[k], &draft.rest[k]}) *angle *= unit;
}

std::vector<Ball> expand_compound_joints(std::vector<LinkDraft>& drafts) {
  std::vector<Ball> balls;
  std::vector<LinkDraft> expanded;
  std::vector<int> place(drafts.size());  // new index of a link
  for (std::size_t i = 0; i < drafts.size(); ++i) {
    LinkDraft& draft = drafts[i];
    int parent = draft.link.parent == ground ? ground : place[draft.link.parent];
    const JointType type = draft.link.joint.type;
    const std::vector<Freedom> freedoms = freedoms_of(type);
    Pose frame = pose_of(draft.link.joint.dh);  // of the next carrier in the one before
    const std::size_t ball_at = has_ball(type) ? freedoms.size() - 4 : freedoms.size();
    for (std::size_t k = 0; k < freedoms.size(); ++k) {
      const bool of_ball = k >= ball_at;
      const std::string index = !of_ball       ? "[" + std::to_string(k + 1) + "]"
                                : k == ball_at ? "[chart]"
                                               : std::string("[") + "zxy"[k - ball_at - 1] + "]";
      expanded.push_back(carrier(draft, freedoms[k], frame * z_along(freedoms[k].axis), parent, index));
      parent = static_cast<int>(expanded.size()) - 1;
      frame = inverse(z_along(freedoms[k].axis));
      Joint& joint = expanded.back().link.joint;
      if (of_ball) {
        joint.drive = k == ball_at ? Drive::locked : Drive::free;
        continue;
      }
      joint.q0 = draft.q[k];
      joint.qd0 = draft.qd[k];
      if (has_ball(type)) continue;
      joint.damping = draft.damping[k];
      joint.stiffness = draft.stiffness[k];
      joint.rest = draft.rest[k];
      joint.armature = draft.armature[k];
    }
    if (has_ball(type)) {
      Ball ball;
      ball.name = draft.link.joint.name;
      ball.chart_link = parent - 3;
      ball.driven = draft.link.joint.drive == Drive::torque;
      std::copy_n(draft.q.begin() + static_cast<std::ptrdiff_t>(ball_at), 4, ball.quaternion.begin());
      std::copy_n(draft.qd.begin() + static_cast<std::ptrdiff_t>(ball_at), 3, ball.omega.begin());
      balls.push_back(ball);
    }
    if (!freedoms.empty()) {
      draft.link.joint.type = JointType::fixed;
      draft.link.joint.dh = dh_of(frame);
    }
    draft.link.parent = parent;
    place[i] = static_cast<int>(expanded.size());
    expanded.push_back(std::move(draft));
  }
  drafts.swap(expanded);
  return balls;
}

}  // namespace redysim
