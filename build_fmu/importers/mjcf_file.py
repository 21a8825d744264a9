"""Parses an MJCF file: includes, default classes, compiler settings, checked attributes, orientations. Errors have file and line."""

from __future__ import annotations

import math
from collections.abc import Iterator
from pathlib import Path

import numpy as np
from lxml import etree

from build_fmu.errors import UserError
from build_fmu.importers.rigid import of_quaternion, rotation_x, rotation_y, rotation_z, transform
from build_fmu.importers.urdf_file import parsed

TURNS = {"x": rotation_x, "y": rotation_y, "z": rotation_z}
ACTUATORS = (
    "general", "motor", "position", "velocity", "intvelocity", "damper", "cylinder", "muscle", "adhesion", "plugin", "dcmotor", "pid",
    "orientation",
)  # fmt: skip
ORIENTATIONS = ("quat", "axisangle", "euler", "xyaxes", "zaxis")
WHOLE = ("springlength",)  # one length is both
SHARED = ("actuator", "equality", "tendon")  # all kinds of these have the same defaults
FRAGMENT = "mujocoinclude"  # root of included files
FILE = "__file__"  # attribute of included elements
BOOLEANS = {"true": True, "false": False}


class Mjcf:
    """The parsed file. Attributes of an element include those of its default class; angles are in rad."""

    def __init__(self, path: Path) -> None:
        self.path, self.root = path, parsed(path, path.read_bytes())
        if self.root.tag == FRAGMENT:
            raise UserError(f"{path}: <{FRAGMENT}> is a fragment: import the <mujoco> file that includes it")
        if self.root.tag != "mujoco":
            raise UserError(f"{path}: the root element must be <mujoco>, got <{self.root.tag}>")
        self._include(self.root, path, {path.resolve()})
        self.compiler: dict[str, str] = {}
        for element in self.root.findall("compiler"):
            self.compiler |= element.attrib
        if self.compiler.get("coordinate") == "global":
            raise self.error(
                self.root.find("compiler"), "global coordinates are not supported: MuJoCo 2.3.3 reads the file and saves it with local ones"
            )
        self.degrees = self.compiler.get("angle", "degree") != "radian"
        self.classes: dict[str, dict[str, dict[str, str]]] = {"main": {}}
        for element in self.root.findall("default"):
            self._read_class(element, self.classes["main"], element.get("class", "main"))
            # until MuJoCo 3.1 the top class, which applies to all elements, could have another name
            self.classes["main"] = self.classes[element.get("class", "main")]

    def error(self, element: etree._Element, sentence: str) -> UserError:
        """Returns an exception with file and line."""
        return UserError(f"{self.place(element)}: {sentence}")

    def place(self, element: etree._Element) -> str:
        """Returns `file:line` of an element."""
        file = next((e.get(FILE) for e in (element, *element.iterancestors()) if e.get(FILE)), self.path)
        return f"{file}:{element.sourceline}"

    def flag(self, key: str, default: bool) -> bool:
        """Returns a Boolean setting of the compiler."""
        return BOOLEANS.get(self.compiler.get(key, ""), default)

    def attributes(self, element: etree._Element, inherited: str = "") -> dict[str, str]:
        """Returns the attributes of an element, with those of its class or of the `childclass` that it inherits."""
        name = element.get("class") or inherited or "main"
        if name not in self.classes:
            raise self.error(element, f"unknown default class '{name}'")
        outer = element.getparent().tag
        tag = outer if outer in SHARED else element.tag
        return _over(self.classes[name].get(tag, {}), dict(element.attrib))

    def numbers(self, element: etree._Element, values: dict[str, str], key: str, count: int | None, default: str = "") -> list[float]:
        """Returns the numbers of an attribute; None: any number of them."""
        words = values.get(key, default).split()
        try:
            found = [float(word) for word in words]
        except ValueError:
            found = []
        complete = len(found) == (len(words) if count is None else count)
        if not complete or not all(map(math.isfinite, found)):
            expected = {None: "a list of numbers", 1: "a number"}.get(count, f"{count} numbers")
            expected = expected.replace("number", "finite number") if complete else expected
            raise self.error(element, f"'{key}' of <{element.tag}> must be {expected}, got '{values.get(key, default)}'")
        return found

    def limits(self, element: etree._Element, values: dict[str, str], key: str, flag: str) -> tuple[float, float] | None:
        """Returns the bounds of a range that counts, by its `flag`; None: it has no effect."""
        low, high = self.numbers(element, values, key, 2, "0 0")
        limited = values.get(flag, "auto")
        if limited == "true" and low >= high:
            raise self.error(element, f"'{key}' of <{element.tag}> must be two increasing numbers, got '{values.get(key, '')}'")
        if limited == "auto" and (low or high) and not self.flag("autolimits", True):
            raise self.error(element, f"<{element.tag}> has '{key}' without '{flag}': autolimits=\"false\" requires it")
        return (low, high) if low < high and limited != "false" else None

    def whole(self, element: etree._Element, values: dict[str, str], key: str, default: int) -> int:
        """Returns a whole number."""
        return int(self.numbers(element, values, key, 1, str(default))[0])

    def setting(self, key: str, count: int, default: str) -> list[float]:
        """Returns the numbers of a setting of the compiler."""
        return (
            self.numbers(self.root.find("compiler"), self.compiler, key, count, default)
            if key in self.compiler
            else [float(word) for word in default.split()]
        )

    def angle(self, value: float) -> float:
        """Returns an angle of the file in rad."""
        return math.radians(value) if self.degrees else value

    def pose(self, element: etree._Element, values: dict[str, str]) -> np.ndarray:
        """Returns the transform of position and orientation."""
        return transform(self.rotation(element, values), self.numbers(element, values, "pos", 3, "0 0 0"))

    def rotation(self, element: etree._Element, values: dict[str, str]) -> np.ndarray:
        """Returns the orientation by quat, axisangle, euler, xyaxes or zaxis."""
        if "axisangle" in values:
            *axis, angle = self.numbers(element, values, "axisangle", 4)
            return turn(self._unit(element, axis), self.angle(angle))
        if "euler" in values:
            sequence, result = self.compiler.get("eulerseq", "xyz"), np.eye(3)
            if len(sequence) != 3 or not set(sequence.lower()) <= set(TURNS):
                raise self.error(element, f"'eulerseq' of <compiler> must be three of x, y, z, X, Y, Z, got '{sequence}'")
            for letter, angle in zip(sequence, self.numbers(element, values, "euler", 3), strict=True):
                one = TURNS[letter.lower()](self.angle(angle))
                result = result @ one if letter.islower() else one @ result
            return result
        if "xyaxes" in values:
            six = self.numbers(element, values, "xyaxes", 6)
            x = self._unit(element, six[:3])
            y = self._unit(element, np.array(six[3:]) - (x @ six[3:]) * x)
            return np.column_stack([x, y, np.cross(x, y)])
        if "zaxis" in values:
            return towards(self._unit(element, self.numbers(element, values, "zaxis", 3)))
        quaternion = self.numbers(element, values, "quat", 4, "1 0 0 0")
        self._unit(element, quaternion)
        return of_quaternion(quaternion)

    def _unit(self, element: etree._Element, vector) -> np.ndarray:
        length = float(np.linalg.norm(vector))
        if length < 1e-12:
            raise self.error(element, f"<{element.tag}> has a direction of length 0")
        return np.asarray(vector, float) / length

    def _include(self, parent: etree._Element, file: Path, seen: set[Path]) -> None:
        for element in list(parent.iter("include")):
            other = self.path.parent / element.get("file", "")
            other = other if other.is_file() else file.parent / element.get("file", "")
            if not other.is_file():
                raise UserError(f"{file}:{element.sourceline}: included file '{element.get('file', '')}' does not exist")
            if other.resolve() in seen:
                raise UserError(f"{file}:{element.sourceline}: '{other}' is included twice")
            inner = parsed(other, other.read_bytes())
            self._include(inner, other, {*seen, other.resolve()})
            above, index = element.getparent(), element.getparent().index(element)
            above.remove(element)
            for child in reversed(list(inner)):
                child.set(FILE, child.get(FILE) or str(other))
                above.insert(index, child)

    def _read_class(self, element: etree._Element, inherited: dict[str, dict[str, str]], name: str) -> None:
        own = {tag: dict(values) for tag, values in inherited.items()}
        for child in element:
            if child.tag != "default":
                tag = "actuator" if child.tag in ACTUATORS else child.tag
                own[tag] = _over(own.get(tag, {}), {key: value for key, value in child.attrib.items() if key != FILE})
        self.classes[name] = own
        for child in element.findall("default"):
            self._read_class(child, own, child.get("class", ""))


def _over(inherited: dict[str, str], own: dict[str, str]) -> dict[str, str]:
    """Returns attributes over inherited ones: any orientation replaces one of another form, a shorter list the first entries only."""
    turned = any(key in own for key in ORIENTATIONS)
    kept = {key: value for key, value in inherited.items() if not (turned and key in ORIENTATIONS)}
    lists = {key: " ".join([value, *kept.get(key, "").split()[len(value.split()) :]]) for key, value in own.items() if key not in WHOLE}
    return kept | own | lists


def elements(parent: etree._Element) -> Iterator[etree._Element]:
    """Yields the element children."""
    yield from (child for child in parent if isinstance(child.tag, str))


def turn(axis: np.ndarray, angle: float) -> np.ndarray:
    """Returns the rotation about a unit axis, exact about a coordinate axis."""
    for k, one in enumerate((rotation_x, rotation_y, rotation_z)):
        if abs(abs(axis[k]) - 1) < 1e-15:
            return one(math.copysign(angle, angle * axis[k]))
    cross = np.array([[0, -axis[2], axis[1]], [axis[2], 0, -axis[0]], [-axis[1], axis[0], 0]])
    return np.eye(3) + math.sin(angle) * cross + (1 - math.cos(angle)) * cross @ cross


def towards(z: np.ndarray) -> np.ndarray:
    """Returns the smallest rotation that takes the z axis to a unit vector."""
    axis = np.array([-z[1], z[0], 0.0])
    sine = float(np.linalg.norm(axis))
    if sine < 1e-12:
        return np.eye(3) if z[2] > 0 else rotation_x(math.pi)
    return turn(axis / sine, math.atan2(sine, float(z[2])))


def quaternion_of(r: np.ndarray) -> list[float]:
    """Returns w, x, y, z of a rotation, w >= 0."""
    four = np.array(
        [
            [r[0, 0] + r[1, 1] + r[2, 2], r[2, 1] - r[1, 2], r[0, 2] - r[2, 0], r[1, 0] - r[0, 1]],
            [0, r[0, 0] - r[1, 1] - r[2, 2], r[0, 1] + r[1, 0], r[0, 2] + r[2, 0]],
            [0, 0, r[1, 1] - r[0, 0] - r[2, 2], r[1, 2] + r[2, 1]],
            [0, 0, 0, r[2, 2] - r[0, 0] - r[1, 1]],
        ]
    )
    q = np.linalg.eigh(np.triu(four).T)[1][:, -1]
    return [float(x) for x in (q if q[0] >= 0 else -q)]
