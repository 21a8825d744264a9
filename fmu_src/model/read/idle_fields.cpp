#include "model/read/idle_fields.hpp"

#include <cmath>
#include <sstream>

#include "math/angles.hpp"
#include "model/any_of.hpp"
#include "model/read/names.hpp"
#include "model/read/open_file.hpp"

namespace redysim {
namespace {

// `field` has no effect unless one of the fields in `needs` is nonzero. Empty `field`: the whole table.
struct Need {
  const char *table, *field, *needs;
};

constexpr Need needs_of_fields[] = {
    {"link", "com", "mass"},
    {"link", "rest", "stiffness"},
    {"link", "lower", "stop_stiffness"},
    {"link", "upper", "stop_stiffness"},
    {"spring", "", "stiffness or damping"},
    {"spring", "rest_length", "stiffness"},
    {"bushing", "", "stiffness or damping"},
    {"contact", "friction_velocity", "friction or static_friction"},
    {"contact", "spin_velocity", "rolling or torsion"},
};

bool is_nonzero(const Value& value) {
  if (value.kind == Value::Kind::number) return value.number != 0;
  return value.kind != Value::Kind::list || any_of(value.items, is_nonzero);
}

bool is_nonzero(const Value& table, const std::string& field) {
  const Value* value = table.find(field);
  return value && is_nonzero(*value);
}

// Checks one file.
class IdleFields {
 public:
  IdleFields(const Value& document, const Model& model, Findings& findings)
      : document_(document), model_(model), findings_(findings), top_(document, "", findings) {}

  void find() {
    for (const char* kind :
         {"link", "spring", "bushing", "contact", "actuator", "trajectory", "frame", "shape"}) {
      std::size_t ordinal = 0;
      for (const Value* table : top_.tables(kind)) {
        Section section(*table, label_of(kind, ++ordinal, *table), findings_);
        check_needs(kind, *table, section);
        check_degrees(*table, section);
        if (kind == std::string("link")) check_joint(*table, section);
        if (kind == std::string("actuator") && table->entries.size() == 1)
          section.warn("joint", "this actuator has no effect without further fields");
      }
    }
    if (const Value* fmu = document_.find("fmu")) {
      check_outputs(*fmu);
      check_targets(*fmu);
    }
  }

 private:
  // Whether any joint or contact of the model has `field` as a tunable parameter.
  bool is_tunable(const std::string& field) const {
    const auto is_it = [&](const std::string& name) { return name.substr(name.rfind('.') + 1) == field; };
    return any_of(model_.fmu.tunable, is_it);
  }

  bool has_any(const Value& table, const char* fields) const {
    std::istringstream words(fields);
    for (std::string word; words >> word;)
      if (is_nonzero(table, word) || is_tunable(word)) return true;
    return false;
  }

  void check_needs(const std::string& kind, const Value& table, Section& section) {
    for (const Need& need : needs_of_fields) {
      const std::string field = need.field;
      if (kind != need.table || (!field.empty() && !is_nonzero(table, field))) continue;
      if (has_any(table, need.needs)) continue;
      const std::string what = field.empty() ? "this " + kind : field;
      section.warn(field.empty() ? "name" : field, what + " has no effect without " + need.needs);
    }
  }

  void check_joint(const Value& table, Section& section) {
    if (section.text("joint") == "fixed") return;  // the reader has already warned
    if (section.text("drive") == "locked" && is_nonzero(table, "qd"))
      section.warn_idle("qd", "on a locked joint");
    if (section.flag("hold", false) && !model_.has_constraints())
      section.warn_idle("hold", "without loops and rigid couplings");
  }

  // Warns about output groups that contain no variables.
  void check_outputs(const Value& fmu) {
    const bool acts = any_of(model_.actuators, [](const Actuator& actuator) { return actuator.acts(); });
    const std::tuple<const char*, bool, const char*> groups[] = {
        {"reference", model_.controller.joints.empty(), "a controller"},
        {"actuator", !acts, "an actuator other than a rigid gear"},
        {"constraint_jacobian", !model_.has_constraints(), "loops and rigid couplings"},
        {"parameter_jacobian", model_.fmu.tunable.empty(), "tunable parameters"}};
    for (const auto& [word, place] : Section(fmu, "fmu", findings_).texts("outputs"))
      for (const auto& [group, is_empty, without] : groups)
        if (is_empty && word == group)
          findings_.warn(place, "fmu: outputs '" + word + "' has no effect without " + without);
  }

  void check_targets(const Value& fmu) {
    for (const auto& [name, place] : Section(fmu, "fmu", findings_).texts("tunable"))
      for (const Trajectory& trajectory : model_.trajectories)
        if (name == model_.links[trajectory.link].joint.name + ".target")
          findings_.warn(place, "fmu: tunable '" + name + "' has no effect: its joint follows a trajectory");
  }

  // Only rotating joints, and of joints with several DOF those whose coordinates are all angles.
  bool takes_angle(const Value& table, Section& section) const {
    if (!table.find("type")) {
      const std::string joint = section.text("joint", "revolute");
      return joint == "revolute" || joint == "universal" || joint == "spherical";
    }
    const std::string name = section.text("joint");
    return any_of(model_.links, [&](const Link& link) {
      return link.joint.name == name && link.joint.type == JointType::revolute;
    });
  }

  // A multiple of 15 above 2 pi is hardly an angle in radians. No check if the file gives the unit.
  void check_degrees(const Value& table, Section& section) {
    if (document_.find("angle_unit")) return;
    const bool angle = takes_angle(table, section);
    for (const char* key : {"q", "lower", "upper", "rest", "from", "to", "rpy", "rpy_a", "rpy_b"}) {
      const Value* value = table.find(key);
      if (!value || !(angle || std::string(key).rfind("rpy", 0) == 0)) continue;
      const std::vector<Value> one = {*value};
      for (const Value& item : value->kind == Value::Kind::list ? value->items : one) {
        if (!(std::abs(item.number) > 2 * pi) || std::fmod(item.number, 15) != 0) continue;
        section.warn(key, std::string(key) + " = " + shown(item.number) +
                              " rad is more than a full turn; set angle_unit = \"deg\" for degrees, or "
                              "\"rad\" if it is right");
        break;
      }
    }
  }

  const Value& document_;
  const Model& model_;
  Findings& findings_;
  Section top_;
};

}  // namespace

std::vector<Diagnostic> idle_fields_of(const std::string& text, const std::string& name, const Model& model) {
  const Value document = parse_toml(text, name);
  Findings findings(name);
  IdleFields(document, model, findings).find();
  return findings.warnings();
}

std::vector<Diagnostic> idle_fields(const std::string& file, const Model& model) {
  std::string text;
  return read_file(file, text) ? std::vector<Diagnostic>() : idle_fields_of(text, file, model);
}

}  // namespace redysim
