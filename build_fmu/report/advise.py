"""What the curves of a sweep say, and what they do not: advice, curves that time cut short, and the time they need."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

from build_fmu.report.sweep import Point

SAME_COST = 1.05  # times: what two measurements of one run may differ by
GROWTH = (1.1, 1.6, 1.8)  # least, usual and most: of a run's time from one tolerance to the next


@dataclass(frozen=True)
class Curve:
    """The runs of one method, step and kind of inputs, loose tolerances first, of all that were asked for."""

    points: Sequence[Point]
    tolerances: Sequence[float]

    @property
    def missing(self) -> int:
        """Returns how many tolerances time left out; none where the last run failed."""
        last = self.points[-1]
        if last.outcome.status not in ("ok", "budget"):
            return 0
        done = last.rtol * (1.01 if last.outcome.status == "budget" else 0.99)
        return sum(rtol < done for rtol in self.tolerances)

    def time_needed(self, stop: float) -> float:
        """Returns the time (s) that the whole curve takes, by the growth from run to run; `stop` is the length of the motion (s)."""
        taken = [p.taken for p in self.points if p.outcome.status == "ok"]
        total = math.fsum(taken)
        if not self.missing:
            return total
        growth = min(max(taken[-1] / taken[-2], GROWTH[0]), GROWTH[2]) if len(taken) > 1 and taken[-2] > 0 else GROWTH[1]
        last = self.points[-1]
        # a run that its budget ended says how fast it was
        next_run = last.taken * stop / max(last.outcome.reached, 1e-3 * stop) if last.outcome.status == "budget" else taken[-1] * growth
        return total + math.fsum(next_run * growth**k for k in range(self.missing))

    def first_below(self, target: float) -> Point | None:
        """Returns the first run below the target that is not lucky: the next tighter one is below it, too, or there can be none."""
        for k, point in enumerate(self.points):
            ends = k == len(self.points) - 1
            after = point if ends else self.points[k + 1]
            confirmed = not self.missing if ends else after.good and after.error <= target or after.outcome.status not in ("ok", "budget")
            if point.good and point.error <= target and confirmed:
                return point
        return None

    def might_beat(self, cost: float, target: float) -> bool:
        """Returns whether the runs that are missing could reach the target at a lower cost: tighter ones cost more."""
        known = [p.us_per_ms for p in self.points if p.good]
        return bool(self.missing) and self.first_below(target) is None and not (known and known[-1] >= cost)


def curves(points: Sequence[Point], tolerances: Sequence[float]) -> list[Curve]:
    """Returns the curves in the order in which they were run."""
    found: dict[tuple, list[Point]] = {}
    for p in points:
        found.setdefault((p.step, p.changing, p.method), []).append(p)
    return [Curve(points, tolerances) for points in found.values()]


def best(of: Sequence[Curve], target: float) -> Point | None:
    """Returns the cheapest run that keeps the target; of those that cost the same, one with a method of its own before `auto`.

    There is none where a curve that was cut short could hold a cheaper one.
    """
    fit = [p for p in (curve.first_below(target) for curve in of) if p]
    least = min((p.us_per_ms for p in fit), default=math.inf)
    if any(curve.might_beat(least, target) for curve in of):
        return None
    near = [p for p in fit if p.us_per_ms <= SAME_COST * least]
    return min(near, key=lambda p: (p.method == "auto", p.us_per_ms), default=None)


def seconds_for_all(of: Sequence[Curve], stop: float) -> float:
    """Returns the bound (s) on a sweep with which each curve's share lets it finish, in two digits."""
    needs = [curve.time_needed(stop) for curve in of]
    least = max(math.fsum(needs[:i]) + need * (len(needs) - i) for i, need in enumerate(needs))
    digit = 10.0 ** (math.floor(math.log10(max(least, 1.0))) - 1)
    return math.ceil(least / digit) * digit
