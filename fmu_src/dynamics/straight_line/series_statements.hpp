#pragma once

#include <string>

#include "dynamics/straight_line/straight_line.hpp"

namespace redysim {

// The C++ definitions of the symbols of a line in taylor_series.hpp. Completes the line's tape by the missing
// sines and cosines. Throws std::domain_error for functions without a recursion.
std::string series_definitions(StraightLine& line);

}  // namespace redysim
