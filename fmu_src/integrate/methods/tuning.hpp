#pragma once

#include <cstdint>

namespace redysim {

// Constants that were chosen by measurement: of `auto`, and of the choice between the tables of `erk`. Costs
// are numbers of right-hand sides, so that the same run makes the same choices. In `auto` the constants of
// starts, steps and trials are right-hand sides of their method and weighted by slope_time().
struct Tuning {
  // ---- auto
  // Measured with bench/automatic.py: work against the best single method at equal error, at rtol 1e-4 to
  // 1e-10, in six uses of the files of models/ (docs/solvers.md).

  static constexpr long steps_between_choices = 16;  // internal steps
  // Up to so many states, about 60 DOF, the implicit methods are created before they are needed. Their
  // matrices then take up to 600 kB.
  static constexpr int implicit_from_start = 128;

  // Multistep or one step: number of steps of the one-step method, for which inputs are held, from which on
  // the multistep method is tried, and below which it is left at once.
  static constexpr double held_for_adams = 5.5;
  // Right-hand sides of restarts and steps. A method is tried only where those of the method in use cost more
  // until the inputs change.
  static constexpr double adams_restart = 30, adams_step = 5, bdf_restart = 50, dirk_step = 15;
  static constexpr double held_for_bdf = 3;
  static constexpr double held_for_restart = 2.5;
  // Communication step over the step that the tolerance allows erk: above it adams is tried later.
  static constexpr double longest_for_adams = 6;
  static constexpr double long_trial_after = 300;  // right-hand sides

  // Explicit or implicit. The spectral radius is estimated after so many right-hand sides, then after twice
  // as many, and so on; an estimate takes 19. Not where explicit methods take one step for each input.
  static constexpr double first_estimate = 100;
  static constexpr double rarest_estimate = 3000;
  static constexpr double held_for_estimate = 1.5;
  // Step times spectral radius from which on an explicit method counts as limited by its stability: for erk
  // as a share of its stability interval, smaller where inputs are held and bdf needs no restart (without it
  // the governor took 9 times the right-hand sides of bdf); for adams as it is, since its iteration must
  // contract.
  static constexpr double erk_stability = 0.6;
  static constexpr double erk_stability_held = 0.2;
  static constexpr double adams_stability = 0.3, series_stability = 3;
  static constexpr double long_hold = 200;  // right-hand sides until the inputs change
  // Step times spectral radius below which bdf counts as limited by its stability, by a highly oscillatory
  // part of the motion: dirk is tried (stiff_arm took 3 times the right-hand sides of dirk without it).
  static constexpr double bdf_oscillatory = 10;
  static constexpr double steady = 1.5;  // ratio of two such estimates, at most
  // exponential is tried where the communication step times the spectral radius is at least fast_vibration, a
  // step of the method in use times it at most bound_by_vibration, and the trace of the Jacobian at most
  // undamped times the radius.
  static constexpr double fast_vibration = 40;
  static constexpr double bound_by_vibration = 10;
  static constexpr double undamped = 1e-3;
  static constexpr double difference_step = 1e-5;         // of a state's scale
  static constexpr double exponential_slopes = 5;         // right-hand sides of a step, without its Jacobian
  static constexpr long exponential_between_choices = 2;  // internal steps
  // What explicit steps would cost instead of implicit ones: stages a step, and step times spectral radius.
  static constexpr double explicit_stages = 7;
  static constexpr double explicit_step = 2.5;
  static constexpr double promised_gain = 0.7;  // of the cost: what a trial of erk must promise

  // Trials of another method. A Jacobian with its factorization takes the time of 1.5 right-hand sides a
  // column.
  static constexpr double jacobian_column = 1.5;
  static constexpr double bucket = 100;                           // right-hand sides of a measurement
  static constexpr double settled = 40, settled_multistep = 300;  // right-hand sides of a start
  static constexpr double hopeless = 3;             // cost over that before, at which a trial ends early
  static constexpr double overtaken = 1.3;          // cost over that of the rival in the last trial
  static constexpr double undecided_share = 0.125;  // of the wait after a failed trial, at least
  static constexpr double undecided_wait = 200;     // after a trial that the motion has overtaken
  static constexpr double present_margin = 1.5;     // cost at the present step size, at most
  static constexpr double least_account = 24;       // right-hand sides before a trial
  static constexpr double settling_cost = 120;      // of a trial, before its measurement
  static constexpr double settling_cost_erk = 30;
  static constexpr double trial_cost = 150;  // of the measurement
  static constexpr double longest_trial =
      20000;                                    // right-hand sides in which an interval between changes ends
  static constexpr double long_account = 1500;  // the same, for stiffness that begins within one,
  static constexpr double long_interval = 1.5;  // and its share of the interval before, at least
  static constexpr double outdated = 1500;      // after which a step size of another method is unknown
  static constexpr double steady_cost = 2;      // ratio of two measurements, at most
  static constexpr double growing = 1.5;        // growth of the step size that extends a trial
  static constexpr int most_extensions = 4;
  // Work over that of the method before in a whole interval between changes, at which a trial ends early.
  static constexpr double lost = 1.3;
  // Right-hand sides of the average with which a trial is compared: over a shorter one, an impact decided
  // (redysim_small_biped took 4.3 times the right-hand sides of bdf).
  static constexpr double horizon = 2000;
  static constexpr double better = 0.95;  // cost of a method that stays over that before it
  // Right-hand sides until the loser of a trial may be tried again; more, in proportion, where it took more
  // than so many in addition. So all trials of a method take 5 % of the work in the end.
  static constexpr double usual_excess = 250;
  static constexpr double first_wait = 1000;
  static constexpr double longer_wait = 4;  // factor after each
  static constexpr double longest_wait = 5000;

  // ---- tables of erk
  // Measured with bench/stepping on KR5, gripper, four-bar, pendulum, planar arm and top, at rest, with slow
  // and with switching torques, in steps of 1 to 100 ms (docs/solvers.md).

  static constexpr double third_order_rtol = 5e-3;  // above it the third order costs least
  // Where forces have corners: above this tolerance order 8 only for a remaining interval of so many steps of
  // order 5 (over an impact, its longer steps are rejected more often).
  static constexpr double corners_rtol = 1e-9, short_of_corners = 0.5;
  static constexpr double share_of_gap = 0.8;  // of the time to a corner that a step of order 8 may take
  // Of a step with a corner: the estimate of an error counts so many times, as it is small by chance in some
  // of them; one that ends beyond the advance is halved.
  static constexpr double doubt_of_corner = 100, error_of_corner = 256;

  static constexpr double eighth_stages = 12, polynomial_stages = 3;
  static constexpr std::int64_t held_to_pass = 3;  // advances with the same inputs to come
  static constexpr double accuracy_worth =
      1.1;  // times the right-hand sides that the smaller error of order 8 is worth
  static constexpr double hysteresis = 1.1;  // in favour of the table in use
  static constexpr long settling_steps = 4;  // after which the step size of a new table is its own
  static constexpr long review_steps = 16;   // after which a long advance is looked at again
  static constexpr double settled_growth =
      2;  // of the step size since the last decision; above it, none is made
  // Step of order 8 over that of order 5, 1.6 (1e4 rtol)^-0.07: the exponent follows from local errors C
  // (h/L)^5 = rtol and C' (h/L)^8 = rtol, the factors are those of KR5, gripper and four-bar, the second over
  // order 3. It is learned at each change, and forgotten with each decision.
  static constexpr double step_ratio = 1.6, step_ratio_third = 3.5, step_ratio_tolerances = 1e4,
                          step_ratio_exponent = -0.07;
  static constexpr double smallest_ratio = 1, largest_ratio = 12;
  static constexpr double forgotten = 0.01;
};

}  // namespace redysim
