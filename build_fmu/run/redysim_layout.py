"""Writes results in ReDySim's files: timevar.dat, statevar.dat, envar.dat, tor.dat and, for a floating base, base.dat and mtvar.dat.

Columns without header, C format %e, SI units. ReDySim's actuator energy is minus the work of drives, its ground energy minus that of
contacts, so its total energy is constant.
"""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from build_fmu.errors import UserError
from build_fmu.files import whole_file
from build_fmu.model.describe import Description
from build_fmu.model.planar import planar_axes
from build_fmu.run.simulate import Result

CONTACT_WORK = "energy.contact"


@dataclass(frozen=True)
class Columns:
    """The joints of ReDySim's state: a floating base, then the joints in the order of the links."""

    base: str | None  # the free or planar joint's name
    planar: bool
    joints: list[str]


def columns_of(model: Description) -> Columns:
    """Returns the joints in ReDySim's order; raises UserError for joints that ReDySim does not support."""
    names = {v.name for v in model.variables}
    balls = [ball["name"] for ball in model.drawing.get("balls", [])]
    base = balls[0] if balls and f"{balls[0]}[3].q" in names else None
    if len(balls) > 1 or (balls and base is None):
        raise UserError(f"ReDySim does not support the spherical joint '{balls[-1]}'")
    moving = [link for link in model.drawing["links"] if link["type"] != "fixed"]
    planar = _planar_base(moving[:3])
    own = [f"{base or planar}[{i}]" for i in (1, 2, 3)] if base or planar else []
    # a locked joint has only a position and is omitted
    joints = [link["joint"] for link in moving if f"{link['joint']}.qd" in names and link["joint"] not in own]
    if base and [link["joint"] for link in moving[:3]] != own:
        raise UserError(f"ReDySim requires the floating base as first joint; '{base}' is not the first joint of the model")
    return Columns(base or planar, planar is not None, joints)


def _planar_base(first: list[dict[str, Any]]) -> str | None:
    """Returns the name of the first joint if it is planar in the ground's x and y, as the base of ReDySim's planar space robots."""
    if [link["type"] for link in first] != ["prismatic", "prismatic", "revolute"]:
        return None
    name = first[0]["joint"].removesuffix("[1]")
    axes = [[row[2] for row in link["rotation"]] for link in first]
    if [link["joint"] for link in first] == [f"{name}[{i}]" for i in (1, 2, 3)] and np.allclose(
        axes, [[1, 0, 0], [0, 1, 0], [0, 0, 1]], atol=1e-9
    ):
        return name
    return None


def write_layout(folder: Path, model: Description, result: Result) -> list[str]:
    """Writes the files and returns their names; raises UserError if the FMU lacks required outputs."""
    columns = columns_of(model)
    # inverse dynamics: motions are inputs and no joint has a torque input
    forward = (
        bool(columns.base) or any(name.endswith(".tau") for name in result.inputs) or not any(name.endswith(".q") for name in result.inputs)
    )
    files = {
        "timevar.dat": result.time[:, None],
        "statevar.dat": _state(columns, result, forward),
        "tor.dat": _torques(columns, model, result),
    }
    if forward or "energy.work" in result.names:
        files["envar.dat"] = _energies(result)
    if columns.base:
        files["base.dat"] = np.column_stack([result.time, *sum(_base(columns, result), [])])
        momenta = [f"momentum.{kind}[{i}]" for kind in ("linear", "angular") for i in (1, 2, 3)]
        if all(name in result.names for name in momenta):
            files["mtvar.dat"] = np.column_stack([result[name] for name in momenta])
    for name, table in files.items():
        whole_file(folder / name, lambda temporary, table=table: np.savetxt(temporary, table + 0.0, fmt="%.6e", delimiter=" "))
    return list(files)


def _state(columns: Columns, result: Result, forward: bool) -> np.ndarray:
    q, qd = ([_column(result, f"{name}.{key}") for name in columns.joints] for key in ("q", "qd"))
    if not forward:
        return np.column_stack([*q, *qd, *(_column(result, f"{name}.qdd") for name in columns.joints)])
    places, rates = _base(columns, result)
    actuator, ground = _lost_energies(result)
    return np.column_stack([*places, *q, *rates, *qd, *ground, actuator])


def _base(columns: Columns, result: Result) -> tuple[list[np.ndarray], list[np.ndarray]]:
    """Returns position and angles about z, x, y of a floating base, and their rates."""
    name = columns.base
    if name is None:
        return [], []
    if columns.planar:
        still = np.zeros(len(result.time))
        x, y, turn = ([_column(result, f"{name}[{i}].{key}") for key in ("q", "qd")] for i in (1, 2, 3))
        return [x[0], y[0], still, turn[0], still, still], [x[1], y[1], still, turn[1], still, still]
    places = [_column(result, f"{name}[{i}].q") for i in (1, 2, 3)]
    phi, theta, psi = (_column(result, f"{name}.angle[{i}]") for i in (1, 2, 3))
    x, y, z = (_column(result, f"{name}.omega[{i}]") for i in (1, 2, 3))
    # omega in base axes = (-sin psi cos theta, sin theta, cos psi cos theta) phi' + (cos psi, 0, sin psi) theta' + (0, 1, 0) psi'
    phi_rate = (z * np.cos(psi) - x * np.sin(psi)) / np.cos(theta)
    theta_rate = x * np.cos(psi) + z * np.sin(psi)
    psi_rate = y - np.sin(theta) * phi_rate
    return [*places, phi, theta, psi], [*(_column(result, f"{name}[{i}].qd") for i in (1, 2, 3)), phi_rate, theta_rate, psi_rate]


def _energies(result: Result) -> np.ndarray:
    potential, kinetic = _column(result, "energy.potential"), _column(result, "energy.kinetic")
    actuator, ground = _lost_energies(result)
    return np.column_stack([potential, kinetic, actuator, sum([potential, kinetic, actuator, *ground]), *ground])


def _lost_energies(result: Result) -> tuple[np.ndarray, list[np.ndarray]]:
    """Returns the energies taken by actuators and, if the model has contacts, by the ground."""
    work = _column(result, "energy.work")
    if CONTACT_WORK not in result.names:
        return -work, []
    ground = -result[CONTACT_WORK]
    return -work - ground, [ground]


def energy_errors(result: Result) -> str:
    """Returns a sentence with the errors that ReDySim's `energy` of legged robots prints; empty without contacts."""
    if CONTACT_WORK not in result.names:
        return ""
    total = _energies(result)[:, 3]
    if not total[0]:
        return ""
    accumulated, largest = (100 * float(error) / abs(total[0]) for error in (np.sum(total - total[0]), np.abs(total - total[0]).max()))
    return f"energy error: accumulated {accumulated:.3g} %, maximum {largest:.3g} % of the initial total energy"


def _torques(columns: Columns, model: Description, result: Result) -> np.ndarray:
    """Returns one column per joint; with prescribed motions in closed loops, the torques of these joints and the loop multipliers."""
    known = {*result.names, *result.inputs}
    torques = [result[f"{name}.tau"] if f"{name}.tau" in known else np.zeros(len(result.time)) for name in columns.joints]
    loops = model.drawing.get("loops", [])
    led = [name for name in columns.joints if f"{name}.q" in result.inputs]
    if not (loops and led):
        return np.column_stack(torques)
    multipliers: list[np.ndarray] = []
    for loop in loops:
        rows = [result[name] for name in result.names if name.startswith(f"{loop['name']}.lambda[")]
        # a revolute joint in a planar mechanism has two independent constraints
        if planar_axes(model.drawing["links"]) and len(rows) == 5 and not np.any(rows[2:]):
            rows = rows[:2]
        multipliers += rows
    driven = [torque for name, torque in zip(columns.joints, torques, strict=True) if f"{name}.tau" in known]
    return np.column_stack([*driven, *multipliers])


def _column(result: Result, name: str) -> np.ndarray:
    if name not in result.names and name not in result.inputs:
        group = "energy" if name.startswith("energy.") else "acceleration" if name.endswith(".qdd") else ""
        hint = f': add "{group}" to [fmu] outputs in the model file' if group else ""
        raise UserError(f"ReDySim's files require the output '{name}', which this FMU does not have{hint}")
    return result[name]
