"""`build-fmu linearise`: state matrices of a model at a state."""

from __future__ import annotations

import argparse

import numpy as np

from build_fmu.cli.parser import positive
from build_fmu.cli.states import add_state_options, model_at_state, print_matrix, with_units
from build_fmu.cli.streams import emit

ROUNDING = 1e-14  # of the largest entry of its row and of that of its column


def add(commands) -> None:
    """Adds the command and its arguments."""
    command = commands.add_parser(
        "linearise",
        help="print the state matrices of a model",
        description="Print A and B of x' = A x + B u at the start state, in SI units and rad; with --step those of a step.",
    )
    add_state_options(command)
    command.add_argument("--step", type=positive, metavar="H", help="derivatives of the state after H seconds, with the inputs held")
    command.set_defaults(run=run)


def run(options: argparse.Namespace) -> int:
    """Prints the matrices."""
    with model_at_state(options) as (model, x, u, facts):
        A, B = model.linearise(x, u, options.step)
        emit(options, {**facts, "step": options.step, "A": A.tolist(), "B": B.tolist()})
        rows = with_units(model, model.states, rates=options.step is None)
        print_matrix("A", rows, with_units(model, model.states), _without_rounding(A))
        print_matrix("B", rows, with_units(model, model.inputs), _without_rounding(B))
    return 0


def _without_rounding(matrix: np.ndarray) -> np.ndarray:
    """Returns the matrix with 0 for entries that are rounding in any units."""
    sizes = abs(matrix)
    largest = np.minimum(sizes.max(axis=1, initial=0, keepdims=True), sizes.max(axis=0, initial=0))
    return np.where(sizes <= ROUNDING * largest, 0, matrix)
