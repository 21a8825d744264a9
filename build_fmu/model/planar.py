"""The plane of motion, the free joints and the numbers of joints, loops and couplings, from the drawing table of a mechanism."""

from __future__ import annotations

from typing import Any


def planar_axes(links: list[dict[str, Any]]) -> tuple[int, int] | None:
    """Returns the two ground axes (0, 1, 2) that span the plane of motion, or None for a spatial mechanism."""
    moving = [link for link in links if link["type"] != "fixed"]
    for normal, plane in ((2, (0, 1)), (1, (0, 2)), (0, (1, 2))):
        if moving and all(_keeps_plane(link, abs(link["rotation"][normal][2])) for link in moving):
            return plane
    return None


def _keeps_plane(link: dict[str, Any], along: float) -> bool:
    """Returns whether a joint rotates about the normal or slides perpendicular to it; `along`: cosine between axis and normal."""
    turns, slides = bool(link["turn"]), bool(link["slide"])
    return (turns or slides) and (not turns or along > 1 - 1e-9) and (not slides or along < 1e-9)


def free_joints(links: list[dict[str, Any]]) -> tuple[set[int], set[int]]:
    """Returns the links of free joints, and those of their translations."""
    places = {link["name"]: i for i, link in enumerate(links) if link["slide"]}
    chains = {i: {places.get(f"{link['name']}[{k}]", -1) for k in (1, 2, 3)} for i, link in enumerate(links) if link["type"] == "spherical"}
    chains = {i: chain for i, chain in chains.items() if -1 not in chain}
    return set(chains), set().union(*chains.values())


def joint_counts(drawing: dict[str, Any]) -> list[str]:
    """Returns the number of joints by type, such as "6 revolute", fixed joints last, then of loops and couplings."""
    free, translations = free_joints(drawing["links"])
    kinds = ["free" if i in free else link["type"] for i, link in enumerate(drawing["links"]) if i not in translations]
    order = dict.fromkeys(["revolute", "prismatic", *(kind for kind in kinds if kind != "fixed"), "fixed"])
    ties = [(len(drawing.get(f"{what}s", [])), what) for what in ("loop", "coupling")]
    return [f"{kinds.count(kind)} {kind}" for kind in order if kind in kinds] + [f"{n} {what}{'s' * (n > 1)}" for n, what in ties if n]
