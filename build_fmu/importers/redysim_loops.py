"""Closed loops of a ReDySim model. Its files define neither the loop closure nor all ground pivots, so the user specifies both."""

from __future__ import annotations

import math
import re
from collections.abc import Sequence
from pathlib import Path

import numpy as np

from build_fmu.errors import UserError, did_you_mean
from build_fmu.importers.draft import GROUND, Draft, DraftLink, DraftTie
from build_fmu.importers.fields import read_text
from build_fmu.importers.layout import settle
from build_fmu.importers.rigid import pose_of, rotation_x, rotation_y, rotation_z, transform

OPEN = 1e-8  # m, the rounding error of a closed loop
LOOP = "--loop 'LINK:x,y,z=LINK:x,y,z', for example --loop 'link1:0.05,0,0=link3:0.1,0,0'"
PIVOT = "--pivot LINK=x,y,z, for example --pivot link4=1,0,0"


def place_pivots(draft: Draft, data, arguments: Sequence[str]) -> None:
    """Moves links on the ground to the given points of the ground frame (m)."""
    links = {link.name: link for link in draft.links}
    given = set()
    for argument in arguments:
        name, equals, text = argument.partition("=")
        link = _known(name.strip(), links, f"--pivot '{argument}'")
        point = _point(text, f"--pivot '{argument}'", PIVOT)
        if not equals or link.parent != GROUND:
            raise UserError(f"--pivot '{argument}': the parent of '{link.name}' is '{link.parent}', not ground")
        pose = pose_of(link.dh)
        pose[:3, 3] = point
        link.dh = settle(pose)
        given.add(link.name)
    feet: dict[tuple[float, ...], list[str]] = {}
    for link in draft.links:
        if link.parent == GROUND and link.name not in given and _closed(data):
            feet.setdefault(tuple(np.round(pose_of(link.dh)[:3, 3], 9) + 0.0), []).append(link.name)
    for point, names in feet.items():
        if len(names) > 1:
            where = ", ".join(f"{x:g}" for x in point)
            draft.doubts.append(
                f"{', '.join(names)} share the ground point ({where}): ReDySim's files omit ground pivots; specify them with {PIVOT}"
            )


def add_loops(draft: Draft, data, arguments: Sequence[str]) -> None:
    """Adds the given loops; reports missing loops and constraint violations of the initial configuration."""
    closed = _closed(data)
    poses = start_poses(draft.links)
    fragments = 0
    for argument in arguments:
        if argument.lower().endswith(".toml"):
            draft.fragments.append(read_text(Path(argument)))
            fragments += 1
        else:
            draft.loops.append(_loop(draft, argument, poses, len(draft.loops) + 1))
    if closed and not arguments:
        wanted = len(draft.links) - data.whole("dof") if "dof" in data else 0
        rows = f", {wanted} constraints in total" if wanted > 0 else ""
        draft.lost.append(
            f"the loops: ReDySim's input does not define them (type = 1{rows}); specify each with {LOOP}, otherwise the mechanism is an "
            "open tree"
        )
    if arguments:
        # driven joints keep their start values in the assembly of the loops
        for link in draft.links:
            link.hold = link.drive == "torque" and isinstance(link.q, float)


def start_poses(links: Sequence[DraftLink]) -> dict[str, np.ndarray]:
    """Returns ground to link at the start values."""
    poses = {GROUND: np.eye(4)}
    waiting = list(links)
    while waiting:
        ready = [link for link in waiting if link.parent in poses]
        if not ready:
            raise UserError(f"cyclic parent references: {', '.join(link.name for link in waiting)}")
        for link in ready:
            poses[link.name] = poses[link.parent] @ _pose(link)
        waiting = [link for link in waiting if link.name not in poses]
    return poses


def _pose(link: DraftLink) -> np.ndarray:
    if link.joint not in ("planar", "free"):
        return pose_of(link.dh, link.joint, link.q)
    if link.joint == "planar":
        x, y, phi = link.q or [0.0] * 3
        return pose_of(link.dh) @ transform(rotation_z(phi), (x, y, 0))
    *place, phi, theta, psi = link.q or [0.0] * 6
    return pose_of(link.dh) @ transform(rotation_z(phi) @ rotation_x(theta) @ rotation_y(psi), place)


def _loop(draft: Draft, argument: str, poses: dict[str, np.ndarray], number: int) -> DraftTie:
    where = f"--loop '{argument}'"
    sides = argument.split("=")
    if len(sides) != 2:
        raise UserError(f"{where} is not a loop: write {LOOP}")
    fields: dict[str, object] = {"type": "point"}
    points = []
    for side, text in zip("ab", sides, strict=True):
        name, colon, place = text.partition(":")
        name = name.strip()
        if name not in poses:
            raise UserError(f"{where}: unknown link '{name}'{did_you_mean(name, poses)}")
        point = _point(place, where, LOOP) if colon else [0.0, 0.0, 0.0]
        fields[f"link_{side}"], fields[f"point_{side}"] = name, point
        points.append((poses[name] @ [*point, 1.0])[:3])
    gap = points[1] - points[0]
    directions, left_out = _plane(draft.links, poses)
    if directions:
        fields["directions"] = directions
        if abs(float(np.dot(gap, left_out))) > OPEN:
            draft.doubts.append(
                f"loop{number}: the two points are {abs(float(np.dot(gap, left_out))):.3g} m apart normal to the plane of the mechanism"
            )
        gap = gap - left_out * np.dot(gap, left_out)
    else:
        fields["type"] = "spherical"
    size = float(np.linalg.norm(gap))
    if size > OPEN:
        draft.doubts.append(
            f"the initial configuration violates loop{number} by {1000 * size:.3g} mm; the FMU corrects it before the first step and "
            "keeps the driven joints (hold = true)"
        )
    return DraftTie(f"loop{number}", fields)


def _plane(links: Sequence[DraftLink], poses: dict[str, np.ndarray]) -> tuple[list[list[float]] | None, np.ndarray]:
    """Returns the directions of a planar loop and the normal of its plane, or None for a spatial mechanism.

    Planar: revolute joints and planar bases along the normal, prismatic joints perpendicular to it.
    """
    for normal in np.eye(3)[::-1]:
        along = [(link.joint, abs(float(poses[link.name][:3, 2] @ normal))) for link in links]
        if all(x > 1 - 1e-9 if joint in ("revolute", "planar") else joint == "prismatic" and x < 1e-9 for joint, x in along):
            return [[float(x) for x in axis] for axis in np.eye(3) if not axis @ normal], normal
    return None, np.zeros(3)


def _closed(data) -> bool:
    return "type" in data and data.whole("type") == 1


def _known(name: str, links: dict[str, DraftLink], where: str) -> DraftLink:
    if name not in links:
        raise UserError(f"{where}: unknown link '{name}'{did_you_mean(name, links)}")
    return links[name]


def _point(text: str, where: str, example: str) -> list[float]:
    cells = [cell for cell in re.split(r"[,\s]+", text.strip()) if cell]
    try:
        point = [float(cell) for cell in cells]
    except ValueError:
        point = []
    if len(point) != 3 or not all(math.isfinite(x) for x in point):
        raise UserError(f"{where}: a point must be three numbers in m; write {example}")
    return point
