"""`build-fmu modes`: eigenfrequencies and mode shapes of a model at rest."""

from __future__ import annotations

import argparse
import sys

import numpy as np

from build_fmu.cli.states import add_state_options, model_at_state, print_matrix, with_units
from build_fmu.cli.streams import emit


def add(commands) -> None:
    """Adds the command and its arguments."""
    command = commands.add_parser(
        "modes",
        help="print eigenfrequencies and mode shapes of a model at rest",
        description="Print the undamped modes of small motions about a state at rest, by increasing frequency.",
    )
    add_state_options(command, ("equilibrium", "held", "start"))
    command.set_defaults(run=run)


def run(options: argparse.Namespace) -> int:
    """Prints the modes."""
    with model_at_state(options) as (model, x, u, facts):
        modes = model.modes(x, u)
        shapes = modes.shapes.T.tolist()
        rows = {"frequencies": modes.frequencies.tolist(), "squares": modes.squares.tolist(), "coordinates": modes.coordinates}
        rows["resolution"] = modes.resolution
        emit(options, {**facts, **rows, "shapes": shapes})
        at = np.array([x[model.states.index(n)] for n in modes.coordinates])
        heads = [_frequency(square) for square in modes.squares]
        names = with_units(model, modes.coordinates)
        # without a resolution all modes are free motions
        unresolved = int((modes.squares == 0).sum())
        if unresolved and modes.resolution > 0:
            what = f"modes below {modes.resolution:.3g} Hz are shown as 0 Hz ({unresolved} of {len(modes.squares)})"
            why = "rounding errors of the highest frequency hide the difference between a slow mode and a free motion"
            print(f"{what}: {why}", file=sys.stderr)
        print_matrix(f"{model.description.model_name}: modes", names, ["pose", *heads], np.column_stack([at, modes.shapes]))
    return 0


def _frequency(square: float) -> str:
    if square < 0:
        return f"unstable {1 / np.sqrt(-square):.3g} s"
    return f"{np.sqrt(square) / (2 * np.pi):.6g} Hz"
