#!/usr/bin/env python3
"""Cost of unused parts of the library: the general library relative to one built without a part.

    python bench/parts.py                     all parts; builds one library per part (bench/variants.py; minutes the first time)
    python bench/parts.py -p loops drives     selected parts
    python bench/parts.py --no-time           instructions, bytes and variables only: independent of the load of the machine

Prints lines `scene.without_PART.metric value`. `instructions`: of fmi2SetReal and fmi2DoStep over steps with changing inputs, counted
by Valgrind, with the few of the driver between the calls; `time`: CPU time of the calls; `bytes`: heap memory of an instance after its
first step. These are ratios of the general library to the library without the part. `variables`: number of the scene's variables that
differ or are missing without the part.
"""

from __future__ import annotations

import argparse
import json
import os
import re
import subprocess
import sys
import tempfile
import time
from dataclasses import replace
from functools import cache
from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent
sys.path.insert(0, str(ROOT))

import built
from bare import bare
from latency import latency
from variants import Build, build_each

from build_fmu import native
from build_fmu.model.describe import describe
from build_fmu.report.machine import machine_lines
from build_fmu.run.driver import Staged, Task, drive, job_lines, stage_model

# erk is in use; taylor is part of libraries for one model only
ALL = tuple(re.findall(r"(?m)^inline constexpr bool (\w+) = holds\(", (ROOT / "fmu_src" / "model" / "features.hpp").read_text("utf-8")))
PARTS = {
    "loops": ("loops",),
    "forces_between_bodies": ("springs", "bushings", "contact", "ports"),
    "drives": ("friction", "actuators", "motion", "control"),
    "spherical": ("spherical",),
    "energies": ("energies",),
    "other_methods": ("adams", "dirk", "bdf", "exponential"),
    "all_these": tuple(part for part in ALL if part != "erk"),
}
SCENES = ("kuka_kr5", "double_pendulum", "four_bar")
STEP, COUNTED, TIMED = 1e-3, 400, 4000
LEAST_PER_JOINT = 100  # instructions of a right-hand side; the recursion takes several times as many
TORQUE = 1e-3  # N m, change of an input


def whole() -> Build:
    return Build(native.library(), native.describe_program())


def task(fmu: Staged, steps: int, repeats: int = 0) -> Task:
    inputs = [name for name in fmu.names("input") if name.endswith(".tau")]
    rows = [[0.0] * len(inputs), [TORQUE] * len(inputs)]
    return Task(STEP, steps, steps, inputs=inputs, rows=rows, outputs=fmu.names("output"), repeats=repeats)


def instructions(fmu: Staged) -> int:
    """Returns the number of instructions of the calls in all but the first step: the difference of two runs."""
    long, short = (executed(fmu, steps) for steps in (COUNTED, 1))
    joints = sum(name.endswith(".qd") for name in fmu.names("output"))
    counted, steps = long - short, COUNTED - 1
    if counted < steps * max(1, joints) * LEAST_PER_JOINT:
        sys.exit(f"Valgrind counted {counted} instructions in {steps} steps of '{fmu.name}', fewer than one right-hand side takes")
    return counted


def executed(fmu: Staged, steps: int) -> int:
    """Returns the number of instructions of a whole process that simulates so many steps."""
    command = ["valgrind", "--tool=callgrind", "--callgrind-out-file=/dev/null", str(native.driver_program())]
    done = subprocess.run(command, input="\n".join(job_lines(fmu, task(fmu, steps))), text=True, capture_output=True)
    found = re.search(r"Collected : (\d+)", done.stderr)
    if done.returncode or not found:
        sys.exit(f"Valgrind counted no instructions:\n{done.stderr[-2000:]}")
    answer = json.loads(done.stdout)
    if answer["status"] != "ok":
        sys.exit(f"'{fmu.name}' failed under Valgrind: {answer['status']}; {'; '.join(answer.get('log', []))}")
    return int(found[1])


def seconds(fmu: Staged) -> float:
    return drive(fmu, task(fmu, TIMED, repeats=5)).seconds


@cache
def variables(build: Build, model: Path) -> dict[str, str]:
    """Returns the variables of the scene according to this build."""
    os.environ["REDYSIM_FMU_DESCRIBE"] = str(build.program)
    try:
        return {variable.name: repr(variable) for variable in describe(model).variables}
    finally:
        del os.environ["REDYSIM_FMU_DESCRIBE"]


def shared_figures(model: Path, build: Build) -> tuple[int, float]:
    """Returns instructions and heap memory of a scene with a library."""
    with tempfile.TemporaryDirectory() as folder:
        fmu = replace(stage_model(model, Path(folder)), library=build.library)
        return instructions(fmu), latency(fmu, task(fmu, 100), [])["bytes"]


def time_ratio(model: Path, pair: tuple[Build, Build], rounds: int) -> float:
    """Returns the CPU time of the first library relative to the second, minimum of alternating rounds."""
    with tempfile.TemporaryDirectory() as folder:
        fmu = stage_model(model, Path(folder))
        first, second = (replace(fmu, library=build.library) for build in pair)
        times = []
        for k in range(rounds):
            one, other = (seconds(fmu) for fmu in ((first, second) if k % 2 else (second, first)))
            times.append((one, other) if k % 2 else (other, one))
    return min(t[0] for t in times) / min(t[1] for t in times)


def figures(model: Path, full: Build, other: Build, rounds: int, known: tuple[int, float]):
    """Yields (metric, value) of one scene and part; `known`: shared_figures of the general library."""
    counted, size = shared_figures(model, other)
    yield "instructions", known[0] / counted
    if rounds:
        yield "time", time_ratio(model, (full, other), rounds)
    yield "bytes", known[1] / size
    shown = [variables(build, model) for build in (full, other)]
    yield "variables", sum(shown[0].get(name) != shown[1].get(name) for name in {*shown[0], *shown[1]})


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("-p", "--parts", nargs="+", choices=PARTS, default=list(PARTS))
    parser.add_argument("-s", "--scenes", nargs="+", default=list(SCENES))
    parser.add_argument("-r", "--rounds", type=int, default=7, help="number of timed rounds")
    parser.add_argument("--no-time", action="store_true")
    options = parser.parse_args()
    for line in machine_lines():
        print(f"# {line}")
    built.program("latency_driver")  # before the libraries, which take long
    full = whole()
    single = {feature for part, features in PARTS.items() if part != "all_these" for feature in features}
    if missing := set(PARTS["all_these"]) - single:
        sys.exit(f"only all_these contains {', '.join(sorted(missing))}")
    builds = build_each({name: tuple(part for part in ALL if part not in PARTS[name]) for name in options.parts})
    begin = time.monotonic()
    with tempfile.TemporaryDirectory() as folder:
        models = {scene: bare(ROOT / "models" / f"{scene}.toml", Path(folder), method="erk") for scene in options.scenes}
        uses = {scene: set(describe(model).features) for scene, model in models.items()}
        known = {scene: shared_figures(model, full) for scene, model in models.items()}
        for number, (part, other) in enumerate(((part, builds[part]) for part in options.parts if part in builds), 1):
            for scene, model in models.items():
                if uses[scene] & set(PARTS[part]):
                    continue
                for metric, value in figures(model, full, other, 0 if options.no_time else options.rounds, known[scene]):
                    print(f"{scene}.without_{part}.{metric} {value:.4g}", flush=True)
            print(f"  {number} of {len(builds)} measured: without {part}, {time.monotonic() - begin:.0f} s", file=sys.stderr, flush=True)
    if len(builds) < len(options.parts):
        sys.exit("a library could not be built")


if __name__ == "__main__":
    main()
