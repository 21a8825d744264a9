#pragma once

#include <initializer_list>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "math/vec3.hpp"
#include "model/number.hpp"
#include "model/read/findings.hpp"
#include "model/read/toml_value.hpp"

namespace redysim {

enum class Bound { any, not_negative, positive };

// Whether a text can be part of an FMI variable name: [A-Za-z_][A-Za-z0-9_]*
bool is_identifier(const std::string& text);

// One table of the model file, with typed and checked access to its fields. An error becomes a finding, "link
// 'elbow': mass must be >= 0, got -1", and the function returns the fallback. refuse_unknown() reports all
// fields that were never requested. The table must outlive the section.
class Section {
 public:
  Section(const Value& table, std::string label, Findings& findings);

  bool has(std::string_view key) const { return table_->find(key) != nullptr; }
  void allow(const std::string& key) { known_.push_back(key); }  // accepts a field without reading it
  Place place() const { return table_->place; }
  Place place(std::string_view key) const;  // of the value of the field, or of the table if it is absent

  std::string text(std::string_view key, const std::string& fallback = {});
  std::string identifier(std::string_view key, const std::string& fallback = {});
  bool flag(std::string_view key, bool fallback);
  double number(std::string_view key, double fallback, Bound bound = Bound::any);
  bool numbers(std::string_view key, std::vector<double>& numbers,
               bool infinite = false);                            // returns false if absent or invalid
  bool within(std::string_view key, double number, Bound bound);  // false after reporting an error
  // One number for all, or a list of `count` numbers; another length is an error and returns the fallback.
  std::vector<double> numbers_each(std::string_view key, std::size_t count, double fallback,
                                   Bound bound = Bound::any);
  Vec3<double> vector(std::string_view key, const Vec3<double>& fallback);
  Vec3<double> direction(std::string_view key, const Vec3<double>& fallback);  // unit vector
  // Fixed-axis roll, pitch, yaw (URDF's rpy): R = Rz(yaw) Ry(pitch) Rx(roll).
  Mat3<double> rotation(std::string_view key, bool degrees);
  bool directions(std::string_view key, std::vector<Vec3<double>>& directions);  // false: absent or invalid
  bool points(std::string_view key, std::vector<Vec3<double>>& points);          // the same, in m
  std::vector<std::pair<std::string, Place>> texts(std::string_view key);
  // For each of `words`, whether the list of strings contains it. Unknown and repeated words are errors.
  std::vector<bool> flags(std::string_view key, const std::vector<std::string>& words);

  // All tables under `key`, written as [[key]] (many) or [key] (one).
  std::vector<const Value*> tables(std::string_view key);
  const Value* table(std::string_view key);

  // One of `choices`, which are pairs of a word and its value.
  template <class Chosen, class Choices = std::initializer_list<std::pair<const char*, Chosen>>>
  Chosen choice(std::string_view key, const Choices& choices, Chosen fallback) {
    const Value* value = ask(key, Value::Kind::text, "a string");
    if (!value) return fallback;
    std::vector<std::string> words;
    for (const auto& [word, chosen] : choices) {
      if (value->text == word) return chosen;
      words.push_back(word);
    }
    refuse_word(key, *value, words);
    return fallback;
  }

  void require(const char* key);  // reports an error if the field is absent
  void error(std::string_view key, const std::string& message);
  void error(Place place, const std::string& message);
  void warn(std::string_view key, const std::string& message);
  // If the field is given, warns for example "friction_velocity has no effect without friction".
  void warn_idle(const std::string& key, const char* why);
  void refuse_unknown();
  std::size_t error_count() const { return findings_->error_count(); }

 private:
  const Value* ask(std::string_view key);
  const Value* ask(std::string_view key, Value::Kind kind, const char* kind_name);
  bool finite(std::string_view key, const Value& value);
  bool read_numbers(std::string_view key, const Value& list, std::vector<double>& numbers,
                    bool infinite = false);
  bool read_vector(std::string_view key, const Value& list, Vec3<double>& vector);
  bool read_list(std::string_view key, const char* what, bool of_unit_length,
                 std::vector<Vec3<double>>& vectors);
  bool normalise(std::string_view key, const Value& list, Vec3<double>& vector);
  void refuse_word(std::string_view key, const Value& value, const std::vector<std::string>& words);

  const Value* table_;
  std::string label_;
  Findings* findings_;
  std::vector<std::string> known_;  // requested fields
};

}  // namespace redysim
