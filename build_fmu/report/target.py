"""Chooses the tolerance of a model file with a `target_error`: the loosest one that meets it."""

from __future__ import annotations

import math
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import replace
from pathlib import Path

import tomlkit

from build_fmu.errors import UserError
from build_fmu.model.describe import Description, describe
from build_fmu.model.resources import attach
from build_fmu.report.motion import Positions, positions
from build_fmu.report.reference import Reference, from_csv, from_tight_runs
from build_fmu.report.sweep import Inputs, offered_methods, task_for
from build_fmu.run.driver import Staged, drive, stage_model

CANDIDATES = tuple(float(f"{head}e-{k}") for k in range(3, 13) for head in (3, 1))[1:]
TIGHT_SECONDS = 60.0
RUN_SECONDS = 30.0
MARGIN = 2.0  # for communication step sizes between those of the runs


@contextmanager
def with_chosen_tolerance(model: Description, file: Path) -> Iterator[tuple[Description, Path]]:
    """Yields the model and its file with the chosen rtol; unchanged without target_error or with a given rtol."""
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
        return None  # nothing is integrated, so rtol has no effect
    rows, every = _rows(fmu)
    stop, row_every = rows * every * fmu.step, every * fmu.step
    if model.report.get("reference"):
        reference = from_csv(file.parent / model.report["reference"], where)
    else:
        held = task_for(fmu, stop, fmu.step, row_every, Inputs(), False, where.names)
        reference = from_tight_runs(fmu, where, held, offered_methods(fmu), TIGHT_SECONDS)
    if reference.uncertainty > target / 3:
        raise UserError(
            f"{file}: target_error = {target:g} cannot be verified: two tight runs differ by {reference.uncertainty:.1g} in {stop:g} s"
        )
    before, best = None, (float("inf"), 0.0)
    for number, rtol in enumerate(CANDIDATES):
        candidate = _candidate(file, model.resources, rtol, folder / str(number))
        worst = _worst(candidate, where, reference, target / MARGIN, folder / f"{number} staged")
        best = min(best, worst)
        # a target that is met by chance is not met at the next tighter tolerance
        kept = worst[0] <= target / MARGIN
        if kept and before:
            return before
        before = candidate if kept else None
    if before:
        return before
    raise UserError(
        f"{file}: no rtol down to 1e-12 meets target_error = {target:g} in {stop:g} s; minimum error {best[0]:.1g} "
        f"(communication step size {best[1]:g} s)"
    )


def tried_steps(fmu: Staged) -> list[float]:
    """Returns the communication step sizes (s) at which a tolerance must meet its target, in descending order.

    The internal steps of one-step methods end at communication points, so errors grow with the communication step size until the
    tolerance limits them. Multistep methods restart when inputs change, which reduces their accuracy at small step sizes.
    """
    rows, every = _rows(fmu)
    multiples = [rows] + [n for n in (1000, 300, 100, 30, 10, 3, 1) if n < rows]
    return [n * every * fmu.step for n in multiples] + [fmu.step] * (every > 1) + [fmu.step / 10]


def _rows(fmu: Staged) -> tuple[int, int]:
    """Returns the number of output rows, and of usual steps per row."""
    count = max(1, round(fmu.stop / fmu.step))
    every = next(n for n in range(max(1, count // 1000), count + 1) if count % n == 0)
    return count // every, every


def _worst(candidate: tuple[Description, Path], where: Positions, reference: Reference, target: float, folder: Path) -> tuple[float, float]:
    """Returns the maximum error over communication step sizes, with constant and changing inputs, and its step size.

    Stops at the first error above the target.
    """
    description, path = candidate
    fmu = stage_model(path, folder, description)
    rows, every = _rows(fmu)
    worst, compared = (0.0, 0.0), False
    for step in tried_steps(fmu):
        row_every = max(step, every * fmu.step)
        stop = int(rows * every * fmu.step / row_every * (1 + 1e-9)) * row_every
        for changing in (False, True):
            task = task_for(fmu, stop, step, row_every, Inputs(), changing, where.names)
            outcome = drive(fmu, replace(task, budget=RUN_SECONDS))
            if outcome.status != "ok":
                return float("inf"), step
            # a table may have no row in common with the largest step sizes
            error = reference.error(where, outcome.times, outcome.values, list(range(len(where.names))))
            if not math.isnan(error):
                worst, compared = max(worst, (error, step)), True
            if worst[0] > target:
                return worst
    return worst if compared else (float("inf"), fmu.step)


def _candidate(file: Path, resources: list[str], rtol: float, folder: Path) -> tuple[Description, Path]:
    folder.mkdir()
    path = folder / file.name
    text = with_rtol(file.read_text(encoding="utf-8-sig"), rtol)
    path.write_text(text, encoding="utf-8", newline="\n")
    attach(resources, file, folder)
    return describe(path), path


def with_rtol(text: str, rtol: float) -> str:
    """Returns the model file with rtol in the section of its target_error, everything else untouched."""
    document = tomlkit.parse(text)
    value = tomlkit.item(rtol)
    if not isinstance(document["solver"], tomlkit.items.InlineTable):
        value.comment("chosen for target_error")
    document["solver"]["rtol"] = value
    return tomlkit.dumps(document)
