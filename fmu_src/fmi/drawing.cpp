#include "fmi/drawing.hpp"

#include <vector>

#include "model/dh.hpp"

namespace redysim {
namespace {

void write(Json& json, const Vec3<double>& v) {
  json.begin_array();
  for (int i = 0; i < 3; ++i) json.value(v[i]);
  json.end_array();
}

// Ground to link frame of each link at q = q0.
std::vector<Pose> start_poses(const Model& model) {
  std::vector<Pose> poses;
  for (const Link& link : model.links) {
    DhParameters dh = link.joint.dh;
    if (link.joint.type == JointType::revolute) dh.theta += link.joint.q0;
    if (link.joint.type == JointType::prismatic) dh.d += link.joint.q0;
    poses.push_back(link.parent == ground ? pose_of(dh) : poses[link.parent] * pose_of(dh));
  }
  return poses;
}

const char* type_name(JointType type) {
  return type == JointType::revolute ? "revolute" : type == JointType::prismatic ? "prismatic" : "fixed";
}

// A loop or a spring: two points, each on a link or on ground.
template <class Tie>
void write_ties(Json& json, const char* key, const std::vector<Tie>& ties, const Model& model,
                const std::vector<Pose>& poses) {
  const auto name = [&](int link) { return link == ground ? std::string("ground") : model.links[link].name; };
  const auto place = [&](int link, const Vec3<double>& point) -> Vec3<double> {
    return link == ground ? point : Vec3<double>(poses[link].rotation * point + poses[link].position);
  };
  json.key(key).begin_array();
  for (const Tie& tie : ties) {
    json.begin_object().member("name", tie.name);
    json.member("link_a", name(tie.link_a)).member("link_b", name(tie.link_b));
    write(json.key("point_a"), place(tie.link_a, tie.point_a));
    write(json.key("point_b"), place(tie.link_b, tie.point_b));
    json.end_object();
  }
  json.end_array();
}

}  // namespace

void write_drawing(Json& json, const Model& model) {
  const std::vector<Pose> poses = start_poses(model);
  json.begin_object().key("links").begin_array();
  for (std::size_t i = 0; i < poses.size(); ++i) {
    const Link& link = model.links[i];
    const Pose& pose = poses[i];
    json.begin_object().member("name", link.name).member("parent", link.parent);
    json.member("type", type_name(link.joint.type));
    write(json.key("origin"), pose.position);
    json.key("rotation").begin_array();
    for (int row = 0; row < 3; ++row) write(json, pose.rotation.row(row).transpose());
    json.end_array();
    write(json.key("com"), pose.rotation * link.com + pose.position);
    json.member("mass", link.mass).end_object();
  }
  json.end_array();
  write_ties(json, "loops", model.loops, model, poses);
  write_ties(json, "springs", model.springs, model, poses);
  json.end_object();
}

}  // namespace redysim
