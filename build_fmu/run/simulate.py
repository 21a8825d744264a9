"""Simulates an FMU and records its outputs.

Inputs follow their expressions during each communication step (`input_course.py`) or are held constant. Outputs are read at its end,
before other inputs jump there, and after setting prescribed motions at that time, on which the torques depend.
"""

from __future__ import annotations

import math
import re
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np

from build_fmu.errors import UserError, unknown
from build_fmu.run.input_course import Course
from build_fmu.run.prescribed import MOTION, Prescribed
from build_fmu.run.session import Session
from build_fmu.run.signals import number_of, parse_inputs, parse_start

MOST_STEPS = 100_000_000


@dataclass
class Settings:
    """The settings of a run; None: as in the FMU's default experiment. Times in s."""

    stop: float | None = None
    step: float | None = None
    tolerance: float | None = None
    start: Sequence[str] = ()
    inputs: Sequence[str] = ()
    outputs: Sequence[str] = ()
    interpolate: str = "expressions"  # inputs that change during a step, see signals.MODES


@dataclass
class Result:
    """The results of a run: one row per communication point, SI units."""

    time: np.ndarray
    names: list[str]
    values: np.ndarray  # rows x names
    inputs: dict[str, np.ndarray] = field(default_factory=dict)
    warnings: list[str] = field(default_factory=list)
    remarks: list[str] = field(default_factory=list)  # on the approximation of inputs

    def __getitem__(self, name: str) -> np.ndarray:
        """Returns the column of an output or, failing that, of an input; raises UserError for another name."""
        if name not in self.names and name not in self.inputs:
            raise unknown("output", name, [*self.names, *self.inputs])
        return self.values[:, self.names.index(name)] if name in self.names else self.inputs[name]

    def only(self, names: Sequence[str]) -> Result:
        """Returns the results for these outputs only."""
        column = {name: i for i, name in enumerate(self.names)}
        return replace(self, names=list(names), values=self.values[:, [column[name] for name in names]])


class Stopped(UserError):
    """A simulation that failed. `result` holds the rows before the failure; without any, the start values of joint positions."""

    def __init__(self, sentence: str, result: Result) -> None:
        super().__init__(sentence)
        self.result = result


def simulate(session: Session, settings: Settings, progress: Callable[[float], None] = lambda _: None) -> Result:
    """Simulates the FMU; `progress` gets the time reached (s). Raises UserError, after the start Stopped."""
    times = time_grid(session, settings)
    units = {name: variable.unit for name, variable in session.variables.items()}
    signals = parse_inputs(settings.inputs, lambda name: session.find(name, "input", session.names("input")), units.get)
    start = start_values(session, settings.start)
    names = select_outputs(session, settings.outputs)

    clash = sorted(set(start) & set(signals))
    if clash:
        raise UserError(f"'{clash[0]}' is both a start value and an input")
    mode = settings.interpolate if session.follows_inputs else "none"
    real_inputs = [name for name in session.names("input") if session.variables[name].type == "Real"]
    course = Course(signals, times, _tolerance(session, settings, start), mode, real_inputs)
    values = np.empty((len(times), len(names)))
    recorded = {name: np.empty(len(times)) for name in real_inputs}
    first = {name: float(start.get(name, session.variables[name].start or 0)) for name in real_inputs}
    motions = Prescribed(real_inputs, times[0], first | course.at(times[0]))
    rows = 0
    try:
        session.initialise(times[0], times[-1], settings.tolerance, start | course.at(times[0]))
        for row, now in _course(session, course, times, motions):
            # a read input is the value set last, from which a motion has continued
            moved = motions.at(times[row])
            values[row] = [moved.get(name, value) for name, value in zip(names, session.read(names), strict=True)]
            now = first | now | moved
            for name, column in recorded.items():
                column[row] = now[name]
            rows = row + 1
            progress(times[row])
    except UserError as error:
        positions = {name[:-1]: float(value) for name, value in start.items() if name.endswith(".q0") and name[:-1] in session.variables}
        reached = Result(np.array(times[:rows]), names, values[:rows], {name: column[:rows] for name, column in recorded.items()})
        before = Result(np.array(times[:1]), list(positions), np.array([list(positions.values())]))
        raise Stopped(str(error), replace(reached if rows else before, warnings=session.warnings())) from None
    session.terminate()
    remarks = course.remarks({name: units[name] or "" for name in real_inputs})
    if signals and mode != settings.interpolate:
        remarks.append("inputs: constant during each step, because this FMU does not support derivatives of inputs")
    return Result(np.array(times), names, values, recorded, session.warnings(), remarks)


def _course(session: Session, course: Course, times: list[float], motions: Prescribed) -> Iterator[tuple[int, dict[str, float]]]:
    """Yields the number of each communication point, when it is reached, and its inputs; `motions` follow them."""
    steps = course.steps()
    for row, time in enumerate(times):
        for part in next(steps) if row > 0 else ():
            session.write(part.values)
            session.write_slopes(part.slopes)
            motions.set(part.begin, part.values)
            session.step(part.begin, part.end - part.begin)
            motions.follow(part.begin, part.end, part.slopes)
        now = course.at(time)
        session.write({name: value for name, value in now.items() if name.endswith(MOTION)})
        motions.set(time, now)
        yield row, now


def _tolerance(session: Session, settings: Settings, start: dict[str, Any]) -> float:
    """Returns the tolerance of inputs relative to their largest values.

    It is rtol to the power 2/3: the error of an input has mean zero, so its effect on the state is of higher order.
    """
    rtol = start.get("solver.rtol", session.variables["solver.rtol"].start if "solver.rtol" in session.variables else None)
    return max(1e-10, min(1e-6, abs(min(float(rtol or 1), settings.tolerance or 1)) ** (2 / 3)))


def time_grid(session: Session, settings: Settings) -> list[float]:
    """Returns the communication points (s): a fixed step, the last one shortened to end at the stop time."""
    experiment = session.description.defaultExperiment
    start = float(getattr(experiment, "startTime", None) or 0)
    stop = settings.stop if settings.stop is not None else float(getattr(experiment, "stopTime", None) or start + 1)
    step = settings.step if settings.step is not None else float(getattr(experiment, "stepSize", None) or (stop - start) / 1000)
    if not (math.isfinite(stop) and stop > start):
        raise UserError(f"the stop time must be later than {start:g} s, got {stop:g}")
    if not (math.isfinite(step) and step > 0):
        raise UserError(f"the step size must be a positive time in s, got {step:g}")
    steps = (stop - start) / step
    if steps > MOST_STEPS:
        raise UserError(f"{steps:.3g} steps are too many to record: use a larger --step")
    count = math.ceil(steps * (1 - 1e-12) - 1e-9) or 1  # an integer up to rounding
    return [start + k * step for k in range(count)] + [stop]


def start_values(session: Session, arguments: Sequence[str]) -> dict[str, Any]:
    """Returns checked start values by name; numbers may be expressions such as `pi/2`."""
    settable = [v.name for v in session.variables.values() if v.causality in ("parameter", "input") or v.initial in ("exact", "approx")]
    values: dict[str, Any] = {}
    for name, text in parse_start(arguments).items():
        kind = session.variables[session.find(name, "parameter", settable)].type
        if kind == "String":
            values[name] = text
        elif kind == "Boolean":
            if text.lower() not in ("true", "false", "0", "1"):
                raise UserError(f"'{name}' must be true or false, got '{text}'")
            values[name] = text.lower() in ("true", "1")
        else:
            values[name] = number_of(text, f"start value of '{name}'")
            if kind == "Integer" and values[name] != int(values[name]):
                raise UserError(f"'{name}' must be an integer, got '{text}'")
    return values


def matches(pattern: str, names: Sequence[str]) -> list[str]:
    """Returns the names that match; only * is special, because names such as position[1] contain brackets."""
    rule = re.compile(".*".join(re.escape(part) for part in pattern.split("*")))
    return [name for name in names if rule.fullmatch(name)]


def select_outputs(session: Session, patterns: Sequence[str]) -> list[str]:
    """Returns the numeric outputs that match the names or `*` patterns (separated by commas or spaces), or all outputs."""
    numeric = [n for n in session.names("output") if session.variables[n].type != "String"]
    # not at the comma of mass_matrix[1,2]
    wanted = [p for text in patterns for p in re.split(r"[,\s]+(?![^\[]*\])", text) if p]
    if not wanted:
        return numeric
    readable = [n for n, v in session.variables.items() if v.type != "String"]
    chosen: dict[str, None] = {}
    for pattern in wanted:
        if "*" in pattern:
            found = matches(pattern, numeric) or matches(pattern, session.names("input"))
            if not found:
                raise UserError(f"no output matches '{pattern}'")
            chosen |= dict.fromkeys(found)
        else:
            chosen[session.find(pattern, "output", readable)] = None
    return list(chosen)
