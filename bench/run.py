#!/usr/bin/env python3
"""Runs the benchmarks and prints lines `scene.metric value` under a header with machine, compiler, flags and commit.

    python bench/run.py                     all scenes
    python bench/run.py -f kuka_kr5         scenes whose name matches the regular expression
    python bench/run.py --build build/mine  another build folder

Times in ns per call, medians over repetitions of one run. The repetitions of all scenes are shuffled, so that other load of the
machine affects all of them. Ratios compare figures of the same run. Nothing is stored.
"""

import argparse
import json
import os
import platform
import re
import statistics
import subprocess
import sys
from pathlib import Path

import built

ROOT = Path(__file__).resolve().parent.parent


def run(program, pattern, repetitions, min_time):
    """{scene: {metric: [ns, ...]}} and Google Benchmark's context, which it writes to standard output as JSON."""
    command = [
        program,
        f"--benchmark_filter={pattern}",
        f"--benchmark_repetitions={repetitions}",
        f"--benchmark_min_time={min_time}",
        "--benchmark_enable_random_interleaving=true",
        "--benchmark_format=json",
    ]
    finished = subprocess.run(command, capture_output=True, text=True)
    if finished.returncode != 0:
        sys.exit(finished.stderr)
    if not finished.stdout.strip():
        sys.exit(f"no scene matches {pattern}")
    report = json.loads(finished.stdout)
    times = {}
    for entry in report["benchmarks"]:
        if entry["run_type"] == "iteration":
            scene, metric = entry["run_name"].split("/")[:2]
            times.setdefault(scene, {}).setdefault(metric, []).append(entry["cpu_time"])
            for counter in {"operations", "longest"} & entry.keys():
                report["context"].setdefault(counter, {})[scene] = entry[counter]
    return times, report["context"]


def in_reading_order(item):
    """Sort key with numbers: chain_6 before chain_30."""
    return [int(part) if part.isdigit() else part for part in re.split(r"(\d+)", item[0])]


def figures(times):
    """Lines (scene.metric, value): medians, and ratios within the run."""
    median = {s: {m: statistics.median(v) for m, v in metrics.items()} for s, metrics in times.items()}
    for scene, metrics in sorted(median.items(), key=in_reading_order):
        for metric, value in sorted(metrics.items()):
            yield f"{scene}.{metric}_ns", value
        peers = [value for metric, value in metrics.items() if metric.startswith("pinocchio_aba")]
        if peers and "forward_dynamics" in metrics:
            yield f"{scene}.forward_dynamics_times_faster_than_pinocchio", min(peers) / metrics["forward_dynamics"]
        if "pinocchio_rnea" in metrics and "inverse_dynamics" in metrics:
            yield f"{scene}.inverse_dynamics_times_faster_than_pinocchio", (metrics["pinocchio_rnea"] / metrics["inverse_dynamics"])
    growth = [(f"{kind}_chain", "forward_dynamics", 10, 1000) for kind in ("right_angle", "any_angle")]
    growth += [("four_bar_chain", "right_hand_side", 10, 100), ("overlapping_loops", "right_hand_side", 10, 100)]
    for family, metric, small, large in growth:
        cost = [median.get(f"{family}_{n}", {}).get(metric) for n in (small, large)]
        if all(cost):
            yield f"{family}.{metric}_cost_each_at_{large}_against_{small}", cost[1] / large / (cost[0] / small)


def commit():
    def git(*arguments):
        return subprocess.run(("git", "-C", ROOT, *arguments), capture_output=True, text=True).stdout.strip()

    changed = git("status", "--porcelain", "--untracked-files=no")
    return (git("rev-parse", "--short", "HEAD") or "none") + (" with changes" if changed else "")


def processor():
    try:
        lines = Path("/proc/cpuinfo").read_text().splitlines()
        return next(line.split(":", 1)[1].strip() for line in lines if line.startswith("model name"))
    except (OSError, StopIteration):
        return platform.processor() or platform.machine()


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("-f", "--filter", default=".", help="regular expression on scene/metric")
    parser.add_argument("-r", "--repetitions", type=int, default=15)
    parser.add_argument("-t", "--min-time", type=float, default=0.02, help="minimum time per repetition, s")
    parser.add_argument("--build", help="build folder (build/bench or build/release)")
    options = parser.parse_args()
    times, context = run(built.program("dynamics_bench", options.build), options.filter, options.repetitions, options.min_time)
    print(f"# machine {processor()}, {os.cpu_count()} processors, load {os.getloadavg()[0]:.1f}")
    print(f"# system {platform.system()} {platform.release()}")
    print(f"# compiler {context.get('compiler', '?')}, flags {context.get('flags', '?')}")
    if "pinocchio" in context:
        print(f"# Pinocchio {context['pinocchio'].strip()}, -march=native, the faster of its LOCAL and WORLD conventions")
    print(f"# commit {commit()}, median of {options.repetitions} repetitions")
    for name, value in figures(times):
        print(f"{name} {value:.4g}")


if __name__ == "__main__":
    main()
