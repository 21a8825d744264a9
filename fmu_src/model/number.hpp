#pragma once

#include <limits>
#include <string>

namespace redysim {

// Minimum of positive fields; the number and its reciprocal are both normal numbers.
inline constexpr double minimum_positive = std::numeric_limits<double>::min();

// Error text for a number below `minimum` (0 or minimum_positive), "must be >= 0, got -1"; empty if it is
// valid.
std::string below(double minimum, double number);

// Decimal form with 15 to 17 digits that reads back as the same number, in any locale.
std::string shown(double number);

// Decimal form with 6 digits.
std::string rounded(double number);

}  // namespace redysim
