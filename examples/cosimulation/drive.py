"""The drives of six joints as an FMU, made with PythonFMU: first-order lag and saturation of the torques."""

from math import exp

from pythonfmu import Fmi2Causality, Fmi2Initial, Fmi2Slave, Fmi2Variability, Real

JOINTS = [f"joint{i}" for i in range(1, 7)]
LAG = 0.004  # s
LARGEST = [300, 300, 150, 10, 5, 0.01]  # N m


class Drive(Fmi2Slave):
    def __init__(self, **kwargs):
        super().__init__(**kwargs)
        self.demand, self.torque = {joint: 0.0 for joint in JOINTS}, {joint: 0.0 for joint in JOINTS}
        for joint in JOINTS:
            self._variable(joint, "demand", self.demand, Fmi2Causality.input)
            self._variable(joint, "torque", self.torque, Fmi2Causality.output)

    def _variable(self, joint: str, kind: str, values: dict, causality: Fmi2Causality) -> None:
        output = causality == Fmi2Causality.output
        self.register_variable(
            Real(
                f"{joint}.{kind}",
                causality=causality,
                variability=Fmi2Variability.continuous,
                initial=Fmi2Initial.exact if output else None,
                getter=lambda: values[joint],
                setter=lambda value: values.__setitem__(joint, value),
            ),
            nested=False,
        )

    def do_step(self, current_time, step_size):
        for joint, largest in zip(JOINTS, LARGEST, strict=True):
            wanted = min(max(self.demand[joint], -largest), largest)
            # exact solution of lag * torque' + torque = wanted during the step
            self.torque[joint] += (1 - exp(-step_size / LAG)) * (wanted - self.torque[joint])
        return True
