#pragma once

#include <limits>
#include <string>

namespace redysim {

// The minimum of what must be positive: it and its reciprocal are normal numbers.
inline constexpr double minimum_positive = std::numeric_limits<double>::min();

// Why a number is below `minimum`, 0 or minimum_positive: "must be >= 0, got -1"; empty if it is not.
std::string below(double minimum, double number);

// A decimal form of 15 to 17 digits that reads back as the same number, whatever the locale.
std::string shown(double number);

// The same to 6 digits.
std::string rounded(double number);

}  // namespace redysim
