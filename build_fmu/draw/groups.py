"""The groups of variables that plots show together: their titles, axis labels and order."""

from __future__ import annotations

import re
from collections.abc import Iterable, Mapping
from dataclasses import dataclass

import numpy as np


@dataclass(frozen=True)
class Group:
    """A kind of variable. `drawn`: plotted by default; `steady`: its axis does not magnify rounding errors of a state at rest."""

    title: str
    symbol: str
    drawn: bool = True
    steady: bool = False


# in the order of the panels
GROUPS = {
    "q": Group("joint position", "$q$", steady=True),
    "angle": Group("angles about z, x, y", "angle", steady=True),
    "qd": Group("joint velocity", r"$\dot{q}$", steady=True),
    "omega": Group("angular velocity in link axes", r"$\omega$", steady=True),
    "tau": Group("joint torque or force", r"$\tau$", steady=True),
    "energy": Group("energy", "$E$", steady=True),
    "balance": Group("energy balance error", r"$\Delta E$"),
    "gap": Group("gap of loops and couplings", "gap"),
    "force": Group("force", "$F$"),
    "depth": Group("penetration depth of contacts", "depth"),
    "slip": Group("slip velocity of contacts", "slip"),
    "position": Group("frame position", "position", drawn=False),
    "velocity": Group("frame velocity", "velocity", drawn=False),
    "quaternion": Group("quaternion (w, x, y, z)", "quaternion", drawn=False),
    "qdd": Group("joint acceleration", r"$\ddot{q}$", drawn=False, steady=True),
    "alpha": Group("angular acceleration in link axes", r"$\alpha$", drawn=False, steady=True),
    "torque": Group("torque", "$T$", drawn=False),
    "point": Group("contact point", "point", drawn=False),
    "lambda": Group("multipliers of loops and couplings", r"$\lambda$", drawn=False),
}
# axes of the components of a vector
AXES = {"angle": "zxy"} | dict.fromkeys(("omega", "alpha", "force", "torque", "position", "velocity", "point"), "xyz")
OF_THE_MODEL = ("energy", "balance")  # one curve per variable of the model, not per joint, loop or frame


def group_of(name: str) -> str:
    """Returns the group of a variable: its last part without the index; other variables form groups of their own name."""
    head, _, tail = name.rpartition(".")
    if head == "energy":
        return "balance" if tail == "balance" else "energy"
    return tail.partition("[")[0] if head else name


def title_of(group: str) -> str:
    """Returns the title of a group's panel."""
    return GROUPS[group].title if group in GROUPS else group


def rank_of(group: str) -> int:
    """Returns the place of a group's panel; unknown groups come last."""
    return list(GROUPS).index(group) if group in GROUPS else len(GROUPS)


def label_of(name: str, group: str, parts: dict[str, str] | None = None) -> str:
    """Returns the legend text of a curve: the joint, loop or frame with the axis, or the name where the title does not say the group.

    `parts` gives the names of the parts of joints with several DOF (see `joint_parts`).
    """
    head, _, tail = name.rpartition(".")
    if group not in GROUPS:
        return name
    if group in OF_THE_MODEL:
        return tail
    index, axes = tail[len(group) :], AXES.get(group, "")
    return (parts or {}).get(head, head) + (f".{axes[int(index[1]) - 1]}" if axes and re.fullmatch(r"\[[123]\]", index) else index)


def joint_parts(names: Iterable[str]) -> dict[str, str]:
    """Returns the names of the parts of free and planar joints for users, such as trunk.x of trunk[1] and cart.angle of cart[3]."""
    heads, parts = dict.fromkeys(name.rpartition(".")[0] for name in names), {}
    for joint in [head.removesuffix("[3]") for head in heads if head.endswith("[3]")]:
        if f"{joint}[2]" in heads:
            axes = ("x", "y", "z" if joint in heads else "angle")
            parts |= {f"{joint}[{k}]": f"{joint}.{axis}" for k, axis in enumerate(axes, 1)}
    return parts


def noise_of(group: str, largest: float, energy: float) -> float:
    """Returns the span up to which curves with this largest value contain rounding errors only; `energy`: largest energy of the run."""
    if group == "balance":
        return 1e-13 * energy
    return (1e-6 if group in GROUPS and GROUPS[group].steady else 1e-11) * max(1.0, largest)


def largest_energy(columns: Mapping[str, np.ndarray]) -> float:
    """Returns the largest energy of a run (J)."""
    return max((float(np.max(np.abs(values), initial=0)) for name, values in columns.items() if group_of(name) == "energy"), default=0.0)


def noise_range(group: str, noise: float) -> float:
    """Returns half the range of an axis whose curves contain rounding errors only."""
    return 1.0 if group in GROUPS and GROUPS[group].steady else 1e3 * noise or 1.0
