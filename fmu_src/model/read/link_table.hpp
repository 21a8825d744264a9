#pragma once

#include <string>
#include <vector>

#include "model/read/names.hpp"

namespace redysim {

// Names and rigid connections of the links, for the readers of loops, springs and contacts.
struct LinkTable {
  LinkIndex index;
  std::vector<int> carriers;       // rigid_carriers(); empty: unknown, no check
  std::vector<std::string> names;  // by link index
};

// Reason why two links cannot move relative to each other; empty if they can.
std::string rigid_pair(int a, int b, const LinkTable& links);

}  // namespace redysim
