#pragma once

#include <string>
#include <string_view>
#include <vector>

#include "model/model.hpp"
#include "model/read/section.hpp"

namespace redysim {

// Whether one of `parts`, for example a trajectory, belongs to the joint of this link.
template <class Part>
bool has_part_of(const std::vector<Part>& parts, int link) {
  for (const Part& part : parts)
    if (part.link == link) return true;
  return false;
}

// Finds the moving joints with one DOF by name.
class JointIndex {
 public:
  explicit JointIndex(const Model& model);

  // Link whose joint has this name, or -1 after reporting an error at `place`.
  int find(const std::string& name, std::string_view key, Place place, Section& section) const;

 private:
  std::vector<std::string> names_;
  std::vector<int> links_;
};

}  // namespace redysim
