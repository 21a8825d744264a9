#pragma once

#include <vector>

#include "dynamics/plan.hpp"
#include "integrate/actuator/actuator_law.hpp"
#include "integrate/system/state_layout.hpp"
#include "math/dual.hpp"

namespace redysim {

// The actuators of integrated joints: convert inputs to torques on the joints and compute the slopes of
// actuator states. Neither allocates nor throws after construction.
class Actuators {
 public:
  // `integrated`: the joints in the state, in the order of their positions.
  Actuators(const Model& model, const std::vector<int>& integrated, const std::vector<int>& carrier);

  bool empty() const { return list_.empty(); }
  int size() const { return static_cast<int>(list_.size()); }
  int at(int joint) const;  // index of the actuator of a joint, or -1
  int joint(int index) const { return list_[index].joint; }
  const Actuator& law(int index) const { return list_[index].law; }
  int number(int index) const { return list_[index].number; }  // index into Model::actuators
  void update(const Parameters<double>& parameters);
  ActuatorCounts counts() const { return counts_; }
  void set_layout(const StateLayout& layout) { layout_ = layout; }

  // Indices of the states of an actuator in y; -1: the actuator does not have this state.
  struct Places {
    int motor_q, motor_qd, current, lagged;
  };
  Places places(int index) const;

  // Replaces the actuator inputs in `forces` (per joint) by torques on the joints.
  void apply(const double* y, double* forces);
  // Swaps the inputs of the last `apply` with the entries of `forces`.
  void exchange_inputs(double* forces);

  // Input and response of the last `apply`.
  double input(int index) const { return inputs_[index]; }
  const ActuatorResponse<double>& response(int index) const { return responses_[index]; }
  void set_slopes(const double* y, double* ydot) const;
  double power() const;  // additional to the power of the torques on the joints, W

  template <class Scalar>
  ActuatorPoint<Scalar> point(int index, const Scalar* y, const Scalar& q, const Scalar& qd,
                              const Scalar& input) const {
    const Places place = places(index);
    const auto state = [y](int entry) { return entry < 0 ? Scalar(0) : y[entry]; };
    return {
        input, q, qd, state(place.motor_q), state(place.motor_qd), state(place.current), state(place.lagged)};
  }
  template <class Scalar>
  Scalar kinetic_energy(int index, const Scalar* y) const {
    const int place = places(index).motor_qd;
    return place < 0 ? Scalar(0) : Scalar(0.5 * law(index).rotor_inertia * y[place] * y[place]);
  }
  // `gear`: its law, with parameters of any scalar type.
  template <class Scalar, class Number>
  Scalar potential_energy(int index, const ActuatorOf<Number>& gear, const Scalar* y, const Scalar& q) const {
    const int place = places(index).motor_q;
    if (place < 0) return Scalar(0);
    const Scalar twist = y[place] / gear.gear_ratio - q;
    return ElasticForce<Scalar>(gear_law(gear), twist, Scalar(0)).energy;
  }

  // Sets the scales of an actuator's states (System::scales), from the scale of its joint's motion and the
  // joint's acceleration under a unit torque. `scales` begins with the first actuator state.
  void set_scales(int index, double of_joint, double response, double* scales) const;

  // Sets the states at the start: gears without twist, zero current and lagged input.
  void set_start(double* y) const;

  // While resting (integrate/system/equilibrium.hpp), `apply` gives the torques of constant inputs, and
  // slopes are 0.
  void rest(bool resting) { resting_ = resting; }
  bool is_resting() const { return resting_; }
  // Sets the states at which the actuators rest under the inputs of the last `apply`.
  void set_rest(double* y) const;

 private:
  struct Placed {
    Actuator law;
    int number, joint, place;  // indices in the model, the plan and the state
    int motor = -1, current = -1, lagged = -1;
  };
  std::vector<Placed> list_;
  ActuatorCounts counts_;
  StateLayout layout_;
  std::vector<double> inputs_;
  std::vector<ActuatorResponse<double>> responses_;
  bool resting_ = false;
};

// Derivatives of a response by the entries of its point.
struct ActuatorGradient {
  enum Entry { input, q, qd, motor_q, motor_qd, current, lagged, entries };
  ActuatorResponse<Dual> by[entries];
};
// `resting`: as Actuators::rest.
ActuatorGradient gradient(const Actuator& law, const ActuatorPoint<double>& at, bool resting);

}  // namespace redysim
