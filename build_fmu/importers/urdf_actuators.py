"""Converts <limit effort velocity> and simple <transmission> elements of a URDF to actuators."""

from __future__ import annotations

import math
from dataclasses import dataclass, field

from lxml import etree

from build_fmu.errors import did_you_mean, listed
from build_fmu.importers.draft import Draft, DraftTie
from build_fmu.importers.toml_writer import number
from build_fmu.importers.urdf_file import Urdf

DRIVEN = ("revolute", "prismatic")
LIMITS = {"effort": "torque_limit", "velocity": "speed_limit"}


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
        draft.lost.append(f"the reductions of {listed(idle)}: without <motorInertia> they have no effect on the motion")
    following = []
    for name, drive in drives.items():
        link = links[layout.called[joints[name].name]]
        if link.drive != "torque":
            following.append(name)
        elif drive.fields:
            note = [] if drive.idle_reduction is None else [f"URDF: gear_ratio = {number(drive.idle_reduction)}, without a rotor inertia"]
            draft.actuators.append(DraftTie("", {"joint": link.joint_name, **drive.fields}, note))
    if following:
        draft.lost.append(f"the drives of {listed(following)}: mimic joints have no drive of their own")


def _read_transmissions(urdf: Urdf, joints: dict, drives: dict[str, Drive], draft: Draft) -> None:
    still: list[str] = []
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
        reduction, inertia = (_inner(urdf, element, tag) for tag in ("mechanicalReduction", "motorInertia"))
        reduction = 1.0 if reduction is None else reduction
        if reduction == 0:
            raise urdf.error(element, f"<mechanicalReduction> of '{named[0]}' must not be 0")
        if inertia is not None and inertia < 0:
            raise urdf.error(element, f"<motorInertia> of '{named[0]}' must be >= 0, got {inertia:g}")
        drive = drives[named[0]] = Drive()
        if inertia:
            drive.fields = ({} if reduction == 1 else {"gear_ratio": reduction}) | {"rotor_inertia": inertia}
        elif reduction != 1:
            drive.idle_reduction = reduction
    for reason, places in refused.items():
        draft.lost.append(f"line {places[0][0]}: <transmission> {listed([name for _, name in places])}: {reason}")
    if still:
        which = "only revolute, continuous and prismatic joints have drives, unless they are locked"
        draft.lost.append(f"<transmission> of {listed(still)}: {which}")


def _can_have_drive(body) -> bool:
    return body.kind in DRIVEN and body.drive != "locked"


def _reason(element: etree._Element, named: list[str], joints: dict, drives: dict[str, Drive]) -> str:
    """Returns why a <transmission> cannot be converted; empty if it can."""
    kind = (element.findtext("type") or element.get("type") or "SimpleTransmission").strip()
    if not kind.endswith("SimpleTransmission") or len(named) != 1 or len(element.findall("actuator")) > 1:
        return f"{kind}: only simple transmissions of one joint and one actuator are supported" if named else "no <joint>"
    if named[0] not in joints:
        return f"unknown joint '{named[0]}'{did_you_mean(named[0], joints)}"
    return f"'{named[0]}' already has a transmission" if named[0] in drives else ""


def _inner(urdf: Urdf, element: etree._Element, tag: str) -> float | None:
    """Returns the number in an element of a transmission, which releases place differently; None without it."""
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
