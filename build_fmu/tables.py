"""What a run or a check leaves behind as numbers: a CSV file, or short tables on the terminal."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from build_fmu.archive import whole_file
from build_fmu.describe import Description
from build_fmu.errors import UserError
from build_fmu.session import Session
from build_fmu.simulate import Result

MOST_LINKS_IN_TABLE = 200  # beyond this many plain lines: a table of 3 000 rows takes seconds


def write_csv(path: Path, result: Result) -> None:
    """Writes `time` (s) and the outputs in SI units, 17 significant digits: each number reads back exactly."""

    def write(temporary: Path) -> None:
        with temporary.open("w", encoding="utf-8", newline="\n") as file:
            file.write(",".join(["time", *map(_quoted, result.names)]) + "\n")
            for time, row in zip(result.time, result.values, strict=True):
                file.write(",".join(f"{x:.17g}" for x in (time, *row)) + "\n")

    whole_file(path, write)


def keep_other_files(path: Path, inputs: Sequence[str]) -> None:
    """Raises UserError where a record would take the place of something else: of an input, or of a file that is no record."""
    if any(Path(name).resolve() == path.resolve() for name in inputs):
        raise UserError(f"'{path}' is an input of this run: choose another name for the record")
    try:
        with path.open(encoding="utf-8", errors="replace") as file:
            head = file.readline(5)
    except OSError:
        return  # not there, or what is wrong with it is said on writing
    if head not in ("", "time,", "time\n"):
        raise UserError(f"'{path}' exists and is no record of a run: choose another name, or remove it")


def _quoted(name: str) -> str:
    return '"' + name.replace('"', '""') + '"' if any(c in name for c in ',"\n') else name


def final_values(session: Session, result: Result):
    """Returns a rich table of every output at the start and at the end, in display units."""
    from rich import box
    from rich.markup import escape
    from rich.table import Table

    table = Table(box=box.SIMPLE_HEAD, padding=(0, 1, 0, 0), title=f"{escape(session.description.modelName)}, t = {result.time[-1]:g} s", title_justify="left")
    for head, justify in (("output", "left"), ("start", "right"), ("end", "right"), ("least", "right"), ("most", "right"), ("unit", "left")):
        table.add_column(head, justify=justify, no_wrap=True)
    for i, name in enumerate(result.names):
        shown = session.display(name)
        column = result.values[:, i] * shown.factor + shown.offset
        numbers = (column[0], column[-1], column.min(), column.max())
        table.add_row(escape(name), *(f"{x + 0.0:.5g}" for x in numbers), shown.unit)
    return table


def _aligned(rows: Sequence[tuple[str, ...]]) -> list[str]:
    """Lines of plain columns."""
    widths = [max(map(len, column)) for column in zip(*rows, strict=True)]
    return ["  " + "  ".join(cell.ljust(width) for cell, width in zip(row, widths, strict=True)).rstrip() for row in rows]


def model_summary(model: Description, file: Path):
    """Returns the rich tables of `check`: the mechanism, then the counts of what the FMU shows."""
    from rich import box
    from rich.console import Group
    from rich.markup import escape
    from rich.table import Table
    from rich.text import Text

    links = model.drawing["links"]
    title, heads = f"{escape(model.model_name)} ({escape(str(file))})", ("link", "on", "joint", "mass [kg]", "origin [m]")
    rows = []
    for link in links:
        parent = "ground" if link["parent"] < 0 else links[link["parent"]]["name"]
        origin = "  ".join(f"{x + 0.0:.4g}" for x in (round(v, 12) for v in link["origin"]))
        rows.append((link["name"], parent, link["type"], f"{link['mass']:.6g}", origin))
    if len(rows) > MOST_LINKS_IN_TABLE:
        mechanism = Text.from_markup(f"[i]{title}[/i]\n\n").append("\n".join(_aligned([heads, *rows])))
    else:
        mechanism = Table(box=box.SIMPLE_HEAD, title=title, title_justify="left")
        for head, justify in zip(heads, ("left", "left", "left", "right", "right"), strict=True):
            mechanism.add_column(escape(head), justify=justify)
        for row in rows:
            mechanism.add_row(*map(escape, row))
    facts = Table(box=None, show_header=False, padding=(0, 2, 0, 1))
    moving = sum(link["type"] != "fixed" for link in links)
    counts = {
        "joints": f"{moving} moving, {len(links) - moving} fixed",
        "loops": str(len(model.drawing.get("loops", []))),
        "springs": str(len(model.drawing.get("springs", []))),
        "inputs": _some([v.name for v in model.select("input")]),
        "outputs": _some([v.name for v in model.select("output")]),
        "parameters": f"{len(model.select('parameter'))}, of them "
                      f"{sum(v.variability == 'tunable' for v in model.select('parameter'))} tunable",
        "total mass": f"{sum(link['mass'] for link in links):.6g} kg",
        "warnings": str(len(model.warnings)),
    }
    for name, text in counts.items():
        if text != "0" or name == "warnings":
            facts.add_row(name, escape(text))
    return Group(mechanism, facts)


def _some(names: list[str]) -> str:
    return f"{len(names)}: {', '.join(names[:4])}{', …' if len(names) > 4 else ''}" if names else "none"
