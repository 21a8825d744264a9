#pragma once

#include <memory>
#include <vector>

#include "dynamics/ball.hpp"
#include "dynamics/plan.hpp"
#include "dynamics/workspace.hpp"
#include "integrate/control/control.hpp"
#include "model/features.hpp"

namespace redysim {

// What a right-hand side or a projection may say, in SUNDIALS' own order: 0 go on, > 0 try a smaller
// step, < 0 give up.
enum class Status { ok = 0, recoverable = 1, fatal = -1 };

// The ODE of one instance: state y = [q (nq); qd (nv); work (1, when asked for)] of the joints that are
// integrated, ydot = f(time, y; inputs). Prescribed joints (drive motion, locked) are no state: between two
// settings their motion goes on as q + qd t + qdd t^2 / 2. Spherical joints come last in q, as quaternions
// (w, x, y, z), and in qd, as angular velocities in link axes.
// Owns the inputs and the workspace; neither throws nor allocates after construction.
class System {
 public:
  // `plan` is used, not copied, and must outlive the system. `with_work` appends the work of inputs and
  // dampers (J) as the last state. `model`: that of the plan, for its trajectories and controller.
  System(const Plan<double>& plan, bool with_work, const Model* model = nullptr);

  const Plan<double>& plan() const { return plan_; }
  int nq() const { return nq_; }  // positions in the state
  int nv() const { return nv_; }  // velocities in the state
  int size() const { return nq() + nv() + (with_work() ? 1 : 0); }
  bool with_work() const { return features::energies && with_work_; }
  int simple() const { return simple_; }  // joints of one freedom in the state
  int balls() const { return features::spherical ? nq_ - nv_ : 0; }
  int joint_of(int state_position) const {
    return integrated_[state_position];
  }  // into plan().joints; < simple()

  // The size of each joint's motions, m or 1 (rad), that absolute tolerances count in; of length simple().
  void set_scales(const Model& model);
  std::vector<double>& scales() { return scales_; }
  const std::vector<double>& scales() const { return scales_; }

  // What is held between settings: joint forces (plan().nv, N m or N; undriven joints stay 0; prescribed
  // joints their qdd), moment and force of each port (6 each), the torque on each spherical joint (3 each,
  // link axes), then per joint with a motion input (or locked) a time, q and qd at that time, and by how much
  // q and qd jumped since the last step, then the phase of each trajectory. Equal inputs mean an equal
  // right-hand side.
  std::vector<double>& inputs() { return inputs_; }
  std::vector<double>& tau() { return inputs_; }
  double* port_wrench(int port) { return &inputs_[plan_.nv + 6 * port]; }
  double* ball_torque(int ball) { return &inputs_[plan_.nv + 6 * plan_.ports.size() + 3 * ball]; }

  // Inputs that move as polynomials of time (input_slopes.cpp): the order-th derivative, 1 to
  // highest_input_order, of a force in inputs() (a prescribed joint's: of its qdd) from `time` on. They are
  // part of inputs() until they end at another time, where each input stays at the value that it has reached.
  static constexpr int highest_input_order = 3;
  void set_input_slope(double time, int input, int order, double value);
  bool has_input_slopes() const { return inputs_.size() > base_size_; }
  double input_slope(int input) const;  // the first derivative where they begin; 0: none
  void anchor_input_slopes(double time);
  void end_input_slopes(double time);
  std::size_t base_size() const { return base_size_; }  // of inputs() without them
  bool is_input_size(std::size_t size) const;
  void resize_inputs(std::size_t size);
  void swap_inputs(std::vector<double>& other);  // of a legal size

  // The forces in inputs() as they are at the time of the last evaluation.
  const double* forces() const { return applied_.empty() ? inputs_.data() : applied_.data(); }
  const double* port_wrenches() const { return forces() + plan_.nv; }
  const double* ball_force(int ball) const { return port_wrenches() + 6 * plan_.ports.size() + 3 * ball; }

  // Begins the motion of a prescribed joint at `time`: there is none before from which it could jump.
  void set_motion(double time, int joint, double q, double qd, double qdd);
  // Sets q (derivative 0), qd (1) or qdd (2) from `time` on; the other two go on from what they have reached.
  void change_motion(double time, int joint, int derivative, double value);

  // Trajectories and the controller; null where the model has none. `enter_phases` brings the trajectories to
  // a time at which a step starts and tells whether the right-hand side changed.
  const Control* control() const { return features::control ? control_.get() : nullptr; }
  void update_control(const Model& model) {
    if (control()) control_->update(model);
  }
  bool enter_phases(double time) { return control() && control_->enter(time, phases()); }
  double next_border(double time) const;  // where a step has to end, s; infinity: nowhere
  JointMotion reference(int joint, double time) { return control_->reference(joint, time, phases()); }
  double jerk(int joint, double time) { return control_->jerk(joint, time, phases()); }

  // What a jump of prescribed joints does to the others, in y: the sudden drive keeps momentum,
  // M_ff dq_f + M_fp dq_p = 0 and the same for qd, its work counts, and loops close again. False: they do
  // not, or the jump is beyond numbers and y is as it was.
  bool follow_jumps(double time, double* y);
  void forget_jumps();
  double jump(int joint, int derivative) const {  // of q (0) or qd (1) that the state has not followed
    const int slot = motion_slot_[joint];
    return slot < 0 ? 0 : inputs_[held_begin() + static_cast<std::size_t>(held_size * slot + 3 + derivative)];
  }

  // All joints at (time, y): q, qd of length plan().nv, valid until the next call.
  struct Coordinates {
    const double* q;
    const double* qd;
  };
  Coordinates coordinates(double time, const double* y);

  // The way back: q and qd of all joints, near those of the last `coordinates`, into the state y.
  void collect(const double* q, const double* qd, double* y) const;

  // ydot = f(time, y). Fills the workspace for y. A non-finite result is recoverable.
  Status right_hand_side(double time, const double* y, double* ydot);

  // Closed loops: moves y to the nearest point (mass metric) with closed position and velocity
  // constraints. `error` (length size(), may be null) is an error estimate to be projected alike.
  bool has_loops() const { return plan_.has_loops(); }
  Status project(double time, double* y, double* error);
  static constexpr int projection_iterations = 8;
  static constexpr double rounding = 1e-15;  // of a residual, relative to the loop points' coordinates
  static constexpr double open_gap = 1e-11;  // m or rad: more than a passing singular position leaves behind
  double largest_gap() const;  // over all rows, m or rad, after the last project or accelerations
  bool loops_are_lost()
      const;  // the last project left a loop open: the rows that would close it were given up

  // Accelerations of all joints at (time, y) into qdd (plan().nv): the same solve as the right-hand side.
  Status accelerations(double time, const double* y, double* qdd);

  // The angles of a spherical joint in the recursion, after `coordinates`.
  const BallAngles& angles_of_ball(int ball) const { return angles_[ball]; }

  // Angular acceleration of a spherical joint in link axes, from what `accelerations` gave at the same y.
  Vec3<double> ball_acceleration(int ball, const double* qdd) const;

  // Drive forces of all joints after `accelerations` at the same time and state, into tau (plan().nv): the
  // input where there is one, what the prescribed motion takes elsewhere.
  void drive_forces(const Coordinates& at, const double* qdd, double* tau) const;

  // Columns of Derivatives by `variables`, at held drive forces -> with the controller's answer.
  void close_control(double time, const Coordinates& at, const std::vector<int>& variables, double* columns);

  double kinetic_energy(double time, const double* y);
  double potential_energy(double time, const double* y);
  double work(const double* y) const { return with_work() ? y[nq() + nv()] : 0.0; }

  // Which joint is to blame for a failure, an evaluation's or a method's: index into plan().joints, or -1.
  int failed_joint() const { return failed_joint_; }
  void forget_failure() { failed_joint_ = -1; }
  void blame(int velocity) {  // the joint of a velocity of the state
    failed_joint_ = velocity < simple() ? joint_of(velocity) : plan_.balls[(velocity - simple()) / 3];
  }
  long evaluations() const { return evaluations_; }

  Workspace<double>& workspace() { return workspace_; }

 private:
  template <bool fill_workspace>
  Status accelerations(double time, const double* y, double* qdd);
  void set_residuals(double time, const double* y);
  Status project_within_rank(double time, double* y, double* error);
  void reduce_residual(const std::vector<double>& residual, double enough, double time, double* y,
                       bool velocity);
  void expand_ball(int ball, const double* y);
  Coordinates coordinates_of_all(double time, const double* y);
  Coordinates moved_and_pushed(double time, const double* y);
  void slope_of_integrated(const double* y, const double* qdd, double* ydot) const;
  void add_correction(double* y, bool velocity);
  void add_change(const double* change, double* y, bool velocity) const;
  void respond(double time, double* y, bool velocity);
  bool jumped() const;
  double energy(const double* q, const double* qd);
  double energy_before_jump(double time, const double* y);
  void take_inputs(double time);
  double motion_at(double time, int joint, int derivative) const;
  void hold_motion(double time, int joint);
  std::size_t forces_size() const { return held_begin(); }
  static constexpr int held_size = 5;  // time, q, qd, jump of q, jump of qd
  std::size_t held_begin() const { return plan_.nv + 6 * plan_.ports.size() + 3 * plan_.balls.size(); }
  double* held_motion(int slot) { return &inputs_[held_begin() + held_size * slot]; }
  std::size_t phases_begin() const {
    return held_begin() + held_size * static_cast<std::size_t>(held_count_);
  }
  double* phases() { return inputs_.data() + phases_begin(); }
  const double* phases() const { return inputs_.data() + phases_begin(); }
  void project_error(double* error);
  double power(const Coordinates& at, const double* qdd);

  const Plan<double>& plan_;
  bool with_work_;
  int simple_ = 0, nq_ = 0, nv_ = 0;
  std::vector<int> integrated_;   // joints in the state
  std::vector<int> motion_slot_;  // per joint: its place among those with a held motion, or -1
  int held_count_ = 0;
  std::vector<double> scales_;
  std::unique_ptr<Control> control_;
  std::vector<double> inputs_;
  std::size_t base_size_ = 0;
  std::vector<double> scratch_inputs_, unmoved_;
  std::vector<double> q_, qd_;       // all joints
  std::vector<BallAngles> angles_;   // of the spherical joints, as in q_
  bool charts_kept_ = false;         // by the corrections after one elimination
  std::vector<double> applied_;      // forces as the recursion takes them, where they are not just inputs_
  std::vector<double> qdd_, drive_;  // all joints, of the last accelerations
  Workspace<double> workspace_;
  std::vector<double> scratch_;  // plan().nv
  int failed_joint_ = -1;
  long evaluations_ = 0;
};

}  // namespace redysim
