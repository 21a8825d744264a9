"""The live page: its model with a port on each link, the compiled library, and what its sliders set."""

from __future__ import annotations

import base64
import gzip
import math
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import tomlkit

from build_fmu import native
from build_fmu.errors import UserError
from build_fmu.model.describe import Description, Variable, describe
from build_fmu.model.resources import attach
from build_fmu.report.target import with_chosen_tolerance
from build_fmu.run.prescribed import motions_of
from build_fmu.show.page import Run
from build_fmu.show.runs import display_units

ROWS = 1500  # that a page keeps
LONGEST_STEP = 0.004  # s, for a smooth motion
EARTH = 9.81  # m/s²
PORT = {
    "wrench": ("force", "torque"),
    "speeds": ("velocity", "angular_velocity"),
    "accelerations": ("acceleration", "angular_acceleration"),
}


@contextmanager
def with_ports(model: Description, file: Path) -> Iterator[tuple[Description, Path, dict[str, str]]]:
    """Yields the model with a port on each link, its file, and the frames of the ports by link."""
    with with_chosen_tolerance(model, file) as (chosen, source), tempfile.TemporaryDirectory() as folder:
        text, prefix = source.read_text(encoding="utf-8-sig"), "port"
        while prefix in text:
            prefix += "_"
        # the parts of a joint with several degrees of freedom have names like trunk[1] and no table
        names = [link["name"] for link in model.drawing["links"] if "[" not in link["name"]]
        frames = {name: f"{prefix}{k}" for k, name in enumerate(names, 1)}
        document = tomlkit.parse(text)
        tables = document.setdefault("frame", tomlkit.aot())
        for link, name in frames.items():
            tables.append({"name": name, "link": link, "outputs": ["velocity", "acceleration"], "port": "ground"})
        copy = Path(folder) / file.name
        copy.write_text(tomlkit.dumps(document), encoding="utf-8", newline="\n")
        attach(chosen.resources, source, Path(folder))
        try:
            ported = describe(copy)
        except UserError as error:
            raise UserError(str(error).replace(str(copy), str(file))) from None
        yield replace(ported, folder=model.folder, warnings=chosen.warnings), copy, frames


def prepared(model: Description, file: Path, frames: dict[str, str], shown: Run, start: dict[str, Any]) -> tuple[Run, dict[str, Any]]:
    """Returns the run without the ports and with the inputs of the sliders, and what a page needs to compute.

    That is the library, the files of the model, value references and sliders.
    """
    variables = {variable.name: variable for variable in model.variables}
    for name in start:
        if variables[name].type != "Real":
            raise UserError(f"--start {name}: a live page sets numbers only; write the value into the model file")
    controls, own = _controls(model, set(frames.values())), set(frames.values())
    columns = {name: values for name, values in shown.columns.items() if name.split(".")[0] not in own}
    for control in controls:
        if control["kind"] == "input":
            columns.setdefault(control["name"], np.full(len(shown.time), control["value"]))
    motions = list(motions_of([variable.name for variable in model.select("input")]).values())
    for q, _, _ in motions:
        columns.setdefault(q, np.full(len(shown.time), float(variables[q].start or 0.0)))
    starts = [name for name in variables if name.endswith(".q0") or ".quaternion0[" in name]
    files = {"model.toml": file, **{name: file.parent / name for name in model.resources}}
    step, stop = model.default_experiment["step_size"], model.default_experiment["stop_time"]
    data = {
        "core": _packed(native.web_library().read_bytes()),
        "licences": _packed("\n\n".join([native.licence_text(), *native.licences_of_parts(["wasm"]).values()]).encode()),
        "guid": model.guid,
        "files": {name: _base64(path.read_bytes()) for name, path in files.items()},
        "rows": ROWS,
        "from": float(shown.time[0]),
        "step": step / math.ceil(step / min(LONGEST_STEP, stop / 250)),
        "references": {name: variables[name].value_reference for name in [*columns, *starts]},
        "start": [[variables[name].value_reference, float(value)] for name, value in start.items()],
        "motions": [[variables[name].value_reference for name in names] for names in motions],
        "ports": _ports(variables, frames),
        "controls": controls,
    }
    return replace(shown, columns=columns, units=display_units(model)), data


def _ports(variables: dict[str, Variable], frames: dict[str, str]) -> dict[str, dict[str, list[int]]]:
    """Returns the value references of the ports by link; links that cannot move have none."""
    found = {}
    for link, frame in frames.items():
        if f"{frame}.force[1]" in variables:
            names = {name: [f"{frame}.{kind}[{k}]" for kind in kinds for k in (1, 2, 3)] for name, kinds in PORT.items()}
            found[link] = {name: [variables[part].value_reference for part in parts] for name, parts in names.items()}
    return found


def _packed(content: bytes) -> str:
    return _base64(gzip.compress(content, 9, mtime=0))


def _base64(content: bytes) -> str:
    return base64.b64encode(content).decode()


def _controls(model: Description, frames: set[str]) -> list[dict[str, Any]]:
    """Returns the sliders: inputs without those of the ports, and tunable parameters. Of a prescribed motion the speed is set."""
    units, forces, found = display_units(model), _Forces(model.drawing), []
    inputs = {variable.name for variable in model.select("input")}
    for variable in model.variables:
        head, _, tail = variable.name.rpartition(".")
        is_input = variable.causality == "input"
        is_tunable = variable.causality == "parameter" and variable.variability == "tunable"
        if variable.type != "Real" or not (is_input or is_tunable) or head in frames:
            continue
        if tail in ("q", "qdd") and f"{head}.qd" in inputs:
            continue
        unit, factor = units[variable.name]
        value = float(variable.start or 0.0)
        low, high = _range(variable, value, forces.scale(head, variable.unit or ""), is_input)
        kind = "input" if is_input else "parameter"
        found.append({"name": variable.name, "reference": variable.value_reference, "kind": kind} | {
            "unit": unit, "factor": factor, "low": low, "high": high, "value": value})  # fmt: skip
    return found


def _range(variable: Variable, value: float, scale: float, is_input: bool) -> tuple[float, float]:
    """Returns the range of a slider: by its scale for an input or a parameter of value 0, otherwise up to twice the value."""
    low, high = sorted((0.0, 2 * value)) if value and not is_input else (-scale, scale)
    return max(low, -math.inf if variable.min is None else variable.min), min(high, math.inf if variable.max is None else variable.max)


class _Forces:
    """Scales of forces and torques: twice the load that carries the outboard links in the start pose."""

    def __init__(self, drawing: dict[str, Any]) -> None:
        self.links = drawing["links"]
        self.gravity = float(np.linalg.norm(drawing["gravity"])) or EARTH

    def scale(self, head: str, unit: str) -> float:
        """Returns the largest value on a slider of a joint or of the whole model, in SI units; per rad, m, rad/s or m/s for their laws."""
        first = next((i for i, link in enumerate(self.links) if link.get("joint") == head), None)
        outboard = self.links if first is None else [link for i, link in enumerate(self.links) if self._is_outboard(i, first)]
        origin = np.zeros(3) if first is None else np.asarray(self.links[first]["origin"], float)
        force = sum(link["mass"] for link in outboard) * self.gravity
        torque = sum(link["mass"] * self.gravity * float(np.linalg.norm(np.asarray(link["com"], float) - origin)) for link in outboard)
        return {"N": _rounded(2 * force), "N.m": _rounded(2 * torque), "rad/s": math.pi, "V": 48.0}.get(
            unit.split("/")[0].removesuffix(".s") if unit.startswith("N") else unit, 1.0
        )

    def _is_outboard(self, i: int, first: int) -> bool:
        while i > first:
            i = self.links[i]["parent"]
        return i == first


def _rounded(x: float) -> float:
    """Returns the next of 1, 2, 5, 10 and so on."""
    if x <= 0:
        return 1.0
    power = 10.0 ** math.floor(math.log10(x))
    return next(k * power for k in (1, 2, 5, 10) if k * power >= x * 0.999)
