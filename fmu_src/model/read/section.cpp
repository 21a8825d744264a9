#include "model/read/section.hpp"

#include <algorithm>
#include <cmath>

#include "math/angles.hpp"
#include "model/any_of.hpp"
#include "model/read/suggest.hpp"

namespace redysim {
namespace {

double minimum_of(Bound bound) {
  if (bound == Bound::any) return -std::numeric_limits<double>::infinity();
  return bound == Bound::positive ? minimum_positive : 0;
}

}  // namespace

bool is_identifier(const std::string& text) {
  if (text.empty() || ('0' <= text[0] && text[0] <= '9')) return false;
  return !any_of(text, [](char c) {
    return !(('a' <= c && c <= 'z') || ('A' <= c && c <= 'Z') || ('0' <= c && c <= '9') || c == '_');
  });
}

Section::Section(const Value& table, std::string label, Findings& findings)
    : table_(&table), label_(std::move(label)), findings_(&findings) {}

Place Section::place(std::string_view key) const {
  const Value* value = table_->find(key);
  return value ? value->place : table_->place;
}

void Section::require(const char* key) {
  if (!has(key)) error(key, std::string(key) + " is required");
}

void Section::error(std::string_view key, const std::string& message) { error(place(key), message); }

void Section::error(Place place, const std::string& message) {
  findings_->error(place, label_.empty() ? message : label_ + ": " + message);
}

void Section::warn(std::string_view key, const std::string& message) {
  findings_->warn(place(key), label_.empty() ? message : label_ + ": " + message);
}

void Section::warn_idle(const std::string& key, const char* why) {
  if (has(key)) warn(key, key + " has no effect " + why);
}

namespace {

// Fields that exist only for some types. Each line starts with the first word of the label of the table.
constexpr std::string_view fields_of_types =
    "\nlink rest lower upper damping stiffness armature friction static_friction friction_velocity "
    "stop_stiffness stop_damping stop_width "
    "\ntrajectory from to start duration speed speed_from speed_to coefficients file time q qd qdd "
    "\ncontact K Cv v_max mu Ch stiffness damping width friction static_friction friction_velocity rolling "
    "torsion spin_velocity axis_a axis_b normal_a normal_b points_a points_b point_a2 point_b2 radius_a "
    "radius_b rpy_a rpy_b size_a size_b tube_a tube_b file spacing \n";

[[gnu::cold]] bool depends_on_type(const std::string& kind, const std::string& key) {
  const std::size_t begin = fields_of_types.find("\n" + kind + " ");
  if (begin == std::string_view::npos) return false;
  return fields_of_types.find(" " + key + " ", begin) < fields_of_types.find('\n', begin + 1);
}

}  // namespace

void Section::refuse_unknown() {
  const std::string kind = label_.substr(0, label_.find(' '));
  for (const Entry& entry : table_->entries) {
    if (contains(known_, entry.key)) continue;
    if (depends_on_type(kind, entry.key))
      error(entry.place, entry.key + " does not apply to this type of " + (kind == "link" ? "joint" : kind));
    else
      error(entry.place, "unknown field '" + entry.key + "'" + did_you_mean(entry.key, known_));
  }
}

const Value* Section::ask(std::string_view key) {
  known_.emplace_back(key);
  return table_->find(key);
}

const Value* Section::ask(std::string_view key, Value::Kind kind, const char* kind_name) {
  const Value* value = ask(key);
  if (!value || value->kind == kind) return value;
  error(value->place, std::string(key) + " must be " + kind_name + ", got " + value->kind_name());
  return nullptr;
}

std::string Section::text(std::string_view key, const std::string& fallback) {
  const Value* value = ask(key, Value::Kind::text, "a string");
  return value ? value->text : fallback;
}

std::string Section::identifier(std::string_view key, const std::string& fallback) {
  const Value* value = ask(key, Value::Kind::text, "a string");
  if (!value) return fallback;
  if (is_identifier(value->text)) return value->text;
  error(value->place, std::string(key) + " '" + value->text +
                          "' must be letters, digits and _ (ASCII) and not start with a digit");
  return fallback;
}

bool Section::flag(std::string_view key, bool fallback) {
  const Value* value = ask(key, Value::Kind::flag, "true or false");
  return value ? value->flag : fallback;
}

bool Section::finite(std::string_view key, const Value& value) {
  if (std::isfinite(value.number)) return true;
  error(value.place, std::string(key) + " must be finite, got " + shown(value.number));
  return false;
}

double Section::number(std::string_view key, double fallback, Bound bound) {
  const Value* value = ask(key, Value::Kind::number, "a number");
  if (!value || !finite(key, *value)) return fallback;
  return within(key, value->number, bound) ? value->number : fallback;
}

bool Section::within(std::string_view key, double number, Bound bound) {
  const std::string why = below(minimum_of(bound), number);
  if (!why.empty()) error(key, std::string(key) + " " + why);
  return why.empty();
}

bool Section::read_numbers(std::string_view key, const Value& list, std::vector<double>& numbers,
                           bool infinite) {
  bool good = true;
  for (const Value& item : list.items) {
    if (item.kind != Value::Kind::number) {
      error(item.place, std::string(key) + " must contain numbers, got " + item.kind_name());
      good = false;
    } else {
      good = ((infinite && std::isinf(item.number)) || finite(key, item)) && good;
    }
    numbers.push_back(item.number);
  }
  return good;
}

bool Section::numbers(std::string_view key, std::vector<double>& numbers, bool infinite) {
  const Value* list = ask(key, Value::Kind::list, "a list of numbers");
  return list && read_numbers(key, *list, numbers, infinite);
}

std::vector<double> Section::numbers_each(std::string_view key, std::size_t count, double fallback,
                                          Bound bound) {
  const Value* value = ask(key);
  std::vector<double> each(count, fallback), given;
  if (!value) return each;
  if (value->kind != Value::Kind::list) return std::vector<double>(count, number(key, fallback, bound));
  if (!read_numbers(key, *value, given)) return each;
  if (given.size() != count) {
    error(value->place, std::string(key) + " must be a number or a list of " + std::to_string(count) +
                            ", got " + std::to_string(given.size()) + " numbers");
    return each;
  }
  for (std::size_t k = 0; k < count; ++k) {
    const std::string why = below(minimum_of(bound), given[k]);
    if (why.empty()) continue;
    error(value->items[k].place, std::string(key) + " " + why);
    return each;
  }
  return given;
}

bool Section::read_vector(std::string_view key, const Value& list, Vec3<double>& vector) {
  std::vector<double> numbers;
  if (!read_numbers(key, list, numbers)) return false;
  if (numbers.size() != 3) {
    error(list.place, std::string(key) + " must be 3 numbers, got " + std::to_string(numbers.size()));
    return false;
  }
  vector = {numbers[0], numbers[1], numbers[2]};
  return true;
}

Vec3<double> Section::vector(std::string_view key, const Vec3<double>& fallback) {
  const Value* list = ask(key, Value::Kind::list, "3 numbers");
  Vec3<double> vector;
  return list && read_vector(key, *list, vector) ? vector : fallback;
}

bool Section::normalise(std::string_view key, const Value& list, Vec3<double>& vector) {
  const double length = vector.stableNorm();
  if (length > 0) {
    vector /= length;
    return true;
  }
  error(list.place, std::string(key) + " must not be the zero vector");
  return false;
}

Vec3<double> Section::direction(std::string_view key, const Vec3<double>& fallback) {
  const Value* list = ask(key, Value::Kind::list, "3 numbers");
  Vec3<double> vector;
  return list && read_vector(key, *list, vector) && normalise(key, *list, vector) ? vector : fallback;
}

Mat3<double> Section::rotation(std::string_view key, bool degrees) {
  using Eigen::AngleAxisd;
  const Vec3<double> rpy = (degrees ? degree : 1) * vector(key, Vec3<double>::Zero());
  return (AngleAxisd(rpy.z(), Vec3<double>::UnitZ()) * AngleAxisd(rpy.y(), Vec3<double>::UnitY()) *
          AngleAxisd(rpy.x(), Vec3<double>::UnitX()))
      .toRotationMatrix();
}

bool Section::directions(std::string_view key, std::vector<Vec3<double>>& directions) {
  return read_list(key, "directions such as [[1, 0, 0], [0, 1, 0]]", true, directions);
}

bool Section::points(std::string_view key, std::vector<Vec3<double>>& points) {
  return read_list(key, "points such as [[0.1, 0, 0], [-0.1, 0, 0]]", false, points);
}

bool Section::read_list(std::string_view key, const char* what, bool of_unit_length,
                        std::vector<Vec3<double>>& vectors) {
  const Value* list = ask(key, Value::Kind::list, (std::string("a list of ") + what).c_str());
  if (!list) return false;
  for (const Value& item : list->items) {
    Vec3<double> vector;
    if (item.kind != Value::Kind::list)
      error(item.place, std::string(key) + " must contain lists of 3 numbers, got " + item.kind_name());
    else if (read_vector(key, item, vector) && (!of_unit_length || normalise(key, item, vector)))
      vectors.push_back(vector);
  }
  return vectors.size() == list->items.size();
}

std::vector<std::pair<std::string, Place>> Section::texts(std::string_view key) {
  const Value* list = ask(key, Value::Kind::list, "a list of strings");
  std::vector<std::pair<std::string, Place>> texts;
  if (!list) return texts;
  for (const Value& item : list->items) {
    if (item.kind == Value::Kind::text)
      texts.emplace_back(item.text, item.place);
    else
      error(item.place, std::string(key) + " must contain strings, got " + item.kind_name());
  }
  return texts;
}

std::vector<bool> Section::flags(std::string_view key, const std::vector<std::string>& words) {
  std::vector<bool> flags(words.size(), false);
  for (const auto& [word, place] : texts(key)) {
    const auto found = std::find(words.begin(), words.end(), word);
    if (found == words.end()) {
      error(place, std::string(key) + " must be " + one_of(words) + ", got '" + word + "'" +
                       did_you_mean(word, words));
      continue;
    }
    const std::size_t index = static_cast<std::size_t>(found - words.begin());
    if (flags[index]) error(place, std::string(key) + " lists '" + word + "' twice");
    flags[index] = true;
  }
  return flags;
}

std::vector<const Value*> Section::tables(std::string_view key) {
  const Value* list = ask(key);
  std::vector<const Value*> tables;
  if (!list) return tables;
  if (list->kind != Value::Kind::list) {
    error(list->place, std::string(key) + " must be written [[" + std::string(key) + "]], once for each");
    return tables;
  }
  for (const Value& item : list->items) {
    if (item.kind == Value::Kind::table)
      tables.push_back(&item);
    else
      error(item.place, std::string(key) + " must be written [[" + std::string(key) + "]], once for each");
  }
  return tables;
}

const Value* Section::table(std::string_view key) {
  const Value* value = ask(key);
  if (!value || value->kind == Value::Kind::table) return value;
  error(value->place, std::string(key) + " must be written [" + std::string(key) + "], once");
  return nullptr;
}

void Section::refuse_word(std::string_view key, const Value& value, const std::vector<std::string>& words) {
  error(value.place, std::string(key) + " must be " + one_of(words) + ", got '" + value.text + "'" +
                         did_you_mean(value.text, words));
}

}  // namespace redysim
