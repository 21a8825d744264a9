"""The groups of variables that plots show together: their titles, axis labels and order."""

from __future__ import annotations

from dataclasses import dataclass


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
    "angle": Group("angles about z, x, y", "angle"),
    "qd": Group("joint velocity", r"$\dot{q}$", steady=True),
    "omega": Group("angular velocity in link axes", r"$\omega$"),
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
    "alpha": Group("angular acceleration in link axes", r"$\alpha$", drawn=False),
    "torque": Group("torque", "$T$", drawn=False),
    "point": Group("contact point", "point", drawn=False),
    "lambda": Group("multipliers of loops and couplings", r"$\lambda$", drawn=False),
}
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


def label_of(name: str, group: str) -> str:
    """Returns the legend text of a curve: the joint, loop or frame with the index, or the name where the title does not say the group."""
    head, _, tail = name.rpartition(".")
    if group not in GROUPS:
        return name
    return tail if group in OF_THE_MODEL else head + tail[len(group) :]
