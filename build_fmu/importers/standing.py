"""The start pose of legs whose knee cannot be straight: the foot stays below the hip."""

from __future__ import annotations

import math
from collections.abc import Container

import numpy as np

from build_fmu.importers.rigid import transform
from build_fmu.importers.tree import Body

PARALLEL = 0.999  # cosine of the angle between the axes of hip and knee
LOW = 0.2  # of the height of all links: feet are below


def feet_below(knees: list[Body], bodies: dict[str, Body], shapes: dict[str, list[np.ndarray]], asked: Container[str]) -> list[Body]:
    """Turns the hips of bent knees until the foot is in the direction in which it is with a straight leg; returns the hips.

    A hip is the nearest joint with a parallel axis above the knee. Those of `asked` keep their position. The foot is the farthest link, or
    the farthest of the `shapes`, positions in the frames of the links, that the knee carries.
    """
    hips = []
    heights = [_pose(body, bodies)[2, 3] for body in bodies.values()]
    low = min(heights) + LOW * (max(heights) - min(heights))
    for knee in knees:
        tip = _tip(knee, bodies, shapes)
        hip = _hip(knee, bodies)
        if hip is None or hip.joint in asked or hip in knees or (_pose(knee, bodies) @ tip)[2] > low:
            continue
        bent = (_pose(knee, bodies, hip) @ tip)[:3]
        knee.q, kept = 0.0, knee.q
        straight = (_pose(knee, bodies, hip) @ tip)[:3]
        knee.q = kept
        across = np.cross(bent, straight) @ hip.axis
        along = bent @ straight - (bent @ hip.axis) * (straight @ hip.axis)
        q = float(f"{hip.q + math.atan2(across, along):.3g}")
        if q != hip.q and (hip.limits is None or hip.limits[0] <= q <= hip.limits[1]):
            hip.q = q
            hips.append(hip)
    return hips


def _hip(knee: Body, bodies: dict[str, Body]) -> Body | None:
    body = bodies[knee.parent]
    while body.joint:
        turn = _pose(knee, bodies, body)[:3, :3]
        if body.kind == "revolute" and abs(body.axis @ turn @ knee.axis) > PARALLEL:
            return body
        body = bodies[body.parent]
    return None


def _tip(knee: Body, bodies: dict[str, Body], shapes: dict[str, list[np.ndarray]]) -> np.ndarray:
    """Returns the farthest origin or shape of the links that the knee carries, in the frame of its link."""
    waiting, points = [knee.name], []
    while waiting:
        body = bodies[waiting.pop()]
        pose = _pose(body, bodies, knee)
        points += [pose[:3, 3], *(pose[:3, :3] @ point + pose[:3, 3] for point in shapes.get(body.name, []))]
        waiting += body.children
    return np.append(max(points, key=lambda point: float(np.linalg.norm(point))), 1.0)


def _pose(body: Body, bodies: dict[str, Body], top: Body | None = None) -> np.ndarray:
    """Returns the pose of a link in the frame of the link `top` above it, or of the root."""
    pose = np.eye(4)
    while body is not top and body.joint:
        pose = body.origin @ _motion(body) @ pose
        body = bodies[body.parent]
    return pose


def _motion(body: Body) -> np.ndarray:
    if body.kind == "prismatic":
        return transform(None, body.q * body.axis)
    if body.kind != "revolute":
        return np.eye(4)
    x, y, z = body.axis
    cross = np.array([[0, -z, y], [z, 0, -x], [-y, x, 0]])
    return transform(np.eye(3) + math.sin(body.q) * cross + (1 - math.cos(body.q)) * cross @ cross)
