"""The extreme cases derived from every model, with their durations."""

from __future__ import annotations

import copy
import math
from collections.abc import Callable
from dataclasses import dataclass, field
from functools import partial
from pathlib import Path
from typing import Any

from build_fmu.stress import variants
from build_fmu.stress.variants import Model

LONG = 1e4  # s
SWITCH = 5e-4  # s between two switches: a square wave of 1 kHz
STIFF_HORIZON = 0.2  # s
AT_REST = 1e3  # s
POINTS = 100


@dataclass(frozen=True)
class Case:
    """One case: the changed model, times in s. `open_end`: the case may end at its CPU time limit. `files`: tables beside the model."""

    group: str
    label: str
    model: Model
    stop: float
    step: float
    rtol: float | None = None
    torques: dict[str, float] = field(default_factory=dict)
    stiff: bool = False
    open_end: bool = False
    files: tuple[Path, ...] = ()


GROUPS = {
    "tolerance": "relative tolerances from loose to the limit of double precision",
    "communication step": "from 10 µs to 1 s",
    "mass ratio": "mass of end links or of links on the ground times up to 1e6",
    "near-massless links": "mass of every second link times 1e-6 or 1e-9",
    "fast": "a joint starts at 1000 rad/s (or m/s)",
    "far away": "the mechanism is up to 1e9 m from the origin",
    "stiff springs": "a spring in every joint, 1e2 to 1e8 N m/rad (N/m), undamped",
    "stiff and damped": "the same springs with damping of 1 ms times the stiffness",
    "switching torques": "all torques change their sign at 1 kHz",
    "long run": "10 000 s, or until the CPU time limit",
    "singular start": "all joints at 0, or all at 180 degrees",
    "contact stiffness": "every contact at 1e3 to 1e10 N/m",
    "contact friction": "every contact at a coefficient of 0 to 2",
    "drop": "the ground of the contacts is 10 m lower",
    "many contacts": f"each contact divided into equal ones, {POINTS} or more in total",
    "contact at rest": f"{AT_REST:g} s, with damping and rolling resistance in every contact, driven joints held",
}


def catalogue(model: Model, stop: float, step: float) -> list[Case]:
    """Returns the cases of a parsed model file; `stop` and `step` (s) are those of its default experiment."""
    model = copy.deepcopy(model)
    variants.plain(model)
    stop = min(stop, 2.0)
    step = min(step, stop)
    cases: list[Case] = []

    def add(group: str, label: str, change: Callable[[Model], Any] | None = None, **other: Any) -> None:
        changed = copy.deepcopy(model)
        if change:
            change(changed)
        cases.append(Case(group, label, changed, **{"stop": stop, "step": step, **other}))

    for rtol in (1e-3, 1e-5, 1e-7, 1e-9, 1e-11, 1e-12):
        add("tolerance", f"rtol {rtol:.0e}", rtol=rtol)
    for size, end in ((1e-5, 0.05), (1e-4, 0.2), (1e-3, 1.0), (1e-2, 2.0), (0.1, 2.0), (1.0, 5.0)):
        add("communication step", f"{size:g} s", stop=end, step=size)
    for ratio in (1e3, 1e6):
        add("mass ratio", f"tips x {ratio:.0e}", partial(variants.heavy_tips, ratio=ratio))
    add("mass ratio", "roots x 1e+06", partial(variants.heavy_roots, ratio=1e6))
    for factor in (1e-6, 1e-9):
        add("near-massless links", f"x {factor:.0e}", partial(variants.light_links, factor=factor))
    _fast(model, add)
    for distance in (1e3, 1e6, 1e9):
        add("far away", f"{distance:.0e} m", partial(variants.far_away, distance=distance))
    for group, time in (("stiff springs", 0.0), ("stiff and damped", 1e-3)):
        for stiffness in (1e2, 1e4, 1e6, 1e8):
            change = partial(variants.stiff_joints, stiffness=stiffness, damping=time * stiffness)
            add(group, f"{stiffness:.0e}", change, stop=STIFF_HORIZON, step=1e-3, stiff=True)
    torques = _torques(model)
    if torques:
        add("switching torques", "1 kHz", stop=1.0, step=SWITCH, torques=torques)
    add("long run", f"{LONG:g} s", stop=LONG, step=0.1, open_end=True)
    for angle, name in ((0.0, "0"), (math.pi, "180 degrees")):
        add("singular start", f"all at {name}", partial(variants.start_at, angle=angle))
    if model.get("contact"):
        _contacts(add)
    return cases


def _contacts(add: Callable[..., None]) -> None:
    for stiffness in (1e3, 1e5, 1e7, 1e9, 1e10):
        add("contact stiffness", f"{stiffness:.0e} N/m", partial(variants.contact_stiffness, stiffness=stiffness), stiff=True)
    for friction in (0.0, 0.5, 1.0, 2.0):
        add("contact friction", f"{friction:g}", partial(variants.contact_friction, friction=friction), stiff=True)
    add("drop", "10 m", partial(variants.drop, height=10.0), stop=3.0)
    add("many contacts", f"{POINTS}", partial(variants.split_contacts, least=POINTS))
    add("contact at rest", f"{AT_REST:g} s", variants.come_to_rest, stop=AT_REST, step=0.1)


def _fast(model: Model, add: Callable[..., None]) -> None:
    names = [link["name"] for link in variants.moving(model)]
    for name, label in dict.fromkeys(zip(names[:1] + names[-1:], ("first joint", "last joint"), strict=False)):

        def change(changed: Model, name: str = name) -> None:
            variants.fast(changed, next(link for link in changed["link"] if link["name"] == name), 1e3)

        add("fast", label, change, stop=0.5, step=1e-3)


def _torques(model: Model) -> dict[str, float]:
    """Returns the torque amplitude of each driven joint: outboard weight times 5 cm, or a tenth of the weight for prismatic joints."""
    masses = variants.outboard_masses(model)
    return {
        link.get("joint_name", link["name"]): 9.81 * masses[link["name"]] * (0.1 if link.get("joint") == "prismatic" else 0.05)
        for link in variants.moving(model)
        if link.get("drive", "torque") == "torque"
    }
