#pragma once

#include <memory>
#include <string>
#include <vector>

#include "dynamics/contact/contact_force.hpp"
#include "dynamics/equation_terms.hpp"
#include "dynamics/ground_motion.hpp"
#include "dynamics/sensed_wrench.hpp"
#include "fmi/instance/parameter_set.hpp"
#include "fmi/instance/prescribed_motion.hpp"
#include "fmi/instance/step_jacobian.hpp"
#include "fmi/variables/state_place.hpp"
#include "math/spatial.hpp"

namespace redysim {

// Quantities at the last communication point, computed on demand.
class Values {
 public:
  Values(Simulation& simulation, CurrentState& state, ParameterSet& parameters, PrescribedMotion& motion);

  void changed() {
    accelerations_are_current_ = slopes_are_current_ = energies_are_current_ = false;
    coordinates_are_current_ = bodies_are_moved_ = false;
  }
  bool are_current(Needs needs) const {
    switch (needs) {
      case Needs::nothing:  // in equilibrium, the start and the response to jumps depend on all parameters
        return parameters_.in_force() ||
               (integrator() ? !parameters_.state_is_due() && state_.follows_motion()
                             : !simulation_.model.starts_in_equilibrium);
      case Needs::parameters:
        return parameters_.in_force();
      case Needs::accelerations:
        return accelerations_are_current_;
      case Needs::slopes:
        return slopes_are_current_;
      case Needs::energies:
        return energies_are_current_;
      case Needs::step_jacobian:
      case Needs::step_jacobian_by_knowns:
        return step_jacobian_->is_current(needs == Needs::step_jacobian_by_knowns);
    }
    return false;
  }
  // Returns why the values cannot be computed, empty on success.
  std::string update(Needs needs);
  // The value of a variable, and its time derivative if the row has rate_is_next. Call update(needs) first.
  double read(const Variable& variable) {
    return variable.row->storage == Storage::none
               ? variable.group->read(variable.row_index(), *this, variable)
               : read_known(variable);
  }
  double read_rate(const Variable& variable);

  // --- for rows of variables; each row states its needs ---

  const Model& model() const { return simulation_.model; }
  const Plan<double>& plan() const { return simulation_.plan; }
  System& system() { return simulation_.system; }
  const Integrator* integrator() const { return simulation_.integrator.get(); }  // null: no step yet
  System::Coordinates coordinates() {
    if (!coordinates_are_current_) update_coordinates();
    return coordinates_;
  }
  JointMotion reference(int joint) { return simulation_.system.reference(joint, simulation_.time); }
  double acceleration(int joint) const { return accelerations_[joint]; }
  // Workspace with the motion of the bodies, independent of the values that were read before: accelerations,
  // energies and momentum leave other rounding errors there.
  const Workspace<double>& moved_bodies();
  Force<double> momentum();
  // References are valid until the next call.
  const AcceleratedBody<double>& body(int index);
  const ContactResult<double>& contact(int index);
  Force<double> sensed_wrench(int frame) const { return sensed_->of(model().frames[frame]); }
  EquationTerms<double>& terms() { return *terms_; }
  StepJacobian* step_jacobian() { return step_jacobian_.get(); }  // null: not requested
  // Force or torque on a joint: its input, with the torque of controller or actuator, or the force required
  // by its prescribed motion.
  double drive_force(int joint) const {
    return has_drive_forces() ? drive_forces_[joint] : simulation_.system.recursion_inputs()[joint];
  }
  // Input of the drive: that of its actuator if there is one, otherwise drive_force.
  double drive_input(int joint) {
    const Actuators* actuators = simulation_.system.actuators();
    const int index = actuators ? actuators->at(joint) : -1;
    return index < 0 ? drive_force(joint) : actuators->input(index);
  }
  // Response of a joint's actuator.
  const ActuatorResponse<double>& actuator(int joint) {
    const Actuators& actuators = *simulation_.system.actuators();
    return actuators.response(actuators.at(joint));
  }
  const double* ball_quaternion(int ball) {
    return simulation_.system.layout().quaternion.of(state_.y(), ball);  // of any length
  }
  const Vec3<double>& ball_acceleration(int ball) const { return ball_accelerations_[ball]; }
  // Index in y of the state that a variable is (Row::state), or whose derivative it is; -1: none.
  int place(const Variable& variable) const {
    return place_of(simulation_.system, variable.row->state, variable);
  }
  double state(const Variable& variable) { return state_.y()[place(variable)]; }
  int place_of_slope(const Variable& variable) const {
    return place_of(simulation_.system, variable.row->slope_of, variable);
  }
  IndependentCoordinates::Motion independent(int k) {
    return state_.independent().motion(k, state_.y(), slopes_are_current_ ? slopes_.data() : nullptr);
  }
  double margin();  // of the independent coordinates: negative where an event should replace them
  const std::string& independent_joint(int k) {
    return model().links[plan().joints[state_.independent().joint(k)].link].joint.name;
  }
  // Index among the states of model exchange, or -1.
  int exchanged_place(const Variable& variable) const {
    return redysim::exchanged_place(simulation_.system, simulation_.independent(), variable.row->state,
                                    variable);
  }
  double slope(const Variable& variable) const { return slopes_[place_of_slope(variable)]; }
  const std::vector<double>& slopes() const { return slopes_; }
  bool is_integrated_outside() const { return simulation_.model_exchange && simulation_.integrator; }
  double kinetic_energy() const { return kinetic_energy_; }
  double potential_energy() const { return potential_energy_; }
  double work() { return simulation_.system.work(state_.y()); }
  double contact_work() { return simulation_.system.contact_work(state_.y()); }
  double energy_balance();

 private:
  double read_known(const Variable& variable);
  void update_coordinates();
  bool has_drive_forces() const { return simulation_.plan.has_motion() || simulation_.system.control(); }
  std::string update_accelerations();
  std::string update_slopes();
  std::string not_finite() const;
  void update_sensed_wrenches();

  Simulation& simulation_;
  CurrentState& state_;
  ParameterSet& parameters_;
  PrescribedMotion& motion_;
  std::vector<double> accelerations_, drive_forces_;  // of all joints
  std::vector<Vec3<double>> ball_accelerations_;
  std::unique_ptr<SensedWrenches<double>> sensed_;  // null: no frame outputs its wrench
  std::unique_ptr<EquationTerms<double>> terms_;    // null: not requested
  std::unique_ptr<StepJacobian> step_jacobian_;     // null: not requested
  std::vector<double> slopes_;                      // of y; empty before the first request
  std::vector<double> q_, qd_;                      // of all joints; empty without prescribed motions
  System::Coordinates coordinates_{};               // q_, qd_ or the state
  static constexpr int none = ground - 1;
  // the quantity read last, at the present accelerations: components are usually read one after the other
  template <class Quantity>
  struct Last {
    int index = none;
    Quantity value;
  };
  Last<AcceleratedBody<double>> body_;
  Last<ContactResult<double>> contact_;
  double kinetic_energy_ = 0, potential_energy_ = 0;
  bool accelerations_are_current_ = false, slopes_are_current_ = false, energies_are_current_ = false;
  bool coordinates_are_current_ = false, bodies_are_moved_ = false;
};

}  // namespace redysim
