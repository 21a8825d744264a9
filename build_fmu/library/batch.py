"""Many runs of one FMU by the compiled driver: one process per worker, no Python between steps; also over a Dask cluster."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np
from numpy.typing import ArrayLike

from build_fmu import native
from build_fmu.errors import UserError, unknown
from build_fmu.run.driver import Outcome, Staged, Task, ask, head_lines, staged

RETRIES = 5  # of a part of a batch on a cluster
PARTS = 4  # per worker of a cluster, so that little is repeated if one is lost
BUDGET = 60.0  # s of CPU time of a run, on average over those of a worker


@dataclass(frozen=True)
class Runs:
    """Results by run: `values` (runs x rows x outputs), NaN after a failure; `status` is "ok" or how the run failed."""

    time: np.ndarray
    names: list[str]
    values: np.ndarray
    status: list[str]

    def __getitem__(self, name: str) -> np.ndarray:
        """Returns an output (runs x rows)."""
        if name not in self.names:
            raise unknown("output", name, self.names)
        return self.values[:, :, self.names.index(name)]


def simulate_batch(fmu: Staged, task: Task, inputs: np.ndarray | None, parameters: Mapping[str, ArrayLike], workers: int) -> Runs:
    """Runs the task with each row of parameters (runs) and inputs (runs x steps x inputs); `inputs` None: as in the task."""
    columns = _columns(fmu, inputs, parameters)
    table = np.column_stack(list(columns.values()))
    references = " ".join(str(fmu.variables[name].value_reference) for name in columns)

    def chunk(runs: np.ndarray) -> tuple[list[str], np.ndarray]:
        lines = head_lines(fmu, task) + [f"vary {references}"]
        lines += ["values " + " ".join(map(repr, row)) for row in table[runs].tolist()]
        if inputs is not None:
            lines += ["input " + " ".join(map(repr, row)) for row in inputs[runs].reshape(-1, inputs.shape[2]).tolist()]
            lines.append("inputs " + " ".join(str(fmu.variables[name].value_reference) for name in fmu.names("input")))
        budget = BUDGET * len(runs)
        return _results(ask(native.driver_program(), [*lines, f"budget {budget!r}"], budget), task, len(runs))

    parts = _parts(len(table), workers)
    with ThreadPoolExecutor(len(parts)) as pool:
        return _joined(task, list(pool.map(chunk, parts)))


def simulate_on_cluster(
    client, archive: Path, fmu: Staged, task: Task, inputs: np.ndarray | None, parameters: Mapping[str, ArrayLike]
) -> Runs:
    """Runs the same over the workers of a Dask client; the runs of a lost worker are repeated by another one.

    The FMU is passed as bytes, so a worker needs no files but those of this package.
    """
    columns = _columns(fmu, inputs, parameters)
    count = len(next(iter(columns.values())))
    shared = client.scatter(archive.read_bytes(), broadcast=True, hash=True)
    futures = [
        client.submit(
            _remote_part,
            shared,
            task,
            None if inputs is None else inputs[runs],
            {name: values[runs] for name, values in columns.items()},
            retries=RETRIES,
            pure=False,
        )
        for runs in _parts(count, PARTS * max(1, sum(client.nthreads().values())))
    ]
    return _joined(task, client.gather(futures))


def _remote_part(archive: bytes, task: Task, inputs: np.ndarray | None, columns: Mapping[str, np.ndarray]) -> tuple[list[str], np.ndarray]:
    """Returns status and values of some runs, on a worker."""
    with TemporaryDirectory() as folder:
        file = Path(folder) / "model.fmu"
        file.write_bytes(archive)
        with staged(file) as fmu:
            runs = simulate_batch(fmu, task, inputs, columns, 1)
    return runs.status, runs.values


def parted(fmu: Staged, parameters: Mapping[str, ArrayLike | str]) -> tuple[dict[str, str], dict[str, ArrayLike]]:
    """Returns the strings, which all runs share, and the numbers; raises UserError for a wrong name or type."""
    known = fmu.names("parameter")
    texts: dict[str, str] = {}
    numbers: dict[str, ArrayLike] = {}
    for name, value in parameters.items():
        if name not in known:
            raise unknown("parameter", name, known)
        if fmu.variables[name].type == "Real":
            numbers[name] = value
        elif fmu.variables[name].type != "String":
            raise UserError(f"parameter '{name}' is not a real number and cannot vary in a batch")
        elif isinstance(value, str) and value.strip() and value.isprintable():
            texts[name] = value
        else:
            raise UserError(f"parameter '{name}' of a batch must be one line of text, the same for all runs")
    return texts, numbers


def _columns(fmu: Staged, inputs: np.ndarray | None, parameters: Mapping[str, ArrayLike]) -> dict[str, np.ndarray]:
    """Returns one value per run of each parameter; raises UserError."""
    columns = {name: _numbers(name, values) for name, values in parameters.items()}
    shapes = {f"parameter '{name}'": values.shape for name, values in columns.items()}
    count = len(inputs) if inputs is not None else next((len(v) for v in columns.values() if v.ndim == 1), 1)
    if count == 0:
        raise UserError("a batch has at least one run")
    for what, shape in shapes.items():
        if shape not in ((), (count,)):
            raise UserError(f"{what} must be a number or have the shape ({count},), got {shape}")
    # a batch varies at least one parameter
    columns = columns or {"solver.rtol": np.array(fmu.variables["solver.rtol"].start)}
    columns = {name: np.broadcast_to(values, count) for name, values in columns.items()}
    if not np.isfinite(list(columns.values())).all() or (inputs is not None and not np.isfinite(inputs).all()):
        raise UserError("the parameters and inputs of a batch must be finite")
    return columns


def _numbers(name: str, values: ArrayLike) -> np.ndarray:
    try:
        return np.asarray(values, dtype=float)
    except (TypeError, ValueError):
        raise UserError(f"parameter '{name}' of a batch must be a number or one number per run") from None


def _parts(count: int, number: int) -> list[np.ndarray]:
    return [part for part in np.array_split(np.arange(count), max(1, number)) if len(part)]


def _joined(task: Task, done: Sequence[tuple[list[str], np.ndarray]]) -> Runs:
    status = [text for states, _ in done for text in states]
    return Runs(_times(task), list(task.outputs), np.concatenate([values for _, values in done]), status)


def _times(task: Task) -> np.ndarray:
    rows = sorted({0, *range(task.every, task.steps + 1, task.every), task.steps})
    return np.array(rows) * task.step


def _results(answer: dict | Outcome, task: Task, count: int) -> tuple[list[str], np.ndarray]:
    """Returns status and values of the runs of one worker."""
    values = np.full((count, len(_times(task)), len(task.outputs)), np.nan)
    if isinstance(answer, Outcome):
        return [answer.status] * count, values
    states: Sequence[str] = answer.get("run_status", [])
    if len(states) != count:
        # the worker itself was stopped
        return [answer["status"] if answer["status"] != "ok" else "crash"] * count, values
    rows = np.array([[np.nan if x is None else x for x in row] for row in answer["values"]], dtype=float).reshape(-1, len(task.outputs))
    first = 0
    for i, size in enumerate(int(n) for n in answer["run_rows"]):
        values[i, :size] = rows[first : first + size]
        first += size
    return list(states), values
