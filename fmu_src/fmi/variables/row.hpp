#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <functional>

#include "dynamics/plan.hpp"
#include "math/dual.hpp"
#include "model/parameters.hpp"

// One role of variables in the running FMU, for example "<joint>.q" or "<frame>.position[i]". Rows are
// defined as part of an Entry (entry.hpp) in the file of their subject.

namespace redysim {

class OutputDerivatives;
class System;
class Values;
struct Variable;

enum class VariableType : std::uint8_t { real, integer, string };
enum class Causality : std::uint8_t { parameter, input, output, local };
enum class Variability : std::uint8_t { fixed, tunable, discrete, continuous };

// The owner of a variable; its name is the first part of the name of the variable.
enum class Owner : std::uint8_t { model, joint, ball, frame, loop, coupling, contact, link };

// What must be computed before reading a value.
enum class Needs : std::uint8_t {
  nothing,
  parameters,
  accelerations,
  slopes,
  energies,
  step_jacobian,
  step_jacobian_by_knowns
};

// Where a value is stored: a parameter in Parameters, an input in System::inputs(), a prescribed motion by
// its order of differentiation.
enum class Storage : std::uint8_t { none, parameter, input, motion };

// The part of the state y (StateLayout) that a variable represents, or whose time derivative it is.
enum class StatePart : std::uint8_t {
  none,
  q,
  quaternion,
  qd,
  omega,
  motor_q,
  motor_qd,
  current,
  lagged,
  work,
  contact_work,
  independent_q,
  independent_qd
};

enum class Bounds : std::uint8_t { none, not_negative, positive, tolerance };

// What a known acts on. Used for dependencies and for checks after tuning.
namespace acts {
inline constexpr unsigned force = 1;
inline constexpr unsigned position = 2, velocity = 4;  // start values, or a prescribed motion
inline constexpr unsigned mass = 8, weight = 16, armature = 32;
inline constexpr unsigned potential = 64, resistance = 128;  // springs and stops; dampers and friction
inline constexpr unsigned gravity = 256;
inline constexpr unsigned target = 512, gain = 1024;
}  // namespace acts

struct Scene {
  const Model& model;
  const Plan<double>& plan;
  int velocities() const { return plan.nv - static_cast<int>(plan.balls.size()); }
  int positions() const { return plan.nv; }  // a quaternion of each spherical joint
  bool is_in_cluster(int joint) const {
    for (const ClusterPlan& cluster : plan.clusters)
      if (std::binary_search(cluster.joints.begin(), cluster.joints.end(), joint, std::greater<>()))
        return true;
    return false;
  }
};

// Numbers of rows or columns that depend on the model.
inline constexpr std::uint8_t per_velocity = 255;  // of the tree (dynamics/equation_terms.hpp)
inline constexpr std::uint8_t per_coordinate = 254, per_input = 253, per_tunable = 252;  // of a step Jacobian
inline constexpr std::uint8_t per_position = 251, per_actuator_state = 250;  // of a state to apply
inline constexpr std::uint8_t per_independent = 249;
struct Lengths {
  int velocities = 0, positions = 0, actuator_states = 0, inputs = 0, tunables = 0, independent = 0;
  int of(std::uint8_t length) const {
    switch (length) {
      case per_velocity:
        return velocities;
      case per_coordinate:
        return 2 * velocities + actuator_states;
      case per_input:
        return inputs;
      case per_tunable:
        return tunables;
      case per_position:
        return positions;
      case per_actuator_state:
        return actuator_states;
      case per_independent:
        return independent;
      default:
        return length;
    }
  }
};

// A character array: a pointer would need relocation when the library is loaded.
struct RowName {
  constexpr RowName(const char* name) {
    for (int i = 0; name[i]; ++i) text[i] = name[i];  // a name that is too long does not compile
  }
  char text[24] = {};
};

struct Row {
  RowName name = "";
  Owner owner = Owner::model;
  VariableType type = VariableType::real;
  Causality causality = Causality::output;
  Variability variability = Variability::continuous;
  // array with index "[i]", or "[i,j]" if columns > 0; 1, 0: scalar; each may be one of Lengths
  std::uint8_t rows = 1, columns = 0;
  Bounds bounds = Bounds::none;
  std::uint8_t bounded = 255;  // the bounds apply only to this number of first elements
  bool in_group = false;       // exists if `group` is requested; a local variable if it is not
  OutputGroup group = OutputGroup::acceleration;
  Needs needs = Needs::nothing;
  Storage storage = Storage::none;
  std::uint8_t motion_order = 0;    // order of a prescribed motion: 0 position, 1 velocity, 2 acceleration
  bool adds_to_controller = false;  // named "<name>_added" if a controller drives the joint
  bool has_direction = false;       // derivatives by it exist
  bool rate_is_next = false;        // its time derivative is the value of the next row
  bool is_indicator = false;        // an event indicator of model exchange, without derivatives
  StatePart state = StatePart::none, slope_of = StatePart::none;
  std::uint16_t acts = 0;

  int elements(const Lengths& lengths) const {
    return lengths.of(rows) * (columns ? lengths.of(columns) : 1);
  }
  bool has_state() const { return state != StatePart::none || slope_of != StatePart::none; }
  bool is_array() const { return rows > 1 || columns > 0; }
};

// The rows of a group and their functions, which take the row index; null if no row has this function.
struct RowGroup {
  const Row* rows;
  int count;
  bool (*exists)(int row, const Scene&, const Variable&);
  double (*read)(int row, Values&, const Variable&);
  // of a parameter; null: not a Real parameter, or without derivatives
  double* (*place)(int row, Parameters<double>&, const Variable&);
  Dual* (*dual_place)(int row, Parameters<Dual>&, const Variable&);
  int (*input)(int row, const System&, const Variable&);  // index into System::inputs()
  double (*derivative)(int row, OutputDerivatives&, const Variable&);

  const Row* begin() const { return rows; }
  const Row* end() const { return rows + count; }
};

}  // namespace redysim
