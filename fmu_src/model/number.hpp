#pragma once

#include <string>

namespace redysim {

// A decimal form of 15 to 17 digits that reads back as the same number, whatever the locale.
std::string shown(double number);

// The same to 6 digits.
std::string rounded(double number);

}  // namespace redysim
