"""Parts of a source that cannot be simulated: impossible inertias, joints that move no mass, massless links between several axes."""

from __future__ import annotations

import numpy as np

from build_fmu.errors import listed
from build_fmu.importers.carried import carried
from build_fmu.importers.draft import GROUND, Draft, DraftLink
from build_fmu.importers.rigid import matrix_of

NEGATIVE = 1e-12  # of the largest principal moment: a smaller negative one is a rounding error
AXES = 3  # revolute axes that can become linearly dependent


def possible(inertia: np.ndarray) -> np.ndarray:
    """Returns the inertia or, if a principal moment is negative, that of the nearest mass distribution."""
    moments, axes = np.linalg.eigh(inertia)
    if moments[0] >= -NEGATIVE * np.abs(moments).max():
        return inertia
    # second moments of the mass along the principal axes, which are sums of squares
    second = np.maximum(moments.sum() / 2 - moments, 0)
    return axes @ np.diag(second.sum() - second) @ axes.T


def lock_massless(draft: Draft) -> None:
    """Locks the joints that move no mass, if other joints do: no torque law can give them a motion."""
    moved = carried(draft.links)
    driven = {tie.fields["joint"] for tie in draft.actuators if "rotor_inertia" in tie.fields}
    single = [link for link in draft.links if link.joint in ("revolute", "prismatic") and link.joint_name not in driven]
    idle = {link.joint_name: link for link in single if moved[link.name].inertia <= 0 and link.drive != "locked"}
    if not any(link.mass or any(link.inertia) for link in draft.links):
        return
    for link in idle.values():
        link.drive = "locked"
    draft.actuators = [tie for tie in draft.actuators if tie.fields["joint"] not in idle]
    cut = [tie.name for tie in draft.couplings if any(name in idle for name in tie.fields["joints"])]
    draft.couplings = [tie for tie in draft.couplings if tie.name not in cut]
    if idle:
        draft.doubts.append(
            f"{listed(list(idle))} move no mass and are locked: --density or --mass gives their links masses from their shapes"
            + (f"; their couplings {listed(cut)} are omitted" if cut else "")
        )


def warn_of_singularity(draft: Draft) -> None:
    """Reports chains of massless links with so many axes that the mass matrix can become singular."""
    rigid, heavy, known = {GROUND: GROUND}, set(), {link.name: link for link in draft.links}
    for link in draft.links:
        rigid[link.name] = rigid[link.parent] if link.joint == "fixed" else link.name
        if link.mass or np.any(matrix_of(link.inertia)) or link.armature:
            heavy.add(rigid[link.name])
    light = {name for name in rigid.values() if name not in heavy and name != GROUND}
    found = []
    for link in draft.links:
        chain = _massless_carriers(link, light, rigid, known) if link.joint != "fixed" and link.name not in light else []
        axes = [known[name].joint_name for name in (*chain, link.name) if known[name].joint == "revolute"]
        if len(axes) >= AXES:
            found.append(f"{', '.join(chain)} (axes {', '.join(axes)})")
    if found:
        draft.doubts.append(
            f"neither mass nor inertia: {listed(found)}; in a pose where these axes become linearly dependent the mass matrix is "
            "singular, and a simulation stops there; give these links mass or inertia"
        )


def _massless_carriers(link: DraftLink, light: set[str], rigid: dict[str, str], known: dict[str, DraftLink]) -> list[str]:
    """Returns the massless moving links between a link and the next one with mass, outermost last."""
    chain, at = [], rigid[link.parent]
    while at in light:
        chain.insert(0, at)
        at = rigid[known[at].parent]
    return chain
