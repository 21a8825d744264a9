"""Reads a URDF: links, joints, inertias, axes, damping, friction, limits, mimics, drives. Link frames are chosen anew for modified DH."""

from __future__ import annotations

import math
from argparse import Namespace
from collections.abc import Sequence
from dataclasses import dataclass, field
from fnmatch import fnmatchcase
from pathlib import Path

import numpy as np
from lxml import etree

from build_fmu.errors import UserError, did_you_mean
from build_fmu.importers.draft import GROUND, Draft, DraftLink, DraftTie, Names, legal
from build_fmu.importers.layout import far, joint_frame, place, settle, side_frame
from build_fmu.importers.masses import add_masses
from build_fmu.importers.rigid import matrix_of, pose_of, position_and_angles, six_of, transform
from build_fmu.importers.toml_writer import number
from build_fmu.importers.urdf_actuators import add_actuators
from build_fmu.importers.urdf_contacts import add_contacts
from build_fmu.importers.urdf_file import DEGREES, NEAR_RIGHT, Urdf
from build_fmu.importers.urdf_limits import add_stops, report_outside, start_inside
from build_fmu.importers.urdf_losses import report_losses, some
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
WORLD = "world"  # the ground in some simulators, without a <link>
RESIDUE = 1e-16  # m2: an inertia below this times the mass is a rounding error


@dataclass
class Body:
    """A link of the URDF and its joint; the root has none."""

    name: str
    line: int
    mass: float = 0.0
    inertia: np.ndarray = field(default_factory=lambda: np.zeros((3, 3)))  # about the COM, in link axes
    com: np.ndarray = field(default_factory=lambda: np.zeros(3))
    parent: str = ""
    joint: str = ""
    kind: str = "fixed"
    origin: np.ndarray = field(default_factory=lambda: np.eye(4))
    axis: np.ndarray = field(default_factory=lambda: np.array([1.0, 0, 0]))
    damping: float = 0.0
    friction: float = 0.0
    q: float = 0.0
    limits: tuple[float, float] | None = None
    children: list[str] = field(default_factory=list)


def read(path: Path, options: Namespace) -> Draft:
    """Returns the draft; raises UserError with file, line and element."""
    if options.stops not in (None, "none") and not 0 < options.stops < math.inf:
        raise UserError(f"--stops: the stiffness must be > 0 and finite, got {options.stops:g}")
    urdf = Urdf(path, options.snap)
    bodies = _bodies(urdf)
    draft = Draft(name=legal(urdf.root.attrib.get("name") or path.stem), source=path.name)
    _joints(urdf, bodies, draft)
    by_joint = {body.joint: body for body in bodies.values() if body.joint}
    mimics = read_mimics(urdf, by_joint, draft)
    limited, posed = [body for body in bodies.values() if body.limits], _pose(bodies, options.pose)
    start_inside(limited, posed.union(mimic.joint for mimic in mimics), draft)
    follow(mimics, by_joint, posed, draft)
    report_outside(limited, draft)
    root = _root(urdf, bodies)
    if options.floating:
        bodies[root].kind = "free"
    elif bodies[root].mass or np.any(bodies[root].inertia):
        draft.lost.append(f"the mass of '{root}', {bodies[root].mass:g} kg: this link is the ground; --floating makes it a floating base")
    _check_reached(urdf, bodies, root)
    layout = _Layout(draft, bodies, options)
    layout.lay(root)
    add_masses(draft, solids_of(urdf, layout) if options.density or options.mass else {}, options)
    add_couplings(mimics, by_joint, layout)
    add_stops(limited, layout, options.stops)
    add_actuators(urdf, by_joint, layout, options.limits)
    if options.shapes:
        add_shapes(urdf, layout)
    if options.contact:
        add_contacts(urdf, layout, feet_only=options.contact == "ground")
    draft.notes.append(
        f"The ground frame is the frame of '{root}'{' at q = 0' if options.floating else ''}. Link frames are chosen anew (z: joint axis, "
        f"x: common normal); the motion is the same. {'A [[frame]]' if options.frames else 'A comment'} gives the pose of the "
        "URDF's own frame (m, rad) if it differs."
    )
    report_losses(urdf.root, draft, bool(options.contact), options.shapes)
    draft.doubts += urdf.like_degrees
    if urdf.near_right:
        draft.doubts.append(
            f"{urdf.near_right} angles are within {NEAR_RIGHT:g} rad of a multiple of 90 degrees, such as 1.5708: --snap makes them exact, "
            "for shorter numbers and a faster model"
        )
    if not any(link.joint != "fixed" for link in draft.links):
        raise UserError(f"'{path}' has no moving joint; --floating makes its root link '{root}' a floating base")
    return draft


def _bodies(urdf: Urdf) -> dict[str, Body]:
    bodies: dict[str, Body] = {}
    for element in urdf.root.findall("link"):
        body = Body(urdf.text(element, "name"), element.sourceline)
        if body.name in bodies:
            raise urdf.error(element, f"duplicate link '{body.name}'")
        inertial = element.find("inertial")
        if inertial is not None:
            _inertial(urdf, inertial, body)
        bodies[body.name] = body
    if not bodies:
        raise UserError(f"'{urdf.path}' has no <link>")
    return bodies


def _inertial(urdf: Urdf, inertial: etree._Element, body: Body) -> None:
    pose = urdf.pose(inertial)
    mass, tensor = inertial.find("mass"), inertial.find("inertia")
    if mass is not None:
        body.mass = urdf.amount(mass, "value", "")
    if tensor is not None:
        six = [urdf.numbers(tensor, key, 1, "0")[0] for key in ("ixx", "iyy", "izz", "ixy", "ixz", "iyz")]
        # rounding residues of an exporter are often impossible inertias
        if max(map(abs, six)) > RESIDUE * body.mass:
            body.inertia = pose[:3, :3] @ matrix_of(six) @ pose[:3, :3].T
    body.com = pose[:3, 3]


def _joints(urdf: Urdf, bodies: dict[str, Body], draft: Draft) -> None:
    seen = set()
    for element in urdf.root.findall("joint"):
        name, kind = urdf.text(element, "name"), urdf.text(element, "type")
        if name in seen:
            raise urdf.error(element, f"duplicate joint '{name}'")
        seen.add(name)
        if kind not in KINDS:
            hint = did_you_mean(kind, KINDS) or f"; supported: {', '.join(KINDS)}"
            raise urdf.error(element, f"joint '{name}': unknown type '{kind}'{hint}")
        parent, child = (_end(urdf, element, tag, bodies) for tag in ("parent", "child"))
        body = bodies[child]
        if body.parent:
            raise urdf.error(
                element, f"link '{child}' is the child of two joints, '{body.joint}' and '{name}'; add loops to the model file as [[loop]]"
            )
        body.parent, body.joint, body.kind, body.origin = parent, name, KINDS[kind], urdf.pose(element)
        bodies[parent].children.append(child)
        _motion(urdf, element, body, draft)


def _pose(bodies: dict[str, Body], asked: Sequence[str]) -> set[str]:
    """Sets the start positions of JOINT=VALUE, where JOINT may contain the wildcards * and ?. Returns the names of the joints."""
    named = set()
    moving = {body.joint: body for body in bodies.values() if body.kind in ("revolute", "prismatic")}
    for text in asked:
        pattern, _, value = text.partition("=")
        found = [body for name, body in moving.items() if fnmatchcase(name, pattern)]
        if not found:
            raise UserError(f"--pose: no revolute or prismatic joint is called '{pattern}'{did_you_mean(pattern, moving)}")
        try:
            q = float(value)
        except ValueError:
            q = math.nan
        if not math.isfinite(q):
            raise UserError(f"--pose: '{text}' must be JOINT=VALUE with a number in rad or m")
        for body in found:
            body.q = q
            named.add(body.joint)
    return named


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
    if kind in ("fixed", "floating"):
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
    where = f"{urdf.path}:{limit.sourceline}: the limits of '{name}', {low:g} to {high:g},"
    if low > high:
        draft.doubts.append(f"{where} are reversed and omitted")
    elif joint.attrib["type"] == "revolute" and DEGREES < max(abs(low), abs(high)) <= 720:
        draft.doubts.append(f"{where} look like degrees; they were read in rad, as URDF defines them")
    # a file without limits has 0 to 0
    return (low, high) if low < high else None


def _root(urdf: Urdf, bodies: dict[str, Body]) -> str:
    roots = [body.name for body in bodies.values() if not body.parent]
    if len(roots) != 1:
        what = f"links without a parent: {some(roots)}" if roots else "cyclic parent references"
        raise UserError(f"{urdf.path}: {what}; a URDF must have one root link")
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
            f"{urdf.path}:{bodies[lost[0]].line}: cyclic parent references: {some(lost)} have no path to the root link '{root}'"
        )


class _Layout:
    """Creates the links of the draft, parents first."""

    def __init__(self, draft: Draft, bodies: dict[str, Body], options: Namespace) -> None:
        self.draft, self.bodies, self.names = draft, bodies, Names()
        self.frames = options.frames
        self.depth = self._depths()
        self.called: dict[str, str] = {}  # names in the model
        self.own: dict[str, np.ndarray] = {}  # the URDF's frame relative to ours
        self.size = max(float(np.linalg.norm(body.origin[:3, 3])) for body in bodies.values()) or 1.0

    def lay(self, root: str) -> None:
        """Fills draft.links; names of links take precedence over names of joints."""
        order, waiting = [], [root]
        while waiting:
            name = waiting.pop()
            order.append(name)
            waiting += reversed(self.bodies[name].children)
        called = self.called = {name: self.names.take(name) for name in order[1:]} | {root: GROUND}
        frames = self.own = {root: np.eye(4)}
        if self.bodies[root].kind != "fixed":
            called[root] = self.names.take(root)
            frames[root] = self._link(self.bodies[root], called[root], GROUND, np.eye(4))
        for name in order[1:]:
            body = self.bodies[name]
            frames[name] = self._link(body, called[name], called[body.parent], frames[body.parent] @ body.origin)
        self.draft.doubts += self.names.sentences()

    def _link(self, body: Body, name: str, parent: str, frame: np.ndarray) -> np.ndarray:
        """Adds one link. `frame` is its URDF frame relative to the parent's; returns it relative to the link's own."""
        link = DraftLink(name, parent, body.kind, mass=body.mass, q=body.q)
        several = 3 if body.kind == "planar" else 0
        link.damping, link.friction = ([x] * several if several and x else x for x in (body.damping, body.friction))
        if body.kind == "fixed":
            link.dh, own = self._fixed(frame)
        else:
            # a joint may have the name of its link
            link.joint_name = name if body.joint in ("", body.name) else self.names.take(body.joint, "_joint")
            wanted = self._wanted(body, frame)
            # `place` would change the direction of x, which joints with several DOF need
            if far(settle(wanted), self.size):
                link.parent, frame = self._mount(body, name, parent, frame)
                wanted = self._wanted(body, frame)
            link.dh, own = place(wanted, frame)
        turn = own[:3, :3]
        link.com = [0.0 if abs(x) < 1e-16 else float(x) for x in turn @ body.com + own[:3, 3]] if body.mass else [0.0] * 3
        link.inertia = six_of(turn @ body.inertia @ turn.T)
        if float(np.abs(own - np.eye(4)).max()) > 1e-12:
            position, rpy = position_and_angles(own)
            if self.frames:
                self.draft.frames.append(DraftTie(self.names.take(f"{name}_frame"), {"link": name, "position": position, "rpy": rpy}))
            else:
                shown = (f"[{', '.join(map(number, values))}]" for values in (position, rpy))
                link.notes.append("URDF frame of '{}' in this frame: position = {}, rpy = {}".format(body.name, *shown))
        self.draft.links.append(link)
        return own

    def _wanted(self, body: Body, frame: np.ndarray) -> np.ndarray:
        if body.kind == "free":
            return frame
        axis = frame[:3, :3] @ body.axis
        # a planar joint keeps the x and y axes of the URDF
        main = self._main_child(body) if body.kind != "planar" else None
        line = None
        if main is not None:
            seen = frame @ main.origin
            line = seen[:3, 3], seen[:3, :3] @ main.axis
        wanted = joint_frame(frame, axis, line)
        # a frame that would be too far away stays at the position in the URDF
        return wanted if not far(settle(wanted), self.size) else joint_frame(frame, axis, None)

    def _fixed(self, frame: np.ndarray) -> tuple:
        dh, own = place(frame, frame)
        return (dh, own) if not far(dh, self.size) else place(transform(None, frame[:3, 3]), frame)

    def _mount(self, body: Body, name: str, parent: str, frame: np.ndarray) -> tuple[str, np.ndarray]:
        mount = self.names.take(f"{name}_mount")
        dh = settle(side_frame(frame[:3, 3]))
        note = f"Massless frame: the axis of '{body.joint}' is nearly parallel to the previous one, so their common normal is too far away."
        self.draft.links.append(DraftLink(mount, parent, "fixed", dh=dh, notes=[note]))
        return mount, np.linalg.inv(pose_of(dh)) @ frame

    def _main_child(self, body: Body) -> Body | None:
        """Returns the moving child with the longest chain."""
        moving = [self.bodies[c] for c in body.children if self.bodies[c].kind != "fixed"]
        return max(moving, key=lambda child: self.depth[child.name], default=None)

    def _depths(self) -> dict[str, int]:
        order, waiting = [], [body.name for body in self.bodies.values() if not body.parent]
        while waiting:
            order.append(waiting.pop())
            waiting += self.bodies[order[-1]].children
        depth: dict[str, int] = {}
        for name in reversed(order):
            depth[name] = 1 + max((depth[c] for c in self.bodies[name].children), default=0)
        return depth
