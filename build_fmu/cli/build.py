"""`build-fmu build`: packs a model file into an FMU."""

from __future__ import annotations

import argparse
import sys
from pathlib import Path

from build_fmu import native
from build_fmu.cli.terminal import sweep_bar, warn
from build_fmu.errors import UserError
from build_fmu.model.describe import Description, describe
from build_fmu.model.inverse import inverse_of


def add(commands) -> None:
    """Adds the command and its arguments."""
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
    command.set_defaults(run=run)


def run(options: argparse.Namespace) -> int:
    """Writes the FMU."""
    if options.inverse:
        with inverse_of(options.model) as (model, source):
            return _pack(model, source, options)
    return _pack(describe(options.model), options.model, options)


def _pack(model: Description, source: Path, options: argparse.Namespace) -> int:
    from build_fmu.fmu.build import build

    # as the model file is called, whatever the model calls itself
    name = f"{options.model.stem}{'_inverse' if options.inverse else ''}.fmu"
    target = options.output or Path(name)
    if target.is_dir():
        target = target / name
    warn(model.warnings)
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
        from build_fmu.fmu.report_pages import put_into
        from build_fmu.report.pages import advice

        with sweep_bar() as progress:
            report = put_into(target, built.model, options.model, progress(target), built.specialised)
        print("\n".join(advice(report)))
    counts = [(len(model.select(kind)), kind) for kind in ("input", "output", "parameter")]
    print(f"{target}  {target.stat().st_size / 1024:.0f} kB, {', '.join(f'{n} {kind}' + ('' if n == 1 else 's') for n, kind in counts)}")
    return 0


def _platforms(text: str) -> list[str]:
    platforms = list(dict.fromkeys(text.split(",")))
    for platform in platforms:
        if platform not in native.LIBRARIES:
            raise argparse.ArgumentTypeError(f"there is no platform '{platform}', only {', '.join(native.LIBRARIES)}")
    return platforms
