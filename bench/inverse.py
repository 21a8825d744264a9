"""Inverse dynamics of the gripper of the ReDySim paper (101 rows, 1 s) by its inverse FMU: in FMPy and in a compiled master.

    python bench/inverse.py [--build build/bench]     after `sh scripts/build.sh bench inverse_batch`

Times in s for all rows, medians over repetitions in one run: initialization, then per row setting 12 values, reading 4 values
and a step. The paper gives 0.025 s for ReDySim and 1.95 s for ADAMS on a machine of 2012.
"""

import argparse
import os
import statistics
import subprocess
import sys
import tempfile
import time
from pathlib import Path

import numpy as np

ROOT = Path(__file__).resolve().parent.parent
sys.path.insert(0, str(ROOT))

import built
from run import commit, processor

PAPER = {"redysim": 0.025, "adams": 1.95}
REPETITIONS = 21


def motion():
    """The paper's cycloid: rows of time, q, qd, qdd."""
    start, goal, t = np.radians([0, 0, 0, 90]), np.radians([60, 80, 80, 120]), np.linspace(0, 1, 101)[:, None]
    w = 2 * np.pi
    return np.hstack(
        [t, start + (goal - start) * (t - np.sin(w * t) / w), (goal - start) * (1 - np.cos(w * t)), (goal - start) * w * np.sin(w * t)]
    )


def through_fmpy(folder, description, inputs, outputs, rows):
    """Returns the time of each repetition in s and the torques of the last one."""
    import fmpy

    fmu = fmpy.instantiate_fmu(folder, description, "CoSimulation")
    times = []
    steps = rows.tolist()
    for _ in range(REPETITIONS):
        fmu.reset()
        torques = []
        begin = time.perf_counter()
        fmu.enterInitializationMode()
        fmu.exitInitializationMode()
        for k, row in enumerate(steps):
            fmu.setReal(inputs, row[1:])
            torques.append(fmu.getReal(outputs))
            if k + 1 < len(steps):
                fmu.doStep(row[0], steps[k + 1][0] - row[0])
        times.append(time.perf_counter() - begin)
    fmu.freeInstance()
    return times, np.array(torques)


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--build", help="build folder (build/bench or build/release)")
    options = parser.parse_args()
    program = built.program("inverse_batch", options.build)
    import fmpy

    from build_fmu.fmu.build import build
    from build_fmu.model.inverse import inverse_of

    rows = motion()
    with tempfile.TemporaryDirectory() as place:
        target = Path(place) / "gripper_inverse.fmu"
        with inverse_of(ROOT / "models" / "gripper.toml") as (model, source):
            build(model, source, target)
        folder = fmpy.extract(str(target), str(Path(place) / "fmu"))
        description = fmpy.read_model_description(folder)
        number = {v.name: v.valueReference for v in description.modelVariables}
        inputs = [number[f"joint{i}.{kind}"] for kind in ("q", "qd", "qdd") for i in range(1, 5)]
        outputs = [number[f"joint{i}.tau"] for i in range(1, 5)]
        times, torques = through_fmpy(folder, description, inputs, outputs, rows)
        library = Path(folder) / "binaries" / "linux64" / f"{model.model_identifier}.so"
        command = [program, library, (Path(folder) / "resources").as_uri(), description.guid, 4, *inputs, *outputs]
        done = subprocess.run(
            [str(word) for word in command], input=" ".join(map(repr, rows.ravel().tolist())), text=True, stdout=subprocess.PIPE, check=True
        )
        numbers = np.array(done.stdout.split(), float)
    assert np.array_equal(numbers[1:].reshape(-1, 4), torques)
    print(f"# machine {processor()}, {os.cpu_count()} processors, load {os.getloadavg()[0]:.1f}")
    print(f"# commit {commit()}, median of {REPETITIONS} repetitions (FMPy) and 2001 (compiled)")
    python = statistics.median(times)
    print(f"gripper_inverse.fmpy_s {python:.4g}\ngripper_inverse.compiled_s {numbers[0]:.4g}")
    for name, seconds in PAPER.items():
        print(f"gripper_inverse.paper_{name}_against_fmpy {seconds / python:.3g}")
        print(f"gripper_inverse.paper_{name}_against_compiled {seconds / numbers[0]:.3g}")


if __name__ == "__main__":
    main()
