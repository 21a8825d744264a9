"""`build-fmu stress`: runs extreme cases derived from models in parallel and writes the results."""

from __future__ import annotations

import argparse
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from build_fmu.cli.parser import count, positive
from build_fmu.cli.streams import add_options, emit
from build_fmu.cli.terminal import bar, output_folder

QUIET = 15.0  # s between two progress messages without a terminal


def add(commands) -> None:
    """Adds the command and its arguments."""
    command = commands.add_parser(
        "stress",
        help="run extreme cases derived from models and report the results",
        description="Derive extreme cases from each "
        "model, run each in a separate process, and write stress.html, .md, .csv, .svg and .png.",
    )
    command.add_argument("models", nargs="+", type=Path, metavar="MODEL", help="model files (.toml)")
    command.add_argument("-o", "--output", type=Path, metavar="DIR", help="output folder (default: current folder)")
    command.add_argument(
        "--only",
        nargs="+",
        action="extend",
        default=[],
        metavar="WORD",
        help="only groups of cases with a word in their name, such as stiff",
    )
    command.add_argument("--method", metavar="NAME", help="solver method (default: as in the model)")
    command.add_argument("--seconds", type=positive, default=2, metavar="S", help="CPU time limit of each run in s (default: 2)")
    command.add_argument("--jobs", type=count, metavar="N", help="parallel runs (default: one per processor)")
    add_options(command, reports=True)
    command.set_defaults(run=run)


def run(options: argparse.Namespace) -> int:
    """Writes the results and returns the exit code: 1 if a case failed."""
    from build_fmu.report.machine import processors
    from build_fmu.report.sweep import known_method
    from build_fmu.stress.html import write_html
    from build_fmu.stress.pages import KINDS, not_finished, write_csv, write_page, write_pictures
    from build_fmu.stress.pool import run_all, work_of

    begin = time.monotonic()
    if options.method is not None:
        known_method(options.method)
    folder = output_folder(options.output)
    work = work_of(options.models, options.only)
    with _progress(len(work)) as progress:
        found = {}
        for number, verdict in run_all(work, options.seconds, options.method, options.jobs or processors()):
            found[number] = verdict
            progress(verdict, len(found))
    verdicts = [found[number] for number in range(len(work))]
    files = [folder / name for name in ("stress.html", "stress.md", "stress.csv", "stress.svg", "stress.png")]
    taken = time.monotonic() - begin
    write_pictures(files[3:], verdicts)
    write_csv(files[2], verdicts)
    write_page(files[1], verdicts, files[3].name, options.seconds, taken)
    write_html(files[0], verdicts, options.seconds, taken)
    counts = {kind: sum(v.kind == kind for v in verdicts) for kind in KINDS}
    rows = [{"model": v.model, "group": v.case.group, "case": v.case.label, "verdict": v.kind, "message": v.message} for v in verdicts]
    emit(options, {"cases": rows, "counts": counts, "files": files})
    total = "1 case" if len(verdicts) == 1 else f"{len(verdicts)} cases"
    print(f"{total}: " + ", ".join(f"{count} {kind}" for kind, count in counts.items() if count))
    if counts["failed"]:
        print("\n".join(line for line in not_finished(verdicts) if line.startswith("| failed")))
    print(*files, sep="\n")
    return 1 if counts["failed"] else 0


@contextmanager
def _progress(total: int) -> Iterator:
    """Yields the progress function, which takes a verdict and the number of finished cases."""
    from rich.progress import MofNCompleteColumn, TimeElapsedColumn, TimeRemainingColumn

    with bar(MofNCompleteColumn(), TimeElapsedColumn(), TimeRemainingColumn()) as shown:
        screen, task = shown.console, shown.add_task("", total=total)
        last = time.monotonic()

        def progress(verdict, count: int) -> None:
            nonlocal last
            words = f"{verdict.model}: {verdict.case.group}, {verdict.case.label}"
            shown.update(task, description=words, completed=count)
            # messages instead of a bar
            if not screen.is_terminal and time.monotonic() - last > QUIET:
                last = time.monotonic()
                screen.print(f"{count} of {total} cases, now {verdict.model}", highlight=False, markup=False, soft_wrap=True)
            if verdict.kind == "failed":
                screen.print(f"failed  {words}: {verdict.message}", highlight=False, markup=False, soft_wrap=True)

        yield progress
