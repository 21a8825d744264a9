"""Mass and inertia that each joint of a tree moves in the start pose."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from build_fmu.importers.draft import DraftLink
from build_fmu.importers.rigid import matrix_of, start_poses


@dataclass(frozen=True)
class Carried:
    """The link of a joint and all that it carries."""

    mass: float  # kg
    inertia: float  # with the armature: about the joint axis, kg m2; of a prismatic joint the mass, kg
    lever: float  # m, distance of the center of mass from the joint axis


def carried(links: Sequence[DraftLink]) -> dict[str, Carried]:
    """Returns what each joint moves, by the name of its link."""
    poses, result = start_poses(links), {}
    # mass, its first moment and inertia about the ground's origin, of each link with all that it carries
    sums = {link.name: [0.0, np.zeros(3), np.zeros((3, 3))] for link in links}
    for link in reversed(links):
        place, own = poses[link.name], sums[link.name]
        turn, axis, origin = place[:3, :3], place[:3, 2], place[:3, 3]
        com = turn @ link.com + origin
        own[0] += link.mass
        own[1] += link.mass * com
        own[2] += turn @ matrix_of(link.inertia) @ turn.T + link.mass * (com @ com * np.eye(3) - np.outer(com, com))
        for k in range(3 if link.parent in sums else 0):
            sums[link.parent][k] += own[k]
        mass, moment, inertia = own
        arm = np.cross(axis, origin)
        about_axis = axis @ inertia @ axis - 2 * np.cross(axis, moment) @ arm + mass * (arm @ arm)
        lever = float(np.linalg.norm(np.cross(axis, moment / mass - origin))) if mass > 0 else 0.0
        result[link.name] = Carried(mass, link.armature + (mass if link.joint == "prismatic" else float(about_axis)), lever)
    return result
