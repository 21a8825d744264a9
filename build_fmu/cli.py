"""The command line `build-fmu`: import, build, check, simulate, show, report, stress. Errors are one sentence on stderr and exit code 1."""

from __future__ import annotations

import argparse
import os
import sys
import tempfile
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path

from build_fmu import __version__, native
from build_fmu.build import build
from build_fmu.completion import SHELLS, script
from build_fmu.describe import Description, describe
from build_fmu.errors import UserError
from build_fmu.input_course import MODES
from build_fmu.inverse import inverse_of


def main(arguments: Sequence[str] | None = None) -> int:
    """Runs one command and returns the exit code."""
    parser = _parser()
    options = parser.parse_args(arguments)
    try:
        return options.run(options) or 0
    except UserError as error:
        print(error, file=sys.stderr)
        return 1
    except BrokenPipeError:
        # the reader of our output (head, less) has enough
        sys.stderr.close()
        return 1
    except KeyboardInterrupt:
        print("stopped", file=sys.stderr)
        return 130


def _build(options: argparse.Namespace) -> int:
    if options.inverse:
        with inverse_of(options.model) as (model, source):
            return _pack(model, source, options)
    return _pack(describe(options.model), options.model, options)


def _pack(model: Description, source: Path, options: argparse.Namespace) -> int:
    # as the model file is called, whatever the model calls itself
    name = f"{options.model.stem}{'_inverse' if options.inverse else ''}.fmu"
    target = options.output or Path(name)
    if target.is_dir():
        target = target / name
    _warn(model.warnings)
    if options.specialise:
        if options.platforms != ["linux64"]:
            raise UserError("--specialise compiles for this machine alone: leave out --platforms")
        print("compiling a library for this scene, about a minute the first time", file=sys.stderr)
    built = build(model, source, target, show=not options.no_show, specialised=options.specialise, platforms=options.platforms)
    if built.specialised:
        print(built.specialised)
    if built.no_page:
        print(f"note: the FMU carries no page that plays it, because {built.no_page}", file=sys.stderr)
    if built.model is not model:
        from build_fmu.report.pages import duration

        rtol = next(v.start for v in built.model.variables if v.name == "solver.rtol")
        experiment = model.default_experiment
        steps = f"{duration(experiment['step_size'] / 10)} to {duration(experiment['stop_time'])}"
        print(f"rtol {rtol:g} keeps target_error = {model.report['target_error']:g} for communication steps of {steps}")
    if options.report:
        from build_fmu.report import command
        from build_fmu.report.pages import advice

        with command.bar() as progress:
            report = command.put_into(target, built.model, options.model, progress(target), built.specialised)
        print("\n".join(advice(report)))
    counts = [(len(model.select(kind)), kind) for kind in ("input", "output", "parameter")]
    print(f"{target}  {target.stat().st_size / 1024:.0f} kB, {', '.join(f'{n} {kind}' + ('' if n == 1 else 's') for n, kind in counts)}")
    return 0


def _import(options: argparse.Namespace) -> int:
    from build_fmu.importers import command

    return command.run(options)


def _show(options: argparse.Namespace) -> int:
    from build_fmu.show import command

    return command.run(options)


def _report(options: argparse.Namespace) -> int:
    from build_fmu.report import command

    return command.run(options)


def _stress(options: argparse.Namespace) -> int:
    from build_fmu.stress import command

    return command.run(options)


def _check(options: argparse.Namespace) -> int:
    from build_fmu.tables import model_summary

    model = describe(options.model)
    _terminal().print(model_summary(model, options.model))
    _warn(model.warnings)
    return 0


def _simulate(options: argparse.Namespace) -> int:
    from build_fmu.plots import FORMATS, plot
    from build_fmu.session import Session
    from build_fmu.redysim_layout import columns_of, described, write_layout
    from build_fmu.simulate import Settings, select_outputs, simulate
    from build_fmu.tables import final_values, keep_other_files, write_csv

    target = _simulated_file(options)
    # a wrong file name shows before the run, not after
    for path, endings in ((options.csv, (".csv",)), (options.plot, FORMATS)):
        if path is not None and path.suffix.lower() not in endings:
            raise UserError(f"'{path}' must end in {' or '.join(endings)}")
    if options.csv:
        keep_other_files(options.csv, options.input)
    if options.redysim_layout and options.redysim_layout.is_file():
        raise UserError(f"'{options.redysim_layout}' is a file: --redysim-layout needs the name of a folder")
    with _as_fmu(target) as fmu, Session(fmu) as session:
        model = described(fmu) if options.redysim_layout else None
        if model:
            columns_of(model)  # what ReDySim does not know shows before the run
        chosen = select_outputs(session, options.output)
        # the layout needs columns that --output may have left out
        recorded = list(dict.fromkeys([*select_outputs(session, ()), *chosen])) if model else chosen
        settings = Settings(options.stop, options.step, options.tolerance, options.start, options.input, recorded, options.interpolate)
        with _progress(session, settings) as progress:
            result = simulate(session, settings, progress)
        _warn([*result.warnings, *result.remarks])
        if model:
            written = write_layout(options.redysim_layout, model, result)
            print(f"{options.redysim_layout}  {len(result.time)} rows in {', '.join(written)}")
        result = result.only(chosen)
        if options.csv:
            write_csv(options.csv, result)
            print(f"{options.csv}  {len(result.time)} rows, {len(result.names)} outputs")
        if options.plot:
            plot(options.plot, session, result, options.output)
            print(f"{options.plot}  t = {result.time[0]:g} to {result.time[-1]:g} s")
        if not (options.csv or options.plot or model):
            _terminal().print(final_values(session, result))
    return 0


def _simulated_file(options: argparse.Namespace) -> Path:
    """Returns FMU|MODEL, also when it stands after a list (`--input a=1 arm.fmu`)."""
    if options.target is not None:
        return options.target
    for values in (options.input, options.start, options.output):
        if values and "=" not in values[-1] and values[-1].endswith((".fmu", ".toml")):
            return Path(values.pop())
    raise UserError("simulate needs an FMU or a model file, for example `build-fmu simulate arm.fmu`")


@contextmanager
def _as_fmu(target: Path) -> Iterator[Path]:
    """Yields the FMU itself, or one built from a model file in a temporary folder."""
    if target.suffix == ".fmu":
        yield target
        return
    model = describe(target)
    _warn(model.warnings)
    with tempfile.TemporaryDirectory() as folder:
        fmu = Path(folder) / f"{model.model_identifier}.fmu"
        build(model, target, fmu)
        yield fmu


@contextmanager
def _progress(session, settings) -> Iterator:
    """Yields a function of the time reached (s) that moves a bar on stderr."""
    from rich.console import Console
    from rich.progress import BarColumn, Progress, TextColumn, TimeRemainingColumn

    from build_fmu.simulate import time_grid

    times = time_grid(session, settings)
    look = (TextColumn("{task.description}"), BarColumn(), TextColumn("t = {task.completed:.3f} s"), TimeRemainingColumn())
    screen = Console(stderr=True)
    with Progress(*look, console=screen, transient=True, disable=not screen.is_terminal) as bar:
        task = bar.add_task(session.description.modelName, total=times[-1] - times[0])
        every = max(1, len(times) // 500)
        count = 0

        def reached(time: float) -> None:
            nonlocal count
            count += 1
            if count % every == 0:
                bar.update(task, completed=time - times[0])

        yield reached


def _terminal():
    """Returns a rich console on stdout; a file or a pipe gets wide lines."""
    from rich.console import Console

    return Console() if sys.stdout.isatty() else Console(width=160)


def _warn(warnings: Sequence[str]) -> None:
    for line in warnings:
        print(line, file=sys.stderr)


def _platforms(text: str) -> list[str]:
    platforms = list(dict.fromkeys(text.split(",")))
    for platform in platforms:
        if platform not in native.LIBRARIES:
            raise argparse.ArgumentTypeError(f"there is no platform '{platform}', only {', '.join(native.LIBRARIES)}")
    return platforms


def _parser() -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(prog="build-fmu", description="From a DH model file to a running FMU (FMI 2.0 co-simulation).",
                                     epilog="For example: build-fmu import arm.urdf; build-fmu show arm.toml; build-fmu build arm.toml. "
                                     "build-fmu COMMAND --help says more.")
    parser.add_argument("--version", action="version", version=f"build-fmu {__version__}")
    commands = parser.add_subparsers(title="commands", required=True, metavar="COMMAND")

    command = commands.add_parser("build", help="pack a model file into an FMU; needs no compiler")
    command.add_argument("model", type=Path, metavar="MODEL", help="model file (.toml)")
    command.add_argument("-o", "--output", type=Path, metavar="FMU", help="file or folder to write (default: here, MODEL's name with .fmu)")
    command.add_argument("--inverse", action="store_true", help="the inverse of the model, MODEL_inverse.fmu: joints take motions and say which "
                         "torques they need")
    command.add_argument("--no-show", action="store_true", help="leave out the page that plays the default experiment (documentation/run.html)")
    command.add_argument("--report", action="store_true", help="put what accuracy costs into the FMU's documentation (takes a minute)")
    command.add_argument("--specialise", action="store_true", help="compile a library for this scene alone: smaller and faster; needs the source "
                         "tree, CMake and a C++ compiler")
    command.add_argument("--platforms", type=_platforms, default=["linux64"], metavar="LIST", help=f"which systems the FMU runs on, of "
                         f"{', '.join(native.LIBRARIES)}, separated by commas (default: linux64)")
    command.set_defaults(run=_build)

    command = commands.add_parser("import", help="write a model file from a URDF, a DH table, ReDySim's files or a scene",
                                  description="Write a model file from a URDF (.urdf), a DH table (.csv, .xlsx), ReDySim's inputs.m or inputs.mat or their "
                                  "folder, or a scene (.json). What it cannot hold is listed.")
    command.add_argument("source", type=Path, metavar="FILE", help="what to import")
    command.add_argument("-o", "--output", type=Path, metavar="MODEL", help="file or folder to write (default: here, FILE's name with .toml)")
    command.add_argument("--name", metavar="NAME", help="name of the model and its file (default: the one in FILE, else FILE's own)")
    command.add_argument("--force", action="store_true", help="write over an existing model file")
    command.add_argument("--loop", action="append", default=[], metavar="LINK:x,y,z=LINK:x,y,z", help="ReDySim: two points that coincide (each in its "
                         "link's frame, m), or a TOML file with [[loop]] tables; repeat it for each loop")
    command.add_argument("--pivot", action="append", default=[], metavar="LINK=x,y,z", help="ReDySim: where a link stands on the ground (m)")
    command.add_argument("--snap", action="store_true", help="URDF: make angles such as 1.5708 exact multiples of 90 degrees")
    command.add_argument("--frames", action="store_true", help="URDF: keep the frames of its links as [[frame]] tables, with outputs")
    command.add_argument("--floating", action="store_true", help="URDF: let the root link float free instead of standing on the ground")
    command.add_argument("--stops", type=float, metavar="STIFFNESS", help="URDF, DH table: make the limits of joints stops of this stiffness (N m/rad, N/m)")
    command.add_argument("--dh", choices=("modified", "standard"), help="DH table: which convention (modified: Craig, Khalil; standard: distal)")
    command.add_argument("--angles", choices=("rad", "deg"), help="DH table: unit of the angles, where its head does not say")
    command.set_defaults(run=_import)

    command = commands.add_parser("check", help="read a model file and say what it holds")
    command.add_argument("model", type=Path, metavar="MODEL", help="model file (.toml)")
    command.set_defaults(run=_check)

    command = commands.add_parser("simulate", help="run an FMU or a model file", description="Run an FMU or a model file. Without --csv and "
                                  "--plot, print a table of values and write nothing. Values are in SI units and radians.")
    command.add_argument("target", nargs="?", type=Path, metavar="FMU|MODEL", help="FMU (.fmu) or model file (.toml)")
    command.add_argument("--stop", type=float, metavar="T", help="stop time in s (default: the FMU's own)")
    command.add_argument("--step", type=float, metavar="H", help="communication step in s (default: the FMU's own)")
    command.add_argument("--tolerance", type=float, metavar="R", help="relative tolerance; may tighten the model's, never loosen it")
    several = {"nargs": "+", "action": "extend", "default": []}
    command.add_argument("--start", **several, metavar="NAME=VALUE", help="start values of parameters, for example joint1.q0=pi/2")
    command.add_argument("--input", **several, metavar="NAME=EXPR|FILE.csv",
                         help="inputs: an expression of t such as 'joint1.tau=2*sin(t) if t < 1 else 0', or a CSV with a column 'time'")
    command.add_argument("--interpolate", choices=MODES, default="expressions", help="inputs that move during a communication step: none (all hold), "
                         "expressions (default), or all (CSV files too, linear between rows)")
    command.add_argument("--output", **several, metavar="NAME", help="outputs to record, * allowed (default: all)")
    command.add_argument("--csv", type=Path, metavar="OUT.csv", help="write the record, 17 digits")
    command.add_argument("--plot", type=Path, metavar="OUT.png", help="draw the record (.png, .svg, .pdf)")
    command.add_argument("--redysim-layout", type=Path, metavar="DIR", help="write timevar.dat, statevar.dat, envar.dat, tor.dat as ReDySim does")
    command.set_defaults(run=_simulate)

    command = commands.add_parser("report", help="what accuracy costs: error against run time, with advice", description="Run method x tolerance x "
                                  "communication step in a compiled master and write NAME_report.html, .md, .csv, .svg and .png.")
    command.add_argument("targets", nargs="*", type=Path, metavar="FMU|MODEL", help="what to sweep")
    command.add_argument("-o", "--output", type=Path, metavar="DIR", help="folder to write into (default: here)")
    command.add_argument("--stop", type=float, metavar="T", help="length of the motion in s (default: the model's own)")
    command.add_argument("--step", type=float, nargs="+", action="extend", metavar="H", help="communication steps in s that divide the longest of them "
                         "(default: the model's own, a tenth and ten times of it)")
    command.add_argument("--method", nargs="+", action="extend", metavar="NAME", help="methods (default: all)")
    command.add_argument("--rtol", type=float, nargs="+", action="extend", metavar="R", help="tolerances (default: 1e-3 to 1e-12)")
    command.add_argument("--input", **several, metavar="NAME=EXPR|FILE.csv", help="inputs, as for simulate")
    command.add_argument("--reference", type=Path, metavar="CSV", help="the true motion: a column time (or t), then the FMU's outputs, or q1, q2, ...")
    command.add_argument("--seconds", type=float, default=120, metavar="S", help="bound on all runs of a target together (default: 120)")
    command.set_defaults(run=_report)

    command = commands.add_parser("stress", help="run extreme cases made from models and say how they went", description="Make extreme cases from each "
                                  "model, run each in a process of its own, and write stress.html, .md, .csv, .svg and .png.")
    command.add_argument("models", nargs="+", type=Path, metavar="MODEL", help="model files (.toml)")
    command.add_argument("-o", "--output", type=Path, metavar="DIR", help="folder to write into (default: here)")
    command.add_argument("--only", nargs="+", action="extend", default=[], metavar="WORD", help="groups of cases whose name holds a word, such as stiff")
    command.add_argument("--method", metavar="NAME", help="solver method (default: the model's own)")
    command.add_argument("--seconds", type=float, default=2, metavar="S", help="computing that each run may take (default: 2)")
    command.add_argument("--jobs", type=int, default=len(os.sched_getaffinity(0)), metavar="N", help="runs side by side (default: one a processor)")
    command.set_defaults(run=_stress)

    command = commands.add_parser("show", help="write a page that plays a run: the mechanism beside linked plots", description="Write one HTML file that "
                                  "plays a run in any browser, without network. An FMU or a model file is run first; with a CSV its record is played.")
    command.add_argument("targets", nargs="*", type=Path, metavar="FMU|MODEL|CSV", help="what to run, a record to play, or both")
    command.add_argument("-o", "--output", type=Path, metavar="PAGE", help="file to write (default: NAME.html here)")
    command.add_argument("--stop", type=float, metavar="T", help="stop time in s (default: the FMU's own)")
    command.add_argument("--step", type=float, metavar="H", help="time between two pictures in s (default: the FMU's own, or a part of it that gives 250 pictures)")
    command.add_argument("--start", **several, metavar="NAME=VALUE", help="start values, as for simulate")
    command.add_argument("--input", **several, metavar="NAME=EXPR|FILE.csv", help="inputs, as for simulate")
    command.add_argument("--gif", type=Path, metavar="FILM", help="write a film (.gif) for reports; a page only with -o")
    command.add_argument("--mp4", type=Path, metavar="FILM", help="the same as .mp4, by the program ffmpeg")
    command.add_argument("--speed", type=float, default=1.0, metavar="X", help="of a film: seconds of the run in a second (default: 1)")
    command.add_argument("--rate", type=float, default=20.0, metavar="N", help="of a film: pictures in a second (default: 20)")
    command.set_defaults(run=_show)

    command = commands.add_parser("completion", help="print what a shell needs to complete commands and options",
                                  description="Print the script; for bash, put this into ~/.bashrc: eval \"$(build-fmu completion bash)\"")
    command.add_argument("shell", choices=SHELLS)
    command.set_defaults(run=lambda options: print(script(options.shell, _parser()), end=""))
    return parser
