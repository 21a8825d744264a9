#include "model/read/contact_reader.hpp"

#include <algorithm>
#include <utility>

#include "model/model.hpp"
#include "model/read/csv.hpp"

namespace redysim {
namespace {

// Reads heights in m, one grid row per line. Returns the error, or an empty string.
std::string read_heights(const std::string& text, double spacing, std::shared_ptr<const BicubicSpline>& to) {
  std::vector<double> heights;
  std::size_t rows = 0, columns = 0, line_number = 0;
  for (std::size_t at = 0; at < text.size();) {
    const std::size_t end = std::min(text.find('\n', at), text.size());
    const std::string line = text.substr(at, end - at);
    at = end + 1;
    ++line_number;
    if (line.find_first_not_of(" \t\r") == line.npos || line[line.find_first_not_of(" \t")] == '#') continue;
    const std::vector<std::string> cells = csv_cells(line);
    const std::string where = "line " + std::to_string(line_number);
    if (rows == 0) columns = cells.size();
    if (cells.size() != columns)
      return where + " has " + std::to_string(cells.size()) + " heights, the first row has " +
             std::to_string(columns);
    for (std::size_t k = 0; k < cells.size(); ++k) {
      double height = 0;
      if (!csv_number(cells[k], height) || !std::isfinite(height))
        return where + ", column " + std::to_string(k + 1) + ": '" + cells[k] +
               "' is not a finite number; a height map needs a height at each grid point";
      heights.push_back(height);
    }
    ++rows;
  }
  if (rows < 2 || columns < 2)
    return "must have at least 2 rows and 2 columns of heights, got " + std::to_string(rows) + " x " +
           std::to_string(columns);
  to = std::make_shared<BicubicSpline>(static_cast<int>(rows), static_cast<int>(columns), spacing,
                                       std::move(heights));
  return {};
}

// The shortest rotation of the z axis to `z`, so that a horizontal plane keeps the axes of its link. If z
// points down, the rotation is that of -z, with the z and y axes reversed.
Mat3<double> frame_along(const Vec3<double>& z) {
  const bool below = z.z() < 0;
  const Vec3<double> up = below ? Vec3<double>(-z) : z;
  const double x = up.x(), y = up.y(), part = 1 / (1 + up.z());
  Mat3<double> frame;
  frame << 1 - x * x * part, -x * y * part, x, -x * y * part, 1 - y * y * part, y, -x, -y, up.z();
  if (below) frame.rightCols<2>() *= -1;
  return frame;
}

// Reads the fields of one shape, whose names end in `side`, "_a" or "_b".
class ShapeReader {
 public:
  ShapeReader(Section& section, const char* side, bool degrees)
      : section_(section), side_(side), degrees_(degrees) {}

  Shape read(int link, ShapeKind fallback, const std::string& folder, std::vector<AttachedFile>& files) {
    Shape shape;
    shape.link = link;
    shape.kind = section_.choice<ShapeKind>(key("shape"), shape_kinds, fallback);
    kind_ = word_of(shape.kind);
    word_known_ = !section_.has(key("shape")) || section_.text(key("shape")) == kind_;
    if (!word_known_) allow_all_fields();
    if (shape.kind == ShapeKind::points)
      read_points(shape);
    else
      shape.frame.position = section_.vector(key("point"), Vec3<double>::Zero());
    switch (shape.kind) {
      case ShapeKind::points:
        break;
      case ShapeKind::sphere:
        shape.radius = size("radius");
        break;
      case ShapeKind::capsule:
        read_capsule(shape);
        break;
      case ShapeKind::box:
        read_box(shape);
        break;
      case ShapeKind::disk:
        read_disk(shape);
        break;
      case ShapeKind::plane:
        shape.frame.rotation = frame_along(section_.direction(key("normal"), Vec3<double>::UnitZ()));
        break;
      case ShapeKind::heightmap:
        read_height_map(shape, folder, files);
        break;
    }
    return shape;
  }

 private:
  std::string key(const char* field) const { return field + side_; }

  // If the shape's name is misspelled, its fields are unknown: none is required and none is refused.
  void allow_all_fields() {
    for (const char* field : {"axis", "normal", "points", "radius", "rpy", "size", "tube"})
      section_.allow(key(field));
    section_.allow(key("point") + "2");
  }

  bool required(const std::string& name) {
    if (section_.has(name)) return true;
    if (word_known_) section_.error(name, name + " is required for shape '" + kind_ + "'");
    return false;
  }

  double size(const char* field) {
    required(key(field));
    return section_.number(key(field), 1, Bound::positive);
  }

  void read_points(Shape& shape) {
    if (!required(key("points")) || !section_.points(key("points"), shape.points)) return;
    if (shape.points.empty()) section_.error(key("points"), key("points") + " must not be empty");
  }

  void read_capsule(Shape& shape) {
    shape.radius = size("radius");
    required(key("point") + "2");
    const Vec3<double> other = section_.vector(key("point") + "2", Vec3<double>::UnitZ());
    const Vec3<double> along = other - shape.frame.position;
    if (!(along.norm() > 0)) {
      section_.error(key("point") + "2", key("point") + "2 and " + key("point") +
                                             " must differ; a capsule of length zero is a sphere");
      return;
    }
    shape.frame.rotation = frame_along(along.normalized());
    shape.frame.position += 0.5 * along;
    shape.half_length = 0.5 * along.norm();
  }

  void read_box(Shape& shape) {
    required(key("size"));
    shape.half_size = 0.5 * section_.vector(key("size"), Vec3<double>::Ones());
    shape.radius = section_.number(key("radius"), 0, Bound::not_negative);
    if (!(shape.half_size.minCoeff() > shape.radius))
      section_.error(key("size"), key("size") + " must be three lengths > 0 and > 2 " + key("radius"));
    shape.frame.rotation = section_.rotation(key("rpy"), degrees_);
  }

  void read_disk(Shape& shape) {
    shape.radius = size("radius");
    shape.tube = section_.number(key("tube"), 0, Bound::not_negative);
    if (!(shape.tube < shape.radius))
      section_.error(key("tube"), key("tube") + " must be smaller than " + key("radius"));
    shape.frame.rotation = frame_along(section_.direction(key("axis"), Vec3<double>::UnitZ()));
  }

  void read_height_map(Shape& shape, const std::string& folder, std::vector<AttachedFile>& files) {
    const bool spaced = required("spacing");
    const double spacing = section_.number("spacing", 1, Bound::positive);
    const AttachedFile* file = required("file") ? attach(section_, folder, files) : nullptr;
    if (file && spaced) {
      const std::string why = read_heights(file->bytes, spacing, shape.heights);
      if (!why.empty()) section_.error("file", "file '" + file->name + "' " + why);
    }
    if (!shape.heights)
      shape.heights = std::make_shared<BicubicSpline>(2, 2, 1.0, std::vector<double>(4, 0.0));
  }

  Section& section_;
  std::string side_, kind_;
  bool word_known_ = true;  // whether the name of the shape is known
  bool degrees_;
};

void read_smooth_law(Section& section, ContactParameters<double>& law) {
  if (!section.has("stiffness")) section.error("stiffness", "stiffness is required, N/m");
  law.stiffness = section.number("stiffness", 1, Bound::positive);
  law.damping = section.number("damping", 0, Bound::not_negative);
  law.width = section.number("width", law.width, Bound::positive);
  law.friction = section.number("friction", 0, Bound::not_negative);
  law.static_friction = section.number("static_friction", law.friction, Bound::not_negative);
  if (law.static_friction < law.friction)
    section.warn("static_friction", "static_friction is smaller than friction and has no effect");
  law.friction_velocity = section.number("friction_velocity", law.friction_velocity, Bound::positive);
  law.rolling = section.number("rolling", 0, Bound::not_negative);
  law.torsion = section.number("torsion", 0, Bound::not_negative);
  law.spin_velocity = section.number("spin_velocity", law.spin_velocity, Bound::positive);
}

void read_redysim_law(Section& section, const Contact& contact, ContactParameters<double>& law) {
  const std::pair<const char*, double*> fields[] = {{"K", &law.stiffness},
                                                    {"Cv", &law.damping},
                                                    {"v_max", &law.v_max},
                                                    {"mu", &law.friction},
                                                    {"Ch", &law.Ch}};
  for (const auto& [key, value] : fields) {
    if (!section.has(key)) section.error(key, std::string(key) + " is required for law 'redysim'");
    *value = section.number(key, 1, value == &law.friction ? Bound::not_negative : Bound::positive);
  }
  if (contact.a.kind != ShapeKind::points || contact.b.kind != ShapeKind::plane)
    section.error("law", "law 'redysim' is for shape_a 'points' and shape_b 'plane' only");
}

void read_outputs(Section& section, Contact& contact) {
  const std::vector<bool> shown = section.flags("outputs", {"force", "torque", "depth", "point", "slip"});
  contact.shows_force = shown[0];
  contact.shows_torque = shown[1];
  contact.shows_depth = shown[2];
  contact.shows_point = shown[3];
  contact.shows_slip = shown[4];
}

// Names of the shapes that shape_a can touch. Overwrites contact.b.kind; the caller refuses the contact.
[[gnu::cold]] std::string partners_of(Contact& contact) {
  std::string words;
  for (const auto& [word, kind] : shape_kinds) {
    contact.b.kind = kind;
    if (!shape_pairs(contact).empty()) words.append(words.empty() ? "'" : ", '").append(word).append("'");
  }
  return words;
}

Contact read_contact(Section section, const std::string& label, const LinkTable& links, bool degrees,
                     Names& names, const std::string& folder, std::vector<AttachedFile>& files) {
  Contact contact;
  contact.name = names.take(section, label);
  contact.line = section.place().line;
  contact.column = section.place().column;
  const std::size_t errors_before = section.error_count();
  if (!section.has("link_a")) section.error("link_a", "link_a is required (a link's name or \"ground\")");
  const int link_a = links.index.find(section.text("link_a", "ground"), "link_a", section, ground);
  const int link_b = links.index.find(section.text("link_b", "ground"), "link_b", section, ground);
  const bool known = section.error_count() == errors_before;
  section.require("shape_a");
  contact.a = ShapeReader(section, "_a", degrees).read(link_a, ShapeKind::sphere, folder, files);
  contact.b = ShapeReader(section, "_b", degrees).read(link_b, ShapeKind::plane, folder, files);
  contact.law = section.choice<Contact::Law>(
      "law", {{"smooth", Contact::Law::smooth}, {"redysim", Contact::Law::redysim}}, Contact::Law::smooth);
  if (contact.law == Contact::Law::redysim)
    read_redysim_law(section, contact, contact);
  else
    read_smooth_law(section, contact);
  read_outputs(section, contact);
  section.refuse_unknown();
  if (shape_pairs(contact).empty()) {
    const std::string a = word_of(contact.a.kind), b = word_of(contact.b.kind);
    section.error("shape_a", "a contact between '" + a + "' and '" + b + "' is not supported; '" + a +
                                 "' supports " + partners_of(contact));
  }
  const std::string rigid = rigid_pair(link_a, link_b, links);
  if (known && !rigid.empty())
    section.error(section.has("link_b") ? "link_b" : "link_a", rigid + "; this contact has no effect");
  return contact;
}

}  // namespace

std::vector<Contact> read_contacts(Section& top, const LinkTable& links, bool degrees, Names& names,
                                   const std::string& folder, std::vector<AttachedFile>& files,
                                   Findings& findings) {
  std::vector<Contact> contacts;
  for (const Value* table : top.tables("contact")) {
    const std::string label = label_of("contact", contacts.size() + 1, *table);
    contacts.push_back(
        read_contact(Section(*table, label, findings), label, links, degrees, names, folder, files));
  }
  return contacts;
}

}  // namespace redysim
