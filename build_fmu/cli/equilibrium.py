"""`build-fmu equilibrium`: the rest pose of a model under constant inputs."""

from __future__ import annotations

import argparse
import re

import numpy as np

from build_fmu.cli.states import add_state_options, model_at_state, print_matrix, with_units
from build_fmu.cli.streams import emit
from build_fmu.run.signals import parse_start

POSITION = re.compile(r"(.*\.(?:q|quaternion))0(\[\d\])?")


def add(commands) -> None:
    """Adds the command and its arguments."""
    command = commands.add_parser(
        "equilibrium",
        help="print the rest pose of a model under constant inputs",
        description="Print the rest pose near the start pose, under gravity, springs, contacts and constant inputs, in SI units and rad.",
    )
    add_state_options(command, ())
    command.set_defaults(run=run)


def run(options: argparse.Namespace) -> int:
    """Prints the pose."""
    with model_at_state(options) as (model, x, _, facts):
        at_rest = _positions(model.start_values(x))
        emit(options, {**facts, "positions": at_rest})
        model.parameters = parse_start(options.start)
        start = _positions(model.start_values())
        values = np.column_stack([list(start.values()), list(at_rest.values())])
        print_matrix(f"{model.description.model_name}: rest pose", with_units(model, at_rest), ["start", "at rest"], values)
    return 0


def _positions(starts: dict[str, float]) -> dict[str, float]:
    """Returns the positions among start values, without the 0 of their names."""
    found = {name: POSITION.fullmatch(name) for name in starts}
    return {"".join(match.groups("")): starts[name] for name, match in found.items() if match}
