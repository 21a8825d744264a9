#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include "integrate/methods/explicit_steps.hpp"
#include "integrate/methods/force_corners.hpp"
#include "integrate/methods/one_step.hpp"
#include "integrate/methods/state_bytes.hpp"
#include "integrate/methods/table_choice.hpp"
#include "integrate/methods/tuning.hpp"

// Explicit Runge-Kutta steps of order 3, 5 and 8. A step takes one right-hand side per stage. At order 3 and
// 5 it takes one fewer if the last slope is also the first one of the next step (same inputs).
//
// While inputs are held, a step of order 8 may pass the end of an advance, at the cost of three right-hand
// sides for its interpolating polynomial. The polynomial gives the state there and at the ends of the next
// advances, until the inputs change.

namespace redysim {
namespace {

// Chosen by right-hand sides against error (docs/solver_measurements.md). Order 3 costs 4 slopes and suffices
// for a loose tolerance, but not with loops, where projecting a larger error takes longer. At tighter
// tolerances order 5 suits communication steps of one step (7 slopes instead of 12), order 8 those of several
// steps, and held inputs. Verner's 6(5) and Cash-Karp's 5(4) lie between and are nowhere the best.
const ExplicitTable& lower_for(double rtol, const System& system) {
  return rtol > Tuning::third_order_rtol && !system.has_constraints() ? bogacki_shampine : dormand_prince;
}

class Erk final : public OneStep {
 public:
  Erk(System& system, const SolverSettings& settings, Scratch scratch);
  const char* name() const override {
    return &lower_ == &bogacki_shampine ? "erk (Bogacki-Shampine 3(2) and Dormand-Prince 8(5,3))"
                                        : "erk (Dormand-Prince 5(4) and 8(5,3))";
  }
  void set_state(const double* y) override {
    passing_.length = 0;
    OneStep::set_state(y);
  }
  double allowed_step() const override {
    return takes_eighth() ? OneStep::allowed_step() / choice_.gain() : OneStep::allowed_step();
  }
  // Contacts end steps, max_rhs requires an even load of the advances.
  bool passes_ends() const override {
    return !starts_singular_ && !system_.plan().has_contacts() &&
           (corners_of(system_) & Corners::backlash) == 0 && !(settings_.max_rhs > 0);
  }

 private:
  struct Passing {
    // numbers of advances: since the inputs changed, and between the two changes before
    double held = 0, held_before = 0;
    // the step that passed the end of the last advance: it starts `begin` after `origin`; length 0: none
    double origin = 0, begin = 0, length = 0;
  };
  static constexpr double Passing::*passing_parts[] = {&Passing::held, &Passing::held_before,
                                                       &Passing::origin, &Passing::begin, &Passing::length};

  static bool slope(double time, const double* y, double* slope, void* self);

  bool takes_eighth() const { return choice_.eighth(); }
  void use_table();
  double stability() const override { return table_in_use().stability; }
  const ExplicitTable& table_in_use() const { return takes_eighth() ? dop853 : lower_; }

  double affordable_steps() const override;
  // the search for contacts uses the workspace
  bool evaluated_candidate() const override {
    return steps_.ends_with_slope() && !system_.plan().has_contacts();
  }
  bool keeps_slope() const { return steps_.ends_with_slope() && !system_.has_constraints(); }
  bool begin_step(double h) override;
  double attempt_error(double h) override;
  Flag accept(double end, double h) override;
  void keep_last_slope();  // the slope at the new state, valid unless that state is projected
  bool pass(double h);
  void expect_changes(bool inputs_changed);
  bool reaches(double end) const override {
    return passing_.length > 0 && end - origin_ <= end_of_last_step();
  }
  bool lies_in_last_step(bool inputs_changed) override;
  void leave_last_step() override;
  double end_of_last_step() const { return passing_.begin + passing_.length - (origin_ - passing_.origin); }
  bool read_goal(double* y) {
    return read((goal_ - passing_.origin - passing_.begin) / passing_.length, goal_, y);
  }
  bool read(double share, double time, double* y);

  void choose_table(double remaining) override;
  long steps_between_choices() const override { return choice_.steps_until_decision(); }
  void forget_choice() override;
  void put_choice(ByteWriter& writer) const override;
  bool get_choice(ByteReader& reader) override;

  const ExplicitTable& lower_;  // of order 3 or 5
  TableChoice choice_;          // between lower_ and order 8
  ExplicitSteps steps_;
  std::vector<double> weights_;  // for the present step
  bool expects_hold_ = false;    // inputs are expected to be held
  CornerWatch corners_{system_};
  Passing passing_;
};

[[gnu::cold]] Erk::Erk(System& system, const SolverSettings& settings, Scratch scratch)
    : OneStep(system, settings, std::move(scratch), SolverMethod::erk, dop853.error_order, 1),
      lower_(lower_for(settings.rtol, system)),
      choice_(settings.rtol, &lower_ == &bogacki_shampine),
      steps_(y_.size(), &Erk::slope, static_cast<OneStep*>(this)),
      weights_(y_) {
  use_table();
}

void Erk::use_table() {
  steps_.use(table_in_use());
  set_error_order(table_in_use().error_order);
}

void Erk::choose_table(double remaining) {
  // a projected end needs one more slope; otherwise the last slope is the first of the next step
  const double projected = system_.has_constraints() ? 1 : 0;
  const unsigned kinds = corners_of(system_) & Corners::of_state;
  const bool corners = kinds != 0;
  const double smooth_for = corners ? Tuning::share_of_gap * time_to_corner(system_, y_.data(), slope_.data())
                                    : std::numeric_limits<double>::infinity();
  double factor;
  choice_.decide({remaining, control_.wanted(), control_.step_limit(), statistics_.steps,
                  slope_known_ ? 0 : 1 - projected, lower_.last + projected, expects_hold_, corners,
                  kinds == Corners::stops, smooth_for, affordable()},
                 factor);
  farthest_ = end_;
  if (expects_hold_ && takes_eighth())
    farthest_ = std::max(end_, std::min(system_.next_breakpoint(time()) - origin_, since_ + smooth_for));
  if (factor == 1) return;
  use_table();
  control_.start(factor * control_.wanted());
}

void Erk::forget_choice() {
  passing_ = {};
  choice_.forget();
  use_table();
}

[[gnu::cold]] void Erk::put_choice(ByteWriter& writer) const {
  for (const auto part : passing_parts) writer.put(passing_.*part);
  if (passing_.length > 0) {
    std::vector<double> polynomial(steps_.saved());
    steps_.save(polynomial.data());
    writer.put(polynomial.data(), polynomial.size());
  }
  choice_.put(writer);
}

[[gnu::cold]] bool Erk::get_choice(ByteReader& reader) {
  Passing passing;
  for (const auto part : passing_parts) {
    reader.get(passing.*part);
    if (!std::isfinite(passing.*part)) return false;
  }
  std::vector<double> polynomial(passing.length > 0 ? steps_.saved() : 0);
  reader.get(polynomial.data(), polynomial.size());
  if (!choice_.get(reader)) return false;
  passing_ = passing;
  if (passing.length > 0) steps_.restore(polynomial.data());
  use_table();
  return true;
}

bool Erk::slope(double time, const double* y, double* slope, void* self_pointer) {
  Erk& self = static_cast<Erk&>(*static_cast<OneStep*>(self_pointer));
  ++self.statistics_.evaluations;
  if (self.system_.right_hand_side(self.absolute(time), y, slope) != Status::ok) return false;
  self.corners_.note(self.system_, self.absolute(time), y);
  return true;
}

bool Erk::begin_step(double) {
  if (is_overconstrained()) {
    release_rank();
    // other states have been evaluated after a known slope; max_rhs allows no repetition
    slope_known_ = slope_known_ && settings_.max_rhs > 0;
  }
  const bool determines_rank = !slope_known_;
  if (!slope_known_ && !slope(reached_, result_, slope_.data(), static_cast<OneStep*>(this))) return false;
  slope_known_ = true;
  if (determines_rank) hold_rank();
  corners_.begin(system_, absolute(reached_), result_);
  std::copy(slope_.begin(), slope_.end(), steps_.first_slope());
  error_weights_.evaluate(result_, weights_.data());
  error_weights_.weigh_work(system_, absolute(reached_), result_, weights_.data());
  return true;
}

double Erk::attempt_error(double h) {
  corners_.attempt();
  constexpr double impossible = std::numeric_limits<double>::infinity();
  if (!steps_.step(reached_, h, result_, candidate_)) return impossible;
  double error = steps_.error(h, error_weights_, weights_.data());
  const bool passes = reached_ + h > end_;
  if (passes && error <= 1) {
    if (!steps_.fit(reached_, h)) return impossible;
    error = std::max(error,
                     Tuning::worth_of_last_term * error_weights_.norm(steps_.last_term(), weights_.data()));
  }
  const double time = absolute(reached_ + h);
  if (!corners_.crosses(system_, time, candidate_))
    return std::isfinite(corners_.time_of_short_touch(system_, time, candidate_, weights_.data()))
               ? std::max(error, Tuning::error_of_corner)
               : error;
  return passes ? std::max(error, Tuning::error_of_corner) : Tuning::doubt_of_corner * error;
}

double Erk::affordable_steps() const {
  const double stages = steps_.ends_with_slope() ? lower_.last : dop853.last - 1;
  const double first_slope = keeps_slope() ? 0 : 1;
  return std::max(0.0, std::floor((affordable() + first_slope) / (stages + first_slope)));
}

OneStep::Flag Erk::accept(double end, double h) {
  if (end <= end_) {
    const Flag flag = OneStep::accept(end, h);
    if (keeps_slope()) keep_last_slope();
    return flag;
  }
  if (!pass(h)) {
    expects_hold_ = false;
    farthest_ = end_;  // repeats the step, ending at the end of the advance
  }
  return Flag::done;
}

void Erk::keep_last_slope() {
  std::copy_n(steps_.last_slope(), slope_.size(), slope_.begin());
  slope_known_ = true;
}

// Ends the advance within a step of size h, after `fit`. False: the state there cannot be computed.
bool Erk::pass(double h) {
  passing_.origin = origin_;
  passing_.begin = reached_;
  passing_.length = h;
  if (!read_goal(result_)) return false;
  reached_ = end_;
  return true;
}

// Updates expects_hold_: if inputs change during the next advances, the rest of a long step is lost.
void Erk::expect_changes(bool inputs_changed) {
  if (inputs_changed) {
    passing_.held_before = passing_.held;
    passing_.held = passing_.length = 0;
  }
  const bool outlasts = passing_.held > 0 && passing_.held >= passing_.held_before;
  expects_hold_ = passes_ends() && (outlasts || passing_.held_before - passing_.held >= Tuning::held_to_pass);
  ++passing_.held;
}

bool Erk::lies_in_last_step(bool inputs_changed) {
  expect_changes(inputs_changed);
  return passing_.length > 0 && end_ <= end_of_last_step() && read_goal(y_.data());
}

// If the end of the step violates a loop, continues from the end of the last advance.
void Erk::leave_last_step() {
  if (passing_.length == 0) return;
  const double end = end_of_last_step();
  if (read(1, origin_ + end, y_.data())) {
    since_ = end;
    if (system_.plan().loops.empty()) keep_last_slope();
  }
  passing_.length = 0;
}

// Sets y to the state at a share of the last step. The polynomial satisfies rigid couplings up to rounding,
// which is removed at its end, but loops only approximately. False: a loop cannot be closed; y is unchanged,
// and the step is given up.
bool Erk::read(double share, double time, double* y) {
  slope_known_ = false;  // slope_ is that at the start of the step
  steps_.evaluate(share, candidate_);
  const bool closed = share == 1 || is_overconstrained()
                          ? system_.close_loops(time, candidate_)
                          : system_.plan().loops.empty() || system_.close_within_step(time, candidate_);
  if (!closed) {
    passing_.length = 0;
    return false;
  }
  std::copy_n(candidate_, y_.size(), y);
  return true;
}

}  // namespace

[[gnu::cold]] std::unique_ptr<OneStep> make_erk(System& system, const SolverSettings& settings,
                                                Scratch scratch) {
  return std::make_unique<Erk>(system, settings, std::move(scratch));
}

}  // namespace redysim
