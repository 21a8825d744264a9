#!/usr/bin/env python3
"""Latency in a compiled master: steps of 1 ms, reading outputs, start-up, and many simultaneous instances.

    python bench/latency.py                       pendulum, four-bar, KUKA KR5, a chain of 20 links and ten four-bars in series
    python bench/latency.py -m models/leg.toml    other models
    python bench/latency.py --instances 1 100     (default: 1 100 10000)

Prints lines `scene.metric value`: times in ns, heap memory per instance in bytes, allocations in all timed steps. `constant`: constant
inputs; `changing`: every torque changes at each step. The model's own method and tolerance are used. The cost of reading the clock is
subtracted. Uses the program of `sh scripts/build.sh bench latency_driver`, and the library and `describe` in build/release or those named
by REDYSIM_FMU_LIBRARY and _DESCRIBE.
"""

import argparse
import math
import sys
from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent
sys.path.insert(0, str(ROOT))

import built

from build_fmu.errors import UserError
from build_fmu.report.machine import machine_lines
from build_fmu.run.driver import Outcome, Staged, Task, ask, head_lines, staged

SCENES = ("pendulum", "four_bar", "kuka_kr5", "long_chain", "four_bar_chain", "iftomm_four_bars")
STEP = 1e-3  # s
TORQUE = 1e-3  # N m, change of an input
UNTIMED = 0.05  # warm-up of the driver, as a fraction of the timed steps


def latency(fmu: Staged, task: Task, instances) -> dict:
    """Returns the figures of single steps, starts and many instances (ns, bytes); raises UserError."""
    lines = [*head_lines(fmu, task), f"repeats {task.repeats}", "instances " + " ".join(map(str, instances))]
    answer = ask(built.program("latency_driver"), lines, task.budget)
    if isinstance(answer, Outcome) or answer["status"] != "ok":
        raise UserError(f"'{fmu.name}' cannot be timed: {answer.message if isinstance(answer, Outcome) else answer['status']}")
    return answer


def figures(model, steps, instances, seconds):
    """Yields (scene.metric, value) of one model file."""
    with staged(model) as fmu:
        inputs = [name for name in fmu.names("input") if name.endswith(".tau")]
        rows = [[0.0] * len(inputs), [TORQUE] * len(inputs)] if inputs else []
        span = max(1, min(steps, int(fmu.stop / STEP / (1 + UNTIMED))))
        task = Task(STEP, span, inputs=inputs, rows=rows, outputs=fmu.reals(), repeats=math.ceil(steps / span) - 1, budget=seconds)
        found = latency(fmu, task, instances)
        for metric in ("instantiate_ns", "initialise_ns", "bytes"):
            yield f"{model.stem}.{metric}", found[metric]
        for kind in ("constant", "changing"):
            for metric, value in found.get(kind, {}).items():
                yield f"{model.stem}.{kind}_{metric}", value
        for row in found["many"]:
            for metric in ("start_ns", "step_ns", "bytes"):
                yield f"{model.stem}.of_{row['count']:.0f}_instances_{metric}", row[metric]


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("-m", "--models", type=Path, nargs="+", default=[ROOT / "models" / f"{name}.toml" for name in SCENES])
    parser.add_argument("-n", "--steps", type=int, default=5000, help="timed steps of each kind")
    parser.add_argument("--instances", type=int, nargs="*", default=[1, 100, 10000])
    parser.add_argument("--seconds", type=float, default=300, help="time limit per model, s")
    options = parser.parse_args()
    for line in machine_lines():
        print(f"# {line}")
    for model in options.models:
        try:
            for name, value in figures(model, options.steps, options.instances, options.seconds):
                print(f"{name} {value:.4g}", flush=True)
        except UserError as error:
            sys.exit(str(error))


if __name__ == "__main__":
    main()
