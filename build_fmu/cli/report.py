"""`build-fmu report`: sweeps FMUs or models and writes table, page and picture of each."""

from __future__ import annotations

import argparse
from pathlib import Path

from build_fmu.cli.terminal import SEVERAL, sweep_bar, targets_after
from build_fmu.errors import UserError


def add(commands) -> None:
    """Adds the command and its arguments."""
    command = commands.add_parser("report", help="what accuracy costs: error against run time, with advice", description="Run method x tolerance x "
                                  "communication step in a compiled master and write NAME_report.html, .md, .csv, .svg and .png.")
    command.add_argument("targets", nargs="*", type=Path, metavar="FMU|MODEL", help="what to sweep")
    command.add_argument("-o", "--output", type=Path, metavar="DIR", help="folder to write into (default: here)")
    command.add_argument("--stop", type=float, metavar="T", help="length of the motion in s (default: the model's own)")
    command.add_argument("--step", type=float, nargs="+", action="extend", metavar="H", help="communication steps in s that divide the longest of them "
                         "(default: the model's own, a tenth and ten times of it)")
    command.add_argument("--method", nargs="+", action="extend", metavar="NAME", help="methods (default: all)")
    command.add_argument("--rtol", type=float, nargs="+", action="extend", metavar="R", help="tolerances (default: 1e-3 to 1e-12)")
    command.add_argument("--input", **SEVERAL, metavar="NAME=EXPR|FILE.csv", help="inputs, as for simulate")
    command.add_argument("--reference", type=Path, metavar="CSV", help="the true motion: a column time (or t), then the FMU's outputs, or q1, q2, ...")
    command.add_argument("--seconds", type=float, default=120, metavar="S", help="bound on all runs of a target together (default: 120)")
    command.set_defaults(run=run)


def run(options: argparse.Namespace) -> int:
    """Writes the reports and returns the exit code: 1 where a target has no report."""
    from build_fmu.report.make import Wish, make_report, write
    from build_fmu.report.pages import advice
    from build_fmu.report.sweep import METHODS, TOLERANCES, known_method

    for method in options.method or ():
        known_method(method)
    for rtol in options.rtol or ():
        if not 0 < rtol < 1:
            raise UserError(f"a tolerance must be between 0 and 1, got {rtol:g}")
    targets = [*options.targets, *targets_after(options.input)]
    wish = Wish(options.stop, options.step or None, options.method or METHODS, options.rtol or TOLERANCES, options.input, options.reference,
                seconds=options.seconds)
    if not targets:
        raise UserError("report needs an FMU or a model file, for example `build-fmu report arm.toml`")
    failed = []
    with sweep_bar() as progress:
        for target in targets:
            try:
                report = make_report(target, wish, progress(target))
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
