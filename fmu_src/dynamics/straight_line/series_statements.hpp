#pragma once

#include <string>

#include "dynamics/straight_line/straight_line.hpp"

namespace redysim {

// The C++ definitions of the symbols of a line in taylor_series.hpp. Throws std::domain_error for functions
// without a recursion.
std::string series_definitions(const StraightLine& line);

}  // namespace redysim
