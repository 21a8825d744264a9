"""Writes a scene for MuJoCo."""

from __future__ import annotations

import math
from xml.etree import ElementTree

from scenes import Scene

JOINTS = {"revolute": "hinge", "prismatic": "slide"}


def numbers(values) -> str:
    return " ".join(f"{x:.17g}" for x in values)


def quaternion(turn) -> list[float]:
    """Returns w, x, y, z of a rotation matrix, computed from its largest component."""
    (a, b, c), (d, e, f), (g, h, i) = turn
    squares = [1 + a + e + i, 1 + a - e - i, 1 - a + e - i, 1 - a - e + i]
    k = max(range(4), key=lambda j: squares[j])
    parts = (
        (squares[0], h - f, c - g, d - b),
        (h - f, squares[1], b + d, c + g),
        (c - g, b + d, squares[2], f + h),
        (d - b, c + g, f + h, squares[3]),
    )[k]
    length = math.sqrt(sum(x * x for x in parts))
    return [x / length for x in parts]


def inertia(body: dict) -> list[float]:
    """MuJoCo requires positive moments of inertia; moments of 0 in a planar scene have no effect on its motion."""
    return [max(x, 1e-9) for x in body["inertia"][:3]] + list(body["inertia"][3:])


def write(scene: Scene, stiffest: float) -> str:
    """Returns the model as XML. A loop is a constraint with the time constant `stiffest`, the minimum that MuJoCo
    allows (two of its steps, see solref in its manual)."""
    data = scene.data
    root = ElementTree.Element("mujoco", model=scene.name)
    ElementTree.SubElement(root, "compiler", angle="radian", autolimits="true")
    option = ElementTree.SubElement(root, "option", gravity=numbers(data["gravity"]), iterations="100", tolerance="1e-14")
    off = {"contact": "disable"} if scene.has_loops else {"contact": "disable", "constraint": "disable"}
    ElementTree.SubElement(option, "flag", **off)
    world = ElementTree.SubElement(root, "worldbody")
    at = {-1: world}
    for k, body in enumerate(data["bodies"]):
        joint = body["joint"]
        placement = joint["placement"]
        element = ElementTree.SubElement(
            at[body["parent"]], "body", name=f"b{k}", pos=numbers(placement["p"]), quat=numbers(quaternion(placement["R"]))
        )
        ElementTree.SubElement(
            element, "inertial", pos=numbers(body["com"]), mass=f"{body['mass']:.17g}", fullinertia=numbers(inertia(body))
        )
        passive = {
            key: f"{joint[name]:.17g}"
            for key, name in (("stiffness", "stiffness"), ("damping", "damping"), ("springref", "rest"))
            if joint.get(name)
        }
        ElementTree.SubElement(element, "joint", name=f"j{k}", type=JOINTS[joint["type"]], axis="0 0 1", **passive)
        at[k] = element

    def site(body: int, point: list[float], name: str) -> None:
        ElementTree.SubElement(at[body], "site", name=name, pos=numbers(point))

    if data["forces"]:
        tendons = ElementTree.SubElement(root, "tendon")
        for k, spring in enumerate(data["forces"]):
            length = f"{spring['rest_length']:.17g}"
            tendon = ElementTree.SubElement(
                tendons, "spatial", stiffness=f"{spring['k']:.17g}", damping=f"{spring['c']:.17g}", springlength=f"{length} {length}"
            )
            for side in "ab":
                site(spring[f"body_{side}"], spring[f"point_{side}"], f"s{k}{side}")
                ElementTree.SubElement(tendon, "site", site=f"s{k}{side}")
    if data["loops"]:
        equality = ElementTree.SubElement(root, "equality")
        for k, loop in enumerate(data["loops"]):
            for side in "ab":
                site(loop[f"body_{side}"], loop[f"point_{side}"], f"l{k}{side}")
            ElementTree.SubElement(
                equality, "connect", site1=f"l{k}a", site2=f"l{k}b", solref=f"{stiffest:.17g} 1", solimp="0.9999 0.9999 0.001"
            )
    keys = ElementTree.SubElement(root, "keyframe")
    ElementTree.SubElement(keys, "key", qpos=numbers(data["initial"]["q"]), qvel=numbers(data["initial"]["qd"]))
    return ElementTree.tostring(root, encoding="unicode")
