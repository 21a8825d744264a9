#!/usr/bin/env python3
"""Work of `auto` against the best single method at equal error, in six uses of each model.

    python bench/automatic.py                      the files of models/ but OMITTED
    python bench/automatic.py -f kr5 -u held       models and uses whose names match the regular expressions
    python bench/automatic.py MODEL.toml...        other model files
    python bench/automatic.py --scatter            the best single method instead of `auto`: the scatter of the ratios
    python bench/automatic.py --markdown           the table of docs/solver_measurements.md

Work is CPU time estimated from counts, in right-hand sides of `erk`: those of other methods are weighted
(fmu_src/integrate/methods/slope_time.hpp), a Jacobian counts as 1.5 per state. No clock is read, so other load does not change a figure.
The error is the maximum of the positions over all outputs, against a reference at the tightest tolerance that can be reached.
Each method runs at rtol 1e-3 to 1e-11, `auto` at 1e-4 to 1e-10. Work and error of a method become curves over its tolerances: the
nearest that are monotone in both (isotonic regression of the logarithms), so that single lucky runs do not decide. For each run of
`auto` the ratio is its work over that of the method that reaches its error at the least work, both from these curves. Of the excess
work, 100 right-hand sides do not count. Errors below that of the reference count as equal to it,
runs with an error above 0.1 rad or m (chaotic motion) are omitted. The runs of single methods are kept
in --cache; remove it after a change of these methods. Needs the program `stepping` (`sh scripts/build.sh bench stepping`).
"""

import argparse
import concurrent.futures
import hashlib
import json
import math
import re
import statistics
import subprocess
from pathlib import Path

import built
from stiff import ROOT

METHODS = ("erk", "adams", "dirk", "bdf")
JUDGED = [10**-exponent for exponent in range(4, 11)]
BETWEEN = [10 ** (-exponent / 2 - 0.25) for exponent in range(8, 20)]  # tolerances of `--scatter`
OURS = [10 ** (-exponent / 2) for exponent in range(7, 22)]
SINGLE = [10 ** (-exponent / 2) for exponent in range(6, 23)]
# communication step in s, end in s, communication steps between changes of the inputs (0: constant)
USES = {
    "long": (0.5, 2, 0),
    "held 10 ms": (0.01, 1, 0),
    "held 1 ms": (0.001, 0.5, 0),
    "held for 7": (0.001, 0.28, 7),
    "changing 10 ms": (0.01, 0.5, 1),
    "changing 1 ms": (0.001, 0.2, 1),
}
OMITTED = "four_bar_chain|quadruped|hexapod|series_elastic_leg|kuka_kr5_harmonic"  # minutes each
LIMIT = 200_000  # right-hand sides of a run
REFERENCES = (("erk", 1e-13, 2_000_000), ("dirk", 1e-12, 1_000_000), ("bdf", 1e-11, 1_000_000), ("auto", 1e-12, 3_000_000))
MEANINGLESS = 0.1  # rad or m: a chaotic motion has no error to compare
NEGLIGIBLE = 100  # right-hand sides in a whole run that do not matter


def rows_of(program, model, **options):
    arguments = [f"{key}={','.join(f'{part:.4g}' for part in value) if key == 'rtol' else value}" for key, value in options.items()]
    lines = subprocess.run([program, model, *arguments], stdout=subprocess.PIPE, text=True, check=True, timeout=1800).stdout.splitlines()
    rows = []
    for line in lines:
        if line.startswith("#"):
            if "reference" in line:
                return None
            continue
        cells, _, stopped = line.partition(" # ")
        method, rtol, _, _, work, _, error, *_, median, most = cells.split()
        if not stopped and math.isfinite(float(error)):
            rows.append([method, float(rtol), float(work), float(error), float(median), float(most)])
    return rows


def has_inputs(model):
    """Whether torques of alternating sign move the model: it has a joint that is driven by an input."""
    text = model.read_text()
    return "[[loop]]" in text or 'mode = "passive"' not in text


class Cell:
    """One model in one use."""

    def __init__(self, program, model, use, cache):
        self.program, self.model, self.use = program, model, use
        step, end, hold = USES[use]
        self.scene = {"step": step, "end": end, "drive": "square" if hold else "rest", "hold": hold or 1, "clock": "off"}
        digest = hashlib.sha256(model.read_bytes() + repr(self.scene).encode()).hexdigest()[:16]
        self.kept = cache / f"{model.stem}-{digest}.states"
        self.singles = cache / f"{model.stem}-{digest}.json"

    def run(self, methods, tolerances, limit):
        return rows_of(self.program, self.model, method=methods, rtol=tolerances, limit=limit, keep=self.kept, **self.scene)

    def measure_singles(self):
        """Reference and runs of the single methods; the floor is the smallest distance of another tight run."""
        if self.singles.exists():
            return json.loads(self.singles.read_text())
        for reference, rtol, limit in REFERENCES:
            self.kept.unlink(missing_ok=True)
            rows = rows_of(
                self.program,
                self.model,
                method=reference,
                rtol=[1e-2],
                limit=limit,
                keep=self.kept,
                reference=reference,
                reference_rtol=rtol,
                **self.scene,
            )
            if rows is not None:
                break
        else:
            return None
        rows = [row for method in METHODS for row in self.run(method, SINGLE, LIMIT)]
        tight = [row[3] for method in METHODS if method != reference for row in self.run(method, [1e-11, 1e-12], 4 * LIMIT)]
        measured = {"reference": reference, "floor": max(min(tight, default=0), 1e-14), "rows": rows}
        self.singles.write_text(json.dumps(measured))
        return measured

    def judge(self):
        """Lines of `auto`: see `compare`."""
        return self.compare("auto", OURS, JUDGED, 5 * LIMIT)

    def scatter(self):
        """Lines of the single methods at other tolerances, where they are the best."""
        lines = [line for method in METHODS for line in self.compare(method, BETWEEN, BETWEEN, LIMIT)]
        return [line for line in lines if line[2] is None or line[5] == line[8]]

    def compare(self, judged, tolerances, wanted, limit):
        """Lines (model, use, rtol, work, best work, best method, error, median and 99th percentile over those of erk, method)."""
        measured = self.measure_singles()
        if measured is None:
            return [(self.model.stem, self.use, None)]
        floor = 2 * measured["floor"]
        own = self.run(judged, tolerances, limit)
        curves = {method: curve([row for row in measured["rows"] if row[0] == method], floor) for method in METHODS}
        mine = curve(own, floor)
        lines = []
        erk = {round(math.log10(row[1]), 1): row for row in measured["rows"] if row[0] == "erk"}
        for row in own:
            if not any(math.isclose(row[1], rtol, rel_tol=0.01) for rtol in wanted):
                continue
            error = max(row[3], floor)
            if error > MEANINGLESS:
                continue
            work = work_at(mine, error)
            offers = [(found, method) for method in METHODS if (found := work_at(curves[method], error)) is not None]
            if not offers or work is None:
                continue
            best, method = min(offers)
            same = erk.get(round(math.log10(row[1]), 1))
            steps = (row[4] / same[4], row[5] / same[5]) if same and same[4] > 0 and same[5] > 0 else None
            lines.append((self.model.stem, self.use, row[1], work, best, method, error, steps, judged))
        return lines


def isotonic(values):
    """The nearest sequence that does not fall (pool adjacent violators)."""
    blocks = []
    for value in values:
        blocks.append([value, 1])
        while len(blocks) > 1 and blocks[-2][0] > blocks[-1][0]:
            upper, count = blocks.pop()
            lower, other = blocks.pop()
            blocks.append([(lower * other + upper * count) / (other + count), other + count])
    return [value for value, count in blocks for _ in range(count)]


def curve(rows, floor):
    """Points (logarithm of the error, of the work) from loose to tight."""
    rows = sorted(rows, key=lambda row: -row[1])
    errors = isotonic([-math.log(max(row[3], floor)) for row in rows])
    works = isotonic([math.log(max(row[2], 1)) for row in rows])
    return [(-error, work) for error, work in zip(errors, works, strict=True)]


def work_at(points, error):
    """Least work for an error, or none."""
    aim = math.log(error) * (1 + 1e-12) + 1e-9
    for k, (at, work) in enumerate(points):
        if at > aim:
            continue
        if k == 0:
            return math.exp(work)
        before, work_before = points[k - 1]
        share = (before - aim) / (before - at) if before > at else 1
        return math.exp(work_before + share * (work - work_before))
    return None


def ratio(line):
    """Work relative to the best, without differences that do not matter."""
    _, _, _, work, best, *_ = line
    return max(work - NEGLIGIBLE, min(work, best)) / best


def report(lines, markdown):
    good = [line for line in lines if line[2] is not None]
    print("| use | runs | median | 90 % | worst | worst case |" if markdown else "# use: runs, median, 90 %, worst, worst case")
    if markdown:
        print("| --- | ---: | ---: | ---: | ---: | --- |")
    for use in [*USES, "all"]:
        mine = sorted((line for line in good if use in (line[1], "all")), key=ratio)
        if not mine:
            continue
        ratios = [ratio(line) for line in mine]
        model, where, rtol, *_ = mine[-1]
        cells = (use, len(mine), f"{statistics.median(ratios):.2f}", f"{ratios[int(0.9 * (len(mine) - 1))]:.2f}", f"{ratios[-1]:.2f}")
        name = f"{model}, {rtol:.0e}" + (f", {where}" if use == "all" else "")
        print(("| " + " | ".join(map(str, cells)) + f" | {name} |") if markdown else " ".join(map(str, cells)) + f" {name}")
    for use in ("changing 10 ms", "changing 1 ms"):
        steps = [line[7] for line in good if line[1] == use and line[7]]
        if steps:
            medians, most = sorted(step[0] for step in steps), sorted(step[1] for step in steps)
            half, tail = (f"{statistics.median(shares):.2f} and {shares[-1]:.2f}" for shares in (medians, most))
            print(f"\n{use}: communication steps over those of erk, median and maximum of the runs: median {half}, 99th percentile {tail}")


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("models", nargs="*", type=Path)
    parser.add_argument("-f", "--filter", default=".", help="regular expression on the model")
    parser.add_argument("-u", "--use", default=".", help="regular expression on the use")
    parser.add_argument("--cache", type=Path, default=ROOT / "build" / "automatic", help="folder of the single methods' runs")
    parser.add_argument("--worse", type=float, default=1.5, help="print the runs with a larger ratio")
    parser.add_argument("--scatter", action="store_true", help="judge the best single method at other tolerances")
    parser.add_argument("--jobs", type=int, default=1)
    parser.add_argument("--markdown", action="store_true")
    parser.add_argument("--build", help="build folder (build/bench or build/release)")
    options = parser.parse_args()
    options.cache.mkdir(parents=True, exist_ok=True)
    program = built.program("stepping", options.build)
    models = options.models or [file for file in sorted((ROOT / "models").glob("*.toml")) if not re.search(OMITTED, file.stem)]
    cells = [
        Cell(program, model.resolve(), use, options.cache)
        for model in models
        if re.search(options.filter, model.stem)
        for use in USES
        if re.search(options.use, use) and (USES[use][2] == 0 or has_inputs(model))
    ]
    with concurrent.futures.ThreadPoolExecutor(options.jobs) as pool:
        lines = [line for found in pool.map(Cell.scatter if options.scatter else Cell.judge, cells) for line in found]
    for line in sorted((line for line in lines if line[2] is not None and ratio(line) > options.worse), key=ratio):
        model, use, rtol, work, best, method, error, *_ = line
        print(f"{model}, {use}, {rtol:.0e}: {ratio(line):.2f}, {work:.0f} right-hand sides, {method} {best:.0f} at an error of {error:.1e}")
    for line in lines:
        if line[2] is None:
            print(f"{line[0]}, {line[1]}: no reference")
    report(lines, options.markdown)


if __name__ == "__main__":
    main()
