#!/usr/bin/env python3
"""Runs ReDySim's examples as FMUs and writes the table of docs/redysim_examples.md.

    python bench/redysim_examples.py              prints the rows, about a minute
    python bench/redysim_examples.py E5 E21       those of some examples
    python bench/redysim_examples.py --docs       writes the page
    python bench/redysim_examples.py E5 --commands     the runs as commands

The runs and the known figures are those of tests/fmi/redysim_cases.py and redysim_dense_cases.py.
"""

from __future__ import annotations

import argparse
import re
import shlex
import sys
import tempfile
from collections.abc import Callable
from dataclasses import dataclass
from math import inf, log10
from pathlib import Path

import numpy as np

ROOT = Path(__file__).resolve().parent.parent
sys.path.insert(0, str(ROOT))

from build_fmu.cli import main as build_fmu
from build_fmu.run.session import Session
from build_fmu.run.simulate import Settings, simulate
from tests.fmi.redysim_cases import REDYSIM, Case, Known
from tests.fmi.redysim_dense_cases import ALL

PAGE = ROOT / "docs" / "redysim_examples.md"
BLOCK = re.compile(r"(<!-- examples -->\n).*?(<!-- end -->)", re.S)
HEAD = ("example", "model and run", "quantity", "time, s", "source", "its figure", "this FMU", "difference", "limited by")
PRINTED = 12  # digits of the known figures
ROUNDING = 1e-8  # a smaller relative difference is "none": the figures are known to so many digits
LONGEST = 300  # characters of a command on the page
FmuFile = Callable[[str], Path]


@dataclass(frozen=True)
class Found:
    """The FMU's values of a known result."""

    known: Known
    values: np.ndarray

    @property
    def errors(self) -> np.ndarray:
        return np.abs(self.values - self.known.values)

    @property
    def relative(self) -> float:
        return float(self.errors.max() / np.abs(self.known.values).max())

    @property
    def digits(self) -> float:
        """Digits of the largest value that agree."""
        return min(-log10(self.relative) if self.relative else inf, PRINTED)


def settings(case: Case) -> Settings:
    tight = {"solver.rtol": 1e-11, "solver.atol": 1e-13} if not case.inverse or case.model == "space_robot" else {}
    start = [f"{name}={value}" for name, value in (tight | case.start).items()]
    inputs = [f"{name}={text}" for name, text in case.inputs.items()]
    return Settings(max(max(known.time for known in case.known), case.step), case.step, None, start, inputs)


def measure(fmu_file: FmuFile, case: Case) -> list[Found]:
    """Runs the case."""
    with Session(fmu_file(case.model + "_inverse" * case.inverse)) as session:
        result = simulate(session, settings(case))
    found = []
    for known in case.known:
        row = int(np.argmin(np.abs(result.time - known.time)))
        assert abs(result.time[row] - known.time) < 1e-9
        found.append(Found(known, np.array([result[name][row] for name in known.names])))
    return found


def command(case: Case) -> str:
    """The run as a command line."""
    run, model = settings(case), f"models/{case.model}.toml"
    lines = []
    if case.inverse:
        lines.append(f"build-fmu build --inverse {model} -o out")
        model = f"out/{case.model}_inverse.fmu"
    words = ["build-fmu", "simulate", model, "--stop", f"{run.stop:g}", "--step", f"{run.step:g}"]
    words += ["--start", *run.start] * bool(run.start) + ["--input", *run.inputs] * bool(run.inputs)
    names = dict.fromkeys(name for known in case.known for name in known.names)
    lines.append(shlex.join([*words, "--output", *names]))
    return "\n".join(lines)


def digits(value: float, source: str) -> str:
    return f"{value:.{7 if source == REDYSIM else 9}g}"


def row(case: Case, rows: list[Found]) -> str:
    """The table's row of one quantity: the time and the value of the largest difference; without one the largest of the last."""
    worst = max(rows, key=lambda found: found.relative)
    if worst.relative < ROUNDING:
        worst = max(rows, key=lambda found: found.known.time)
    known, none = worst.known, worst.relative < ROUNDING
    k = int(np.argmax(np.abs(known.values) if none else worst.errors))
    cells = (
        case.example,
        f"`{case.model}`, {case.run}",
        f"{known.what.partition(' at ')[0]}, `{known.names[k]}`",
        f"{known.time:g}",
        known.source,
        digits(known.values[k], known.source),
        digits(worst.values[k], "") if known.source == REDYSIM else digits(worst.values[k], known.source),
        "none" if none else f"{worst.errors[k]:.0e}",
        known.why or ("seven printed digits" if known.whole else ""),
    )
    return f"| {' | '.join(cells)} |"


def rows(case: Case, found: list[Found]) -> list[str]:
    """One row per quantity and source."""
    groups: dict[tuple[str, str], list[Found]] = {}
    for one in found:
        groups.setdefault((one.known.what, one.known.source), []).append(one)
    return [row(case, group) for group in groups.values()]


def chosen(patterns: list[str]) -> list[Case]:
    """The cases of these examples: E1 is not E10."""
    wanted = [re.compile(rf"{re.escape(pattern)}\b", re.IGNORECASE) for pattern in patterns]
    return [case for case in ALL if not wanted or any(pattern.match(case.example) for pattern in wanted)]


def builder(folder: Path) -> FmuFile:
    built: dict[str, Path] = {}

    def fmu_file(name: str) -> Path:
        if name not in built:
            built[name] = folder / f"{name}.fmu"
            model = ROOT / "models" / f"{name.removesuffix('_inverse')}.toml"
            options = ["--inverse"] * name.endswith("_inverse")
            if build_fmu(["build", str(model), "-o", str(built[name]), "--no-show", "--quiet", *options]):
                sys.exit(f"{model.name} was not built")
        return built[name]

    return fmu_file


def page_block(lines: list[str]) -> str:
    commands = [text for case in ALL if len(text := command(case)) <= LONGEST]
    table = "\n".join([f"| {' | '.join(HEAD)} |", "| --- " * len(HEAD) + "|", *lines])
    return f"\n{table}\n\nRuns with short arguments as commands:\n\n```sh\n" + "\n".join(dict.fromkeys(commands)) + "\n```\n\n"


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("examples", nargs="*", help="first words of examples, for example E5 (default: all)")
    parser.add_argument("--commands", action="store_true", help="print the runs as commands instead")
    parser.add_argument("--docs", action="store_true", help="write docs/redysim_examples.md")
    options = parser.parse_args()
    cases = chosen(options.examples)
    if not cases:
        parser.error(f"unknown example {' '.join(options.examples)}; available: {', '.join(dict.fromkeys(case.example for case in ALL))}")
    if options.docs and options.examples:
        parser.error("--docs requires all examples")
    if options.commands:
        print("\n".join(command(case) for case in cases))
        return
    lines = []
    with tempfile.TemporaryDirectory() as folder:
        fmu_file = builder(Path(folder))
        for case in cases:
            lines += rows(case, measure(fmu_file, case))
            print(*lines[-len({(known.what, known.source) for known in case.known}) :], sep="\n", flush=True)
    if options.docs:
        text = PAGE.read_text(encoding="utf-8")
        PAGE.write_text(BLOCK.sub(lambda found: found[1] + page_block(lines) + found[2], text), encoding="utf-8")


if __name__ == "__main__":
    main()
