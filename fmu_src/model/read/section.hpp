#pragma once

#include <string>
#include <utility>
#include <vector>

#include "math/vec3.hpp"
#include "model/read/findings.hpp"
#include "model/read/number.hpp"
#include "model/read/toml_value.hpp"

namespace redysim {

enum class Bound { any, not_negative, positive };

// True for a name that can stand in an FMI variable name: [A-Za-z_][A-Za-z0-9_]*
bool is_identifier(const std::string& text);

// One table of the model file with typed, checked access to its fields. An error is reported as a finding,
// "link 'elbow': mass must be >= 0, got -1", and the fallback is returned. refuse_unknown() reports the
// fields that were never requested. The table must outlive the section.
class Section {
 public:
  Section(const Value& table, std::string label, Findings& findings);

  bool has(const std::string& key) const { return table_->find(key) != nullptr; }
  Place place() const { return table_->place; }
  Place place(const std::string& key) const;  // of the field's value, or of the table when it is absent

  std::string text(const std::string& key, const std::string& fallback = {});
  std::string identifier(const std::string& key, const std::string& fallback = {});
  bool flag(const std::string& key, bool fallback);
  double number(const std::string& key, double fallback, Bound bound = Bound::any);
  bool numbers(const std::string& key, std::vector<double>& numbers,
               bool infinite = false);                              // false: absent or invalid
  bool within(const std::string& key, double number, Bound bound);  // reports the error
  // One number for all, or a list of `count`; any other length is a finding and returns the fallback.
  std::vector<double> numbers_each(const std::string& key, std::size_t count, double fallback,
                                   Bound bound = Bound::any);
  Vec3<double> vector(const std::string& key, const Vec3<double>& fallback);
  Vec3<double> direction(const std::string& key, const Vec3<double>& fallback);  // of unit length
  // Fixed-axis roll, pitch, yaw (URDF's rpy): R = Rz(yaw) Ry(pitch) Rx(roll).
  Mat3<double> rotation(const std::string& key, bool degrees);
  bool directions(const std::string& key, std::vector<Vec3<double>>& directions);  // false: absent or invalid
  bool points(const std::string& key, std::vector<Vec3<double>>& points);          // likewise, m
  std::vector<std::pair<std::string, Place>> texts(const std::string& key);
  // Which of `words` a list of strings contains; an unknown word and a repeated one are findings.
  std::vector<bool> flags(const std::string& key, const std::vector<std::string>& words);

  // The tables under `key`: written [[key]] (many) or [key] (one).
  std::vector<const Value*> tables(const std::string& key);
  const Value* table(const std::string& key);

  // One of `choices`; the words in `later` are refused as not available yet.
  template <class Enum>
  Enum choice(const std::string& key, const std::vector<std::pair<const char*, Enum>>& choices, Enum fallback,
              const std::vector<std::string>& later = {}) {
    std::vector<std::string> words;
    for (const auto& option : choices) words.push_back(option.first);
    const int chosen = chosen_word(key, words, later);
    return chosen < 0 ? fallback : choices[static_cast<std::size_t>(chosen)].second;
  }

  void error(const std::string& key, const std::string& message);
  void error(Place place, const std::string& message);
  void warn(const std::string& key, const std::string& message);
  void refuse_unknown();

 private:
  const Value* ask(const std::string& key);
  const Value* ask(const std::string& key, Value::Kind kind, const char* kind_name);
  bool finite(const std::string& key, const Value& value);
  bool read_numbers(const std::string& key, const Value& list, std::vector<double>& numbers,
                    bool infinite = false);
  bool read_vector(const std::string& key, const Value& list, Vec3<double>& vector);
  bool read_list(const std::string& key, const char* what, bool of_unit_length,
                 std::vector<Vec3<double>>& vectors);
  bool normalise(const std::string& key, const Value& list, Vec3<double>& vector);
  int chosen_word(const std::string& key, const std::vector<std::string>& words,
                  const std::vector<std::string>& later);

  const Value* table_;
  std::string label_;
  Findings* findings_;
  std::vector<std::string> known_;
};

}  // namespace redysim
