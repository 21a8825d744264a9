"""`build-fmu build`: builds the FMU of a model file."""

from __future__ import annotations

import argparse
import sys
from pathlib import Path

from build_fmu import native
from build_fmu.cli.streams import add_options, emit
from build_fmu.cli.terminal import output_file, sweep_bar, warn
from build_fmu.errors import InvalidArgument
from build_fmu.model.describe import Description, describe
from build_fmu.model.inverse import inverse_of


def add(commands) -> None:
    """Adds the command and its arguments."""
    command = commands.add_parser("build", help="build the FMU of a model file; needs no compiler")
    command.add_argument("model", type=Path, metavar="MODEL", help="model file (.toml)")
    command.add_argument(
        "-o", "--output", type=Path, metavar="FMU", help="output file or folder (default: MODEL's name with .fmu in the current folder)"
    )
    command.add_argument("--inverse", action="store_true", help="inverse dynamics (motion in, torques out): MODEL_inverse.fmu")
    command.add_argument("--fmi", type=int, choices=(2, 3), default=2, help="version of FMI (default: 2)")
    command.add_argument("--arrays", action="store_true", help="arrays such as q[n] in place of scalars (FMI 3.0 only)")
    command.add_argument("--no-show", action="store_true", help="omit the page that plays the default experiment (documentation/run.html)")
    command.add_argument(
        "--report", action="store_true", help="add the report on accuracy and CPU time to the FMU's documentation (takes a minute)"
    )
    command.add_argument(
        "--specialise",
        action="store_true",
        help="compile a library for this model, which is faster and often smaller; requires the source tree, CMake and a C++ compiler",
    )
    command.add_argument(
        "--platforms",
        type=_platforms,
        metavar="LIST",
        help=f"platforms of the FMU, separated by commas: {', '.join(native.LIBRARIES)} "
        f"(default: linux64, and {' and '.join(native.TRIED)} where their libraries are installed)",
    )
    add_options(command, reports=True)
    command.set_defaults(run=run)


def run(options: argparse.Namespace) -> int:
    """Writes the FMU."""
    if options.inverse:
        with inverse_of(options.model) as (model, source):
            return _pack(model, source, options)
    return _pack(describe(options.model), options.model, options)


def _pack(model: Description, source: Path, options: argparse.Namespace) -> int:
    from build_fmu.fmu.build import build

    # the name of the model file, not the name in it
    target = output_file(options.output, f"{options.model.stem}{'_inverse' if options.inverse else ''}.fmu", (".fmu",))
    warn(model.warnings)
    _check(options)
    if options.specialise:
        print("compiling a library for this model (one to seven minutes the first time)", file=sys.stderr)
    built = build(
        model,
        source,
        target,
        show=not options.no_show,
        specialised=options.specialise,
        platforms=options.platforms or (["linux64"] if options.specialise else native.platforms()),
        fmi=options.fmi,
        arrays=options.arrays,
    )
    warn(built.undrawn)
    if built.specialised:
        print(built.specialised)
    if built.no_page:
        print(f"note: the FMU has no page that plays it: {built.no_page}", file=sys.stderr)
    if model.no_model_exchange:
        print(f"note: {model.no_model_exchange}", file=sys.stderr)
    if built.model is not model:
        print(_selected_tolerance(model, built.model))
    if options.report:
        from build_fmu.fmu.report_pages import put_into
        from build_fmu.report.pages import advice

        with sweep_bar() as progress:
            report = put_into(target, built.model, options.model, progress(target), built.specialised)
        print("\n".join(advice(report)))
    remarks = [text for text in (built.specialised, built.no_page, model.no_model_exchange) if text]
    facts = {kind + "s": [v.name for v in model.select(kind)] for kind in ("input", "output", "parameter")}
    emit(options, {"fmu": target, "bytes": target.stat().st_size, **facts, "warnings": [*model.warnings, *built.undrawn], "notes": remarks})
    counts = [(len(model.select(kind)), kind) for kind in ("input", "output", "parameter")]
    print(f"{target}  {target.stat().st_size / 1024:.0f} kB, {', '.join(f'{n} {kind}' + ('' if n == 1 else 's') for n, kind in counts)}")
    return 0


def _check(options: argparse.Namespace) -> None:
    """Raises InvalidArgument for options that exclude each other."""
    if options.report and options.fmi == 3:
        raise InvalidArgument("--report supports FMI 2.0 only: remove it and run `build-fmu report` on the model file")
    if options.arrays and options.fmi != 3:
        raise InvalidArgument("--arrays: FMI 2.0 has scalars only; add --fmi 3")
    if options.specialise and native.HOST != "linux64":
        raise InvalidArgument("--specialise requires Linux on x86-64")
    if options.specialise and options.platforms not in (None, ["linux64"]):
        raise InvalidArgument("--specialise supports linux64 only: remove --platforms")


def _selected_tolerance(asked: Description, built: Description) -> str:
    """Returns the sentence on the tolerance that meets target_error."""
    from build_fmu.report.pages import duration

    rtol = next(v.start for v in built.variables if v.name == "solver.rtol")
    experiment = asked.default_experiment
    steps = f"{duration(experiment['step_size'] / 10)} to {duration(experiment['stop_time'])}"
    return f"rtol {rtol:g} meets target_error = {asked.report['target_error']:g} for communication step sizes of {steps}"


def _platforms(text: str) -> list[str]:
    platforms = list(dict.fromkeys(text.split(",")))
    for platform in platforms:
        if platform not in native.LIBRARIES:
            raise argparse.ArgumentTypeError(f"unknown platform '{platform}'; available: {', '.join(native.LIBRARIES)}")
    return platforms
