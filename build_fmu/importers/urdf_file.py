"""Parses a URDF file and reads its attributes; errors have file, line and element."""

from __future__ import annotations

import math
import re
from collections.abc import Sequence
from pathlib import Path

import numpy as np
from lxml import etree

from build_fmu.errors import InvalidArgument, UserError, did_you_mean
from build_fmu.importers.fields import read_text
from build_fmu.importers.packages import expanded, has_macros
from build_fmu.importers.rigid import rotation_x, rotation_y, rotation_z, transform

DEGREES = 4 * math.pi  # rad: an angle beyond two turns is probably in degrees
NEAR_RIGHT = 1e-3  # rad: an angle within this of a multiple of 90 degrees is probably meant to be one
NAMESPACE = re.compile(rb"""\sxmlns(:[\w.-]+)?\s*=\s*("[^"]*"|'[^']*')""")


class Urdf:
    """The parsed file with checked access to attributes."""

    source = "URDF"  # the name of the format

    def __init__(self, path: Path, root: etree._Element, snap: bool, shown: str = "") -> None:
        """`root` is the <robot>; `shown` is the name of the file in messages with lines, if it differs from its path."""
        self.path, self.root, self.snap, self.shown = path, root, snap, shown or f"{path}"
        self.gravity = [0.0, 0.0, -9.81]
        self.near_right = 0
        self.like_degrees: list[str] = []
        self.springs: dict[str, tuple[float, float]] = {}  # stiffness and rest by joint, which a URDF does not have

    @classmethod
    def of_file(cls, path: Path, snap: bool, arguments: Sequence[str] = ()) -> Urdf:
        """Reads a file; `arguments` are those of xacro, NAME=VALUE."""
        macros = has_macros(path, read_text(path))
        if arguments and not macros:
            raise InvalidArgument(f"--arg has no effect on '{path.name}': it contains no xacro macros")
        root = parsed(path, expanded(path, arguments) if macros else path.read_bytes())
        if root.tag != "robot":
            raise UserError(f"{path}: the root element must be <robot>, got <{root.tag}>")
        return cls(path, root, snap, f"{path} (expanded)" if macros else "")

    def error(self, element: etree._Element, sentence: str) -> UserError:
        return UserError(f"{self.shown}:{element.sourceline}: {sentence}")

    def text(self, element: etree._Element, key: str) -> str:
        if key not in element.attrib:
            raise self.error(element, f"<{element.tag}> has no attribute '{key}'{did_you_mean(key, element.attrib)}")
        return element.attrib[key]

    def name(self, element: etree._Element) -> str:
        """Returns the name of a link or joint."""
        if not self.text(element, "name"):
            raise self.error(element, f"'name' of <{element.tag}> is empty")
        return element.attrib["name"]

    def numbers(self, element: etree._Element, key: str, count: int, default: str) -> list[float]:
        words = element.attrib.get(key, default).split()
        try:
            values = [float(word) for word in words]
        except ValueError:
            values = []
        if len(values) != count or not all(math.isfinite(x) for x in values):
            what = "a number" if count == 1 else f"{count} numbers"
            what = what.replace("number", "finite number") if len(values) == count else what
            raise self.error(element, f"'{key}' of <{element.tag}> must be {what}, got '{element.attrib.get(key, default)}'")
        return values

    def amount(self, element: etree._Element, key: str, default: str) -> float:
        """Returns a non-negative number."""
        value = self.numbers(element, key, 1, default)[0]
        if value < 0:
            raise self.error(element, f"'{key}' of <{element.tag}> must be >= 0, got {value:g}")
        return value

    def bound(self, element: etree._Element, key: str) -> float:
        """Returns an effort or velocity, which may be infinite; 0 without one."""
        return math.inf if element.get(key) in ("inf", "+inf") else self.numbers(element, key, 1, "0")[0]

    def pose(self, parent: etree._Element) -> np.ndarray:
        """Returns the transform of <origin xyz rpy>."""
        element = parent.find("origin")
        if element is None:
            return np.eye(4)
        angles = self.numbers(element, "rpy", 3, "0 0 0")
        return transform(self.rotation(element, angles, f"rpy = '{element.get('rpy')}'"), self.numbers(element, "xyz", 3, "0 0 0"))

    def rotation(self, element: etree._Element, angles: list[float], shown: str) -> np.ndarray:
        """Returns the rotation by roll, pitch and yaw (rad); counts angles near a multiple of 90 degrees, and rounds them with `snap`."""
        if max(map(abs, angles)) > DEGREES:
            self.like_degrees.append(
                f"{self.shown}:{element.sourceline}: {shown} looks like degrees; it was read in rad, as {self.source} defines it"
            )
        for i, angle in enumerate(angles):
            nearest = round(angle / (math.pi / 2)) * (math.pi / 2)
            # deviations in the last digits are rounding errors
            if 0 < abs(angle - nearest) < NEAR_RIGHT:
                if self.snap or abs(angle - nearest) < 1e-14:
                    angles[i] = nearest
                self.near_right += not self.snap and abs(angle - nearest) >= 1e-14
        roll, pitch, yaw = angles
        return rotation_z(yaw) @ rotation_y(pitch) @ rotation_x(roll)


# errors without effect that are common in files of robots, beside prefixes without a namespace
ACCEPTED = ("ERR_UNKNOWN_VERSION", "WAR_UNKNOWN_VERSION", "ERR_HYPHEN_IN_COMMENT")


def parsed(path: Path, text: bytes) -> etree._Element:
    """Returns the root element: names keep prefixes, attributes lose outer spaces; raises UserError with file, line, column."""
    root, errors = _parse(text)
    for error in errors:
        if error.domain_name != "NAMESPACE" and error.type_name not in ACCEPTED:
            raise UserError(f"{path}:{error.line}:{error.column}: {_sentence(error.message.strip())}")
    if root is None:
        raise UserError(f"{path}:1:1: invalid XML: no element")
    dtd = root.getroottree().docinfo.internalDTD
    if dtd is not None and any(dtd.iterentities()):
        raise UserError(f"{path}:1: XML entities are not supported")
    # without its namespace a prefix stays part of the name
    plain = NAMESPACE.sub(lambda found: re.sub(rb"\S", b" ", found[0]), text)
    if plain != text:
        root = _parse(plain)[0]
    for element in root.iter("*"):
        for key, value in element.attrib.items():
            # a name with a prefix cannot be set, and none of them is read
            if ":" not in key:
                element.set(key, value.strip())
    return root


def _sentence(message: str) -> str:
    if message.startswith("Excessive depth"):
        return "elements nested in more than 255 others are not supported"
    return f"invalid XML: {message}"


def _parse(text: bytes) -> tuple[etree._Element | None, list[etree._LogEntry]]:
    """Returns the root element and the errors."""
    parser = etree.XMLParser(recover=True, resolve_entities=False, no_network=True, remove_comments=True, remove_pis=True)
    root = etree.fromstring(text or b" ", parser)
    return root, list(parser.error_log)
