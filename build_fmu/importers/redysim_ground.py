"""The ground of ReDySim's legged robots: g_prop becomes contacts of the feet with a plane.

g_prop contains K, Cv, v_max, mu, Ch and the numbers of the vertical and the two horizontal axes. ReDySim tests two points of each link: the
tip, `alt` along its x axis, and the other end, `alt - al`.
"""

from __future__ import annotations

from build_fmu.importers.draft import Draft, DraftTie

FIELDS = ("K", "Cv", "v_max", "mu", "Ch")


def add_ground(draft: Draft, data) -> None:
    """Adds a contact at each foot, that is each link without children."""
    if "g_prop" not in data:
        return
    g_prop = [float(x) for x in data.flat("g_prop")]
    if len(g_prop) != 8:
        raise data.error("g_prop", f"must have 8 entries (K, Cv, v_max, mu, Ch and three axes), got {len(g_prop)}")
    for name, value in zip(FIELDS, g_prop, strict=False):
        if not (value > 0 or (name == "mu" and value == 0)):
            raise data.error("g_prop", f"{name} must be > 0, got {value:g}")
    if sorted(g_prop[5:]) != [1, 2, 3]:
        raise data.error("g_prop", "entries 6 to 8 must be the axes 1, 2 and 3 in any order")
    normal = [float(axis == g_prop[5]) for axis in (1, 2, 3)]
    count = len(draft.links)
    tips, lengths = (data.column(name, count) for name in ("alt", "al"))
    parents = {link.parent for link in draft.links}
    feet = {link.name: _points(tips[i], lengths[i]) for i, link in enumerate(draft.links) if link.name not in parents and i > 0}
    for number, (foot, points) in enumerate(feet.items(), start=1):
        contact = {"link_a": foot, "shape_a": "points", "points_a": points, "normal_b": normal}
        draft.contacts.append(DraftTie(f"foot{number}", contact | {"law": "redysim"} | dict(zip(FIELDS, g_prop, strict=False))))
    if not feet:
        draft.lost.append("the ground (g_prop): the robot has no links besides its base")
        return
    shown = "; ".join(f"{foot} at x = {', '.join(f'{x:g}' for x, _, _ in points)} m" for foot, points in feet.items())
    draft.doubts.append(
        f"only feet, the links without children, touch the ground (g_prop): {shown}; ReDySim also tests the ends of the other links"
    )


def _points(tip: float, length: float) -> list[list[float]]:
    """Returns the end of a foot, or both ends and the ankle between them: there the tip of the shank touches, too."""
    other = tip - length
    # at its own origin a link only repeats the tip of its parent
    places = [tip] if abs(other) <= 1e-9 * abs(length) else [tip, 0.0, other]
    return [[x, 0.0, 0.0] for x in places]
