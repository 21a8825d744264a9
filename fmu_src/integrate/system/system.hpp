#pragma once

#include <memory>
#include <vector>

#include "dynamics/ball.hpp"
#include "dynamics/loops/loop_rows.hpp"
#include "dynamics/plan.hpp"
#include "dynamics/workspace.hpp"
#include "integrate/actuator/actuators.hpp"
#include "integrate/control/control.hpp"
#include "integrate/system/contact_search.hpp"
#include "integrate/system/state_layout.hpp"
#include "model/features.hpp"

namespace redysim {

// Result of a right-hand side or a projection, as in SUNDIALS: 0 success, > 0 try a smaller step.
enum class Status { ok = 0, recoverable = 1 };

// The ODE of one instance: ydot = f(time, y; inputs) with the state y (StateLayout) of the integrated joints.
// Prescribed joints (drive motion, locked) are not in the state: between two settings their motion is q + qd
// t + qdd t^2 / 2. Owns the inputs and the workspace; neither throws nor allocates after construction.
class System {
 public:
  // `plan` is not copied and must outlive the system. `with_work` appends the work of inputs and dampers (J)
  // to the state. `model`: the plan's model, for its trajectories, controller and actuators.
  [[gnu::cold]] System(const Plan<double>& plan, bool with_work, const Model* model = nullptr);

  const Plan<double>& plan() const { return plan_; }
  const StateLayout& layout() const { return layout_; }
  const InputLayout& input_layout() const { return input_layout_; }
  int nq() const { return layout_.nq(); }
  int nv() const { return layout_.nv(); }
  int size() const { return layout_.size(); }
  bool with_work() const { return features::energies && layout_.work.count != 0; }
  int simple() const { return layout_.q.count; }  // joints of one degree of freedom in the state
  int balls() const { return features::spherical ? layout_.quaternion.count : 0; }
  // Index into plan().joints; state_position < simple().
  int joint_of(int state_position) const { return integrated_[state_position]; }

  // Scale of each joint's motion, m or 1 (rad), and of each actuator state, for absolute tolerances; length
  // simple() + layout().actuators().
  void set_scales(const Model& model, const Parameters<double>& parameters);
  std::vector<double>& scales() { return scales_; }
  const std::vector<double>& scales() const { return scales_; }
  void nominals(double* y) const;  // the scale of each entry of y
  // Changes of each entry of y for difference quotients: small relative to its scale, to the onset of stops
  // and contacts and to the velocities of dry friction, beyond which a stiff force is constant. Length
  // size().
  void difference_steps(const double* y, double* steps) const;

  // The inputs as set last (InputLayout). The torque of an undriven joint is 0. Equal inputs give an equal
  // right-hand side.
  std::vector<double>& inputs() { return inputs_; }
  double& tau(int joint) { return inputs_[input_layout_.tau[joint]]; }
  double* ball_torque(int ball) { return &inputs_[input_layout_.ball_torque[ball]]; }

  // Inputs as polynomials of time (input_slopes.cpp): sets the derivative of `order` 1 to
  // InputLayout::highest_order of a force in inputs(), or of the qdd of a prescribed joint, from `time` on.
  // The derivatives are part of inputs() until end_input_slopes; then each input keeps the value reached.
  void set_input_slope(double time, int input, int order, double value);
  bool has_input_slopes() const { return inputs_.size() > base_size(); }
  double input_slope(int input) const;  // the first derivative when it was set; 0: none
  double input_derivative(double time, int input, int order) const;  // order 0: the value
  void anchor_input_slopes(double time);
  void end_input_slopes(double time);
  std::size_t base_size() const {  // size of inputs() without slopes
    return static_cast<std::size_t>(input_layout_.size());
  }
  bool is_input_size(std::size_t size) const;
  void resize_inputs(std::size_t size);
  void swap_inputs(std::vector<double>& other);  // requires is_input_size(other.size())

  // Forces used by the last evaluation: inputs() at its time, with the torques of the controller and
  // actuators, and with the torques of spherical joints in their charts.
  const double* recursion_inputs() const {
    return recursion_inputs_.empty() ? inputs_.data() : recursion_inputs_.data();
  }
  const double* recursion_port_wrenches() const { return input_layout_.port_wrench.of(recursion_inputs()); }
  const double* recursion_ball_torque(int ball) const {
    return input_layout_.ball_torque.of(recursion_inputs(), ball);
  }

  // Starts the motion of a prescribed joint at `time`, without a jump.
  void set_motion(double time, int joint, double q, double qd, double qdd);
  // Sets q (derivative 0), qd (1) or qdd (2) from `time` on; the other two continue from their present
  // values.
  void change_motion(double time, int joint, int derivative, double value);

  // Trajectories and the controller; null if the model has none. `enter_phases` sets the phases of the
  // trajectories at the start of a step and returns whether the right-hand side changed.
  const Control* control() const { return features::control ? control_.get() : nullptr; }
  void update_drives(const Parameters<double>& parameters) {  // of the controller and the actuators
    if (control()) control_->update(parameters);
    if (actuators()) actuators_->update(parameters);
  }
  bool enter_phases(double time) { return control() && control_->enter(time, phases()); }
  // Takes the samples of the controller that are due at the start of a step from (time, y); returns the same.
  bool enter_samples(double time, const double* y);
  bool controller_holds() const { return control() && control_->holds(phases()); }  // a sample's torques act
  double next_breakpoint(double time) const;  // time at which a step must end, s; infinity: none
  // The next three require control().
  StepLimits step_limits(double time) const { return control_->step_limits(time, phases()); }
  JointMotion reference(int joint, double time) { return control_->reference(joint, time, phases()); }
  double jerk(int joint, double time) { return control_->jerk(joint, time, phases()); }

  // Null if the model has no actuators with their own law.
  Actuators* actuators() { return features::actuators ? actuators_.get() : nullptr; }
  const Actuators* actuators() const { return features::actuators ? actuators_.get() : nullptr; }

  // Applies pending jumps of prescribed joints to the other joints in y. An impulsive drive conserves
  // momentum: M_ff dq_f + M_fp dq_p = 0, likewise for qd. Its work is added, and y is projected onto the loop
  // constraints. False: they cannot be satisfied, or the result is not finite and y is unchanged.
  bool follow_jumps(double time, double* y);
  void forget_jumps();
  double jump(int joint, int derivative) const {  // pending jump of q (0) or qd (1)
    const int slot = motion_slot_[joint];
    return slot < 0 ? 0 : inputs_[input_layout_.held_motion[slot] + InputLayout::held_q_jump + derivative];
  }

  // q and qd of all joints at (time, y), length plan().nv; valid until the next call.
  struct Coordinates {
    const double* q;
    const double* qd;
  };
  Coordinates coordinates(double time, const double* y);

  // Inverse of `coordinates`: sets y from q and qd of all joints, which must be near those of the last call.
  void collect(const double* q, const double* qd, double* y) const;

  // Computes ydot = f(time, y) and fills the workspace. A result that is not finite is recoverable.
  Status right_hand_side(double time, const double* y, double* ydot);
  // As right_hand_side, for evaluations that are not steps of an integrator: the search for contacts
  // continues from the accelerations of the last right_hand_side.
  Status slope_within_step(double time, const double* y, double* ydot);
  // ydot without work, from the result of `accelerations` at the same y.
  void slope_from(const double* y, const double* qdd, double* ydot) const;

  // Moves y to the nearest point (mass metric) that satisfies the loop constraints of positions and
  // velocities. `error` (length size(), may be null): an error estimate, projected likewise. `evaluated`: the
  // last right_hand_side was at (time, y).
  bool has_constraints() const { return plan_.has_constraints(); }
  Status project(double time, double* y, double* error, bool evaluated = false);
  bool close_loops(double time, double* y) {  // as project; false: a loop remains violated
    return !has_constraints() || (project(time, y, nullptr) == Status::ok && !loops_are_violated());
  }
  // The same for an output within a step, without masses where that is cheaper.
  bool close_within_step(double time, double* y);
  // Projects a change of the state's velocities (nv()) onto the constraints (mass metric). Call after
  // `accelerations` at the same state.
  void project_velocity(double* velocity);
  // Adds to the velocities in a change of the state the smallest ones (mass metric) that cancel these rates
  // of the constraint rows. Call after `accelerations` at the same state.
  void cancel_rates(const std::vector<Dual>& rates, double* change);
  static constexpr int projection_iterations = 8;
  // Bounds of relative_violation (dynamics/loops/loop_rows.hpp):
  static constexpr double rounding = 1e-15;
  static constexpr double rank_violation = 1e-11;  // larger after projection: the rank was too small
  static constexpr double violation = 1e-8;        // a loop is violated
  bool loops_are_violated() const;                 // the last project omitted necessary rows
  int rows() const { return static_cast<int>(workspace_.loop.b.size()); }
  int independent_rows() const;  // in the last right_hand_side
  // Only so many rows remain independent until the call with `false`.
  void hold_rank(bool hold);

  // Accelerations of all joints at (time, y) into qdd (plan().nv): the same solve as the right-hand side.
  Status accelerations(double time, const double* y, double* qdd);

  // Part, s, of a step of `h` s from (time, y) until the first contact point touches (contact_search.hpp).
  double step_to_touch(double time, const double* y, double h, bool or_separation);
  // Call after this step of `h` s to (time, y). Returns the part, s, until a contact point touched that
  // separated again.
  double passed_touch(double time, const double* y, double h);
  // Data that the search uses besides: time, accelerations and contact_regions (as bits) of the last
  // right_hand_side. Empty without contacts.
  std::vector<double>& searched() { return searched_; }
  // Code of the regions between the corners of contact forces, at the last right_hand_side or search.
  std::uint64_t contact_regions() const;

  // The angles of a spherical joint in the recursion, after `coordinates`.
  const BallAngles& angles_of_ball(int ball) const { return angles_[ball]; }

  // Angular acceleration, rad/s^2, of a spherical joint in link axes, from the result of `accelerations` at
  // the same y.
  Vec3<double> ball_acceleration(int ball, const double* qdd) const;

  // Sets `drive` (plan().nv) to the drive forces of all joints, after `accelerations` at the same time and
  // state: the force required by a prescribed motion, otherwise the input.
  void drive_forces(const Coordinates& at, const double* qdd, double* drive) const;

  // Power of the wrench at a port, W; call after `accelerations`.
  double port_power(const Coordinates& at, int port) const;

  // Replaces columns of Derivatives for held drive inputs by those of the controlled system. `variables`: of
  // the columns, which are `length` apart.
  void add_feedback(double time, const Coordinates& at, const std::vector<JointVariable>& variables,
                    double* columns, std::size_t length);

  bool has_prescribed_joints() const { return simple() + 4 * balls() < plan_.nv; }
  // Kinetic energy, J, with each velocity increased by its nominal value.
  [[gnu::cold]] double energy_scale(double time, const double* y);
  double kinetic_energy(double time, const double* y);
  double potential_energy(double time, const double* y);
  double energy_before_jumps(double time, const double* y);  // both, before jumps
  double work(const double* y) const { return with_work() ? *layout_.work.of(y) : 0.0; }
  double contact_work(const double* y) const { return layout_.work.count > 1 ? layout_.work.of(y)[1] : 0.0; }

  // The joint that caused a failure of an evaluation or a method: index into plan().joints, or -1.
  int failed_joint() const { return failed_joint_; }
  void forget_failure() { failed_joint_ = -1; }
  void set_failed_joint(int velocity) {  // the joint of a velocity of the state
    const int place = nq() + velocity;
    failed_joint_ =
        layout_.omega.contains(place) ? plan_.balls[layout_.omega.entry_at(place)] : joint_of(velocity);
  }
  void set_failed_drive(int joint) { failed_joint_ = joint; }  // index into plan().joints
  std::int64_t evaluations() const { return evaluations_; }

  Workspace<double>& workspace() { return workspace_; }

 private:
  void note_searched(double time);
  void set_layouts(bool with_work, const Model* model);
  ActuatorCounts place_actuators(const Model& model);
  void set_actuator_scales(const Parameters<double>& parameters);
  template <bool fill_workspace>
  Status accelerations(double time, const double* y, double* qdd);
  void set_residuals(double time, const double* y, bool with_sizes = true);
  bool has_clear_rank() const;
  void allocate_corrections();
  bool evaluated_by_line() const { return features::straight_line && by_line_; }
  const double* line_inputs(const Coordinates& at);
  void complete_drive_forces(const Coordinates& at);
  bool close_by_matrix(double time, double* y);
  bool set_corrections(double time, const double* y);
  Status project_within_rank(double time, double* y, double* error, bool eliminated);
  Status reduce_residuals(double time, double* y);
  double reduce_residual(double time, double* y, bool velocity);
  void expand_ball(int ball, const double* y);
  Coordinates coordinates_of_all(double time, const double* y);
  Coordinates coordinates_and_inputs(double time, const double* y);
  void slope_of_integrated(const double* y, const double* qdd, double* ydot) const;
  void add_correction(double* y, bool velocity);
  void add_change(const double* change, double* y, bool velocity) const;
  void respond(double time, double* y, bool velocity);
  bool jumped() const;
  double energy(const double* q, const double* qd, const double* y);
  void update_recursion_inputs(double time);
  double motion_at(double time, int joint, int derivative) const;
  void hold_motion(double time, int joint);
  double* held_motion(int slot) { return &inputs_[input_layout_.held_motion[slot]]; }
  double* phases() { return input_layout_.phase.of(inputs_.data()); }
  const double* phases() const { return input_layout_.phase.of(inputs_.data()); }
  void make_tangential(double* velocity);
  void project_error(double* error);
  double power(const Coordinates& at, const double* qdd);
  void add_actuators(const double* y, double* ydot) const;

  const Plan<double>& plan_;
  StateLayout layout_;
  InputLayout input_layout_;
  std::vector<int> integrated_;   // joints in the state
  std::vector<int> motion_slot_;  // per joint: index among those with a held motion, or -1
  std::vector<double> scales_;
  std::unique_ptr<Control> control_;
  std::unique_ptr<Actuators> actuators_;
  std::unique_ptr<ContactSearch> contact_search_;  // null: no contacts
  std::vector<double> inputs_;
  std::vector<double> scratch_inputs_, unmoved_, sampled_state_;
  std::vector<double> q_, qd_;            // all joints
  std::vector<BallAngles> angles_;        // of the spherical joints, as in q_
  bool charts_kept_ = false;              // true during the corrections of a projection
  std::vector<double> recursion_inputs_;  // empty: inputs_ is used
  std::vector<double> qdd_, drive_;       // of all joints, at the last accelerations
  std::vector<double> searched_;          // see searched()
  Workspace<double> workspace_;
  std::vector<double> scratch_;  // plan().nv
  ResidualProgress progress_;
  // Straight-line code (dynamics/straight_line/straight_line.hpp):
  std::vector<double> line_inputs_;  // with friction and stops; empty: none
  bool by_line_ = false;             // it computed the last right_hand_side
  // Projection by matrices, see straight_line_corrections and dynamics/loops/loop_levers.hpp:
  std::vector<double> corrections_;  // C or U^2 J^T, plan().nv x rows(); empty: none
  std::vector<double> gram_;
  std::vector<double> before_closing_;  // state before the last projection; empty: no constraints
  bool corrects_by_matrix_ = false;     // during a projection
  bool rank_is_held_ = false;           // they must not be used
  int failed_joint_ = -1;
  std::int64_t evaluations_ = 0;
};

}  // namespace redysim
