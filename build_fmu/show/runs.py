"""The results that a page plays: of a simulation or from a CSV."""

from __future__ import annotations

import sys
from pathlib import Path

import numpy as np

from build_fmu.errors import UserError
from build_fmu.model.describe import Description
from build_fmu.model.planar import joint_counts
from build_fmu.run.session import Session
from build_fmu.run.signals import read_table
from build_fmu.run.simulate import Result
from build_fmu.show.page import Run


def run_of(session: Session, result: Result, failure: UserError | None = None) -> Run:
    """Returns outputs, nonzero inputs and units of a simulation, and why it failed."""
    columns = {name: result[name] for name in result.names} | {
        name: values for name, values in result.inputs.items() if np.any(values != 0)
    }
    units = {}
    for name in columns:
        display = session.display(name)
        # offsets are ignored: no unit of this project has one
        units[name] = (display.unit, display.factor)
    return Run(result.time, columns, units, failure)


def recorded(record: Path, model: Description | None) -> Run:
    """Returns the results of a CSV, with the units of the model if it is given."""
    table = read_table(record)
    columns = {name: np.array(values) for name, values in table.items() if name != "time"}
    if not columns:
        raise UserError(f"'{record}' has no column except time")
    units = {}
    if model:
        units = display_units(model)
        known = {v.name for v in model.variables}
        balls = {ball["name"] for ball in model.drawing.get("balls", [])}
        joints = [link.get("joint") for link in model.drawing["links"] if link["type"] != "fixed"]
        parts = [[f"{j}.quaternion[{k}]" for k in range(1, 5)] if j in balls else [f"{j}.q"] for j in joints]
        # the first of each joint
        missing = [gone[0] for part in parts if (gone := [name for name in part if name in known and name not in columns])]
        if missing:
            more = f" and {len(missing) - 1} more" if len(missing) > 1 else ""
            print(f"'{record}' has no column '{missing[0]}'{more}: these joints do not move", file=sys.stderr)
    return Run(np.array(table["time"]), columns, units)


def display_units(model: Description) -> dict[str, tuple[str, float]]:
    """Returns the display unit of each variable and its factor from SI."""
    shown = {unit["name"]: {d["name"]: float(d.get("factor", 1)) for d in unit.get("display", [])} for unit in model.units}
    units = {}
    for variable in model.variables:
        factor = shown.get(variable.unit, {}).get(variable.display_unit)
        units[variable.name] = (variable.display_unit, factor) if factor else (variable.unit or "", 1.0)
    return units


def about(model: Description | None, shown: Run, record: Path | None) -> str:
    """Returns the line below the title: description, joints and mass of the model."""
    parts = [model.description] if model and model.description else []
    if model:
        links = model.drawing["links"]
        parts.append(f"{', '.join(joint_counts(model.drawing))}, {sum(link['mass'] for link in links):.4g} kg")
    if record:
        parts.append(f"{record.name}, {len(shown.time)} rows")
    return " · ".join(parts)
