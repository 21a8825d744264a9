"""The right-hand side of a model and its exact derivatives, by a model-exchange instance."""

from __future__ import annotations

import ctypes
import re
from collections.abc import Sequence
from pathlib import Path

import numpy as np

from build_fmu.errors import UserError
from build_fmu.run.session import WARNING, Session

INDEPENDENT = re.compile(r"independent\.(q|qd|qdd)\[(\d+)\]")


class Evaluation(Session):
    """An instance whose states and inputs are given: x' = f(x, u, t).

    `states`, `slopes` and `inputs` are variables, in the order of x, x' and u; `names_of_states` those of the joints that
    `independent.q[i]` and `.qd[i]` are.
    """

    kind = "ModelExchange"

    def __init__(self, fmu: Path) -> None:
        """Opens the FMU; raises UserError if it has no model exchange."""
        super().__init__(fmu)
        if self.description.modelExchange is None:
            self.close()
            raise UserError(f"'{self.description.modelName}' has no equations in continuous time, because its contact forces jump")
        slopes = [row.variable for row in self.description.derivatives]
        self.slopes = [v.name for v in slopes]
        self.states = [v.derivative.name for v in slopes]
        self.inputs = [n for n in self.names("input") if self.variables[n].type == "Real"]
        self.size = len(self.states)
        self.names_of_states = self.states
        self.start = np.empty(self.size)
        self.next_event = np.inf  # s: point of a trajectory after t = 0

    def begin(self, values: dict[str, float]) -> None:
        """Initialises, again if necessary, with the given start values and inputs."""
        self.restart(values)
        *_, has_next, time = self._guarded("in the first event", self.instance.newDiscreteStates)
        self.next_event = time if has_next else np.inf
        self._guarded("in the first event", self.instance.enterContinuousTimeMode)
        self.names_of_states = [self.name_of(n) for n in self.states]
        self.start = self.given_states()

    def name_of(self, variable: str) -> str:
        """Returns `elbow.q` for an independent coordinate that is the position of this joint, else the name itself."""
        found = INDEPENDENT.fullmatch(variable)
        if not found:
            return variable
        letter, number = found.groups()
        reference = self.references([f"independent.joint[{number}]"])
        (joint,) = self._guarded("when reading a joint", lambda: self.instance.getString(reference))
        name = f"{joint.decode() if isinstance(joint, bytes) else joint}.{letter}"
        return name if name in self.variables or letter == "qdd" else variable

    def given_states(self) -> np.ndarray:
        """Returns the state of the instance."""
        x = np.empty(self.size)
        self._guarded("when reading the state", lambda: self.instance.getContinuousStates(_pointer(x), self.size))
        return x

    def place(self, x: np.ndarray, u: np.ndarray, time: float = 0.0) -> None:
        """Sets time (s), state and inputs."""
        x = np.ascontiguousarray(x, dtype=float)
        self._guarded("when setting the time", lambda: self.instance.setTime(time))
        self._guarded("when setting the state", lambda: self.instance.setContinuousStates(_pointer(x), self.size))
        if self.inputs:
            self._guarded("when setting inputs", lambda: self.instance.setReal(self.references(self.inputs), [float(v) for v in u]))

    def slope(self, x: np.ndarray, u: np.ndarray, time: float = 0.0) -> np.ndarray:
        """Returns x'."""
        self.place(x, u, time)
        dx = np.empty(self.size)
        self._guarded("when evaluating the equations of motion", lambda: self.instance.getDerivatives(_pointer(dx), self.size))
        return dx

    def jacobian(self, unknowns: Sequence[str], knowns: Sequence[str]) -> np.ndarray:
        """Returns the exact derivatives at the current place: one row per unknown, one column per known.

        Raises UserError where loops are in a singular configuration.
        """
        logged = len(self.log)
        rows, result = self.references(unknowns), np.empty((len(unknowns), len(knowns)))
        for j, reference in enumerate(self.references(knowns)):

            def column(known: int = reference) -> list[float]:
                return self.instance.getDirectionalDerivative(rows, [known], [1.0])

            result[:, j] = self._guarded("when differentiating the equations of motion", column)
            for status, text in self.log[logged:]:
                if status == WARNING:
                    raise UserError(f"there is no linear model: {text.split(': ', 1)[-1]}")
        return result

    def references(self, names: Sequence[str]) -> list[int]:
        """Returns the value references."""
        return [self.variables[n].valueReference for n in names]


def _pointer(values: np.ndarray):
    return values.ctypes.data_as(ctypes.POINTER(ctypes.c_double))
