#include "model/read/loop_reader.hpp"

#include <Eigen/QR>
#include <cmath>

namespace redysim {
namespace {

// Reads both ends of a loop, spring or bushing. Returns false if a link is unknown.
template <class Connection>
bool read_ends(Connection& connection, Section& section, const LinkTable& links) {
  const std::size_t errors_before = section.error_count();
  const auto end = [&](const char* key) {
    if (!section.has(key))
      section.error(key, std::string(key) + " is required (a link's name or \"ground\")");
    const std::string name = section.text(key, "ground");
    return links.index.find(name, key, section, ground);
  };
  connection.link_a = end("link_a");
  connection.link_b = end("link_b");
  const bool known = section.error_count() == errors_before;
  connection.point_a = section.vector("point_a", connection.point_a);
  connection.point_b = section.vector("point_b", connection.point_b);
  return known;
}

bool uses_axis(LoopType type) { return type != LoopType::point && type != LoopType::spherical; }
bool uses_x(LoopType type) { return type == LoopType::prismatic || type == LoopType::fixed; }

void warn_unused(Section& section, LoopType type) {
  const auto warn = [&](const char* key) { section.warn_idle(key, "on this type of loop"); };
  if (!uses_axis(type)) {
    warn("axis_a");
    warn("axis_b");
  }
  if (!uses_x(type)) {
    warn("x_a");
    warn("x_b");
  }
}

// Makes x perpendicular to the axis. If x is parallel to it: an error if x is used, else any direction.
void square_up(Vec3<double>& x, const Vec3<double>& axis, const std::string& side, bool used,
               Section& section) {
  const Vec3<double> rest = x - axis.dot(x) * axis;
  if (rest.norm() > 1e-6)
    x = rest.normalized();
  else if (used)
    section.error("x_" + side, "x_" + side + " must not be parallel to axis_" + side);
  else
    x = axis.unitOrthogonal();
}

void read_directions(Loop& loop, Section& section) {
  const bool good = section.directions("directions", loop.directions);
  if (loop.type != LoopType::point) {
    if (section.has("directions"))
      section.error("directions", "directions belong to loops of type 'point' only");
    return;
  }
  if (!section.has("directions"))
    section.error("directions", "directions is required for type 'point', such as [[1, 0, 0], [0, 1, 0]]");
  if (!good) return;
  const Eigen::Index count = static_cast<Eigen::Index>(loop.directions.size());
  if (count < 1 || count > 3) {
    section.error("directions", "directions must be 1 to 3, got " + std::to_string(count));
    return;
  }
  Eigen::Matrix<double, 3, Eigen::Dynamic, 0, 3, 3> columns(3, count);
  for (Eigen::Index i = 0; i < count; ++i) columns.col(i) = loop.directions[static_cast<std::size_t>(i)];
  Eigen::ColPivHouseholderQR<decltype(columns)> qr(columns);
  qr.setThreshold(1e-6);
  if (qr.rank() < count) section.error("directions", "directions must be linearly independent");
}

Loop read_loop(Section section, const std::string& label, const LinkTable& links, Names& names) {
  Loop loop;
  loop.name = names.take(section, label);
  section.require("type");
  loop.type = section.choice<LoopType>("type",
                                       {{"point", LoopType::point},
                                        {"spherical", LoopType::spherical},
                                        {"revolute", LoopType::revolute},
                                        {"prismatic", LoopType::prismatic},
                                        {"cylindrical", LoopType::cylindrical},
                                        {"universal", LoopType::universal},
                                        {"fixed", LoopType::fixed}},
                                       LoopType::spherical);
  loop.line = section.place().line;
  loop.column = section.place().column;
  const bool known = read_ends(loop, section, links);
  loop.axis_a = section.direction("axis_a", loop.axis_a);
  loop.axis_b = section.direction("axis_b", loop.axis_b);
  loop.x_a = section.direction("x_a", loop.x_a);
  loop.x_b = section.direction("x_b", loop.x_b);
  square_up(loop.x_a, loop.axis_a, "a", uses_x(loop.type), section);
  square_up(loop.x_b, loop.axis_b, "b", uses_x(loop.type), section);
  warn_unused(section, loop.type);
  read_directions(loop, section);
  section.refuse_unknown();
  const std::string rigid = rigid_pair(loop.link_a, loop.link_b, links);
  if (known && !rigid.empty()) section.error("link_b", rigid + "; this loop has no effect");
  return loop;
}

SpringDamper read_spring(Section section, const std::string& label, const LinkTable& links, Names& names) {
  SpringDamper spring;
  spring.name = names.take(section, label);
  const bool known = read_ends(spring, section, links);
  spring.stiffness = section.number("stiffness", 0, Bound::not_negative);
  spring.damping = section.number("damping", 0, Bound::not_negative);
  spring.rest_length = section.number("rest_length", 0, Bound::not_negative);
  section.refuse_unknown();
  const std::string rigid = rigid_pair(spring.link_a, spring.link_b, links);
  if (known && !rigid.empty()) section.warn("link_b", rigid + "; this spring has no effect");
  return spring;
}

// Reads six numbers: along x, y, z and about x, y, z.
void read_six(Section& section, const char* key, Vec3<double>& along, Vec3<double>& about) {
  std::vector<double> given;
  if (!section.numbers(key, given)) return;
  if (given.size() != 6) {
    section.error(key, std::string(key) + " must be 6 numbers (x, y, z, rx, ry, rz), got " +
                           std::to_string(given.size()));
    return;
  }
  for (double number : given)
    if (!section.within(key, number, Bound::not_negative)) return;
  along = {given[0], given[1], given[2]};
  about = {given[3], given[4], given[5]};
}

Bushing read_bushing(Section section, const std::string& label, const LinkTable& links, bool degrees,
                     Names& names) {
  Bushing bushing;
  bushing.name = names.take(section, label);
  const bool known = read_ends(bushing, section, links);
  bushing.rotation_a = section.rotation("rpy_a", degrees);
  bushing.rotation_b = section.rotation("rpy_b", degrees);
  if (!section.has("stiffness") && !section.has("damping"))
    section.error("stiffness", "stiffness or damping is required");
  read_six(section, "stiffness", bushing.stiffness, bushing.turning_stiffness);
  read_six(section, "damping", bushing.damping, bushing.turning_damping);
  section.refuse_unknown();
  const std::string rigid = rigid_pair(bushing.link_a, bushing.link_b, links);
  if (known && !rigid.empty()) section.warn("link_b", rigid + "; this bushing has no effect");
  return bushing;
}

template <class Connection, class Read>
std::vector<Connection> read_all(const char* key, Read read, Section& top, const LinkTable& links,
                                 Names& names, Findings& findings) {
  std::vector<Connection> connections;
  for (const Value* table : top.tables(key)) {
    const std::string label = label_of(key, connections.size() + 1, *table);
    connections.push_back(read(Section(*table, label, findings), label, links, names));
  }
  return connections;
}

}  // namespace

std::vector<Loop> read_loops(Section& top, const LinkTable& links, Names& names, Findings& findings) {
  return read_all<Loop>("loop", read_loop, top, links, names, findings);
}

std::vector<SpringDamper> read_springs(Section& top, const LinkTable& links, Names& names,
                                       Findings& findings) {
  return read_all<SpringDamper>("spring", read_spring, top, links, names, findings);
}

std::vector<Bushing> read_bushings(Section& top, const LinkTable& links, bool degrees, Names& names,
                                   Findings& findings) {
  const auto read = [degrees](const Section& section, const std::string& label, const LinkTable& to,
                              Names& taken) { return read_bushing(section, label, to, degrees, taken); };
  return read_all<Bushing>("bushing", read, top, links, names, findings);
}

}  // namespace redysim
