#pragma once

#include "integrate/methods/force_corners.hpp"
#include "integrate/methods/methods.hpp"
#include "integrate/methods/shared_scratch.hpp"
#include "integrate/methods/step_work.hpp"

// Variable-order multistep methods by SUNDIALS' CVODE: Adams (functional iteration) and BDF (Newton
// iteration).
//
// CVODE counts time from its last restart, so that its steps may be shorter than the rounding of a large
// time. It runs ahead of time() in steps of its own. States at communication points are interpolated, so a
// run with unchanged inputs does not depend on the communication points. Changed inputs restart it at time().
// CVODE's memory is opaque: a saved state is the last restart and the number of steps since, and restoring
// repeats these steps. CVODE restarts every steps_between_restarts steps to bound them.

namespace redysim {

struct CvodeDeleter {
  void operator()(void* memory) const;
};

class Cvode final : public Integrator {
 public:
  Cvode(System& system, const SolverSettings& settings, Scratch scratch, SolverMethod method);

  Outcome start(double time, const double* y) override;
  void set_state(const double* y) override;
  Outcome advance(double end, bool inputs_changed) override;
  bool reaches(double end) const override {
    return restart_due_ == Due::no && since_restart(end) <= ahead_time_;
  }

  double time() const override { return time_; }
  const double* state() const override { return y_.data(); }
  const Statistics& statistics() const override { return statistics_; }
  SolverMethod method() const override { return method_; }
  const char* name() const override { return method_ == SolverMethod::bdf ? "bdf" : "adams"; }

  void save(std::vector<unsigned char>& bytes) const override;
  bool restore(const unsigned char* bytes, std::size_t size) override;

 private:
  static constexpr int steps_between_restarts = 4000;

  // State from which CVODE restarts.
  struct Restart {
    double time = 0, first_step = 0;
    double touch = 0;       // s since the restart: a short touch, at which a step ends; 0: none
    bool repeated = false;  // not the first of the run
    std::vector<double> y, inputs;
    std::int64_t rejected_before = 0;  // statistics
  };
  // Whether the next advance restarts CVODE: no, for the first time since the state was set, or again.
  enum class Due : unsigned char { no, first, again };
  // Content of a saved state.
  struct Saved;

  // Functions that CVODE calls; `self` is a Cvode (cvode_functions.cpp).
  static int right_hand_side(double time, N_Vector y, N_Vector ydot, void* self);
  static int weights(N_Vector y, N_Vector weights, void* self);
  static int jacobian(double time, N_Vector y, N_Vector slope, SUNMatrix matrix, void* self, N_Vector,
                      N_Vector, N_Vector);
  static int project(double time, N_Vector y, N_Vector correction, double, N_Vector error, void* self);
  static bool power(double time, void* self, int part, double& power);

  void build();
  void build_newton();
  double absolute(double since) const { return restart_.time + since; }  // CVODE's time -> system time
  double since_restart(double end) const;
  bool restart(double time, const double* y, bool repeated);
  void reset_cvode();
  Outcome restart_between_steps(double time, const double* y);
  bool passes_jump();
  double missed_touch();
  Outcome return_to(double touch);
  Outcome step_past(double& end);
  void set_stop();
  double next_step() const;
  double end_of_step(double step) const;
  int take_step();
  Outcome interpolate(double end);
  void count_step();
  void count_last_step();
  void count_work(double before);
  template <class Visit>
  void each_work(double* y, const Visit& visit);  // visits each integral and its entry of y
  Outcome failed(int flag);

  static bool read(ByteReader& reader, const System& system, Saved& saved);
  void repeat_steps(const Saved& saved);

  System& system_;
  SolverSettings settings_;
  SolverMethod method_;
  ErrorWeights error_weights_;

  Scratch scratch_;
  sundials::Vector &weights_, &error_;  // owned by the scratch
  sundials::Vector ahead_;              // the state at ahead_time_
  DenseJacobian* jacobian_ = nullptr;   // BDF only
  sundials::Matrix matrix_;
  sundials::LinearSolver linear_solver_;
  sundials::NonlinearSolver nonlinear_solver_;
  std::unique_ptr<void, CvodeDeleter> memory_;

  // state that determines the continuation
  double time_ = 0;
  std::vector<double> y_;
  Due restart_due_ = Due::first;
  Restart restart_;
  double ahead_time_ = 0;         // end of CVODE's last step since the restart; not before time_
  std::int32_t steps_taken_ = 0;  // since the restart
  std::vector<StepWork> works_;   // total, contacts; empty: the method's own integrals suffice
  Statistics statistics_;

  CornerWatch corners_{system_};
  std::vector<double> slope_;  // f at the restart
  bool slope_known_ = false;   // the next call of right_hand_side returns slope_
  bool stopped_ = false;       // the last step ended at the stop time
  bool warming_up_ = false;
  bool project_history_ = false;  // Adams with loops
  bool projection_failed_ = false;
};

}  // namespace redysim
