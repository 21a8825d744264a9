#!/usr/bin/env python3
"""Stiff scenes: right-hand sides of our implicit methods against CVODE BDF with its own difference Jacobian.

    python bench/stiff.py                    five scenes at rtol 1e-6
    python bench/stiff.py -f governor        scenes whose name matches the regular expression

All right-hand sides are counted, including those of difference Jacobians. An exact Jacobian counts as its CPU time in right-hand
sides, measured in the same process. CVODE runs at rtol 1e-3 to 1e-11; its figure for an error is interpolated on a straight line
through these runs (logarithms of both). Errors: maximum of the positions over all outputs, against `dirk` at 1e-11. Prints
lines `scene.metric value`, geometric means of three runs around rtol (single runs scatter). Needs the program `stepping`
(`sh scripts/build.sh bench stepping`).
"""

import argparse
import math
import re
import subprocess
from pathlib import Path

import built

ROOT = Path(__file__).resolve().parent.parent
SCENES = {"stiff_arm": 5, "governor": 10, "stiff_strut": 2, "gripper_pd": 1.5, "top": 1}  # s
AROUND = (2, 1, 0.5)  # times rtol: single runs scatter
OURS = ("bdf", "dirk", "auto")
TOLERANCES = [f"1e{exponent / 2:g}" if exponent % 2 == 0 else f"3e{(exponent - 1) // 2}" for exponent in range(-6, -23, -1)]


def stepping(program, model, **options):
    """Rows of the program's table as dictionaries; runs that stopped are omitted."""
    arguments = [f"{key}={','.join(map(str, value)) if isinstance(value, (list, tuple)) else value}" for key, value in options.items()]
    lines = subprocess.run([program, model, *arguments], stdout=subprocess.PIPE, text=True, check=True).stdout.splitlines()
    rows = []
    for line in lines:
        if line.startswith("#") or "#" in line:
            continue
        method, rtol, evaluations, jacobians, work, _, error = line.split()[:7]
        rows.append(
            {
                "method": method,
                "rtol": rtol,
                "evaluations": int(evaluations),
                "jacobians": int(jacobians),
                "work": float(work),
                "error": float(error),
            }
        )
    return rows


def work_for(rows, error):
    """Effort of a method for an error, from a straight line through its runs (logarithms of both)."""
    x = [math.log(row["error"]) for row in rows]
    y = [math.log(row["work"]) for row in rows]
    mean_x, mean_y = sum(x) / len(x), sum(y) / len(y)
    slope = sum((a - mean_x) * (b - mean_y) for a, b in zip(x, y, strict=True)) / sum((a - mean_x) ** 2 for a in x)
    return math.exp(mean_y + slope * (math.log(error) - mean_x))


def geometric_mean(values):
    return math.exp(sum(map(math.log, values)) / len(values))


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("-f", "--filter", default=".", help="regular expression on the scene")
    parser.add_argument("--rtol", type=float, default=1e-6)
    parser.add_argument("--build", help="build folder (build/bench or build/release)")
    options = parser.parse_args()
    program = built.program("stepping", options.build)
    for scene, end in SCENES.items():
        if not re.search(options.filter, scene):
            continue
        common = {"model": ROOT / "models" / f"{scene}.toml", "step": 0.01, "end": end, "reference": "dirk", "reference_rtol": "1e-11"}
        differences = stepping(program, method="bdf-dq", rtol=TOLERANCES, **common)
        rows = stepping(program, method=OURS, rtol=[options.rtol * factor for factor in AROUND], **common)
        for method in OURS:
            own = [row for row in rows if row["method"] == method]
            for metric in ("error", "evaluations", "jacobians", "work"):
                print(f"{scene}.{method}_{metric} {geometric_mean([max(row[metric], 1e-300) for row in own]):.3g}")
            ratios = [row["work"] / work_for(differences, row["error"]) for row in own]
            print(f"{scene}.{method}_of_difference_bdf {geometric_mean(ratios):.2f}", flush=True)


if __name__ == "__main__":
    main()
