#include "model/read/trajectory_reader.hpp"

#include <cmath>

#include "math/angles.hpp"
#include "model/read/joint_index.hpp"
#include "model/read/motion_table.hpp"

namespace redysim {
namespace {

enum class Shape { cycloid, quintic, cubic, speed, polynomial, table };

// Reads a motion between two positions, at rest or with given velocities at both ends.
void read_move(Section& section, Shape shape, double unit, const Joint& joint, Trajectory& trajectory) {
  section.require("to");
  section.require("duration");
  const double length = section.number("duration", 1, Bound::positive);
  trajectory.begin = section.number("start", 0);
  trajectory.end = trajectory.begin + length;
  trajectory.from = section.has("from") ? unit * section.number("from", 0) : joint.q0;
  trajectory.to = unit * section.number("to", 0);
  if (shape == Shape::cycloid) {
    trajectory.kind = Trajectory::Kind::cycloid;
    return;
  }
  const double speed_from = unit * section.number("speed_from", 0),
               speed_to = unit * section.number("speed_to", 0);
  const double start[] = {trajectory.from, speed_from, 0}, end[] = {trajectory.to, speed_to, 0};
  trajectory.pieces = {{trajectory.begin, shape == Shape::quintic
                                              ? quintic(length, start, end)
                                              : cubic(length, start[0], speed_from, end[0], speed_to)}};
}

void read_speed(Section& section, double unit, const Joint& joint, Trajectory& trajectory) {
  section.require("speed");
  const double from = section.has("from") ? unit * section.number("from", 0) : joint.q0;
  trajectory.pieces = {{section.number("start", 0), {from, unit * section.number("speed", 0)}}};
}

void read_polynomial(Section& section, double unit, Trajectory& trajectory) {
  std::vector<double> coefficients;
  section.require("coefficients");
  if (section.numbers("coefficients", coefficients) && coefficients.empty())
    section.error("coefficients", "coefficients must contain at least one number");
  for (double& coefficient : coefficients) coefficient *= unit;
  const double start = section.number("start", 0);
  trajectory.pieces = {{start, coefficients}};
  if (!section.has("duration")) return;
  trajectory.begin = start;
  trajectory.end = start + section.number("duration", 1, Bound::positive);
}

// Reads the table from a file in the folder of the model file. Returns false after reporting an error.
bool attach_table(Section& section, const std::string& folder, const std::string& joint,
                  std::vector<AttachedFile>& files, MotionTable& table) {
  const AttachedFile* file = attach(section, folder, files);
  if (!file) return false;
  const std::string why = read_csv(file->bytes, joint, table);
  if (!why.empty()) section.error("file", "file '" + file->name + "' " + why);
  return why.empty();
}

// Reads the table from lists in the model file. Returns false after reporting an error.
bool read_columns(Section& section, MotionTable& table) {
  bool good = true;
  for (const char* key : {"time", "q"})
    if (!section.has(key)) {
      section.error(key, std::string(key) + " or file is required");
      good = false;
    }
  const std::pair<const char*, std::vector<double>*> columns[] = {
      {"time", &table.time}, {"q", &table.q}, {"qd", &table.qd}, {"qdd", &table.qdd}};
  for (const auto& [key, column] : columns)
    if (section.has(key)) good = section.numbers(key, *column) && good;
  return good;
}

void read_table(Section& section, double unit, const Joint& joint, const std::string& folder,
                std::vector<AttachedFile>& files, Trajectory& trajectory) {
  MotionTable table;
  bool good = true;
  if (section.has("file")) {
    for (const char* key : {"time", "q", "qd", "qdd"})
      if (section.has(key)) section.error(key, std::string(key) + " and file must not both be given");
    good = attach_table(section, folder, joint.name, files, table);
  } else {
    good = read_columns(section, table);
  }
  if (!good) return;
  const std::string why = objection(table);
  if (!why.empty()) {
    const std::string key = section.has("file") ? "file" : "time";
    section.error(key, section.has("file") ? "file '" + section.text("file") + "': " + why : why);
    return;
  }
  for (std::vector<double>* column : {&table.q, &table.qd, &table.qdd})
    for (double& value : *column) value *= unit;
  interpolate(table, trajectory);
}

// Whether position, velocity and acceleration are finite: those of very short motions overflow.
bool is_finite(const Trajectory& trajectory) {
  const double length = trajectory.end - trajectory.begin;
  double sum = trajectory.kind == Trajectory::Kind::cycloid
                   ? (trajectory.to - trajectory.from) / length / length
                   : trajectory.from;
  for (const Trajectory::Piece& piece : trajectory.pieces)
    for (double coefficient : piece.coefficients) sum += 0 * coefficient;
  return length > 0 && std::isfinite(sum);
}

Trajectory read_trajectory(Section section, const Model& model, const JointIndex& joints, bool degrees,
                           const std::string& folder, std::vector<AttachedFile>& files) {
  Trajectory trajectory;
  const std::size_t errors_before = section.error_count();
  section.require("joint");
  const std::string name = section.text("joint");
  trajectory.link = name.empty() ? -1 : joints.find(name, "joint", section.place("joint"), section);
  section.require("type");
  const auto shape = section.choice<Shape>("type",
                                           {{"cycloid", Shape::cycloid},
                                            {"quintic", Shape::quintic},
                                            {"cubic", Shape::cubic},
                                            {"speed", Shape::speed},
                                            {"polynomial", Shape::polynomial},
                                            {"table", Shape::table}},
                                           Shape::cycloid);
  if (section.error_count() > errors_before) return trajectory;  // the other fields depend on joint and type
  const Joint& joint = model.links[trajectory.link].joint;
  const double unit = degrees && turns(joint) ? degree : 1;
  if (shape == Shape::speed)
    read_speed(section, unit, joint, trajectory);
  else if (shape == Shape::polynomial)
    read_polynomial(section, unit, trajectory);
  else if (shape == Shape::table)
    read_table(section, unit, joint, folder, files, trajectory);
  else
    read_move(section, shape, unit, joint, trajectory);
  if (section.error_count() == errors_before && !is_finite(trajectory))
    section.error(shape == Shape::table ? "time" : "duration",
                  "the trajectory is too short: its velocities and accelerations are not finite");
  section.refuse_unknown();
  return trajectory;
}

}  // namespace

std::vector<Trajectory> read_trajectories(Section& top, const Model& model, bool degrees,
                                          const std::string& folder, std::vector<AttachedFile>& files,
                                          Findings& findings) {
  std::vector<Trajectory> trajectories;
  const std::vector<const Value*> tables = top.tables("trajectory");
  if (tables.empty()) return trajectories;
  const JointIndex joints(model);
  std::size_t ordinal = 0;
  for (const Value* table : tables) {
    const std::string label = "trajectory " + std::to_string(++ordinal);
    Section section(*table, label, findings);
    Trajectory trajectory = read_trajectory(section, model, joints, degrees, folder, files);
    if (trajectory.link < 0) continue;
    const std::string& joint = model.links[trajectory.link].joint.name;
    if (has_part_of(trajectories, trajectory.link))
      section.error("joint", "joint '" + joint + "' already has a trajectory");
    else
      trajectories.push_back(std::move(trajectory));
  }
  return trajectories;
}

}  // namespace redysim
