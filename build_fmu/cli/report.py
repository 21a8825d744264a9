"""`build-fmu report`: measures accuracy and CPU time of FMUs or models and writes tables, pages and diagrams."""

from __future__ import annotations

import argparse
from pathlib import Path

from build_fmu.cli.parser import positive, tolerance
from build_fmu.cli.streams import add_options, emit
from build_fmu.cli.terminal import SEVERAL, output_folder, sweep_bar, targets_after
from build_fmu.errors import InvalidArgument, UserError


def add(commands) -> None:
    """Adds the command and its arguments."""
    command = commands.add_parser(
        "report",
        help="measure accuracy against CPU time and recommend a method",
        description="Run method x tolerance x "
        "communication step size in a compiled master and write NAME_report.html, .md, .csv, .svg and .png.",
    )
    command.add_argument("targets", nargs="*", type=Path, metavar="FMU|MODEL", help="FMUs (.fmu) or model files (.toml)")
    command.add_argument("-o", "--output", type=Path, metavar="DIR", help="output folder (default: current folder)")
    command.add_argument("--stop", type=positive, metavar="T", help="duration of the motion in s (default: as in the model)")
    command.add_argument(
        "--step",
        type=positive,
        nargs="+",
        action="extend",
        metavar="H",
        help="communication step sizes in s, divisors of the largest (default: 0.1, 1 and 10 times that of the model)",
    )
    command.add_argument("--method", nargs="+", action="extend", metavar="NAME", help="methods (default: all)")
    command.add_argument("--rtol", type=tolerance, nargs="+", action="extend", metavar="R", help="tolerances (default: 1e-3 to 1e-12)")
    command.add_argument("--input", **SEVERAL, metavar="NAME=EXPR|FILE.csv", help="inputs, as for simulate")
    command.add_argument(
        "--reference", type=Path, metavar="CSV", help="reference motion: columns time (or t) and the FMU's outputs, or q1, q2, ..."
    )
    command.add_argument("--seconds", type=positive, default=120, metavar="S", help="time limit for all runs of a model, s (default: 120)")
    add_options(command, reports=True)
    command.set_defaults(run=run)


def run(options: argparse.Namespace) -> int:
    """Writes the reports and returns the exit code; targets that fail are reported at the end."""
    from build_fmu.report.make import Wish, files_of, make_report, write
    from build_fmu.report.pages import advice, run_rows
    from build_fmu.report.sweep import METHODS, TOLERANCES, known_method

    for method in options.method or ():
        known_method(method)
    targets = [*options.targets, *targets_after(options.input)]
    wish = Wish(
        options.stop,
        options.step or None,
        options.method or METHODS,
        options.rtol or TOLERANCES,
        options.input,
        options.reference,
        seconds=options.seconds,
    )
    if not targets:
        raise InvalidArgument("report requires an FMU or a model file, for example `build-fmu report arm.toml`")
    folder, failed, facts = output_folder(options.output), [], []
    with sweep_bar() as progress:
        for target in targets:
            try:
                name = f"{target.stem}_report"
                report = make_report(target, wish, progress(target), files_of(folder, name))
                files = write(report, folder, name)
                print(*files, *(f"  {line}" for line in advice(report)), sep="\n")
                facts.append({"target": target, "files": files, "unit": report.unit, "advice": advice(report), "runs": run_rows(report)})
            except InvalidArgument:
                raise
            except UserError as error:
                failed.append(str(error))
    if failed:
        raise UserError("\n".join(failed))
    emit(options, {"reports": facts})
    return 0
