"""Reads the bodies, joints, geoms and sites of an MJCF file. A body with several joints becomes a chain of links with one joint each."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator
from dataclasses import dataclass, field
from functools import partial
from itertools import chain, count

import numpy as np
from lxml import etree

from build_fmu.errors import UserError, did_you_mean, listed
from build_fmu.importers.draft import Draft
from build_fmu.importers.mjcf_axes import principal_axes
from build_fmu.importers.mjcf_file import ORIENTATIONS, Mjcf, elements, towards, turn
from build_fmu.importers.obj_faces import obj_faces
from build_fmu.importers.rigid import matrix_of, transform
from build_fmu.importers.solids import Body as Mass
from build_fmu.importers.solids import Solid, body_of, is_open, joined, mesh_body, mujoco_mesh_body
from build_fmu.importers.tree import Body

WORLD = "world"
KINDS = {"hinge": "revolute", "slide": "prismatic", "ball": "spherical", "free": "free"}
JOINTS = ("joint", "freejoint")
EXPAND = ("replicate", "attach", "composite", "flexcomp")
LENGTHS = {"sphere": 1, "capsule": 2, "cylinder": 2, "box": 3, "ellipsoid": 3}
DENSITY = 1000.0  # kg/m3, the default of MJCF
DISTINCT = 1e-4  # relative difference of principal moments from which on the axes of a mesh in single precision are known


@dataclass
class Geom:
    """A geom of a body; `pose` in the frame of the body, `solid` None for planes and height fields."""

    body: str
    element: etree._Element
    values: dict[str, str]
    pose: np.ndarray
    kind: str
    solid: Solid | None = None
    rule: str = ""  # how the inertia of a mesh is computed


@dataclass
class Joint:
    """A joint of the file; `link` is the key of its body in `Tree.bodies`. Positions count from `ref`, tendons rest at `spring`."""

    name: str
    link: str
    kind: str
    ref: float = 0.0
    spring: float = 0.0


@dataclass
class Tree:
    """What was read. `shift`: pose of the frame of an MJCF body in the frame of its link's source (its last joint's position)."""

    mj: Mjcf
    draft: Draft
    bodies: dict[str, Body] = field(default_factory=lambda: {WORLD: Body(WORLD)})
    shift: dict[str, np.ndarray] = field(default_factory=lambda: {WORLD: np.eye(4)})
    aligned: dict[str, np.ndarray | None] = field(default_factory=dict)  # see `frame_of`; None: not known
    joints: list[Joint] = field(default_factory=list)
    geoms: list[Geom] = field(default_factory=list)
    sites: dict[str, tuple[str, np.ndarray]] = field(default_factory=dict)
    omitted: Counter = field(default_factory=Counter)
    unread: list[Geom] = field(default_factory=list)  # meshes that would have a mass
    applied: list[etree._Element] = field(default_factory=list)  # of <contact>
    used: dict[str, set[str]] = field(default_factory=dict)  # names of bodies, joints and sites, which generated names avoid

    def read(self) -> None:
        """Fills the tree."""
        for kind, tags in (("body", ("body",)), ("joint", JOINTS), ("site", ("site",))):
            named = (element.get("name") for tag in tags for element in self.mj.root.iterfind(f"worldbody//{tag}"))
            self.used[kind] = {name for name in named if name}
        for element in self.mj.root.findall("worldbody"):
            self._contents(element, WORLD, element.get("childclass", ""), np.eye(4))
        if self.unread:
            given = sum(amount for key, amount in map(self._amount, self.unread) if key == "mass")
            self.draft.lost.append(
                f"mass of {len(self.unread)} <geom> of {listed(list(dict.fromkeys(geom.body for geom in self.unread)))}"
                f"{f' ({given:g} kg given)' if given else ''}: the <mesh> is not read; add mass, com and inertia to the model file"
            )
        self._limit_masses()

    def frame_of(self, body: str) -> np.ndarray:
        """Returns the frame in which MuJoCo states positions of a body and ends of constraints, in the frame of the MJCF body.

        It differs for aligned free joints: origin in the center of mass, principal axes.
        """
        frame = self.aligned.get(body, np.eye(4))
        if frame is None:
            raise UserError(
                f"'{self.mj.path}': body '{body}': an aligned free joint is not supported with fusestatic, or with a mesh of equal "
                'principal moments: set align="false", and state its <key> and <equality> in the frame of the body'
            )
        return frame

    def _contents(self, element: etree._Element, body: str, inherited: str, outer: np.ndarray) -> None:
        """Reads the children of a body, also those inside a <frame>, but its joints and its <inertial>."""
        for child, inner, pose in self._inside(element, inherited, outer):
            if child.tag == "body":
                self._body(child, body, inner, pose)
            elif child.tag == "geom":
                self._geom(child, body, inner, pose)
            elif child.tag == "site":
                values = self.mj.attributes(child, inner)
                name = values.get("name") or self._unused("site", (f"site{i}" for i in count(len(self.sites))))
                self.sites[name] = (body, pose @ self._pose_of_shape(child, values)[0])
            elif child.tag in EXPAND:
                raise self.mj.error(child, f"<{child.tag}> is not supported: save the expanded model from MuJoCo and import that file")
            elif child.tag not in (*JOINTS, "inertial"):
                self.omitted[f"<{child.tag}>"] += 1

    def _inside(self, element: etree._Element, inherited: str, outer: np.ndarray) -> Iterator[tuple[etree._Element, str, np.ndarray]]:
        """Yields the children of a body and of its frames, with the class that they inherit and the pose of their <frame> in the body."""
        for child in elements(element):
            inner = child.get("childclass") or inherited
            if child.tag == "frame":
                yield from self._inside(child, inner, outer @ self.mj.pose(child, child.attrib))
            else:
                yield child, inner, outer

    def _body(self, element: etree._Element, parent: str, inherited: str, outer: np.ndarray) -> None:
        name = element.get("name") or self._unused("body", (f"body{i}" for i in count(1)))
        if name in self.bodies:
            raise self.mj.error(element, f"duplicate body '{name}'")
        own = [part for part in self._inside(element, inherited, np.eye(4)) if part[0].tag in (*JOINTS, "inertial")]
        joints = [part for part in own if part[0].tag in JOINTS]
        frame, before = self.shift[parent] @ outer @ self.mj.pose(element, element.attrib), np.zeros(3)
        last = parent
        if not joints:
            self._add(Body(name, element.sourceline, parent=parent, origin=frame))
        for i, (joint, inner, pose) in enumerate(joints):
            link = Body(name if i == len(joints) - 1 else "", element.sourceline, parent=last)
            at = self._joint(joint, inner, link, (name, i, len(joints)))
            if link.kind != "free":
                at, link.axis = pose[:3, :3] @ at + pose[:3, 3], pose[:3, :3] @ link.axis
            self.joints[-1].link = link.name
            ref = self.joints[-1].ref
            back = turn(link.axis, -ref) if link.kind == "revolute" else None
            slide = -ref * link.axis if link.kind == "prismatic" else np.zeros(3)
            link.origin = frame @ transform(None, at - before) @ transform(back, slide)
            self._add(link)
            frame, before, last = np.eye(4), at, link.name
        self.shift[name] = self.bodies[name].shown = transform(None, -before)
        for key in ("mocap", "gravcomp"):
            if element.get(key, "false") not in ("false", "0"):
                self.omitted[f"'{key}' of <body>"] += 1
        first = len(self.geoms)
        self._contents(element, name, inherited, np.eye(4))
        inertial = next((part for part in own if part[0].tag == "inertial"), None)
        mass, axes = self._inertia(inertial, element, [geom for geom in self.geoms[first:] if geom.body == name])
        if joints and self._is_aligned(element, joints[0][0]):
            self.aligned[name] = None if axes is None or element.find(".//body") is not None else transform(axes, mass.com)
        mass, body = mass.moved(self.shift[name]), self.bodies[name]
        body.mass, body.com, body.inertia = float(mass.mass), mass.com, mass.inertia

    def _is_aligned(self, element: etree._Element, joint: etree._Element) -> bool:
        """Returns whether MuJoCo moves the frame of a body to its principal axes: one with a free joint and without child bodies."""
        chosen = joint.get("align", "auto")
        wanted = self.mj.flag("alignfree", False) if chosen == "auto" else chosen == "true"
        # fusestatic adds child bodies without joints to the body
        moving = any(element.find(f".//body//{tag}") is not None for tag in JOINTS)
        single = not moving if self.mj.flag("fusestatic", False) else element.find(".//body") is None
        return wanted and single and self.joints[-1].kind == "free"

    def _unused(self, kind: str, names: Iterator[str]) -> str:
        """Returns the first of the names that no body, joint or site of the file has, and reserves it."""
        name = next(name for name in names if name not in self.used[kind])
        self.used[kind].add(name)
        return name

    def _add(self, body: Body) -> None:
        self.bodies[body.name] = body
        self.bodies[body.parent].children.append(body.name)

    def _joint(self, element: etree._Element, inherited: str, link: Body, place: tuple[str, int, int]) -> np.ndarray:
        """Reads a joint into its link and returns its position in the frame of the MJCF body; `place`: body, index, number of joints."""
        body, index, number = place
        mj = self.mj
        values = dict(element.attrib) if element.tag == "freejoint" else mj.attributes(element, inherited)
        kind = "free" if element.tag == "freejoint" else values.get("type", "hinge")
        if kind not in KINDS:
            hint = did_you_mean(kind, KINDS) or f"; supported: {', '.join(KINDS)}"
            raise mj.error(element, f"unknown joint type '{kind}'{hint}")
        generated = (f"{body}_joint{i}" for i in count(index + 1))
        name = values.get("name") or self._unused("joint", chain([body], generated) if number == 1 else generated)
        if any(joint.name == name for joint in self.joints):
            raise mj.error(element, f"duplicate joint '{name}'")
        if not link.name:
            wanted = f"{body}_{name.removeprefix(f'{body}_')}"
            link.name = self._unused("body", chain([wanted], (f"{wanted}_{i}" for i in count(2))))
        link.joint, link.kind = name, KINDS[kind]
        joint = Joint(name, link.name, kind)
        self.joints.append(joint)
        if kind == "free":
            self._whole(element, values)
            return np.zeros(3)
        at = np.array(mj.numbers(element, values, "pos", 3, "0 0 0"))
        if kind == "ball":
            self._whole(element, values)
            return at
        axis = np.array(mj.numbers(element, values, "axis", 3, "0 0 1"))
        length = float(np.linalg.norm(axis))
        if length < 1e-12:
            raise mj.error(element, f"joint '{name}': the axis is zero")
        link.axis = axis / length if abs(length - 1) > 1e-15 else axis
        scale = mj.angle if kind == "hinge" else float
        joint.ref, joint.spring = (scale(mj.numbers(element, values, key, 1, "0")[0]) for key in ("ref", "springref"))
        link.q, link.rest = joint.ref, joint.spring
        self._forces(element, values, name, link)
        limits = mj.limits(element, values, "range", "limited")
        if limits:
            link.limits = (scale(limits[0]), scale(limits[1]))
        low, high = mj.numbers(element, values, "range", 2, "0 0")
        self.omitted["reversed 'range' of <joint>"] += low > high
        self._report(element, values)
        return at

    def _forces(self, element: etree._Element, values: dict[str, str], name: str, link: Body) -> None:
        """Reads the forces of a hinge or slide joint into its link."""
        for key, own in (("stiffness", "stiffness"), ("damping", "damping"), ("armature", "armature"), ("frictionloss", "friction")):
            amounts = self.mj.numbers(element, values, key, None, "0") or [0.0]
            if amounts[0] < 0 and key != "damping":
                raise self.mj.error(element, f"'{key}' of joint '{name}' must be >= 0, got {amounts[0]:g}")
            if amounts[0] < 0:
                given = f"{self.mj.place(element)}: 'damping' of joint '{name}' is {amounts[0]:g}"
                self.draft.doubts.append(f"{given}; negative damping adds energy, and 0 is used")
            setattr(link, own, max(amounts[0], 0.0))
            self.omitted[f"nonlinear {key} of joints"] += any(amounts[1:])
        if not link.stiffness:
            link.rest = 0.0

    def _whole(self, element: etree._Element, values: dict[str, str]) -> None:
        """Lists the forces of a free or ball joint, which the model does not have."""
        for key in ("stiffness", "damping", "armature", "frictionloss"):
            if any(self.mj.numbers(element, values, key, None, "0")):
                self.omitted[f"{key} of ball and free joints"] += 1
        if values.get("limited") == "true" or (values.get("limited", "auto") == "auto" and "range" in values):
            self.omitted["limits of ball and free joints"] += 1
        self._report(element, values)

    def _report(self, element: etree._Element, values: dict[str, str]) -> None:
        for key in ("springdamper", "actuatorfrcrange", "margin"):
            if any(self.mj.numbers(element, values, key, None, "0")):
                self.omitted[f"'{key}' of <joint>"] += 1

    def _pose_of_shape(self, element: etree._Element, values: dict[str, str]) -> tuple[np.ndarray, float | None]:
        """Returns the pose of a geom or site, and half of its length by `fromto`."""
        if "fromto" not in values:
            return self.mj.pose(element, values), None
        six = np.array(self.mj.numbers(element, values, "fromto", 6))
        line = six[:3] - six[3:]
        length = float(np.linalg.norm(line))
        if length < 1e-12:
            raise self.mj.error(element, f"'fromto' of <{element.tag}> has no length")
        return transform(towards(line / length), (six[:3] + six[3:]) / 2), length / 2

    def _geom(self, element: etree._Element, body: str, inherited: str, outer: np.ndarray) -> None:
        mj = self.mj
        values = mj.attributes(element, inherited)
        kind = values.get("type", "sphere")
        own, half = self._pose_of_shape(element, values)
        geom = Geom(body, element, values, outer @ own, kind)
        if kind == "mesh":
            geom.solid, geom.rule = self._mesh(element, values, geom.pose)
        elif kind in LENGTHS and "mesh" in values:
            self.omitted[f"<geom> of type {kind} that is fitted to a mesh, with its mass"] += 1
        elif kind in LENGTHS:
            size = mj.numbers(element, values, "size", None, "")
            if half is not None and size:
                size = [size[0], half] if kind in ("capsule", "cylinder") else [size[0], size[0], half]
            if len(size) < LENGTHS[kind] or min(size[: LENGTHS[kind]]) <= 0:
                raise mj.error(
                    element, f"'size' of a <geom> of type {kind} must be {LENGTHS[kind]} numbers > 0, got '{values.get('size', '')}'"
                )
            whole = [2 * x for x in size[:3]] if kind == "box" else [size[0], 2 * size[1]] if LENGTHS[kind] == 2 else size[: LENGTHS[kind]]
            geom.solid = Solid(kind, whole, geom.pose)
        elif kind not in ("plane", "hfield"):
            self.omitted[f"<geom> of type {kind}"] += 1
        self.geoms.append(geom)

    def _mesh(self, element: etree._Element, values: dict[str, str], pose: np.ndarray) -> tuple[Solid | None, str]:
        """Returns the solid of a mesh and the rule of its inertia."""
        name = values.get("mesh", "")
        for asset in self.mj.root.findall("asset/mesh"):
            of_asset = self.mj.attributes(asset)
            file = of_asset.get("file", "")
            plain = file.replace("\\", "/").rpartition("/")[2]
            if name != (of_asset.get("name") or plain.rpartition(".")[0]):
                continue
            scale = self.mj.numbers(asset, of_asset, "scale", 3, "1 1 1")
            moved = {"pos": of_asset.get("refpos", "0 0 0"), "quat": of_asset.get("refquat", "1 0 0 0")}
            folder = self.mj.compiler.get("meshdir", self.mj.compiler.get("assetdir", ""))
            path = self.mj.path.resolve().parent / folder / (plain if self.mj.flag("strippath", False) else file)
            if not file or not path.is_file():
                given = next((key for key in ("builtin", "vertex") if key in of_asset), "")
                reason = f"given by '{given}', not by a file" if given and not file else "without a file that exists"
                self.omitted[f"<mesh> {reason} ('{file or name}')"] += 1
                return None, ""
            default = "exact" if self.mj.flag("exactmeshinertia", False) else "legacy"
            size, own = _referred(scale, self.mj.pose(asset, moved))
            return Solid("mesh", size, pose @ own, str(path)), of_asset.get("inertia", default)
        raise self.mj.error(element, f"unknown mesh '{name}'")

    def _inertia(
        self, given: tuple[etree._Element, str, np.ndarray] | None, element: etree._Element, geoms: list[Geom]
    ) -> tuple[Mass, np.ndarray | None]:
        """Returns the mass of a body by <inertial> or by its geoms, and the axes in which MuJoCo states its inertia; None: not known."""
        mj = self.mj
        inertial, _, outer = given or (None, "", np.eye(4))
        rule, parts = mj.compiler.get("inertiafromgeom", "auto"), []
        if rule == "true" or (rule == "auto" and inertial is None):
            low, high = mj.setting("inertiagrouprange", 2, "0 5")
            counted = [g for g in geoms if low <= mj.whole(g.element, g.values, "group", 0) <= high]
            self.unread += [g for g in counted if g.kind == "mesh" and g.solid is None and self._amount(g)[1]]
            counted = [g for g in counted if g.solid is not None]
            parts = [(geom, part) for geom, part in zip(counted, map(self._mass, counted), strict=True) if part.mass > 0]
        if parts:
            mass, mesh = joined([part for _, part in parts]), any(geom.kind == "mesh" for geom, _ in parts)
            turned = parts[0][0].pose[:3, :3] if len(parts) == 1 else np.eye(3)
            if len(parts) == 1 and not mesh:
                return mass, turned
            vague = mesh and not _distinct(mass.inertia)
            return mass, None if vague else turned @ principal_axes(turned.T @ mass.inertia @ turned)
        if inertial is not None:
            values = mj.attributes(inertial)
            at = outer @ mj.pose(inertial, values)
            if "pos" not in values:
                raise mj.error(inertial, "<inertial> requires 'pos'")
            if "fullinertia" in values:
                if other := next((key for key in (*ORIENTATIONS, "diaginertia") if key in values), ""):
                    raise mj.error(inertial, f"<inertial> has 'fullinertia', which excludes '{other}'")
                own = matrix_of(mj.numbers(inertial, values, "fullinertia", 6))
                axes = at[:3, :3] @ principal_axes(own)
            else:
                own, axes = np.diag(mj.numbers(inertial, values, "diaginertia", 3, "0 0 0")), at[:3, :3]
            return Mass(mj.numbers(inertial, values, "mass", 1)[0], np.zeros(3), own).moved(at), axes
        # MuJoCo places the mass of boundmass at the body's own pose, in the frame of the body
        at = mj.pose(element, element.attrib)
        return Mass(0.0, at[:3, 3]), at[:3, :3]

    def _amount(self, geom: Geom) -> tuple[str, float]:
        """Returns whether mass or density of a geom is given, and its value."""
        key = "mass" if "mass" in geom.values else "density"
        return key, self.mj.numbers(geom.element, geom.values, key, 1, str(DENSITY))[0]

    def _mass(self, geom: Geom) -> Mass:
        key, amount = self._amount(geom)
        if geom.values.get("shellinertia") == "true":
            self.omitted["'shellinertia' of <geom>"] += 1
        if amount == 0:
            return Mass()
        exact = geom.rule == "exact"
        try:
            solid = body_of(geom.solid, partial(mesh_body, first_object=True) if exact else mujoco_mesh_body)
        except UserError as error:
            raise self.mj.error(geom.element, str(error)) from None
        faces = obj_faces(geom.solid.file)
        if faces and faces.objects > 1:
            self.omitted["objects after the first one of an OBJ file, in mass and inertia, as in MuJoCo"] += faces.objects - 1
        if faces and faces.large_faces:
            self.draft.doubts.append(
                f"{self.mj.place(geom.element)}: mass and inertia of the mesh may differ from MuJoCo's, which splits faces with more than "
                f"four corners into other triangles or drops them ({faces.large_faces} x)"
            )
        if geom.rule not in ("", "legacy", "exact"):
            self.omitted[f'inertia="{geom.rule}" of <mesh>, computed as legacy'] += 1
        if exact and is_open(geom.solid.file):
            self.draft.doubts.append(f"{self.mj.place(geom.element)}: the mesh is not closed; its mass is that of its bounding box")
        return solid.scaled(amount / solid.mass if key == "mass" else amount)

    def _limit_masses(self) -> None:
        """Applies boundmass, boundinertia, balanceinertia and settotalmass of the compiler."""
        own = [body for name, body in self.bodies.items() if name in self.shift and name != WORLD]
        least, least_inertia = (self.mj.setting(key, 1, "0")[0] for key in ("boundmass", "boundinertia"))
        for body in own:
            body.mass = max(body.mass, least)
            values, axes = np.linalg.eigh(body.inertia)
            values = np.maximum(values, least_inertia)
            if self.mj.flag("balanceinertia", False) and 2 * values.max() > values.sum():
                values = np.full(3, values.mean())
            if not np.allclose(values, np.linalg.eigvalsh(body.inertia), rtol=1e-12, atol=0):
                body.inertia = axes @ np.diag(values) @ axes.T
        total, wanted = sum(body.mass for body in own), self.mj.setting("settotalmass", 1, "-1")[0]
        for body in own if wanted > 0 else ():
            body.mass, body.inertia = body.mass * wanted / total, body.inertia * wanted / total


def _referred(scale: list[float], reference: np.ndarray) -> tuple[list[float], np.ndarray]:
    """Returns scale and pose of a mesh that MuJoCo shifts and turns to its reference and then scales.

    The scale is a matrix of 9 numbers, by rows, where it shears the turned mesh.
    """
    turn = reference[:3, :3].T
    matrix = np.diag(scale) @ turn
    own = turn.T @ matrix
    at = -matrix @ reference[:3, 3]
    if float(np.abs(own - np.diag(np.diag(own))).max()) > 1e-12 * max(map(abs, scale)):
        return [float(x) for x in matrix.ravel()], transform(None, at)
    return [float(x) for x in np.diag(own)], transform(turn, at)


def _distinct(inertia: np.ndarray) -> bool:
    """Returns whether no two principal moments are equal."""
    moments = np.linalg.eigvalsh(inertia)
    return bool(np.diff(moments).min() > DISTINCT * moments[-1])
