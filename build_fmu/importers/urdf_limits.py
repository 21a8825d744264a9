"""Start positions inside the limits of URDF joints, and stops at these limits."""

from __future__ import annotations

import math
from collections.abc import Container

from build_fmu.errors import listed
from build_fmu.importers.carried import carried
from build_fmu.importers.draft import Draft
from build_fmu.importers.standing import feet_below

INSIDE = 0.05  # of the range: distance of a chosen start position from the limit
FREQUENCY = 20.0  # Hz, of what a joint moves against its stop
DAMPING = {"revolute": 1.0, "prismatic": 2.0}  # s/rad, s/m: about half of the impact speed remains at 1 rad/s or 1 m/s


def lock_narrow(limited: list, asked: Container[str], following: Container[str], draft: Draft) -> list:
    """Locks the joints whose limits have zero width at these, or at the positions of `asked`, the joints of --pose; reports them.

    Returns the joints with limits, without those of `following`, the mimic joints, that have no width: these move with their leaders.
    """
    narrow = [body for body in limited if body.limits[0] == body.limits[1]]
    locked, omitted = ([body for body in narrow if (body.joint in following) == follows] for follows in (False, True))
    for body in locked:
        body.q, body.drive = body.q if body.joint in asked else body.limits[0], "locked"
    if locked:
        draft.doubts.append(
            f"limits of zero width lock the joints: {listed([f'{body.joint} = {body.q:g}' for body in locked])}; "
            'without drive = "locked" in the model file they move without limits'
        )
    if omitted:
        draft.lost.append(f"the limits of {listed([body.joint for body in omitted])}: zero width, but the joints follow a <mimic>")
    return [body for body in limited if body not in omitted]


def start_inside(limited: list, asked: Container[str], draft: Draft, legs: tuple[dict, dict] | None = None) -> None:
    """Moves the start positions of limited joints into their limits, except those of `asked`, the joints of --pose; reports them.

    With `legs`, all bodies of a robot that stands and the positions of their shapes, hips keep the feet below them.
    """
    moved = []
    for body in limited:
        low, high = body.limits
        if body.joint in asked or low <= body.q <= high:
            continue
        margin = INSIDE * (high - low)
        wanted = low + margin if body.q < low else high - margin
        rounded = float(f"{wanted:.3g}")
        body.q = rounded if low <= rounded <= high else wanted
        moved.append(body)
    if moved:
        chosen = listed([f"{body.joint} = {body.q:g}" for body in moved])
        hips = feet_below(moved, *legs, asked) if legs else []
        below = f"; the feet stay below: {listed([f'{body.joint} = {body.q:g}' for body in hips])}" if hips else ""
        draft.doubts.append(f"start positions inside the limits are chosen: {chosen}{below}; --pose JOINT=VALUE sets others")


def report_outside(limited: list, draft: Draft) -> None:
    """Reports start positions outside the limits: those of --pose and of mimic joints."""
    outside = [f"{b.joint} ({b.limits[0]:g} to {b.limits[1]:g})" for b in limited if not b.limits[0] <= b.q <= b.limits[1]]
    if outside:
        draft.doubts.append(f"the start position is outside the limits of {listed(outside)}: set it with --pose JOINT=VALUE")


def add_stops(limited: list, layout, stops: float | str | None) -> None:
    """Adds stops at the limits, of stiffness `stops` or, without one, by the masses; lists the limits if `stops` is "none"."""
    draft, links = layout.draft, {link.name: link for link in layout.draft.links}
    limited = [body for body in limited if links[layout.called[body.name]].drive != "locked"]
    if stops == "none" and limited:
        draft.lost.append(f"the limits of {listed([body.joint for body in limited])}: omitted with --stops none")
    if stops == "none":
        return
    moved = {} if stops or not limited else carried(draft.links)
    chosen, idle = [], []
    for body in limited:
        link = links[layout.called[body.name]]
        inertia = moved[link.name].inertia if moved else 0.0
        if not stops and inertia <= 0:
            idle.append(body.joint)
            continue
        link.lower, link.upper = body.limits
        link.stop_stiffness = stops or float(f"{inertia * (2 * math.pi * FREQUENCY) ** 2:.2g}")
        link.stop_damping = 0.0 if stops else DAMPING[link.joint]
        chosen.append(body.joint)
    if chosen and not stops:
        draft.doubts.append(
            f"stops at the limits of {listed(chosen)}: the stiffness gives a natural frequency of {FREQUENCY:g} Hz with the inertia that "
            f"the joint moves in the start pose, damping {DAMPING['revolute']:g} s/rad or {DAMPING['prismatic']:g} s/m; "
            "--stops STIFFNESS sets one stiffness, --stops none omits stops"
        )
    if idle:
        draft.lost.append(f"the limits of {listed(idle)}: these joints move no mass; --stops STIFFNESS converts them to stops")
