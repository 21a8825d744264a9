"""Reads a URDF: links, joints, inertias, axes, damping, friction, limits, mimics, drives. Link frames are chosen anew for modified DH."""

from __future__ import annotations

import math
from argparse import Namespace
from pathlib import Path

import numpy as np
from lxml import etree

from build_fmu.errors import UserError, did_you_mean, listed
from build_fmu.importers.draft import Draft, legal
from build_fmu.importers.masses import add_masses
from build_fmu.importers.physical import lock_massless, possible, warn_of_singularity
from build_fmu.importers.rigid import matrix_of
from build_fmu.importers.tree import Body, TreeLayout, set_pose
from build_fmu.importers.urdf_actuators import add_actuators
from build_fmu.importers.urdf_contacts import add_urdf_contacts
from build_fmu.importers.urdf_file import DEGREES, NEAR_RIGHT, Urdf
from build_fmu.importers.urdf_limits import add_stops, lock_narrow, report_outside, start_inside
from build_fmu.importers.urdf_losses import report_losses
from build_fmu.importers.urdf_mimic import add_couplings, follow, read_mimics
from build_fmu.importers.urdf_visuals import add_shapes, solids_of

KINDS = {
    "revolute": "revolute",
    "continuous": "revolute",
    "prismatic": "prismatic",
    "fixed": "fixed",
    "floating": "free",
    "planar": "planar",
}
KINDS_OF = {"URDF": KINDS, "SDF": KINDS | {"ball": "spherical"}}
WORLD = "world"  # the ground in some simulators, without a <link>
LIMIT = ("lower", "upper", "effort", "velocity")
RESIDUE = 1e-16  # m2: an inertia below this times the mass is a rounding error


def read(path: Path, options: Namespace) -> Draft:
    """Returns the draft; raises UserError with file, line and element."""
    return draft_of(Urdf.of_file(path, options.snap, options.arg), options)[0]


def draft_of(urdf: Urdf, options: Namespace) -> tuple[Draft, TreeLayout]:
    """Returns the draft of a parsed file, and where its links are."""
    if options.stops not in (None, "none") and not 0 < options.stops < math.inf:
        raise UserError(f"--stops: the stiffness must be > 0 and finite, got {options.stops:g}")
    path = urdf.path
    draft = Draft(name=legal(urdf.root.attrib.get("name") or path.stem), source=path.name, gravity=urdf.gravity)
    bodies = _bodies(urdf, draft)
    _joints(urdf, bodies, draft)
    by_joint = {body.joint: body for body in bodies.values() if body.joint}
    for name, (stiffness, rest) in urdf.springs.items():
        by_joint[name].stiffness, by_joint[name].rest = stiffness, rest
    mimics = read_mimics(urdf, by_joint, draft)
    limited, posed = [body for body in bodies.values() if body.limits], set_pose(bodies, options.pose)
    legs = (bodies, _places_of_shapes(urdf)) if options.floating and options.contact else None
    following = {mimic.joint for mimic in mimics}
    limited = lock_narrow(limited, posed, following, draft)
    start_inside(limited, posed | following, draft, legs)
    follow(mimics, by_joint, posed, draft)
    report_outside(limited, draft)
    root = _root(urdf, bodies)
    if options.floating:
        bodies[root].kind = "free"
    elif bodies[root].mass or np.any(bodies[root].inertia):
        draft.lost.append(f"the mass of '{root}', {bodies[root].mass:g} kg: this link is the ground; --floating makes it a floating base")
    _check_reached(urdf, bodies, root)
    layout = TreeLayout(draft, bodies, options, urdf.source)
    layout.lay(root)
    add_masses(draft, solids_of(urdf, layout) if options.density or options.mass else {}, options)
    add_couplings(mimics, by_joint, layout)
    add_actuators(urdf, by_joint, layout, options.limits)
    lock_massless(draft)
    add_stops(limited, layout, options.stops)
    warn_of_singularity(draft)
    if options.shapes:
        add_shapes(urdf, layout)
    if options.contact:
        add_urdf_contacts(urdf, layout, feet_only=options.contact == "ground")
    draft.notes.append(
        f"The ground frame is the frame of '{root}'{' at q = 0' if options.floating else ''}. Link frames are chosen anew (z: joint axis, "
        f"x: common normal); the motion is the same. {'A [[frame]]' if options.frames else 'A comment'} gives the pose of the "
        f"{urdf.source}'s own frame (m, rad) if it differs."
    )
    report_losses(urdf.root, draft, bool(options.contact), options.shapes)
    draft.doubts += urdf.like_degrees
    if urdf.near_right:
        draft.doubts.append(
            f"{urdf.near_right} angles are within {NEAR_RIGHT:g} rad of a multiple of 90 degrees, such as 1.5708: --snap makes them exact, "
            "for shorter numbers, a faster model and closed loops with parallel axes"
        )
    if not any(link.joint != "fixed" for link in draft.links):
        hint = f"; --floating makes its root link '{root}' a floating base" if urdf.source == "URDF" else ""
        raise UserError(f"'{path}' has no moving joint{hint}")
    return draft, layout


def _bodies(urdf: Urdf, draft: Draft) -> dict[str, Body]:
    bodies: dict[str, Body] = {}
    for element in urdf.root.findall("link"):
        body = Body(urdf.name(element), element.sourceline)
        if body.name in bodies:
            raise urdf.error(element, f"duplicate link '{body.name}'")
        inertial = element.find("inertial")
        if inertial is not None:
            _inertial(urdf, inertial, body, draft)
        bodies[body.name] = body
    if not bodies:
        raise UserError(f"'{urdf.path}' has no <link>")
    return bodies


def _places_of_shapes(urdf: Urdf) -> dict[str, list[np.ndarray]]:
    """Returns the positions of the <collision> shapes in the frames of the links."""
    links = urdf.root.findall("link")
    origins = {link.attrib["name"]: link.findall("collision/origin") for link in links}
    return {name: [np.array(urdf.numbers(origin, "xyz", 3, "0 0 0")) for origin in found] for name, found in origins.items()}


def _inertial(urdf: Urdf, inertial: etree._Element, body: Body, draft: Draft) -> None:
    pose = urdf.pose(inertial)
    mass, tensor = inertial.find("mass"), inertial.find("inertia")
    if mass is not None:
        body.mass = urdf.amount(mass, "value", "")
    if tensor is not None:
        six = [urdf.numbers(tensor, key, 1, "0")[0] for key in ("ixx", "iyy", "izz", "ixy", "ixz", "iyz")]
        # rounding residues of an exporter are often impossible inertias
        if max(map(abs, six)) > RESIDUE * body.mass:
            given = matrix_of(six)
            inertia = possible(given)
            if inertia is not given:
                _report_change(f"{urdf.shown}:{tensor.sourceline}: the inertia of '{body.name}'", given, inertia, draft)
            body.inertia = pose[:3, :3] @ inertia @ pose[:3, :3].T
    body.com = pose[:3, 3]


def _report_change(where: str, given: np.ndarray, used: np.ndarray, draft: Draft) -> None:
    before, after = (", ".join(f"{x:.3g}" for x in np.linalg.eigvalsh(matrix)) for matrix in (given, used))
    draft.doubts.append(f"{where} has a negative principal moment ({before} kg m2); the nearest possible one is used ({after} kg m2)")


def _joints(urdf: Urdf, bodies: dict[str, Body], draft: Draft) -> None:
    seen = set()
    for element in urdf.root.findall("joint"):
        name, kind = urdf.name(element), urdf.text(element, "type")
        if name in seen:
            raise urdf.error(element, f"duplicate joint '{name}'")
        seen.add(name)
        kinds = KINDS_OF[urdf.source]
        if kind not in kinds:
            hint = did_you_mean(kind, KINDS) or f"; supported: {', '.join(KINDS)}"
            raise urdf.error(element, f"joint '{name}': unknown type '{kind}'{hint}")
        parent, child = (_end(urdf, element, tag, bodies) for tag in ("parent", "child"))
        body = bodies[child]
        if body.parent:
            raise urdf.error(
                element, f"link '{child}' is the child of two joints, '{body.joint}' and '{name}'; add loops to the model file as [[loop]]"
            )
        body.parent, body.joint, body.kind, body.origin = parent, name, kinds[kind], urdf.pose(element)
        bodies[parent].children.append(child)
        _motion(urdf, element, body, draft)


def _end(urdf: Urdf, joint: etree._Element, tag: str, bodies: dict[str, Body]) -> str:
    """Returns the name of the parent or child link of a joint."""
    name, end = joint.get("name"), joint.find(tag)
    if end is None:
        raise urdf.error(joint, f"joint '{name}' has no <{tag}>")
    link = urdf.text(end, "link")
    if link == WORLD and tag == "parent":
        bodies.setdefault(WORLD, Body(WORLD, end.sourceline))
    if link not in bodies:
        raise urdf.error(end, f"joint '{name}': unknown link '{link}'{did_you_mean(link, bodies)}")
    return link


def _motion(urdf: Urdf, joint: etree._Element, body: Body, draft: Draft) -> None:
    """Reads axis, friction and limits of a joint, as far as its type has them."""
    kind = joint.get("type")
    for tag in ("dynamics", "limit") if kind in ("floating", "planar") else ():
        if joint.find(tag) is not None and (kind, tag) != ("planar", "dynamics"):
            draft.lost.append(f"<{tag}> of '{body.joint}': not supported for {kind} joints")
    if kind in ("fixed", "floating", "ball"):
        return
    body.axis = _axis(urdf, joint, body.joint)
    dynamics = joint.find("dynamics")
    if dynamics is not None:
        body.damping = urdf.amount(dynamics, "damping", "0")
        body.friction = urdf.amount(dynamics, "friction", "0")
    if kind != "planar":
        body.limits = _limits(urdf, joint, body.joint, draft)


def _axis(urdf: Urdf, joint: etree._Element, name: str) -> np.ndarray:
    element = joint.find("axis")
    axis = np.array([1.0, 0, 0] if element is None else urdf.numbers(element, "xyz", 3, "1 0 0"))
    length = float(np.linalg.norm(axis))
    if length < 1e-9:
        raise urdf.error(joint, f"joint '{name}': the axis is zero")
    # no division by a length of 1 up to rounding: (0, 0, 1) stays exact
    return axis / length if abs(length - 1) > 1e-15 else axis


def _limits(urdf: Urdf, joint: etree._Element, name: str, draft: Draft) -> tuple[float, float] | None:
    limit = joint.find("limit")
    if limit is None or joint.attrib["type"] == "continuous":
        return None
    low, high = (urdf.numbers(limit, key, 1, "0")[0] for key in ("lower", "upper"))
    where = f"{urdf.shown}:{limit.sourceline}: the limits of '{name}', {low:g} to {high:g},"
    if low > high:
        draft.doubts.append(f"{where} are reversed and omitted")
    elif joint.attrib["type"] == "revolute" and DEGREES < max(abs(low), abs(high)) <= 720:
        draft.doubts.append(f"{where} look like degrees; they were read in rad, as {urdf.source} defines them")
    if low == high and _is_placeholder(urdf, limit):
        draft.doubts.append(f"{where} with effort and velocity 0 are read as placeholders: '{name}' has no limits")
        return None
    return (low, high) if low <= high and ("lower" in limit.attrib or "upper" in limit.attrib) else None


def _is_placeholder(urdf: Urdf, limit: etree._Element) -> bool:
    """Returns whether all values are 0, which exporters of CAD programs write for joints without limits."""
    return urdf.source == "URDF" and all(key in limit.attrib and urdf.bound(limit, key) == 0 for key in LIMIT)


def _root(urdf: Urdf, bodies: dict[str, Body]) -> str:
    roots = [body.name for body in bodies.values() if not body.parent]
    if len(roots) != 1:
        what = f"links without a parent: {listed(roots)}" if roots else "cyclic parent references"
        # a file's first root is usually the intended one
        line = bodies[roots[1]].line if roots else next(iter(bodies.values())).line
        article = "an" if urdf.source == "SDF" else "a"
        raise UserError(f"{urdf.shown}:{line}: {what}; {article} {urdf.source} must have one root link")
    return roots[0]


def _check_reached(urdf: Urdf, bodies: dict[str, Body], root: str) -> None:
    reached, waiting = set(), [root]
    while waiting:
        name = waiting.pop()
        reached.add(name)
        waiting += bodies[name].children
    lost = [name for name in bodies if name not in reached]
    if lost:
        raise UserError(
            f"{urdf.shown}:{bodies[lost[0]].line}: cyclic parent references: {listed(lost)} have no path to the root link '{root}'"
        )
