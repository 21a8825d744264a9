#include "model/number.hpp"

#include <charconv>
#include <cmath>
#include <cstdio>

namespace redysim {
namespace {

// std::to_chars would add 140 kB of tables to every FMU; printf uses the decimal separator of the locale.
std::string printed(double number, int digits) {
  char text[40];
  std::snprintf(text, sizeof text, "%.*g", digits, number);
  std::string result;
  bool in_point = false;  // inside the decimal separator, which may have several bytes
  for (const char* c = text; *c; ++c) {
    const bool plain = (*c >= '0' && *c <= '9') || (*c >= 'a' && *c <= 'z') || *c == '-' || *c == '+';
    if (plain || !in_point) result += plain ? *c : '.';
    in_point = !plain;
  }
  return result;
}

}  // namespace

std::string shown(double number) {
  if (std::isnan(number)) return "nan";
  for (int digits = 15; digits < 17; ++digits) {
    const std::string text = printed(number, digits);
    double back = 0;
    std::from_chars(text.data(), text.data() + text.size(), back);
    if (back == number) return text;
  }
  return printed(number, 17);
}

std::string rounded(double number) { return printed(number, 6); }

std::string below(double minimum, double number) {
  if (number >= minimum) return {};
  const bool positive = minimum == minimum_positive;
  std::string bound = positive ? "> 0" : ">= " + shown(minimum);
  if (positive && number > 0) bound += " and at least " + shown(minimum);
  return "must be " + bound + ", got " + shown(number);
}

}  // namespace redysim
