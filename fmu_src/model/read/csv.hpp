#pragma once

#include <string>
#include <vector>

namespace redysim {

// Cells of one line of a CSV file, without surrounding blanks and without quotation marks.
std::vector<std::string> csv_cells(const std::string& line);

// Returns false if the cell is not a number.
bool csv_number(const std::string& cell, double& value);

}  // namespace redysim
