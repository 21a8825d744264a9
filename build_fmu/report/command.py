"""`build-fmu report`: sweeps FMUs or models and writes table, page and picture of each."""

from __future__ import annotations

import tempfile
import time
import zipfile
from argparse import Namespace
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, replace
from pathlib import Path

from build_fmu.archive import Entry, write_archive
from build_fmu.describe import Description, describe
from build_fmu.documentation import documentation
from build_fmu.driver import Staged, staged
from build_fmu.errors import UserError
from build_fmu.report.html import write_html
from build_fmu.report.machine import busy, load
from build_fmu.report.motion import positions
from build_fmu.report.pages import Report, advice, write_csv, write_page, write_pictures
from build_fmu.report.reference import Reference, from_csv, from_tight_runs
from build_fmu.report.sweep import METHODS, TOLERANCES, Inputs, Plan, communication_steps, known_method, offered_methods, sweep, task_for
from build_fmu.signals import parse_inputs

TIGHT_SECONDS = 20.0


@dataclass(frozen=True)
class Wish:
    """What a user asks of a report; None: as the model says. Times in s."""

    stop: float | None = None
    steps: Sequence[float] | None = None
    methods: Sequence[str] = METHODS
    tolerances: Sequence[float] = TOLERANCES
    inputs: Sequence[str] = ()
    reference: Path | None = None
    changing: Sequence[bool] = (False, True)
    seconds: float = 120.0
    repeats: int = 20


def run(options: Namespace) -> int:
    """Writes the reports and returns the exit code: 1 where a target has no report."""
    for method in options.method or ():
        known_method(method)
    for rtol in options.rtol or ():
        if not 0 < rtol < 1:
            raise UserError(f"a tolerance must be between 0 and 1, got {rtol:g}")
    wish = Wish(options.stop, options.step or None, options.method or METHODS, options.rtol or TOLERANCES, options.input, options.reference,
                seconds=options.seconds)
    targets = list(options.targets)
    # a target may stand after a list: --input a=1 arm.fmu
    for values in (options.input,):
        while values and "=" not in values[-1] and values[-1].endswith((".fmu", ".toml")):
            targets.append(Path(values.pop()))
    if not targets:
        raise UserError("report needs an FMU or a model file, for example `build-fmu report arm.toml`")
    failed = []
    with bar() as advance:
        for target in targets:
            try:
                report = make_report(target, wish, advance(target))
                for file in write(report, options.output or Path("."), Path(target).stem):
                    print(file)
                for line in advice(report):
                    print(f"  {line}")
            except UserError as error:
                if len(targets) == 1:
                    raise
                failed.append(str(error))
    for line in failed:
        print(line)
    return 1 if failed else 0


def write(report: Report, folder: Path, stem: str) -> list[Path]:
    """Writes the files of a report into the folder and returns them."""
    files = [folder / f"{stem}_report{ending}" for ending in (".html", ".md", ".csv", ".svg", ".png")]
    write_pictures(files[3:], report)
    write_csv(files[2], report)
    write_page(files[1], report, files[3].name)
    write_html(files[0], report, files[3])
    return files


def put_into(fmu: Path, model: Description, source: Path, progress: Callable[[str, int, int], None], note: str = "") -> Report:
    """Sweeps a built FMU and adds the pages, with a note, to its documentation."""
    table = model.report.get("reference")
    report = replace(make_report(fmu, Wish(reference=source.parent / table if table else None), progress), note=note)
    with zipfile.ZipFile(fmu) as archive:
        entries = [Entry(i.filename, archive.read(i), bool(i.external_attr >> 16 & 0o100)) for i in archive.infolist()]
    page = "documentation/index.html"
    played = any(entry.name == "documentation/run.html" for entry in entries)
    entries = [Entry(page, documentation(model, played, has_report=True)) if entry.name == page else entry for entry in entries]
    with tempfile.TemporaryDirectory() as folder:
        files = [Path(folder) / f"report{ending}" for ending in (".md", ".csv", ".svg", ".html")]
        write_page(files[0], report, "report.svg")
        write_csv(files[1], report)
        write_pictures(files[2:3], report)
        write_html(files[3], report, files[2])
        entries += [Entry(f"documentation/{file.name}", file.read_bytes()) for file in files]
    write_archive(fmu, entries)
    return report


def make_report(target: Path, wish: Wish, progress: Callable[[str, int, int], None] = lambda *_: None) -> Report:
    """Sweeps one FMU or model file; `progress` gets a sentence, the runs done and their number."""
    begin, load_before = time.monotonic(), load()
    model = describe(target) if target.suffix == ".toml" else None
    with staged(target) as fmu:
        where = positions(fmu)
        usual = fmu.step
        stop = wish.stop if wish.stop is not None else fmu.stop
        steps = sorted(wish.steps) if wish.steps else communication_steps(stop, usual)
        if not stop > 0 or not all(0 < h <= stop for h in steps):
            raise UserError(f"steps must be positive and not longer than the motion, {stop:g} s")
        # whole numbers of the longest step
        stop = max(1, int(stop / max(steps) * (1 + 1e-9))) * max(steps)
        if not any(abs(h - usual) < 1e-9 * usual for h in steps):
            usual = steps[0]
        methods = offered_methods(fmu, wish.methods)
        if not methods:
            raise UserError(f"'{fmu.name}' offers none of the methods {', '.join(wish.methods)}")
        inputs = _inputs(fmu, wish.inputs)
        forces = [n for n in fmu.names("input") if not n.endswith((".q", ".qd", ".qdd"))]
        changing = [c for c in wish.changing if not c or forces]
        references = _references(fmu, model, target, wish, where, inputs, stop, max(steps))
        plan = Plan(stop, steps, methods, wish.tolerances, changing, wish.seconds, wish.repeats)
        total = len(steps) * len(changing) * len(methods) * len(wish.tolerances)
        points = list(sweep(fmu, where, references, inputs, plan, lambda text, done: progress(text, done, total)))
        given = f"inputs {', '.join(wish.inputs)}" if wish.inputs else "no input acts"
        return Report(fmu.name, where.unit, stop, usual, given, references(usual), points, time.monotonic() - begin,
                      tolerances=wish.tolerances, busy=busy(load_before, load()))


def _inputs(fmu: Staged, arguments: Sequence[str]) -> Inputs:
    known = fmu.names("input")

    def find(name: str) -> str:
        if name not in known:
            raise UserError(f"there is no input '{name}'")
        return name

    signals = parse_inputs(arguments, find)
    return Inputs(list(signals), lambda t: [signal(t) for signal in signals.values()])


def _references(fmu: Staged, model: Description | None, target: Path, wish: Wish, where, inputs: Inputs, stop: float,
                longest: float) -> Callable[[float], Reference]:
    """Returns a function of the communication step: inputs that are held make another motion at each step."""
    table = wish.reference or _named_reference(model, target)
    if table and (not inputs.given or wish.reference):
        exact = from_csv(table, where)
        if exact.times[-1] < longest * (1 - 1e-9):
            raise UserError(f"'{table}' ends at {exact.times[-1]:g} s, before the first row of output at {longest:g} s")
        return lambda _: exact
    made: dict[float, Reference] = {}
    methods: list[str] = []

    def reference(step: float) -> Reference:
        key = step if inputs.given else longest
        if key not in made:
            methods[:] = methods or offered_methods(fmu)
            task = task_for(fmu, stop, key, longest, inputs, False, where.names)
            made[key] = from_tight_runs(fmu, where, task, methods, TIGHT_SECONDS)
        return made[key]

    return reference


def _named_reference(model: Description | None, target: Path) -> Path | None:
    name = model.report.get("reference") if model else None
    return target.parent / name if name else None


@contextmanager
def bar() -> Iterator:
    """Yields a function of a target that returns its progress function; the bar is on stderr."""
    from rich.console import Console
    from rich.progress import BarColumn, Progress, TextColumn, TimeElapsedColumn

    screen = Console(stderr=True)
    look = (TextColumn("{task.description}"), BarColumn(), TextColumn("{task.completed:.0f}/{task.total:.0f}"), TimeElapsedColumn())
    with Progress(*look, console=screen, transient=True, disable=not screen.is_terminal) as shown:
        task = shown.add_task("", total=1)

        def of(target: Path) -> Callable[[str, int, int], None]:
            return lambda text, done, total: shown.update(task, description=f"{Path(target).stem}: {text}", completed=done, total=total)

        yield of


