"""Measures CPU time and error for all combinations of method, tolerance and communication step size."""

from __future__ import annotations

import math
import time
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, field, replace

from build_fmu.errors import InvalidArgument, UserError
from build_fmu.report.motion import Positions
from build_fmu.report.reference import Reference
from build_fmu.run.driver import Outcome, Staged, Task, drive
from build_fmu.run.prescribed import MOTION

METHODS = ("auto", "erk", "adams", "dirk", "bdf", "exponential")
TOLERANCES = tuple(10.0**-k for k in range(3, 13))
# added to each input at every other step: below the rounding of any torque, but a changed input
TOUCH = 1e-100


@dataclass(frozen=True)
class Inputs:
    """Inputs sampled at each communication step: names and a function of time that returns their values."""

    names: list[str] = field(default_factory=list)
    row: Callable[[float], list[float]] = lambda _: []

    @property
    def given(self) -> bool:
        """Returns whether there are inputs."""
        return bool(self.names)


@dataclass(frozen=True)
class Point:
    """One measured run. Error in m or rad, cost in µs of CPU time per ms of motion."""

    method: str
    rtol: float
    step: float
    changing: bool
    outcome: Outcome
    error: float
    us_per_ms: float
    rhs_per_ms: float
    taken: float = math.nan  # s, wall-clock time with all repetitions

    @property
    def good(self) -> bool:
        """Returns whether the run finished."""
        return self.outcome.status == "ok" and math.isfinite(self.error)


WORTH_SHARING = 0.1  # of the time limit: less is not given to unfinished curves


@dataclass(frozen=True)
class Plan:
    """The settings of a sweep: times in s, the time limit `seconds` of all runs, and the repetitions of each run."""

    stop: float
    steps: Sequence[float]
    methods: Sequence[str]
    tolerances: Sequence[float] = TOLERANCES
    changing: Sequence[bool] = (False, True)
    seconds: float = 120.0
    repeats: int = 20
    spend: float = 0.06


def known_method(name: str) -> None:
    """Raises InvalidArgument for an unknown solver method."""
    if name not in METHODS:
        raise InvalidArgument(f"unknown method '{name}'; available: {', '.join(METHODS)}")


def offered_methods(fmu: Staged, wanted: Sequence[str] = METHODS) -> list[str]:
    """Returns the methods that the FMU supports."""
    if "solver.method" not in fmu.variables or "solver.rtol" not in fmu.variables:
        raise UserError(f"'{fmu.name}' lacks the parameters solver.method and solver.rtol: it was not built by build-fmu")
    found = []
    for method in wanted:
        outcome = drive(fmu, Task(1e-6, 1, start=fmu.solver(method), budget=20))
        if outcome.status != "refused" or not any("solver.method" in line for line in outcome.log):
            found.append(method)
    return found


def communication_steps(stop: float, step: float) -> list[float]:
    """Returns 0.1, 1 and 10 times the usual step size, as far as they are at most a fifth of the motion."""
    return [h for h in (step / 10, step, step * 10) if h <= stop / 5 * (1 + 1e-9)] or [stop]


def force_inputs(fmu: Staged) -> list[str]:
    """Returns the inputs that `changing` varies: all but prescribed motions, which would be different motions."""
    return [n for n in fmu.names("input") if not n.endswith(MOTION)]


def task_for(fmu: Staged, stop: float, step: float, row_every: float, inputs: Inputs, changing: bool, names: Sequence[str]) -> Task:
    """Returns the run from 0 to `stop` (s) with an output row every `row_every` (s)."""
    count, every = round(stop / step), round(row_every / step)
    if abs(every * step - row_every) > 1e-9 * row_every or every < 1:
        raise UserError(f"the communication step size {step:g} s is not a divisor of the largest one, {row_every:g} s")
    rows: list[list[float]] = [inputs.row(k * step) for k in range(count)] if inputs.given else []
    names_of_inputs = list(inputs.names)
    if changing:
        touched = force_inputs(fmu)
        missing = [n for n in touched if n not in names_of_inputs]
        names_of_inputs += missing
        rows = [row + [0.0] * len(missing) for row in rows] or [[0.0] * len(names_of_inputs), [0.0] * len(names_of_inputs)]
        for k, row in enumerate(rows):
            for i, name in enumerate(names_of_inputs):
                if name in touched and k % 2 == 1:
                    row[i] += TOUCH
    return Task(step, count, every, {}, names, names_of_inputs, rows)


@dataclass
class Pending:
    """A curve with its missing tolerances, loose ones first, and its last run if that had too little time."""

    step: float
    changing: bool
    method: str
    missing: list[float]
    cut: Point | None = None


def measure(
    fmu: Staged, where: Positions, reference: Reference, task: Task, curve: Pending, ratio: float, plan: Plan, budget: float
) -> Point:
    """Runs the next point of a curve, repeated for the measurement of its CPU time."""
    begin, rtol = time.monotonic(), curve.missing[0]
    start = {**task.start, **fmu.solver(curve.method, rtol, ratio)}
    outcome = drive(fmu, replace(task, start=start, repeats=plan.repeats, spend=plan.spend, budget=budget))
    error = cost = rhs = math.nan
    if outcome.status == "ok":
        columns = [list(task.outputs).index(name) for name in where.names]
        error = reference.error(where, outcome.times, outcome.values, columns)
        milliseconds = outcome.reached * 1e3
        cost = outcome.seconds * 1e6 / milliseconds
        count = outcome.health.get("solver.rhs_evaluations")
        rhs = math.nan if count is None else count / milliseconds
    return Point(curve.method, rtol, task.step, curve.changing, outcome, error, cost, rhs, time.monotonic() - begin)


def sweep(
    fmu: Staged,
    where: Positions,
    references: Callable[[float], Reference],
    inputs: Inputs,
    plan: Plan,
    progress: Callable[[str, int], None] = lambda *_: None,
) -> Iterator[Point]:
    """Yields the points, loose tolerances first; a curve ends at a failure.

    The time limit is divided among the curves. Those that exceed their share continue with what the others leave.
    """
    end, ratio = time.monotonic() + plan.seconds, _atol_ratio(fmu)
    loose_first = sorted(plan.tolerances, reverse=True)
    curves = [Pending(h, c, m, loose_first) for h in plan.steps for c in plan.changing for m in plan.methods]

    def run(curve: Pending, waiting: int) -> Iterator[Point]:
        task = task_for(fmu, plan.stop, curve.step, max(plan.steps), inputs, curve.changing, where.names)
        reference = references(curve.step)
        begin, left, curve.cut = time.monotonic(), 0.0, None
        share = (end - begin) / waiting
        while curve.missing and left >= 0 and not curve.cut:
            left = share - (time.monotonic() - begin)
            done = sum(len(loose_first) - len(other.missing) for other in curves)
            progress(f"{curve.method}, rtol {curve.missing[0]:.0e}, step {curve.step:g} s", done)
            point = measure(fmu, where, reference, task, curve, ratio, plan, max(left, 0.5))
            if point.outcome.status == "budget":
                curve.cut = point
            else:
                curve.missing = curve.missing[1:] if point.outcome.status == "ok" else []
                yield point

    while waiting := [curve for curve in curves if curve.missing]:
        for number, curve in enumerate(waiting):
            yield from run(curve, len(waiting) - number)
        if end - time.monotonic() < WORTH_SHARING * plan.seconds:
            yield from (curve.cut for curve in waiting if curve.cut)  # they show the speed
            return


def _atol_ratio(fmu: Staged) -> float:
    rtol, atol = (fmu.variables[name].start for name in ("solver.rtol", "solver.atol"))
    return float(atol) / float(rtol) if rtol else 0.01
