#!/usr/bin/env python3
"""Speed-up of a library for one model: forward dynamics as straight-line code and by recursion, and the specialised library of the KR5.

    python bench/straight_line.py                 after `sh scripts/build.sh bench benchmarks` and `sh scripts/build.sh release`
    python bench/straight_line.py --no-library    without the KR5's library (one minute)

Prints lines `scene.metric value`; times in ns are medians of shuffled repetitions in one process.
"""

from __future__ import annotations

import argparse
import statistics
import sys
from pathlib import Path

import built
from run import run

ROOT = Path(__file__).resolve().parent.parent
sys.path.insert(0, str(ROOT))

from build_fmu import native
from build_fmu.fmu.specialise import specialised_library
from build_fmu.model.describe import describe
from build_fmu.report.machine import machine_lines


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("-r", "--repetitions", type=int, default=15)
    parser.add_argument("-t", "--min-time", type=float, default=0.02, help="minimum time per repetition, s")
    parser.add_argument("--no-library", action="store_true")
    options = parser.parse_args()
    program = built.program("straight_line_bench")
    print(f"# {'; '.join(machine_lines())}.")
    times, report = run(program, ".", options.repetitions, options.min_time)
    for scene, metrics in sorted(times.items(), key=lambda item: report["operations"][item[0]]):
        print(f"{scene}.straight_line_operations {report['operations'][scene]:.0f}")
        print(f"{scene}.longest_straight_line {report['longest'][scene]:.0f}")
        for metric, values in sorted(metrics.items()):
            print(f"{scene}.{metric}_ns {statistics.median(values):.4g}", flush=True)
    if options.no_library:
        return
    print("building the KR5's library", file=sys.stderr, flush=True)
    model = ROOT / "models" / "kuka_kr5.toml"
    with specialised_library(describe(model), model) as special:
        print(f"kuka_kr5.specialised_library_bytes {special.library.stat().st_size}")
    print(f"kuka_kr5.general_library_bytes {native.library().stat().st_size}")
    if special.faster:
        print(f"kuka_kr5.specialised_run_times_faster {special.faster:.3g}")


if __name__ == "__main__":
    main()
