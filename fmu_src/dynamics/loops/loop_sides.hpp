#pragma once

#include <algorithm>
#include <vector>

namespace redysim {

// The joints that a loop crosses, from each end up to a common body (excluded); for a coupling all are in
// joints_a.
struct LoopSides {
  std::vector<int> joints_a, joints_b;

  bool on_a(int joint) const { return std::count(joints_a.begin(), joints_a.end(), joint) > 0; }
  bool on_b(int joint) const { return std::count(joints_b.begin(), joints_b.end(), joint) > 0; }
  bool crosses(int joint) const { return on_a(joint) || on_b(joint); }
  // Rows of two loops are coupled if their loops cross a common joint.
  bool is_coupled_to(const LoopSides& other) const {
    for (const auto* joints : {&joints_a, &joints_b})
      for (const int joint : *joints)
        if (other.crosses(joint)) return true;
    return false;
  }
};

}  // namespace redysim
