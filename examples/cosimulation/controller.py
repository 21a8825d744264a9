"""A robot controller as an FMU, made with PythonFMU: moves six joints along cycloids with PD control and gravity compensation."""

from math import cos, pi, sin

from pythonfmu import Fmi2Causality, Fmi2Initial, Fmi2Slave, Fmi2Variability, Real

JOINTS = [f"joint{i}" for i in range(1, 7)]
GOAL = [0.8, 0.6, -0.9, 0.5, 0.7, 0.3]  # rad, from 0
MOVE = 1.0  # s
STIFFNESS = [3000, 4000, 1500, 15, 3, 0.002]  # N m/rad
DAMPING = [300, 350, 100, 1, 0.15, 1e-4]  # N m s/rad


def reference(time: float, goal: float) -> tuple[float, float]:
    """Position and velocity on the cycloid from 0 to `goal`."""
    if time >= MOVE:
        return goal, 0.0
    w = 2 * pi / MOVE
    return goal / MOVE * (time - sin(w * time) / w), goal / MOVE * (1 - cos(w * time))


class Controller(Fmi2Slave):
    def __init__(self, **kwargs):
        super().__init__(**kwargs)
        self.heard = {f"{joint}.{kind}": 0.0 for joint in JOINTS for kind in ("q", "qd", "weight")}
        self.said = {f"{joint}.{kind}": 0.0 for joint in JOINTS for kind in ("demand", "reference")}
        for name in self.heard:
            self._variable(name, self.heard, Fmi2Causality.input)
        for name in self.said:
            self._variable(name, self.said, Fmi2Causality.output)

    def _variable(self, name: str, values: dict, causality: Fmi2Causality) -> None:
        output = causality == Fmi2Causality.output
        self.register_variable(
            Real(
                name,
                causality=causality,
                variability=Fmi2Variability.continuous,
                initial=Fmi2Initial.exact if output else None,
                getter=lambda: values[name],
                setter=lambda value: values.__setitem__(name, value),
            ),
            nested=False,
        )

    def do_step(self, current_time, step_size):
        for joint, goal, stiffness, damping in zip(JOINTS, GOAL, STIFFNESS, DAMPING, strict=True):
            q, qd, weight = (self.heard[f"{joint}.{kind}"] for kind in ("q", "qd", "weight"))
            wanted, speed = reference(current_time, goal)
            self.said[f"{joint}.demand"] = stiffness * (wanted - q) + damping * (speed - qd) + weight
            self.said[f"{joint}.reference"] = reference(current_time + step_size, goal)[0]
        return True
