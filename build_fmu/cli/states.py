"""The state at which `linearise`, `modes` and `equilibrium` evaluate a model, and the tables that they print."""

from __future__ import annotations

import argparse
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from build_fmu.cli.streams import add_options
from build_fmu.cli.terminal import SEVERAL, console, warn
from build_fmu.errors import InvalidArgument, unknown
from build_fmu.run.signals import number_of, parse_start

if TYPE_CHECKING:
    from build_fmu.library.model import Model

BLOCK = 8  # columns


def add_state_options(command: argparse.ArgumentParser, places: Sequence[str] = ("start", "equilibrium", "held")) -> None:
    """Adds the model file and the options of its state."""
    command.add_argument("model", type=Path, metavar="MODEL", help="model file (.toml)")
    command.add_argument("--start", **SEVERAL, metavar="NAME=VALUE", help="start values of parameters, for example joint1.q0=pi/2")
    command.add_argument("--input", **SEVERAL, metavar="NAME=VALUE", help="constant inputs, for example joint1.tau=2 (default: the start)")
    if places:
        command.add_argument(
            "--at",
            choices=places,
            default=places[0],
            help="start: the start state; equilibrium: the rest pose near it; held: the start pose with inputs that hold it "
            f"(default: {places[0]})",
        )
    add_options(command, reports=True)


@contextmanager
def model_at_state(options: argparse.Namespace) -> Iterator[tuple[Model, np.ndarray, np.ndarray, dict]]:
    """Yields the model of the options, its state x, its inputs u and the facts of `--json`; raises UserError.

    Prints the warnings of the model first and the largest rate of the state last.
    """
    from build_fmu.library.model import load

    with load(options.model) as model:
        warn(model.description.warnings)
        x, u = given_state(model, options)
        facts = {"name": model.description.model_name, "states": model.states, "x": x.tolist(), "inputs": model.inputs, "u": u.tolist()}
        # a sampled controller has no rates at any other state than the start
        rates = {} if model.sample_time else dict(zip(with_units(model, model.states, rates=True), abs(model.slope(x, u)), strict=True))
        worst = max(rates, key=rates.get, default=None)
        yield model, x, u, facts | ({"largest_rate": rates[worst]} if worst else {})
        if worst:
            print(f"largest velocity or acceleration at this state: {worst} {rates[worst]:.1e}")


def with_units(model: Model, names: Sequence[str], rates: bool = False) -> list[str]:
    """Returns the names with units, as `joint1.q [rad]`, or with `rates` those of their time derivatives, as `joint1.q' [rad/s]`."""
    units = {v.name: v.unit or "" for v in model.description.variables}
    if rates:
        return [f"{n}' [{units[n]}2]" if units[n].endswith("/s") else f"{n}' [{units[n] or 1}/s]" for n in names]
    return [f"{n} [{units[n]}]" if units[n] else n for n in names]


def given_state(model: Model, options: argparse.Namespace) -> tuple[np.ndarray, np.ndarray]:
    """Returns state and inputs; raises UserError."""
    model.parameters = parse_start(options.start)
    u = model.start_inputs()
    for name, text in parse_start(options.input, "constant input").items():
        if name not in model.inputs:
            raise unknown("input", name, model.inputs)
        u[model.inputs.index(name)] = number_of(text, f"input '{name}'")
    where = getattr(options, "at", "equilibrium")
    if where == "equilibrium":
        return model.start_at_rest(u), u
    if where == "held":
        if options.input:
            raise InvalidArgument("--at held finds the inputs: remove --input")
        x = model.without_velocity()
        return x, model.hold(x)
    return model.start(), u


def print_matrix(title: str, rows: Sequence[str], columns: Sequence[str], values: np.ndarray) -> None:
    """Prints a matrix with names of rows and columns, in blocks that fit a line."""
    from rich import box
    from rich.markup import escape
    from rich.table import Table

    for first in range(0, len(columns), BLOCK):
        table = Table(box=box.SIMPLE_HEAD, title=escape(title), title_justify="left")
        table.add_column("")
        for name in columns[first : first + BLOCK]:
            table.add_column(escape(name.replace(" [", "\n[")), justify="right")
        for name, row in zip(rows, values[:, first : first + BLOCK], strict=True):
            table.add_row(escape(name), *(f"{x:.6g}" for x in row))
        console().print(table)
