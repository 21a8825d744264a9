"""Parses an SDF file and restates its model as a URDF tree, whose link frames are those of the joints (docs/sdf.md)."""

from __future__ import annotations

import math
from argparse import Namespace
from collections import Counter
from collections.abc import Iterator
from copy import deepcopy
from dataclasses import dataclass
from itertools import chain, count
from pathlib import Path

import numpy as np
from lxml import etree

from build_fmu.errors import UserError, did_you_mean, listed
from build_fmu.importers.mjcf_file import elements, of_quaternion
from build_fmu.importers.rigid import inverse, transform
from build_fmu.importers.urdf_actuators import DRAKE
from build_fmu.importers.urdf_file import Urdf, parsed

MODEL, WORLD = "__model__", "world"
# the children of each element that are read
READ = {
    "sdf": ("model", "world"),
    "world": ("model", "gravity"),
    "model": ("pose", "link", "joint", "frame", "static"),
    "link": ("pose", "inertial", "visual", "collision"),
    "frame": ("pose",),
    "inertial": ("pose", "mass", "inertia"),
    "inertia": ("ixx", "iyy", "izz", "ixy", "ixz", "iyz"),
    "visual": ("pose", "geometry", "material"),
    "collision": ("pose", "geometry"),
    "material": ("diffuse",),
    "joint": ("pose", "parent", "child", "axis", "axis2", *DRAKE),
    "axis": ("xyz", "use_parent_model_frame", "dynamics", "limit", "mimic"),
    "dynamics": ("damping", "friction", "spring_reference", "spring_stiffness"),
    "limit": ("lower", "upper", "effort", "velocity"),
    "mimic": ("multiplier", "offset", "reference"),
}
READ["axis2"] = READ["axis"]
SIZES = {"box": ("size",), "sphere": ("radius",), "cylinder": ("radius", "length"), "capsule": ("radius", "length")}
LOOPS = {"revolute": "revolute", "continuous": "revolute", "prismatic": "prismatic", "fixed": "fixed", "ball": "spherical"}
KINDS = (*LOOPS, "universal")
# elements of <axis> without effect on joints without an axis; limits and friction of a fixed joint have no effect
UNMOVED = {"fixed": ("mimic",), "ball": ("dynamics", "limit", "mimic")}
GEARBOX = ("gearbox_ratio", "gearbox_reference_body")
# correct, but not read
OTHER = ("plugin", "sensor", "light", "surface", "self_collide", "gripper", "include", "audio_source", *GEARBOX)
UNLIMITED = 1e15  # a larger limit means no limit


@dataclass
class Closing:
    """A joint whose child has another joint already: poses in the frames of both links (of the URDF), and the direction of its axis."""

    name: str
    kind: str
    links: tuple[str, str]
    poses: tuple[np.ndarray, np.ndarray]
    axis: np.ndarray


class Sdf(Urdf):
    """A URDF made of the first model of an SDF file. Lines are those of the SDF; poses are exact."""

    source = "SDF"

    def __init__(self, path: Path, options: Namespace) -> None:
        super().__init__(path, etree.Element("robot"), options.snap)
        self.file = parsed(path, path.read_bytes())
        if self.file.tag != "sdf":
            raise UserError(f"{path}: the root element must be <sdf>, got <{self.file.tag}>")
        if _version(self.file)[0] != 1:
            raise self.error(self.file, f"version '{self.file.get('version')}' is not supported: expected 1.3 to 1.11")
        self.lost: list[str] = []
        self.doubts: list[str] = []
        self.closing: list[Closing] = []
        self.parts: dict[str, str] = {}  # names of parts of universal joints
        self.poses: dict[etree._Element, np.ndarray] = {}
        self.massless = options.density is not None or options.mass is not None
        self.gravity = [0.0, 0.0, -9.8]
        self.model = self._model()
        self._frames()
        self.root.set("name", self.model.get("name", ""))
        self._links()
        self._joints()
        self._losses()

    def pose(self, parent: etree._Element) -> np.ndarray:
        """Returns the pose of a generated element."""
        return self.poses.get(parent, np.eye(4))

    def _model(self) -> etree._Element:
        worlds = [*self.file.findall("world"), self.file]
        models = [model for world in worlds for model in world.findall("model")]
        moving = [model for model in models if not _is_true(_text(model, "static", "false"))]
        if not moving:
            raise UserError(f"{self.path}: no <model> that can move")
        others = [model.get("name", "") for model in models if model is not moving[0]]
        if others:
            self.lost.append(f"the models {', '.join(others)}: one model is imported, '{moving[0].get('name', '')}'")
        for world in moving[0].iterancestors("world"):
            gravity = world.find("gravity")
            if gravity is None and _version(self.file) < (1, 6):
                gravity = world.find("physics/gravity")
            if gravity is not None:
                self.gravity = self._values(gravity, 3)
        return moving[0]

    def _frames(self) -> None:
        """Fills `places`: by name the element and the default reference of its pose."""
        self.places: dict[str, tuple[etree._Element, str]] = {}
        for tag in ("link", "joint", "frame"):
            for element in self.model.findall(tag):
                name = self.name(element)
                if name in self.places or name in (MODEL, WORLD):
                    raise self.error(element, f"duplicate name '{name}'" if name in self.places else f"'{name}' is a reserved name")
                default = self._name(element, "child") if tag == "joint" else element.get("attached_to", "") if tag == "frame" else ""
                self.places[name] = element, default or MODEL
        self.known: dict[str, np.ndarray] = {WORLD: np.eye(4), MODEL: np.eye(4)}
        # the pose of the model is that of its placement frame
        placed = self.place(self.model.get("placement_frame") or MODEL, self.model)
        self.known = {WORLD: np.eye(4), MODEL: self._own_pose(self.model) @ inverse(placed)}
        if self._relative_to(self.model) not in ("", WORLD):
            self.lost.append(f"the place of '{self._relative_to(self.model)}', to which the <pose> of the model is relative")

    def place(self, name: str, by: etree._Element, seen: tuple[str, ...] = ()) -> np.ndarray:
        """Returns the pose of a link, joint or frame in the world."""
        if name not in self.known:
            if name in seen:
                raise self.error(by, f"cyclic references of poses: {', '.join((*seen[seen.index(name) :], name))}")
            if name not in self.places:
                raise self.error(by, self._unknown("frame", name))
            element, default = self.places[name]
            base = self._relative_to(element) or default
            self.known[name] = self.place(base, element, (*seen, name)) @ self._own_pose(element)
        return self.known[name]

    def _unknown(self, what: str, name: str) -> str:
        """Returns the reason why a name is not found."""
        unknown = f"unknown {what} '{name}'"
        if "::" in name or self.model.find("include") is not None:
            return f"{unknown}: included and nested models are not supported; copy their links and joints into the model"
        return f"{unknown}{did_you_mean(name, self.places)}"

    def link_of(self, name: str, by: etree._Element, seen: tuple[str, ...] = ()) -> str:
        """Returns the link at an end of a joint: the named link, or the one that the named frame or joint is attached to."""
        if name == WORLD:
            return WORLD
        if name == MODEL and name not in seen:
            return self.link_of(self._canonical(), by, (*seen, name))
        if name not in self.places or name in seen:
            raise self.error(by, f"joint '{by.get('name')}': {self._unknown('link', name)}")
        element, base = self.places[name]
        if element.tag == "link":
            return name
        return self.link_of(base, by, (*seen, name))

    def _canonical(self) -> str:
        return self.model.get("canonical_link") or next((link.get("name") for link in self.model.findall("link")), "")

    def _links(self) -> None:
        """Adds the links; their frames are those of the first joint with this child."""
        names = [link.get("name") for link in self.model.findall("link")]
        self.frame = {WORLD: np.eye(4)} | {name: self.place(name, self.model) for name in names}
        self.ends: list[tuple[etree._Element, str, str, bool]] = []  # joint, parent, child, whether it closes a loop
        for joint in self.model.findall("joint"):
            parent, child = (self.link_of(self._name(joint, tag), joint) for tag in ("parent", "child"))
            if child == WORLD:
                raise self.error(joint, f"joint '{joint.get('name')}': the child must be a link, not the world")
            if self.text(joint, "type") == "gearbox":
                line = f"{self.shown}:{joint.sourceline}"
                self.lost.append(f"{line}: joint '{joint.get('name')}' of type gearbox: add a [[coupling]]")
                continue
            closes = any(end[2] == child and not end[3] for end in self.ends)
            self.ends.append((joint, parent, child, closes))
            if not closes:
                self.frame[child] = self.place(joint.get("name"), joint)
        for link in self.model.findall("link"):
            name = link.get("name")
            element = self._add(self.root, link, "link", name=name)
            self._inertial(link, element, name)
            for tag in ("visual", "collision"):
                for shape in link.findall(tag):
                    self._shape(shape, element, name)

    def _add(self, parent: etree._Element, source: etree._Element, tag: str, **attributes: str) -> etree._Element:
        element = etree.SubElement(parent, tag, **attributes)
        element.sourceline = source.sourceline
        return element

    def _inside(self, element: etree._Element, link: str) -> np.ndarray:
        """Returns the pose of a part of a link in the frame of the URDF's link."""
        base = self.place(self._relative_to(element) or link, element)
        return inverse(self.frame[link]) @ base @ self._own_pose(element)

    def _inertial(self, link: etree._Element, target: etree._Element, name: str) -> None:
        inertial = link.find("inertial")
        if inertial is not None and _is_true(inertial.get("auto", "")):
            self.lost.append(f"{self.shown}:{inertial.sourceline}: automatic inertia of '{name}': --density computes it by the shapes")
            return
        if inertial is None:
            if self.massless:
                return
            default = "1 kg and 1 kg m2, the default of SDF; --density computes it by the shapes"
            self.doubts.append(f"link '{name}' has no <inertial>: {default}")
        element = self._add(target, link if inertial is None else inertial, "inertial")
        tensor = None if inertial is None else inertial.find("inertia")
        six = {key: _text(tensor, key, str(float(key[1] == key[2]))) for key in READ["inertia"]}
        self._add(element, element, "mass", value=_text(inertial, "mass", "1"))
        self._add(element, element, "inertia", **six)
        home = inverse(self.frame[name]) @ self.place(name, link)
        self.poses[element] = home if inertial is None else self._inside(inertial, name)

    def _shape(self, shape: etree._Element, target: etree._Element, link: str) -> None:
        element = self._add(target, shape, shape.tag)
        self.poses[element] = self._inside(shape, link)
        geometry = self._add(element, shape, "geometry")
        for one in (part for outer in shape.findall("geometry") for part in elements(outer)):
            kind = one.tag.removeprefix("drake:")
            keys = {"uri": "filename", "scale": "scale"} if kind == "mesh" else {key: key for key in SIZES.get(kind, ())}
            given = {new: _text(one, old, "") for old, new in keys.items() if one.find(old) is not None}
            self._add(geometry, one, kind, **given)
            if one.find("submesh") is not None:
                self.lost.append(f"{self.shown}:{one.sourceline}: <submesh>: the whole mesh is drawn")
        colour = shape.findtext("material/diffuse")
        if colour:
            words = colour.split()
            material = self._add(element, shape, "material")
            self._add(material, shape, "color", rgba=" ".join([*words, "1"][:4] if len(words) == 3 else words))

    def _joints(self) -> None:
        held = {child for _, _, child, _ in self.ends}
        for link in self.model.findall("link"):
            if link.get("name") not in held:
                self._joint(link, link.get("name"), "floating", WORLD, link.get("name"))
        for joint, parent, child, closes in self.ends:
            name, kind = joint.get("name"), self.text(joint, "type")
            if kind not in (LOOPS if closes else KINDS):
                supported = ", ".join(LOOPS if closes else KINDS)
                where = " that closes a loop" if closes else ""
                raise self.error(joint, f"joint '{name}'{where}: unsupported type '{kind}'; supported: {supported}")
            elif closes:
                inner = [*joint.iterfind("axis/*"), *joint]
                forces = [part.tag for part in inner if part.tag in ("dynamics", "limit", "mimic", *DRAKE)]
                if forces:
                    self.lost.append(f"{self.shown}:{joint.sourceline}: {listed(forces)} of '{name}', which closes a loop")
                at = self.place(name, joint)
                poses = tuple(inverse(self.frame[end]) @ at for end in (parent, child))
                axis = self._axis(joint, "axis", at) if joint.find("axis") is not None else np.array([0.0, 0, 1])
                self.closing.append(Closing(name, LOOPS[kind], (parent, child), poses, axis))
            elif kind == "universal":
                cross = self._add(self.root, joint, "link", name=self._part(name, "cross")).get("name")
                self.frame[cross] = self.frame[child]
                self._moving(joint, "axis", self._joint(joint, self._part(name, "1"), "revolute", parent, cross))
                self._moving(joint, "axis2", self._joint(joint, self._part(name, "2"), "revolute", cross, child))
                rotor = [part.tag for part in joint if part.tag in DRAKE]
                if rotor:
                    self.lost.append(
                        f"{self.shown}:{joint.sourceline}: {listed(rotor)} of '{name}': a universal joint has no drive in Drake"
                    )
            else:
                element = self._joint(joint, name, kind, parent, child)
                if kind in UNMOVED:
                    found = [part.tag for part in joint.iterfind("axis/*") if part.tag in UNMOVED[kind]]
                    if found:
                        self.lost.append(f"{self.shown}:{joint.sourceline}: {listed(found)} of '{name}': not supported for {kind} joints")
                else:
                    self._moving(joint, "axis", element)
                self._transmission(joint)

    def _joint(self, source: etree._Element, name: str, kind: str, parent: str, child: str) -> etree._Element:
        element = self._add(self.root, source, "joint", name=name, type=kind)
        self._add(element, source, "parent", link=parent)
        self._add(element, source, "child", link=child)
        self.poses[element] = inverse(self.frame[parent]) @ self.frame[child]
        return element

    def _part(self, joint: str, what: str) -> str:
        """Returns the name of a part of a universal joint; no link, joint or frame of the file has it."""
        wanted = f"{joint}_{what}"
        if wanted not in self.parts:
            names = chain([wanted], (f"{wanted}_{i}" for i in count(2)))
            self.parts[wanted] = next(name for name in names if name not in self.places and name not in self.parts.values())
        return self.parts[wanted]

    def _transmission(self, joint: etree._Element) -> None:
        """Adds Drake's gear ratio and rotor inertia."""
        found = {part.tag: part for part in reversed(joint) if part.tag in DRAKE}
        if not found:
            return
        transmission = self._add(self.root, joint, "transmission")
        self._add(transmission, joint, "joint", name=joint.get("name"))
        actuator = self._add(transmission, joint, "actuator")
        for part in map(deepcopy, found.values()):
            part.set("value", repr(self._values(part, 1)[0]))
            actuator.append(part)

    def _moving(self, joint: etree._Element, tag: str, target: etree._Element) -> None:
        """Adds axis, dynamics, limits and mimic."""
        axis, name = joint.find(tag), target.get("name")
        direction = self._axis(joint, tag, self.place(joint.get("name"), joint))
        self._add(target, joint, "axis", xyz=" ".join(repr(float(x)) for x in direction))
        for dynamics in axis.findall("dynamics"):
            self._add(target, dynamics, "dynamics", damping=_text(dynamics, "damping", "0"), friction=_text(dynamics, "friction", "0"))
            stiffness, rest = (self._number(dynamics, f"spring_{key}", "0") for key in ("stiffness", "reference"))
            if stiffness:
                self.springs[name] = stiffness, rest
        for limit in axis.findall("limit"):
            low, high = (self._number(limit, key, default) for key, default in (("lower", "-1e16"), ("upper", "1e16")))
            both = abs(low) < UNLIMITED and abs(high) < UNLIMITED
            if (abs(low) < UNLIMITED) != (abs(high) < UNLIMITED):
                self.lost.append(f"{self.shown}:{limit.sourceline}: the limit of '{name}', which has one on one side only")
            bounds = {"lower": repr(low), "upper": repr(high)} if both else {}
            most = {key: self._number(limit, key, "inf") for key in ("effort", "velocity")}
            # a negative value means no limit
            bounds |= {key: repr(x) for key, x in most.items() if 0 <= x < UNLIMITED}
            self._add(target, limit, "limit", **bounds)
        for mimic in axis.findall("mimic"):
            factor, offset, reference = (self._number(mimic, key, "01"[key == "multiplier"]) for key in READ["mimic"])
            leader = self._leader(mimic, name)
            if not leader:
                continue
            values = {"joint": leader, "multiplier": repr(factor), "offset": repr(offset - factor * reference)}
            self._add(target, mimic, "mimic", **values)

    def _leader(self, mimic: etree._Element, name: str) -> str:
        """Returns the joint of the URDF that <mimic> of the joint `name` follows; lists a <mimic> of an axis that does not exist."""
        leader, axis = self.text(mimic, "joint"), mimic.get("axis", "axis")
        ends = next((end for end in self.ends if end[0].get("name") == leader), None)
        if ends is None:
            return leader  # reported as unknown later
        universal, reason = ends[0].get("type") == "universal", ""
        if axis not in ("axis", "axis2")[: 2 if universal else 1]:
            reason = f"'{leader}' has no <{axis}>"
        elif ends[3]:
            reason = f"'{leader}' closes a loop"
        if reason:
            self.lost.append(f"{self.shown}:{mimic.sourceline}: <mimic> of '{name}': {reason}")
            return ""
        return self._part(leader, "12"[axis == "axis2"]) if universal else leader

    def _axis(self, joint: etree._Element, tag: str, frame: np.ndarray) -> np.ndarray:
        """Returns the unit vector of an axis in the frame of the joint."""
        axis = joint.find(tag)
        if axis is None:
            raise self.error(joint, f"joint '{joint.get('name')}' has no <{tag}>")
        xyz = axis.find("xyz")
        values = np.array([0.0, 0, 1] if xyz is None else self._values(xyz, 3))
        length = float(np.linalg.norm(values))
        if length < 1e-9:
            raise self.error(axis, f"joint '{joint.get('name')}': the axis is zero")
        values = values / length if abs(length - 1) > 1e-15 else values
        old = "true" if _version(self.file) < (1, 5) else "false"
        inside = _is_true(_text(axis, "use_parent_model_frame", old))
        base = "" if xyz is None else xyz.get("expressed_in", "")
        base = base or (MODEL if inside else "")
        return frame[:3, :3].T @ self.place(base, axis)[:3, :3] @ values if base else values

    def _relative_to(self, element: etree._Element) -> str:
        pose = element.find("pose")
        return "" if pose is None else pose.get("relative_to") or pose.get("frame") or ""

    def _own_pose(self, element: etree._Element) -> np.ndarray:
        """Returns the transform of <pose>, in its reference."""
        pose = element.find("pose")
        if pose is None or not (pose.text or "").strip():
            return np.eye(4)
        if pose.get("rotation_format") == "quat_xyzw":
            *position, x, y, z, w = self._values(pose, 7)
            if not any((x, y, z, w)):
                raise self.error(pose, "the quaternion of <pose> is zero")
            return transform(of_quaternion([w, x, y, z]), position)
        *position, roll, pitch, yaw = self._values(pose, 6)
        angles = [math.radians(x) if _is_true(pose.get("degrees", "")) else x for x in (roll, pitch, yaw)]
        return transform(self.rotation(pose, angles, pose.text.strip()), position)

    def _values(self, element: etree._Element, count: int) -> list[float]:
        """Returns the numbers of an element's text."""
        words = (element.text or "").split()
        try:
            values = [float(word) for word in words]
        except ValueError:
            values = []
        if len(values) != count or not all(map(math.isfinite, values)):
            what = "a number" if count == 1 else f"{count} numbers"
            raise self.error(element, f"<{element.tag}> must be {what}, got '{(element.text or '').strip()}'")
        return values

    def _number(self, parent: etree._Element, tag: str, default: str) -> float:
        element = parent.find(tag)
        if element is None or (element.text or "").strip().lstrip("+-").lower() in ("inf", "infinity"):
            return float(default)
        return self._values(element, 1)[0]

    def _name(self, element: etree._Element, tag: str) -> str:
        found = element.find(tag)
        if found is None:
            raise self.error(element, f"joint '{element.get('name')}' has no <{tag}>")
        return (found.text or "").strip()

    def _losses(self) -> None:
        """Lists the elements that are not read."""
        tags, first = Counter(), {}
        for parent, child in _unread(self.model):
            tags[parent.tag, child.tag] += 1
            first.setdefault((parent.tag, child.tag), child.sourceline)
        for outer in (self.file, *self.model.iterancestors("world")):
            for child in elements(outer):
                if child.tag not in READ[outer.tag]:
                    tags[outer.tag, child.tag] += 1
                    first.setdefault((outer.tag, child.tag), child.sourceline)
        for (parent, tag), number in tags.items():
            hint = "" if tag in OTHER else did_you_mean(tag, READ[parent])
            self.lost.append(f"{number} x <{tag}> in <{parent}>, first in line {first[parent, tag]}{hint}")


def _unread(parent: etree._Element) -> Iterator[tuple[etree._Element, etree._Element]]:
    """Yields the elements that are not read, with their parents."""
    for child in elements(parent):
        if child.tag not in READ[parent.tag]:
            yield parent, child
        elif child.tag in READ:
            yield from _unread(child)


def _text(parent: etree._Element | None, tag: str, default: str) -> str:
    """Returns the text of a child."""
    return ((parent.findtext(tag) if parent is not None else None) or default).strip()


def _is_true(text: str) -> bool:
    """Returns the value of a Boolean, in letters of any case."""
    return text.strip().lower() in ("true", "1")


def _version(root: etree._Element) -> tuple[int, ...]:
    words = root.get("version", "1.11").split(".")
    return tuple(int(word) if word.isdigit() else 0 for word in words)
