#pragma once

#include <string>
#include <vector>

namespace redysim {

// Cells of a line of a CSV file, without blanks around them and without quotation marks.
std::vector<std::string> csv_cells(const std::string& line);

// False: the cell is not a number.
bool csv_number(const std::string& cell, double& value);

}  // namespace redysim
