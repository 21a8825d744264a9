#include <gtest/gtest.h>

#include <filesystem>
#include <set>

#include "fmi/instance/simulation.hpp"
#include "model/read/model_file.hpp"

namespace redysim {
namespace {

TEST(VariableTable, names_and_references_are_unique_in_every_model) {
  for (const auto& file : std::filesystem::directory_iterator(REDYSIM_MODELS)) {
    if (file.path().extension() != ".toml") continue;
    const Model model = read_model_file(file.path().string()).model;
    const Simulation simulation(model, false);
    const VariableTable& table = simulation.table;
    std::set<std::string> names;
    for (const Variable& variable : table.all()) {
      EXPECT_TRUE(names.insert(variable.name).second) << file.path() << ": " << variable.name;
      const unsigned reference = variable.value_reference;
      const Variable* found = variable.type() == VariableType::real      ? table.real(reference)
                              : variable.type() == VariableType::integer ? table.integer(reference)
                                                                         : table.string(reference);
      EXPECT_EQ(found, &variable) << file.path() << ": " << variable.name;
    }
  }
}

TEST(VariableTable, unknown_references_mean_nothing) {
  const Model model = read_model_file(REDYSIM_MODELS "/pendulum.toml").model;
  const VariableTable table(model, Plan<double>(model), {});
  EXPECT_EQ(table.real(static_cast<unsigned>(-1)), nullptr);
  EXPECT_EQ(table.integer(1u << 30), nullptr);
  EXPECT_EQ(table.string(1u << 30), nullptr);
}

}  // namespace
}  // namespace redysim
