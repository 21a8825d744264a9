#include "fmi/number.hpp"

#include <charconv>

namespace redysim {

std::string shortest(double value) {
  char text[32];
  const auto end = std::to_chars(text, text + sizeof text, value);
  return std::string(text, end.ptr);
}

}  // namespace redysim
