#pragma once

#include <string>
#include <string_view>
#include <vector>

#include "model/read/findings.hpp"

namespace redysim {

struct Entry;

// A TOML document as a tree of values with their positions in the file. Integers are stored as `number`.
struct Value {
  enum class Kind { text, number, flag, list, table, other };
  Kind kind = Kind::other;
  Place place;
  std::string text;
  double number = 0;
  bool flag = false;
  std::vector<Value> items;    // of kind list
  std::vector<Entry> entries;  // of kind table

  const Value* find(std::string_view key) const;
  std::string kind_name() const;  // "a number", as in "must be a string, got a number"
};

struct Entry {
  std::string key;
  Place place;  // of the key
  Value value;
};

// Throws ModelError(syntax) for malformed text; `name` replaces the path in messages.
Value parse_toml(const std::string& text, const std::string& name);

}  // namespace redysim
