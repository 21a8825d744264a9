#pragma once

#include <string>
#include <vector>

#include "model/read/model_file.hpp"

namespace redysim::test {

inline Model read(const std::string& text) { return read_model_text(text, "m.toml").model; }

// What a file is refused for, "line: message" each; empty when it is accepted.
inline std::vector<std::string> errors(const std::string& text) {
  std::vector<std::string> found;
  try {
    read_model_text(text, "m.toml");
  } catch (const ModelError& error) {
    for (const Diagnostic& diagnostic : error.diagnostics())
      found.push_back(std::to_string(diagnostic.line) + ": " + diagnostic.message);
  }
  return found;
}

inline std::vector<std::string> warnings(const std::string& text) {
  std::vector<std::string> found;
  for (const Diagnostic& diagnostic : read_model_text(text, "m.toml").warnings)
    found.push_back(std::to_string(diagnostic.line) + ": " + diagnostic.message);
  return found;
}

using Lines = std::vector<std::string>;

// A sound link on lines 2 to 5, and two on lines 2 to 9; what a test appends still belongs to the last link.
inline const std::string arm =
    "name = 'm'\n"
    "[[link]]\n"
    "name = 'a'\nmass = 1\n"
    "inertia = [1, 1, 1]\n";
inline const std::string arms = arm +
                                "[[link]]\n"
                                "name = 'b'\nmass = 1\n"
                                "inertia = [1, 1, 1]\n";

}  // namespace redysim::test
