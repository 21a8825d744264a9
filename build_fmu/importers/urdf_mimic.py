"""Converts <mimic> of URDF joints, q = multiplier q_leader + offset, to couplings."""

from __future__ import annotations

from collections.abc import Container
from dataclasses import dataclass

from build_fmu.errors import did_you_mean, listed
from build_fmu.importers.draft import Draft, DraftTie
from build_fmu.importers.urdf_file import Urdf

COUPLED = ("revolute", "prismatic")


@dataclass
class Mimic:
    """Names of the follower and its leader in the URDF; multiplier and offset in rad and m."""

    joint: str
    leader: str
    multiplier: float
    offset: float


def read_mimics(urdf: Urdf, joints: dict, draft: Draft) -> list[Mimic]:
    """Returns the mimic joints, leaders before followers, and lists those that cannot be converted. `joints` has a body per joint name."""
    found: dict[str, Mimic] = {}
    for element in urdf.root.findall("joint"):
        mimic, name = element.find("mimic"), element.attrib["name"]
        if mimic is None:
            continue
        leader = urdf.text(mimic, "joint")
        multiplier, offset = (urdf.numbers(mimic, key, 1, default)[0] for key, default in (("multiplier", "1"), ("offset", "0")))
        reason = _reason(name, leader, joints)
        if reason:
            draft.lost.append(f"line {mimic.sourceline}: <mimic> of '{name}': {reason}")
        else:
            found[name] = Mimic(name, leader, multiplier, offset)
    cyclic = [name for name in found if _follows_itself(name, found)]
    if cyclic:
        draft.lost.append(f"<mimic> of {listed(cyclic)}: cyclic references")
    ordered: dict[str, Mimic] = {}
    for name in found:
        chain = []
        while name in found and name not in ordered and name not in cyclic:
            chain.append(found[name])
            name = found[name].leader
        ordered |= {mimic.joint: mimic for mimic in reversed(chain)}
    return list(ordered.values())


def _reason(name: str, leader: str, joints: dict) -> str:
    """Returns why a <mimic> cannot be converted; empty if it can."""
    if leader not in joints:
        return f"unknown joint '{leader}'{did_you_mean(leader, joints)}"
    other = [joint for joint in (name, leader) if joints[joint].kind not in COUPLED]
    return f"'{other[0]}' is not a revolute, continuous or prismatic joint" if other else ""


def _follows_itself(name: str, mimics: dict[str, Mimic]) -> bool:
    at, seen = mimics[name].leader, set()
    while at in mimics and at != name and at not in seen:
        seen.add(at)
        at = mimics[at].leader
    return at == name


def follow(mimics: list[Mimic], joints: dict, asked: Container[str], draft: Draft) -> None:
    """Sets the start positions of the mimic joints; reports those of `asked`, the joints of --pose, that differ."""
    for mimic in mimics:
        body, q = joints[mimic.joint], mimic.multiplier * joints[mimic.leader].q + mimic.offset
        if mimic.joint in asked and body.q != q:
            draft.doubts.append(f"--pose: '{mimic.joint}' starts at {q:g}, not {body.q:g}, because it follows '{mimic.leader}'")
        body.q = q


def add_couplings(mimics: list[Mimic], joints: dict, layout) -> None:
    """Adds the couplings to layout.draft. Mimic joints have no input; a multiplier of 0 locks the joint."""
    links = {link.name: link for link in layout.draft.links}
    for mimic in mimics:
        link, leader = (links[layout.called[joints[name].name]] for name in (mimic.joint, mimic.leader))
        link.drive = "free" if mimic.multiplier else "locked"
        if mimic.multiplier:
            fields = {"joints": [link.joint_name, leader.joint_name], "ratios": [1, -mimic.multiplier], "offset": mimic.offset}
            name = layout.names.take(f"{link.joint_name}_mimic")
            layout.draft.couplings.append(DraftTie(name, {key: value for key, value in fields.items() if value}))
