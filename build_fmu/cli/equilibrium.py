"""`build-fmu equilibrium`: the rest pose of a model under constant inputs."""

from __future__ import annotations

import argparse

import numpy as np

from build_fmu.cli.states import add_state_options, facts_of_state, model_at_state, print_matrix
from build_fmu.cli.streams import emit


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
    with model_at_state(options) as (model, x, u):
        left = abs(model.slope(x, u)).max(initial=0)
        rows = [model.states.index(n) for n in model.positions]
        positions = dict(zip(model.positions, x[rows].tolist(), strict=True))
        emit(options, {**facts_of_state(model, x, u), "positions": positions, "largest_rate": left})
        values = np.column_stack([model.start()[rows], x[rows]])
        print_matrix(f"{model.description.model_name}: rest pose", model.positions, ["start", "at rest"], values)
        print(f"largest velocity or acceleration there: {left:.1e}")
    return 0
