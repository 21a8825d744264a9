"""Lists the content of a URDF that a model file cannot represent, including unknown and misspelt names."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable

from lxml import etree

from build_fmu.errors import did_you_mean
from build_fmu.importers.draft import Draft

# the children of each element that are read or reported separately
CHILDREN = {
    "robot": ("link", "joint", "material", "transmission", "gazebo", "sensor", "ros2_control"),
    "link": ("inertial", "visual", "collision"),
    "joint": ("origin", "parent", "child", "axis", "dynamics", "limit", "mimic"),
    "inertial": ("origin", "mass", "inertia"),
    "collision": ("origin", "geometry", "material", "verbose"),
}
ATTRIBUTES = {
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
    for parent in [robot, *robot.findall("link"), *robot.findall("joint"), *robot.findall("link/inertial"), *collisions]:
        seen = set()
        for child in parent:
            if child.tag not in CHILDREN[parent.tag]:
                tags[parent.tag, child.tag] += 1
                first.setdefault((parent.tag, child.tag), child.sourceline)
            elif parent.tag != "robot" and child.tag in seen and child.tag not in ("visual", "collision", "geometry"):
                draft.lost.append(f"line {child.sourceline}: duplicate <{child.tag}> in <{parent.tag}>: the first one is used")
            seen.add(child.tag)
    for (parent, tag), count in tags.items():
        draft.lost.append(f"{count} x <{tag}> in <{parent}>, first in line {first[parent, tag]}{did_you_mean(tag, CHILDREN[parent])}")
    places: dict[tuple[str, str], list[int]] = {}
    for element in _read(robot, collisions):
        for key in element.attrib:
            if key not in ATTRIBUTES[element.tag]:
                places.setdefault((element.tag, key), []).append(element.sourceline)
    for (tag, key), at in places.items():
        what = f"'{key}' of <{tag}>"
        draft.lost.append(
            (f"line {at[0]}: {what}" if len(at) == 1 else f"{len(at)} x {what}, first in line {at[0]}") + did_you_mean(key, ATTRIBUTES[tag])
        )


def _read(robot: etree._Element, collisions: list[etree._Element]) -> Iterable[etree._Element]:
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
