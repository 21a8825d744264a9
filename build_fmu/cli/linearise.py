"""`build-fmu linearise`: state matrices of a model at a state."""

from __future__ import annotations

import argparse

from build_fmu.cli.parser import positive
from build_fmu.cli.states import add_state_options, given_state, print_matrix
from build_fmu.cli.streams import add_options, emit
from build_fmu.cli.terminal import warn


def add(commands) -> None:
    """Adds the command and its arguments."""
    command = commands.add_parser(
        "linearise",
        help="print the state matrices of a model",
        description="Print A and B of x' = A x + B u at the start state, in SI units and rad; with --step those of a step.",
    )
    add_state_options(command)
    command.add_argument("--step", type=positive, metavar="H", help="derivatives of the state after H seconds, with the inputs held")
    add_options(command, reports=True)
    command.set_defaults(run=run)


def run(options: argparse.Namespace) -> int:
    """Prints the matrices."""
    from build_fmu.library.model import load

    with load(options.model) as model:
        warn(model.description.warnings)
        x, u = given_state(model, options)
        A, B = model.linearise(x, u, options.step)
        facts = {"name": model.description.model_name, "step": options.step, "states": model.states, "inputs": model.inputs}
        emit(options, {**facts, "x": x.tolist(), "u": u.tolist(), "A": A.tolist(), "B": B.tolist()})
        print_matrix("A", model.states, model.states, A)
        print_matrix("B", model.states, model.inputs, B)
    return 0
