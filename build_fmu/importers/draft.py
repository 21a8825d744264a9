"""The content of an imported file before it is written as a model file: plain data in SI units and radians."""

from __future__ import annotations

import re
from collections.abc import Iterable
from dataclasses import dataclass, field
from itertools import chain, count

GROUND = "ground"
RESERVED = ("time", "energy", "solver", "gravity", "independent", "state", GROUND)


@dataclass
class DhFrame:
    """Modified DH: T = Rz(gamma) Tz(b) Rx(alpha) Tx(a) Rz(theta) Tz(d)."""

    gamma: float = 0.0
    b: float = 0.0
    alpha: float = 0.0
    a: float = 0.0
    theta: float = 0.0
    d: float = 0.0


@dataclass
class DraftLink:
    """A body and its joint; `notes` become comments above it."""

    name: str
    parent: str = GROUND
    joint: str = "revolute"
    joint_name: str = ""
    dh: DhFrame = field(default_factory=DhFrame)
    mass: float = 0.0
    com: list[float] = field(default_factory=lambda: [0.0] * 3)
    inertia: list[float] = field(default_factory=lambda: [0.0] * 6)  # Ixx, Iyy, Izz, Ixy, Ixz, Iyz about the COM
    q: float | list[float] = 0.0  # a list for joints with several DOF, here and below
    qd: float | list[float] = 0.0
    hold: bool = False
    damping: float | list[float] = 0.0
    stiffness: float = 0.0
    rest: float = 0.0
    armature: float = 0.0
    friction: float | list[float] = 0.0
    static_friction: float = 0.0
    friction_velocity: float = 0.0
    lower: float | None = None
    upper: float | None = None
    stop_stiffness: float = 0.0
    stop_damping: float = 0.0
    stop_width: float = 0.0
    drive: str = "torque"
    notes: list[str] = field(default_factory=list)


@dataclass
class DraftTie:
    """A table other than a link and its fields, by their names in the model file; `notes` become comments above it."""

    name: str  # empty for actuators and shapes
    fields: dict[str, object] = field(default_factory=dict)
    notes: list[str] = field(default_factory=list)


@dataclass
class Draft:
    """A whole model file. `lost` lists what was omitted, `doubts` what the user should check; both are printed."""

    name: str
    source: str
    description: str = ""
    gravity: list[float] = field(default_factory=lambda: [0.0, 0.0, -9.81])
    links: list[DraftLink] = field(default_factory=list)
    loops: list[DraftTie] = field(default_factory=list)
    couplings: list[DraftTie] = field(default_factory=list)
    actuators: list[DraftTie] = field(default_factory=list)
    springs: list[DraftTie] = field(default_factory=list)
    contacts: list[DraftTie] = field(default_factory=list)
    frames: list[DraftTie] = field(default_factory=list)
    shapes: list[DraftTie] = field(default_factory=list)
    controller: dict[str, object] = field(default_factory=dict)
    solver: dict[str, object] = field(default_factory=dict)
    fmu: dict[str, object] = field(default_factory=dict)
    notes: list[str] = field(default_factory=list)
    lost: list[str] = field(default_factory=list)
    doubts: list[str] = field(default_factory=list)
    inputs: list[str] = field(default_factory=list)  # of a run, as `build-fmu simulate --input` takes them
    fragments: list[str] = field(default_factory=list)  # the user's own TOML, copied unchanged


def legal(name: str) -> str:
    """Returns the nearest valid name for a model file."""
    text = re.sub(r"[^A-Za-z0-9_]+", "_", name.strip()).strip("_") if not re.fullmatch(r"[A-Za-z_]\w*", name, re.ASCII) else name
    if not text:
        text = "unnamed"
    return f"_{text}" if text[0].isdigit() else text


class Names:
    """Assigns valid, unique names and records the changed ones."""

    def __init__(self, reserved: Iterable[str] = RESERVED) -> None:
        self.used = set(reserved)
        self.changed: list[tuple[str, str]] = []

    def take(self, wanted: str, spare: str = "") -> str:
        """Returns a valid, unique name: `wanted`, `wanted` + `spare`, or `wanted` with a number."""
        base = legal(wanted)
        tries = chain([base], [base + spare] if spare else [], (f"{base}_{i}" for i in count(2)))
        name = next(t for t in tries if t not in self.used)
        self.used.add(name)
        if name != wanted:
            self.changed.append((wanted, name))
        return name

    def sentences(self) -> list[str]:
        """Returns one sentence with all changed names, if there are any."""
        pairs = [f"'{old}' is renamed to '{new}'" for old, new in self.changed]
        return [f"{', '.join(pairs)}: names must be unique and consist of letters, digits and _"] if pairs else []
