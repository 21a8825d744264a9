"""The contact scenes of the comparison: data for all simulators, our model file, and the exact result of each simulator's own law.

Each simulator regularises contact in its own way. Its errors are distances from the exact solution of its own equations, so that they
measure the integration only: Newton's equations of a point, or laws of momentum, without any code of the simulators.
"""

from __future__ import annotations

import json
import math
from dataclasses import asdict, dataclass, field
from pathlib import Path

import numpy as np
from scipy.integrate import solve_ivp

G = 9.81
WIDTH = 1e-4  # m, of our normal law


@dataclass
class Data:
    """A ball, or a block on four feet, above the plane z = 0. Lengths in m; stiffness in N/m per contact point."""

    radius: float  # of the ball; 0: a block
    mass: float
    stiffness: float
    position: list[float]
    velocity: list[float]
    gravity: list[float] = field(default_factory=lambda: [0.0, 0.0, -G])
    friction: float = 0.0
    creep: float = 1e-3  # m/s, at half of the friction; sets the friction velocity of each law
    damping: bool = False
    end: float = 2.0
    rows: int = 1
    feet: list[list[float]] = field(default_factory=list)
    foot: float = 0.01  # radius of a foot
    moment: list[float] = field(default_factory=list)  # principal moments of inertia

    @property
    def contacts(self) -> int:
        return len(self.feet) or 1


@dataclass
class ContactScene:
    name: str
    title: str
    methods: tuple[str, ...]  # ours
    data: Data
    file: Path = Path()
    model: Path = Path()
    exact: dict[str, float] = field(default_factory=dict)  # by law

    @property
    def end(self) -> float:
        return self.data.end

    @property
    def rows(self) -> int:
        return self.data.rows

    @property
    def step(self) -> float:
        return self.data.end / self.data.rows

    torques = ()

    def error(self, peer: str, method: str, rows: np.ndarray) -> float:
        """Distance from the exact solution, m; of `creep` in the second half of the time."""
        law = "CENIC" if method == "cenic" else peer
        if law not in self.exact:
            self.exact[law] = EXACT[self.name](self.data, law)
        z0, (x, z) = rows[0, 2], rows[-1, [0, 2]]
        # vibrations of the normal force drop out of the momenta along and normal to the incline
        seen = {"bounce": z, "roll": x, "slide": x + self.data.friction * (z - z0), "creep": x - rows[-2, 0]}[self.name]
        return float(abs(seen - self.exact[law]))


def rest_depth(data: Data, law: str) -> float:
    """Static depth at a contact point."""
    load = -data.mass * data.gravity[2] / data.contacts
    if law == "MuJoCo":
        return 0.0  # its stiffness does not carry the weight
    return load / data.stiffness + (WIDTH / 2 if law == "ReDySim-FMU" else 0.0)


def friction_velocity(data: Data, law: str) -> float:
    return data.creep / {"ReDySim-FMU": math.atanh(0.5) / 4, "CENIC": math.sqrt(1 / 3)}.get(law, 0.5)


def friction_curve(data: Data, law: str, slip: float) -> float:
    s = abs(slip) / friction_velocity(data, law)
    if law == "ReDySim-FMU":
        share = math.tanh(4 * s)
    elif law == "Drake":
        share = s**3 * (10 + s * (6 * s - 15)) if s < 1 else 1.0
    elif law == "CENIC":
        share = s / math.hypot(1, s)
    else:
        share = min(1.0, s)
    return data.friction * share * (slip > 0) - data.friction * share * (slip < 0)


def bounce(data: Data, law: str) -> float:
    """An elastic ball: flights, and the time of a contact with weight."""
    drop = data.position[2] - data.radius
    weight, k = G, data.stiffness / data.mass
    if law == "MuJoCo":
        weight *= 1e-4  # 1 - d of its constraint
    width = WIDTH if law == "ReDySim-FMU" else 0.0
    v = math.sqrt(2 * G * drop)

    def slope(_, y):
        u = y[0] / width if width else 2.0
        h = width * (u**3 - u**4 / 2 if u < 1 else u - 0.5) if width else y[0]
        return [y[1], weight - k * h]

    def deepest(_, y):
        return y[1]

    deepest.terminal = True
    half = solve_ivp(slope, (0, 1), [0, v], events=deepest, rtol=1e-13, atol=1e-18, max_step=1e-5, method="DOP853").t_events[0][0]
    t = data.end - v / G - 2 * half
    while t > 2 * v / G + 2 * half:
        t -= 2 * v / G + 2 * half
    return data.radius + v * t - G * t * t / 2


def roll(data: Data, law: str) -> float:
    """A sliding sphere starts to roll."""
    v, mu, t = data.velocity[0], data.friction, data.end
    if law == "MuJoCo":
        # rigid limit: it has no friction velocity
        sliding = 2 * v / (7 * mu * G)
        return v * sliding - mu * G * sliding**2 / 2 + 5 / 7 * v * (t - sliding)
    arm = data.radius - rest_depth(data, law) * (1.0 if law == "Exudyn" else 0.5)
    ratio = 1 + arm**2 / (0.4 * data.radius**2)

    def slope(_, y):
        force = friction_curve(data, law, y[0]) * G
        return [-ratio * force, -force, y[1]]

    solution = solve_ivp(slope, (0, t), [v, v, 0], rtol=1e-13, atol=1e-15, max_step=2e-3, method="DOP853")
    return solution.y[2, -1]


def slide(data: Data, law: str) -> float:
    """Constant normal force."""
    down, normal, v, t = data.gravity[0], -data.gravity[2], data.velocity[0], data.end
    if law == "MuJoCo":
        return v * t + (down - data.friction * normal) * t * t / 2

    def slope(_, y):
        return [down - friction_curve(data, law, y[0]) * normal, y[0]]

    return solve_ivp(slope, (0, t), [v, 0], rtol=1e-13, atol=1e-15, max_step=1e-2, method="DOP853").y[1, -1]


def creep(data: Data, law: str) -> float:
    """A block on an incline of half the friction creeps; rigid friction holds it."""
    return 0.0 if law == "MuJoCo" else data.creep * data.end / data.rows


EXACT = {"bounce": bounce, "roll": roll, "slide": slide, "creep": creep}


def block(tangent: float, velocity: float, rows: int = 1) -> Data:
    """A block of 0.2 m x 0.2 m x 0.1 m and 2 kg on an incline, in axes of the incline."""
    angle = math.atan(tangent)
    feet = [[x, y, -0.05] for x in (-0.1, 0.1) for y in (-0.1, 0.1)]
    gravity = [G * math.sin(angle), 0.0, -G * math.cos(angle)]
    moment = [2 / 12 * 0.05, 2 / 12 * 0.05, 2 / 12 * 0.08]
    return Data(0.0, 2.0, 1e5, [0, 0, 0.05], [velocity, 0, 0], gravity, 0.4, 1e-4, True, rows=rows, feet=feet, moment=moment)


def scenes() -> list[ContactScene]:
    ball = 0.1
    return [
        ContactScene("bounce", "elastic ball, 3 bounces", ("erk", "adams", "auto"), Data(ball, 1.0, 1e5, [0, 0, 0.6], [0, 0, 0])),
        ContactScene(
            "roll", "ball slides, then rolls", ("erk", "dirk", "bdf", "auto"), Data(ball, 2.0, 1e5, [0, 0, ball], [3, 0, 0], friction=0.3)
        ),
        ContactScene("slide", "block slides on an incline", ("erk", "dirk", "bdf", "auto"), block(0.6, 0.1)),
        ContactScene("creep", "block held by friction on an incline", ("dirk", "bdf", "auto"), block(0.2, 0.0, rows=2)),
    ]


MODEL = """name = "{name}"
gravity = {gravity}
[[link]]
name = "body"
joint = "free"
drive = "free"
mass = {mass}
inertia = {moment}
q = [{x}, 0, {z}, 1, 0, 0, 0]
qd = [{velocity}, 0, 0, 0, 0, 0]
[[contact]]
name = "floor"
link_a = "body"
{shape}
stiffness = {stiffness}
width = {width}
damping = {damping}
friction = {friction}
friction_velocity = {friction_velocity}
"""


def write(scene: ContactScene, folder: Path) -> None:
    """Writes the files of a scene: data for the other simulators, and our model."""
    data = scene.data
    shape = f'shape_a = "points"\npoints_a = {data.feet}' if data.feet else f'shape_a = "sphere"\nradius_a = {data.radius}'
    at_rest = rest_depth(data, "ReDySim-FMU") if scene.name != "bounce" else 0.0
    moment = data.moment or [0.4 * data.mass * data.radius**2] * 3
    scene.file, scene.model = folder / f"contact_{scene.name}.json", folder / f"contact_{scene.name}.toml"
    depths = {peer: rest_depth(data, peer) if scene.name != "bounce" else 0.0 for peer in ("Drake", "MuJoCo", "Exudyn")}
    zones = {law: friction_velocity(data, law) for law in ("Drake", "CENIC", "Exudyn")}
    scene.file.write_text(json.dumps({**asdict(data), "moment": moment, "depths": depths, "friction_velocity": zones}))
    scene.model.write_text(
        MODEL.format(
            name=f"contact_{scene.name}",
            gravity=data.gravity,
            mass=data.mass,
            moment=moment,
            x=data.position[0],
            z=data.position[2] - at_rest,
            velocity=data.velocity[0],
            shape=shape,
            stiffness=data.stiffness,
            width=WIDTH,
            damping=20.0 if data.damping else 0.0,
            friction=data.friction,
            friction_velocity=friction_velocity(data, "ReDySim-FMU"),
        )
    )
