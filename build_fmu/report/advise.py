"""Evaluates the curves of a sweep: recommended runs, unfinished curves, and the time that they need."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

from build_fmu.report.sweep import WORTH_SHARING, Point

SAME_COST = 1.05  # ratio of two measurements of one run
GROWTH = (1.1, 1.6, 1.8)  # minimum, usual and maximum ratio of the times of successive runs


@dataclass(frozen=True)
class Curve:
    """The runs of one method, step size and kind of inputs, loose tolerances first; `tolerances` are all requested ones."""

    points: Sequence[Point]
    tolerances: Sequence[float]

    @property
    def missing(self) -> int:
        """Returns the number of tolerances omitted for lack of time; 0 if the last run failed."""
        last = self.points[-1]
        if last.outcome.status not in ("ok", "budget"):
            return 0
        done = last.rtol * (1.01 if last.outcome.status == "budget" else 0.99)
        return sum(rtol < done for rtol in self.tolerances)

    def time_needed(self, stop: float) -> float:
        """Returns the estimated time (s) of the whole curve; `stop` is the duration of the motion (s)."""
        taken = [p.taken for p in self.points if p.outcome.status == "ok"]
        total = math.fsum(taken)
        if not self.missing:
            return total
        growth = min(max(taken[-1] / taken[-2], GROWTH[0]), GROWTH[2]) if len(taken) > 1 and taken[-2] > 0 else GROWTH[1]
        last = self.points[-1]
        # a run that reached its time limit shows its speed
        next_run = last.taken * stop / max(last.outcome.reached, 1e-3 * stop) if last.outcome.status == "budget" else taken[-1] * growth
        return total + math.fsum(next_run * growth**k for k in range(self.missing))

    def first_below(self, target: float) -> Point | None:
        """Returns the first run that meets the target, if the next tighter one meets it too or cannot exist."""
        for k, point in enumerate(self.points):
            ends = k == len(self.points) - 1
            after = point if ends else self.points[k + 1]
            confirmed = not self.missing if ends else after.good and after.error <= target or after.outcome.status not in ("ok", "budget")
            if point.good and point.error <= target and confirmed:
                return point
        return None

    def might_beat(self, cost: float, target: float) -> bool:
        """Returns whether missing runs could meet the target at a lower cost; tighter runs cost more."""
        known = [p.us_per_ms for p in self.points if p.good]
        return bool(self.missing) and self.first_below(target) is None and not (known and known[-1] >= cost)


def curves(points: Sequence[Point], tolerances: Sequence[float]) -> list[Curve]:
    """Returns the curves in the order of their runs."""
    found: dict[tuple, list[Point]] = {}
    for p in points:
        found.setdefault((p.step, p.changing, p.method), []).append(p)
    return [Curve(points, tolerances) for points in found.values()]


def best(of: Sequence[Curve], target: float) -> Point | None:
    """Returns the cheapest run that meets the target; for equal costs, other methods have priority over `auto`.

    Returns None if an unfinished curve could contain a cheaper run.
    """
    fit = [p for p in (curve.first_below(target) for curve in of) if p]
    least = min((p.us_per_ms for p in fit), default=math.inf)
    if any(curve.might_beat(least, target) for curve in of):
        return None
    near = [p for p in fit if p.us_per_ms <= SAME_COST * least]
    return min(near, key=lambda p: (p.method == "auto", p.us_per_ms), default=None)


def seconds_for_all(of: Sequence[Curve], stop: float) -> float:
    """Returns the time limit (s) of a sweep in which all curves can finish, with two digits."""
    least = math.fsum(curve.time_needed(stop) for curve in of) / (1 - WORTH_SHARING)
    digit = 10.0 ** (math.floor(math.log10(max(least, 1.0))) - 1)
    return math.ceil(least / digit) * digit
