#pragma once

#include <string>
#include <vector>

#include "model/model.hpp"
#include "model/read/model_error.hpp"

namespace redysim {

struct ModelFile {
  Model model;
  std::vector<Diagnostic> warnings;
  std::string source;                 // bytes of the file, followed by those of attached files
  std::vector<std::string> attached;  // names of files in the same folder from which it reads tables
};

// Reads and checks a model file (TOML; fields in docs/model_file.md). Throws ModelError with all errors.
ModelFile read_model_file(const std::string& path);

// The same for text in memory; `name` replaces the path in messages.
ModelFile read_model_text(const std::string& text, const std::string& name);

}  // namespace redysim
