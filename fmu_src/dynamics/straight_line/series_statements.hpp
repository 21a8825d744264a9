#pragma once

#include <string>

#include "dynamics/straight_line/straight_line.hpp"

namespace redysim {

// C++ definitions for a line of the symbols declared in taylor_series.hpp. Throws std::domain_error for
// functions without a recursion.
std::string series_definitions(const StraightLine& line);

}  // namespace redysim
