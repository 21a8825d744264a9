"""Rigid transforms as 4x4 matrices, and the modified DH parameters of a frame (docs/notation.md)."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from build_fmu.importers.draft import GROUND, DhFrame, DraftLink


def rotation_x(angle: float) -> np.ndarray:
    c, s = _cos_sin(angle)
    return np.array([[1.0, 0, 0], [0, c, -s], [0, s, c]])


def rotation_y(angle: float) -> np.ndarray:
    c, s = _cos_sin(angle)
    return np.array([[c, 0, s], [0, 1.0, 0], [-s, 0, c]])


def rotation_z(angle: float) -> np.ndarray:
    c, s = _cos_sin(angle)
    return np.array([[c, -s, 0], [s, c, 0], [0, 0, 1.0]])


def transform(rotation: np.ndarray | None = None, position: Sequence[float] = (0, 0, 0)) -> np.ndarray:
    """Returns the 4x4 matrix of a frame; columns of `rotation` are its axes, `position` its origin (m)."""
    result = np.eye(4)
    result[:3, :3] = np.eye(3) if rotation is None else rotation
    result[:3, 3] = position
    return result


def inverse(t: np.ndarray) -> np.ndarray:
    rotation = t[:3, :3].T
    return transform(rotation, -rotation @ t[:3, 3])


def pose_of(dh: DhFrame, joint: str = "fixed", q: float = 0.0) -> np.ndarray:
    """Returns parent to link for the joint value q, added to theta (revolute) or d (prismatic)."""
    theta = dh.theta + (q if joint == "revolute" else 0.0)
    d = dh.d + (q if joint == "prismatic" else 0.0)
    first = transform(rotation_z(dh.gamma), (0, 0, dh.b))
    return first @ transform(rotation_x(dh.alpha)) @ transform(None, (dh.a, 0, 0)) @ transform(rotation_z(theta), (0, 0, d))


def start_poses(links: Sequence[DraftLink]) -> dict[str, np.ndarray]:
    """Returns the poses of all links in the ground frame in the initial configuration."""
    poses = {GROUND: np.eye(4)}
    for link in links:
        several = isinstance(link.q, list)
        poses[link.name] = poses[link.parent] @ pose_of(link.dh, link.joint, 0.0 if several else link.q)
        # of joints with several DOF those with a quaternion; others start at 0
        if several and (link.joint, len(link.q)) in (("free", 7), ("spherical", 4)):
            poses[link.name] = poses[link.name] @ transform(of_quaternion(link.q[-4:]), link.q[:-4] or (0, 0, 0))
    return poses


def position_and_angles(own: np.ndarray) -> tuple[list[float], list[float]]:
    """Returns position (m) and roll, pitch, yaw (rad) of a frame, rounded to 13 decimals, of a position below 1 m to 13 digits."""
    r = own[:3, :3]
    cosine = math.hypot(r[0, 0], r[1, 0])
    pitch = math.atan2(-r[2, 0], cosine)
    yaw = math.atan2(r[1, 0], r[0, 0]) if cosine > 1e-14 else math.atan2(-r[0, 1], r[1, 1])
    # roll is computed after removing yaw, whose rounding error is large near a pitch of 90 degrees
    c, s = math.cos(yaw), math.sin(yaw)
    roll = math.atan2(s * r[0, 2] - c * r[1, 2], c * r[1, 1] - s * r[0, 1])
    largest = float(np.abs(own[:3, 3]).max())
    digits = 13 - math.floor(math.log10(largest)) if 0 < largest < 1 else 13
    return [round(float(x), digits) for x in own[:3, 3]], [round(x, 13) for x in (roll, pitch, yaw)]


def of_quaternion(q: Sequence[float]) -> np.ndarray:
    """Returns the rotation of w, x, y, z of any length."""
    w, x, y, z = np.array(q) / np.linalg.norm(q)
    return np.array(
        [
            [1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)],
            [2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)],
            [2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)],
        ]
    )


def matrix_of(inertia: Sequence[float]) -> np.ndarray:
    """Returns the 3x3 tensor of [Ixx, Iyy, Izz, Ixy, Ixz, Iyz]."""
    xx, yy, zz, xy, xz, yz = inertia
    return np.array([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]], float)


def six_of(tensor: np.ndarray) -> list[float]:
    """Returns [Ixx, Iyy, Izz, Ixy, Ixz, Iyz] of a tensor; rounding errors of the rotation become zeros."""
    noise = 4e-16 * float(np.abs(tensor).max(initial=0.0))
    pairs = ((0, 0), (1, 1), (2, 2), (0, 1), (0, 2), (1, 2))
    means = [float(tensor[i, j] + tensor[j, i]) / 2 for i, j in pairs]
    return [0.0 if abs(x) <= noise else x for x in means]


def _cos_sin(angle: float) -> tuple[float, float]:
    """Returns cosine and sine, exact for multiples of 90 degrees."""
    turns = angle / (math.pi / 2)
    nearest = round(turns)
    if abs(turns) < 1e6 and abs(angle - nearest * (math.pi / 2)) <= 1e-15 * max(1.0, abs(angle)):
        return ((1.0, 0.0), (0.0, 1.0), (-1.0, 0.0), (0.0, -1.0))[nearest % 4]
    return math.cos(angle), math.sin(angle)
