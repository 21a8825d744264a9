#include "model/read/findings.hpp"

#include <algorithm>
#include <tuple>

namespace redysim {
namespace {

std::vector<Diagnostic> in_file_order(std::vector<Diagnostic> diagnostics) {
  std::stable_sort(diagnostics.begin(), diagnostics.end(),
                   [](const Diagnostic& first, const Diagnostic& second) {
                     return std::tie(first.line, first.column) < std::tie(second.line, second.column);
                   });
  return diagnostics;
}

}  // namespace

void Findings::error(Place place, std::string message) {
  errors_.push_back({file_, place.line, place.column, std::move(message)});
}

void Findings::warn(Place place, std::string message) {
  warnings_.push_back({file_, place.line, place.column, std::move(message)});
}

std::vector<Diagnostic> Findings::errors() const { return in_file_order(errors_); }
std::vector<Diagnostic> Findings::warnings() const { return in_file_order(warnings_); }

}  // namespace redysim
