#include <arkode/arkode_erkstep.h>

#include <algorithm>
#include <cstring>
#include <limits>
#include <optional>
#include <utility>

#include "integrate/methods/explicit_tables.hpp"
#include "integrate/methods/one_step.hpp"
#include "integrate/methods/table_choice.hpp"
#include "integrate/methods/tuning.hpp"

// Explicit Runge-Kutta steps by SUNDIALS' ARKODE (ERKStep). A step takes one right-hand side per stage, one
// fewer if the slope of the last stage is the first one of the next step (same inputs).

namespace redysim {
namespace {

using namespace sundials;

struct Table {
  ButcherTable (*coefficients)();
  int error_order;          // local error estimate ~ h^error_order
  bool first_same_as_last;  // its last stage is f at the new state
  double stability;         // its interval on the negative real axis
  const char* name;
};

// By right-hand sides against error (docs/solvers.md): the third order costs 4 slopes and suffices for a
// loose tolerance; not with loops, where a larger error takes longer to project. At tighter ones the fifth
// suits communication steps that are one step (7 slopes, not 13), the eighth those of several. Verner's 6(5)
// and Cash-Karp's 5(4) lie between and are nowhere the best.
constexpr Table third = {bogacki_shampine_3, 3, true, 2.5, "erk (Bogacki-Shampine 3(2))"};
constexpr Table fifth = {dormand_prince_5, 5, true, 3.3, "erk (Dormand-Prince 5(4))"};
constexpr Table eighth = {dormand_prince_8, 8, false, 5.2, "erk (Dormand-Prince 8(7))"};

bool is_third_order(double rtol, const System& system) {
  return rtol > Tuning::third_order_rtol && !system.has_constraints();
}

const Table& alone_for(double rtol, const System& system) {
  return is_third_order(rtol, system) ? third : rtol > Tuning::eighth_order_rtol ? fifth : eighth;
}

// Friction and stops change the forces within one or two steps, so the longer steps of a higher order gain
// nothing.
bool is_smooth(const Plan<double>& plan) {
  return std::none_of(plan.joints.begin(), plan.joints.end(),
                      [](const JointPlan<double>& joint) { return joint.has_friction || joint.has_stops; });
}

struct ErkStepDeleter {
  void operator()(void* memory) const { ERKStepFree(&memory); }
};

class Erk final : public OneStep {
 public:
  Erk(System& system, const SolverSettings& settings, Room room);
  const char* name() const override {
    return choice_ ? "erk (Dormand-Prince 5(4) and 8(7))" : alone_for(settings_.rtol, system_).name;
  }
  double allowed_step() const override {
    return choice_ && choice_->eighth() ? OneStep::allowed_step() / choice_->gain() : OneStep::allowed_step();
  }

 private:
  using Memory = std::unique_ptr<void, ErkStepDeleter>;

  static int right_hand_side(double time, N_Vector y, N_Vector ydot, void* self);

  Memory made(const Table& table);
  const Table& table_in_use() const {
    return !choice_ ? alone_for(settings_.rtol, system_) : choice_->eighth() ? eighth : fifth;
  }
  int run(double first_step) override;
  double reached() const override;
  const double* last_slope() const override { return last_slope_; }
  const char* reason(int) const override { return nullptr; }
  double stability() const override { return table_in_use().stability; }

  void choose_table(double remaining) override;
  long steps_between_choices() const override {
    return choice_ ? choice_->steps_until_decision() : OneStep::steps_between_choices();
  }
  void use_chosen();
  void forget_choice() override;
  void put_choice(ByteWriter& writer) const override;
  bool get_choice(ByteReader& reader) override;

  Memory lower_, eighth_;  // eighth_: only with a choice
  void* in_use_ = nullptr;
  std::optional<TableChoice> choice_;   // if there are two tables
  const double* last_slope_ = nullptr;  // where ERKStep keeps the slope at the end of its last step, or null
  bool reuse_slope_ = false;            // the next slope asked for is slope_
};

[[gnu::cold]] Erk::Erk(System& system, const SolverSettings& settings, Room room)
    : OneStep(system, settings, std::move(room), SolverMethod::erk,
              alone_for(settings.rtol, system).error_order, 1) {
  if (!is_third_order(settings.rtol, system) && is_smooth(system.plan())) {
    set_error_order(fifth.error_order);
    lower_ = made(fifth);
    eighth_ = made(eighth);
    choice_.emplace(settings.rtol);
  } else {
    lower_ = made(alone_for(settings.rtol, system));
  }
  in_use_ = lower_.get();
  statistics_ = {};
}

[[gnu::cold]] Erk::Memory Erk::made(const Table& table) {
  Memory memory(created(ERKStepCreate(&Erk::right_hand_side, 0.0, start_.get(), room_->context)));
  void* erk = memory.get();
  ERKStepSetErrHandlerFn(erk, &LastMessage::keep, &room_->message);
  ERKStepSetUserData(erk, static_cast<OneStep*>(this));
  ERKStepSetTable(erk, table.coefficients().get());  // copies it
  ERKStepSetInterpolantDegree(erk, 1);  // never used between step ends; higher ones cost right-hand sides
  ERKStepWFtolerances(erk, &OneStep::weights);
  ERKStepSetAdaptivityFn(erk, &OneStep::adapt, static_cast<OneStep*>(this));
  ERKStepSetErrorBias(erk, 1.0);
  ERKStepSetSafetyFactor(erk, sundials_safety);
  ERKStepSetFixedStepBounds(erk, 1.0, 1.0);
  ERKStepSetMinReduction(erk, shortest_to_touch);
  ERKStepSetMaxErrTestFails(erk, 100);  // StepControl stops before
  if (settings_.max_step > 0) ERKStepSetMaxStep(erk, settings_.max_step);
  // ERKStep takes c = 1 in the last stage for "first same as last", which 8(7) is not, unless a step is
  // post-processed: then it asks for the slope at the new state
  if (!table.first_same_as_last || system_.has_constraints())
    ERKStepSetPostprocessStepFn(erk, &OneStep::complete_step);

  warming_up_ = true;
  end_ = 1;
  control_.start(1);
  ERKStepSetInitStep(erk, 1.0);
  double reached = 0;
  ERKStepEvolve(erk, 1.0, result_.get(), &reached, ARK_ONE_STEP);
  warming_up_ = false;
  return memory;
}

void Erk::choose_table(double remaining) {
  if (!choice_) return;
  const bool same = !system_.has_constraints();  // the last slope is the next step's first
  double factor;
  choice_->decide({remaining, control_.wanted(), control_.step_limit(), statistics_.steps,
                   slope_known_ || !same ? 0.0 : 1.0, same ? 6.0 : 7.0},
                  factor);
  if (factor == 1) return;
  use_chosen();
  control_.start(factor * control_.wanted());
}

void Erk::use_chosen() {
  in_use_ = choice_->eighth() ? eighth_.get() : lower_.get();
  set_error_order(table_in_use().error_order);
}

void Erk::forget_choice() {
  if (!choice_) return;
  choice_->forget();
  use_chosen();
}

void Erk::put_choice(ByteWriter& writer) const {
  if (choice_) choice_->put(writer);
}

bool Erk::get_choice(ByteReader& reader) {
  if (!choice_) return reader.finished();
  if (!choice_->get(reader)) return false;
  use_chosen();
  return true;
}

int Erk::right_hand_side(double time, N_Vector y, N_Vector ydot, void* self_pointer) {
  Erk& self = static_cast<Erk&>(*static_cast<OneStep*>(self_pointer));
  double* slope = data(ydot);
  const std::size_t bytes = self.y_.size() * sizeof(double);
  if (self.skip_slope_) {
    self.skip_slope_ = false;
    self.last_slope_ = nullptr;
    return 0;
  }
  if (self.reuse_slope_) {
    self.reuse_slope_ = false;
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
    const Status status = self.system_.right_hand_side(self.absolute(time), data(y), slope);
    if (status == Status::ok) return 0;
    if (status == Status::fatal) return -1;
    self.stage_failed_ = true;
  }
  // without a slope ERKStep fails; with a NaN it tries a smaller step
  std::fill_n(slope, self.y_.size(), std::numeric_limits<double>::quiet_NaN());
  return 0;
}

int Erk::run(double first_step) {
  void* erk = in_use_;
  reuse_slope_ = slope_known_;
  ERKStepSetMaxNumSteps(erk, allowed_);
  ERKStepSetInitStep(erk, first_step);
  ERKStepReset(erk, since_, start_.get());
  ERKStepSetStopTime(erk, end_);
  double reached = since_;
  return ERKStepEvolve(erk, end_, result_.get(), &reached, ARK_NORMAL);
}

double Erk::reached() const {
  double time = since_;
  ERKStepGetCurrentTime(in_use_, &time);
  return time;
}

}  // namespace

[[gnu::cold]] std::unique_ptr<OneStep> make_erk(System& system, const SolverSettings& settings, Room room) {
  return std::make_unique<Erk>(system, settings, std::move(room));
}

}  // namespace redysim
