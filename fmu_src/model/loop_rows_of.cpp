#include "model/loop_rows_of.hpp"

#include <cmath>

#include "model/start_poses.hpp"

namespace redysim {

namespace {

constexpr double parallel = 1e-12;  // two axes count as parallel if the sine between them is smaller

// Whether every joint from `link` up to (not including) `stop` moves in planes normal to `normal`.
bool moves_in_plane(const Model& model, const std::vector<Pose>& poses, int link, int stop,
                    const Vec3<double>& normal) {
  for (; link != stop; link = model.links[link].parent) {
    const Vec3<double> axis = poses[link].rotation.col(2);
    const Joint& joint = model.links[link].joint;
    if (turns(joint) && axis.cross(normal).norm() > parallel) return false;
    if (slides(joint) && std::abs(axis.dot(normal)) > parallel) return false;
  }
  return true;
}

// Whether `link` can rotate about `normal` only.
bool turns_about(const Model& model, const std::vector<Pose>& poses, int link, const Vec3<double>& normal) {
  for (; link != ground; link = model.links[link].parent)
    if (turns(model.links[link].joint) && poses[link].rotation.col(2).cross(normal).norm() > parallel)
      return false;
  return true;
}

int meeting_link(const Model& model, int a, int b) {
  while (a != b) (a > b ? a : b) = model.links[a > b ? a : b].parent;
  return a;
}

LoopRow position_row(int index, const Vec3<double>& u) {
  LoopRow row;
  row.index = index;
  row.u = u;
  return row;
}

LoopRow rotation_row(int index, const Vec3<double>& u, const Vec3<double>& v) {
  LoopRow row;
  row.index = index;
  row.rotation = true;
  row.u = u;
  row.v = v;
  return row;
}

LoopRows point_rows(const Model& model, const std::vector<Pose>& poses, const Loop& loop) {
  LoopRows out;
  for (const Vec3<double>& direction : loop.directions) {
    out.rows.push_back(position_row(static_cast<int>(out.rows.size()), direction));
    out.rows.back().on_ground = true;
  }
  // three directions fix the point in space; two fix it in a plane, which a planar mechanism does not tilt
  const int meeting = meeting_link(model, loop.link_a, loop.link_b);
  if (meeting == ground || loop.directions.size() == 3) return out;
  const bool plane_kept =
      loop.directions.size() == 2 &&
      turns_about(model, poses, meeting, loop.directions[0].cross(loop.directions[1]).normalized());
  out.tied_to_ground = !plane_kept;
  return out;
}

// Right-handed frame with z along `axis` and x in the plane of `axis` and `x`.
Mat3<double> joint_frame(const Vec3<double>& axis, const Vec3<double>& x) {
  Mat3<double> frame;
  frame.col(2) = axis.normalized();
  frame.col(0) = (x - frame.col(2) * frame.col(2).dot(x)).normalized();
  frame.col(1) = frame.col(2).cross(frame.col(0));
  return frame;
}

// Returns x, or any vector perpendicular to the axis if x is parallel to it.
Vec3<double> across(const Vec3<double>& axis, const Vec3<double>& x) {
  return axis.cross(x).norm() > 1e-6 ? x : Vec3<double>(axis.unitOrthogonal());
}

LoopRows rows_of(const Model& model, const std::vector<Pose>& poses, const Loop& loop) {
  if (loop.type == LoopType::point) return point_rows(model, poses, loop);
  const Mat3<double> frame_a = joint_frame(loop.axis_a, across(loop.axis_a, loop.x_a));
  const Mat3<double> frame_b = joint_frame(loop.axis_b, across(loop.axis_b, loop.x_b));
  const Vec3<double> axis_b = frame_b.col(2);
  const bool slides = loop.type == LoopType::prismatic || loop.type == LoopType::cylindrical;
  LoopRows out;
  for (int k = 0; k < (slides ? 2 : 3); ++k) out.rows.push_back(position_row(k, frame_a.col(k)));
  const int next = static_cast<int>(out.rows.size());
  if (loop.type == LoopType::universal) out.rows.push_back(rotation_row(next, frame_a.col(2), axis_b));
  if (loop.type == LoopType::spherical || loop.type == LoopType::universal) return out;
  if (loop.type == LoopType::revolute) {
    const int meeting = meeting_link(model, loop.link_a, loop.link_b);
    const Vec3<double> normal = loop.link_a == ground
                                    ? Vec3<double>(frame_a.col(2))
                                    : Vec3<double>(poses[loop.link_a].rotation * frame_a.col(2));
    if (moves_in_plane(model, poses, loop.link_a, meeting, normal) &&
        moves_in_plane(model, poses, loop.link_b, meeting, normal)) {
      out.left_out = {out.rows.back(), rotation_row(next, frame_a.col(0), axis_b),
                      rotation_row(next + 1, frame_a.col(1), axis_b)};
      out.rows.pop_back();
      return out;
    }
  }
  out.rows.push_back(rotation_row(next, frame_a.col(0), axis_b));
  out.rows.push_back(rotation_row(next + 1, frame_a.col(1), axis_b));
  if (loop.type == LoopType::prismatic || loop.type == LoopType::fixed)
    out.rows.push_back(rotation_row(next + 2, frame_a.col(0), frame_b.col(1)));
  return out;
}

}  // namespace

int multiplier_count(const Loop& loop) {
  switch (loop.type) {
    case LoopType::point:
      return static_cast<int>(loop.directions.size());
    case LoopType::spherical:
      return 3;
    case LoopType::universal:
    case LoopType::cylindrical:
      return 4;
    case LoopType::revolute:
    case LoopType::prismatic:
      return 5;
    case LoopType::fixed:
      return 6;
  }
  return 0;
}

std::vector<LoopRows> loop_rows_of(const Model& model) {
  std::vector<LoopRows> rows;
  if (model.loops.empty()) return rows;
  const std::vector<Pose> poses = start_poses(model);
  for (const Loop& loop : model.loops) rows.push_back(rows_of(model, poses, loop));
  return rows;
}

}  // namespace redysim
