#pragma once

#include <memory>
#include <string>

#include "fmi/instance/values.hpp"
#include "integrate/system/tangent.hpp"

namespace redysim {

// Exact derivatives of outputs at the last communication point: along a direction of the knowns at fixed
// state, or with respect to time. Functions with a string result return the reason of a failure, empty on
// success.
class OutputDerivatives {
 public:
  OutputDerivatives(Simulation& simulation, CurrentState& state, Values& values);
  ~OutputDerivatives();

  // Along a direction: call begin, set_direction for each known, follow, evaluate, read.
  std::string begin();
  void set_direction(const Variable& known, double direction);
  std::string follow(bool in_initialization);
  // With respect to time: call go_with_time, evaluate, read.
  std::string go_with_time();
  std::string evaluate();
  double read(const Variable& output) {
    const RowGroup& group = *output.group;
    return group.derivative ? group.derivative(output.row_index(), *this, output) : 0;
  }

  // sensitivity = seed^T times the derivatives, by one reverse sweep. False: not available for this model or
  // for one of these variables.
  bool pull_back(const unsigned* unknowns, std::size_t unknown_count, const unsigned* knowns,
                 std::size_t known_count, const double* seed, double* sensitivity);

  // Why the derivative with respect to a known does not exist; empty if it does.
  std::string objection(const Variable& known, double direction, bool in_initialization) const;

  // --- for rows of variables ---

  const Model& model() const { return simulation_.model; }
  Values& values() { return values_; }
  Tangent& tangent() { return *tangent_; }
  double energy() { return tangent().kinetic_energy().derivative + tangent().potential_energy().derivative; }
  double work();
  double contact_work();
  double balance();
  IndependentCoordinates::Direction independent(int k) {
    return state_.independent().direction(k, state_.y(), *tangent_);
  }

 private:
  std::string follow_jumps();
  void follow_independent();
  void change_state(const Variable& known, double direction);
  bool add_weight(const Variable& unknown, double weight);
  const double* gradient(const Variable& known) const;
  bool take_weights(const unsigned* unknowns, std::size_t count, const double* seed);
  bool sweep_back();
  void pull_ball(int ball, const double* qdd);
  void pull_actuators(const System::Coordinates& at);
  ActuatorGradient gradient_of(int actuator, const System::Coordinates& at);

  // Source of the work's derivative: zero, the energy (jump of a prescribed motion), the power, or the
  // direction given for the work state.
  enum class Work { none, of_energy, by_power, given };

  Simulation& simulation_;
  CurrentState& state_;
  Values& values_;
  std::unique_ptr<Tangent> tangent_;  // null before the first request
  struct Reverse;
  std::unique_ptr<Reverse> reverse_;  // null before the first request
  bool jumps_ = false;                // the direction changes the position or velocity of a prescribed joint
  bool moves_state_ = false;          // the direction changes the state itself
  double work_change_[2] = {0, 0};    // direction of the work states
  std::vector<double> independent_;   // directions of independent positions, then velocities; empty: none
  Work work_ = Work::none;
};

// Derivative of a component of a unit quaternion if the rotation changes by the rotation vector `turn` (in
// its own axes).
double quaternion_change(Eigen::Vector4d quaternion, const Vec3<double>& turn, int component);

}  // namespace redysim
