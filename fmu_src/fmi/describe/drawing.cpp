#include "fmi/describe/drawing.hpp"

#include <algorithm>
#include <cmath>
#include <iterator>
#include <vector>

#include "model/start_poses.hpp"

namespace redysim {
namespace {

void write(Json& json, const Vec3<double>& v) {
  json.begin_array();
  for (int i = 0; i < 3; ++i) json.value(v[i]);
  json.end_array();
}

// The links as in the model file: a spherical joint moves the last of its internal links.
struct Shown {
  std::vector<int> number;           // index of each link in the drawing, or -1
  std::vector<const Ball*> ball_of;  // the spherical joint of a link, or null

  explicit Shown(const Model& model) : number(model.links.size(), 0), ball_of(model.links.size(), nullptr) {
    for (const Ball& ball : model.balls) {
      for (int link = ball.chart_link; link < turned_link(ball); ++link) number[link] = -1;
      ball_of[turned_link(ball)] = &ball;
    }
    int count = 0;
    for (int& n : number)
      if (n == 0) n = count++;
  }
  int parent(const Model& model, int link) const {
    const int carrier = model.links[ball_of[link] ? ball_of[link]->chart_link : link].parent;
    return carrier == ground ? ground : number[carrier];
  }
};

const char* word_of(JointType type) {
  const auto same = [type](const auto& entry) { return entry.second == type; };
  return std::find_if(std::begin(joint_types), std::end(joint_types), same)->first;
}

// Writes rotations given by quaternions: the rotating link, its reference link and the initial rotation.
void write_balls(Json& json, const Model& model, const Shown& shown) {
  json.key("balls").begin_array();
  for (const Ball& ball : model.balls) {
    json.begin_object().member("name", ball.name).member("link", shown.number[turned_link(ball)]);
    json.member("base", shown.parent(model, turned_link(ball))).key("quaternion").begin_array();
    for (const double x : ball.quaternion) json.value(x);
    json.end_array().end_object();
  }
  json.end_array();
}

// Writes loops, springs or bushings: two points, each on a link or on ground.
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

void write(Json& json, const char* key, const Mat3<double>& rotation) {
  json.key(key).begin_array();
  for (int row = 0; row < 3; ++row) write(json, rotation.row(row).transpose());
  json.end_array();
}

// Writes the couplings with the drawing's link indices.
void write_couplings(Json& json, const Model& model, const Shown& shown) {
  json.key("couplings").begin_array();
  for (const Coupling& coupling : model.couplings) {
    json.begin_object().member("name", coupling.name).key("links").begin_array();
    for (const int link : coupling.links) json.value(shown.number[link]);
    json.end_array().end_object();
  }
  json.end_array();
}

constexpr int most_grid_lines = 60;  // maximum, of a height map

// Writes every step-th height; `grid` is their spacing.
void write_heights(Json& json, const BicubicSpline& map) {
  const int step = 1 + (std::max(map.rows(), map.columns()) - 1) / most_grid_lines;
  json.member("grid", step * map.spacing()).key("heights").begin_array();
  for (int row = 0; row < map.rows(); row += step) {
    json.begin_array();
    for (int column = 0; column < map.columns(); column += step) json.value(map.height(row, column));
    json.end_array();
  }
  json.end_array();
}

// Writes a shape: its frame at the start, and its dimensions.
void write_shape(Json& json, const char* side, const Shape& shape, const Model& model,
                 const std::vector<Pose>& poses) {
  const bool on_ground = shape.link == ground;
  const Pose carrier = on_ground ? Pose{} : poses[shape.link];
  json.key(side).begin_object().member("kind", word_of(shape.kind));
  json.member("link", on_ground ? "ground" : model.links[shape.link].name.c_str());
  write(json.key("origin"), carrier.rotation * shape.frame.position + carrier.position);
  write(json, "rotation", carrier.rotation * shape.frame.rotation);
  if (shape.radius > 0) json.member("radius", shape.radius);
  if (shape.kind == ShapeKind::capsule) json.member("half_length", shape.half_length);
  if (shape.kind == ShapeKind::disk) json.member("tube", shape.tube);
  if (shape.kind == ShapeKind::box) write(json.key("half_size"), shape.half_size);
  if (shape.kind == ShapeKind::points) {
    json.key("points").begin_array();
    for (const Vec3<double>& point : shape.points) write(json, point);
    json.end_array();
  }
  if (shape.kind == ShapeKind::heightmap) write_heights(json, *shape.heights);
  json.end_object();
}

void write_contacts(Json& json, const Model& model, const std::vector<Pose>& poses) {
  json.key("contacts").begin_array();
  for (const Contact& contact : model.contacts) {
    json.begin_object().member("name", contact.name);
    write_shape(json, "a", contact.a, model, poses);
    write_shape(json, "b", contact.b, model, poses);
    json.end_object();
  }
  json.end_array();
}

void write_shapes(Json& json, const std::vector<DrawnShape>& shapes, const Shown& shown,
                  const std::vector<Pose>& poses) {
  const auto write_list = [&](const char* key, const std::vector<double>& list) {
    json.key(key).begin_array();
    for (const double x : list) json.value(x);
    json.end_array();
  };
  json.key("shapes").begin_array();
  for (const DrawnShape& shape : shapes) {
    const Pose carrier = shape.link == ground ? Pose{} : poses[shape.link];
    json.begin_object().member("kind", shape.kind);
    json.member("link", shape.link == ground ? ground : shown.number[shape.link]);
    write(json.key("origin"), carrier.rotation * shape.position + carrier.position);
    write(json, "rotation", carrier.rotation * shape.rotation);
    write_list("size", shape.size);
    if (!shape.color.empty()) write_list("color", shape.color);
    if (!shape.file.empty()) json.member("file", shape.file);
    json.end_object();
  }
  json.end_array();
}

}  // namespace

void write_drawing(Json& json, const Model& model, const std::vector<DrawnShape>& shapes) {
  const std::vector<Pose> poses = start_poses(model);
  const Shown shown(model);
  json.begin_object();
  write(json.key("gravity"), model.gravity);
  json.key("links").begin_array();
  for (std::size_t i = 0; i < poses.size(); ++i) {
    if (shown.number[i] < 0) continue;
    const Link& link = model.links[i];
    const Ball* ball = shown.ball_of[i];
    const Pose& pose = poses[i];
    json.begin_object().member("name", link.name).member("parent", shown.parent(model, static_cast<int>(i)));
    json.member("type", ball ? "spherical" : word_of(link.joint.type));
    json.member("joint", ball ? ball->name : link.joint.name).member("q", link.joint.q0);
    // rotation (rad) about and displacement (m) along z per unit of q
    const MotionSubspace S = motion_subspace(link.joint);
    json.member("turn", S.angular).member("slide", S.linear);
    if (std::isfinite(link.joint.lower)) json.member("lower", link.joint.lower);
    if (std::isfinite(link.joint.upper)) json.member("upper", link.joint.upper);
    write(json.key("origin"), pose.position);
    write(json, "rotation", pose.rotation);
    write(json.key("com"), pose.rotation * link.com + pose.position);
    json.member("mass", link.mass).end_object();
  }
  json.end_array();
  write_balls(json, model, shown);
  write_ties(json, "loops", model.loops, model, poses);
  write_ties(json, "springs", model.springs, model, poses);
  if (!model.couplings.empty()) write_couplings(json, model, shown);
  if (!model.bushings.empty()) write_ties(json, "bushings", model.bushings, model, poses);
  if (!model.contacts.empty()) write_contacts(json, model, poses);
  if (!shapes.empty()) write_shapes(json, shapes, shown, poses);
  json.end_object();
}

}  // namespace redysim
