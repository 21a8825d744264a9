#pragma once

#include <string>
#include <vector>

#include "model/model.hpp"
#include "model/read/model_error.hpp"

namespace redysim {

struct ModelFile {
  Model model;
  std::vector<Diagnostic> warnings;
  std::string source;                 // the file's bytes, then those of attached files
  std::vector<std::string> attached;  // names of files beside it that it takes tables from
};

// Reads and checks a model file (TOML; fields in docs/model_file.md). Throws ModelError with all errors.
ModelFile read_model_file(const std::string& path);

// The same for text in memory; `name` stands for the file in messages.
ModelFile read_model_text(const std::string& text, const std::string& name);

}  // namespace redysim
