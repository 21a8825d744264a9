"""`build-fmu stress`: runs extreme cases derived from models in parallel and writes the results."""

from __future__ import annotations

import argparse
import os
import time
import tomllib
from concurrent.futures import ThreadPoolExecutor, as_completed
from pathlib import Path

from build_fmu.cli.terminal import bar
from build_fmu.errors import UserError

QUIET = 15.0  # s between two progress messages without a terminal


def add(commands) -> None:
    """Adds the command and its arguments."""
    command = commands.add_parser("stress", help="run extreme cases derived from models and report the results", description="Derive extreme cases from each "
                                  "model, run each in a separate process, and write stress.html, .md, .csv, .svg and .png.")
    command.add_argument("models", nargs="+", type=Path, metavar="MODEL", help="model files (.toml)")
    command.add_argument("-o", "--output", type=Path, metavar="DIR", help="output folder (default: current folder)")
    command.add_argument("--only", nargs="+", action="extend", default=[], metavar="WORD", help="only groups of cases with a word in their name, such as stiff")
    command.add_argument("--method", metavar="NAME", help="solver method (default: as in the model)")
    command.add_argument("--seconds", type=float, default=2, metavar="S", help="CPU time limit of each run in s (default: 2)")
    command.add_argument("--jobs", type=int, default=len(os.sched_getaffinity(0)), metavar="N", help="parallel runs (default: one per processor)")
    command.set_defaults(run=run)


def run(options: argparse.Namespace) -> int:
    """Writes the results and returns the exit code: 1 if a case failed."""
    from build_fmu.report.sweep import known_method
    from build_fmu.stress.html import write_html
    from build_fmu.stress.pages import (
        KINDS,
        not_finished,
        write_csv,
        write_page,
        write_pictures,
    )

    begin = time.monotonic()
    wanted = _groups(options.only)
    if options.method is not None:
        known_method(options.method)
    work = [(model, case) for file in options.models for model, case in _cases(file) if case.group in wanted]
    verdicts = _run_all(work, options)
    folder = options.output or Path(".")
    files = [folder / name for name in ("stress.html", "stress.md", "stress.csv", "stress.svg", "stress.png")]
    taken = time.monotonic() - begin
    write_pictures(files[3:], verdicts)
    write_csv(files[2], verdicts)
    write_page(files[1], verdicts, files[3].name, options.seconds, taken)
    write_html(files[0], verdicts, options.seconds, taken)
    counts = {kind: sum(v.kind == kind for v in verdicts) for kind in KINDS}
    print(f"{len(verdicts)} cases: " + ", ".join(f"{count} {kind}" for kind, count in counts.items() if count))
    if counts["failed"]:
        print("\n".join(line for line in not_finished(verdicts) if line.startswith("| failed")))
    for file in files:
        print(file)
    return 1 if counts["failed"] else 0


def _groups(words: list[str]) -> list[str]:
    from build_fmu.stress.cases import GROUPS

    found = [group for group in GROUPS if not words or any(word in group for word in words)]
    if not found:
        raise UserError(f"no group of cases matches '{words[0]}'; available: {', '.join(GROUPS)}")
    return found


def _cases(file: Path) -> list[tuple]:
    """Returns the model's name with each of its cases; `describe` checks the file first."""
    from build_fmu.model.describe import describe
    from build_fmu.stress.cases import catalogue

    description = describe(file)
    experiment = description.default_experiment
    model = tomllib.loads(file.read_text(encoding="utf-8-sig"))
    return [(file.stem, case) for case in catalogue(model, experiment["stop_time"], experiment["step_size"])]


def _run_all(work: list[tuple], options: argparse.Namespace) -> list:
    from rich.progress import MofNCompleteColumn, TimeElapsedColumn, TimeRemainingColumn

    from build_fmu.stress.run import run_case

    verdicts: dict = {}
    spoken = time.monotonic()
    with bar(MofNCompleteColumn(), TimeElapsedColumn(), TimeRemainingColumn()) as shown, ThreadPoolExecutor(options.jobs) as pool:
        screen, task = shown.console, shown.add_task("", total=len(work))
        futures = {pool.submit(run_case, model, case, options.seconds, options.method): i for i, (model, case) in enumerate(work)}
        try:
            for number, future in enumerate(as_completed(futures), start=1):
                verdict = verdicts[futures[future]] = future.result()
                words = f"{verdict.model}: {verdict.case.group}, {verdict.case.label}"
                shown.update(task, description=words, completed=number)
                # progress messages instead of a bar
                if not screen.is_terminal and time.monotonic() - spoken > QUIET:
                    spoken = time.monotonic()
                    screen.print(f"{number} of {len(work)} cases, now {verdict.model}", highlight=False, markup=False, soft_wrap=True)
                if verdict.kind == "failed":
                    screen.print(f"failed  {words}: {verdict.message}", highlight=False, markup=False, soft_wrap=True)
        except BaseException:
            pool.shutdown(wait=False, cancel_futures=True)
            raise
    return [verdicts[i] for i in range(len(work))]
