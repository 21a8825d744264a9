#pragma once

#include <string>
#include <vector>

#include "model/read/names.hpp"

namespace redysim {

// What loops, springs and contacts need to know of the links.
struct LinkTable {
  LinkIndex index;
  std::vector<int> carriers;       // rigid_carriers(); empty: unknown, do not check
  std::vector<std::string> names;  // by link index
};

// Why nothing can move between two links; empty if something can.
std::string rigid_pair(int a, int b, const LinkTable& links);

}  // namespace redysim
