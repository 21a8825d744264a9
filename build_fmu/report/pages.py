"""The report as a CSV, as a Markdown page with recommendations, and as work–precision diagrams."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from build_fmu.draw.figure import INK, plain_axes, save, titled_figure
from build_fmu.files import whole_file
from build_fmu.report.advise import best, curves, seconds_for_all
from build_fmu.report.machine import TIME, machine_lines
from build_fmu.report.reference import Reference
from build_fmu.report.sweep import Point

TARGETS = (1e-3, 1e-6, 1e-9)
COLUMNS = ("method", "rtol", "step_s", "inputs", "status", "error", "us_per_ms", "rhs_per_ms", "steps", "rejected", "message")
COLOURS = {"erk": "#1f77b4", "adams": "#d95f02", "bdf": "#7570b3", "dirk": "#1b9e77", "exponential": "#a6761d", "auto": "#444444"}
MARKERS = {"erk": "o", "adams": "s", "bdf": "^", "dirk": "D", "exponential": "v", "auto": "x"}


@dataclass(frozen=True)
class Report:
    """The content of the pages; times in s."""

    name: str
    unit: str
    stop: float
    step: float  # the usual communication step size
    inputs: str
    reference: Reference
    points: Sequence[Point]
    seconds: float
    note: str = ""  # on the library
    tolerances: Sequence[float] = ()  # requested for each curve
    busy: str = ""  # a sentence if other programs were running
    coverage: str = ""  # a sentence if the reference lacks output rows

    @property
    def steps(self) -> list[float]:
        """Returns the communication step sizes in ascending order."""
        return sorted({p.step for p in self.points})

    @property
    def sections(self) -> list[tuple[float, str, list[Point]]]:
        """Returns step size, kind of inputs and runs of each table."""
        found = []
        for changing, inputs in ((False, "constant inputs"), (True, "changing inputs")):
            for step in self.steps:
                points = [p for p in self.points if p.changing == changing and p.step == step]
                if points:
                    found.append((step, inputs, points))
        return found


def duration(seconds: float) -> str:
    """Returns a time with a suitable unit."""
    return f"{seconds:g} s" if seconds >= 0.1 else f"{seconds * 1e3:g} ms" if seconds >= 1e-4 else f"{seconds * 1e6:g} µs"


def cost(us: float) -> str:
    """Returns a CPU time with two or three digits."""
    return f"{us:.0f}" if us >= 99.5 else f"{us:.1f}" if us >= 9.95 else f"{us:.2g}"


def advice(report: Report) -> list[str]:
    """Returns one recommendation per target, then remarks on unfinished curves, the reference and the load of the machine."""
    all_curves = curves(report.points, report.tolerances)
    unfinished = [curve for curve in all_curves if curve.missing]
    lines = []
    for target in TARGETS:
        changing, held = (chosen(report, target, flag) for flag in (True, False))
        first = changing or held
        if target < report.reference.uncertainty:
            line = f"no recommendation, because the uncertainty of the reference is {report.reference.uncertainty:.1g} {report.unit}"
        elif first:
            line = f"{_choice(first)} (step size {duration(report.step)}, {'changing' if changing else 'constant'} inputs"
            line += f"; with constant inputs {_choice(held)})" if changing and held else ")"
        elif any(math.isclose(c.points[0].step, report.step) for c in unfinished):
            line = "no recommendation, because unfinished curves could contain a cheaper run"
        else:
            line = f"no run with a step size of {duration(report.step)} meets the target"
        lines.append(f"for {_power(target)} {report.unit}: {line}")
    if unfinished:
        lines.append(
            f"{len(unfinished)} of {len(all_curves)} curves reached the time limit; all of them need about "
            f"--seconds {seconds_for_all(all_curves, report.stop):.0f}"
        )
    return lines + [sentence for sentence in (report.coverage, report.busy) if sentence]


def chosen(report: Report, target: float, changing: bool) -> Point | None:
    """Returns the recommended run at the usual step size."""
    points = [p for p in report.points if p.changing == changing and math.isclose(p.step, report.step)]
    return best(curves(points, report.tolerances), target)


def _choice(point: Point) -> str:
    return f"{point.method} at rtol {_power(point.rtol)}, {cost(point.us_per_ms)} µs per ms"


def _power(number: float) -> str:
    return f"{number:.0e}".replace("e-0", "e-")


def write_csv(path: Path, report: Report) -> None:
    """Writes one row per run."""
    shapes = {"rtol": "g", "step_s": ".12g", "error": ".6g", "us_per_ms": ".6g", "rhs_per_ms": ".6g"}
    rows = [",".join(COLUMNS)]
    for row in run_rows(report):
        cells = [format(value, shapes.get(key, "")) for key, value in row.items()]
        rows.append(",".join([*cells[:-1], f'"{cells[-1]}"']))
    whole_file(path, lambda temporary: temporary.write_text("\n".join(rows) + "\n", encoding="utf-8"))


def run_rows(report: Report) -> list[dict[str, object]]:
    """Returns the columns of each run."""
    rows = []
    for p in report.points:
        health = p.outcome.health
        counts = (health.get("solver.steps", ""), health.get("solver.rejected", ""))
        message = p.outcome.message.replace('"', "'")
        inputs = "changing" if p.changing else "held"
        values = (p.method, p.rtol, p.step, inputs, p.outcome.status, p.error, p.us_per_ms, p.rhs_per_ms, *counts, message)
        rows.append(dict(zip(COLUMNS, values, strict=True)))
    return rows


def write_page(path: Path, report: Report, picture: str) -> None:
    """Writes the Markdown page."""
    whole_file(path, lambda temporary: temporary.write_text("\n".join(page_lines(report, picture)) + "\n", encoding="utf-8"))


def page_lines(report: Report, picture: str) -> list[str]:
    """Returns the lines of the Markdown page."""
    lines = [
        f"# {report.name}: accuracy and {TIME}",
        "",
        *(f"* {line}" for line in advice(report)),
        "",
        method(report),
        "",
        f"![work–precision diagram]({picture})",
        "",
    ]
    for step, inputs, points in report.sections:
        lines += [f"## Step size {duration(step)}, {inputs}", "", *_table(points, report.unit), ""]
    lines += [f"* {report.note}"] if report.note else []
    lines += [*(f"* {line}" for line in machine_lines()), f"* {len(report.points)} runs in {report.seconds:.0f} s"]
    return lines


def method(report: Report) -> str:
    """Returns the method of measurement, in Markdown."""
    reference = report.reference
    known = f"uncertainty {reference.uncertainty:.1g} {report.unit}" if reference.uncertainty else "taken as exact"
    rows = "the output rows of the reference" if report.coverage else "output rows"
    return (
        f"Duration of the motion: {duration(report.stop)}; {report.inputs}. The error is the maximum over all joints and {rows}. "
        f"Reference: {reference.origin} ({known}). The cost is the {TIME} of `fmi2SetReal` and `fmi2DoStep` per millisecond of motion, "
        "the median of repeated runs in a compiled master. With *changing inputs*, every force or torque changes by 1e-100 at each "
        "communication step: the motion stays the same, but multistep methods restart."
    )


def _table(points: Sequence[Point], unit: str) -> list[str]:
    lines = [f"| method | rtol | error [{unit}] | µs per ms | right-hand sides per ms | |", "| --- | --- | ---: | ---: | ---: | --- |"]
    for p in points:
        note = "" if p.outcome.status == "ok" else f"{p.outcome.status}: {p.outcome.message}".replace("|", "\\|")
        number = [f"{p.error:.1e}", cost(p.us_per_ms), f"{p.rhs_per_ms:.3g}"] if p.good else ["", "", ""]
        lines.append(f"| {p.method} | {p.rtol:.0e} | {' | '.join(number)} | {note} |")
    return lines


def write_pictures(paths: Sequence[Path], report: Report) -> None:
    """Draws the work–precision diagrams, one panel per communication step size, as .svg and .png files."""
    steps = report.steps
    with titled_figure(f"{report.name}: accuracy and {TIME}", 1.2 + 4.4 * len(steps), 4.6) as figure:
        all_axes = figure.subplots(1, len(steps), sharex=True, sharey=True, squeeze=False)[0]
        for axes, step in zip(all_axes, steps, strict=True):
            draw_panel(axes, [p for p in report.points if p.step == step], report)
            axes.set_title(f"communication step size {duration(step)}", loc="left", fontsize=10, color=INK)
            axes.set_xlabel(f"maximum error in {duration(report.stop)} of motion [{report.unit}]")
        all_axes[0].set_ylabel(f"{TIME} per 1 ms of motion [µs]")
        if all_axes[-1].get_legend_handles_labels()[0]:
            all_axes[-1].legend(loc="upper left", bbox_to_anchor=(1.0, 1.02), frameon=False, fontsize=8.5)
        save(figure, paths)


def draw_panel(axes, points: Sequence[Point], report: Report) -> None:
    """Draws the curves of one communication step size, with accuracy increasing to the right."""
    axes.set(xscale="log", yscale="log")  # also without a curve
    for changing in (False, True):
        for method in dict.fromkeys(p.method for p in points):
            curve = [p for p in points if p.method == method and p.changing == changing and p.good and p.error > 0]
            if not curve:
                continue
            axes.plot(
                [p.error for p in curve],
                [p.us_per_ms for p in curve],
                "--" if changing else "-",
                color=COLOURS.get(method, "k"),
                marker=MARKERS.get(method, "o"),
                ms=4.5,
                lw=1.4,
                mfc="white" if changing else None,
                label=f"{method}, {'changing' if changing else 'constant'} inputs",
            )
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
