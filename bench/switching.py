#!/usr/bin/env python3
"""Torques that switch at 1 kHz: right-hand sides per second of motion and error of `erk`, one line per scene.

    python bench/switching.py                      KR5, gripper and four-bar; 1 ms and 0.5 ms steps
    python bench/switching.py --method auto adams  other methods

Each drive applies plus or minus the torque that holds the outboard mass at 5 cm from the axis, with alternating sign in each communication
step: 1000 or 2000 switches per second, at exact times. The error is the maximum of the positions over 1 s, against `erk` at rtol 1e-13
with the same torques. The loosest tolerance from 1e-3 to 1e-9 with an error of at most 1e-5 is used. Needs the program `stepping`
(`sh scripts/build.sh bench stepping`).
"""

import argparse
from pathlib import Path

import built
from stiff import stepping

ROOT = Path(__file__).resolve().parent.parent
SCENES = ("kuka_kr5", "gripper", "four_bar")
TOLERANCES = ("1e-3", "1e-4", "1e-5", "1e-6", "1e-7", "1e-8", "1e-9")
ERROR = 1e-5  # rad


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--method", nargs="+", default=["erk"])
    parser.add_argument("--build", help="build folder (build/bench or build/release)")
    options = parser.parse_args()
    program = built.program("stepping", options.build)
    for scene in SCENES:
        for step in (1e-3, 5e-4):
            model = ROOT / "models" / f"{scene}.toml"
            rows = stepping(program, model, method=options.method, rtol=TOLERANCES, step=step, end=1, drive="square")
            for method in options.method:
                name = f"{scene}.{method}_{1 / step:.0f}_switches_a_second"
                good = [row for row in rows if row["method"] == method and row["error"] <= ERROR]
                if good:
                    print(
                        f"{name} {good[0]['work']:.0f} right-hand sides, error {good[0]['error']:.1e} at rtol {good[0]['rtol']}", flush=True
                    )
                else:
                    print(f"{name} not reached", flush=True)


if __name__ == "__main__":
    main()
