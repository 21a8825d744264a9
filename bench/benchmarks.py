#!/usr/bin/env python3
"""Error against CPU time on the IFToMM multibody benchmarks A01 to A05 and a slider-crank through its singular configuration.

    python bench/benchmarks.py -o out/bench                all
    python bench/benchmarks.py -f squeezer -r 3            selected benchmarks, three repetitions

The error is the maximum difference of one output variable from its reference (benchmark_references.py) over the output times; the time is
the CPU time of the steps, median of the repetitions. Exudyn runs the benchmarks that its joint coordinates describe, if it is
installed (scripts/peers.sh). Writes benchmarks.svg, benchmarks_table.md and benchmarks.txt (lines `scene.metric value`).
"""

from __future__ import annotations

import re
import statistics
import sys
import tempfile
from collections.abc import Callable
from dataclasses import dataclass, field
from pathlib import Path

import matplotlib
import numpy as np
from matplotlib.figure import Figure

ROOT = Path(__file__).resolve().parent.parent
sys.path[:0] = [str(ROOT), str(ROOT / "models"), str(ROOT / "bench" / "peers")]

import benchmark_references as references
import generate_iftomm_four_bars
from peers import Peers, command_line
from scenes import Scene, of_model
from worker import Gone

from build_fmu.run.driver import Task, drive, stage_model

TOLERANCES = (1e-4, 1e-8, 1e-11)
STEPS = (1, 4, 16)  # of Exudyn in an output step
LIMIT = 60.0  # s


@dataclass(frozen=True)
class Benchmark:
    name: str
    title: str
    variable: str
    unit: str
    stop: float
    step: float
    reference: Callable[[np.ndarray], np.ndarray]
    source: str  # of the reference
    published: str  # an entry of others: CPU time
    inputs: dict[str, float] = field(default_factory=dict)
    exudyn: bool = False
    count: int = 0  # of four-bars, if the model is generated

    def model(self, folder: Path) -> Path:
        if not self.count:
            return ROOT / "models" / f"{self.name}.toml"
        file = folder / f"{self.name}_{self.count}.toml"
        file.write_text(generate_iftomm_four_bars.model(self.count), encoding="utf-8")
        return file

    @property
    def times(self) -> np.ndarray:
        return np.arange(round(self.stop / self.step) + 1) * self.step


OPENSIM = "OpenSim 3.2 {} s"
OURS = "ReDySim-FMU"
BENCHMARKS = (
    Benchmark(
        "pendulum",
        "A01, simple pendulum",
        "pivot.q",
        "rad",
        10,
        0.01,
        references.pendulum,
        "closed form",
        OPENSIM.format(0.637),
        exudyn=True,
    ),
    Benchmark(
        "iftomm_four_bars",
        "A02, 2 four-bars",
        "rod0.q",
        "rad",
        10,
        0.01,
        references.four_bars(2),
        "equation of motion in one coordinate",
        OPENSIM.format(0.455),
        exudyn=True,
        count=2,
    ),
    Benchmark(
        "iftomm_four_bars",
        "A02, 40 four-bars",
        "rod0.q",
        "rad",
        10,
        0.01,
        references.four_bars(40),
        "equation of motion in one coordinate",
        "",
        exudyn=True,
        count=40,
    ),
    Benchmark(
        "iftomm_squeezer",
        "A03, Andrews' squeezer",
        "beta.q",
        "rad",
        0.03,
        0.0003,
        references.squeezer,
        "published, 16 digits at 0.03 s",
        OPENSIM.format(0.384) + " for 0.05 s",
        {"beta.tau": 0.033},
        exudyn=True,
    ),
    Benchmark(
        "iftomm_bricard",
        "A04, Bricard's mechanism",
        "joint1.q",
        "rad",
        10,
        0.01,
        references.bricard,
        "dense formulation, each second",
        OPENSIM.format(0.258),
    ),
    Benchmark(
        "iftomm_governor",
        "A05, stiff flyball governor",
        "lift.q",
        "m",
        10,
        0.01,
        references.governor,
        "equations of motion in two coordinates",
        OPENSIM.format(0.233),
    ),
    Benchmark(
        "slider_crank",
        "slider-crank, dead points and singular configuration",
        "crank_joint.q",
        "rad",
        3,
        0.01,
        references.slider_crank,
        "equation of motion in one coordinate",
        "",
    ),
)


@dataclass(frozen=True)
class Row:
    label: str
    error: float
    seconds: float


def worst(reference: np.ndarray, found: np.ndarray) -> float:
    """Maximum error at the times with a reference; a result that is not finite there has none."""
    at = np.isfinite(reference)
    error = np.abs(found[at] - reference[at])
    return float(error.max()) if np.isfinite(error).all() else float("inf")


def ours(benchmark: Benchmark, folder: Path, rtol: float, repetitions: int) -> Row:
    model = benchmark.model(folder)
    with tempfile.TemporaryDirectory() as place:
        fmu = stage_model(model, Path(place))
        start = {"solver.rtol": rtol, "solver.atol": rtol / 100}
        task = Task(
            benchmark.step,
            len(benchmark.times) - 1,
            start=start,
            inputs=list(benchmark.inputs),
            rows=[list(benchmark.inputs.values())],
            outputs=[benchmark.variable],
            budget=LIMIT,
        )
        outcomes = [drive(fmu, task) for _ in range(repetitions)]
    if outcomes[0].status != "ok":
        raise RuntimeError(f"{benchmark.title}: {outcomes[0].message}")
    values = outcomes[0].values[:, 0]
    reference = benchmark.reference(benchmark.times)
    label = f"{OURS}, tolerance {rtol:g}"
    return Row(label, worst(reference[-len(values) :], values), statistics.median(outcome.seconds for outcome in outcomes))


def neutral(benchmark: Benchmark, folder: Path) -> Scene:
    """The benchmark for Exudyn."""
    model = benchmark.model(folder)
    data = of_model(model, {variable.removesuffix(".tau"): value for variable, value in benchmark.inputs.items()})
    data["time"] = {"t_end": benchmark.stop, "dt_out": benchmark.step}
    return Scene(f"{benchmark.name}{benchmark.count or ''}", model, benchmark.title, (), data)


def exudyn(benchmark: Benchmark, peers: Peers, folder: Path) -> list[Row]:
    """Generalized alpha with loops, the explicit method of order 4 without."""
    scene = neutral(benchmark, folder)
    method, label = ("GeneralizedAlpha", "generalized alpha") if scene.has_loops else ("RK44", "RK44")
    reference, found = benchmark.reference(benchmark.times), []
    worker = peers.start("Exudyn", scene)
    try:
        for cut in STEPS:
            name = f"Exudyn, {label}, step {benchmark.step / cut:.2g} s"
            try:
                answer = worker.ask(method, cut, LIMIT)
            except Gone:
                found.append(Row(f"{name}: ended after {LIMIT:g} s", float("nan"), float("nan")))
                break
            if answer.rows is None:
                found.append(Row(f"{name}: failed", float("nan"), float("nan")))
                continue
            found.append(Row(name, worst(reference, answer.rows[:, 0]), answer.seconds))
    finally:
        worker.close()
    return found


def cell(value: float, form: str) -> str:
    return format(value, form) if np.isfinite(value) else "–"


def published(benchmark: Benchmark) -> tuple[float, str]:
    """CPU time (s) of the published entry, and its description."""
    seconds, _, rest = benchmark.published.removeprefix("OpenSim 3.2 ").partition(" s")
    return float(seconds), rest


def draw(results: list[tuple[Benchmark, list[Row]]], file: Path) -> None:
    """CPU time over error, one diagram per benchmark, as those of peers/summary.py; published entries state no error."""
    matplotlib.rcParams.update({"svg.fonttype": "none", "svg.hashsalt": "redysim"})
    figure = Figure(figsize=(10.4, 2.7 * -(-len(results) // 3)), layout="constrained")
    for i, (benchmark, rows) in enumerate(results):
        axes = figure.add_subplot(-(-len(results) // 3), 3, i + 1)
        for program, colour in ((OURS, "#c0392b"), ("Exudyn", "#2c6fa6")):
            points = [(row.error, 1e3 * row.seconds) for row in rows if row.label.startswith(program) and np.isfinite(row.error)]
            if points:
                axes.loglog(*zip(*points, strict=True), marker="o", ms=4, color=colour, label=program)
        if benchmark.published:
            axes.axhline(1e3 * published(benchmark)[0], color="#5a6872", ls="--", lw=1, label="OpenSim 3.2, published time")
        axes.set_title(benchmark.title, fontsize=9)
        axes.set_ylim(0.3, 1e5)
        axes.set_xlabel(f"maximum error, {benchmark.unit}", fontsize=8)
        axes.set_ylabel("CPU time, ms", fontsize=8)
        axes.tick_params(labelsize=7)
        axes.grid(alpha=0.3)
    named = {label: line for axes in figure.axes for line, label in zip(*axes.get_legend_handles_labels(), strict=True)}
    figure.legend(named.values(), named.keys(), loc="lower right", fontsize=9)
    figure.savefig(file, metadata={"Date": None})


def table(benchmark: Benchmark, rows: list[Row]) -> str:
    lines = [f"**{benchmark.title}**: {benchmark.stop:g} s, `{benchmark.variable}`, reference: {benchmark.source}", ""]
    lines += [f"| program | maximum error, {benchmark.unit} | CPU time, ms |", "| --- | --- | --- |"]
    lines += [f"| {row.label} | {cell(row.error, '.1e')} | {cell(1e3 * row.seconds, '.3g')} |" for row in rows]
    if benchmark.published:
        seconds, rest = published(benchmark)
        lines.append(f"| OpenSim 3.2, published{rest} | not stated | {1e3 * seconds:.0f} |")
    return "\n".join(lines) + "\n"


def main() -> None:
    parser = command_line(__doc__)
    parser.add_argument("-f", "--filter", default=".", help="regular expression on models")
    parser.add_argument("-r", "--repetitions", type=int, default=5)
    options = parser.parse_args()
    options.output.mkdir(parents=True, exist_ok=True)
    work = options.output / "benchmarks_work"
    peers = Peers(options.programs, options.python, work)
    absent = peers.missing().get("Exudyn", "")
    if absent:
        print(f"Exudyn is skipped: {absent}")
    texts, figures, results = [], [], []
    for benchmark in BENCHMARKS:
        if not re.search(options.filter, benchmark.name):
            continue
        rows = [ours(benchmark, work, rtol, options.repetitions) for rtol in TOLERANCES]
        name = f"{benchmark.name}{benchmark.count or ''}"
        for rtol, row in zip(TOLERANCES, rows, strict=True):
            figures += [f"{name}.benchmark_error_at_{rtol:g} {row.error:.3g}", f"{name}.benchmark_ms_at_{rtol:g} {1e3 * row.seconds:.3g}"]
        if benchmark.exudyn and not absent:
            rows += exudyn(benchmark, peers, work)
        texts.append(table(benchmark, rows))
        results.append((benchmark, rows))
        print(texts[-1], flush=True)
    version = "" if absent else f"Exudyn {peers.versions().get('Exudyn', '?')}.\n\n"
    (options.output / "benchmarks_table.md").write_text("\n" + version + "\n".join(texts) + "\n", encoding="utf-8")
    draw(results, options.output / "benchmarks.svg")
    (options.output / "benchmarks.txt").write_text("\n".join(figures) + "\n", encoding="utf-8")


if __name__ == "__main__":
    main()
