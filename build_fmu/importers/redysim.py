"""Reads ReDySim input files of robots with fixed and floating bases: inputs.m with initials.m, or inputs.mat, of all releases.

ReDySim's b is our d. Its start values y0 replace th (revolute) or b (prismatic), so they become q, and theta or d is 0.
"""

from __future__ import annotations

import math
import os
from argparse import Namespace
from collections.abc import Sequence
from pathlib import Path

import numpy as np

from build_fmu.errors import UserError, did_you_mean
from build_fmu.importers import matlab_file, matlab_reader
from build_fmu.importers.draft import GROUND, DhFrame, Draft, DraftLink, legal
from build_fmu.importers.matlab_expression import Values
from build_fmu.importers.redysim_floating import is_floating, joint_column, set_free, start
from build_fmu.importers.redysim_ground import add_ground
from build_fmu.importers.redysim_loops import add_loops, place_pivots

NEEDED = ("alp", "a", "b", "bt", "dx", "dy", "dz", "m", "Icxx", "Icyy", "Iczz")
KNOWN = (
    *NEEDED,
    "n",
    "dof",
    "type",
    "th",
    "r",
    "g",
    "Icxy",
    "Icyz",
    "Iczx",
    "aj",
    "al",
    "alt",
    "angs",
    "Tp",
    "T",
    "steps",
    "nq",
    "g_prop",
    "y0",
    "ti",
    "tf",
    "incr",
    "rtol",
    "atol",
    "int_type",
    "gx",
    "gy",
    "gz",
)
PROGRAMS = ("torque.m", "trajectory.m", "jacobian.m", "inv_kine.m", "for_kine.m", "animate.m", "sys_ode.m")
MEANING = {"torque.m": "the control law", "trajectory.m": "the prescribed motion", "jacobian.m": "the loop Jacobian",
           "inv_kine.m": "the loop solution"}  # fmt: skip
STARTS = ("y0", "ti", "tf", "incr", "rtol", "atol", "int_type")  # the results of initials() in order; some releases have n first
SOLVERS = {0: "erk", 1: "bdf", 2: "erk"}


def read(path: Path, options: Namespace) -> Draft:
    """Returns the draft; `path` is inputs.m, initials.m, inputs.mat or their folder. Raises UserError with file, line, field."""
    folder, inputs, initials = _find(path)
    call = Functions(folder, {"inputs": inputs, "initials": initials})
    data = Reading(call("inputs"))
    starts = Reading(_named_by_position(call("initials"))) if initials else data
    name = options.name or (folder.name if inputs.stem == "inputs" else inputs.stem) or "model"
    draft = Draft(name=legal(name), source=f"{folder.name}/{inputs.name}" + (f" and {initials.name}" if initials else ""))
    count = data.whole("n") if "n" in data else data.length("bt")
    if starts.values.skipped:
        draft.doubts.append(f"{call.short(starts.values.skipped[0])}; values of {initials.name} that depend on it are omitted")
    draft.gravity = _gravity(data, draft)
    draft.links = _links(data, starts, count, call, draft)
    _warn_of_namesakes(data, draft)
    place_pivots(draft, data, options.pivot)
    add_loops(draft, data, options.loop)
    add_ground(draft, data)
    _settings(data, starts, draft)
    _losses(folder, data, draft)
    return draft


class Functions:
    """Evaluates the function files of a robot's folder; recursive calls are refused."""

    def __init__(self, folder: Path, files: dict[str, Path | None]) -> None:
        self.folder, self.files = folder, files
        self.known: dict[str, Values] = {}
        self.running: list[str] = []

    def short(self, sentence: str) -> str:
        """Returns the sentence with file names instead of paths."""
        return sentence.replace(f"{self.folder}{os.sep}", "")

    def __call__(self, function: str, arguments: Sequence[np.ndarray] = ()) -> Values | None:
        """Returns the values of the function, or None if the folder has no such file."""
        path = self.files.get(function) or self.folder / f"{function}.m"
        if function in self.known and not arguments:
            return self.known[function]
        if not path.is_file():
            return None
        if function in self.running:
            raise UserError(f"{path}: the function '{function}' calls itself")
        self.running.append(function)
        try:
            found = (
                matlab_file.read_values(path)
                if path.suffix.lower() == ".mat"
                else matlab_reader.read_values(path, self, arguments, tolerant=function == "initials")
            )
        finally:
            self.running.pop()
        if not arguments:
            self.known[function] = found
        return found


def _named_by_position(values: Values) -> Values:
    """Renames the results of initials(), which some releases call yo, t_initial, t_final and type."""
    names = values.outputs[1:] if values.outputs[:1] == ["n"] else values.outputs
    if len(names) == len(STARTS) - 1 or names[len(STARTS) - 1 :] in (["type"], ["int_type"]):
        for table in (values.arrays, values.lines):
            found = {own: table.pop(name) for own, name in zip(STARTS, names, strict=False) if name in table}
            table.update(found)
    return values


class Reading:
    """Checked access to the variables of one file."""

    def __init__(self, values: Values) -> None:
        self.values, self.path = values, values.path

    def __contains__(self, name: str) -> bool:
        return name in self.values.arrays and self.values.arrays[name].size > 0

    def error(self, name: str, sentence: str) -> UserError:
        line = self.values.lines.get(name)
        return UserError(f"{self.path}:{line}: '{name}' {sentence}" if line else f"{self.path}: '{name}' {sentence}")

    def flat(self, name: str) -> np.ndarray:
        if name not in self:
            others = [key for key in self.values.arrays if key not in KNOWN]
            raise UserError(f"{self.path}: '{name}' is missing{did_you_mean(name, others)}")
        array = self.values.arrays[name].ravel(order="F")
        if not np.all(np.isfinite(array)):
            raise self.error(name, "contains a value that is not a finite number")
        return array

    def length(self, name: str) -> int:
        return self.flat(name).size

    def column(self, name: str, count: int, default: float | None = None) -> list[float]:
        """Returns `count` numbers; longer arrays are truncated (some have an entry for the ground link at the end)."""
        if name not in self and default is not None:
            return [default] * count
        array = self.flat(name)
        if array.size < count:
            raise self.error(name, f"has {array.size} entries; n = {count} are required")
        return [float(x) for x in array[:count]]

    def number(self, name: str, default: float | None = None) -> float:
        if name not in self and default is not None:
            return default
        array = self.flat(name)
        if array.size != 1:
            raise self.error(name, f"must be one number, got {array.size}")
        return float(array[0])

    def whole(self, name: str, default: int | None = None) -> int:
        value = self.number(name, default)
        if value != int(value):
            raise self.error(name, f"must be an integer, got {value:g}")
        return int(value)


def _find(path: Path) -> tuple[Path, Path, Path | None]:
    """Returns the folder, the inputs file and the initials file, if there is one."""
    if path.is_dir():
        for name in ("inputs.m", "inputs.mat"):
            if (path / name).is_file():
                return _find(path / name)
        raise UserError(f"the folder '{path}' contains neither inputs.m nor inputs.mat")
    folder = path.resolve().parent
    inputs = path
    if path.name.lower() == "initials.m":
        found = [folder / name for name in ("inputs.m", "inputs.mat") if (folder / name).is_file()]
        if not found:
            raise UserError(f"'{path}' contains start values only: inputs.m is missing in its folder")
        inputs = found[0]
    initials = folder / "initials.m"
    return folder, inputs, initials if initials.is_file() else None


def _warn_of_namesakes(data: Reading, draft: Draft) -> None:
    if is_floating(data) and data.length("a") == 4 and data.flat("a")[2] in (1, 1.5):
        draft.doubts.append(f"ReDySim has two 3-link arms of this name, with a(3) = 1 and a(3) = 1.5: this one has {data.flat('a')[2]:g}")


def _gravity(data: Reading, draft: Draft) -> list[float]:
    if "g" in data:
        if data.length("g") != 3:
            raise data.error("g", f"must be a vector of 3 numbers (acceleration of gravity), got {data.length('g')}")
        gravity = [float(x) for x in data.flat("g")]
    elif "gx" in data:
        gravity = [data.number(key, 0.0) for key in ("gx", "gy", "gz")]
    else:
        raise UserError(f"{data.path}: 'g' is missing (acceleration of gravity), for example g = [0; -9.81; 0]")
    size = math.hypot(*gravity)
    if size and max(gravity) > 0.5 * size:
        shown = ", ".join(f"{x:g}" for x in gravity)
        draft.doubts.append(
            f"gravity points along a positive axis, ({shown}) m/s2: check its sign; it differs between ReDySim's inverse and forward biped"
        )
    if size and not 9.7 < size < 9.9:
        draft.doubts.append(f"gravity is {size:g} m/s2")
    return gravity


def _links(data: Reading, starts: Reading, count: int, call: Functions, draft: Draft) -> list[DraftLink]:
    columns = _columns(data, count)
    base = start(data, starts, count, call, draft) if is_floating(data) else None
    q, qd = base[2:] if base else _start(data, starts, count, columns, draft)
    links = []
    for i in range(count):
        c = {key: values[i] for key, values in columns.items()}
        _check_entry(data, c, i + 1, count)
        parent, turns = c["bt"], c["r"] == 1
        dh = DhFrame(alpha=_right_angle(c["alp"]), a=c["a"], theta=0.0 if turns else c["th"], d=c["b"] if turns else 0.0)
        links.append(
            DraftLink(
                f"link{i + 1}",
                f"link{int(parent)}" if parent else GROUND,
                "revolute" if turns else "prismatic",
                f"joint{i + 1}",
                dh,
                mass=c["m"],
                com=[c["dx"], c["dy"], c["dz"]],
                inertia=[c[key] for key in ("Icxx", "Icyy", "Iczz", "Icxy", "Iczx", "Icyz")],
                q=q[i],
                qd=qd[i],
                drive="torque" if c["aj"] == 1 else "free",
            )
        )
    if is_floating(data):
        place, rates = base[:2] if base else ([0.0] * 6, [0.0] * 6)
        set_free(links[0], data, place, rates, draft)
    _check_ring(data, links)
    return links


def _columns(data: Reading, count: int) -> dict[str, list[float]]:
    """Returns the entries of all links by variable."""
    if not 1 <= count <= 100_000:
        raise data.error("n", f"must be at least 1, got {count}")
    columns = {key: data.column(key, count) for key in NEEDED}
    for key in ("Icxy", "Icyz", "Iczx"):
        columns[key] = data.column(key, count, 0.0)
    for key, default in (("r", 1.0), ("aj", 1.0), ("th", 0.0)):
        columns[key] = (joint_column if is_floating(data) else Reading.column)(data, key, count, default)
    if is_floating(data):
        columns["r"][0] = 1.0
    return columns


def _check_entry(data: Reading, entry: dict[str, float], number: int, count: int) -> None:
    parent = entry["bt"]
    rules = {
        "bt": (parent == int(parent) and 0 <= parent <= count and parent != number, "the number of another link or 0 for ground"),
        "m": (entry["m"] >= 0, ">= 0"),
        "r": (entry["r"] in (0, 1), "1 (revolute) or 0 (prismatic)"),
        "aj": (entry["aj"] in (0, 1), "1 (actuated) or 0"),
    }
    for key, (valid, rule) in rules.items():
        if not valid:
            raise data.error(key, f"entry {number} must be {rule}, got {entry[key]:g}")


def _check_ring(data: Reading, links: list[DraftLink]) -> None:
    carried, waiting = {GROUND}, links
    while ready := [link for link in waiting if link.parent in carried]:
        carried |= {link.name for link in ready}
        waiting = [link for link in waiting if link.name not in carried]
    if waiting:
        raise data.error("bt", f"has cyclic parent references: {', '.join(link.name for link in waiting)}")


def _right_angle(angle: float) -> float:
    """Restores the last digits of multiples of pi/2, which .mat files and products of pi lose."""
    nearest = round(angle / (math.pi / 2)) * (math.pi / 2)
    return nearest if abs(angle - nearest) < 1e-12 else angle


def _start(data: Reading, starts: Reading, count: int, columns: dict[str, list[float]], draft: Draft) -> tuple[list[float], list[float]]:
    """Returns start positions and velocities from y0 = (q, dq, actuator energy), or from th and b of the moving joints."""
    for reading in (starts, data):
        if "y0" in reading:
            y0 = [float(x) for x in reading.flat("y0")]
            if len(y0) not in (2 * count, 2 * count + 1):
                raise reading.error(
                    "y0", f"must have 2 n + 1 = {2 * count + 1} entries (positions, velocities, actuator energy), got {len(y0)}"
                )
            return y0[:count], y0[count : 2 * count]
    nominal = columns["th"] if "th" in data else data.column("angs", count, 0.0)
    base = "the base starts at the origin, " if is_floating(data) else ""
    draft.doubts.append(f"no start values (y0) found: {base}the moving joints start at their nominal th and b, at rest")
    return [nominal[i] if columns["r"][i] == 1 else columns["b"][i] for i in range(count)], [0.0] * count


def _settings(data: Reading, starts: Reading, draft: Draft) -> None:
    for reading in (starts, data):
        if "int_type" in reading and reading.whole("int_type") in SOLVERS and "method" not in draft.solver:
            draft.solver["method"] = SOLVERS[reading.whole("int_type")]
        for key in ("rtol", "atol"):
            if key in reading and key not in draft.solver:
                draft.solver[key] = reading.number(key)
        for name in ("tf", "Tp", "T"):
            _set_time(draft, "stop_time", reading, name, math.inf)
        for name in ("incr", "steps"):
            _set_time(draft, "step_size", reading, name, draft.fmu.get("stop_time", math.inf))
    if draft.solver.get("rtol", 0) > 1e-5:
        draft.doubts.append(
            f"rtol = {draft.solver['rtol']:g} is ReDySim's own tolerance: the error of a free double pendulum is then 0.2 rad "
            "after 3 s; 1e-8 costs little more"
        )
    if "ti" in starts and starts.number("ti") != 0:
        draft.lost.append(f"the start time ti = {starts.number('ti'):g} s: the simulation environment sets it")


def _set_time(draft: Draft, field: str, reading: Reading, name: str, below: float) -> None:
    """Sets a time of the default experiment unless it is set or the value is not a time below the bound."""
    if name in reading and reading.length(name) == 1 and field not in draft.fmu and 0 < reading.number(name) < below:
        draft.fmu[field] = reading.number(name)


def _losses(folder: Path, data: Reading, draft: Draft) -> None:
    for name in PROGRAMS:
        if (folder / name).is_file() and name in MEANING:
            draft.lost.append(f"{name} ({MEANING[name]}) is a program: apply torques as inputs and add loops with --loop")
    asked = set(data.values.outputs) if data.path.suffix.lower() == ".m" else set()
    draft.lost += [f"the variable '{name}' of {data.path.name}" for name in sorted(asked - set(KNOWN))]
