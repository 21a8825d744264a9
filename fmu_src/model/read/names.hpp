#pragma once

#include <map>
#include <string>
#include <string_view>
#include <vector>

#include "model/read/section.hpp"

namespace redysim {

// "link 'elbow'", or "link 3" (the third) while the table has no name.
std::string label_of(const std::string& kind, std::size_t ordinal, const Value& table);

// The names under which links, joints, loops, couplings, springs and contacts appear in FMI variables: each
// has one owner.
class Names {
 public:
  // Reads the required field `name` and claims it for `owner`; empty when missing or bad.
  std::string take(Section& section, const std::string& owner);

  void claim(const std::string& name, std::string_view key, const std::string& owner, Section& section);

 private:
  struct Owner {
    std::string label;
    int line = 0;
  };
  std::map<std::string, Owner> owners_;
};

// Link names to indices, as loops and springs give their ends.
class LinkIndex {
 public:
  LinkIndex() : candidates_{"ground"} {}
  void add(const std::string& name, int index);

  // Index of `name`, `ground` for "ground", or `fallback` with a finding on the field `key`.
  int find(const std::string& name, std::string_view key, Section& section, int fallback) const;

 private:
  std::map<std::string, int> indices_;
  std::vector<std::string> candidates_;
};

}  // namespace redysim
