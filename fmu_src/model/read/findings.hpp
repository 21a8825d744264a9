#pragma once

#include <cstddef>
#include <string>
#include <vector>

#include "model/read/model_error.hpp"

namespace redysim {

// A position in the model file, counted from 1.
struct Place {
  int line = 0, column = 0;
};

// Collects all errors and warnings about a file.
class Findings {
 public:
  explicit Findings(std::string file) : file_(std::move(file)) {}

  void error(Place place, std::string message);
  void warn(Place place, std::string message);
  std::size_t error_count() const { return errors_.size(); }

  // in the order of the file
  const std::vector<Diagnostic>& errors() const { return errors_; }
  const std::vector<Diagnostic>& warnings() const { return warnings_; }

 private:
  std::string file_;
  std::vector<Diagnostic> errors_, warnings_;
};

}  // namespace redysim
