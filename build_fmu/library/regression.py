"""The torques and the regressor of a model for prescribed motions, by its inverse FMU."""

from __future__ import annotations

import re
from collections.abc import Callable, Iterable, Mapping, Sequence

import numpy as np

from build_fmu.errors import UserError
from build_fmu.identify.parameters import LOSSES, Plant
from build_fmu.run.session import Session

REGRESSOR = re.compile(r"(.+)\.regressor\[(\d+),1\]")
JOINT = re.compile(r"'([^']+)'$")
MOVING = re.compile(r"(.*?)(\[\d\])?\.(qd|omega\[1\])")
EXTRA = ("friction_velocity", "static_friction")


def plant_of(
    document: Mapping, open_inverse: Callable[[tuple[str, ...]], Session], parameters: Mapping[str, float | str], tunable: Iterable[str]
) -> Plant:
    """Returns the model with prescribed motion; raises UserError for loops and for joints without drive.

    `document` is the model file; `open_inverse(tunable)` opens its inverse FMU; `parameters` are start
    values, some of them of `tunable` parameters.
    """
    session = open_inverse(())
    _supported(document)
    for name in session.names("output"):
        if found := MOVING.fullmatch(name):
            raise UserError(
                f"identification requires driven joints, but no input of the inverse model prescribes the motion of '{found[1]}'"
            )
    joints = [n.removesuffix(".q") for n in session.names("input") if n.endswith(".q")]
    rows: dict[str, dict[str, int]] = {}  # link -> joint -> row of its regressor
    for name, variable in session.variables.items():
        if found := REGRESSOR.fullmatch(name):
            rows.setdefault(found[1], {})[JOINT.search(variable.description)[1]] = int(found[2])
    numbers = [f"{link}.{what}" for link in rows for what in ("mass", *_indexed("com", 3), *_indexed("inertia", 6))]
    numbers += [f"{joint}.{what}" for joint in joints for what in (*LOSSES, *EXTRA, *_limits(document, joint))]
    # the tables of controllers are omitted
    given = [name for name in parameters if name in tunable and not name.endswith((".kp", ".kd", ".target"))]
    changed = tuple(dict.fromkeys([*numbers, *given]))
    session = open_inverse(changed)
    parameters = {name: value for name, value in parameters.items() if name in session.variables}
    values = {name: float(session.variables[name].start) for name in numbers} | {n: v for n, v in parameters.items() if n in numbers}
    speeds = {f"{t['joint']}.speed_limit": float(t["speed_limit"]) for t in document.get("actuator", []) if "speed_limit" in t}
    torques = torques_on(session, joints)
    matrix = [f"{link}.regressor[{rows[link][joint]},{k}]" for joint in joints for link in rows for k in range(1, 11)]
    names = [f"{joint}.{letter}" for letter in ("q", "qd", "qdd") for joint in joints]

    def evaluate(q: np.ndarray, qd: np.ndarray, qdd: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        session = open_inverse(changed)  # again if the model was closed
        result = np.empty((len(q), len(torques) + len(matrix)))
        for row, motion in zip(result, np.hstack([q, qd, qdd]), strict=True):
            session.restart({**parameters, **dict(zip(names, motion, strict=True))})
            row[:] = session.read([*torques, *matrix])
        return result[:, : len(torques)], result[:, len(torques) :].reshape(len(q), len(joints), -1)

    sliding = np.array([session.variables[f"{joint}.q"].unit == "m" for joint in joints])
    gravity = float(np.linalg.norm(document.get("gravity", [9.81])))
    size = _size(document, values, rows)
    return Plant(joints, torques, list(rows), _losses(document, joints), values | speeds, sliding, size, gravity, evaluate)


def torques_on(session: Session, joints: Sequence[str]) -> list[str]:
    """Returns the outputs of an inverse model with the torques on the joints, behind their actuators."""
    return [next(n for n in session.names("output") if n in (f"{joint}.tau", f"{joint}.tau_joint")) for joint in joints]


def _supported(document: Mapping) -> None:
    for kind, word in (("loop", "loops"), ("coupling", "couplings")):
        for table in document.get(kind, []):
            if kind == "loop" or not table.get("stiffness"):
                raise UserError(f"identification supports open trees only, and '{table.get('name')}' is one of the {word} of the model")


def _losses(document: Mapping, joints: list[str]) -> list[str]:
    """Parameters of the joints. A gyroscopic rotor acts on other joints, too, and that of an elastic gear is no armature: both stay."""
    rotors = {table["joint"] for table in document.get("actuator", []) if table.get("gyroscopic") or "stiffness" in table}
    return [f"{joint}.{what}" for joint in joints for what in LOSSES if not (what == "armature" and joint in rotors)]


def _limits(document: Mapping, joint: str) -> list[str]:
    """The stops of a joint that the file has."""
    owner = joint.partition("[")[0]
    table = next(t for t in document["link"] if t.get("joint_name", t["name"]) == owner)
    return [what for what in ("lower", "upper") if what in table]


def _size(document: Mapping, values: Mapping[str, float], links: Iterable[str]) -> float:
    """Returns the largest length of the joints, centers of mass and radii of gyration; 1 if all are 0."""
    lengths = [abs(float(table.get(what, 0))) for table in document["link"] for what in ("a", "d", "b", "pitch")]
    for link in links:
        lengths += [abs(values[f"{link}.{what}"]) for what in _indexed("com", 3)]
        if (mass := values[f"{link}.mass"]) > 0:
            lengths += [np.sqrt(abs(values[f"{link}.{what}"]) / mass) for what in _indexed("inertia", 3)]
    return float(max(lengths)) or 1.0


def _indexed(name: str, count: int) -> list[str]:
    return [f"{name}[{k}]" for k in range(1, count + 1)]
