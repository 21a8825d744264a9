#pragma once

#include <limits>
#include <string>

namespace redysim {

// Minimum of positive fields: it and its reciprocal are normal numbers.
inline constexpr double minimum_positive = std::numeric_limits<double>::min();

// The error of a number below `minimum` (0 or minimum_positive): "must be >= 0, got -1"; empty if it is
// valid.
std::string below(double minimum, double number);

// A decimal form of 15 to 17 digits that is read as the same number, in any locale.
std::string shown(double number);

// The same to 6 digits.
std::string rounded(double number);

}  // namespace redysim
