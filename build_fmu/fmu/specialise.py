"""Compiles a library for one model: without unused features, and with forward dynamics as straight-line code where that is faster.

Requires the source tree, CMake and a C++ compiler. The build folder `build/specialised/NAME` is kept.
"""

from __future__ import annotations

import fcntl
import os
import shutil
import subprocess
import sys
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass, replace
from pathlib import Path

from build_fmu import native
from build_fmu.errors import UserError
from build_fmu.model.describe import Description
from build_fmu.report.sweep import Inputs, task_for
from build_fmu.run.driver import drive, stage_model

RUN_SECONDS = 10.0  # CPU time limit of a run that is measured


@dataclass(frozen=True)
class Specialised:
    """A library for one model, and its specialisation."""

    library: Path
    features: list[str]
    no_straight_line: str  # the reason; empty: it has one
    faster: float | None = None  # CPU time with the general library over that with this one; None: not measured

    def summary(self) -> str:
        """Returns features, size and speed of the library."""
        line = f"no straight-line code: {self.no_straight_line}" if self.no_straight_line else "forward dynamics as straight-line code"
        size, general = self.library.stat().st_size, native.library().stat().st_size
        return (
            f"specialised: features {', '.join(self.features) or 'none'}; {line}; {size / 1e3:.0f} kB instead of {general / 1e3:.0f} kB"
            + (f"; {self.faster:.2f} times as fast" if self.faster else "")
        )


@contextmanager
def specialised_library(model: Description, model_file: Path) -> Iterator[Specialised]:
    """Compiles the library of a described model, which no other process rebuilds in the block.

    Raises UserError if a tool is missing or fails.
    """
    source = native.SOURCE_TREE
    if not (source / "CMakeLists.txt").is_file() or not (source / "fmu_src").is_dir():
        raise UserError("--specialise requires the source tree of build_fmu: install build_fmu from it")
    for tool in ("cmake", "ninja"):
        if not shutil.which(tool):
            raise UserError(f"--specialise requires {tool}, which is not installed")
    folder = source / "build" / "specialised" / model.model_identifier
    folder.mkdir(parents=True, exist_ok=True)
    with _locked(folder):
        yield _compile(model, model_file, source, folder)


@contextmanager
def _locked(folder: Path) -> Iterator[None]:
    """Keeps a build folder to this thread; others wait."""
    with (folder / "lock").open("w", encoding="utf-8") as file:
        try:
            fcntl.flock(file, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except BlockingIOError:
            print(f"waiting for another build in '{folder}'", file=sys.stderr, flush=True)
            fcntl.flock(file, fcntl.LOCK_EX)
        yield


def _compile(model: Description, model_file: Path, source: Path, folder: Path) -> Specialised:
    line, reason = _straight_line(model_file, folder)
    if line is None and model.needs_own_library:
        raise UserError(f"method taylor needs straight-line code: {reason}")
    features = [feature for feature in model.features if line or feature != "taylor"]
    settings = {
        "CMAKE_BUILD_TYPE": "Release",
        "REDYSIM_TESTS": "OFF",
        "REDYSIM_FEATURES": ";".join(features) or "none",
        "REDYSIM_STRAIGHT_LINE": str(line or ""),
        "REDYSIM_FMI_HEADERS": str(_fmi_headers()),
    }
    _run(["cmake", "-S", str(source), "-B", str(folder), "-G", "Ninja", *(f"-D{key}={value}" for key, value in settings.items())], folder)
    _run(["cmake", "--build", str(folder), "--target", "redysim_fmu", "--parallel", str(os.cpu_count() or 1)], folder)
    library = folder / "fmu_src" / "fmi" / "libredysim_fmu.so"
    return Specialised(library, features, reason, _times_faster(model, model_file, library))


def _times_faster(model: Description, model_file: Path, library: Path) -> float | None:
    """Compares the fastest runs with both libraries, run alternately with inputs that change at each step; None if one fails."""
    with tempfile.TemporaryDirectory() as folder:
        general = stage_model(model_file, Path(folder), model)
        pair = (general, replace(general, library=library))
        steps = max(1, round(general.stop / general.step))
        task = task_for(general, steps * general.step, general.step, general.step, Inputs(), True, general.names("output")[:1])
        task = replace(task, every=steps, repeats=5, spend=0.2, budget=RUN_SECONDS)
        usual = replace(task, start={"solver.method": "auto"}) if model.needs_own_library else task
        runs = [[drive(fmu, one) for fmu, one in zip(pair, (usual, task), strict=True)] for _ in range(5)]
    if any(run.status != "ok" for row in runs for run in row):
        return None
    first, second = (min(row[k].seconds for row in runs) for k in (0, 1))
    return first / second


def _straight_line(model_file: Path, folder: Path) -> tuple[Path | None, str]:
    """Returns the C++ file with the forward dynamics of the model, or the reason for none."""
    run = subprocess.run([str(native.describe_program()), "--straight-line", str(model_file)], capture_output=True, text=True, check=False)
    if run.returncode != 0:
        return None, run.stderr.strip().removeprefix("describe: ")
    file = folder / "straight_line.cpp"
    # an unchanged file is not compiled again
    if not file.is_file() or file.read_text(encoding="utf-8") != run.stdout:
        file.write_text(run.stdout, encoding="utf-8")
    return file, ""


def _fmi_headers() -> Path:
    import fmpy

    return Path(fmpy.__file__).parent / "c-code"


def _run(command: list[str], folder: Path) -> None:
    """Runs a build command; its output goes to a log, and the last lines into an error."""
    run = subprocess.run(command, capture_output=True, text=True, check=False)
    log = folder / "build.log"
    with log.open("a", encoding="utf-8") as file:
        file.write(" ".join(command) + "\n" + run.stdout + run.stderr)
    if run.returncode != 0:
        end = "\n".join((run.stdout + run.stderr).strip().splitlines()[-15:])
        raise UserError(f"building the specialised library failed, see '{log}':\n{end}")
