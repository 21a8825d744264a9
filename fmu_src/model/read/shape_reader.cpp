#include "model/read/shape_reader.hpp"

#include <algorithm>

#include "model/any_of.hpp"
#include "model/read/link_table.hpp"
#include "model/read/model_error.hpp"
#include "model/read/open_file.hpp"

namespace redysim {
namespace {

const std::vector<std::pair<const char*, std::size_t>> sizes = {
    {"box", 3}, {"cylinder", 2}, {"sphere", 1}, {"capsule", 2}, {"mesh", 3}};

void read_size(Section& section, DrawnShape& shape, std::size_t count) {
  if (section.has("size")) {
    // a negative scale factor mirrors a mesh
    shape.size = section.numbers_each("size", count, 1, shape.kind == "mesh" ? Bound::any : Bound::positive);
    if (std::count(shape.size.begin(), shape.size.end(), 0.0) > 0)
      section.error("size", "the scale of a mesh must not be 0");
  } else {
    shape.size.assign(count, 1);
    if (shape.kind != "mesh") section.error("size", "size is required");
  }
}

void read_color(Section& section, DrawnShape& shape) {
  if (!section.has("color") || !section.numbers("color", shape.color)) return;
  const bool is_outside = any_of(shape.color, [](double part) { return !(part >= 0 && part <= 1); });
  if (is_outside || shape.color.size() < 3 || shape.color.size() > 4)
    section.error("color", "color must be red, green, blue and optionally opacity, each from 0 to 1");
  if (shape.color.size() == 3) shape.color.push_back(1);
}

DrawnShape read_shape(Section section, const LinkIndex& links, bool degrees) {
  DrawnShape shape;
  shape.link = links.find(section.text("link", "ground"), "link", section, ground);
  section.require("kind");
  const std::size_t count = section.choice("kind", sizes, std::size_t{0});
  shape.kind = section.text("kind");
  if (count != 0) read_size(section, shape, count);
  shape.file = section.text("file");
  if (shape.kind == "mesh" && shape.file.empty()) section.error("file", "file is required for a mesh");
  if (shape.kind != "mesh" && section.has("file")) section.error("file", "file applies to kind 'mesh' only");
  shape.position = section.vector("position", shape.position);
  shape.rotation = section.rotation("rpy", degrees);
  read_color(section, shape);
  if (count != 0) section.refuse_unknown();
  return shape;
}

}  // namespace

std::vector<DrawnShape> read_shapes(const std::string& path, const Model& model) {
  std::string text;
  if (const char* why = read_file(path, text))
    throw ModelError(ModelError::Reason::unreadable, {{path, 0, 0, std::string("the model file ") + why}});
  const Value document = parse_toml(text, path);
  Findings findings(path);
  Section top(document, "", findings);
  LinkIndex links;
  for (std::size_t i = 0; i < model.links.size(); ++i) links.add(model.links[i].name, static_cast<int>(i));
  const bool degrees = top.text("angle_unit") == "deg";
  std::vector<DrawnShape> shapes;
  for (const Value* table : top.tables("shape"))
    shapes.push_back(
        read_shape(Section(*table, "shape " + std::to_string(shapes.size() + 1), findings), links, degrees));
  if (findings.error_count() > 0) throw ModelError(ModelError::Reason::invalid, findings.errors());
  return shapes;
}

}  // namespace redysim
