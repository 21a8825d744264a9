#include <arkode/arkode_arkstep.h>
#include <sunmatrix/sunmatrix_dense.h>
#include <sunnonlinsol/sunnonlinsol_newton.h>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <utility>

#include "integrate/methods/force_corners.hpp"
#include "integrate/methods/one_step.hpp"
#include "integrate/methods/tuning.hpp"

// Diagonally implicit Runge-Kutta steps by SUNDIALS' ARKODE (ARKStep) with the exact Jacobian: L-stable and
// stiffly accurate, with an explicit first stage. The method has no history, so inputs may change at every
// communication step. The slope at the end of a step is that of its last stage.

namespace redysim {
namespace {

using namespace sundials;

// Chosen from 14 tables of ARKODE on five stiff scenes at rtol 1e-3 to 1e-8: on each it needs the fewest
// right-hand sides for a given error, or nearly so, and its error estimate is reliable
// (docs/solver_measurements.md). It is the implicit part of ARK4(3)7L[2]SA: Kennedy and Carpenter, Appl.
// Numer. Math. 136 (2019). It is repeated here because ARKODE would link all its tables, 30 kB.
constexpr int stages = 7;
constexpr int order = 4, embedded_order = 3;
constexpr double diagonal = 0.1235;
constexpr double nodes[stages] = {0, 0.247, 0.42165537495307726, 0.335, 0.075, 0.7, 1};
// entries below the diagonal, from the third stage on; the last row gives the step
constexpr double rows[][stages - 1] = {
    {0.14907768747653863, 0.14907768747653863},
    {0.12483442871739439, 0.12483442871739439, -0.038168857434788782},
    {-0.073031940302180909, -0.073031940302180909, -0.24343568716014671, 0.34099956776450852},
    {-0.15296500088128806, -0.15296500088128806, 0.072205620474335874, 0.40430630248551713,
     0.40591807880272318},
    {0, 0, 0.51611072831742366, -0.14606356393857081, 0.23473048589019332, 0.27172234973095377}};
constexpr double embedded[stages] = {
    0, 0, 0.51752174615934821, -0.15173820706113939, 0.23672007870234135, 0.27544638219944978, 0.12205};

constexpr double coefficient(int stage, int slope) {
  if (slope >= stage) return slope == stage && stage > 0 ? diagonal : 0;
  return stage == 1 ? diagonal : rows[stage - 2][slope];
}

constexpr double tightening = 1.0 / 5;       // matches the global error of the explicit methods at equal rtol
constexpr int newton_iterations = 4;         // one more than usual: the Jacobian is exact and expensive
constexpr int remembered_slopes = 3;         // used to predict a stage
constexpr int newton_failures = 60;          // consecutive; each reduces the step to a quarter
constexpr double shortest_to_touch = 1e-12;  // minimum relative to the last step, if it ends at a contact
constexpr double safety = 0.96;              // ARKODE multiplies the result of `adapt` by this factor

struct ArkStepDeleter {
  void operator()(void* memory) const { ARKStepFree(&memory); }
};

class Dirk final : public OneStep {
 public:
  Dirk(System& system, const SolverSettings& settings, Scratch scratch);
  const char* name() const override { return "dirk (Kennedy-Carpenter 4(3))"; }

 private:
  static Dirk& of(void* self) { return static_cast<Dirk&>(*static_cast<OneStep*>(self)); }
  static int weights(N_Vector y, N_Vector weights, void* self);
  static int adapt(N_Vector y, double t, double h, double, double, double error, double, double, int, int,
                   double* next, void* self);
  static int right_hand_side(double time, N_Vector y, N_Vector ydot, void* self);
  static int jacobian(double time, N_Vector y, N_Vector slope, SUNMatrix matrix, void* self, N_Vector,
                      N_Vector, N_Vector);
  static int predict(double time, N_Vector stage, void* self);
  static int complete(double time, N_Vector y, void* self);

  void build();
  void set_table();
  void set_predictors();
  void integrate_power(double time, double* y);
  double error_with_corners(double since, const double* y, double error);
  bool is_doubtful(double since, const double* y, double h, double error);
  Flag run(double first_step) override;
  Flag flag_of(int arkode);
  double reached() const override;
  long unsolved() const;  // attempts whose stage equations were not solved, total of all runs

  Vector &start_, &end_state_;  // owned by the scratch; end_state_ holds result_
  DenseJacobian& jacobian_;
  Matrix matrix_;
  LinearSolver linear_solver_;
  NonlinearSolver nonlinear_solver_;
  std::unique_ptr<void, ArkStepDeleter> memory_;

  double weights_of_slopes_[stages][stages] = {};
  const double* slopes_[stages] = {};              // slopes of the stages, stored by ARKStep
  std::vector<double> stage_state_, stage_slope_;  // for integrate_power; empty if not needed
  int stage_ = 0;                                  // index of the stage being solved
  double step_begin_ = 0;                          // time at which begin_slope_ holds
  const double* begin_slope_ = nullptr;
  bool warming_up_ = false;  // in the first step, in which ARKODE allocates: the right-hand side is zero
  long unsolved_before_ = 0;
  bool too_short_ = false;  // the step to repeat is below the minimum
  CornerWatch corners_{system_};
};

Dirk::Dirk(System& system, const SolverSettings& settings, Scratch scratch)
    : OneStep(system, settings, std::move(scratch), SolverMethod::dirk, embedded_order + 1, tightening),
      start_(scratch_->vectors[0]),
      end_state_(scratch_->vectors[1]),
      jacobian_(scratch_->jacobian()) {
  if (system.with_work() && system.plan().has_motion()) stage_state_ = stage_slope_ = y_;
  build();
}

void Dirk::build() {
  memory_.reset(
      created(ARKStepCreate(nullptr, &Dirk::right_hand_side, 0.0, start_.get(), scratch_->context)));
  void* ark = memory_.get();
  OneStep* self = this;
  ARKStepSetErrHandlerFn(ark, &LastMessage::keep, &scratch_->message);
  ARKStepSetUserData(ark, self);
  set_table();
  // states between step ends are not requested, and Hermite interpolation costs right-hand sides
  ARKStepSetInterpolantType(ark, ARK_INTERP_LAGRANGE);
  ARKStepSetInterpolantDegree(ark, 1);
  ARKStepWFtolerances(ark, &Dirk::weights);
  ARKStepSetAdaptivityFn(ark, &Dirk::adapt, self);
  ARKStepSetErrorBias(ark, 1.0);
  ARKStepSetSafetyFactor(ark, safety);
  ARKStepSetFixedStepBounds(ark, 1.0, 1.0);
  ARKStepSetMinReduction(ark, shortest_to_touch);
  ARKStepSetMaxErrTestFails(ark, 100);  // StepControl stops earlier
  if (settings_.max_step > 0) ARKStepSetMaxStep(ark, step_limit(settings_.max_step));

  matrix_ = make_matrix(system_.size(), scratch_->context);
  linear_solver_ = make_linear_solver(system_, scratch_->context);
  ARKStepSetLinearSolver(ark, linear_solver_.get(), matrix_.get());
  ARKStepSetJacFn(ark, &Dirk::jacobian);
  nonlinear_solver_.reset(created(SUNNonlinSol_Newton(start_.get(), scratch_->context)));
  ARKStepSetNonlinearSolver(ark, nonlinear_solver_.get());
  ARKStepSetDeduceImplicitRhs(ark, SUNTRUE);
  ARKStepSetStagePredictFn(ark, &Dirk::predict);
  ARKStepSetPostprocessStepFn(ark, &Dirk::complete);
  ARKStepSetMaxNonlinIters(ark, newton_iterations);
  ARKStepSetMaxConvFails(ark, newton_failures);

  warming_up_ = true;
  end_ = 1;
  control_.start(1);
  allowed_ = 1;
  run(1);
  warming_up_ = false;
  statistics_ = {};
  set_predictors();
}

void Dirk::set_table() {
  double weights[stages * stages] = {}, step[stages] = {};
  for (int i = 0; i < stages; ++i)
    for (int j = 0; j < stages; ++j) weights[i * stages + j] = coefficient(i, j);
  std::copy_n(&weights[(stages - 1) * stages], stages, step);
  double c[stages], error[stages];
  std::copy_n(nodes, stages, c);
  std::copy_n(embedded, stages, error);
  const ARKodeButcherTable table =
      created(ARKodeButcherTable_Create(stages, order, embedded_order, c, weights, step, error));
  ARKStepSetTables(memory_.get(), order, embedded_order, table, nullptr);
  ARKodeButcherTable_Free(table);
}

// Predicts a stage by integrating the polynomial through the slopes of the previous stages: the weights are
// integrals of Lagrange polynomials, by two Gauss points.
void Dirk::set_predictors() {
  for (int i = 1; i < stages; ++i) {
    const int count = std::min(i, remembered_slopes), first = i - count;
    for (double point : {0.5 - 0.5 / std::sqrt(3.0), 0.5 + 0.5 / std::sqrt(3.0)}) {
      for (int j = first; j < i; ++j) {
        double value = 0.5 * nodes[i];
        for (int k = first; k < i; ++k)
          if (k != j) value *= (point * nodes[i] - nodes[k]) / (nodes[j] - nodes[k]);
        weights_of_slopes_[i][j] += value;
      }
    }
  }
}

int Dirk::weights(N_Vector y, N_Vector weights, void* self) {
  Dirk& dirk = of(self);
  dirk.error_weights_.evaluate(data(y), data(weights));
  if (!dirk.warming_up_)
    dirk.error_weights_.weigh_work(dirk.system_, dirk.absolute(dirk.step_begin_), data(y), data(weights));
  return 0;
}

int Dirk::adapt(N_Vector y, double t, double h, double, double, double error, double, double, int, int,
                double* next, void* self_pointer) {
  Dirk& self = of(self_pointer);
  *next = h;
  if (self.warming_up_) return 0;
  // a step that Newton's iteration could not solve limits the next step size
  const long unsolved = self.unsolved();
  if (unsolved != self.unsolved_before_) {
    self.statistics_.rejected += unsolved - self.unsolved_before_;
    self.unsolved_before_ = unsolved;
    self.control_.limit(h);
  }
  if (error <= 1) {
    if (self.is_doubtful(t, data(y), h, error)) return 1;
    if (!self.keep(t, data(y), h, error)) return 1;
    self.corners_.begin(self.system_, self.absolute(t), data(y));
    if (self.end_ - t > 0) *next = self.step_from(t, data(y)) / safety;
    return 0;
  }
  self.too_short_ = !self.repeat(t, h, error);
  *next = h / safety;
  return self.too_short_ ? 1 : 0;
}

// Error estimate of a step to y with regard to corners of forces: above 1 if the step must be repeated.
double Dirk::error_with_corners(double since, const double* y, double error) {
  const double time = absolute(since);
  if (corners_.crosses(system_, time, y)) return Tuning::doubt_of_corner * error;
  if (!corners_.expects_touches()) return error;
  double* weights = candidate_;  // not needed here: ARKStep holds the states
  error_weights_.evaluate(y, weights);
  return std::isfinite(corners_.time_of_short_touch(system_, time, y, weights)) ? Tuning::error_of_corner
                                                                                : error;
}

bool Dirk::is_doubtful(double since, const double* y, double h, double error) {
  const double doubted = error_with_corners(since, y, error);
  if (!(doubted > 1)) return false;
  too_short_ = !repeat(since, h, doubted);
  if (!too_short_) repeat_up_to(h);
  return true;
}

int Dirk::right_hand_side(double time, N_Vector y, N_Vector ydot, void* self_pointer) {
  Dirk& self = of(self_pointer);
  double* slope = data(ydot);
  const std::size_t bytes = self.y_.size() * sizeof(double);
  if (self.warming_up_) {
    std::memset(slope, 0, bytes);
    return 0;
  }
  const bool first_stage = time == self.step_begin_;  // also of a repeated step
  if (first_stage) {
    self.corners_.attempt();
    self.stage_ = 0;
    self.slopes_[0] = slope;
    if (self.begin_slope_ != nullptr) {
      if (slope != self.begin_slope_) std::memcpy(slope, self.begin_slope_, bytes);
      return 0;
    }
  }
  ++self.statistics_.evaluations;
  newton_matrix(self.linear_solver_).set_present(data(y));
  if (first_stage) self.release_rank();
  const Status status = self.system_.right_hand_side(self.absolute(time), data(y), slope);
  if (status == Status::ok) self.corners_.note(self.system_, self.absolute(time), data(y));
  if (first_stage && status == Status::ok) {
    self.hold_rank();
    if (time == self.since_) {
      std::memcpy(self.slope_.data(), slope, bytes);
      self.begin_slope_ = self.slope_.data();
    } else {
      self.begin_slope_ = slope;
    }
  }
  return static_cast<int>(status);
}

int Dirk::jacobian(double time, N_Vector y, N_Vector, SUNMatrix matrix, void* self_pointer, N_Vector,
                   N_Vector, N_Vector) {
  Dirk& self = of(self_pointer);
  if (self.warming_up_) return SUNMatZero(matrix);
  ++self.statistics_.jacobians;
  ++self.statistics_.evaluations;
  newton_matrix(self.linear_solver_).set_reference(data(y));
  return static_cast<int>(self.jacobian_.evaluate(self.absolute(time), data(y), SM_DATA_D(matrix)));
}

int Dirk::predict(double, N_Vector stage, void* self_pointer) {
  Dirk& self = of(self_pointer);
  if (self.warming_up_) return 0;
  double time = 0, gamma = 0, h = 0;
  N_Vector prediction, z, slope, known;
  void* user_data;
  ARKStepGetNonlinearSystemData(self.memory_.get(), &time, &prediction, &z, &slope, &gamma, &known,
                                &user_data);
  ARKStepGetCurrentStep(self.memory_.get(), &h);
  const int i = ++self.stage_;
  self.slopes_[i] = data(slope);
  double* y = data(stage);
  for (int j = 0; j < i; ++j) {
    const double factor = h * self.weights_of_slopes_[i][j];
    if (factor == 0) continue;
    for (std::size_t k = 0; k < self.y_.size(); ++k) y[k] += factor * self.slopes_[j][k];
  }
  return 0;
}

int Dirk::complete(double time, N_Vector y, void* self_pointer) {
  Dirk& self = of(self_pointer);
  if (self.warming_up_) return 0;
  if (!self.stage_state_.empty()) self.integrate_power(time, data(y));
  const bool closed = self.close(time, data(y));
  self.step_begin_ = time;
  self.begin_slope_ = self.system_.has_constraints() ? nullptr : self.slopes_[stages - 1];
  return closed ? 0 : 1;
}

// Replaces the work of the step by the quadrature of the power at its stages. The slopes that ARKStep deduces
// from a stage contain the power only to the accuracy of Newton's iteration. The force of a prescribed joint,
// which is constant in the Jacobian of the power, may change much faster than the state. These evaluations
// are not counted as right-hand sides: `auto` decides by their number, and requesting energies must not
// change a run.
void Dirk::integrate_power(double time, double* y) {
  const double h = time - step_begin_;
  const auto& work = system_.layout().work;
  double correction[2] = {};  // for the total work of non-conservative forces and for that of contacts
  for (int i = 0; i < stages; ++i) {
    const double weight = coefficient(stages - 1, i);
    if (weight == 0) continue;
    std::copy_n(y, stage_state_.size(), stage_state_.begin());
    for (int j = 0; j < stages; ++j) {
      const double factor = h * (coefficient(i, j) - coefficient(stages - 1, j));
      if (factor == 0) continue;
      for (std::size_t k = 0; k < stage_state_.size(); ++k) stage_state_[k] += factor * slopes_[j][k];
    }
    const double at = i + 1 == stages ? time : step_begin_ + nodes[i] * h;
    if (system_.slope_within_step(absolute(at), stage_state_.data(), stage_slope_.data()) != Status::ok)
      return;
    for (int part = 0; part < work.count; ++part)
      correction[part] += h * weight * (*work.of(stage_slope_.data(), part) - *work.of(slopes_[i], part));
  }
  for (int part = 0; part < work.count; ++part) *work.of(y, part) += correction[part];
}

OneStep::Flag Dirk::run(double first_step) {
  void* ark = memory_.get();
  unsolved_before_ = unsolved();
  too_short_ = false;
  step_begin_ = since_;
  begin_slope_ = slope_known_ && !is_overconstrained() ? slope_.data() : nullptr;
  if (!warming_up_) corners_.begin(system_, absolute(since_), y_.data());
  std::copy(y_.begin(), y_.end(), data(start_));
  ARKStepSetMaxNumSteps(ark, allowed_);
  ARKStepSetInitStep(ark, first_step);
  ARKStepReset(ark, since_, start_.get());
  ARKStepSetStopTime(ark, end_);
  ARKStepSetMinStep(ark, std::min(first_step, smallest_step(since_, end_)));
  double reached = since_;
  const Flag flag = flag_of(ARKStepEvolve(ark, end_, end_state_.get(), &reached, ARK_NORMAL));
  const bool ended = flag == Flag::done || flag == Flag::step_limit;
  slope_known_ = ended && !warming_up_ && !system_.has_constraints();
  if (slope_known_) std::copy_n(slopes_[stages - 1], slope_.size(), slope_.begin());
  return flag;
}

OneStep::Flag Dirk::flag_of(int arkode) {
  if (arkode >= 0) return Flag::done;
  switch (too_short_ ? ARK_ERR_FAILURE : arkode) {
    case ARK_TOO_MUCH_WORK:
      return Flag::step_limit;
    case ARK_POSTPROCESS_STEP_FAIL:
      return Flag::not_closed;
    case ARK_RHSFUNC_FAIL:
    case ARK_UNREC_RHSFUNC_ERR:
      return Flag::not_finite;
    case ARK_TOO_MUCH_ACC:
      return Flag::below_rounding;
    case ARK_CONV_FAILURE:
    case ARK_ERR_FAILURE:
    case ARK_REPTD_RHSFUNC_ERR:
      return Flag::too_short;
    default:
      return Flag::other;
  }
}

double Dirk::reached() const {
  double time = since_;
  ARKStepGetCurrentTime(memory_.get(), &time);
  return time;
}

long Dirk::unsolved() const {
  long count = 0;
  ARKStepGetNumStepSolveFails(memory_.get(), &count);
  return count;
}

}  // namespace

std::unique_ptr<OneStep> make_dirk(System& system, const SolverSettings& settings, Scratch scratch) {
  return std::make_unique<Dirk>(system, settings, std::move(scratch));
}

}  // namespace redysim
