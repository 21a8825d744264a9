"""A tree of bodies with arbitrary frames, and its links with modified DH frames; shared by the importers of URDF and MJCF."""

from __future__ import annotations

import math
from argparse import Namespace
from collections.abc import Sequence
from dataclasses import dataclass, field
from fnmatch import fnmatchcase

import numpy as np

from build_fmu.errors import InvalidArgument, UserError, did_you_mean
from build_fmu.importers.draft import GROUND, Draft, DraftLink, DraftTie, Names, legal
from build_fmu.importers.layout import far, joint_frame, place, settle, side_frame
from build_fmu.importers.rigid import pose_of, position_and_angles, six_of, transform
from build_fmu.importers.toml_writer import number

WHOLE = ("free", "spherical")  # joints that need no axis


@dataclass
class Body:
    """A link of the source and its joint; the root has none."""

    name: str
    line: int = 0
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
    stiffness: float = 0.0
    rest: float = 0.0
    armature: float = 0.0
    q: float = 0.0
    drive: str = "torque"
    limits: tuple[float, float] | None = None
    shown: np.ndarray = field(default_factory=lambda: np.eye(4))  # pose of the frame for comments and --frames in that of the link
    children: list[str] = field(default_factory=list)


def set_pose(bodies: dict[str, Body], asked: Sequence[str]) -> set[str]:
    """Sets the start positions of JOINT=VALUE, where JOINT may contain the wildcards * and ?. Returns the names of the joints."""
    named = set()
    moving = {body.joint: body for body in bodies.values() if body.kind in ("revolute", "prismatic")}
    values: dict[str, str] = {}
    for text in asked:
        pattern, _, value = text.partition("=")
        if pattern in values:
            raise InvalidArgument(f"--pose: '{pattern}' is given twice, as {values[pattern]} and {value}")
        values[pattern] = value
        found = [body for name, body in moving.items() if fnmatchcase(name, pattern)]
        if not found:
            raise UserError(f"--pose: no revolute or prismatic joint is called '{pattern}'{did_you_mean(pattern, moving)}")
        try:
            q = float(value)
        except ValueError:
            q = math.nan
        if not math.isfinite(q):
            raise InvalidArgument(f"--pose: '{text}' must be JOINT=VALUE with a number in rad or m")
        for body in found:
            body.q = q
            named.add(body.joint)
    return named


class TreeLayout:
    """Creates the links of the draft, parents first."""

    def __init__(self, draft: Draft, bodies: dict[str, Body], options: Namespace, source: str) -> None:
        """`source` is the name of the format in comments."""
        self.draft, self.bodies, self.names, self.source = draft, bodies, Names(), source
        self.frames = options.frames
        self.depth = self._depths()
        self.called: dict[str, str] = {}  # names in the model
        self.joints: dict[str, str] = {}  # names in the model of joints that are not called like their links
        self.own: dict[str, np.ndarray] = {}  # the source's frame relative to ours
        self.size = max(float(np.linalg.norm(body.origin[:3, 3])) for body in bodies.values()) or 1.0

    def lay(self, root: str) -> None:
        """Fills draft.links; names of links take precedence over names of joints."""
        order, waiting = [], [root]
        while waiting:
            name = waiting.pop()
            order.append(name)
            waiting += reversed(self.bodies[name].children)
        called = self.called = {name: self.names.take(name) for name in order[1:]} | {root: GROUND}
        moving = [self.bodies[name] for name in order if self.bodies[name].kind != "fixed"]
        apart = [body for body in moving if body.joint not in ("", body.name)]  # a joint may have the name of its link
        # joints that can keep their names first, so that no generated name takes one of these
        apart.sort(key=lambda body: legal(body.joint) in self.names.used)
        self.joints = {body.name: self.names.take(body.joint, "_joint") for body in apart}
        frames = self.own = {root: np.eye(4)}
        if self.bodies[root].kind != "fixed":
            called[root] = self.names.take(root)
            frames[root] = self._link(self.bodies[root], called[root], GROUND, np.eye(4))
        for name in order[1:]:
            body = self.bodies[name]
            frames[name] = self._link(body, called[name], called[body.parent], frames[body.parent] @ body.origin)
        self.draft.doubts += self.names.sentences()

    def _link(self, body: Body, name: str, parent: str, frame: np.ndarray) -> np.ndarray:
        """Adds one link. `frame` is its frame in the source relative to the parent's; returns it relative to the link's own."""
        link = DraftLink(name, parent, body.kind, mass=body.mass, q=body.q)
        several = 3 if body.kind == "planar" else 0
        link.stiffness, link.rest, link.armature, link.drive = body.stiffness, body.rest, body.armature, body.drive
        link.damping, link.friction = ([x] * several if several and x else x for x in (body.damping, body.friction))
        if body.kind == "fixed":
            link.dh, own = self._fixed(frame)
        else:
            link.joint_name = self.joints.get(body.name, name)
            wanted = self._wanted(body, frame)
            # `place` would change the direction of x, which joints with several DOF need
            if far(settle(wanted), self.size):
                link.parent, frame = self._mount(body, name, parent, frame)
                wanted = self._wanted(body, frame)
            link.dh, own = place(wanted, frame)
        turn = own[:3, :3]
        link.com = [0.0 if abs(x) < 1e-16 else float(x) for x in turn @ body.com + own[:3, 3]] if body.mass else [0.0] * 3
        link.inertia = six_of(turn @ body.inertia @ turn.T)
        shown = own @ body.shown
        if float(np.abs(shown - np.eye(4)).max()) > 1e-12:
            position, rpy = position_and_angles(shown)
            if self.frames:
                self.draft.frames.append(DraftTie(self.names.take(f"{name}_frame"), {"link": name, "position": position, "rpy": rpy}))
            else:
                texts = (f"[{', '.join(map(number, values))}]" for values in (position, rpy))
                link.notes.append("{} frame of '{}' in this frame: position = {}, rpy = {}".format(self.source, body.name, *texts))
        self.draft.links.append(link)
        return own

    def _wanted(self, body: Body, frame: np.ndarray) -> np.ndarray:
        if body.kind in WHOLE:
            return frame
        axis = frame[:3, :3] @ body.axis
        # a planar joint keeps the x and y axes of the source
        main = self._main_child(body) if body.kind != "planar" else None
        line = None
        if main is not None:
            seen = frame @ main.origin
            line = seen[:3, 3], seen[:3, :3] @ main.axis
        wanted = joint_frame(frame, axis, line)
        # a frame that would be too far away stays at the position in the source
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
        moving = [self.bodies[c] for c in body.children if self.bodies[c].kind not in ("fixed", *WHOLE)]
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
