// Any bytes as a model file: a model, or a ModelError with a place; and a model that is read can be planned.

#include <cstddef>
#include <cstdint>
#include <string>

#include "fmi/instance/simulation.hpp"
#include "model/read/model_file.hpp"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace redysim;
  try {
    const ModelFile file =
        read_model_text(std::string(reinterpret_cast<const char*>(data), size), "fuzz.toml");
    if (file.model.links.size() > 200) return 0;
    const Simulation simulation(file.model, false);
    if (simulation.table.all().empty()) __builtin_trap();
  } catch (const ModelError& error) {
    if (error.diagnostics().empty()) __builtin_trap();
  }
  return 0;
}
