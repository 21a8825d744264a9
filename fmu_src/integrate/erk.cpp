#include <arkode/arkode_erkstep.h>

#include <algorithm>
#include <cstring>
#include <limits>

#include "integrate/dormand_prince_8.hpp"
#include "integrate/one_step.hpp"

// Explicit Runge-Kutta steps by SUNDIALS' ARKODE (ERKStep). Right-hand sides per step: exactly the stages;
// one fewer where the last stage's slope is the next step's first (same inputs).

namespace redysim {
namespace {

using namespace sundials;

struct Table {
  ARKODE_ERKTableID id;     // none: dormand_prince_8
  int error_order;          // local error estimate ~ h^error_order
  bool first_same_as_last;  // its last stage is f at the new state
  const char* name;
};

// By right-hand sides against error, on the KR5, the double pendulum and the SCARA: the fifth order serves
// the tolerances of daily use, above all when each communication step is one step (7 slopes, not 13); the
// eighth needs fewer from errors of 1e-6 down; the third costs 4 slopes where hardly any accuracy is asked
// for. Verner's 6(5) and Cash-Karp's 5(4) lie between without a range of their own.
Table table_for(double rtol) {
  if (rtol > 3e-4) return {ARKODE_BOGACKI_SHAMPINE_4_2_3, 3, true, "erk (Bogacki-Shampine 3(2))"};
  if (rtol > 1e-9) return {ARKODE_DORMAND_PRINCE_7_4_5, 5, true, "erk (Dormand-Prince 5(4))"};
  return {ARKODE_ERK_NONE, 8, false, "erk (Dormand-Prince 8(7))"};
}

struct ErkStepDeleter {
  void operator()(void* memory) const { ERKStepFree(&memory); }
};

class Erk final : public OneStep {
 public:
  Erk(System& system, const SolverSettings& settings, const Table& table);
  const char* name() const override { return table_.name; }

 private:
  static int right_hand_side(double time, N_Vector y, N_Vector ydot, void* self);

  int run(double first_step) override;
  double reached() const override;
  const double* last_slope() const override {
    return table_.first_same_as_last && !system_.has_loops() ? last_slope_ : nullptr;
  }
  const char* reason(int) const override { return nullptr; }

  Table table_;
  std::unique_ptr<void, ErkStepDeleter> memory_;
  long allowed_before_ = 0;
  const double* last_slope_ = nullptr;  // where ERKStep keeps the last slope it asked for
  bool serve_slope_ = false;            // the next slope asked for is slope_
};

Erk::Erk(System& system, const SolverSettings& settings, const Table& table)
    : OneStep(system, settings, SolverMethod::erk, table.error_order, 1), table_(table) {
  memory_.reset(created(ERKStepCreate(&Erk::right_hand_side, 0.0, start_.get(), context_)));
  void* erk = memory_.get();
  ERKStepSetErrHandlerFn(erk, &LastMessage::keep, &message_);
  ERKStepSetUserData(erk, static_cast<OneStep*>(this));
  if (table_.id == ARKODE_ERK_NONE)
    ERKStepSetTable(erk, dormand_prince_8().get());  // copies it
  else
    ERKStepSetTableNum(erk, table_.id);
  ERKStepSetInterpolantDegree(erk, 1);  // never used between step ends; higher ones cost right-hand sides
  ERKStepWFtolerances(erk, &OneStep::weights);
  ERKStepSetAdaptivityFn(erk, &OneStep::adapt, static_cast<OneStep*>(this));
  ERKStepSetErrorBias(erk, 1.0);
  ERKStepSetSafetyFactor(erk, sundials_safety);
  ERKStepSetFixedStepBounds(erk, 1.0, 1.0);
  ERKStepSetMaxErrTestFails(erk, 100);  // step_control's floor is reached before
  if (settings.max_step > 0) ERKStepSetMaxStep(erk, settings.max_step);
  // ERKStep takes c = 1 in the last stage for "first same as last", which 8(7) is not, unless a step is
  // post-processed: then it asks for the slope at the new state
  if (!table_.first_same_as_last || system.has_loops())
    ERKStepSetPostprocessStepFn(erk, &OneStep::complete_step);

  warming_up_ = true;
  end_ = 1;
  control_.start(1);
  ERKStepSetInitStep(erk, 1.0);
  double reached = 0;
  ERKStepEvolve(erk, 1.0, result_.get(), &reached, ARK_ONE_STEP);
  warming_up_ = false;
  statistics_ = {};
}

int Erk::right_hand_side(double time, N_Vector y, N_Vector ydot, void* self_pointer) {
  Erk& self = static_cast<Erk&>(*static_cast<OneStep*>(self_pointer));
  double* slope = data(ydot);
  const std::size_t bytes = self.y_.size() * sizeof(double);
  if (self.skip_slope_) {
    self.skip_slope_ = false;
    return 0;
  }
  if (self.serve_slope_) {
    self.serve_slope_ = false;
    std::memcpy(slope, self.slope_.data(), bytes);
    return 0;
  }
  if (self.warming_up_) {
    std::memset(slope, 0, bytes);
    return 0;
  }
  self.last_slope_ = slope;
  if (!self.stage_failed_) {
    ++self.statistics_.evaluations;
    const Status status = self.system_.right_hand_side(time, data(y), slope);
    if (status == Status::ok) return 0;
    if (status == Status::fatal) return -1;
    self.stage_failed_ = true;
  }
  // ERKStep gives up at a stage without slope; a slope that is not a number makes it try a smaller step
  std::fill_n(slope, self.y_.size(), std::numeric_limits<double>::quiet_NaN());
  return 0;
}

int Erk::run(double first_step) {
  void* erk = memory_.get();
  serve_slope_ = slope_known_;
  if (allowed_ != allowed_before_) ERKStepSetMaxNumSteps(erk, allowed_before_ = allowed_);
  ERKStepSetInitStep(erk, first_step);
  ERKStepReset(erk, time_, start_.get());
  ERKStepSetStopTime(erk, end_);
  double reached = time_;
  return ERKStepEvolve(erk, end_, result_.get(), &reached, ARK_NORMAL);
}

double Erk::reached() const {
  double time = time_;
  ERKStepGetCurrentTime(memory_.get(), &time);
  return time;
}

}  // namespace

std::unique_ptr<OneStep> make_erk(System& system, const SolverSettings& settings) {
  return std::make_unique<Erk>(system, settings, table_for(settings.rtol));
}

}  // namespace redysim
