"""`build-fmu equilibrium`: the rest pose of a model under constant inputs."""

from __future__ import annotations

import argparse

import numpy as np

from build_fmu.cli.states import add_state_options, given_state, print_matrix
from build_fmu.cli.streams import add_options, emit
from build_fmu.cli.terminal import warn


def add(commands) -> None:
    """Adds the command and its arguments."""
    command = commands.add_parser(
        "equilibrium",
        help="print the rest pose of a model under constant inputs",
        description="Print the rest pose near the start pose, under gravity, springs, contacts and constant inputs, in SI units and rad.",
    )
    add_state_options(command, ())
    add_options(command, reports=True)
    command.set_defaults(run=run)


def run(options: argparse.Namespace) -> int:
    """Prints the pose."""
    from build_fmu.library.model import load

    with load(options.model) as model:
        warn(model.description.warnings)
        x, u = given_state(model, options)
        left = abs(model.slope(x, u)).max(initial=0)
        emit(
            options,
            {
                "name": model.description.model_name,
                "positions": dict(zip(model.positions, x[[model.states.index(n) for n in model.positions]].tolist(), strict=True)),
                "states": model.states,
                "x": x.tolist(),
                "inputs": model.inputs,
                "u": u.tolist(),
                "largest_rate": left,
            },
        )
        rows = [model.states.index(n) for n in model.positions]
        values = np.column_stack([model.start()[rows], x[rows]])
        print_matrix(f"{model.description.model_name}: rest pose", model.positions, ["start", "at rest"], values)
        print(f"largest velocity or acceleration there: {left:.1e}")
    return 0
