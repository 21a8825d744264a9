"""Converts <collision> shapes of a URDF to contacts with the ground plane z = 0 and places a floating base on it."""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Iterable
from dataclasses import dataclass, field

import numpy as np
from lxml import etree

from build_fmu.draw.meshes import mesh_parts
from build_fmu.errors import UserError, listed
from build_fmu.importers.draft import GROUND, Draft, DraftTie
from build_fmu.importers.masses import fixed_to_ground
from build_fmu.importers.rigid import pose_of, position_and_angles, start_poses, transform
from build_fmu.importers.solids import scaled
from build_fmu.importers.urdf_file import Urdf
from build_fmu.importers.urdf_visuals import SIZES, fields_of

STATIC_DEPTH = 1e-3  # m, of the points that carry the weight
WIDTH = 1e-4  # m, the default of the model file
EARTH = 9.81  # m/s2, for models without gravity
LAW = {"damping": 2.0, "friction": 0.8, "friction_velocity": 1e-3}  # s/m, -, m/s
UPRIGHT = 5.0  # moment of tilted feet over the overturning moment of the weight, at least
NARROW = 5e-3  # m: root mean square of the distances of contact points from a line
TILT = 0.02  # rad, by which a robot must be able to lean: as much as joints sag (holding.py)
FEET = 0.02  # shapes within this fraction of the height of all shapes are feet
RIM_POINTS = 8  # on each rim of a cylinder that stands upright
# of a mesh with more corners the extreme points in these directions touch: down, and 8 each at these angles from it
DIRECTIONS = np.array(
    [(0, 0, -1)]
    + [
        (math.sin(slope) * math.cos(turn), math.sin(slope) * math.sin(turn), -math.cos(slope))
        for slope in np.radians([15, 45, 90, 135])
        for turn in np.radians(range(0, 360, 45))
    ]
)
# 2000 directions, evenly over the sphere: the extreme points in these are the corners of a convex hull
HEIGHTS, TURNS = (2 * np.arange(2000) + 1) / 2000 - 1, np.arange(2000) * math.pi * (3 - math.sqrt(5))
SPHERE = np.column_stack([np.sqrt(1 - HEIGHTS**2) * np.cos(TURNS), np.sqrt(1 - HEIGHTS**2) * np.sin(TURNS), HEIGHTS])


@dataclass
class Solid:
    """A <collision> shape. `pose`: its frame relative to the link of the model; `size`: edges, or radius and length (m), or scale."""

    kind: str
    link: str
    pose: np.ndarray
    size: list[float]
    file: str = ""  # of a mesh
    points: list[list[float]] = field(default_factory=list)  # of a mesh, in the frame of the link
    beyond: float = 0.0  # of a mesh: how far other corners of its convex hull lie outside of the points, m
    friction: float | None = None  # of the file; None: LAW


def add_urdf_contacts(urdf: Urdf, layout, feet_only: bool) -> None:
    """Fills the contacts of layout.draft by <collision> shapes."""
    omitted, links = Counter(), urdf.root.findall("link")
    tag = "collision" if any(link.find("collision") is not None for link in links) else "visual"
    solids = [solid for link in links for solid in _solids(urdf, link, tag, layout, omitted)]
    if not solids:
        found = "".join(f"; omitted: {count} {what}" for what, count in omitted.items())
        what = "<collision>" if tag == "collision" else "<collision> or <visual>"
        raise UserError(f"--contact: '{urdf.path}' has no {what} of {', '.join(SIZES)}, box, mesh{found}; write [[contact]] by hand")
    if tag == "visual":
        layout.draft.doubts.append("the file has no <collision>: the <visual> shapes touch the ground")
    add_contacts(solids, omitted, layout, feet_only)


def add_contacts(solids: list[Solid], omitted: Counter, layout, feet_only: bool) -> None:
    """Fills the contacts of layout.draft, lifts a floating base to the ground, and reports parameters and omitted shapes."""
    draft = layout.draft
    poses, still = start_poses(draft.links), fixed_to_ground(draft.links)
    omitted["shapes of links that are fixed to the ground"] += sum(solid.link in still for solid in solids)
    mobile = [solid for solid in solids if solid.link not in still]
    moving = _read_meshes(mobile, poses, omitted)
    places = [_lowest_points(solid, poses[solid.link]) for solid in moving]
    heights = [[place[2] for place in of_solid] for of_solid in places]
    lowest, highest = min(map(min, heights), default=0.0), max(map(max, heights), default=0.0)
    near = lowest + FEET * (highest - lowest) + 1e-9
    chosen = [solid for solid, at in zip(moving, heights, strict=True) if not feet_only or min(at) <= near]
    omitted["shapes above the feet; --contact all includes them"] += len(moving) - len(chosen)
    draft.lost += [f"contact of {count} {what}" for what, count in omitted.items() if count]
    if len({solid.link for solid in mobile}) > 1:
        draft.lost.append("contact between links of the robot")
    if not chosen:
        return
    # of a flat foot only its lowest points carry weight, and nothing of the ankle above it
    feet = [(solid, of_solid) for solid, of_solid, at in zip(moving, places, heights, strict=True) if min(at) <= near]
    carrying = [place for solid, of_solid in feet if not _above(solid, of_solid, feet, draft) for place in _lowest(of_solid)]
    points = len(carrying)
    mass = sum(link.mass for link in draft.links if link.name not in still)
    enough = max(_gravity(draft) * mass, 1e-3) / (points * (STATIC_DEPTH - WIDTH / 2))
    upright = _against_tilting(draft, poses, carrying)
    stiffness = float(f"{max(enough, upright):.2g}")
    for solid in chosen:
        for shape in _shapes(solid, poses[solid.link]):
            law = LAW if solid.friction is None else LAW | {"friction": solid.friction}
            if law["friction"] == 0:
                law = {"damping": law["damping"], "friction": 0}
            fields = {"link_a": solid.link, **shape, "stiffness": stiffness, **law, "outputs": ["force", "depth", "point"]}
            draft.contacts.append(DraftTie(layout.names.take(f"{solid.link}_contact"), fields))
    shared = f"{mass:.4g} kg on {points} point{'s' if points > 1 else ''}{'' if any(draft.gravity) else f', at {EARTH:g} m/s2'}"
    why = f"{UPRIGHT:g} times what keeps the robot upright" if upright > enough else f"depth {1000 * STATIC_DEPTH:g} mm"
    _report(draft, chosen, poses, f"stiffness {stiffness:g} N/m ({shared}: {why})")
    unread = [solid.link for solid in mobile if solid.kind == "mesh" and not solid.points]
    if feet_only and unread:
        meshes, links = f"{len(unread)} mesh{'es' if len(unread) > 1 else ''}", listed(list(dict.fromkeys(unread)))
        draft.doubts.append(f"{meshes} of {links} cannot be read, but may be feet: check the contacts, or add [[contact]] by hand")
    _falls_over(draft, poses, [place for _, of_solid in feet for place in _lowest(of_solid)])
    _lift(draft, poses, lowest)


def _gravity(draft: Draft) -> float:
    return math.hypot(*draft.gravity) or EARTH


def _lowest(places: list[list[float]]) -> list[list[float]]:
    """Returns the points that carry weight: of a flat foot only the lowest ones."""
    low = min(place[2] for place in places)
    return [place for place in places if place[2] <= low + STATIC_DEPTH]


def _above(solid: Solid, places: list[list[float]], feet: list[tuple[Solid, list[list[float]]]], draft: Draft) -> bool:
    """Returns whether a shape of the same link, or of one that this link carries, is lower: an ankle above its foot."""
    parents, low = {link.name: link.parent for link in draft.links}, min(place[2] for place in places)
    for other, others in feet:
        name = other.link if min(place[2] for place in others) < low - STATIC_DEPTH else GROUND
        while name not in (GROUND, solid.link):
            name = parents[name]
        if name == solid.link:
            return True
    return False


def _center(draft: Draft, poses: dict[str, np.ndarray]) -> tuple[float, np.ndarray]:
    """Returns mass and center of mass of a robot with a floating base; otherwise a mass of 0."""
    mass = sum(link.mass for link in draft.links)
    if not mass or not any(link.joint == "free" and link.parent == GROUND for link in draft.links):
        return 0.0, np.zeros(3)
    return mass, sum(link.mass * (poses[link.name] @ [*link.com, 1])[:3] for link in draft.links) / mass


def _against_tilting(draft: Draft, poses: dict[str, np.ndarray], points: list[list[float]]) -> float:
    """Returns the stiffness of each point with which the feet resist tilting UPRIGHT times as much as the weight overturns, N/m.

    The robot is rigid. For points in one line, or almost, no stiffness is enough, and 0 is returned.
    """
    mass, center = _center(draft, poses)
    feet = np.array(points)
    spread = (feet - feet.mean(axis=0))[:, :2]
    least = float(np.linalg.eigvalsh(spread.T @ spread)[0])
    if least < len(feet) * NARROW**2:
        return 0.0
    return UPRIGHT * _gravity(draft) * mass * max(0.0, center[2] - feet[:, 2].min()) / least


def _solids(urdf: Urdf, link: etree._Element, tag: str, layout, omitted: Counter) -> list[Solid]:
    """Returns the supported shapes of a <link>; counts the others."""
    solids, name = [], link.attrib["name"]
    for element in link.findall(tag):
        pose = layout.own[name] @ urdf.pose(element)
        for shape in element.iterfind("geometry/*"):
            fields = fields_of(urdf, shape, omitted)
            if fields:
                file = str(fields.get("file") or shape.get("filename", ""))
                solids.append(Solid(shape.tag, layout.called[name], pose, fields.get("size", [1.0] * 3), file))
    return solids


def _read_meshes(solids: list[Solid], poses: dict[str, np.ndarray], omitted: Counter) -> list[Solid]:
    """Fills the points of meshes; returns the solids without meshes that cannot be read, which are counted."""
    failed: list[str] = []
    for solid in solids:
        if solid.kind == "mesh":
            try:
                solid.points, solid.beyond = _extreme_points(solid, poses[solid.link])
            except UserError as error:
                failed.append(str(error))
    if failed and len(failed) == len(solids):
        raise UserError(f"--contact: {len(failed)} <mesh> shapes cannot be converted: {failed[0]}; write [[contact]] by hand")
    if failed:
        omitted[f"<mesh> shapes: {failed[0]}"] += len(failed)
    return [solid for solid in solids if solid.kind != "mesh" or solid.points]


def _extreme_points(solid: Solid, pose: np.ndarray) -> tuple[list[list[float]], float]:
    """Returns corners of the convex hull of a mesh, in the frame of its link, which has this initial pose, and see `Solid.beyond`."""
    corners = scaled(np.concatenate([points[np.unique(triangles)] for points, triangles, _ in mesh_parts(solid.file)]), solid.size)
    corners = np.round(corners @ solid.pose[:3, :3].T + solid.pose[:3, 3], 7)
    world = corners @ pose[:3, :3].T
    # a mesh is stretched to a cube, so that a long flat foot has its four corners
    extent = np.maximum(np.ptp(world, axis=0), 1e-9)
    world /= extent
    # rows in memory order: an import of dense meshes takes a third of the time
    upright = np.ascontiguousarray(world.T)
    hull = np.unique(np.concatenate([np.argmax(part @ upright, axis=1) for part in np.array_split(SPHERE, 40)]))
    if len(hull) <= len(DIRECTIONS):
        return corners[hull].tolist(), 0.0
    chosen = np.unique(np.argmax(world @ DIRECTIONS.T, axis=0))
    # along a unit vector of the unstretched mesh
    beyond = (np.max(world[hull] @ SPHERE.T, axis=0) - np.max(world[chosen] @ SPHERE.T, axis=0)) / np.linalg.norm(SPHERE / extent, axis=1)
    return corners[chosen].tolist(), float(beyond.max())


def _shapes(solid: Solid, pose: np.ndarray) -> list[dict[str, object]]:
    """Returns the shape fields of the contacts of a solid whose link has this initial pose."""
    if solid.kind == "mesh":
        return [{"shape_a": "points", "points_a": solid.points}]
    position, angles = position_and_angles(solid.pose)
    if solid.kind == "sphere":
        return [{"shape_a": "sphere", "point_a": position, "radius_a": solid.size[0]}]
    if solid.kind == "box":
        return [{"shape_a": "box", "point_a": position, "size_a": solid.size, **({"rpy_a": angles} if any(angles) else {})}]
    radius, half = solid.size[0], solid.size[1] / 2
    ends = [_at(solid.pose, (0, 0, z)) for z in (-half, half)]
    if solid.kind == "capsule":
        return [{"shape_a": "capsule", "point_a": ends[0], "point_a2": ends[1], "radius_a": radius}]
    if _is_upright(solid, pose):
        turns = [2 * math.pi * k / RIM_POINTS for k in range(RIM_POINTS)]
        rims = [_at(solid.pose, (radius * math.cos(t), radius * math.sin(t), z)) for z in (-half, half) for t in turns]
        return [{"shape_a": "points", "points_a": rims}]
    axis = [round(float(x), 13) for x in solid.pose[:3, 2]]
    return [{"shape_a": "disk", "point_a": end, "axis_a": axis, "radius_a": radius} for end in ends]


def _is_upright(solid: Solid, pose: np.ndarray) -> bool:
    return solid.kind == "cylinder" and abs((pose @ solid.pose)[2, 2]) > math.sqrt(0.5)


def _lowest_points(solid: Solid, pose: np.ndarray) -> list[list[float]]:
    """Returns the contact points in the ground frame, in the start pose of the link; of round shapes those that are lowest."""
    if solid.kind == "mesh":
        return [_at(pose, point) for point in solid.points]
    world = pose @ solid.pose
    if solid.kind == "sphere":
        return [_at(_lowered(world, solid.size[0]), (0, 0, 0))]
    if solid.kind == "box":
        return [_at(world, np.array(solid.size) * (np.array(corner) - 0.5)) for corner in np.ndindex(2, 2, 2)]
    radius, half = solid.size[0], solid.size[1] / 2
    if _is_upright(solid, pose):
        return [_at(pose, point) for point in _shapes(solid, pose)[0]["points_a"]]
    slope = 1.0 if solid.kind == "capsule" else math.sqrt(max(0.0, 1 - world[2, 2] ** 2))
    return [_at(_lowered(world, radius * slope), (0, 0, z)) for z in (-half, half)]


def _lowered(pose: np.ndarray, height: float) -> np.ndarray:
    return transform(None, (0, 0, -height)) @ pose


def _falls_over(draft: Draft, poses: dict[str, np.ndarray], points: list[list[float]]) -> None:
    """Reports a floating robot whose center of mass is not above its contact points. A single body has no pose to choose."""
    if len(draft.links) < 2:
        return
    mass, center = _center(draft, poses)
    feet = np.array(points)
    turns = np.radians(np.arange(0, 360, 2))
    # in each horizontal direction, how far the points reach beyond the center
    reach = (feet - center)[:, :2] @ np.array([np.cos(turns), np.sin(turns)])
    margin = float(reach.max(axis=0).min())
    if mass and margin < TILT * (center[2] - feet[:, 2].min()):
        where = f"{-margin:.2g} m outside the feet" if margin < 0 else f"{margin:.2g} m inside the edge of the feet"
        draft.doubts.append(
            f"the center of mass is {where}, so that the robot may fall over: set a start pose with --pose JOINT=VALUE; "
            "only shapes with contact stay above the ground, --contact all converts all"
        )


def _at(pose: np.ndarray, point: Iterable[float]) -> list[float]:
    return [round(float(x), 13) for x in pose[:3, :3] @ np.asarray(point, float) + pose[:3, 3]]


def _report(draft: Draft, chosen: list[Solid], poses: dict[str, np.ndarray], stiffness: str) -> None:
    kinds = Counter(solid.kind for solid in chosen)
    counts = ", ".join(f"{count} x <{kind}>" for kind, count in kinds.items())
    links = listed(list(dict.fromkeys(solid.link for solid in chosen)))
    draft.doubts.append(f"contact of {counts} ({links}) with the plane z = 0: {stiffness}; {_law(chosen)}")
    for upright, words in (
        (True, f"{2 * RIM_POINTS} points on the rims, because it stands upright; it does not roll smoothly"),
        (False, "two disks (its rims), because it lies; contact is not smooth if it stands upright"),
    ):
        found = [s.link for s in chosen if s.kind == "cylinder" and _is_upright(s, poses[s.link]) == upright]
        if found:
            found = list(dict.fromkeys(found))
            draft.doubts.append(f"<cylinder> of {listed(found)}: each is {words}")

    meshes = [solid for solid in chosen if solid.kind == "mesh"]
    if meshes:
        found, most = list(dict.fromkeys(solid.link for solid in meshes)), max(len(solid.points) for solid in meshes)
        beyond = max(solid.beyond for solid in meshes)
        missing = f", others lie up to {1000 * beyond:.2g} mm outside of them" if beyond > 1e-6 else ""
        draft.doubts.append(
            f"<mesh> of {listed(found)}: each is at most {most} corners of its convex hull{missing}; it does not roll smoothly"
        )


def _law(chosen: list[Solid]) -> str:
    """Returns what is assumed of the law, and the friction that the file states."""
    given: dict[float, list[str]] = {}
    for solid in chosen:
        if solid.friction is not None:
            given.setdefault(solid.friction, []).append(solid.link)
    assumed = [f"{key} {value:g}{unit}" for (key, value), unit in zip(LAW.items(), (" s/m", "", " m/s"), strict=True)]
    if not given:
        return f"{', '.join(assumed)} are assumed"
    by = [f"{value:g}" + (f" ({listed(list(dict.fromkeys(links)))})" if len(given) > 1 else "") for value, links in given.items()]
    creep = f", {assumed[2]} are" if any(solid.friction != 0 for solid in chosen) else " is"
    return f"{assumed[0]}{creep} assumed; friction {', '.join(by)} as in the file"


def _lift(draft: Draft, poses: dict[str, np.ndarray], lowest: float) -> None:
    """Moves the floating base such that the lowest contact point touches the ground, or lowers the ground below a fixed base.

    Other distances are reported.
    """
    bases = [link for link in draft.links if link.joint == "free" and link.parent == GROUND]
    if len(bases) == 1:
        base = bases[0]
        before = base.q if isinstance(base.q, list) else [0.0] * 3 + [1.0, 0.0, 0.0, 0.0]
        # the translations are along the axes of the joint frame
        place = pose_of(base.dh)[:3, :3].T @ [0, 0, -lowest] + before[:3]
        if base.q is before and abs(lowest) > 1e-9:
            change = f"the height of '{base.name}' in the keyframe is changed by {-lowest:.4g} m"
            draft.doubts.append(f"{change}: the lowest contact point touches the plane")
        base.q = [*(round(float(x), 13) for x in place), *before[3:]]
        base.drive = "free"
        draft.notes.append(f"Initial height of '{base.name}': the lowest contact point touches the ground plane.")
    elif lowest < -1e-9 and not bases:
        for contact in draft.contacts:
            contact.fields["point_b"] = [0.0, 0.0, round(float(lowest), 13)]
        draft.doubts.append(f"the ground plane is at z = {lowest:.4g} m, the height of the lowest contact point: the base is not floating")
    elif abs(lowest) > 1e-9:
        side = "above" if lowest > 0 else "below"
        why = "there are several floating bases" if bases else "the base is not floating"
        draft.doubts.append(f"the lowest contact point starts {abs(lowest):.4g} m {side} the ground plane; {why}")
