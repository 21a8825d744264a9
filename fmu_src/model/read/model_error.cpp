#include "model/read/model_error.hpp"

namespace redysim {
namespace {

std::string joined(const std::vector<Diagnostic>& diagnostics) {
  std::string text;
  for (const Diagnostic& diagnostic : diagnostics) {
    if (!text.empty()) text += '\n';
    text += diagnostic.text();
  }
  return text;
}

}  // namespace

std::string Diagnostic::text() const {
  if (line == 0) return file + ": " + message;
  return file + ":" + std::to_string(line) + ":" + std::to_string(column) + ": " + message;
}

ModelError::ModelError(Reason reason, std::vector<Diagnostic> diagnostics)
    : std::runtime_error(joined(diagnostics)), reason_(reason), diagnostics_(std::move(diagnostics)) {}

}  // namespace redysim
