"""Chooses the tolerance of a model file that names a `target_error`: the loosest that keeps it."""

from __future__ import annotations

import re
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import replace
from pathlib import Path

from build_fmu.describe import Description, describe
from build_fmu.driver import Task, drive, stage_model
from build_fmu.errors import UserError
from build_fmu.report.motion import positions
from build_fmu.report.reference import from_csv, from_tight_runs
from build_fmu.report.sweep import Inputs, offered_methods, task_for
from build_fmu.resources import attach

CANDIDATES = tuple(float(f"{head}e-{k}") for k in range(3, 13) for head in (3, 1))[1:]
TIGHT_SECONDS = 60.0
RUN_SECONDS = 30.0
KEY = re.compile(r"^(?P<indent>[ \t]*)(?P<path>(?:solver[ \t]*\.[ \t]*)?)target_error[ \t]*=[^#\n]*(?:#[^\n]*)?$", re.MULTILINE)
INLINE = re.compile(r"target_error[ \t]*=[ \t]*[^,}\s]+")


@contextmanager
def with_chosen_tolerance(model: Description, file: Path) -> Iterator[tuple[Description, Path]]:
    """Yields the model and its file with rtol written beside target_error; unchanged where there is nothing to choose."""
    target = model.report.get("target_error")
    if not target:
        yield model, file
        return
    with tempfile.TemporaryDirectory() as folder:
        chosen = _choose(model, file, float(target), Path(folder))
        yield (replace(chosen[0], warnings=model.warnings), chosen[1]) if chosen else (model, file)


def _choose(model: Description, file: Path, target: float, folder: Path) -> tuple[Description, Path] | None:
    try:
        fmu = stage_model(file, folder / "as it is", model)
        where = positions(fmu)
    except UserError:
        return None  # nothing is integrated, so nothing is to be chosen
    # some rows of output at least, and no step that the usual one does not divide
    count = max(1, round(fmu.stop / fmu.step))
    every = next(n for n in range(max(1, count // 100), count + 1) if count % n == 0)
    stop, row_every = count * fmu.step, every * fmu.step
    if model.report.get("reference"):
        reference = from_csv(file.parent / model.report["reference"], where)
    else:
        held = task_for(fmu, stop, fmu.step, row_every, Inputs(), False, where.names)
        reference = from_tight_runs(fmu, where, held, offered_methods(fmu), TIGHT_SECONDS)
    if reference.uncertainty > target / 3:
        raise UserError(f"{file}: target_error = {target:g} cannot be checked: two tight runs differ by {reference.uncertainty:.1g} in {stop:g} s")
    before, best = None, float("inf")
    for number, rtol in enumerate(CANDIDATES):
        candidate = _candidate(file, model.resources, rtol, folder / str(number))
        error = _error(candidate, where, reference, stop, row_every, folder / f"{number} staged")
        best = min(best, error)
        # a lucky run has no equally good neighbour
        if error <= target and before:
            return before
        before = candidate if error <= target else None
    if before:
        return before
    raise UserError(f"{file}: no rtol down to 1e-12 keeps target_error = {target:g} in {stop:g} s, the least error is {best:.1g}")


def _error(candidate: tuple[Description, Path], where, reference, stop: float, row_every: float, folder: Path) -> float:
    """Returns the larger error of a run with inputs held and one where they change at each step."""
    description, path = candidate
    fmu = stage_model(path, folder, description)
    worst = 0.0
    for changing in (False, True):
        task = task_for(fmu, stop, fmu.step, row_every, Inputs(), changing, where.names)
        outcome = drive(fmu, Task(task.step, task.steps, task.every, {}, task.outputs, task.inputs, task.rows, budget=RUN_SECONDS))
        if outcome.status != "ok":
            return float("inf")
        worst = max(worst, reference.error(where, outcome.times, outcome.values, list(range(len(where.names)))))
    return worst


def _candidate(file: Path, resources: list[str], rtol: float, folder: Path) -> tuple[Description, Path]:
    folder.mkdir()
    path = folder / file.name
    text = with_rtol(file.read_text(encoding="utf-8-sig"), rtol)
    path.write_text(text, encoding="utf-8", newline="\n")
    attach(resources, file, folder)
    description = describe(path)
    start = next(v.start for v in description.variables if v.name == "solver.rtol")
    if start != rtol:
        raise UserError(f"{file}: write target_error on a line of its own under [solver]")
    return description, path


def with_rtol(text: str, rtol: float) -> str:
    """Returns the model file with rtol beside its target_error, everything else untouched."""
    line = KEY.search(text)
    if line:
        return f"{text[:line.end()]}\n{line['indent']}{line['path']}rtol = {rtol!r}  # chosen for target_error{text[line.end():]}"
    return INLINE.sub(lambda found: f"{found[0]}, rtol = {rtol!r}", text, count=1)
