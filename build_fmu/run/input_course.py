"""Approximates inputs that are functions of time by cubic polynomials over parts of the communication steps.

A communication step is divided where an input is not smooth, and further until the cubics meet the tolerance. A cubic interpolates its
input at the four Lobatto points of the part, end points included. Its error has mean zero and is at most h^4/80 |u''''/4!|.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from build_fmu.errors import UserError
from build_fmu.run.branches import Split, halves, inside
from build_fmu.run.prescribed import MOTION
from build_fmu.run.signals import Signal, Table
from build_fmu.run.taylor import magnitude

POINTS = (0.0, 0.5 - math.sqrt(0.05), 0.5 + math.sqrt(0.05), 1.0)
# coefficients of 1, s, s^2, s^3 from the values at the points
FIT = np.linalg.inv(np.vander(POINTS, increasing=True))
FACTORIALS = np.array([1.0, 2.0, 6.0])
CUBIC_ERROR = 1 / 80
MOST_PARTS = 20_000  # of one communication step


@dataclass(frozen=True)
class Part:
    """A part of a step (s), the input values at its start, and the first three derivatives of the inputs that change."""

    begin: float
    end: float
    values: dict[str, float]
    slopes: dict[str, list[float]] = field(default_factory=dict)


@dataclass
class Moving:
    """A derivative of a signal and its inputs; `usual`, `scale`: largest absolute value at samples and so far; `worst`: largest error."""

    signal: Signal
    derivative: int
    names: list[str]
    usual: float = 0.0
    scale: float = 0.0
    worst: float = 0.0

    def at(self, t: float) -> float:
        """Returns the value."""
        return derived(self.names[0], self.signal, self.derivative, t)

    def bound(self, low: float, high: float) -> Bound:
        """Bounds the signal over a range of time; raises Split where it has no bound or is not smooth."""
        m = self.derivative
        series = self.signal.series(low, high, m + 4)
        values = [x * math.factorial(m) for x in (series[m] if m < len(series) else (0.0, 0.0))]
        self.scale = max(self.scale, min(map(abs, values)))
        highest = magnitude(series[m + 4]) if m + 4 < len(series) else 0.0
        return Bound(highest * math.factorial(m + 4) / 24, values[1] - values[0])


@dataclass(frozen=True)
class Bound:
    """The largest fourth Taylor coefficient over a range, and the spread of its values."""

    highest: float
    spread: float = math.inf

    def error(self, size: float) -> float:
        """Returns the error bound of a cubic over a part of `size` (s)."""
        return min(CUBIC_ERROR * size**4 * self.highest, 2 * self.spread)


@dataclass(frozen=True)
class Stretch:
    """A part of a step from a to b, and its range of smooth inputs; `joined`: smooth together with the previous part."""

    a: float
    b: float
    low: float
    high: float
    joined: bool = False
    bounds: Sequence[Bound] = ()

    def halved(self) -> Split:
        """Returns the split in the middle."""
        return halves(self.a, self.b)


class Course:
    """The parts of all steps between the times; `mode`: the signals that change during a step (none, expressions or all)."""

    def __init__(self, signals: Mapping[str, Signal], times: Sequence[float], tolerance: float, mode: str, inputs: Sequence[str]) -> None:
        """`inputs` are the real inputs of the FMU, `tolerance` is relative to each signal's largest value."""
        self.times, self.tolerance = times, tolerance
        self.held = {name: s for name, s in signals.items() if isinstance(s, Table) and mode == "expressions"}
        # for each input a derivative of a signal; of a motion the position first
        self.values: dict[str, tuple[Signal, int]] = {name: (signals[name], 0) for name in sorted(signals, key=_rank)}
        self.moving: list[Moving] = []
        self.parts, self.moved = 0, False
        exact = {name: s for name, s in signals.items() if name in inputs and (mode == "all" or not isinstance(s, Table))}
        motions = _motions(exact, inputs)
        self._complete(motions, exact)
        if mode != "none":
            self._follow(exact, motions)
        samples = times[:: max(1, len(times) // 200)]
        for moving in self.moving:
            moving.scale = moving.usual = max(abs(moving.at(t)) for t in samples)

    def _complete(self, motions: Mapping[str, Sequence[int]], exact: Mapping[str, Signal]) -> None:
        """Adds the missing parts of motions as derivatives of the given ones; a held motion needs them, too: q + qd s + qdd s^2/2."""
        for head, given in motions.items():
            for order in range(given[0], 3):
                below = max(k for k in given if k <= order)
                self.values.setdefault(head + MOTION[order], (exact[head + MOTION[below]], order - below))
        self.values = dict(sorted(self.values.items(), key=lambda item: _rank(item[0])))

    def _follow(self, exact: Mapping[str, Signal], motions: Iterable[str]) -> None:
        """Lets inputs change during a step; a motion changes by its acceleration."""
        accelerations = [head + MOTION[2] for head in motions if head + MOTION[2] not in self.held]
        for name in [*accelerations, *(name for name in exact if name.rpartition(".")[0] not in motions)]:
            self._add(name, *self.values[name])

    def at(self, t: float) -> dict[str, float]:
        """Returns the inputs at a time; a motion includes its derivatives."""
        return {name: derived(name, signal, order, t) for name, (signal, order) in self.values.items()}

    def steps(self) -> Iterator[list[Part]]:
        """Yields the parts of each step."""
        for k, smooth in enumerate(self._smooth_steps()):
            begin, end = self.times[k], self.times[k + 1]
            if not self.moving:
                yield [Part(begin, end, self.at(begin))]
                continue
            parts = [self._part(stretch) for stretch in ([Stretch(begin, end, begin, end)] if smooth else self._merged(begin, end))]
            self.parts += len(parts)
            self.moved = self.moved or len(parts) > 1 or bool(parts[0].slopes)
            yield parts

    def remarks(self, units: Mapping[str, str]) -> list[str]:
        """Returns sentences on the error of the inputs."""
        lines = self._outside_tables()
        if self.moved:
            far = max(self.moving, key=lambda moving: moving.worst / (moving.scale or 1.0))
            left = f"with an error of at most {far.worst:.1g} {units[far.names[0]]} (input '{far.names[0]}')" if far.worst else "exactly"
            lines.append(f"inputs: approximated {left} by cubic polynomials over {self.parts} intervals")
        held: dict[str, list[tuple[float, str]]] = {}
        for name, table in self.held.items():
            if error := _held_error(table, np.array(self.times)):
                held.setdefault(units[name], []).append((error, name))
        return lines + [_held_remark(off, unit) for unit, off in held.items()]

    def _outside_tables(self) -> list[str]:
        """Returns a sentence for each range of tables that does not contain the starts of all steps."""
        begin, end = self.times[0], self.times[-2 if len(self.times) > 1 else 0]
        ranges: dict[tuple[float, float], list[str]] = {}
        for name, (signal, derivative) in self.values.items():
            if isinstance(signal, Table) and derivative == 0 and len(signal.times) > 1:
                ranges.setdefault((signal.times[0], signal.times[-1]), []).append(name)
        slack = 1e-9 * (end - begin)
        return [
            f"inputs: the table of '{names[0]}'{f' and {len(names) - 1} more' if len(names) > 1 else ''} covers {first:g} to {last:g} s "
            f"of a run from {begin:g} to {self.times[-1]:g} s; outside, the nearest row holds"
            for (first, last), names in ranges.items()
            if first > begin + slack or last < end - slack
        ]

    def _add(self, name: str, signal: Signal, derivative: int) -> None:
        for moving in self.moving:
            if moving.signal is signal and moving.derivative == derivative:
                moving.names.append(name)
                return
        self.moving.append(Moving(signal, derivative, [name]))

    def _smooth_steps(self) -> Iterator[bool]:
        """Yields for each step whether one cubic meets the tolerance; ranges of steps are analysed together."""
        ranges = [(0, len(self.times) - 1)]
        size = self.times[1] - self.times[0]
        while ranges:
            first, last = ranges.pop()
            try:
                bounds = [moving.bound(self.times[first], self.times[last]) for moving in self.moving]
                good = self._accepts(bounds, size)
            except Split:
                good = False
            if good:
                self._note(bound.error(size) for bound in bounds)
            if good or last - first == 1:
                yield from [good] * (last - first)
            else:
                middle = (first + last) // 2
                ranges += [(middle, last), (first, middle)]

    def _accepts(self, bounds: Sequence[Bound], size: float) -> bool:
        errors = [bound.error(size) for bound in bounds]
        return all(error <= self.tolerance * moving.scale for error, moving in zip(errors, self.moving, strict=True))

    def _note(self, errors: Iterable[float]) -> None:
        for error, moving in zip(errors, self.moving, strict=True):
            moving.worst = max(moving.worst, error)

    def _merged(self, begin: float, end: float) -> Iterator[Stretch]:
        """Yields the parts of a step; parts that were halved only in the search for points without smoothness are joined."""
        before: Stretch | None = None
        for now in self._parted(begin, end):
            joint = self._joint(before, now) if before and now.joined else None
            if before and not joint:
                self._note(bound.error(before.b - before.a) for bound in before.bounds)
                yield before
            before = joint or now
        self._note(bound.error(before.b - before.a) for bound in before.bounds)
        yield before

    def _joint(self, first: Stretch, second: Stretch) -> Stretch | None:
        bounds = [Bound(max(x.highest, y.highest)) for x, y in zip(first.bounds, second.bounds, strict=True)]
        if not self._accepts(bounds, second.b - first.a):
            return None
        grain = 16 * math.ulp(first.b)
        try:
            for moving in self.moving:
                moving.bound(first.b - grain, first.b + grain)
        except Split:
            return None  # the inputs are not smooth in the middle
        return Stretch(first.a, second.b, first.low, second.high, first.joined, bounds)

    def _parted(self, begin: float, end: float) -> Iterator[Stretch]:
        near, least = 1e-12 * (end - begin), 1e-9 * (end - begin)
        left, count = [Stretch(begin, end, begin, end)], 0
        while left:
            now = left.pop()
            split, at_fault = now.halved(), self.moving[0]
            try:
                bounds = []
                for at_fault in self.moving:
                    bounds.append(at_fault.bound(now.low, now.high))
                    if bounds[-1].error(now.b - now.a) > self.tolerance * at_fault.scale:
                        break
                else:
                    yield replace(now, bounds=bounds)
                    continue
            except Split as found:
                split = found
            if now.b - now.a <= least:
                yield replace(now, bounds=self._short(now))
                continue
            left += reversed(_divided(now, split, near))
            count += 1
            if count > MOST_PARTS:
                raise UserError(
                    f"input '{at_fault.names[0]}' changes too fast in the step from t = {begin:g} s: more than {MOST_PARTS} intervals are "
                    "needed; use a smaller --step or --interpolate none"
                )

    def _short(self, stretch: Stretch) -> list[Bound]:
        """Returns the bounds of a part too short to be divided; raises UserError if an input is not finite in it."""
        bounds = []
        for moving in self.moving:
            ends = [moving.at(t) for t in inside(stretch.low, stretch.high)]
            if max(map(abs, ends)) > 1e6 * (moving.usual or 1.0):
                raise UserError(f"input '{moving.names[0]}' is unbounded near t = {stretch.a:g} s")
            bounds.append(Bound(math.inf, max(ends) - min(ends)))
        return bounds

    def _part(self, stretch: Stretch) -> Part:
        low, high = inside(stretch.low, stretch.high)
        values = {name: derived(name, signal, order, low) for name, (signal, order) in self.values.items()}
        points = [low + s * (high - low) for s in POINTS]
        nodes = np.array([[moving.at(t) for t in points] for moving in self.moving])
        fitted = (nodes - nodes[:, :1]) @ FIT[1:].T * (FACTORIALS / (stretch.b - stretch.a) ** np.arange(1, 4))
        slopes = {name: row.tolist() for moving, row in zip(self.moving, fitted, strict=True) if row.any() for name in moving.names}
        return Part(stretch.a, stretch.b, values, slopes)


def _divided(now: Stretch, split: Split, near: float) -> list[Stretch]:
    """Returns the parts in order; with a split almost at an end, one part with a narrower range."""
    snap = near + 16 * math.ulp(now.b)
    if split.after - now.a <= snap and split.after < now.high:
        return [replace(now, low=split.after, joined=False)]
    if now.b - split.before <= snap and split.before > now.low:
        return [replace(now, high=split.before)]
    first = Stretch(now.a, split.after, now.low, split.before, now.joined)
    return [first, Stretch(split.after, now.b, split.after, now.high, joined=split.before == split.after)]


def _motions(exact: Iterable[str], inputs: Sequence[str]) -> dict[str, list[int]]:
    """Returns the orders of the parts that are given of each prescribed motion."""
    motions: dict[str, list[int]] = {}
    for name in exact:
        head, _, part = name.rpartition(".")
        if "." + part in MOTION and head + MOTION[2] in inputs:
            motions[head] = sorted([*motions.get(head, []), MOTION.index("." + part)])
    return motions


def _rank(name: str) -> int:
    return MOTION.index(part) if (part := "." + name.rpartition(".")[2]) in MOTION else 0


def derived(name: str, signal: Signal, order: int, t: float) -> float:
    """Returns a derivative of a signal at a time; raises UserError, with the input's name, where it does not exist."""
    try:
        if order == 0:
            return signal(t)
        series = signal.series(t, t, order)
    except UserError as error:
        raise UserError(f"input '{name}': {error}") from None
    except Split:
        raise UserError(f"input '{name}': the motion has no derivative at t = {t:g} s") from None
    return series[order][0] * math.factorial(order) if order < len(series) else 0.0


def _held_remark(off: list[tuple[float, str]], unit: str) -> str:
    error, name = max(off)
    inputs = f"'{name}' is" if len(off) == 1 else f"'{name}' and {len(off) - 1} more are"
    return f"inputs: {inputs} constant during each step, up to {error:.2g} {unit} off the table; `--interpolate all` interpolates"


def _held_error(table: Table, times: np.ndarray) -> float:
    """Returns the largest difference between the table and its value at the start of a step, which is held until the next time."""
    rows, values = np.array(table.times), np.array(table.values)
    grain = 1e-9 * np.diff(times).min()
    held = np.interp(times[:-1], rows, values)  # of two rows at one time the later one
    ends = np.interp(times[1:] - grain, rows, values)
    step = np.searchsorted(times[1:-1], rows, side="right")
    inside = (rows > times[step]) & (rows < times[step + 1] - grain)
    return float(max(np.abs(ends - held).max(), np.abs(values - held[step])[inside].max(initial=0.0)))
