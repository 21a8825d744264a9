#!/usr/bin/env python3
"""Error against CPU time of this project's FMU and of other simulators on the scenes of tests/scenes.

    python bench/peers/work_precision.py -o out/bench                 all scenes
    python bench/peers/work_precision.py -f double -r 3 -o FOLDER     selected scenes, three rounds

The error is the maximum difference of a joint position from the 16-digit reference over the output times of the scene. The time is the
CPU time of the steps only (without loading and start values), median of all rounds. Each round runs every method of every simulator
once, in random order, so that other load of the machine affects all of them. Short runs, whose times scatter most, have more rounds. Writes
peers.csv, peers.md, losses.md, peers.txt (lines `scene.metric value`) and one plot per scene.
"""

from __future__ import annotations

import argparse
import csv
import random
import re
import statistics
import sys
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

sys.path.insert(0, str(Path(__file__).resolve().parent))
from peers import Curve, Peers, command_line, curves
from scenes import ROOT, Scene, all_scenes, referred
from summary import SMALLEST, draw, lines, losses, table
from worker import LIMIT, Gone

SHORT, MORE = 0.02, 3  # s: below, a run has so many times the rounds
ROUNDING = 1e-7  # rad: below, a finer run without improvement ends the curve


@dataclass
class Point:
    curve: Curve
    value: float
    error: float
    seconds: list[float] = field(default_factory=list)

    @property
    def median(self) -> float:
        return statistics.median(self.seconds)


def error_of(scene: Scene, rows: np.ndarray, _curve: Curve | None = None) -> float:
    """Maximum position error; missing rows are NaN."""
    difference = np.abs(rows - np.array(scene.reference))
    return float(np.nanmax(difference)) if np.isfinite(difference).any() else float("inf")


def limit_of(curve: Curve) -> float:
    """Returns the time limit for the first answer, in s: heyoka compiles a minute for seven joints."""
    return 300.0 if curve.peer == "heyoka" else LIMIT


def first_round(scene, curve: Curve, worker, failures: list[str], longest: float, judge) -> list[Point]:
    """Runs a curve from coarse to fine until its runs take too long or no longer improve."""
    points, worse = [], 0
    for value in curve.values:
        answer = worker.ask(curve.method, value, limit_of(curve))
        if answer.rows is None:
            failures.append(f"{curve.label}, {value:g}: {answer.failure}")
            continue
        error = judge(scene, answer.rows, curve)
        if np.isfinite(error) and error < 10:
            best = min((p.error for p in points), default=1.0)
            worse = worse + 1 if best < ROUNDING and error > 0.7 * best else 0
            points.append(Point(curve, value, error, [answer.seconds]))
        if answer.seconds > longest or worse >= 2 or error < SMALLEST:
            break
    return points


def compare(
    scene, peers: Peers, chosen: list[Curve], rounds: int, longest: float, seed: int, judge=error_of
) -> tuple[list[Point], list[str]]:
    """Runs the chosen curves; `judge` returns the error of a result."""
    failures: list[str] = []
    points: list[Point] = []
    workers = {peer: peers.start(peer, scene) for peer in {curve.worker for curve in chosen}}
    try:
        for curve in chosen:
            print(f"  {curve.label}", flush=True)
            try:
                points += first_round(scene, curve, workers[curve.worker], failures, longest, judge)
            except Gone:
                failures.append(f"{curve.label}: its process ended, see {workers[curve.worker].log.name}")
                workers[curve.worker] = peers.start(curve.worker, scene)
        order = random.Random(seed)
        short = [point for point in points if point.seconds[0] < SHORT]
        for k in range(1, rounds * MORE if rounds > 1 else 1):
            runs = points if k < rounds else short
            print(f"  round {k + 1}, {len(runs)} runs", flush=True)
            for point in order.sample(runs, len(runs)):
                try:
                    point.seconds.append(workers[point.curve.worker].ask(point.curve.method, point.value).seconds)
                except Gone:
                    failures.append(f"{point.curve.label}, {point.value:g}: its process ended")
                    workers[point.curve.worker] = peers.start(point.curve.worker, scene)
    finally:
        for worker in workers.values():
            worker.close()
    return points, failures


def medians(rounds: int) -> str:
    """Describes the times of `compare`."""
    return f"medians of {rounds} rounds" + (f", of {MORE * rounds} for runs shorter than {1000 * SHORT:g} ms" if rounds > 1 else "")


def curves_command_line(doc: str) -> argparse.ArgumentParser:
    """Returns a parser with the options of a comparison of curves."""
    parser = command_line(doc)
    parser.add_argument("-f", "--filter", default=".", help="regular expression on scenes")
    parser.add_argument("-r", "--rounds", type=int, default=5)
    parser.add_argument("--longest", type=float, default=0.5, help="maximum CPU time of a run, s; slower runs end the curve")
    return parser


def main() -> None:
    parser = curves_command_line(__doc__)
    parser.add_argument("--seed", type=int, default=1)
    options = parser.parse_args()
    options.output.mkdir(parents=True, exist_ok=True)
    peers = Peers(options.programs, options.python, ROOT / "build" / "peers_work")
    absent = peers.missing()
    for peer, reason in absent.items():
        print(f"{peer} is skipped: {reason}")
    records, text, lost, figures = [], [], [], []
    for scene in map(referred, all_scenes()):
        if not re.search(options.filter, scene.name):
            continue
        print(f"{scene.name}: {scene.title}", flush=True)
        chosen = [curve for curve in curves(scene) if curve.peer not in absent]
        points, failures = compare(scene, peers, chosen, options.rounds, options.longest, options.seed)
        for point in points:
            records.append([scene.name, point.curve.label, f"{point.value:g}", f"{point.error:.4g}", f"{point.median / scene.end:.6g}"])
        draw(scene, points, options.output)
        text.append(table(scene, points))
        lost.append(losses(scene, points))
        figures += lines(scene, points)
        (options.output / f"peers_{scene.name}_failures.txt").write_text("".join(f"{line}\n" for line in failures))
    with (options.output / "peers.csv").open("w", newline="") as file:
        writer = csv.writer(file)
        writer.writerow(["scene", "method", "tolerance or steps per output step", "error, rad", "CPU time in s per simulated second"])
        writer.writerows(records)
    versions = ", ".join(f"{peer} {version}" for peer, version in peers.versions().items() if peer not in absent)
    (options.output / "peers.md").write_text(f"{versions}; {medians(options.rounds)}.\n\n" + "\n".join(text))
    (options.output / "losses.md").write_text("".join(lost))
    (options.output / "peers.txt").write_text("".join(f"{name} {value:.4g}\n" for name, value in figures))
    print(f"wrote {options.output}/peers.csv, peers.md and the plots")


if __name__ == "__main__":
    main()
