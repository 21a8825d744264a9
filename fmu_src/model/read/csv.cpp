#include "model/read/csv.hpp"

#include <charconv>
#include <system_error>

namespace redysim {

std::vector<std::string> csv_cells(const std::string& line) {
  std::vector<std::string> out(1);
  bool quoted = false;
  for (char c : line) {
    if (c == '"')
      quoted = !quoted;
    else if (c == ',' && !quoted)
      out.emplace_back();
    else if (c != '\r' && !(out.back().empty() && (c == ' ' || c == '\t')))
      out.back() += c;
  }
  for (std::string& cell : out) cell.erase(cell.find_last_not_of(" \t") + 1);
  return out;
}

// Does not depend on the locale, whose decimal separator may be a comma.
bool csv_number(const std::string& cell, double& value) {
  const char* first = cell.c_str();
  const char* const last = first + cell.size();
  if (*first == '+' && first[1] != '-') ++first;
  const auto [end, error] = std::from_chars(first, last, value);
  return error == std::errc() && end == last;
}

}  // namespace redysim
