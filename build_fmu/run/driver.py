"""Runs an FMU in the compiled `fmu_driver`: timing without Python, in a separate process that may hang or crash."""

from __future__ import annotations

import json
import math
import os
import subprocess
import tempfile
import zipfile
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np

from build_fmu import native
from build_fmu.errors import UserError
from build_fmu.model.describe import Description, Variable, describe
from build_fmu.model.resources import attach
from build_fmu.run.fmu_file import read_description

HEALTH = ("solver.steps", "solver.rejected", "solver.rhs_evaluations")
PATIENCE = 10.0  # s that a single call may exceed the budget before it counts as a hang
LONGEST_WAIT = 1e6  # s, less than the operating system accepts
EXCEPTIONS = 0xC0000000  # exit codes of crashed processes on Windows
SYSTEMS = {"linux64": "Linux on x86-64", "win64": "64-bit Windows"}


@dataclass(frozen=True)
class Staged:
    """The files of an FMU for the driver, and its variables by name; times in s."""

    name: str
    library: Path
    resources: str
    guid: str
    variables: dict[str, Variable]
    stop: float
    step: float

    def names(self, causality: str) -> list[str]:
        """Returns the names of a causality's variables, in the FMU's order."""
        return [v.name for v in self.variables.values() if v.causality == causality]

    def reals(self) -> list[str]:
        """Returns all real outputs."""
        return [n for n in self.names("output") if self.variables[n].type == "Real"]

    def solver(self, method: str, rtol: float | None = None, ratio: float = 0.01) -> dict[str, Any]:
        """Returns the start values that select a method and tolerances, without `max_rhs`, which not every method has."""
        start: dict[str, Any] = {"solver.method": method}
        if rtol is not None:
            start |= {"solver.rtol": rtol, "solver.atol": rtol * ratio}
        return start | ({"solver.max_rhs": 0.0} if "solver.max_rhs" in self.variables else {})


@dataclass(frozen=True)
class Task:
    """One run: start values, step size (s) and count, periodic rows of inputs, outputs, and time limit (s)."""

    step: float
    steps: int
    every: int = 1
    start: dict[str, Any] = field(default_factory=dict)
    outputs: Sequence[str] = ()
    inputs: Sequence[str] = ()
    rows: Sequence[Sequence[float]] = ()
    hold: int = 1
    repeats: int = 0
    spend: float = 1e9
    budget: float = 60.0


@dataclass(frozen=True)
class Outcome:
    """The result of a run. `status`: ok, budget, error, refused, not finite, hang, crash, not loaded."""

    status: str
    message: str = ""
    reached: float = 0.0
    seconds: float = math.nan
    times: np.ndarray = field(default_factory=lambda: np.empty(0))
    values: np.ndarray = field(default_factory=lambda: np.empty((0, 0)))
    health: dict[str, int] = field(default_factory=dict)
    method: str = ""
    after: str = ""
    log: Sequence[str] = ()


@contextmanager
def staged(target: Path) -> Iterator[Staged]:
    """Yields the files of an FMU, or those of a model file's FMU; raises UserError."""
    with tempfile.TemporaryDirectory() as folder:
        yield stage_fmu(target, Path(folder)) if target.suffix == ".fmu" else stage_model(target, Path(folder))


def stage_model(model: Path, folder: Path, description: Description | None = None) -> Staged:
    """Writes the files of a model's FMU into the folder."""
    table = description or describe(model)
    (folder / "resources").mkdir(parents=True, exist_ok=True)
    (folder / "resources" / "model.toml").write_bytes(model.read_bytes())
    attach(table.resources, model, folder / "resources")
    experiment = table.default_experiment
    return Staged(
        table.model_name,
        native.library(native.HOST),
        (folder / "resources").as_uri(),
        table.guid,
        {v.name: v for v in table.variables},
        experiment["stop_time"],
        experiment["step_size"],
    )


def stage_fmu(fmu: Path, folder: Path) -> Staged:
    """Unpacks an FMU into the folder."""
    description = read_description(fmu)
    if description.fmiVersion != "2.0":
        raise UserError(f"'{fmu}' is an FMU of FMI 3.0: this command runs FMI 2.0 only, give it the model file")
    try:
        with zipfile.ZipFile(fmu) as archive:
            archive.extractall(folder)
    except (zipfile.BadZipFile, OSError) as error:
        raise UserError(f"'{fmu}' cannot be unpacked: {error}") from None
    library = folder / "binaries" / native.HOST / f"{description.coSimulation.modelIdentifier}{native.LIBRARIES[native.HOST][1]}"
    if not library.is_file():
        raise UserError(f"'{fmu}' contains no library for {SYSTEMS[native.HOST]}")
    experiment = description.defaultExperiment
    stop = float(getattr(experiment, "stopTime", None) or 1)
    variables = {v.name: _variable(v) for v in description.modelVariables}
    return Staged(
        description.modelName,
        library,
        (folder / "resources").as_uri(),
        description.guid,
        variables,
        stop,
        float(getattr(experiment, "stepSize", None) or stop / 1000),
    )


def _variable(v) -> Variable:
    start = float(v.start) if v.type == "Real" and v.start is not None else v.start
    return Variable(
        v.name, v.valueReference, v.type, v.causality or "local", v.variability or "continuous", v.initial, start, v.unit, v.displayUnit,
        max=float(v.max) if v.type == "Real" and v.max is not None else None,
    )  # fmt: skip


def drive(fmu: Staged, task: Task) -> Outcome:
    """Runs the task in a separate process."""
    health = [name for name in HEALTH if name in fmu.variables]
    answer = ask(native.driver_program(), job_lines(fmu, task), task.budget)
    if isinstance(answer, Outcome):
        return answer
    status, phase, log = answer["status"], answer.get("phase", ""), [" ".join(line.split()) for line in answer.get("log", [])]
    message = next((line for line in reversed(log) if not line.startswith("warning: ")), "")
    if status == "not finite":
        name = next(n for n in task.outputs if fmu.variables[n].value_reference == answer["bad_reference"])
        message = f"'{name}' is not finite at t = {answer['bad_time']:g} s, although the step returned fmi2OK"
    elif status == "hang":
        message = f"the FMU did not respond within {task.budget + PATIENCE:g} s ({phase}, t = {answer['reached']:g} s)"
    elif status == "budget":
        message = f"reached t = {answer['reached']:g} s within {task.budget:g} s of CPU time"
    values = np.array([[math.nan if x is None else x for x in row] for row in answer.get("values", [])], dtype=float)
    return Outcome(
        status,
        message,
        answer.get("reached", 0.0),
        answer.get("seconds", math.nan),
        np.array(answer.get("times", [])),
        values,
        dict(zip(health, answer.get("integers", []), strict=False)),
        next((text for text in answer.get("texts", []) if text), ""),
        answer.get("after", ""),
        log,
    )


def job_lines(fmu: Staged, task: Task) -> list[str]:
    """Returns the input of fmu_driver for the task."""
    health = [name for name in HEALTH if name in fmu.variables]
    lines = [*head_lines(fmu, task), f"repeats {task.repeats}", f"spend {task.spend!r}"]
    lines += ["integers " + " ".join(_reference(fmu, name) for name in health)] if health else []
    return lines + ([f"names {_reference(fmu, 'solver.method')}"] if "solver.method" in fmu.variables else [])


def head_lines(fmu: Staged, task: Task) -> list[str]:
    """Returns the part of a job that describes FMU and run; bench/latency.py uses it, too."""
    lines = [
        f"library {fmu.library}",
        f"resources {fmu.resources}",
        f"guid {fmu.guid}",
        f"step {task.step!r}",
        f"steps {task.steps}",
        f"every {task.every}",
        f"hold {task.hold}",
        f"budget {task.budget!r}",
        f"patience {PATIENCE!r}",
    ]
    for name, value in task.start.items():
        word = "string" if fmu.variables[name].type == "String" else "real"
        lines.append(f"{word} {_reference(fmu, name)} {value if word == 'string' else repr(float(value))}")
    if task.outputs:
        lines.append("outputs " + " ".join(_reference(fmu, name) for name in task.outputs))
    if task.inputs:
        lines.append("inputs " + " ".join(_reference(fmu, name) for name in task.inputs))
        lines += ["input " + " ".join(repr(float(x)) for x in row) for row in task.rows]
    return lines


def ask(program: Path, lines: list[str], budget: float) -> dict[str, Any] | Outcome:
    """Returns the answer of a driver program to a job, or how it failed."""
    try:
        done = subprocess.run(
            [str(program)],
            input="\n".join(lines) + "\n",
            encoding="utf-8",
            errors="replace",
            capture_output=True,
            timeout=min(12 * (budget + PATIENCE), LONGEST_WAIT),
            check=False,
            env={**os.environ, "LC_ALL": "C"},
        )
    except subprocess.TimeoutExpired:
        return Outcome("hang", "the process does not respond")
    except OSError as error:
        raise UserError(f"cannot run '{program}': {error.strerror}") from None
    if done.returncode >= EXCEPTIONS:
        return Outcome("crash", f"the process was terminated by exception {done.returncode:#x}")
    if done.returncode < 0:
        return Outcome("crash", f"the process was terminated by signal {-done.returncode}")
    if done.returncode != 0:
        raise UserError(f"{done.stderr.strip() or f'{program.name} failed with exit code {done.returncode}'}; rebuild it")
    return json.loads(done.stdout)


def _reference(fmu: Staged, name: str) -> str:
    return str(fmu.variables[name].value_reference)
