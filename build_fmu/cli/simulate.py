"""`build-fmu simulate`: simulates an FMU or a model file and records its outputs."""

from __future__ import annotations

import argparse
import tempfile
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING

from build_fmu.cli.parser import number, positive, tolerance
from build_fmu.cli.streams import add_options, emit
from build_fmu.cli.terminal import SEVERAL, bar, console, output_file, output_folder, targets_after, warn
from build_fmu.errors import InvalidArgument, UserError
from build_fmu.run.signals import MODES

if TYPE_CHECKING:
    from build_fmu.model.describe import Description
    from build_fmu.run.session import Session
    from build_fmu.run.simulate import Result


def add(commands) -> None:
    """Adds the command and its arguments."""
    command = commands.add_parser(
        "simulate",
        help="simulate an FMU or a model file",
        description="Simulate an FMU or a model file. Without --csv and "
        "--plot, print a table of values in the units that it names, angles in deg. Options, CSV files and --json use SI units and rad.",
    )
    command.add_argument("target", nargs="?", type=Path, metavar="FMU|MODEL", help="FMU (.fmu) or model file (.toml)")
    command.add_argument("--stop", type=number, metavar="T", help="stop time in s (default: as in the FMU)")
    command.add_argument("--step", type=positive, metavar="H", help="communication step size in s (default: as in the FMU)")
    command.add_argument("--tolerance", type=tolerance, metavar="R", help="relative tolerance; used if tighter than the model's")
    command.add_argument("--start", **SEVERAL, metavar="NAME=VALUE", help="start values of parameters, for example joint1.q0=pi/2")
    command.add_argument(
        "--input",
        **SEVERAL,
        metavar="NAME=EXPR|FILE.csv",
        help="inputs: an expression of t such as 'joint1.tau=2*sin(t) if t < 1 else 0', or a CSV with a column 'time' or 't' (s), "
        "separated by commas, semicolons or tabs; - is standard input",
    )
    command.add_argument(
        "--interpolate",
        choices=MODES,
        default="expressions",
        help="inputs that change during a communication step: none (all constant), "
        "expressions (default), or all (also CSV files, linear between rows)",
    )
    command.add_argument("--output", **SEVERAL, metavar="NAME", help="outputs to record, with * as wildcard (default: all)")
    command.add_argument("--csv", type=Path, metavar="OUT.csv", help="write the results with 17 digits")
    command.add_argument("--plot", type=Path, metavar="OUT.png", help="plot the results (.png, .svg, .pdf)")
    command.add_argument(
        "--redysim-layout", type=Path, metavar="DIR", help="write ReDySim's files timevar.dat, statevar.dat, envar.dat, tor.dat"
    )
    add_options(command, reports=True)
    command.set_defaults(run=run)


def run(options: argparse.Namespace) -> int:
    """Simulates the target and writes the requested files."""
    from build_fmu.run.session import Session
    from build_fmu.run.simulate import Settings, select_outputs, simulate
    from build_fmu.run.tables import final_values

    target = _simulated_file(options)
    _check_files(options)
    with _as_fmu(target, options) as (fmu, said), Session(fmu) as session:
        model = _model_of_layout(fmu) if options.redysim_layout else None
        chosen = select_outputs(session, options.output)
        # the layout needs columns that --output may exclude
        recorded = list(dict.fromkeys([*select_outputs(session, ()), *chosen])) if model else chosen
        settings = Settings(options.stop, options.step, options.tolerance, options.start, options.input, recorded, options.interpolate)
        with _progress(session, settings) as progress:
            result = simulate(session, settings, progress)
        warn([*result.warnings, *result.remarks], said)
        if model:
            _write_layout(options.redysim_layout, model, result)
        result = result.only(chosen)
        _write_files(session, result, options)
        emit(options, _facts(session, result, options))
        if not (options.csv or options.plot or model):
            console().print(final_values(session, result))
    return 0


def _check_files(options: argparse.Namespace) -> None:
    """Raises UserError for wrong names of files, before the run."""
    from build_fmu.draw.plots import FORMATS

    for path, endings in ((options.csv, (".csv",)), (options.plot, FORMATS)):
        if path is not None:
            output_file(path, path.name, endings)
    output_folder(options.redysim_layout, "--redysim-layout")


def _keep_files(options: argparse.Namespace, resources: Sequence[Path]) -> None:
    """Raises UserError if --csv would overwrite another file than results; `resources`: tables of the model."""
    from build_fmu.run.signals import tables_of
    from build_fmu.run.tables import keep_other_files

    if options.csv:
        keep_other_files(options.csv, [*tables_of(options.input), *resources])


def _model_of_layout(fmu: Path) -> Description:
    """Returns the model in the FMU; raises UserError if ReDySim's files cannot hold its joints."""
    from build_fmu.model.resources import model_in
    from build_fmu.run.redysim_layout import columns_of

    model = model_in(fmu)
    if model is None:
        raise UserError(f"'{fmu}' contains no model file, which defines ReDySim's order of joints")
    columns_of(model)
    return model


def _write_layout(folder: Path, model: Description, result: Result) -> None:
    from build_fmu.run.redysim_layout import energy_errors, write_layout

    written = write_layout(folder, model, result)
    print(f"{folder}  {len(result.time)} rows in {', '.join(written)}")
    if errors := energy_errors(result):
        print(errors)


def _write_files(session: Session, result: Result, options: argparse.Namespace) -> None:
    from build_fmu.draw.plots import plot
    from build_fmu.run.tables import write_csv

    if options.csv:
        write_csv(options.csv, result)
        print(f"{options.csv}  {len(result.time)} rows, {len(result.names)} outputs")
    if options.plot:
        plot(options.plot, session, result, options.output)
        print(f"{options.plot}  t = {result.time[0]:g} to {result.time[-1]:g} s")


def _facts(session: Session, result: Result, options: argparse.Namespace) -> dict[str, object]:
    """Returns the values of the table in SI units, and the files."""
    outputs = {}
    for i, name in enumerate(result.names):
        column = result.values[:, i]
        unit = session.variables[name].unit or ""
        outputs[name] = {"start": column[0], "end": column[-1], "min": column.min(), "max": column.max(), "unit": unit}
    return {
        "name": session.description.modelName,
        "time": [result.time[0], result.time[-1]],
        "rows": len(result.time),
        "outputs": outputs,
        "files": [path for path in (options.csv, options.plot, options.redysim_layout) if path],
        "warnings": [*result.warnings, *result.remarks],
    }


def _simulated_file(options: argparse.Namespace) -> Path:
    """Returns FMU|MODEL, also after option values (`--input a=1 arm.fmu`)."""
    if options.target is not None:
        return options.target
    found = targets_after(options.input, options.start, options.output)
    if not found:
        raise InvalidArgument("simulate requires an FMU or a model file, for example `build-fmu simulate arm.fmu`")
    return found[0]


@contextmanager
def _as_fmu(target: Path, options: argparse.Namespace) -> Iterator[tuple[Path, list[str]]]:
    """Yields the FMU itself, or one built from a model file in a temporary folder, and the warnings that were printed.

    Raises UserError if --csv would overwrite a file that is read.
    """
    if target.suffix == ".fmu":
        _keep_files(options, [])
        yield target, []
        return
    from build_fmu.fmu.build import build_for_run
    from build_fmu.model.describe import describe

    model = describe(target)
    _keep_files(options, [target.parent / name for name in model.resources])
    warn(model.warnings)
    with tempfile.TemporaryDirectory() as folder:
        fmu = Path(folder) / f"{model.model_identifier}.fmu"
        build_for_run(model, target, fmu)
        yield fmu, model.warnings


@contextmanager
def _progress(session, settings) -> Iterator:
    """Yields the progress function, which takes the time reached (s)."""
    from rich.progress import TextColumn, TimeRemainingColumn

    from build_fmu.run.simulate import time_grid

    times = time_grid(session, settings)
    with bar(TextColumn("t = {task.completed:.3f} s"), TimeRemainingColumn()) as shown:
        task = shown.add_task(session.description.modelName, total=times[-1] - times[0])
        every = max(1, len(times) // 500)
        count = 0

        def reached(time: float) -> None:
            nonlocal count
            count += 1
            if count % every == 0:
                shown.update(task, completed=time - times[0])

        yield reached
