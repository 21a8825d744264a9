"""The sweep as a CSV, as a Markdown page with advice, and as a work-precision picture."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from build_fmu.draw.figure import INK, plain_axes, save, titled_figure
from build_fmu.files import whole_file
from build_fmu.report.advise import best, curves, seconds_for_all
from build_fmu.report.machine import machine_lines
from build_fmu.report.reference import Reference
from build_fmu.report.sweep import Point

TARGETS = (1e-3, 1e-6, 1e-9)
COLOURS = {"erk": "#1f77b4", "adams": "#d95f02", "bdf": "#7570b3", "dirk": "#1b9e77", "auto": "#444444"}
MARKERS = {"erk": "o", "adams": "s", "bdf": "^", "dirk": "D", "auto": "x"}


@dataclass(frozen=True)
class Report:
    """All that the pages show; times in s."""

    name: str
    unit: str
    stop: float
    step: float  # the usual communication step
    inputs: str
    reference: Reference
    points: Sequence[Point]
    seconds: float
    note: str = ""  # how the library came to be
    tolerances: Sequence[float] = ()  # that each curve was to have
    busy: str = ""  # a sentence, if other programs ran

    @property
    def steps(self) -> list[float]:
        """Returns the communication steps, shortest first."""
        return sorted({p.step for p in self.points})


def duration(seconds: float) -> str:
    """Returns a time with a unit that fits."""
    return f"{seconds:g} s" if seconds >= 0.1 else f"{seconds * 1e3:g} ms" if seconds >= 1e-4 else f"{seconds * 1e6:g} µs"


def cost(us: float) -> str:
    """Returns a cost with two or three digits."""
    return f"{us:.0f}" if us >= 99.5 else f"{us:.1f}" if us >= 9.95 else f"{us:.2g}"


def advice(report: Report) -> list[str]:
    """Returns one line a target: what to take, and what it costs; then what is to be known before it is taken."""
    all_curves = curves(report.points, report.tolerances)
    unfinished = [curve for curve in all_curves if curve.missing]
    lines = []
    for target in TARGETS:
        changing, held = (chosen(report, target, flag) for flag in (True, False))
        first = changing or held
        if target < report.reference.uncertainty:
            line = f"no advice: the reference is known to {report.reference.uncertainty:.1g} {report.unit} only"
        elif first:
            line = f"take {_choice(first)} (step {duration(report.step)}, inputs {'that change at each step' if changing else 'held'}"
            line += f"; {_choice(held)} where they are held)" if changing and held else ")"
        elif any(math.isclose(c.points[0].step, report.step) for c in unfinished):
            line = "no advice: curves that could answer are unfinished"
        else:
            line = "no run of this sweep is good enough"
        lines.append(f"for {_power(target)} {report.unit} {line}")
    if unfinished:
        lines.append(f"{len(unfinished)} of {len(all_curves)} curves are unfinished, their time was up; all of them need about "
                     f"--seconds {seconds_for_all(all_curves, report.stop):.0f}")
    return lines + [report.busy] * bool(report.busy)


def chosen(report: Report, target: float, changing: bool) -> Point | None:
    """Returns the run that the curves of the usual step carry as advice."""
    points = [p for p in report.points if p.changing == changing and math.isclose(p.step, report.step)]
    return best(curves(points, report.tolerances), target)


def _choice(point: Point) -> str:
    return f"{point.method} at rtol {_power(point.rtol)}: {cost(point.us_per_ms)} µs a ms"


def _power(number: float) -> str:
    return f"{number:.0e}".replace("e-0", "e-")


def write_csv(path: Path, report: Report) -> None:
    """Writes one row a run."""
    head = "method,rtol,step_s,inputs,status,error,us_per_ms,rhs_per_ms,steps,rejected,message"
    rows = [head]
    for p in report.points:
        health = p.outcome.health
        message = p.outcome.message.replace('"', "'")
        rows.append(f"{p.method},{p.rtol:g},{p.step:.12g},{'changing' if p.changing else 'held'},{p.outcome.status},{p.error:.6g},{p.us_per_ms:.6g},"
                    f"{p.rhs_per_ms:.6g},{health.get('solver.steps', '')},{health.get('solver.rejected', '')},\"{message}\"")
    whole_file(path, lambda temporary: temporary.write_text("\n".join(rows) + "\n", encoding="utf-8"))


def write_page(path: Path, report: Report, picture: str) -> None:
    """Writes the Markdown page."""
    whole_file(path, lambda temporary: temporary.write_text("\n".join(page_lines(report, picture)) + "\n", encoding="utf-8"))


def page_lines(report: Report, picture: str) -> list[str]:
    """Returns the lines of the Markdown page."""
    lines = [f"# {report.name}: what accuracy costs", "", *(f"* {line}" for line in advice(report)), "", method(report), "",
             f"![error against run time]({picture})", ""]
    for changing in (False, True):
        for step in report.steps:
            points = [p for p in report.points if p.changing == changing and p.step == step]
            if points:
                lines += [f"## Step {duration(step)}, inputs {'change' if changing else 'held'}", "", *_table(points, report.unit), ""]
    lines += [f"* {report.note}"] if report.note else []
    lines += [*(f"* {line}" for line in machine_lines()), f"* {len(report.points)} runs in {report.seconds:.0f} s"]
    return lines


def method(report: Report) -> str:
    """Returns how the figures were measured, in Markdown."""
    reference = report.reference
    known = f"known to {reference.uncertainty:.1g} {report.unit}" if reference.uncertainty else "taken as exact"
    return (f"The motion lasts {duration(report.stop)}, {report.inputs}. The error is the largest of any joint at any row of output, against "
            f"{reference.origin}, {known}. A cost is the time of `fmi2SetReal` and `fmi2DoStep` for one millisecond of motion, median of repeated "
            "runs in a compiled master. *Inputs change* means that every force or torque is set to another number at each communication step (by "
            "1e-100: the motion stays the same, and a method that lives on its history loses it).")


def _table(points: Sequence[Point], unit: str) -> list[str]:
    lines = [f"| method | rtol | error [{unit}] | µs a ms | right-hand sides a ms | |", "| --- | --- | ---: | ---: | ---: | --- |"]
    for p in points:
        note = "" if p.outcome.status == "ok" else f"{p.outcome.status}: {p.outcome.message}".replace("|", "\\|")
        number = [f"{p.error:.1e}", cost(p.us_per_ms), f"{p.rhs_per_ms:.3g}"] if p.good else ["", "", ""]
        lines.append(f"| {p.method} | {p.rtol:.0e} | {' | '.join(number)} | {note} |")
    return lines


def write_pictures(paths: Sequence[Path], report: Report) -> None:
    """Draws error against cost, a panel a communication step, into .svg and .png files."""
    steps = report.steps
    with titled_figure(f"{report.name}: what accuracy costs", 1.2 + 4.4 * len(steps), 4.6) as figure:
        all_axes = figure.subplots(1, len(steps), sharex=True, sharey=True, squeeze=False)[0]
        for axes, step in zip(all_axes, steps, strict=True):
            draw_panel(axes, [p for p in report.points if p.step == step], report)
            axes.set_title(f"communication step {duration(step)}", loc="left", fontsize=10, color=INK)
            axes.set_xlabel(f"largest error in {duration(report.stop)} of motion [{report.unit}]")
        all_axes[0].set_ylabel("computing time for 1 ms of motion [µs]")
        all_axes[-1].legend(loc="upper left", bbox_to_anchor=(1.0, 1.02), frameon=False, fontsize=8.5)
        save(figure, paths)


def draw_panel(axes, points: Sequence[Point], report: Report) -> None:
    """Draws the curves of one communication step; accurate is right, cheap is low."""
    for changing in (False, True):
        for method in dict.fromkeys(p.method for p in points):
            curve = [p for p in points if p.method == method and p.changing == changing and p.good and p.error > 0]
            if not curve:
                continue
            axes.loglog([p.error for p in curve], [p.us_per_ms for p in curve], "--" if changing else "-", color=COLOURS.get(method, "k"),
                        marker=MARKERS.get(method, "o"), ms=4.5, lw=1.4, mfc="white" if changing else None,
                        label=f"{method}, inputs {'change' if changing else 'held'}")
    from matplotlib.ticker import FuncFormatter, LogLocator

    if not axes.xaxis_inverted():
        axes.invert_xaxis()
    axes.yaxis.set_major_formatter(FuncFormatter(lambda y, _: f"{y:g}"))
    axes.yaxis.set_major_locator(LogLocator(10, subs=(1, 2, 5)))
    axes.yaxis.set_minor_formatter(FuncFormatter(lambda *_: ""))
    low = report.reference.uncertainty
    if low > 0 and math.isfinite(low):
        axes.axvline(low, color="#999999", lw=0.8, ls=":")
    plain_axes(axes)
