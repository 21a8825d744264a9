#pragma once

#include <string>
#include <vector>

#include "model/model.hpp"
#include "model/read/model_error.hpp"

namespace redysim {

// Warnings about fields that read_model_file accepts and that have no effect, or look like degrees where
// angles are in radians. `file` is a valid model file, `model` what was read from it. Not part of
// read_model_file, because the library has no use for them.
std::vector<Diagnostic> idle_fields(const std::string& file, const Model& model);

// The same for text in memory; `name` stands for the file in messages.
std::vector<Diagnostic> idle_fields_of(const std::string& text, const std::string& name, const Model& model);

}  // namespace redysim
