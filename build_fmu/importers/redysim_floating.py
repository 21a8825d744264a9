"""The floating base of ReDySim's space and legged robots: link 1 with six coordinates.

Coordinates are x, y, z and the angles of Rz(phi) Rx(theta) Ry(psi). y0 contains those of the base and the joints, then their rates.
"""

from __future__ import annotations

import math

import numpy as np

from build_fmu.errors import UserError
from build_fmu.importers.draft import Draft, DraftLink

BASE = 6  # coordinates of the base in y0, also for planar motion


def is_floating(data) -> bool:
    """Returns whether the base floats: only such robots define nq (0: planar motion) or g_prop (ground)."""
    return "nq" in data or "g_prop" in data


def joint_column(data, name: str, count: int, default: float | None = None) -> list[float]:
    """Returns a column of joint values; the entry for the base, missing in some files, is 0."""
    if name in data and data.length(name) == count - 1:
        return [0.0, *data.column(name, count - 1)]
    return data.column(name, count, default)


def start(data, starts, count: int, call, draft: Draft) -> tuple[list[float], list[float], list[float], list[float]] | None:
    """Returns base coordinates, base rates, joint positions and joint rates (with 0 for the base) of y0, or None."""
    for reading in (starts, data):
        if "y0" not in reading:
            continue
        y0 = [float(x) for x in reading.flat("y0")]
        half = BASE + count - 1
        # followed by the actuator energy and, for legged robots, the states of ground and controller
        more = 2 if "g_prop" in data else 1
        if len(y0) in range(2 * BASE, min(2 * BASE + more + 1, 2 * half)):
            # inverse dynamics integrates only the base
            return y0[:BASE], y0[BASE : 2 * BASE], *_joints_of_the_trajectory(starts, count, call, draft)
        if len(y0) < 2 * half or ("g_prop" not in data and len(y0) > 2 * half + 1):
            raise reading.error(
                "y0", f"must have 2 (n + 5) + 1 = {2 * half + 1} entries (base, joints, their rates, actuator energy), got {len(y0)}"
            )
        q, qd = y0[:half], y0[half : 2 * half]
        return q[:BASE], qd[:BASE], [0.0, *q[BASE:]], [0.0, *qd[BASE:]]
    return None


def _joints_of_the_trajectory(starts, count: int, call, draft: Draft) -> tuple[list[float], list[float]]:
    """Returns joint positions and rates at the start of trajectory(t, n, tf); zeros if it cannot be evaluated."""
    reason = "trajectory.m is missing"
    try:
        end = starts.number("tf", 1.0)
        values = call("trajectory", [np.array([[x]]) for x in (0.0, float(count), end)])
        found = [values.arrays[name].ravel(order="F").tolist() for name in values.outputs[:2]] if values else []
        if len(found) == 2 and all(len(column) in (count - 1, count) for column in found):
            draft.doubts.append("y0 contains only the base (inverse dynamics): the joints start at the initial values of trajectory.m")
            return tuple([0.0, *(column if len(column) == count - 1 else column[1:])] for column in found)
        reason = f"trajectory.m does not return {count - 1} joint positions and rates" if values else reason
    except (UserError, KeyError) as error:
        reason = call.short(str(error)) if isinstance(error, UserError) else f"trajectory.m does not assign {error}"
    draft.doubts.append(f"y0 contains only the base (inverse dynamics) and the joints start at 0: {reason}")
    return [0.0] * count, [0.0] * count


def set_free(base: DraftLink, data, place: list[float], rates: list[float], draft: Draft) -> None:
    """Sets joint and start values of the base."""
    base.drive, base.joint_name = "free", "base"
    planar = "nq" in data and data.whole("nq", 0) == 0
    if planar:
        base.joint = "planar"
        left = [f"{x:g}" for x in (place[2], *place[4:], rates[2], *rates[4:]) if x]
        if left:
            draft.lost.append(f"start values of the base out of its plane ({', '.join(left)}): nq = 0 means planar motion in x and y")
        base.q, base.qd = [*place[:2], place[3]], [*rates[:2], rates[3]]
    else:
        base.joint = "free"
        base.q, base.qd = list(place), [*rates[:3], *_omega(place[3:], rates[3:])]
    draft.notes.append('The base has no actuators; with drive = "torque" its forces and torques are inputs.')


def _omega(angles: list[float], rates: list[float]) -> list[float]:
    """Returns the angular velocity in the base's axes from the rates of phi, theta, psi."""
    (_, theta, psi), (d_phi, d_theta, d_psi) = angles, rates
    return [
        -math.sin(psi) * math.cos(theta) * d_phi + math.cos(psi) * d_theta,
        math.sin(theta) * d_phi + d_psi,
        math.cos(psi) * math.cos(theta) * d_phi + math.sin(psi) * d_theta,
    ]
