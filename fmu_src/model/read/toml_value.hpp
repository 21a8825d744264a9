#pragma once

#include <string>
#include <string_view>
#include <vector>

#include "model/read/findings.hpp"

namespace redysim {

struct Entry;

// A TOML document as a plain tree that remembers where everything stands; integers are numbers.
struct Value {
  enum class Kind { text, number, flag, list, table, other };
  Kind kind = Kind::other;
  Place place;
  std::string text;
  double number = 0;
  bool flag = false;
  std::vector<Value> items;    // of a list
  std::vector<Entry> entries;  // of a table

  const Value* find(std::string_view key) const;
  std::string kind_name() const;  // "a number", as in "must be a string, got a number"
};

struct Entry {
  std::string key;
  Place place;  // of the key
  Value value;
};

// Throws ModelError(syntax); `name` stands for the file in the message.
Value parse_toml(const std::string& text, const std::string& name);

}  // namespace redysim
