"""Writes results as a CSV file or as a table on the terminal."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from build_fmu.errors import UserError
from build_fmu.files import whole_file
from build_fmu.run.session import Session
from build_fmu.run.simulate import Result


def write_csv(path: Path, result: Result) -> None:
    """Writes `time` (s) and the outputs in SI units, 17 significant digits, so each number can be read back exactly."""

    def write(temporary: Path) -> None:
        with temporary.open("w", encoding="utf-8", newline="\n") as file:
            file.write(",".join(["time", *map(_quoted, result.names)]) + "\n")
            for time, row in zip(result.time, result.values, strict=True):
                file.write(",".join(f"{x:.17g}" for x in (time, *row)) + "\n")

    whole_file(path, write)


def keep_inputs(paths: Sequence[Path], inputs: Sequence[Path]) -> None:
    """Raises UserError if an output would overwrite an input."""
    for path in paths:
        if any(name.resolve() == path.resolve() for name in inputs):
            raise UserError(f"'{path}' is an input of this run: choose another output file")


def keep_other_files(path: Path, inputs: Sequence[Path]) -> None:
    """Raises UserError if the output would overwrite an input or a file that does not contain results."""
    keep_inputs([path], inputs)
    try:
        with path.open(encoding="utf-8", errors="replace") as file:
            head = file.readline(5)
    except OSError:
        return  # does not exist, or writing reports the error
    if head not in ("", "time,", "time\n"):
        raise UserError(f"'{path}' exists and does not contain simulation results: choose another name or remove it")


def _quoted(name: str) -> str:
    return '"' + name.replace('"', '""') + '"' if any(c in name for c in ',"\n') else name


def final_values(session: Session, result: Result):
    """Returns a rich table of every output at the start and at the end, in display units."""
    from rich import box
    from rich.markup import escape
    from rich.table import Table

    table = Table(
        box=box.SIMPLE_HEAD,
        padding=(0, 1, 0, 0),
        title=f"{escape(session.description.modelName)}, t = {result.time[-1]:g} s",
        title_justify="left",
    )
    for head, justify in (("output", "left"), ("start", "right"), ("end", "right"), ("min", "right"), ("max", "right"), ("unit", "left")):
        table.add_column(head, justify=justify, no_wrap=True)
    for i, name in enumerate(result.names):
        shown = session.display(name)
        column = result.values[:, i] * shown.factor + shown.offset
        numbers = (column[0], column[-1], column.min(), column.max())
        table.add_row(escape(name), *(f"{x + 0.0:.5g}" for x in numbers), shown.unit)
    return table
