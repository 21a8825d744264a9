#pragma once

#include <string>

namespace redysim {

// The shortest decimal text that reads back as the same double, whatever the locale; "nan", "inf", "-inf".
std::string shortest(double value);

}  // namespace redysim
