#pragma once

namespace redysim {

// Constants that were chosen by measurement: of `auto`, and of the choice between the tables of `erk`. Costs
// are numbers of right-hand sides, so that the same run makes the same choices.
struct Tuning {
  // ---- auto
  // Measured with bench/stepping on the 37 files of models/ at rtol 1e-6: 1 s in steps of 10 ms and 0.5 s in
  // steps of 1 ms with held inputs, 0.5 s in steps of 10 ms with torques of switching sign; 111 runs. With
  // these values `auto` takes at most 2.1 times the right-hand sides of the best single method
  // (docs/solvers.md).

  static constexpr long steps_between_choices = 16;  // internal steps

  // Multistep or one step. A restart of a multistep method costs what about six communication steps of erk
  // cost.
  static constexpr int held_for_adams = 6;  // communication steps with held inputs until adams starts
  static constexpr int held_for_bdf = 3;    // the same for bdf, whose alternative, dirk, costs more
  // Communication step over the step that the tolerance allows erk: adams saves right-hand sides below it
  // (smooth scenes in steps of 10 ms took 3 times those of adams with a smaller limit).
  static constexpr double longest_for_adams = 6;
  // Internal steps of bdf in a communication step from which on its restart does not matter.
  static constexpr double restart_negligible = 30;

  // Explicit or implicit. The spectral radius is estimated after so many right-hand sides, then after twice
  // as many, and so on; an estimate takes 19.
  static constexpr long first_estimate = 100;
  static constexpr long rarest_estimate = 3000;
  // Step times spectral radius from which on an explicit method counts as limited by its stability: for erk
  // as a share of its stability interval, smaller where inputs are held and bdf needs no restart (without it
  // the governor took 9 times the right-hand sides of bdf); for adams as it is, since its iteration must
  // contract.
  static constexpr double erk_stability = 0.6;
  static constexpr double erk_stability_held = 0.2;
  static constexpr double adams_stability = 0.3;
  // Step times spectral radius below which bdf counts as limited by its stability, by a highly oscillatory
  // part of the motion: dirk is tried (stiff_arm took 3 times the right-hand sides of dirk without it).
  static constexpr double bdf_oscillatory = 10;
  // What explicit steps would cost instead of implicit ones: stages a step, and step times spectral radius.
  static constexpr double explicit_stages = 7;
  static constexpr double explicit_step = 2.5;
  static constexpr double promised_gain = 0.7;  // of the cost: what a trial of erk must promise

  // Trials of another method. A Jacobian with its factorization takes the time of 1.5 right-hand sides a
  // column.
  static constexpr long trial_cost = 400;     // right-hand sides until a trial is judged
  static constexpr int longest_backoff = 64;  // factor on the time between estimates after failed trials
  static constexpr double jacobian_column = 1.5;

  // ---- tables of erk
  // Measured with bench/stepping on 46 cases: KR5, gripper, four-bar, pendulum, planar arm and top, at rest,
  // with slow and with switching torques, in steps of 1 to 100 ms. On average erk takes 4, 8 and 18 % fewer
  // right-hand sides than order 5 alone at rtol 1e-6, 1e-7 and 1e-8, with 0.7, 0.25 and 0.15 of its error
  // (docs/solvers.md).

  static constexpr double third_order_rtol = 5e-3;   // above it the third order costs least
  static constexpr double eighth_order_rtol = 1e-9;  // order 8 from here down, where forces have corners

  static constexpr double eighth_stages = 13;
  static constexpr double accuracy_worth =
      1.1;  // times the right-hand sides that the smaller error of order 8 is worth
  static constexpr double hysteresis = 1.1;  // in favour of the table in use
  static constexpr long settling_steps = 4;  // after which the step size of a new table is its own
  static constexpr long review_steps = 16;   // after which a long advance is looked at again
  static constexpr double settled_growth =
      2;  // of the step size since the last decision; above it, none is made
  // Step of order 8 over that of order 5, 1.6 (1e4 rtol)^-0.07: the exponent follows from local errors C
  // (h/L)^5 = rtol and C' (h/L)^8 = rtol, the factor is that of KR5, gripper and four-bar. It is learned at
  // each change, and forgotten with each decision.
  static constexpr double step_ratio = 1.6, step_ratio_tolerances = 1e4, step_ratio_exponent = -0.07;
  static constexpr double smallest_ratio = 1, largest_ratio = 12;
  static constexpr double forgotten = 0.01;
};

}  // namespace redysim
