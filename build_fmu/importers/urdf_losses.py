"""Lists the content of a URDF that a model file cannot represent, including unknown and misspelt names."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable

from lxml import etree

from build_fmu.errors import did_you_mean
from build_fmu.importers.draft import Draft
from build_fmu.importers.urdf_actuators import DRAKE, ROS, SIMPLE, kind_of

# the children of each element that are read or reported separately
CHILDREN = {
    "robot": ("link", "joint", "material", "transmission", "gazebo", "sensor", "ros2_control"),
    "link": ("inertial", "visual", "collision"),
    "joint": ("origin", "parent", "child", "axis", "dynamics", "limit", "mimic"),
    "inertial": ("origin", "mass", "inertia"),
    "collision": ("origin", "geometry", "material", "verbose"),
    "transmission": ("type", "joint", "actuator", *ROS),
    "transmission/joint": ("hardwareInterface", *ROS),
    "actuator": ("hardwareInterface", *ROS, *DRAKE),
}
SEVERAL = ("visual", "collision", "geometry", "joint", "actuator", "hardwareInterface")  # elements that may be repeated
ATTRIBUTES = {
    "robot": ("name", "version"), "link": ("name",), "transmission": ("name", "type"), "transmission/joint": ("name",),
    "actuator": ("name",), **{tag: ("value",) for tag in DRAKE},
    "joint": ("name", "type"), "origin": ("xyz", "rpy"), "parent": ("link",), "child": ("link",), "axis": ("xyz",), "mass": ("value",),
    "dynamics": ("damping", "friction"), "limit": ("lower", "upper", "effort", "velocity"),
    "mimic": ("joint", "multiplier", "offset"),
    "inertia": ("ixx", "iyy", "izz", "ixy", "ixz", "iyz"), "sphere": ("radius",), "capsule": ("radius", "length"),
    "cylinder": ("radius", "length"), "box": ("size",),
}  # fmt: skip


def report_losses(robot: etree._Element, draft: Draft, contact: bool = False, shapes: bool = False) -> None:
    """Fills draft.lost and draft.doubts. With `contact`, `shapes` the <collision>, <visual> shapes are reported elsewhere."""
    visual, collision = (sum(1 for _ in robot.iter(tag)) for tag in ("visual", "collision"))
    if visual and not shapes:
        draft.lost.append(f"{visual} <visual> shapes")
    if collision and not contact:
        draft.lost.append(f"{collision} <collision> shapes: --contact ground converts those of the feet, --contact all converts all")
    for tag in ("gazebo", "sensor", "ros2_control"):
        count = len(robot.findall(tag))
        if count:
            draft.lost.append(f"{count} x <{tag}>")
    _unknown(robot, draft, contact)
    _masses(robot, draft)


def _unknown(robot: etree._Element, draft: Draft, contact: bool) -> None:
    """Lists unknown elements and attributes, and duplicate elements."""
    tags, first = Counter(), {}
    collisions = robot.findall("link/collision") if contact else []
    outer = [robot, *robot.findall("link"), *robot.findall("joint"), *robot.findall("link/inertial"), *collisions, *_drives(robot)]
    for parent in outer:
        kind, seen = _kind(parent), set()
        for child in parent:
            if child.tag not in CHILDREN[kind]:
                tags[kind, child.tag] += 1
                first.setdefault((kind, child.tag), child.sourceline)
            elif kind != "robot" and child.tag in seen and child.tag not in SEVERAL:
                draft.lost.append(f"line {child.sourceline}: duplicate <{child.tag}> in <{parent.tag}>: the first one is used")
            seen.add(child.tag)
    for (kind, tag), count in tags.items():
        parent, hint = kind.rpartition("/")[2], did_you_mean(tag, CHILDREN[kind])
        draft.lost.append(f"{count} x <{tag}> in <{parent}>, first in line {first[kind, tag]}{hint}")
    places: dict[tuple[str, str], list[int]] = {}
    for element in _read(robot, collisions):
        for key in element.attrib:
            if key not in ATTRIBUTES[_kind(element)]:
                places.setdefault((_kind(element), key), []).append(element.sourceline)
    for (kind, key), at in places.items():
        what = f"'{key}' of <{kind.rpartition('/')[2]}>"
        draft.lost.append(
            (f"line {at[0]}: {what}" if len(at) == 1 else f"{len(at)} x {what}, first in line {at[0]}")
            + did_you_mean(key, ATTRIBUTES[kind])
        )


def _drives(robot: etree._Element) -> list[etree._Element]:
    """Returns the simple transmissions, their joints and actuators. Other transmissions are listed as a whole."""
    simple = [element for element in robot.findall("transmission") if kind_of(element).endswith(SIMPLE)]
    return simple + [child for element in simple for child in element if child.tag in ("joint", "actuator")]


def _kind(element: etree._Element) -> str:
    """Returns the name of an element in the tables: that of the <joint> of a transmission differs from that of the robot."""
    parent = element.getparent()
    return "transmission/joint" if element.tag == "joint" and parent is not None and parent.tag == "transmission" else element.tag


def _read(robot: etree._Element, collisions: list[etree._Element]) -> Iterable[etree._Element]:
    drives = _drives(robot)
    yield from (robot, *robot.findall("link"), *drives, *(child for drive in drives for child in drive if child.tag in DRAKE))
    for joint in robot.findall("joint"):
        yield joint
        yield from (child for child in joint if child.tag in ATTRIBUTES)
    for inertial in robot.findall("link/inertial"):
        yield from (child for child in inertial if child.tag in ATTRIBUTES)
    for collision in collisions:
        yield from (child for child in collision.iter() if child.tag in ATTRIBUTES)


def _masses(robot: etree._Element, draft: Draft) -> None:
    for link in robot.findall("link"):
        inertial = link.find("inertial")
        if inertial is None:
            continue
        tensor, name = inertial.find("inertia"), link.get("name")
        if inertial.find("mass") is None:
            draft.doubts.append(f"line {inertial.sourceline}: <inertial> of '{name}' has no <mass>; set to 0")
        missing = [key for key in ("ixx", "iyy", "izz") if tensor is not None and key not in tensor.attrib]
        if missing:
            draft.doubts.append(f"line {tensor.sourceline}: <inertia> of '{name}' has no {', '.join(missing)}; set to 0")
