"""`build-fmu check`: checks a model file and prints a summary."""

from __future__ import annotations

import argparse
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

from build_fmu.cli.streams import add_options, emit
from build_fmu.cli.terminal import console, warn
from build_fmu.errors import listed
from build_fmu.model.describe import Description, describe

MOST_LINKS_IN_TABLE = 200  # plain lines for more links: a table of 3000 rows takes seconds

COUNTED = ("loops", "couplings", "springs", "contacts")
FEATURES = {"motion": "motion (prescribed, locked or inside spherical joints)"}


def add(commands) -> None:
    """Adds the command and its arguments."""
    command = commands.add_parser("check", help="check a model file and print a summary")
    command.add_argument("model", type=Path, metavar="MODEL", help="model file (.toml)")
    add_options(command, reports=True)
    command.set_defaults(run=run)


def run(options: argparse.Namespace) -> int:
    """Prints the summary."""
    from build_fmu.draw.shapes import with_solids

    model = describe(options.model)
    model = replace(model, warnings=[*model.warnings, *with_solids(model)[1]])
    console().print(_summary(model, options.model))
    emit(options, _facts(model, options.model))
    warn(model.warnings)
    return 0


def _facts(model: Description, file: Path) -> dict[str, object]:
    """Returns the summary as plain data."""
    links = model.drawing["links"]
    parents = {link["name"]: "ground" if link["parent"] < 0 else links[link["parent"]]["name"] for link in links}
    rows = [{"name": x["name"], "parent": parents[x["name"]], "joint": x["type"], "mass": x["mass"], "origin": x["origin"]} for x in links]
    counts = {kind: len(model.drawing.get(kind, [])) for kind in COUNTED}
    names = {f"{kind}s": [v.name for v in model.select(kind)] for kind in ("input", "output", "parameter")}
    total = sum(link["mass"] for link in links)
    return {"name": model.model_name, "file": file, "links": rows, **counts, **names, "total_mass": total, "warnings": model.warnings}


def _summary(model: Description, file: Path):
    """Returns the rich tables of `check`: the mechanism and the numbers of variables."""
    from rich import box
    from rich.console import Group
    from rich.markup import escape
    from rich.table import Table
    from rich.text import Text

    from build_fmu.report.sweep import METHODS

    links = model.drawing["links"]
    title, heads = f"{escape(model.model_name)} ({escape(str(file))})", ("link", "parent", "joint", "mass [kg]", "origin [m]")
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
    moving, fixed = model.joints
    counts = {
        "joints": f"{moving} moving, {fixed} fixed",
        **{kind: str(len(model.drawing.get(kind, []))) for kind in COUNTED},
        "features": ", ".join(FEATURES.get(name, name) for name in model.features if name not in (*METHODS, "taylor")) or "none",
        "gravity": "  ".join(f"{x:g}" for x in model.drawing["gravity"]) + " m/s²",
        "solver": _solver(model),
        "inputs": _some([v.name for v in model.select("input")]),
        "outputs": _some([v.name for v in model.select("output")]),
        "parameters": f"{len(model.select('parameter'))} ({sum(v.variability == 'tunable' for v in model.select('parameter'))} tunable)",
        "total mass": f"{sum(link['mass'] for link in links):.6g} kg",
        "warnings": str(len(model.warnings)),
    }
    for name, text in counts.items():
        if text != "0" or name == "warnings":
            facts.add_row(name, escape(text))
    return Group(mechanism, facts)


def _solver(model: Description) -> str:
    start = {v.name: v.start for v in model.variables if v.name in ("solver.method", "solver.rtol")}
    own = "; requires a library for this model: build-fmu build --specialise" if model.needs_own_library else ""
    return f"{start['solver.method']}, rtol {start['solver.rtol']:g}{own}"


def _some(names: list[str]) -> str:
    return f"{len(names)}: {listed(names)}" if names else "none"


def _aligned(rows: Sequence[tuple[str, ...]]) -> list[str]:
    """Returns lines with aligned columns."""
    widths = [max(map(len, column)) for column in zip(*rows, strict=True)]
    return ["  " + "  ".join(cell.ljust(width) for cell, width in zip(row, widths, strict=True)).rstrip() for row in rows]
