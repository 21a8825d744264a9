"""Prints the figures of the trotting quadruped: `python bench/quadruped.py [METHOD...]` after `make bench` or `make test`.

CPU time of the compiled driver (best of three), right-hand sides per step of 1 ms, depth of the feet, slip while it stands.
"""

from __future__ import annotations

import sys
import tempfile
from pathlib import Path

import numpy as np

ROOT = Path(__file__).resolve().parents[1]
sys.path.insert(0, str(ROOT))

from build_fmu.fmu.build import build
from build_fmu.model.describe import describe
from build_fmu.run.driver import Task, drive, stage_fmu
from build_fmu.run.session import Session
from build_fmu.run.simulate import Settings, simulate

FEET = [f"{end}_{side}_foot" for end in ("front", "hind") for side in ("left", "right")]
STEP, TROT = 1e-3, (0.5, 4.5)  # s


def main(methods: list[str]) -> None:
    """Prints one line per method."""
    with tempfile.TemporaryDirectory() as folder:
        model = Path(folder) / "quadruped.toml"
        (model.parent / "quadruped_trot.csv").write_bytes((ROOT / "models" / "quadruped_trot.csv").read_bytes())
        for method in methods:
            before, _, after = (ROOT / "models" / "quadruped.toml").read_text().rpartition("[solver]\n")
            model.write_text(f'{before}[solver]\nmethod = "{method}"\n{after}')
            fmu = model.with_suffix(".fmu")
            build(describe(model), model, fmu)
            staged = stage_fmu(fmu, Path(folder) / method)
            times = {stop: min(drive(staged, Task(STEP, round(stop / STEP))).seconds for _ in range(3)) for stop in (TROT[0], staged.stop)}
            print(f"{method:6s} {figures(fmu, times, staged.stop)}", flush=True)


def figures(fmu: Path, times: dict[float, float], stop: float) -> str:
    """Returns the figures of one run, given the CPU time up to the start of the trot and up to the end."""
    with Session(fmu) as session:
        run = simulate(session, Settings(stop, STEP))
    counts, time = np.diff(run["solver.rhs_evaluations"]), run.time[1:]
    trot = counts[(time > TROT[0]) & (time < TROT[1])]
    depth = max(run[f"{foot}.depth"].max() for foot in FEET)
    still = (run.time > 0.35) & (run.time < TROT[0])
    slip = max(run[f"{foot}.slip"][still].max() for foot in FEET)
    standing, trotting = TROT[0] / times[TROT[0]], (stop - TROT[0]) / (times[stop] - times[TROT[0]])
    return (
        f"{stop / times[stop]:.1f} x real time (standing {standing:.0f}, trotting {trotting:.1f}); right-hand sides per ms of trot: "
        f"median {np.median(trot):.0f}, 99 % {np.percentile(trot, 99):.0f}, max {trot.max():.0f}; depth {1000 * depth:.2f} mm; "
        f"slip while standing {slip:.1e} m/s; distance {run['trunk[1].q'][-1]:.3f} m"
    )


if __name__ == "__main__":
    main(sys.argv[1:] or ["auto", "bdf", "dirk"])
