#pragma once

#include <fstream>
#include <map>
#include <sstream>
#include <stdexcept>
#include <string>
#include <vector>

// The reference tables of tests/scenes, by column name.

namespace redysim::test {

struct SceneTable {
  std::map<std::string, std::size_t> columns;
  std::vector<std::vector<double>> rows;

  explicit SceneTable(const std::string& name) {
    std::ifstream file(std::string(REDYSIM_SCENES "/") + name + ".csv");
    std::string line, cell;
    if (!std::getline(file, line)) throw std::runtime_error("no reference table " + name);
    std::istringstream header(line);
    while (std::getline(header, cell, ',')) columns.emplace(cell, columns.size());
    while (std::getline(file, line)) {
      std::istringstream cells(line);
      rows.emplace_back();
      while (std::getline(cells, cell, ',')) rows.back().push_back(std::stod(cell));
    }
  }

  double at(std::size_t row, const std::string& column) const { return rows[row].at(columns.at(column)); }

  // Columns prefix1, prefix2, ... of one row.
  std::vector<double> vector(std::size_t row, const std::string& prefix, int count) const {
    std::vector<double> out;
    for (int i = 1; i <= count; ++i) out.push_back(at(row, prefix + std::to_string(i)));
    return out;
  }
};

}  // namespace redysim::test
