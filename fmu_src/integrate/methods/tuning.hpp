#pragma once

#include <cstdint>

namespace redysim {

// Constants chosen by measurement, for `auto` and for the choice between the tables of `erk`. Costs are
// numbers of right-hand sides, so that equal runs make equal choices. In `auto` the constants of starts,
// steps and trials are right-hand sides of their method and weighted by slope_time().
struct Tuning {
  // ---- auto
  // Measured with bench/automatic.py: work relative to the best single method at equal error, at rtol 1e-4 to
  // 1e-10, in six uses of the files of models/ (docs/solver_measurements.md).

  static constexpr long steps_between_choices = 16;  // internal steps
  // Up to this number of states, about 60 DOF, the implicit methods are created at initialization. Their
  // matrices then take up to 600 kB.
  static constexpr int implicit_from_start = 128;

  // Multistep or one-step: while inputs are held, number of steps of the one-step method from which on a
  // multistep method is tried (held_for_adams, held_for_bdf), and below which it is abandoned at once
  // (held_for_restart).
  static constexpr double held_for_adams = 5.5;
  // Right-hand sides of restarts and steps. A method is tried only if the method in use costs more than these
  // until the inputs change.
  static constexpr double adams_restart = 30, adams_step = 5, bdf_restart = 50, dirk_step = 15;
  static constexpr double held_for_bdf = 3;
  static constexpr double held_for_restart = 2.5;
  // Communication step size relative to the step that the tolerance allows erk: above it adams is tried
  // later.
  static constexpr double longest_for_adams = 6;
  static constexpr double long_trial_after = 300;  // right-hand sides

  // Explicit or implicit. The spectral radius is estimated after this number of right-hand sides, then after
  // twice as many, and so on; an estimate takes 19. No estimate while explicit methods take one step for each
  // input.
  static constexpr double first_estimate = 100;
  static constexpr double second_estimate = 60;  // right-hand sides until a first one is confirmed
  static constexpr double rarest_estimate = 3000;
  static constexpr double held_for_estimate = 1.5;
  // Step size times spectral radius from which on stability limits an explicit method. For erk: relative to
  // its stability interval, and smaller where inputs are held and bdf needs no restart (otherwise the
  // governor took 9 times the right-hand sides of bdf). For adams: absolute, since its iteration must
  // contract.
  static constexpr double erk_stability = 0.6;
  static constexpr double erk_stability_held = 0.2;
  static constexpr double adams_stability = 0.3, series_stability = 3;
  static constexpr double long_hold = 200;  // right-hand sides until the inputs change
  // Part of the step budget of an advance, 1/4, after which bdf is tried instead of an explicit method even
  // if stability does not seem to limit its steps (friction at velocities below the tolerance).
  static constexpr long explicit_part = 4;
  // Step size times spectral radius below which stability limits bdf because of a highly oscillatory part of
  // the motion: then dirk is tried (otherwise stiff_arm took 3 times the right-hand sides of dirk).
  static constexpr double bdf_oscillatory = 10;
  static constexpr double steady = 1.5;  // maximum ratio of two such estimates
  // Accepted steps of bdf for each rejected one, below which dirk is tried while inputs are held although it
  // was never used (a foot of 4 mg took 38 times the right-hand sides of dirk).
  static constexpr long few_accepted = 3;
  // exponential is tried if the communication step size times the spectral radius is at least fast_vibration,
  // the step size of the method in use times the radius at most bound_by_vibration, and the trace of the
  // Jacobian at most undamped times the radius.
  static constexpr double fast_vibration = 40;
  static constexpr double bound_by_vibration = 10;
  static constexpr double undamped = 1e-3;
  static constexpr double difference_step = 1e-5;         // relative to a state's scale
  static constexpr double exponential_slopes = 5;         // right-hand sides of a step, without its Jacobian
  static constexpr long exponential_between_choices = 2;  // internal steps
  // Cost of explicit steps instead of implicit ones: stages per step, and step size times spectral radius.
  static constexpr double explicit_stages = 7;
  static constexpr double explicit_step = 2.5;
  static constexpr double promised_gain = 0.7;  // relative cost that a trial of erk must promise

  // Trials of another method. A Jacobian and its factorization take 1.5 right-hand sides per column.
  static constexpr double jacobian_column = 1.5;
  static constexpr double bucket = 100;                           // right-hand sides of a measurement
  static constexpr double settled = 40, settled_multistep = 300;  // right-hand sides until a start is over
  static constexpr double hopeless = 3;                           // relative cost at which a trial ends early
  static constexpr double overtaken = 1.3;  // relative to the rival's cost: invalidates the last trial
  static constexpr double undecided_share = 0.125;  // minimum wait after that, relative to the previous wait
  static constexpr double undecided_wait = 200;     // minimum wait after that, right-hand sides
  static constexpr double short_evidence = 0.05;    // time of a measurement relative to that of the trial
  static constexpr double present_margin = 1.5;     // maximum ratio to the cost of the present step size
  static constexpr double least_account = 24;       // right-hand sides before a trial
  static constexpr double settling_cost = 120;      // right-hand sides before the measurement of a trial
  static constexpr double settling_cost_erk = 30;
  static constexpr double trial_cost = 150;       // right-hand sides of the measurement
  static constexpr double longest_trial = 20000;  // right-hand sides; ends an interval between changes
  static constexpr double long_account = 1500;    // right-hand sides that end a measurement in an interval
  static constexpr double long_interval = 1.5;    // if above this multiple of the previous interval's work
  static constexpr double outdated = 1500;        // right-hand sides after which a step size is outdated
  static constexpr double steady_cost = 2;        // maximum ratio of two measurements
  static constexpr double growing = 1.5;          // growth of the step size that extends a trial
  static constexpr int most_extensions = 4;
  // Work relative to that of the previous method in a whole interval between changes, at which a trial ends
  // early.
  static constexpr double lost = 1.3;
  // Right-hand sides averaged for the comparison with a trial. With a shorter average, an impact decided
  // (redysim_small_biped took 4.3 times the right-hand sides of bdf).
  static constexpr double horizon = 2000;
  static constexpr double better = 0.95;  // cost relative to the previous method at which the tried one stays
  // Right-hand sides until a rejected method may be tried again; more, in proportion, if its trial took more
  // than usual_excess in addition. Together, all trials of a method finally take 5 % of the work.
  static constexpr double usual_excess = 250;
  static constexpr double first_wait = 1000;
  static constexpr double longer_wait = 4;  // factor after each trial
  static constexpr double longest_wait = 5000;

  // ---- tables of erk
  // Measured with bench/stepping on KR5, gripper, four-bar, pendulum, planar arm and top, at rest, with slow
  // and with switching torques, in steps of 1 to 100 ms (docs/solver_measurements.md).

  static constexpr double third_order_rtol = 5e-3;  // above it order 3 has the minimum cost
  // If forces have corners and the tolerance is above corners_rtol: order 8 only for a remaining interval of
  // at most short_of_corners steps of order 5 (its longer steps are rejected more often at an impact), or
  // with the next stop more than far_from_stops of its steps away.
  static constexpr double corners_rtol = 1e-9, short_of_corners = 0.5, far_from_stops = 10;
  static constexpr double share_of_gap = 0.8;  // part of the time to a corner that a step of order 8 may take
  // For a step with a corner: the error estimate is multiplied by doubt_of_corner, since it may be small by
  // chance. A step that ends beyond the advance, or whose stages miss a stop, is shortened (error_of_corner).
  static constexpr double doubt_of_corner = 100, error_of_corner = 256;

  static constexpr double eighth_stages = 12, polynomial_stages = 3;
  static constexpr std::int64_t held_to_pass = 3;  // expected further advances with the same inputs
  // Error of a step that passes an end, relative to the weighted last coefficient of its polynomial: where
  // stability limits the step, the polynomial was wrong between its ends by several hundred times the
  // tolerance.
  static constexpr double worth_of_last_term = 1 / 1200.0;
  static constexpr double accuracy_worth = 1.1;  // cost ratio accepted for the smaller error of order 8
  static constexpr double hysteresis = 1.1;      // factor in favour of the table in use
  static constexpr long settling_steps = 4;      // steps until the step size of a new table is settled
  static constexpr long review_steps = 16;       // steps until the choice is reviewed in a long advance
  static constexpr double settled_growth = 2;    // maximum change of the step size since the last decision
  // Step size of order 8 relative to order 5: 1.6 (1e4 rtol)^-0.07. The exponent follows from local errors C
  // (h/L)^5 = rtol and C' (h/L)^8 = rtol. The factors are those of KR5, gripper and four-bar; the second one
  // is relative to order 3. The ratio is corrected at each change and decays to the expected value at each
  // decision.
  static constexpr double step_ratio = 1.6, step_ratio_third = 3.5, step_ratio_tolerances = 1e4,
                          step_ratio_exponent = -0.07;
  static constexpr double smallest_ratio = 1, largest_ratio = 12;
  static constexpr double forgotten = 0.01;
};

}  // namespace redysim
