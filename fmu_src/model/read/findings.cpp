#include "model/read/findings.hpp"

#include <tuple>
#include <utility>

namespace redysim {
namespace {

// Inserts after all entries with the same or an earlier place.
void insert(std::vector<Diagnostic>& diagnostics, Diagnostic added) {
  auto at = diagnostics.end();
  while (at != diagnostics.begin() &&
         std::tie(added.line, added.column) < std::tie(at[-1].line, at[-1].column))
    --at;
  diagnostics.insert(at, std::move(added));
}

}  // namespace

void Findings::error(Place place, std::string message) {
  insert(errors_, {file_, place.line, place.column, std::move(message)});
}

void Findings::warn(Place place, std::string message) {
  insert(warnings_, {file_, place.line, place.column, std::move(message)});
}

}  // namespace redysim
