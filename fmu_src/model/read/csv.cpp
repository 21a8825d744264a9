#include "model/read/csv.hpp"

#include <cstdlib>

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

bool csv_number(const std::string& cell, double& value) {
  char* end = nullptr;
  value = std::strtod(cell.c_str(), &end);
  return !cell.empty() && *end == '\0';
}

}  // namespace redysim
