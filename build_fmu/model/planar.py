"""Whether a mechanism moves in a plane, from its drawing table."""

from __future__ import annotations

from typing import Any


def planar_axes(links: list[dict[str, Any]]) -> tuple[int, int] | None:
    """Returns the two ground axes (0, 1, 2) that span the plane of motion, or None for a spatial mechanism."""
    moving = [link for link in links if link["type"] != "fixed"]
    for normal, plane in ((2, (0, 1)), (1, (0, 2)), (0, (1, 2))):
        along = [(link["type"], abs(link["rotation"][normal][2])) for link in moving]
        if along and all(z > 1 - 1e-9 if kind == "revolute" else kind == "prismatic" and z < 1e-9 for kind, z in along):
            return plane
    return None
