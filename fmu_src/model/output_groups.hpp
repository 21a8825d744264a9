#pragma once

// Optional outputs of the FMU: groups that `[fmu] outputs` requests by name (docs/model_file.md).

namespace redysim {

enum class OutputGroup : unsigned char {
  acceleration,
  energy,
  solver,
  momentum,
  reference,
  power,
  actuator,
  step_jacobian,
  parameter_jacobian,
  state,  // enabled by `[fmu] tunable`
  mass_matrix,
  bias,
  gravity_torque,
  coriolis,
  passive,
  reaction,
  regressor,
  constraint_jacobian
};

struct OutputGroupRow {
  char name[20];  // a pointer would need relocation when the library is loaded
  OutputGroup group;
  bool by_default;  // shown if the model file has no list
};

inline constexpr OutputGroupRow output_groups[] = {
    {"acceleration", OutputGroup::acceleration, true},
    {"energy", OutputGroup::energy, true},
    {"solver", OutputGroup::solver, true},
    {"momentum", OutputGroup::momentum, false},
    {"reference", OutputGroup::reference, false},
    {"power", OutputGroup::power, false},
    {"actuator", OutputGroup::actuator, false},
    {"step_jacobian", OutputGroup::step_jacobian, false},
    {"parameter_jacobian", OutputGroup::parameter_jacobian, false},
    {"mass_matrix", OutputGroup::mass_matrix, false},
    {"bias", OutputGroup::bias, false},
    {"gravity_torque", OutputGroup::gravity_torque, false},
    {"coriolis", OutputGroup::coriolis, false},
    {"passive", OutputGroup::passive, false},
    {"reaction", OutputGroup::reaction, false},
    {"regressor", OutputGroup::regressor, false},
    {"constraint_jacobian", OutputGroup::constraint_jacobian, false},
};

// A set of groups.
class OutputGroups {
 public:
  static constexpr OutputGroups by_default() {
    OutputGroups groups;
    for (const OutputGroupRow& row : output_groups)
      if (row.by_default) groups.add(row.group);
    return groups;
  }
  constexpr bool has(OutputGroup group) const { return (bits_ & bit(group)) != 0; }
  constexpr bool has_any_from(OutputGroup group) const { return bits_ >= bit(group); }
  constexpr void add(OutputGroup group) { bits_ |= bit(group); }

 private:
  static constexpr unsigned bit(OutputGroup group) { return 1u << static_cast<unsigned>(group); }
  unsigned bits_ = 0;
};

}  // namespace redysim
