"""Changes of a model for extreme cases; each function modifies the parsed file in place."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
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
    for tie in [*model.get("loop", []), *model.get("spring", []), *model.get("bushing", [])]:
        for side in ("a", "b"):
            if tie.get(f"link_{side}") == "ground":
                tie[f"point_{side}"] = _moved(tie.get(f"point_{side}", [0, 0, 0]), [0, 0, distance])
    _move_surfaces(model, [0, 0, distance])


def _moved(point: Sequence[float], by: Sequence[float]) -> list[float]:
    return [float(x) + d for x, d in zip(point, by, strict=True)]


def _move_surfaces(model: Model, by: Sequence[float]) -> None:
    """Moves the shapes of all contacts that are fixed to the ground."""
    for contact in model.get("contact", []):
        for side, link in (("a", contact.get("link_a")), ("b", contact.get("link_b", "ground"))):
            if link == "ground":
                if f"points_{side}" in contact:
                    contact[f"points_{side}"] = [_moved(point, by) for point in contact[f"points_{side}"]]
                    continue
                contact[f"point_{side}"] = _moved(contact.get(f"point_{side}", [0, 0, 0]), by)
                if f"point_{side}2" in contact:
                    contact[f"point_{side}2"] = _moved(contact[f"point_{side}2"], by)


def drop(model: Model, height: float) -> None:
    """Lowers the ground of all contacts by `height` (m) along gravity."""
    gravity = [float(x) for x in model.get("gravity", [0, 0, -9.81])]
    size = math.hypot(*gravity)
    if size > 0:
        _move_surfaces(model, [height * g / size for g in gravity])


def contact_stiffness(model: Model, stiffness: float) -> None:
    """Sets the stiffness of every contact (N/m)."""
    for contact in model["contact"]:
        contact["K" if contact.get("law") == "redysim" else "stiffness"] = stiffness


def contact_friction(model: Model, friction: float) -> None:
    """Sets the coefficients of friction of every contact."""
    for contact in model["contact"]:
        contact.pop("static_friction", None)
        contact["mu" if contact.get("law") == "redysim" else "friction"] = friction


def come_to_rest(model: Model) -> None:
    """Adds losses to every contact and holds driven joints in their start pose, so that bodies on the ground come to rest."""
    model.pop("trajectory", None)
    for link in model.get("link", []):
        link.pop("qd", None)
        if link.get("drive") == "motion":
            link["drive"] = "locked"
    for contact in model["contact"]:
        if contact.get("law") != "redysim":
            contact["damping"] = max(10.0, float(contact.get("damping", 0)))
            contact["rolling"] = max(0.01, float(contact.get("rolling", 0)))


def split_contacts(model: Model, least: int) -> None:
    """Replaces each contact by equal ones that share its force, `least` in total: the motion remains the same."""
    contacts = model["contact"]
    share = math.ceil(least / len(contacts))
    for contact in list(contacts):
        for name in ("stiffness", "K", "Cv", "Ch"):
            if name in contact:
                contact[name] = float(contact[name]) / share
        for k in range(1, share):
            contacts.append({**contact, "name": f"{contact['name']}_{k}", "outputs": []})


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
