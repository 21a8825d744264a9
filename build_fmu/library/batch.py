"""Many runs of one FMU by the compiled driver: one process per worker, no Python between steps."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from build_fmu import native
from build_fmu.errors import UserError, unknown
from build_fmu.run.driver import Outcome, Staged, Task, ask, head_lines

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
        return self.values[:, :, self.names.index(name)]


def simulate_batch(fmu: Staged, task: Task, inputs: np.ndarray | None, parameters: Mapping[str, ArrayLike], workers: int) -> Runs:
    """Runs the task with each row of parameters (runs) and inputs (runs x steps x inputs); `inputs` None: as in the task."""
    for name in parameters:
        known = fmu.names("parameter")
        if name not in known:
            raise unknown("parameter", name, known)
    columns = {name: np.asarray(values, dtype=float) for name, values in parameters.items()}
    shapes = {f"parameter '{name}'": values.shape for name, values in columns.items()}
    count = len(inputs) if inputs is not None else next((len(v) for v in columns.values() if v.ndim == 1), 1)
    for what, shape in shapes.items():
        if shape not in ((), (count,)):
            raise UserError(f"{what} must be a number or have the shape ({count},), got {shape}")
    # a batch varies at least one parameter
    columns = columns or {"solver.rtol": np.array(fmu.variables["solver.rtol"].start)}
    table = np.column_stack([np.broadcast_to(values, count) for values in columns.values()])
    if not np.isfinite(table).all() or (inputs is not None and not np.isfinite(inputs).all()):
        raise UserError("the parameters and inputs of a batch must be finite")
    references = " ".join(str(fmu.variables[name].value_reference) for name in columns)

    def chunk(runs: np.ndarray) -> tuple[list[str], np.ndarray]:
        lines = head_lines(fmu, task) + [f"vary {references}"]
        lines += ["values " + " ".join(map(repr, row)) for row in table[runs].tolist()]
        if inputs is not None:
            lines += ["input " + " ".join(map(repr, row)) for row in inputs[runs].reshape(-1, inputs.shape[2]).tolist()]
            lines.append("inputs " + " ".join(str(fmu.variables[name].value_reference) for name in fmu.names("input")))
        budget = BUDGET * len(runs)
        return _results(ask(native.driver_program(), [*lines, f"budget {budget!r}"], budget), task, len(runs))

    parts = [part for part in np.array_split(np.arange(count), max(1, workers)) if len(part)]
    with ThreadPoolExecutor(len(parts)) as pool:
        done = list(pool.map(chunk, parts))
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
