#pragma once

#include <map>
#include <string>
#include <string_view>
#include <vector>

#include "model/read/section.hpp"

namespace redysim {

// "link 'elbow'", or "link 3" for the third table if it has no name.
std::string label_of(const std::string& kind, std::size_t ordinal, const Value& table);

// The names of links, joints, loops, couplings, springs, contacts etc. in FMI variables. Each name is unique.
class Names {
 public:
  // Reads the required field `name` and registers it for `owner`; empty if it is missing or invalid.
  std::string take(Section& section, const std::string& owner);

  void claim(const std::string& name, std::string_view key, const std::string& owner, Section& section);

 private:
  struct Owner {
    std::string label;
    int line = 0;
  };
  std::map<std::string, Owner> owners_;
};

// Finds links by the names that loops and springs give for their ends.
class LinkIndex {
 public:
  LinkIndex() : candidates_{"ground"} {}
  void add(const std::string& name, int index);

  // Index of the link `name`, `ground` for "ground", or `fallback` after reporting an error on the field
  // `key`.
  int find(const std::string& name, std::string_view key, Section& section, int fallback) const;

 private:
  std::map<std::string, int> indices_;
  std::vector<std::string> candidates_;
};

}  // namespace redysim
