"""Makes the report of an FMU or a model: the sweep, then tables, pages and diagrams."""

from __future__ import annotations

import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from build_fmu.errors import UserError
from build_fmu.model.describe import Description, describe
from build_fmu.report.html import write_html
from build_fmu.report.machine import busy, load
from build_fmu.report.motion import positions
from build_fmu.report.pages import Report, write_csv, write_page, write_pictures
from build_fmu.report.reference import Reference, from_csv, from_tight_runs
from build_fmu.report.sweep import METHODS, TOLERANCES, Inputs, Plan, communication_steps, force_inputs, offered_methods, sweep, task_for
from build_fmu.run.driver import Staged, staged
from build_fmu.run.signals import parse_inputs, tables_of
from build_fmu.run.simulate import MOST_STEPS
from build_fmu.run.tables import keep_inputs

TIGHT_SECONDS = 20.0


@dataclass(frozen=True)
class Wish:
    """The settings of a report; None: as in the model. Times in s."""

    stop: float | None = None
    steps: Sequence[float] | None = None
    methods: Sequence[str] = METHODS
    tolerances: Sequence[float] = TOLERANCES
    inputs: Sequence[str] = ()
    reference: Path | None = None
    changing: Sequence[bool] = (False, True)
    seconds: float = 120.0
    repeats: int = 20


def files_of(folder: Path, name: str) -> list[Path]:
    """Returns the files of a report: page, text, table, diagram and picture."""
    return [folder / f"{name}{ending}" for ending in (".html", ".md", ".csv", ".svg", ".png")]


def write(report: Report, folder: Path, name: str) -> list[Path]:
    """Writes the files of a report into the folder and returns them."""
    files = files_of(folder, name)
    write_pictures(files[3:], report)
    write_csv(files[2], report)
    write_page(files[1], report, files[3].name)
    write_html(files[0], report, files[3])
    return files


def make_report(
    target: Path, wish: Wish, progress: Callable[[str, int, int], None] = lambda *_: None, files: Sequence[Path] = ()
) -> Report:
    """Sweeps one FMU or model file; `progress` gets a text, the number of finished runs and that of all runs.

    Raises UserError, also if the sweep reads one of the `files` to be written.
    """
    begin, load_before = time.monotonic(), load()
    model = describe(target) if target.suffix == ".toml" else None
    table = wish.reference or _named_reference(model, target)
    resources = [target.parent / name for name in model.resources] if model else []
    keep_inputs(files, [*tables_of(wish.inputs), *resources, *([table] if table else [])])
    with staged(target) as fmu:
        where = positions(fmu)
        usual = fmu.step
        stop = wish.stop if wish.stop is not None else fmu.stop
        steps = sorted(wish.steps) if wish.steps else communication_steps(stop, usual)
        if not stop > 0 or not all(0 < h <= stop for h in steps):
            raise UserError(f"step sizes must be positive and at most the duration of the motion, {stop:g} s")
        if stop / min(steps) > MOST_STEPS:
            raise UserError(f"{stop / min(steps):.3g} communication steps are too many for a report: shorten the motion with --stop")
        # a multiple of the largest step size
        stop = max(1, int(stop / max(steps) * (1 + 1e-9))) * max(steps)
        if not any(abs(h - usual) < 1e-9 * usual for h in steps):
            usual = steps[0]
        _check_tolerances(fmu, wish.tolerances)
        methods = offered_methods(fmu, wish.methods)
        if not methods:
            raise UserError(f"'{fmu.name}' supports none of the methods {', '.join(wish.methods)}")
        inputs = _inputs(fmu, wish.inputs)
        changing = [c for c in wish.changing if not c or force_inputs(fmu)]
        rows = np.arange(round(stop / max(steps)) + 1) * max(steps)
        references = _references(fmu, table if not inputs.given or wish.reference else None, where, inputs, rows)
        plan = Plan(stop, steps, methods, wish.tolerances, changing, wish.seconds, wish.repeats)
        total = len(steps) * len(changing) * len(methods) * len(wish.tolerances)
        points = list(sweep(fmu, where, references, inputs, plan, lambda text, done: progress(text, done, total)))
        given = f"inputs {', '.join(wish.inputs)}" if wish.inputs else "inputs are zero"
        return Report(
            fmu.name,
            where.unit,
            stop,
            usual,
            given,
            references(usual),
            points,
            time.monotonic() - begin,
            tolerances=wish.tolerances,
            busy=busy(load_before, load()),
            coverage=references(usual).coverage(rows),
        )


def _check_tolerances(fmu: Staged, tolerances: Sequence[float]) -> None:
    limit = fmu.variables["solver.rtol"].max if "solver.rtol" in fmu.variables else None
    if limit is not None and max(tolerances) > limit:
        raise UserError(f"--rtol must be at most {limit:g}, the maximum of solver.rtol, got {max(tolerances):g}")


def _inputs(fmu: Staged, arguments: Sequence[str]) -> Inputs:
    known = fmu.names("input")

    def find(name: str) -> str:
        if name not in known:
            raise UserError(f"unknown input '{name}'")
        return name

    signals = parse_inputs(arguments, find, lambda name: fmu.variables[name].unit if name in known else None)
    return Inputs(list(signals), lambda t: [signal(t) for signal in signals.values()])


def _references(fmu: Staged, table: Path | None, where, inputs: Inputs, rows: np.ndarray) -> Callable[[float], Reference]:
    """Returns a function of the communication step size: with sampled inputs, each step size has its own motion. `rows` in s."""
    stop, longest = float(rows[-1]), float(rows[1])
    if table:
        exact = from_csv(table, where)
        exact.coverage(rows)  # refuses a table without common times
        return lambda _: exact
    made: dict[float, Reference] = {}
    methods: list[str] = []

    def reference(step: float) -> Reference:
        key = step if inputs.given else longest
        if key not in made:
            methods[:] = methods or offered_methods(fmu)
            task = task_for(fmu, stop, key, longest, inputs, False, where.names)
            made[key] = from_tight_runs(fmu, where, task, methods, TIGHT_SECONDS)
        return made[key]

    return reference


def _named_reference(model: Description | None, target: Path) -> Path | None:
    name = model.report.get("reference") if model else None
    if not name:
        return None
    if not (table := target.parent / name).exists():
        raise UserError(f"'{target}': reference of [report]: '{table}' does not exist; name another table with --reference")
    return table
