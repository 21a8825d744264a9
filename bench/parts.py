#!/usr/bin/env python3
"""What a scene pays for parts of the library that it does not use: the whole library against one built without a part.

    python bench/parts.py                     every part; builds a library a part in build/parts (minutes the first time)
    python bench/parts.py -p loops springs    some parts
    python bench/parts.py --no-time           instructions, bytes and variables alone: the same on a busy machine

Prints lines `scene.without_PART.metric value`. `instructions`: those of fmi2SetReal and fmi2DoStep over steps with changing inputs,
counted by Valgrind; `time`: the same by the clock; `bytes`: of the heap an instance after its first step. These are ratios, the whole
library's figure over that without the part. `variables`: of the scene's variables, how many are another, or missing, without it.
"""

from __future__ import annotations

import argparse
import os
import re
import subprocess
import sys
import tempfile
from dataclasses import dataclass, replace
from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent
sys.path.insert(0, str(ROOT))

from bare import bare  # noqa: E402
from build_fmu import native  # noqa: E402
from build_fmu.describe import describe  # noqa: E402
from build_fmu.driver import Staged, Task, drive, job_lines, latency, stage_model  # noqa: E402
from build_fmu.report.machine import machine_lines  # noqa: E402

ALL = ("loops", "springs", "friction", "ports", "motion", "spherical", "control", "energies", "erk", "adams", "dirk", "bdf")
PARTS = {part: (part,) for part in ALL[:8]} | {"multistep_and_implicit": ("adams", "dirk", "bdf"), "all_these": tuple(p for p in ALL if p != "erk")}
SCENES = ("kuka_kr5", "double_pendulum", "four_bar")
STEP, COUNTED, TIMED = 1e-3, 400, 4000
CALLS = ("fmi2SetReal", "fmi2DoStep")
TORQUE = 1e-3  # N m, by which an input changes


@dataclass(frozen=True)
class Build:
    """A library and the `describe` of the same parts."""

    library: Path
    program: Path


def whole() -> Build:
    return Build(native.library(), native.describe_program())


def without(name: str) -> Build:
    """Builds the library that lacks a part."""
    folder = ROOT / "build" / "parts" / name
    folder.mkdir(parents=True, exist_ok=True)
    import fmpy

    features = ";".join(part for part in ALL if part not in PARTS[name])
    settings = {"CMAKE_BUILD_TYPE": "Release", "REDYSIM_TESTS": "OFF", "REDYSIM_FEATURES": features, "REDYSIM_FMI_HEADERS": str(Path(fmpy.__file__).parent / "c-code")}
    commands = [["cmake", "-S", ROOT, "-B", folder, "-G", "Ninja", *(f"-D{key}={value}" for key, value in settings.items())],
                ["cmake", "--build", folder, "--parallel", str(os.cpu_count() or 1), "--target", "redysim_fmu", "describe"]]
    for command in commands:
        done = subprocess.run([str(word) for word in command], capture_output=True, text=True)
        if done.returncode:
            sys.exit(f"{name}: the library was not built:\n{(done.stdout + done.stderr)[-2000:]}")
    return Build(folder / "fmu_src" / "fmi" / "libredysim_fmu.so", folder / "fmu_src" / "fmi" / "describe")


def task(fmu: Staged, steps: int, repeats: int = 0) -> Task:
    inputs = [name for name in fmu.names("input") if name.endswith(".tau")]
    rows = [[0.0] * len(inputs), [TORQUE] * len(inputs)]
    return Task(STEP, steps, steps, inputs=inputs, rows=rows, outputs=fmu.names("output"), repeats=repeats)


def instructions(fmu: Staged) -> int:
    """Returns how many instructions the calls took."""
    command = ["valgrind", "--tool=callgrind", "--callgrind-out-file=/dev/null", *(f"--toggle-collect={name}" for name in CALLS), str(native.driver_program())]
    done = subprocess.run(command, input="\n".join(job_lines(fmu, task(fmu, COUNTED))), text=True, capture_output=True)
    found = re.search(r"Collected : (\d+)", done.stderr)
    if done.returncode or not found or not int(found[1]):
        sys.exit(f"valgrind counted nothing:\n{done.stderr[-2000:]}")
    return int(found[1])


def seconds(fmu: Staged) -> float:
    return drive(fmu, task(fmu, TIMED, repeats=5)).seconds


def variables(build: Build, model: Path) -> dict[str, str]:
    """Returns the scene's variables as this build describes them."""
    os.environ["REDYSIM_FMU_DESCRIBE"] = str(build.program)
    try:
        return {variable.name: repr(variable) for variable in describe(model).variables}
    finally:
        del os.environ["REDYSIM_FMU_DESCRIBE"]


def figures(model: Path, full: Build, other: Build, rounds: int):
    """Yields (metric, value) of one scene and part."""
    with tempfile.TemporaryDirectory() as folder:
        fmu = stage_model(model, Path(folder))
        pair = [replace(fmu, library=build.library) for build in (full, other)]
        counted = [instructions(one) for one in pair]
        yield "instructions", counted[0] / counted[1]
        if rounds:
            times = [[seconds(one) for one in (pair if k % 2 else reversed(pair))][:: 1 if k % 2 else -1] for k in range(rounds)]
            yield "time", min(t[0] for t in times) / min(t[1] for t in times)
        size = [latency(one, task(one, 100), [])["bytes"] for one in pair]
        yield "bytes", size[0] / size[1]
    shown = [variables(build, model) for build in (full, other)]
    yield "variables", sum(shown[0].get(name) != shown[1].get(name) for name in {*shown[0], *shown[1]})


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("-p", "--parts", nargs="+", choices=PARTS, default=list(PARTS))
    parser.add_argument("-s", "--scenes", nargs="+", default=list(SCENES))
    parser.add_argument("-r", "--rounds", type=int, default=7, help="of the timed runs")
    parser.add_argument("--no-time", action="store_true")
    options = parser.parse_args()
    for line in machine_lines():
        print(f"# {line}")
    full = whole()
    with tempfile.TemporaryDirectory() as folder:
        models = {scene: bare(ROOT / "models" / f"{scene}.toml", Path(folder)) for scene in options.scenes}
        uses = {scene: set(describe(model).features) for scene, model in models.items()}
        for part in options.parts:
            print(f"without {part}", file=sys.stderr, flush=True)
            other = without(part)
            for scene, model in models.items():
                if uses[scene] & set(PARTS[part]):
                    continue
                for metric, value in figures(model, full, other, 0 if options.no_time else options.rounds):
                    print(f"{scene}.without_{part}.{metric} {value:.4g}", flush=True)


if __name__ == "__main__":
    main()
