"""Runs one case, a tight run for comparison, and other methods if it failed."""

from __future__ import annotations

import math
import shutil
import tempfile
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
import tomlkit

from build_fmu.errors import UserError
from build_fmu.model.describe import describe
from build_fmu.report.motion import Positions, positions
from build_fmu.report.sweep import METHODS
from build_fmu.run.driver import Outcome, Staged, Task, drive, stage_model
from build_fmu.stress.cases import Case

MOST_ROWS = 200
LONG_SHARE = 4  # the CPU time limit of a run with an open end, over that of others
LARGEST_GAP = 1e-8  # m or rad
ROUNDING = 1e-9  # of the potential energy: a smaller energy exchange counts as rest
REST = 1e-9  # m or rad: below this displacement there is no motion, and the energy is not judged
SMALL = ("small motion", "no motion")  # the first words of messages about small motions
FINER = (1e-1, 1e-2, 1e-4)  # factors on the absolute tolerance, tried if that may be too coarse for the motion


@dataclass(frozen=True)
class Verdict:
    """The result of a case. `kind`: finished, doubtful, slow, refused, failed."""

    model: str
    case: Case
    kind: str
    message: str = ""
    method: str = ""
    remedy: str = ""
    reached: float = 0.0
    balance: float = math.nan  # maximum energy balance error over the maximum exchanged energy
    gap: float = math.nan
    error: float = math.nan
    unit: str = ""
    steps: int | None = None
    rhs: int | None = None
    seconds: float = math.nan
    after: str = ""

    @property
    def small(self) -> bool:
        """Returns whether the case finished with an energy too small for the usual bound."""
        return self.kind == "finished" and self.message.startswith(SMALL)


def run_case(name: str, case: Case, seconds: float, method: str | None) -> Verdict:
    """Runs the case within the CPU time limit (s per run)."""
    with tempfile.TemporaryDirectory() as folder:
        file = Path(folder) / "model.toml"
        file.write_text(tomlkit.dumps(case.model), encoding="utf-8")
        for table in case.files:
            shutil.copyfile(table, Path(folder) / table.name)
        try:
            fmu = stage_model(file, Path(folder) / "staged", describe(file))
        except UserError as error:
            return Verdict(name, case, "refused", str(error).replace(str(file), "model.toml").splitlines()[0])
        return _run(name, fmu, case, seconds, method)


def _run(name: str, fmu: Staged, case: Case, seconds: float, method: str | None) -> Verdict:
    start: dict[str, Any] = {} if method is None else fmu.solver(method)
    rtol = float(fmu.variables["solver.rtol"].start)
    if case.rtol is not None:
        rtol = case.rtol
        start |= {"solver.rtol": rtol, "solver.atol": rtol / 100}
    budget = seconds * (LONG_SHARE if case.open_end else 1)
    task = _task(fmu, case, start, budget)
    outcome = drive(fmu, task)
    where = _positions(fmu)
    facts = _facts(task, outcome, where)
    kind, message = _judge(case, outcome, facts, rtol)
    remedy = ""
    if kind == "doubtful" and not _opens(facts):
        kind, message = _judge_finer(fmu, case, start, facts, budget, rtol, where) or (kind, message)
    if kind in ("failed", "slow", "doubtful"):
        remedy = _remedy(fmu, case, start, outcome, budget, rtol, where)
    error = math.nan
    if kind in ("finished", "doubtful") and where and not case.open_end:
        error = _error(fmu, case, task, outcome, where, rtol, seconds)
    return Verdict(
        name,
        case,
        kind,
        message,
        outcome.method,
        remedy,
        outcome.reached,
        facts["balance"],
        facts["gap"],
        error,
        where.unit if where else "",
        outcome.health.get("solver.steps"),
        outcome.health.get("solver.rhs_evaluations"),
        outcome.seconds,
        outcome.after,
    )


def _task(fmu: Staged, case: Case, start: dict[str, Any], budget: float) -> Task:
    count = max(1, round(case.stop / case.step))
    inputs = [n for n in fmu.names("input") if n.endswith(".tau") and n.removesuffix(".tau") in case.torques]
    rows = [[sign * case.torques[n.removesuffix(".tau")] for n in inputs] for sign in (1, -1)] if inputs else []
    every = max(1, count // MOST_ROWS)
    if len(rows) == 2 and every % 2 == 0:
        every += 1  # otherwise all rows would see the same half of the square wave
    return Task(case.step, count, every, start, fmu.reals(), inputs, rows, budget=budget)


def _positions(fmu: Staged) -> Positions | None:
    try:
        return positions(fmu)
    except UserError:
        return None


def _facts(task: Task, outcome: Outcome, where: Positions | None) -> dict[str, float]:
    """Returns relative energy balance error, exchanged energy (J), maximum constraint violation and displacement (m, rad)."""
    if not outcome.values.size:
        return dict.fromkeys(("balance", "energy", "gap", "moved"), math.nan)
    column = {n: outcome.values[:, i] for i, n in enumerate(task.outputs)}
    gaps = [values.max() for n, values in column.items() if n.endswith(".gap")]
    names = where.names if where else []
    moved = max((float(np.ptp(column[n])) for n in names), default=math.nan)
    return _balance(column) | {"gap": float(max(gaps, default=math.nan)), "moved": moved}


def _balance(column: dict[str, np.ndarray]) -> dict[str, float]:
    if "energy.balance" not in column:
        return {"balance": math.nan, "energy": math.nan}
    kinetic, potential, work = (column[f"energy.{name}"] for name in ("kinetic", "potential", "work"))
    # rows may miss peaks of the kinetic energy, but not of potential energy and work
    energy = max(float(kinetic.max()), *(float(np.abs(x - x[0]).max()) for x in (potential, work)))
    # at rest, the balance contains only rounding errors of the potential energy
    scale = max(energy, ROUNDING * float(np.abs(potential).max()))
    off = float(np.abs(column["energy.balance"]).max())
    return {"balance": off / scale if scale > 0 else (0.0 if off == 0 else math.nan), "energy": energy}


def _judge(case: Case, outcome: Outcome, facts: dict[str, float], rtol: float, bound: float = 0.0) -> tuple[str, str]:
    if outcome.status == "budget" and not case.open_end:
        return "slow", outcome.message
    if outcome.status == "refused":
        return "refused", outcome.message
    if outcome.status not in ("ok", "budget"):
        return "failed", f"{outcome.status}: {outcome.message}"
    if _opens(facts):
        return "doubtful", f"the constraint violation of a loop reaches {facts['gap']:.1e}"
    if facts["balance"] > max(bound, balance_bound(rtol, outcome.reached)):
        if facts["moved"] <= REST:
            return "finished", f"no motion: {facts['moved']:.0e} m or rad, {facts['energy']:.0e} J"
        return "doubtful", f"the energy balance error is {facts['balance']:.1e} of the exchanged energy"
    return "finished", f"to t = {outcome.reached:g} s" if outcome.status == "budget" else ""


def _opens(facts: dict[str, float]) -> bool:
    return facts["gap"] > LARGEST_GAP


def _judge_finer(
    fmu: Staged, case: Case, start: dict[str, Any], first: dict[str, float], seconds: float, rtol: float, where: Positions | None
) -> tuple[str, str] | None:
    """Returns "finished" and the reason if a finer absolute tolerance meets the bound: the motion is small."""
    usual = float(start.get("solver.atol", fmu.variables["solver.atol"].start))
    for factor in FINER:
        task = _task(fmu, case, {**start, "solver.atol": factor * usual}, seconds)
        outcome = drive(fmu, task)
        facts = _facts(task, outcome, where)
        # fast vibrations take many steps, each of which may have an error of rtol
        if _judge(case, outcome, facts, rtol, bound=rtol * outcome.health.get("solver.steps", 0))[0] == "finished":
            return "finished", (
                f"small motion, {first['energy']:.0e} J: the relative energy balance error is {first['balance']:.0e} with an absolute "
                f"tolerance of {usual:.0e}, and {facts['balance']:.0e} with {factor * usual:.0e}"
            )
    return None


def balance_bound(rtol: float, motion: float) -> float:
    """Returns the bound on the relative energy balance error after a `motion` (s)."""
    return max(1e3 * rtol, 1e-8) * max(1.0, motion)


def _remedy(fmu: Staged, case: Case, start: dict[str, Any], first: Outcome, seconds: float, rtol: float, where: Positions | None) -> str:
    """Returns the first other method that finishes the case, as a text; a long run must come as far as the `first` one."""
    for method in METHODS:
        if method == first.method:
            continue
        task = _task(fmu, case, {**start, **fmu.solver(method)}, seconds)
        outcome = drive(fmu, task)
        if outcome.reached < first.reached:
            continue
        facts = _facts(task, outcome, where)
        if _judge(case, outcome, facts, rtol)[0] == "finished":
            return f"finishes with {method}"
        # as for the first method: the motion may be small compared with the absolute tolerance
        if outcome.status == "ok" and not _opens(facts) and _judge_finer(fmu, case, task.start, facts, seconds, rtol, where):
            return f"finishes with {method} and a finer absolute tolerance"
    return ""


def _error(fmu: Staged, case: Case, task: Task, outcome: Outcome, where: Positions, rtol: float, seconds: float) -> float:
    """Returns the distance to a tight run of another method; nan if that run does not finish."""
    tight = max(min(rtol / 1000, 1e-10), 1e-13)
    for method in ("bdf", "erk") if case.stiff else ("adams", "erk"):
        if method == outcome.method:
            continue
        start = {**task.start, **fmu.solver(method, tight)}
        other = drive(fmu, replace(task, start=start, outputs=where.names, budget=seconds))
        if other.status == "ok" and len(other.times) == len(outcome.times):
            columns = [list(task.outputs).index(n) for n in where.names]
            return where.error(outcome.values[:, columns], other.values)
        break
    return math.nan
