"""Masses and inertias of links without them, by --density or --mass: from shapes or, without any shape, from the lengths of the links."""

from __future__ import annotations

from argparse import Namespace

import numpy as np

from build_fmu.errors import InvalidArgument, listed
from build_fmu.importers.draft import GROUND, Draft, DraftLink
from build_fmu.importers.rigid import pose_of, six_of
from build_fmu.importers.solids import Body, Solid, body_of, is_open, joined

SLENDER = 0.05  # radius of a rod over the length of the longest one


def add_masses(draft: Draft, solids: dict[str, list[Solid]], options: Namespace) -> None:
    """Fills masses, centers and inertias; `solids` by link. Reports what is missing, or what was filled."""
    still, empty = fixed_to_ground(draft.links), without_mass(draft.links)
    if options.density is None and options.mass is None:
        if len(empty) == sum(link.name not in still for link in draft.links):
            draft.lost.append("masses and inertias: the file contains none; --density or --mass fills them, or add them to the model file")
        return
    if options.density is not None and options.mass is not None:
        raise InvalidArgument("--density and --mass exclude each other: give one of them")
    source = "shapes"
    if not any(solids.get(link.name) for link in empty) and len(empty) == len(draft.links):
        solids, source = _rods(draft.links), "link lengths, as rods"
    bodies = {link.name: joined([body_of(solid) for solid in solids[link.name]]) for link in empty if solids.get(link.name)}
    volume = sum(body.mass for body in bodies.values())
    if not volume:
        draft.doubts.append(
            f"{'--density' if options.mass is None else '--mass'} has no effect: no moving link without a mass has a readable shape"
        )
        return
    density = options.density if options.mass is None else options.mass / volume
    for link in empty:
        if link.name in bodies:
            _fill(link, bodies[link.name].scaled(density))
    total = f"{density * volume:.4g} kg in total"
    draft.doubts.append(f"masses and inertias of {listed(list(bodies))}: {density:.4g} kg/m3 and {source}, {total}")
    boxes = {solid.file for name in bodies for solid in solids[name] if solid.file and is_open(solid.file)}
    if boxes:
        draft.doubts.append(f"{len(boxes)} meshes are not closed: their masses are those of their bounding boxes")
    left = [link.name for link in empty if link.name not in bodies]
    if left:
        draft.doubts.append(f"without readable shapes and therefore without mass: {listed(left)}")


def fixed_to_ground(links: list[DraftLink]) -> set[str]:
    """Returns the names of the links that cannot move, with the ground."""
    still = {GROUND}
    for link in links:
        if link.joint == "fixed" and link.parent in still:
            still.add(link.name)
    return still


def without_mass(links: list[DraftLink]) -> list[DraftLink]:
    """Returns the moving links with neither mass nor inertia."""
    still = fixed_to_ground(links)
    return [link for link in links if link.name not in still and not link.mass and not any(link.inertia)]


def _fill(link: DraftLink, body: Body) -> None:
    link.mass, link.com, link.inertia = float(body.mass), [float(x) for x in body.com], six_of(body.inertia)


def _rods(links: list[DraftLink]) -> dict[str, list[Solid]]:
    """Returns rods from each link's origin to its children; a moving link without one is a ball. Without any length: none."""
    ends: dict[str, list[np.ndarray]] = {link.name: [] for link in links}
    for link in links:
        q = 0.0 if isinstance(link.q, list) else link.q
        end = pose_of(link.dh, link.joint, q)[:3, 3]
        if link.parent in ends and np.linalg.norm(end) > 1e-9:
            ends[link.parent].append(end)
    longest = max((float(np.linalg.norm(end)) for own in ends.values() for end in own), default=0.0)
    if not longest:
        # one link, or all at one point: the offsets of the first joints
        longest = max((float(np.linalg.norm(pose_of(link.dh)[:3, 3])) for link in links), default=0.0)
    if not longest:
        return {}
    radius = SLENDER * longest
    solids = {name: [Solid("cylinder", [radius, float(np.linalg.norm(end))], _along(end)) for end in own] for name, own in ends.items()}
    for link in links:
        if not solids[link.name] and link.joint != "fixed":
            solids[link.name] = [Solid("sphere", [radius])]
    return solids


def _along(end: np.ndarray) -> np.ndarray:
    """Returns the frame in the middle of a rod from the origin, with z along it."""
    z = end / np.linalg.norm(end)
    x = np.cross(z, np.eye(3)[int(np.argmin(np.abs(z)))])
    x /= np.linalg.norm(x)
    pose = np.eye(4)
    pose[:3, :3], pose[:3, 3] = np.column_stack([x, np.cross(z, x), z]), end / 2
    return pose
