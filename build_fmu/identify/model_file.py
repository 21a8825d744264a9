"""Writes identified parameters into the text of a model file; comments and everything else stay."""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence

import numpy as np
import tomlkit

from build_fmu.identify.parameters import INERTIAL, PLACES, Plant, body_of

DIGITS = 12
SAME = 1e-10  # a change that is rounding, relative to the largest entry
PART = re.compile(r"(.*)\[(\d+)\]")  # a coordinate of a joint with several


def with_parameters(text: str, plant: Plant, pi: Mapping[str, float], chosen: Sequence[str], origin: str) -> str:
    """Returns the model file with the parameters `pi` of the chosen links and joints; `origin` becomes its first comment."""
    document = tomlkit.parse(text)
    links = {table["name"]: table for table in document["link"]}
    for link in plant.links:
        if link in chosen and pi[f"{link}.m"] > 0:
            _write_body(links[link], *body_of(np.array([pi[f"{link}.{letters}"] for letters in INERTIAL])))
    joints = {table.get("joint_name", table["name"]): table for table in document["link"]}
    actuators = {table["joint"]: table for table in document.get("actuator", [])}
    for name in plant.losses:
        if name in chosen:
            joint, _, what = name.rpartition(".")
            _write_loss(plant, joints, actuators.get(joint, {}), joint, what, pi[name])
    # a reference solution belongs to the former parameters
    if "report" in document:
        document["report"].pop("reference", None)
        if not document["report"]:
            document.remove("report")
    return f"# {origin}\n{tomlkit.dumps(document)}"


def _write_body(table, mass: float, com, inertia) -> None:
    six = [inertia[i, j] for i, j in PLACES]
    if len(table.get("inertia", [0] * 3)) == 3 and max(map(abs, six[3:])) <= SAME * max(six[:3]):
        six = six[:3]
    if abs(mass - table.get("mass", 0)) > SAME * mass:
        table["mass"] = _rounded(mass)
    for field, values, count in (("com", com, 3), ("inertia", six, len(six))):
        former = [*table.get(field, []), *[0] * 6][:count]
        least = SAME * max(map(abs, values))
        if max(abs(a - b) for a, b in zip(values, former, strict=True)) > least:
            table[field] = [_rounded(x) if abs(x) > least else 0 for x in values]


def _write_loss(plant: Plant, joints: Mapping, actuator: Mapping, joint: str, what: str, value: float) -> None:
    """Writes a parameter of a joint, in its link or in its actuator."""
    if what == "armature" and "rotor_inertia" in actuator:
        actuator["rotor_inertia"] = _rounded(value / actuator.get("gear_ratio", 1) ** 2)
        return
    found = PART.fullmatch(joint)
    owner, part = (found[1], int(found[2]) - 1) if found else (joint, None)
    table, count = joints[owner], sum(j.startswith(f"{owner}[") for j in plant.joints)
    peak = max(0.0, plant.values[f"{joint}.static_friction"] - plant.values[f"{joint}.friction"])
    fields = {what: value} | ({"static_friction": value + peak} if what == "friction" and "static_friction" in table else {})
    for field, number in fields.items():
        if part is None:
            if number or field in table:
                table[field] = _rounded(number)
            continue
        entries = [float(x) for x in table.get(field, [0.0] * count)]
        entries[part] = _rounded(number)
        if any(entries) or field in table:
            table[field] = entries


def _rounded(value: float) -> float:
    return float(f"{value:.{DIGITS}g}")
