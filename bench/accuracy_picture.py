#!/usr/bin/env python3
"""Draws accuracy.png, the work-precision diagram of the KUKA KR5: python bench/accuracy_picture.py -o out/bench"""

from __future__ import annotations

import argparse
import math
import sys
from pathlib import Path

import matplotlib
import numpy as np
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure
from matplotlib.ticker import FuncFormatter, LogLocator, NullFormatter

ROOT = Path(__file__).resolve().parent.parent
sys.path.insert(0, str(ROOT))

from build_fmu.report.machine import processor
from build_fmu.report.make import Wish, make_report
from build_fmu.report.pages import COLOURS, Report, advice, cost
from build_fmu.report.pages import chosen as chosen_run

STEP = 0.01  # s
TARGETS = (1e-3, 1e-6, 1e-9)
INK, PALE = "#22303c", "#5a6872"


def power(number: float) -> str:
    return f"10$^{{{round(math.log10(number))}}}$"


def curve(axes, report: Report, method: str, strong: bool) -> None:
    """Draws one method with changing inputs and labels its end."""
    points = [p for p in report.points if p.method == method and p.good and p.error > 0]
    if not points:
        return
    colour = COLOURS.get(method, "k")
    axes.loglog(
        [p.error for p in points],
        [p.us_per_ms for p in points],
        color=colour,
        lw=3 if strong else 1.2,
        marker="o",
        ms=5 if strong else 3,
        alpha=1 if strong else 0.75,
    )
    last = min(points, key=lambda p: p.error)
    axes.annotate(
        method,
        (last.error, last.us_per_ms),
        (6, 0),
        textcoords="offset points",
        va="center",
        color=colour,
        fontsize=12 if strong else 9,
        weight="bold" if strong else "normal",
    )


def always_alike(report: Report, method: str, other: str) -> bool:
    """Whether two methods have the same errors, as `auto` and the method that it selects."""
    errors = [{f"{p.error:.1e}" for p in report.points if p.method == name and p.good} for name in (method, other)]
    return len(errors[0] & errors[1]) > len(errors[0]) / 2


def draw(report: Report, file: Path) -> None:
    matplotlib.rcParams.update({"font.size": 9, "axes.axisbelow": True})
    figure = Figure(figsize=(8.6, 4.9), dpi=130, layout="constrained")
    FigureCanvasAgg(figure)
    axes = figure.subplots()
    methods = list(dict.fromkeys(p.method for p in report.points))
    chosen = {target: chosen_run(report, target, True) for target in TARGETS}
    winner = next((p.method for p in chosen.values() if p), methods[0])
    for method in methods:
        if method == winner or not always_alike(report, method, winner):
            curve(axes, report, method, method == winner)
    axes.margins(x=0.08)
    axes.invert_xaxis()
    bottom = axes.get_ylim()[0] / 2.2
    for target, point in chosen.items():
        if point:
            axes.plot([target, target], [bottom, point.us_per_ms], color=PALE, lw=1, ls=":")
            axes.annotate(
                f"{power(target)} rad\n{cost(point.us_per_ms)} µs",
                (target, point.us_per_ms),
                (0, -16),
                textcoords="offset points",
                ha="center",
                va="top",
                fontsize=11,
                color=INK,
                bbox={"facecolor": "white", "edgecolor": "none", "pad": 1.5},
            )
    axes.set_ylim(bottom, None)
    first, last = chosen[TARGETS[0]], chosen[TARGETS[-1]]
    if first and last:
        figure.suptitle(
            f"KUKA KR5: errors from 1e-3 to 1e-9 rad for {last.us_per_ms / first.us_per_ms:.1f} times the CPU time",
            x=0.01,
            ha="left",
            fontsize=13,
            weight="bold",
            color=INK,
        )
    axes.set_title(
        f"six joints, torques changing every {1e3 * report.step:g} ms; {processor()}, one thread", loc="left", fontsize=9, color=PALE
    )
    axes.set_xlabel("maximum joint error in 1 s of free fall [rad], more accurate to the right")
    axes.set_ylabel("CPU time per 1 ms of motion [µs]")
    axes.yaxis.set_major_formatter(FuncFormatter(lambda y, _: f"{y:g}"))
    axes.yaxis.set_major_locator(LogLocator(10, subs=(1, 2, 5)))
    axes.yaxis.set_minor_formatter(NullFormatter())
    axes.xaxis.set_major_locator(LogLocator(10, numticks=20))
    real_time = axes.secondary_yaxis(
        "right", functions=(lambda us: 1000 / np.maximum(us, 1e-9), lambda factor: 1000 / np.maximum(factor, 1e-9))
    )
    real_time.set_ylabel("times faster than real time")
    real_time.yaxis.set_major_formatter(FuncFormatter(lambda y, _: f"{y:,.0f}"))
    axes.grid(color="#e3e7ea", lw=0.8)
    for side in ("top", "right"):
        axes.spines[side].set_visible(False)
    figure.savefig(file, metadata={"Software": None})


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("-o", "--output", type=Path, default=ROOT / "out" / "bench")
    parser.add_argument("--quick", action="store_true", help="run each combination once")
    options = parser.parse_args()
    options.output.mkdir(parents=True, exist_ok=True)
    wish = Wish(steps=[STEP], changing=(True,), seconds=30 if options.quick else 120, repeats=1 if options.quick else 20)
    report = make_report(ROOT / "models" / "kuka_kr5.toml", wish)
    print("\n".join(advice(report)))
    draw(report, options.output / "accuracy.png")


if __name__ == "__main__":
    main()
