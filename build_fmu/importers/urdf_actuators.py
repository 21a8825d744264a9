"""Converts <limit effort velocity> and simple <transmission> elements of a URDF to actuators."""

from __future__ import annotations

import math
from dataclasses import dataclass, field

from lxml import etree

from build_fmu.errors import UserError, did_you_mean, listed
from build_fmu.importers.draft import Draft, DraftTie
from build_fmu.importers.toml_writer import number
from build_fmu.importers.urdf_file import Urdf

DRIVEN = ("revolute", "prismatic")
SIMPLE = "SimpleTransmission"
LIMITS = {"effort": "torque_limit", "velocity": "speed_limit"}
# names of reduction and rotor inertia: of ROS, the text of elements anywhere in a transmission; of Drake, attributes in its <actuator>
ROS = ("mechanicalReduction", "motorInertia")
DRAKE = ("drake:gear_ratio", "drake:rotor_inertia")


@dataclass
class Drive:
    """What the URDF states of the drive of a joint: fields of [[actuator]], and a reduction without effect in the model."""

    fields: dict[str, float] = field(default_factory=dict)
    idle_reduction: float | None = None


def add_actuators(urdf: Urdf, joints: dict, layout, limits: bool) -> None:
    """Adds the actuators to layout.draft and lists what is omitted. `joints` has a body per joint name; `limits`: convert <limit>."""
    draft, drives = layout.draft, {}
    _read_transmissions(urdf, joints, drives, draft)
    _read_limits(urdf, joints, drives, draft, limits)
    links = {link.name: link for link in draft.links}
    idle = [name for name, drive in drives.items() if drive.idle_reduction is not None]
    if idle:
        draft.lost.append(f"the reductions of {listed(idle)}: without a rotor inertia they have no effect on the motion")
    following = []
    for name, drive in drives.items():
        link = links[layout.called[joints[name].name]]
        if link.drive != "torque":
            following.append(name)
        elif drive.fields:
            idle = drive.idle_reduction
            note = [] if idle is None else [f"{urdf.source}: gear_ratio = {number(idle)}, without a rotor inertia"]
            draft.actuators.append(DraftTie("", {"joint": link.joint_name, **drive.fields}, note))
    if following:
        draft.lost.append(f"the drives of {listed(following)}: mimic joints have no drive of their own")


def _read_transmissions(urdf: Urdf, joints: dict, drives: dict[str, Drive], draft: Draft) -> None:
    still: list[str] = []
    unpowered: list[str] = []
    refused: dict[str, list[tuple[int, str]]] = {}
    for element in urdf.root.findall("transmission"):
        named = [urdf.text(joint, "name") for joint in element.findall("joint")]
        reason = _reason(element, named, joints, drives)
        if not reason and not _can_have_drive(joints[named[0]]):
            still.append(named[0])
            continue
        if reason:
            name = element.get("name") or element.get("type") or ""
            refused.setdefault(reason, []).append((element.sourceline, f"'{name}'"))
            continue
        drive = drives[named[0]] = Drive()
        reduction, inertia, of_drake = _gear(urdf, element, named[0], draft)
        if inertia and of_drake and _has_no_effort(urdf, named[0]):
            unpowered.append(named[0])
        elif inertia:
            drive.fields = ({} if reduction == 1 else {"gear_ratio": reduction}) | {"rotor_inertia": inertia}
        elif reduction != 1:
            drive.idle_reduction = reduction
    for reason, places in refused.items():
        draft.lost.append(f"line {places[0][0]}: <transmission> {listed([name for _, name in places])}: {reason}")
    if still:
        which = "only revolute, continuous and prismatic joints have drives, unless they are locked"
        draft.lost.append(f"{'<transmission>' if urdf.source == 'URDF' else 'the rotors'} of {listed(still)}: {which}")
    if unpowered:
        draft.lost.append(f"<{DRAKE[1]}> of {listed(unpowered)}: for Drake joints with an effort limit of 0 have no actuator")


def _gear(urdf: Urdf, element: etree._Element, joint: str, draft: Draft) -> tuple[float, float, bool]:
    """Returns reduction and rotor inertia of a transmission, and whether they are Drake's, which replace those of ROS, as in Drake."""
    drake = [_inner(urdf, element, tag) for tag in DRAKE]
    ros = [None, _inner(urdf, element, ROS[1])]
    try:
        ros[0] = _inner(urdf, element, ROS[0])
    except UserError as error:
        if ros[1]:
            raise
        draft.lost.append(f"{error}; without <{ROS[1]}> it has no effect")
    of_drake = drake != [None, None]
    unused = [tag for tag, value, neutral in zip(ROS, ros, (1, 0), strict=True) if of_drake and value not in (None, neutral)]
    if unused:
        names = " and ".join(f"<{tag}>" for tag in unused)
        draft.lost.append(f"line {element.sourceline}: {names} of '{joint}': <{DRAKE[0]}> and <{DRAKE[1]}> are used instead")
    (reduction, inertia), tags = (drake, DRAKE) if of_drake else (ros, ROS)
    if reduction == 0:
        raise urdf.error(element, f"<{tags[0]}> of '{joint}' must not be 0")
    if inertia is not None and inertia < 0:
        raise urdf.error(element, f"<{tags[1]}> of '{joint}' must be >= 0, got {inertia:g}")
    return 1.0 if reduction is None else reduction, inertia or 0.0, of_drake


def _has_no_effort(urdf: Urdf, joint: str) -> bool:
    limits = [limit for element in urdf.root.findall("joint") if element.get("name") == joint for limit in element.findall("limit")[:1]]
    return any("effort" in limit.attrib and urdf.bound(limit, "effort") == 0 for limit in limits)


def _can_have_drive(body) -> bool:
    return body.kind in DRIVEN and body.drive != "locked"


def kind_of(transmission: etree._Element) -> str:
    """Returns the type of a <transmission>, which ends with SIMPLE for the ones that are supported."""
    return (transmission.findtext("type") or transmission.get("type") or SIMPLE).strip()


def _reason(element: etree._Element, named: list[str], joints: dict, drives: dict[str, Drive]) -> str:
    """Returns why a <transmission> cannot be converted; empty if it can."""
    kind = kind_of(element)
    if not kind.endswith(SIMPLE) or len(named) != 1 or len(element.findall("actuator")) > 1:
        return f"{kind}: only simple transmissions of one joint and one actuator are supported" if named else "no <joint>"
    if named[0] not in joints:
        return f"unknown joint '{named[0]}'{did_you_mean(named[0], joints)}"
    return f"'{named[0]}' already has a transmission" if named[0] in drives else ""


def _inner(urdf: Urdf, element: etree._Element, tag: str) -> float | None:
    """Returns the number in an element of a transmission; None without it."""
    if tag in DRAKE:
        found = next((inner for actuator in element.findall("actuator") for inner in actuator.iterchildren(tag)), None)
        return None if found is None else urdf.numbers(found, "value", 1, "")[0]
    # releases of ROS place it differently
    found = next(element.iter(tag), None)
    if found is None:
        return None
    try:
        value = float(found.text or "")
    except ValueError:
        value = math.nan
    if not math.isfinite(value):
        raise urdf.error(found, f"<{tag}> must be a number, got '{(found.text or '').strip()}'")
    return value


def _read_limits(urdf: Urdf, joints: dict, drives: dict[str, Drive], draft: Draft, wanted: bool) -> None:
    bounded, idle = [], []
    for element in urdf.root.findall("joint"):
        limit, name = element.find("limit"), element.attrib["name"]
        if limit is None or not _can_have_drive(joints[name]):
            continue
        fields = {}
        for key, ours in LIMITS.items():
            value = urdf.bound(limit, key)
            if 0 < value < math.inf:
                fields[ours] = value
            elif value <= 0 and key in limit.attrib:
                idle.append(f"{name} ({key})")
        if fields:
            bounded.append(name)
        if fields and wanted:
            drives.setdefault(name, Drive()).fields.update(fields)
    if bounded and not wanted:
        draft.lost.append(f"the effort and velocity limits of {listed(bounded)}: --limits converts them to limits of actuators")
    if idle and wanted:
        draft.doubts.append(f"limits that are not positive are read as no limit: {listed(idle)}")
