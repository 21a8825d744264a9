"""The reference solution: a table named in the model, or two tight runs of different methods."""

from __future__ import annotations

import re
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from build_fmu.errors import UserError
from build_fmu.report.motion import Positions
from build_fmu.run.driver import Staged, Task, drive
from build_fmu.run.signals import read_table

TIGHT = (1e-13, 1e-12, 1e-11, 1e-10)
# methods of different families first, because their errors are independent
ORDER = ("erk", "adams", "dirk", "bdf", "exponential", "auto")


@dataclass(frozen=True)
class Reference:
    """Positions at times (s), their uncertainty (in the unit of errors), and their origin."""

    times: np.ndarray
    values: np.ndarray
    uncertainty: float
    origin: str

    def common(self, times: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Returns which times (s) have a row, and the place of each row."""
        at = np.searchsorted(self.times, times - 1e-9 * max(1.0, float(self.times[-1])))
        at = np.minimum(at, len(self.times) - 1)
        return np.abs(self.times[at] - times) <= 1e-9 * np.maximum(1.0, np.abs(times)), at

    def coverage(self, times: np.ndarray) -> str:
        """Returns a sentence if some output rows have no reference; raises UserError if only the start has one."""
        both, _ = self.common(times)
        if not np.any(both & (times > 0)):
            raise UserError(f"{self.origin} has none of the times of the output rows, every {times[1]:g} s to {times[-1]:g} s")
        if both.all():
            return ""
        last = times[both][-1]
        return f"{self.origin} has {both.sum()} of {len(times)} output rows, the last at {last:g} s: the errors are those of these"

    def error(self, where: Positions, times: np.ndarray, values: np.ndarray, columns: list[int]) -> float:
        """Returns the maximum error at common times; nan if there are none after the start."""
        both, at = self.common(times)
        if not np.any(both & (times > 0)):
            return float("nan")
        return where.error(values[both][:, columns], self.values[at[both]])


def from_csv(path: Path, where: Positions) -> Reference:
    """Reads a table whose columns are the FMU's output names, or t, q1, q2, … in the order of its joints."""
    table = read_table(path)
    numbered = [f"q{i}" for i in range(1, len(where.coordinates) + 1)]
    if all(name in table for name in where.names):
        names = where.names
    elif not where.quaternions and {name for name in table if re.fullmatch(r"q[1-9][0-9]*", name)} == set(numbered):
        names = numbered
    else:
        missing = next(name for name in where.names if name not in table)
        raise UserError(f"'{path}' is not a reference: column '{missing}' is missing")
    values = np.array([table[name] for name in names]).T
    return Reference(np.array(table["time"]), values, 0.0, f"the table {path.name}")


def from_tight_runs(fmu: Staged, where: Positions, task: Task, methods: list[str], budget: float) -> Reference:
    """Returns the tightest solution on which two methods agree best; their difference is the uncertainty. Raises UserError."""
    best: Reference | None = None
    for rtol in TIGHT:
        runs = []
        for method in sorted(methods, key=ORDER.index):
            start = {**task.start, **fmu.solver(method, rtol)}
            outcome = drive(fmu, replace(task, start=start, outputs=where.names, budget=budget))
            if outcome.status == "ok":
                runs.append((method, outcome))
            if len(runs) == 2:
                break
        if len(runs) < 2:
            continue
        (one, first), (other, second) = runs
        difference = where.error(first.values, second.values)
        if best is None or difference < best.uncertainty:
            best = Reference(first.times, first.values, difference, f"{one} at rtol {rtol:g}, confirmed by {other}")
        # if a looser pair agrees better, rounding errors dominate
        elif best is not None:
            return best
        if difference < 1e-9:
            return best
    if best is None:
        raise UserError(
            f"'{fmu.name}' has no reference: fewer than two methods finish a tight run within {budget:g} s; add a table with --reference"
        )
    return best
