#pragma once

#include <string>
#include <vector>

#include "model/model.hpp"
#include "model/read/model_error.hpp"

namespace redysim {

// Warns about fields that read_model_file accepts but that have no effect, and about numbers in radians that
// look like degrees. `file`: a valid model file; `model`: the result of reading it. Separate from
// read_model_file because the library does not need these warnings.
std::vector<Diagnostic> idle_fields(const std::string& file, const Model& model);

// The same for text in memory; `name` replaces the path in messages.
std::vector<Diagnostic> idle_fields_of(const std::string& text, const std::string& name, const Model& model);

}  // namespace redysim
