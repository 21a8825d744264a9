"""A PD controller that holds the start pose of an imported robot, with gains by the masses."""

from __future__ import annotations

import math

import numpy as np

from build_fmu.errors import UserError, listed
from build_fmu.importers.carried import carried
from build_fmu.importers.draft import Draft
from build_fmu.importers.rigid import start_poses

FREQUENCY = 3.0  # Hz, at least: of what a joint moves on its controller
SAG = {"revolute": 0.02, "prismatic": 0.005}  # rad, m, at most: under the weight in the least favourable direction
DAMPING_RATIO = 0.7


def hold_start(draft: Draft) -> None:
    """Adds the controller to the draft. A leg that stands on the ground carries its share of the whole robot."""
    poses, moved = start_poses(draft.links), carried(draft.links)
    share, feet, center = _standing(draft, poses)
    gravity = math.hypot(*draft.gravity)
    controlled, idle = {}, []
    for link in draft.links:
        if link.joint not in SAG or link.drive != "torque":
            continue
        name, load = link.joint_name or link.name, moved[link.name]
        turns, stands = link.joint == "revolute", link.name in feet
        # of a leg also those of the robot on its foot; an ankle balances the robot above it
        reach = max(_distance(poses[link.name], point) for point in (*feet[link.name], center)) if stands else 0.0
        lever, foot_lever = (load.lever, reach) if turns else (1.0, 1.0)
        weight = gravity * max(load.mass * lever, stands * share * foot_lever)
        inertia = max(load.inertia, stands * share * foot_lever**2)
        if inertia <= 0:
            idle.append(name)
            continue
        kp = max(inertia * (2 * math.pi * FREQUENCY) ** 2, weight / SAG[link.joint])
        kd = 2 * DAMPING_RATIO * math.sqrt(kp * inertia)
        controlled[name] = (float(f"{kp:.2g}"), float(f"{kd:.2g}"))
    if idle:
        draft.lost.append(f"--hold for {listed(idle)}: these joints move no mass")
    if not controlled:
        raise UserError("--hold: no joint with a drive moves a mass")
    kp, kd = (list(gains) for gains in zip(*controlled.values(), strict=True))
    draft.controller = {"law": "pd", "joints": list(controlled), "kp": kp, "kd": kd, "input": True}
    draft.doubts.append(
        f"a PD controller holds the start pose of {listed(list(controlled))}: its gains give a natural frequency of at least "
        f"{FREQUENCY:g} Hz and a sag of at most {SAG['revolute']:g} rad or {SAG['prismatic']:g} m under its weight; "
        "the inputs are added to its torques"
    )


def _standing(draft: Draft, poses: dict[str, np.ndarray]) -> tuple[float, dict[str, list[np.ndarray]], np.ndarray]:
    """Returns the mass on each foot of a floating robot with contacts, kg, where the feet are that each link carries, and its center, m."""
    links = {link.name: link for link in draft.links}
    if not any(link.joint == "free" for link in draft.links):
        return 0.0, {}, np.zeros(3)
    feet: dict[str, list[np.ndarray]] = {}
    for contact in draft.contacts:
        name = str(contact.fields["link_a"])
        points = contact.fields.get("points_a") or [contact.fields.get("point_a", [0.0] * 3)]
        link = links.get(name)
        while link and link.joint != "free":
            feet.setdefault(link.name, []).extend((poses[name] @ [*point, 1])[:3] for point in points)
            link = links.get(link.parent)
    touching = {contact.fields["link_a"] for contact in draft.contacts}
    mass = sum(link.mass for link in draft.links)
    center = sum(link.mass * (poses[link.name] @ [*link.com, 1])[:3] for link in draft.links) / (mass or 1.0)
    return mass / max(1, len(touching)), feet, center


def _distance(place: np.ndarray, point: np.ndarray) -> float:
    """Returns the distance of a point from the z axis of a frame, m."""
    return float(np.linalg.norm(np.cross(place[:3, 2], point - place[:3, 3])))
