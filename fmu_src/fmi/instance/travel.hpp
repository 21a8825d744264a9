#pragma once

#include <string>
#include <vector>

#include "fmi/instance/simulation.hpp"

namespace redysim {

// Maximum displacement of each sliding joint since the start.
class Travel {
 public:
  void begin(const Simulation& simulation);
  void note(const Simulation& simulation);
  // A message for each joint whose maximum displacement is hardly larger than its tolerance. Displacements
  // far below the tolerance or the largest displacement may be rounding errors and are ignored.
  std::vector<std::string> unresolved(const Simulation& simulation) const;

 private:
  struct Range {
    int place;  // index in the state
    double start, farthest;
  };
  std::vector<Range> ranges_;
  bool has_begun_ = false;
};

}  // namespace redysim
