"""A plant without a binary: a unit mass on each input, x'' = input, behind the interface of `session.Session`."""

from math import factorial
from types import SimpleNamespace

from build_fmu.errors import UserError
from build_fmu.run.session import Session


def variable(name, causality, kind="Real", start=None, unit=None, display=None, initial=None):
    return SimpleNamespace(name=name, causality=causality, type=kind, start=start, unit=unit, displayUnit=display, initial=initial)


DEGREES = SimpleNamespace(name="deg", factor="57.29577951308232", offset=None)


class FakeSession(Session):
    """Exact for inputs that are polynomials during a step; fails after `fails_at` (s)."""

    follows_inputs = True

    def __init__(self, fails_at=None, start="0", stop="1", step="0.1"):
        variables = [
            variable("joint1.tau", "input", start="0", unit="N.m"),
            variable("joint2.tau", "input", start="0", unit="N.m"),
            variable("joint1.q", "output", unit="rad", display="deg"),
            variable("joint1.qd", "output", unit="rad/s"),
            variable("joint2.q", "output", unit="rad", display="deg"),
            variable("joint2.qd", "output", unit="rad/s"),
            variable("energy.kinetic", "output", unit="J"),
            variable("tip.position[1]", "output", unit="m"),
            variable("solver.steps", "output", "Integer"),
            variable("solver.says", "output", "String"),
            variable("joint1.q0", "parameter", start="0", unit="rad"),
            variable("solver.method", "parameter", "String", start="erk"),
            variable("solver.log", "parameter", "Boolean", start="false"),
            variable("solver.order", "parameter", "Integer", start="4"),
        ]
        self.description = SimpleNamespace(
            modelName="fake",
            modelVariables=variables,
            defaultExperiment=SimpleNamespace(startTime=start, stopTime=stop, stepSize=step),
            unitDefinitions=[SimpleNamespace(name="rad", displayUnits=[DEGREES]), SimpleNamespace(name="m", displayUnits=[])],
        )
        self.variables = {v.name: v for v in variables}
        self.values = {v.name: 0.0 for v in variables}
        self.fails_at, self.log, self.steps, self.calls = fails_at, [], [], []
        self.slopes = {}

    def close(self):
        self.calls.append("close")

    def initialise(self, start, stop, tolerance, values):
        self.calls.append(("initialise", start, stop, tolerance))
        self.values |= values
        self.values["joint1.q"] = self.values["joint1.q0"]

    def write(self, values):
        self.values |= values

    def write_slopes(self, slopes):
        self.slopes = slopes

    def read(self, names):
        return [self.values[name] for name in names]

    def step(self, time, size):
        if self.fails_at is not None and time >= self.fails_at:
            raise UserError(f"the FMU stopped in the step from t = {time:g} s: joint1 runs away")
        self.steps.append((time, size))
        for joint in ("joint1", "joint2"):
            force, speed = self.values[f"{joint}.tau"], self.values[f"{joint}.qd"]
            derivatives = [force, *self.slopes.get(f"{joint}.tau", ())]
            self.values[f"{joint}.q"] += speed * size + sum(d * size ** (k + 2) / factorial(k + 2) for k, d in enumerate(derivatives))
            self.values[f"{joint}.qd"] += sum(d * size ** (k + 1) / factorial(k + 1) for k, d in enumerate(derivatives))
            self.values[f"{joint}.tau"] = sum(d * size**k / factorial(k) for k, d in enumerate(derivatives))
        self.slopes = {}
        self.values["energy.kinetic"] = sum(self.values[f"joint{i}.qd"] ** 2 / 2 for i in (1, 2))
        self.values["solver.steps"] += 1

    def terminate(self):
        self.calls.append("terminate")
