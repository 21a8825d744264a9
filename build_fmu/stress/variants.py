"""Changes of a model for extreme cases; each function modifies the parsed file in place."""

from __future__ import annotations

import math
from collections.abc import Iterator
from typing import Any

Model = dict[str, Any]
# sizes of q and qd; other joints have one value
SIZES = {"universal": (2, 2), "cylindrical": (2, 2), "planar": (3, 3), "spherical": (3, 3), "free": (6, 6)}
MOVED = ("motion", "locked")


def plain(model: Model) -> None:
    """Adds the outputs that the pages need, and removes target and reference."""
    fmu = model.setdefault("fmu", {})
    fmu["outputs"] = sorted({*fmu.get("outputs", ["acceleration"]), "energy", "solver"})
    model.pop("report", None)
    solver = model.setdefault("solver", {})
    solver.pop("target_error", None)


def moving(model: Model) -> Iterator[dict[str, Any]]:
    """Yields the links whose joints are integrated."""
    for link in model.get("link", []):
        if link.get("joint", "revolute") != "fixed" and link.get("drive", "torque") not in MOVED:
            yield link


def parents(model: Model) -> list[str]:
    """Returns the name of each link's parent."""
    links = model.get("link", [])
    return [link.get("parent", links[i - 1]["name"] if i else "ground") for i, link in enumerate(links)]


def outboard_masses(model: Model) -> dict[str, float]:
    """Returns, by link, the mass of the link and of all outboard links (kg)."""
    links, above = model.get("link", []), dict(zip((link["name"] for link in model.get("link", [])), parents(model), strict=True))
    total = dict.fromkeys(above, 0.0)
    for link in links:
        name, seen = link["name"], set()
        while name in above and name not in seen:
            seen.add(name)
            total[name] += float(link.get("mass", 0))
            name = above[name]
    return total


def scale(link: dict[str, Any], factor: float) -> None:
    """Multiplies mass and inertia."""
    if "mass" in link:
        link["mass"] = float(link["mass"]) * factor
    if "inertia" in link:
        link["inertia"] = [float(x) * factor for x in link["inertia"]]


def heavy_tips(model: Model, ratio: float) -> None:
    """Multiplies mass and inertia of end links by `ratio`."""
    carriers = set(parents(model))
    for link in model.get("link", []):
        if link["name"] not in carriers:
            scale(link, ratio)


def heavy_roots(model: Model, ratio: float) -> None:
    """Multiplies mass and inertia of links on the ground by `ratio`."""
    for link, parent in zip(model.get("link", []), parents(model), strict=True):
        if parent == "ground":
            scale(link, ratio)


def light_links(model: Model, factor: float) -> None:
    """Multiplies mass and inertia of every second link, or of the only one, by `factor`."""
    links = model.get("link", [])
    for link in links[1::2] or links:
        scale(link, factor)


def far_away(model: Model, distance: float) -> None:
    """Moves the whole mechanism by `distance` (m) along the ground's z axis."""
    for link, parent in zip(model.get("link", []), parents(model), strict=True):
        if parent == "ground":
            link["b"] = float(link.get("b", 0)) + distance
    for tie in [*model.get("loop", []), *model.get("spring", [])]:
        for side in ("a", "b"):
            if tie.get(f"link_{side}") == "ground":
                point = [float(x) for x in tie.get(f"point_{side}", [0, 0, 0])]
                tie[f"point_{side}"] = [point[0], point[1], point[2] + distance]


def fast(model: Model, link: dict[str, Any], speed: float) -> None:
    """Starts one joint at `speed` (rad/s or m/s)."""
    kind = link.get("joint", "revolute")
    if kind in SIZES:
        link["qd"] = [0.0] * (SIZES[kind][1] - 1) + [speed]
    else:
        link["qd"] = math.degrees(speed) if kind != "prismatic" and model.get("angle_unit") == "deg" else speed


def stiff_joints(model: Model, stiffness: float, damping: float) -> None:
    """Adds a spring to every joint that supports one, relaxed in the initial configuration."""
    for link in moving(model):
        kind = link.get("joint", "revolute")
        if kind in ("spherical", "free"):
            continue
        if kind in SIZES:
            count = SIZES[kind][0]
            link |= {"stiffness": [stiffness] * count, "damping": [damping] * count, "rest": link.get("q", [0.0] * count)}
        else:
            link |= {"stiffness": stiffness, "damping": damping, "rest": link.get("q", 0.0)}


def start_at(model: Model, angle: float) -> None:
    """Starts all joints at `angle` (rad), prismatic joints at 0."""
    for link in moving(model):
        kind = link.get("joint", "revolute")
        if kind in SIZES:
            link["q"] = [0.0] * SIZES[kind][0]
        elif kind == "prismatic":
            link["q"] = 0.0
        else:
            link["q"] = math.degrees(angle) if model.get("angle_unit") == "deg" else angle
