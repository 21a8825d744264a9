#pragma once

#include <string>
#include <vector>

#include "fmi/instance/simulation.hpp"

namespace redysim {

// Largest displacement of each sliding joint since the start.
class Travel {
 public:
  void begin(const Simulation& simulation);
  void note(const Simulation& simulation);
  // A message for each joint whose whole motion is hardly larger than its tolerance. Motions far
  // below the tolerance or the largest motion may be rounding.
  std::vector<std::string> unresolved(const Simulation& simulation) const;

 private:
  struct Range {
    int place;  // in the state
    double start, farthest;
  };
  std::vector<Range> ranges_;
  bool has_begun_ = false;
};

}  // namespace redysim
