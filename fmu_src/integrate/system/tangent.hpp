#pragma once

#include <vector>

#include "dynamics/assembly/assembly.hpp"
#include "dynamics/contact/contact_force.hpp"
#include "dynamics/equation_terms.hpp"
#include "dynamics/ground_motion.hpp"
#include "dynamics/sensed_wrench.hpp"
#include "integrate/system/control_tangent.hpp"
#include "integrate/system/system.hpp"
#include "math/dual.hpp"
#include "math/spatial.hpp"

namespace redysim {

class IndependentCoordinates;

// A System at one point with one direction of change, as dual numbers: exact directional derivatives. Created
// when a master first requests derivatives.
class Tangent {
 public:
  Tangent(const Model& model, const System& system);

  // Moves to (time, y) with these parameters and direction 0. Then set the directions of the independent
  // variables (q and qd of joints with one degree of freedom, force, balls, parameters) and call
  // apply_parameters or go_with_time.
  void go_to(const Parameters<double>& given, System& system, double time, const double* y);

  // Directions of the quaternion (any length) and the angular velocity of a spherical joint.
  struct BallChange {
    double quaternion[4] = {}, omega[3] = {};
  };
  std::vector<Dual> q, qd, force;  // for all joints; force: as System::recursion_inputs(), before actuators
  std::vector<BallChange> balls;
  Parameters<Dual> parameters;
  ControlTangent* control() { return features::control ? control_.get() : nullptr; }  // null: none
  // Passes the directions of the parameters to the plan, the controller, and to q, qd and balls, whose start
  // values are parameters.
  void apply_parameters();

  // Completes the directions of q and qd from those of the prescribed joints, as System::follow_jumps does
  // from (time, y), the state before the jump; loop constraints remain satisfied.
  void follow_jumps(System& system, double time, const double* y);

  // Completes the directions of q, qd and balls at (time, y) for joints in loops and rigid couplings, from
  // the directions dq, dqd of the independent coordinates.
  void follow_independent(const Model& model, System& system, double time, const double* y,
                          const IndependentCoordinates& chosen, const double* dq, const double* dqd);

  // Rates of all constraint rows at (time, y) with their directions, from those of q, qd and balls.
  const std::vector<Dual>& row_rates(System& system, double time, const double* y);

  // Replaces the directions of the start values by those of the assembled start. Returns the reason of a
  // failure; null: success.
  const char* follow_assembly(const Model& model, const Assembly& assembly);

  // Sets the direction of time; inputs follow their polynomials.
  void go_with_time(System& system, double time, const double* y);

  // Sets the directions of actuator states to those of their start, from q and qd.
  void start_actuators();

  // Violation of a constraint by the joint accelerations, after go_with_time; `constraint` < 0: rounding
  // only.
  struct Misfit {
    int constraint = -1;  // as Assembly::constraint
    Assembly::Residual acceleration;
  };
  Misfit constraint_misfit(const Model& model);

  // Evaluates the quantities below and their directions; false: not finite.
  bool evaluate();
  std::vector<Dual> qdd, drive;  // drive: forces on the joints
  // Input and response of an actuator.
  Dual actuator_input(int index) const { return actuator_inputs_[index]; }
  const ActuatorResponse<Dual>& actuator(int index) const { return responses_[index]; }
  // An entry of y; used for actuator states only.
  Dual& state(int place) { return state_[place]; }
  // Direction of the quaternion's time derivative, for a quaternion of any length.
  Eigen::Vector4d quaternion_slope(int ball) const;
  Dual power;  // of drives, dampers, ports and contacts
  Dual contact_power() const { return workspace_.contact_power; }
  Dual port_power(int port) const;  // power of the port's wrench
  std::vector<Dual> multipliers;    // per loop row
  Dual kinetic_energy(), potential_energy();
  Force<Dual> momentum();
  AcceleratedBody<Dual> body(int index);
  Force<Dual> sensed_wrench(const Frame& frame) const { return sensed_->of(frame); }
  EquationTerms<Dual>& terms() { return *terms_; }
  // Sum over the points of a contact, after evaluate().
  ContactResult<Dual> contact(int index, int link_a) const {
    return contact_result(plan_, workspace_, index, link_a);
  }
  struct BallMotion {
    Vec3<Dual> omega, alpha;
    Vec3<double> turn;  // rotation vector of the link, in link axes
  };
  BallMotion ball(int index) const;

 private:
  using Duals = std::vector<Dual>;  // per joint of the plan
  void set_balls();
  void expand(System& system, double time, const double* y, Duals& at, Duals& speed) const;
  void apply_actuators();
  int actuator_count() const { return actuators_ ? actuators_->size() : 0; }
  const ActuatorOf<Dual>& actuator_law(int index) const {
    return parameters.actuators[actuators_->number(index)];
  }
  BallAnglesOf<Dual> angles_in(const Duals& at, int ball) const;
  Vec3<Dual> omega_in(const Duals& at, const Duals& speed, int ball) const;
  void put_ball(int ball, const BallAngles& angles, const Vec3<double>& turn, const Vec3<Dual>& omega,
                Duals& at, Duals& speed) const;
  void set_directions(const Duals& at, const Duals& speed);
  void renew_charts(Duals& at, Duals& speed) const;
  Duals answer_to(const Duals& jump, const Duals& at);
  void add(const Duals& change, bool velocity, Duals& at, Duals& speed) const;
  void project(Duals& at, Duals& speed);
  void project_within_rank(Duals& at, Duals& speed, double pivot_tolerance);
  struct ResidualSize {
    double value, derivative;  // maxima over all rows; value is relative, derivative is not
  };
  ResidualSize residual_size(const Duals& at, const Duals& speed, bool velocity);
  void reduce(Duals& at, Duals& speed, bool velocity);

  Plan<Dual> plan_;
  Workspace<Dual> workspace_;
  std::vector<BallAngles> angles_;
  std::vector<Vec3<double>> ball_omega_, ball_turn_;
  std::vector<Eigen::Vector4d> ball_quaternion_;
  std::vector<BallAnglesOf<Dual>> moved_;
  InputLayout inputs_;
  bool with_time_ = false;
  std::unique_ptr<ControlTangent> control_;
  const Actuators* actuators_;  // null: none
  std::vector<Dual> state_;     // y; used for actuator states only
  std::vector<Dual> actuator_inputs_;
  std::vector<ActuatorResponse<Dual>> responses_;
  std::unique_ptr<SensedWrenches<Dual>> sensed_;  // null: no frame outputs its wrench
  std::unique_ptr<EquationTerms<Dual>> terms_;    // null: not requested
};

}  // namespace redysim
