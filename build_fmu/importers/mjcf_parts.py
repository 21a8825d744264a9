"""Converts what an MJCF file contains besides its bodies: equality constraints, tendons, actuators, keyframes and shapes."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator

import numpy as np
from lxml import etree

from build_fmu.errors import UserError, did_you_mean, listed, named
from build_fmu.importers.draft import GROUND, DraftLink, DraftTie
from build_fmu.importers.mjcf_bodies import Joint, Tree
from build_fmu.importers.mjcf_file import elements, of_quaternion, quaternion_of
from build_fmu.importers.rigid import inverse, position_and_angles, start_poses, transform
from build_fmu.importers.tree import TreeLayout

DRAWN = ("box", "cylinder", "sphere", "capsule", "mesh")
HIDDEN = 3  # group from which on MuJoCo's viewer does not draw geoms


class Parts:
    """The remaining content of the file, added to the draft of a layout."""

    def __init__(self, tree: Tree, layout: TreeLayout) -> None:
        self.tree, self.layout, self.mj, self.draft = tree, layout, tree.mj, layout.draft
        self.links = {link.name: link for link in self.draft.links}
        self.joints = {joint.name: joint for joint in tree.joints}

    def link_of(self, joint: str) -> DraftLink:
        """Returns the link of a joint of the file."""
        return self.links[self.layout.called[self.joints[joint].link]]

    def frame_of(self, element: etree._Element, body: str) -> tuple[str, np.ndarray]:
        """Returns the link of a body and the pose of the body's frame in it."""
        if body not in self.tree.shift:
            raise self.mj.error(element, f"unknown body '{body}'{did_you_mean(body, self.tree.shift)}")
        return self.layout.called[body], self.layout.own[body] @ self.tree.shift[body]

    def add_equalities(self) -> None:
        """Converts connect and weld to loops and linear joint constraints to couplings, in the configuration of qpos0."""
        poses = start_poses(self.draft.links)
        made = 0
        for element in (child for section in self.mj.root.findall("equality") for child in elements(section)):
            values = self.mj.attributes(element)
            if values.get("active", "true") == "false":
                self.tree.omitted["inactive equality constraints"] += 1
            elif element.tag in ("joint", "tendon"):
                made += self._linear(element, values)
            elif element.tag in ("connect", "weld"):
                if not self.mj.numbers(element, values, "torquescale", 1, "1")[0]:
                    self.tree.omitted['torquescale="0" of <weld>, which is rigid here'] += 1
                self._loop(element, values, poses)
                made += 1
            else:
                self.tree.omitted[f"<{element.tag}> in <equality>"] += 1
        if made:
            self.draft.doubts.append("equality constraints are rigid here; MuJoCo's are soft (solref, solimp)")

    def _loop(self, element: etree._Element, values: dict[str, str], poses: dict[str, np.ndarray]) -> None:
        ends = []
        if "site1" in values:
            for key in ("site1", "site2"):
                if values.get(key) not in self.tree.sites:
                    raise self.mj.error(element, f"unknown site '{values.get(key, '')}'")
                body, pose = self.tree.sites[values[key]]
                link, frame = self.frame_of(element, body)
                ends.append((link, frame @ pose))
        else:
            (link_a, a), (link_b, b) = (self._end(element, values.get(key, "world")) for key in ("body1", "body2"))
            given = self.mj.numbers(element, values, "relpose", 7, "0 0 0 0 0 0 0")
            if element.tag == "connect":
                a = a @ _moved(self.mj.numbers(element, values, "anchor", 3))
            if element.tag == "weld" and any(given[3:]):
                # the place of relpose on the first body is at the anchor on the second one
                a = a @ _moved(given[:3], of_quaternion(given[3:]))
                b = b @ _moved(self.mj.numbers(element, values, "anchor", 3, "0 0 0"))
            else:
                # the other end is where the first one is at qpos0
                b = inverse(poses[link_b]) @ poses[link_a] @ a
            ends = [(link_a, a), (link_b, b)]
        name = self.layout.names.take(values.get("name", "") or f"{element.tag}_{ends[0][0]}_{ends[1][0]}")
        fields: dict[str, object] = {"type": "spherical" if element.tag == "connect" else "fixed"}
        for side, (link, pose) in zip("ab", ends, strict=True):
            fields |= {f"link_{side}": link, f"point_{side}": [float(x) for x in pose[:3, 3]]}
            if element.tag == "weld":
                fields |= {f"axis_{side}": [float(x) for x in pose[:3, 2]], f"x_{side}": [float(x) for x in pose[:3, 0]]}
        self.draft.loops.append(DraftTie(name, fields))

    def _end(self, element: etree._Element, body: str) -> tuple[str, np.ndarray]:
        """Returns the link of a body and the pose of the frame in which MuJoCo states the ends of constraints."""
        link, frame = self.frame_of(element, body)
        return link, frame @ self.tree.frame_of(body)

    def _linear(self, element: etree._Element, values: dict[str, str]) -> int:
        """Converts a linear constraint of joints or fixed tendons to a coupling, of one joint to a locked one; returns how many."""
        sides = [self._terms(element, values[key]) for key in (f"{element.tag}1", f"{element.tag}2") if key in values]
        factors = (self.mj.numbers(element, values, "polycoef", None, "0 1 0 0 0") + [0.0] * 5)[:5]
        if None in sides or (len(sides) == 2 and any(factors[2:])):
            self.tree.omitted[f"nonlinear <{element.tag}> in <equality>"] += 1
            return 0
        ratios: Counter[str] = Counter()
        for terms, sign in zip(sides, (1.0, -factors[1]), strict=False):
            for joint, factor in terms.items():
                ratios[joint] += sign * factor
        ratios = {joint: ratio for joint, ratio in ratios.items() if ratio}
        if not ratios:
            raise self.mj.error(element, f"<{element.tag}> in <equality> constrains no joint")
        dependent = next((joint for joint in ratios if self.link_of(joint).drive != "locked"), "")
        if not dependent:
            self.tree.omitted[f"<{element.tag}> in <equality> of joints that others lock"] += 1
            return 0
        first = self.link_of(dependent)
        first.drive, first.q = "free", self.joints[dependent].ref + factors[0] / ratios[dependent]
        if len(ratios) == 1:
            first.drive = "locked"
            return 1
        offset = factors[0] + sum(ratio * self.joints[joint].ref for joint, ratio in ratios.items())
        fields = {"joints": [self.link_of(joint).joint_name for joint in ratios], "ratios": list(ratios.values()), "offset": offset}
        name = self.layout.names.take(values.get("name", "") or f"{first.joint_name}_equality")
        self.draft.couplings.append(DraftTie(name, {key: value for key, value in fields.items() if value}))
        return 1

    def _terms(self, element: etree._Element, name: str) -> dict[str, float] | None:
        """Returns the factors of the joints in a joint or fixed tendon of this name; None: not linear in hinge and slide joints."""
        if element.tag == "joint":
            return self._factors(element, [(name, 1.0)])
        tendons = {child.get("name"): child for section in self.mj.root.findall("tendon") for child in elements(section)}
        if name not in tendons:
            raise self.mj.error(element, f"unknown tendon '{name}'{did_you_mean(name, filter(None, tendons))}")
        return self._of_fixed(tendons[name]) if tendons[name].tag == "fixed" else None

    def _of_fixed(self, tendon: etree._Element) -> dict[str, float] | None:
        parts = [(child.get("joint", ""), self.mj.numbers(child, child.attrib, "coef", 1)[0]) for child in elements(tendon)]
        return self._factors(tendon, parts)

    def _factors(self, element: etree._Element, parts: list[tuple[str, float]]) -> dict[str, float] | None:
        found: Counter[str] = Counter()
        for name, factor in parts:
            if self._joint(element, name).kind not in ("hinge", "slide"):
                return None
            found[name] += factor
        return found

    def _joint(self, element: etree._Element, name: str) -> Joint:
        if name not in self.joints:
            raise self.mj.error(element, f"unknown joint '{name}'{did_you_mean(name, self.joints)}")
        return self.joints[name]

    def add_tendons(self) -> None:
        """Converts springs and dampers of fixed tendons to elastic couplings."""
        for element in (child for section in self.mj.root.findall("tendon") for child in elements(section)):
            values = self.mj.attributes(element)
            given = {key: self.mj.numbers(element, values, key, None, "0") or [0.0] for key in ("stiffness", "damping")}
            stiffness, damping = (amounts[0] for amounts in given.values())
            for key, amounts in given.items():
                self.tree.omitted[f"nonlinear {key} of tendons"] += any(amounts[1:])
            if element.tag != "fixed":
                self.tree.omitted[f"<{element.tag}> tendons"] += 1
                continue
            for key in ("limited", "frictionloss", "armature"):
                if values.get(key, "0") not in ("0", "false", "auto") or (key == "limited" and "range" in values):
                    self.tree.omitted[f"'{key}' of tendons"] += 1
            parts = self._of_fixed(element)
            if not stiffness:
                self.tree.omitted["damping of tendons without stiffness"] += bool(damping)
                continue
            if parts is None or len(parts) < 2:
                self.tree.omitted["springs of tendons over one joint, or over others than hinge and slide joints"] += 1
                continue
            rest = self.mj.numbers(element, values, "springlength", None, "-1")
            # without a length (-1): at rest where the springs of its joints are
            own = sum(factor * self.joints[name].spring for name, factor in parts.items())
            low, high = (own, own) if all(length == -1 for length in rest) else (rest[0], rest[-1])
            self.tree.omitted["<fixed> tendon with a range of lengths at rest: onset is smooth, no damping in it"] += high > low
            fields = {"joints": [self.link_of(name).joint_name for name in parts], "ratios": list(parts.values())}
            fields |= {"offset": (low + high) / 2, "stiffness": stiffness, "damping": damping, "backlash": high - low}
            name = self.layout.names.take(values.get("name", "") or "tendon")
            self.draft.couplings.append(DraftTie(name, {key: value for key, value in fields.items() if value}))

    def _actuators(self) -> Iterator[tuple[etree._Element, dict[str, str], str]]:
        """Yields element, attributes and hinge or slide joint of each actuator; "": it acts on something else."""
        for element in (child for section in self.mj.root.findall("actuator") for child in elements(section)):
            values = self.mj.attributes(element)
            joint = values.get("joint") or values.get("jointinparent") or ""
            single = joint and self._joint(element, joint).kind in ("hinge", "slide")
            yield element, values, joint if single else ""

    def _gear(self, element: etree._Element, values: dict[str, str]) -> float:
        return (self.mj.numbers(element, values, "gear", None, "1") or [1.0])[0]

    def add_rotors(self) -> None:
        """Adds armature and damping of the actuators to their joints."""
        for element, values, joint in self._actuators():
            for key in ("armature", "damping") if joint else ():
                first, *others = self.mj.numbers(element, values, key, None, "0") or [0.0]
                self.tree.omitted[f"nonlinear {key} of <{element.tag}>"] += any(others)
                link = self.link_of(joint)
                setattr(link, key, getattr(link, key) + self._gear(element, values) ** 2 * first)

    def add_actuators(self, limits: bool) -> None:
        """Gives the joints with an actuator a torque input and the others none, and lists other effects of the actuators."""
        found = list(self._actuators())
        if not found:
            if any(joint.kind != "free" for joint in self.tree.joints):
                self.draft.doubts.append("the file has no actuators: hinge, slide and ball joints have torque inputs")
            return
        driven, bounds, servos, geared = [], {}, [], []
        for element, values, joint in found:
            if not joint:
                where = next((key for key in ("tendon", "site", "body", "cranksite") if key in values), "joint that is a ball or free one")
                self.tree.omitted[f"<{element.tag}> on a {where}"] += 1
                continue
            driven.append(joint)
            gear = self._gear(element, values)
            if element.tag != "motor":
                servos.append(f"{joint} (<{element.tag}>)")
            elif gear != 1:
                geared.append(f"{joint} ({gear:g})")
            bounds[joint] = bounds.get(joint, 0.0) + self._range(element, values, gear)
        own = {self.layout.called[self.joints[name].link] for name in driven}
        for link in self.draft.links:
            if link.joint != "fixed" and link.drive != "locked":
                link.drive = "torque" if link.name in own else "free"
        bounds = {joint: both for joint, both in bounds.items() if np.isfinite(both).all() and both.any()}
        for joint, both in bounds.items() if limits else ():
            if self.link_of(joint).drive == "torque":
                most = float(np.abs(both).max())
                self.draft.actuators.append(DraftTie("", {"joint": self.link_of(joint).joint_name, "torque_limit": most}))
        uneven = [joint for joint, both in bounds.items() if both.sum()]
        if bounds and not limits:
            self.draft.lost.append(f"the ranges of the actuators of {listed(list(bounds))}: --limits converts them to torque limits")
        elif uneven:
            self.draft.lost.append(f"the smaller bounds of the actuators of {listed(uneven)}: a torque limit acts in both directions")
        if geared:
            self.draft.doubts.append(
                f"inputs are torques or forces on the joint, gear times control: the gears of {listed(geared)} are omitted"
            )
        if servos:
            self.draft.lost.append(
                f"the laws of the actuators of {listed(servos)}: the input is the torque on the joint; add a [controller]"
            )

    def _range(self, element: etree._Element, values: dict[str, str], gear: float) -> np.ndarray:
        """Returns the bounds of the torque on the joint."""
        both = np.array([-np.inf, np.inf])
        for key, flag, usable in (("ctrlrange", "ctrllimited", element.tag == "motor"), ("forcerange", "forcelimited", True)):
            limits = self.mj.limits(element, values, key, flag)
            if usable and limits:
                both = np.array([max(both[0], limits[0]), min(both[1], limits[1])])
        return np.sort(both * gear) if gear else np.zeros(2)

    def add_shapes(self) -> None:
        """Converts visible geoms to shapes."""
        materials = {m.get("name"): self.mj.attributes(m).get("rgba") for m in self.mj.root.findall("asset/material")}
        hidden = 0
        for geom in self.tree.geoms:
            if self.mj.whole(geom.element, geom.values, "group", 0) >= HIDDEN:
                hidden += 1
                continue
            if geom.solid is None or geom.kind not in DRAWN:
                self.tree.omitted[f"drawing of <geom> of type {geom.kind}"] += geom.kind not in ("plane", "mesh")
                continue
            if geom.kind == "mesh" and len(geom.solid.size) == 9:
                self.tree.omitted["drawing of <mesh> with 'refquat' and an unequal 'scale', which shears it"] += 1
                continue
            link, frame = self.frame_of(geom.element, geom.body)
            position, angles = position_and_angles(frame @ geom.solid.pose)
            fields: dict[str, object] = {"link": link, "kind": geom.kind}
            if geom.kind == "mesh":
                fields |= {"file": geom.solid.file} | ({"size": list(geom.solid.size)} if list(geom.solid.size) != [1, 1, 1] else {})
            else:
                fields["size"] = list(geom.solid.size)
            fields |= {key: value for key, value in (("position", position), ("rpy", angles)) if any(value)}
            colour = geom.values.get("rgba") or materials.get(geom.values.get("material", ""))
            if colour:
                rgba = [min(max(x, 0.0), 1.0) for x in self.mj.numbers(geom.element, {"rgba": colour}, "rgba", 4)]
                fields["color"] = rgba[:3] if rgba[3:] in ([], [1.0]) else rgba
            self.draft.shapes.append(DraftTie("", fields))
        if hidden:
            self.draft.lost.append(f"drawing of {hidden} <geom> of group {HIDDEN} or higher, which are collision shapes")

    def add_keyframe(self, wanted: str | None) -> None:
        """Sets the start state of a keyframe; without a wanted one, lists those of the file."""
        keys = {k.get("name") or f"{i}": k for i, k in enumerate(self.mj.root.findall("keyframe/key"))}
        if wanted is None:
            if keys:
                self.draft.doubts.append(f"the start configuration is qpos0; --keyframe selects one of: {listed(list(keys))}")
            return
        if wanted not in keys:
            raise UserError(f"--keyframe: unknown keyframe '{wanted}'{did_you_mean(wanted, keys) or named(keys)}")
        key = keys[wanted]
        self._report_key(key, wanted)
        sizes = {"free": (7, 6), "ball": (4, 3)}
        counts = [sizes.get(joint.kind, (1, 1)) for joint in self.tree.joints]
        qpos = self.mj.numbers(key, key.attrib, "qpos", sum(n for n, _ in counts)) if "qpos" in key.attrib else None
        qvel = self.mj.numbers(key, key.attrib, "qvel", sum(n for _, n in counts)) if "qvel" in key.attrib else None
        poses, at, rate = start_poses(self.draft.links), 0, 0
        for joint, (n, m) in zip(self.tree.joints, counts, strict=True):
            link = self.link_of(joint.name)
            frame = self.tree.frame_of(joint.link) if joint.kind == "free" else np.eye(4)
            if qpos is not None:
                link.q = self._position(joint.kind, qpos[at : at + n], poses[link.name], frame)
            if qvel is not None:
                turned = of_quaternion(link.q[3:]) if joint.kind == "free" and qpos is not None else np.eye(3)
                link.qd = self._velocity(joint.kind, qvel[rate : rate + m], poses[link.name], turned, frame)
            at, rate = at + n, rate + m

    def _report_key(self, key: etree._Element, name: str) -> None:
        """Lists the contents of a keyframe other than positions and velocities, if they have an effect in MuJoCo."""
        given = {part: self.mj.numbers(key, key.attrib, part, None) for part in ("ctrl", "act", "mpos", "mquat") if part in key.attrib}
        moved = any(body.get("mocap") == "true" for body in self.mj.root.iterfind("worldbody//body"))
        lost = [part for part, values in given.items() if (moved if part.startswith("m") else any(values))]
        if lost:
            inputs = ": inputs start at 0" if "ctrl" in lost else ""
            self.draft.lost.append(f"{self.mj.place(key)}: {listed([repr(part) for part in lost])} of <key> '{name}'{inputs}")

    @staticmethod
    def _position(kind: str, values: list[float], pose: np.ndarray, frame: np.ndarray) -> float | list[float]:
        """Returns the position of a joint; of a free one by the world pose of `frame`, which is fixed in the body at `pose`."""
        if kind != "free":
            return values[0] if len(values) == 1 else [float(x) for x in np.array(values) / np.linalg.norm(values)]
        turn, own = pose[:3, :3].T, transform(of_quaternion(values[3:]), values[:3]) @ inverse(frame)
        return [*map(float, turn @ (own[:3, 3] - pose[:3, 3])), *quaternion_of(turn @ own[:3, :3])]

    @staticmethod
    def _velocity(kind: str, values: list[float], pose: np.ndarray, turned: np.ndarray, frame: np.ndarray) -> float | list[float]:
        """Returns the velocity of a joint; of a free one, `turned` from `pose`, by that of the origin of `frame` and about its axes."""
        if kind != "free":
            return values[0] if len(values) == 1 else list(values)
        omega = frame[:3, :3] @ values[3:]
        return [*map(float, pose[:3, :3].T @ values[:3] - turned @ np.cross(omega, frame[:3, 3])), *map(float, omega)]

    def add_frames(self) -> None:
        """Converts sites to frames."""
        for name, (body, pose) in self.tree.sites.items():
            link, frame = self.layout.called[body], self.layout.own[body] @ self.tree.shift[body] @ pose
            if link != GROUND:
                position, angles = position_and_angles(frame)
                self.draft.frames.append(DraftTie(self.layout.names.take(name), {"link": link, "position": position, "rpy": angles}))


def _moved(position: list[float], turn: np.ndarray | None = None) -> np.ndarray:
    pose = np.eye(4)
    pose[:3, 3] = position
    if turn is not None:
        pose[:3, :3] = turn
    return pose
