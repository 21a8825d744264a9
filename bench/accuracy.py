#!/usr/bin/env python3
"""Accuracy of the FMU as lines `scene.metric value`. References: the tables of tests/scenes, computed without our algorithms.

    python bench/accuracy.py

`random_states_fd_error`, `_id_error`: maximum error of the accelerations (inverse FMU: of the torques) over 50 random states, relative to
the largest value of the state. `trajectory_error`: maximum position error of the model's method at rtol 1e-8. `amplification`: growth
factor of a change of the start values. `trajectory_error_in_rtol_times_amplification`: the error divided by both.
`loop_gap`: maximum at the output times of a run in free fall from the model's start, m or rad. `library_bytes`: size of the shared
library. The results hardly depend on the machine.
"""

from __future__ import annotations

import sys
import tempfile
from pathlib import Path

import numpy as np

ROOT = Path(__file__).resolve().parent.parent
sys.path.insert(0, str(ROOT))

from build_fmu import native
from build_fmu.model.inverse import inverse_of
from build_fmu.report.machine import machine_lines
from build_fmu.run.driver import Outcome, Staged, Task, drive, stage_model, staged

SCENES = ROOT / "tests" / "scenes"
RANDOM_STATES = {
    "double_pendulum": "double_pendulum",
    "gripper": "gripper_freefall",
    "gripper_redysim": "gripper_redysim_freefall",
    "kuka_kr5": "kr5_freefall",
}
TRAJECTORIES = {"pendulum": "simple_pendulum", **RANDOM_STATES, "four_bar": "fourbar_freefall", "stiff_strut": "stiff_strut"}
LOOPS = {"four_bar": 100.0, "five_bar": 10.0, "slider_crank": 10.0, "bennett": 10.0, "three_rrr": 10.0}  # seconds to run
RTOL = 1e-8
NUDGE = 1e-6  # rad, m, rad/s or m/s, for the amplification


def table(name: str) -> np.ndarray:
    return np.genfromtxt(SCENES / f"{name}.csv", delimiter=",", names=True)


def columns(rows: np.ndarray, letter: str) -> np.ndarray:
    return np.stack([rows[name] for name in rows.dtype.names if name.rstrip("0123456789") == letter], axis=1)


def named(fmu: Staged, ending: str, causality: str) -> list[str]:
    return [name for name in fmu.names(causality) if name.endswith(ending)]


def whole(outcome: Outcome) -> np.ndarray:
    if outcome.status != "ok":
        sys.exit(f"the FMU's run failed: {outcome.message}")
    return outcome.values


def accelerations(model: Path, rows: np.ndarray) -> float:
    """Forward dynamics: q0, qd0 and tau give qdd at the start."""
    worst = 0.0
    with staged(model) as fmu:
        starts, inputs, outputs = (
            named(fmu, ".q0", "parameter") + named(fmu, ".qd0", "parameter"),
            named(fmu, ".tau", "input"),
            named(fmu, ".qdd", "output"),
        )
        for state, tau, expected in zip(
            np.hstack([columns(rows, "q"), columns(rows, "qd")]), columns(rows, "tau"), columns(rows, "qdd"), strict=True
        ):
            task = Task(1e-9, 1, start=dict(zip(starts, state, strict=True)), inputs=inputs, rows=[tau], outputs=outputs)
            worst = max(worst, np.abs(whole(drive(fmu, task))[0] - expected).max() / np.abs(expected).max())
    return worst


def torques(model: Path, rows: np.ndarray) -> float:
    """Inverse dynamics: the inputs q, qd and qdd of the inverse FMU give tau."""
    worst = 0.0
    with inverse_of(model) as (description, source), tempfile.TemporaryDirectory() as folder:
        fmu = stage_model(source, Path(folder), description)
        inputs, outputs = (
            [name for letter in ("q", "qd", "qdd") for name in named(fmu, f".{letter}", "input")],
            named(fmu, ".tau", "output"),
        )
        for motion, expected in zip(np.hstack([columns(rows, letter) for letter in ("q", "qd", "qdd")]), columns(rows, "tau"), strict=True):
            values = whole(drive(fmu, Task(1e-9, 1, inputs=inputs, rows=[motion], outputs=outputs)))
            worst = max(worst, np.abs(values[0] - expected).max() / np.abs(expected).max())
    return worst


def positions(fmu: Staged, rows: np.ndarray, rtol: float, start: dict[str, float]) -> np.ndarray:
    names, times = named(fmu, ".q", "output"), rows["t"]
    settings = {"solver.rtol": rtol, "solver.atol": rtol / 100, **start}
    return whole(drive(fmu, Task(float(times[-1]) / (len(times) - 1), len(times) - 1, start=settings, outputs=names)))


def trajectory(model: Path, rows: np.ndarray):
    """Yields the error at rtol 1e-8 and the amplification of a change of the start values."""
    with staged(model) as fmu:
        error = np.abs(positions(fmu, rows, RTOL, {}) - columns(rows, "q")).max()
        yield "trajectory_error", error
        plain = positions(fmu, rows, 1e-11, {})
        grown = 1.0
        for name in named(fmu, ".q0", "parameter") + named(fmu, ".qd0", "parameter"):
            start = {name: float(fmu.variables[name].start) + NUDGE}
            moved = positions(fmu, rows, 1e-11, start)
            # assembly changes the start values: use the change of the actual start
            grown = max(grown, np.abs(moved - plain).max() / max(NUDGE, np.abs(moved[0] - plain[0]).max()))
        yield "amplification", grown
        yield "trajectory_error_in_rtol_times_amplification", error / RTOL / grown


def loop_gap(model: Path, seconds: float) -> float:
    with staged(model) as fmu:
        gaps = named(fmu, ".gap", "output")
        steps = round(seconds / 0.01)
        return float(whole(drive(fmu, Task(0.01, steps, outputs=gaps, budget=120))).max())


def main() -> None:
    for line in machine_lines():
        print(f"# {line}")

    def show(name: str, value: float) -> None:
        print(f"{name} {value:.3g}", flush=True)

    for name, scene in RANDOM_STATES.items():
        model = ROOT / "models" / f"{name}.toml"
        show(f"{name}.random_states_fd_error", accelerations(model, table(f"{scene}_fd")))
        show(f"{name}.random_states_id_error", torques(model, table(f"{scene}_id")))
    for name, scene in TRAJECTORIES.items():
        for metric, value in trajectory(ROOT / "models" / f"{name}.toml", table(scene)):
            show(f"{name}.{metric}", value)
    for name, seconds in LOOPS.items():
        show(f"{name}.loop_gap_in_{seconds:.0f}_s", loop_gap(ROOT / "models" / f"{name}.toml", seconds))
    print(f"library_bytes {native.library().stat().st_size}")


if __name__ == "__main__":
    main()
