"""Chooses link frames that modified DH parameters can describe: z on the joint axis, x on the common normal.

Each rigid transform is Rz(gamma) Tz(b) Rx(alpha) Tx(a) Rz(theta) Tz(d). A link's frame is chosen for its main child, which
then needs no gamma and b; the other children need them. Only rounding errors are rounded.
"""

from __future__ import annotations

import math

import numpy as np

from build_fmu.importers.draft import DhFrame
from build_fmu.importers.rigid import inverse, pose_of, rotation_x, rotation_z, transform

PARALLEL = 1e-12  # sine of the angle below which two axes count as parallel
NEARLY = 1e-4  # below which the common normal is too far away to be used
LAST_DIGITS = 4e-15


def settle(pose: np.ndarray) -> DhFrame:
    """Returns the DH parameters of a frame: of the two solutions the one with the smaller |gamma|."""
    rotation, p = pose[:3, :3], pose[:3, 3]
    zx, zy, zz = rotation[:, 2]
    sine = math.hypot(zx, zy)
    tiny = 1e-15 * max(1.0, float(np.abs(p).max()))
    if sine < PARALLEL:
        alpha, b = (0.0 if zz > 0 else math.pi), 0.0
        gamma, a = _polar(p[0], p[1], tiny)
        d = float(p[2]) if zz > 0 else -float(p[2])
    else:
        gamma, alpha = _snap(math.atan2(zx, -zy)), _snap(math.atan2(sine, zz))
        if abs(gamma) > math.pi / 2 + 1e-9:
            gamma, alpha = gamma - math.copysign(math.pi, gamma), -alpha
        turned = rotation_z(-gamma) @ p
        a = float(turned[0])
        # an axis that meets the parent's z needs no offset along itself
        d = -float(turned[1]) / math.sin(alpha) if abs(turned[1]) > tiny else 0.0
        b = float(turned[2] - d * rotation_x(alpha)[2, 2])
    rest = rotation_x(-alpha) @ rotation_z(-gamma) @ rotation
    theta = _snap(math.atan2(rest[1, 0], rest[0, 0]))
    noise = 1e-15 * max(1.0, abs(b), abs(d), float(np.abs(p).max()))
    a, b, d = (0.0 if abs(x) <= noise else x for x in (a, b, d))
    return DhFrame(_snap(gamma), b, _snap(alpha), a, theta, d)


def far(dh: DhFrame, size: float) -> bool:
    """Returns whether nearly parallel axes place the frame far outside a mechanism whose longest offset is `size` (m).

    The relative error of the dynamics grows with the square of the distance between a frame and its body.
    """
    return max(abs(dh.b), abs(dh.d)) > 10 * size


def joint_frame(frame: np.ndarray, axis: np.ndarray, child: tuple[np.ndarray, np.ndarray] | None) -> np.ndarray:
    """Returns a frame on a joint axis. All arguments are in the same coordinates.

    `frame`: the link's frame in the source; its x axis and origin are kept if the axes do not define them. `axis`: unit
    vector. `child`: point and unit vector of the main child's axis.
    """
    origin = frame[:3, 3]
    x = _hint(frame, axis)
    if child is not None:
        point, direction = child
        normal = np.cross(axis, direction)
        sine = float(np.linalg.norm(normal))
        between = point - origin
        if sine > NEARLY:
            x = _towards(normal / sine, x)
            # the foot of the common normal on our axis
            along = float(np.cross(between, direction) @ normal) / sine**2
            origin = origin + (0.0 if abs(along) < 1e-15 * max(1.0, float(np.abs(between).max())) else along) * axis
        elif sine < PARALLEL:
            across = between - (between @ axis) * axis
            length = float(np.linalg.norm(across))
            if length > 1e-9:
                x = _towards(across / length, x)
    return transform(np.column_stack([x, np.cross(axis, x), axis]), origin)


def place(frame: np.ndarray, parent_to: np.ndarray) -> tuple[DhFrame, np.ndarray]:
    """Returns the DH parameters of `frame`, and the source's frame `parent_to` relative to the frame of these parameters."""
    dh = settle(frame)
    return dh, inverse(pose_of(dh)) @ parent_to


def side_frame(origin: np.ndarray) -> np.ndarray:
    """Returns a frame at `origin` whose z axis is perpendicular to the parent's, as an intermediate frame for a nearly parallel axis."""
    return transform(rotation_x(math.pi / 2), origin)


def _polar(x: float, y: float, tiny: float) -> tuple[float, float]:
    if math.hypot(x, y) <= tiny:
        return 0.0, 0.0
    if abs(y) <= tiny:
        return 0.0, float(x)
    angle = math.atan2(y, x)
    return (angle, math.hypot(x, y)) if abs(angle) <= math.pi / 2 else (angle - math.copysign(math.pi, angle), -math.hypot(x, y))


def _hint(frame: np.ndarray, axis: np.ndarray) -> np.ndarray:
    """Returns the first axis of the source's frame that is not along the joint axis, made perpendicular to it."""
    for k in (0, 1):
        across = frame[:3, k] - (frame[:3, k] @ axis) * axis
        length = float(np.linalg.norm(across))
        if length > 0.5:
            return across / length
    raise AssertionError("two perpendicular axes cannot both be along a third")


def _towards(direction: np.ndarray, hint: np.ndarray) -> np.ndarray:
    return -direction if direction @ hint < -1e-9 else direction


def _snap(angle: float) -> float:
    """Restores the last digits of multiples of 90 degrees, which products of rotations lose."""
    nearest = round(angle / (math.pi / 2)) * (math.pi / 2)
    return nearest if abs(angle - nearest) < LAST_DIGITS else angle
