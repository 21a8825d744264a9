"""A spring-damper between two ports as an FMU, made with PythonFMU. Variables `a.*` and `b.*` are those of the terminals."""

from pythonfmu import Fmi2Causality, Fmi2Initial, Fmi2Slave, Fmi2Variability, Real

STIFFNESS, DAMPING = 2000.0, 10.0  # N/m, N s/m
MOTION = ("position", "velocity", "acceleration")


class Pad(Fmi2Slave):
    def __init__(self, **kwargs):
        super().__init__(**kwargs)
        self.motion = {f"{end}.{kind}[{i}]": 0.0 for end in "ab" for kind in MOTION for i in (1, 2, 3)}
        self.force = {f"{end}.force[{i}]": 0.0 for end in "ab" for i in (1, 2, 3)}
        self.state = {"energy": 0.0, "loss": 0.0}  # J of the spring, W of the damper
        for values, causality in (
            (self.motion, Fmi2Causality.input),
            (self.force, Fmi2Causality.output),
            (self.state, Fmi2Causality.output),
        ):
            for name in values:
                self._variable(name, values, causality)

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
        """The forces at the end of the step, from the motion at its start."""
        self.state["energy"] = self.state["loss"] = 0.0
        for i in (1, 2, 3):
            x, v, a = (self.motion[f"b.{kind}[{i}]"] - self.motion[f"a.{kind}[{i}]"] for kind in MOTION)
            x, v = x + step_size * v + step_size**2 / 2 * a, v + step_size * a
            self.force[f"a.force[{i}]"] = STIFFNESS * x + DAMPING * v
            self.force[f"b.force[{i}]"] = -self.force[f"a.force[{i}]"]
            self.state["energy"] += STIFFNESS / 2 * x * x
            self.state["loss"] += DAMPING * v * v
        return True
