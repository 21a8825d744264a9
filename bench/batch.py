#!/usr/bin/env python3
"""Many short runs of the KUKA KR5: `simulate_many` beside `mujoco.rollout`, CPU time at equal error.

    python bench/batch.py [--runs 10000]       after `sh scripts/peers.sh`

Each run takes 1 s from random angles, with random torques held for 10 ms. Errors are the medians over 100 runs of the largest error of
an angle at the end, against rtol 1e-12. CPU time of one worker, with its start and the exchange of data. Prints lines
`kuka_kr5.METHOD.SETTING.error`, `.us_per_run`, then the ratio at equal error and the time of all runs.
"""

from __future__ import annotations

import argparse
import os
import subprocess
import sys
import tempfile
import time
from pathlib import Path

import numpy as np

ROOT = Path(__file__).resolve().parent.parent
sys.path[:0] = [str(ROOT), str(ROOT / "bench" / "peers")]

import built
import mjcf
from bare import bare
from scenes import read

import build_fmu as rds
from build_fmu.report.machine import machine_lines

STEP, ROWS, JUDGED, SAMPLE = 0.01, 100, 100, 1000
TORQUES = np.array([20.0, 20.0, 10.0, 0.1, 0.1, 0.01])  # N m, standard deviations
TOLERANCES = (1e-3, 1e-4, 1e-5, 1e-6, 1e-7, 1e-8)
CUTS = {"RK4": (1, 2, 4, 8, 16), "implicitfast": (4, 16, 64)}


def cpu_seconds() -> float:
    spent = os.times()
    return spent.user + spent.system + spent.children_user + spent.children_system


class Batch:
    """Starts and torques of all runs, and the two simulators."""

    def __init__(self, runs: int, folder: Path) -> None:
        random = np.random.default_rng(1)
        self.starts = random.uniform(-1, 1, (runs, 6))
        self.torques = random.normal(size=(runs, ROWS, 6)) * TORQUES
        self.python = built.python_with("mujoco")
        self.file = folder / "runs.npz"
        self.xml = mjcf.write(read(ROOT / "tests" / "scenes" / "kr5_freefall.json"), 0.0)
        self.model = rds.load(bare(ROOT / "models" / "kuka_kr5.toml", folder))
        self.angles = [f"joint{k + 1}.q" for k in range(6)]

    def ours(self, rtol: float, runs: int) -> tuple[np.ndarray, float]:
        """Returns final angles and CPU seconds."""
        begin = cpu_seconds()
        self.model.parameters = {"solver.rtol": rtol, "solver.atol": rtol / 100}
        starts = {f"joint{k + 1}.q0": self.starts[:runs, k] for k in range(6)}
        done = self.model.simulate_many(self.torques[:runs], starts, stop=STEP * ROWS, step=STEP, outputs=self.angles)
        return np.stack([done[name][:, -1] for name in self.angles], axis=1), cpu_seconds() - begin

    def mujoco(self, integrator: str, cuts: int, runs: int) -> tuple[np.ndarray, float]:
        starts = np.hstack([self.starts[:runs], np.zeros((runs, 6))])
        np.savez(self.file, xml=self.xml, starts=starts, torques=self.torques[:runs], step=STEP)
        peer = [self.python, ROOT / "bench" / "peers" / "rollout_peer.py", self.file, integrator, str(cuts)]
        done = subprocess.run(peer, check=True, capture_output=True, text=True)
        return np.load(self.file.with_suffix(".ends.npy")), float(done.stdout)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--runs", type=int, default=10000)
    options = parser.parse_args()
    for line in machine_lines():
        print(f"# {line}")
    with tempfile.TemporaryDirectory() as folder:
        batch = Batch(max(options.runs, SAMPLE), Path(folder))
        reference, _ = batch.ours(1e-12, JUDGED)

        def measured(name: str, simulate) -> tuple[float, float]:
            ends, seconds = simulate(SAMPLE)
            error = float(np.median(np.abs(ends[:JUDGED] - reference).max(axis=1)))
            print(f"kuka_kr5.{name}.error {error:.3g}\nkuka_kr5.{name}.us_per_run {1e6 * seconds / SAMPLE:.4g}", flush=True)
            return error, seconds / SAMPLE

        own = [measured(f"auto.{rtol:g}", lambda runs, rtol=rtol: batch.ours(rtol, runs)) for rtol in TOLERANCES]
        errors, costs = np.log(np.array(own)[::-1]).T
        for method, all_cuts in CUTS.items():
            for cuts in all_cuts:
                error, cost = measured(f"{method}.{cuts}", lambda runs, m=method, c=cuts: batch.mujoco(m, c, runs))
                if errors[0] <= np.log(error) <= errors[-1]:
                    ratio = cost / np.exp(np.interp(np.log(error), errors, costs))
                    print(f"kuka_kr5.{method}.{cuts}.times_slower_at_equal_error {ratio:.3g}", flush=True)
        begin = time.monotonic()
        _, seconds = batch.ours(1e-6, options.runs)
        print(f"kuka_kr5.all_runs_cpu_seconds {seconds:.4g}\nkuka_kr5.all_runs_seconds {time.monotonic() - begin:.4g}")
        batch.model.close()


if __name__ == "__main__":
    main()
