"""A model-exchange instance as a master in C sees it."""

from __future__ import annotations

import ctypes as c

import numpy as np

from tests.fmi.raw import MODEL_EXCHANGE, OK, Slave, Unpacked
from tests.fmi.raw3 import Slave3, Unpacked3


class EventInfo(c.Structure):
    _fields_ = [
        ("again", c.c_int),
        ("terminate", c.c_int),
        ("new_nominals", c.c_int),
        ("new_values", c.c_int),
        ("has_next", c.c_int),
        ("next", c.c_double),
    ]


class Tool:
    """What both versions of FMI have in common; `states` and `slopes` are the names of the variables in the order of the state vector,
    `indicator_count` is the number of event indicators in the description."""

    derivatives_function = "GetDerivatives"

    def begin(self, **values) -> EventInfo:
        """Initializes and goes to continuous-time mode; returns the first event."""
        self.initialize(**values)
        info = self.event()
        assert self.call("EnterContinuousTimeMode") == OK
        return info

    def numbers(self, function: str, count: int | None = None) -> np.ndarray:
        """Calls a function that fills this many numbers, by default one a state."""
        values = np.full(len(self.states) if count is None else count, np.nan)
        assert self.call(function, values.ctypes.data_as(c.c_void_p), c.c_size_t(len(values))) == OK, self.errors
        return values

    def get_states(self) -> np.ndarray:
        return self.numbers("GetContinuousStates")

    def derivatives(self) -> np.ndarray:
        return self.numbers(self.derivatives_function)

    def indicators(self) -> np.ndarray:
        return self.numbers("GetEventIndicators", self.indicator_count)

    def set_states(self, values) -> int:
        values = np.ascontiguousarray(values, dtype=float)
        return self.call("SetContinuousStates", values.ctypes.data_as(c.c_void_p), c.c_size_t(len(values)))

    def set_time(self, time: float) -> int:
        return self.call("SetTime", c.c_double(time))

    def slope_at(self, time: float, values) -> np.ndarray:
        assert (self.set_time(time), self.set_states(values)) == (OK, OK), self.errors
        return self.derivatives()

    def advance(self, time: float, h: float) -> None:
        """One step of the midpoint rule from this time."""
        states = self.get_states()
        middle = states + h / 2 * self.slope_at(time, states)
        states = states + h * self.slope_at(time + h / 2, middle)
        assert (self.set_time(time + h), self.set_states(states)) == (OK, OK), self.errors


class Exchange(Tool, Slave):
    """One instance of FMI 2.0."""

    def __init__(self, fmu: Unpacked, **options) -> None:
        super().__init__(fmu, kind=MODEL_EXCHANGE, logging=True, **options)
        scalars = list(fmu.xml.iter("ScalarVariable"))
        rows = fmu.xml.find("ModelStructure/Derivatives")
        slopes = [scalars[int(row.get("index")) - 1] for row in ([] if rows is None else rows)]
        self.slopes = [scalar.get("name") for scalar in slopes]
        self.states = [scalars[int(scalar[0].get("derivative")) - 1].get("name") for scalar in slopes]
        self.indicator_count = int(fmu.xml.get("numberOfEventIndicators", "0"))

    def event(self) -> EventInfo:
        info = EventInfo()
        assert self.call("NewDiscreteStates", c.byref(info)) == OK, self.errors
        assert (info.again, info.terminate) == (0, 0)
        return info

    def completed_step(self) -> bool:
        """Returns whether the instance asks for an event."""
        enter, terminate = c.c_int(-1), c.c_int(-1)
        assert self.call("CompletedIntegratorStep", 1, c.byref(enter), c.byref(terminate)) == OK
        assert terminate.value == 0
        return bool(enter.value)

    def directional(self, unknowns: list[str], knowns: list[str], direction) -> np.ndarray:
        references = [(c.c_uint * len(names))(*(self.fmu.variables[name][1] for name in names)) for names in (unknowns, knowns)]
        result = np.full(len(unknowns), np.nan)
        direction = np.ascontiguousarray(direction, dtype=float)
        status = self.call(
            "GetDirectionalDerivative",
            references[0],
            c.c_size_t(len(unknowns)),
            references[1],
            c.c_size_t(len(knowns)),
            direction.ctypes.data_as(c.c_void_p),
            result.ctypes.data_as(c.c_void_p),
        )
        assert status == OK, self.errors
        return result

    def jacobian(self, unknowns: list[str], knowns: list[str]) -> np.ndarray:
        """Column by column."""
        return np.column_stack([self.directional(unknowns, [known], [1.0]) for known in knowns])


class Exchange3(Tool, Slave3):
    """One instance of FMI 3.0."""

    derivatives_function = "GetContinuousStateDerivatives"

    def __init__(self, fmu: Unpacked3, **options) -> None:
        super().__init__(fmu, interface="ModelExchange", **options)
        by_reference = {element.get("valueReference"): name for name, element in fmu.elements.items()}
        rows = fmu.xml.findall("ModelStructure/ContinuousStateDerivative")
        self.slopes = [by_reference[row.get("valueReference")] for row in rows]
        self.states = [by_reference[fmu.elements[name].get("derivative")] for name in self.slopes]
        self.indicator_count = len(fmu.xml.findall("ModelStructure/EventIndicator"))

    def event(self) -> EventInfo:
        flags, time = [c.c_bool(True) for _ in range(5)], c.c_double(np.nan)
        assert self.call("UpdateDiscreteStates", *map(c.byref, flags), c.byref(time)) == OK, self.errors
        info = EventInfo(*(flag.value for flag in flags), time.value)
        assert (info.again, info.terminate) == (0, 0)
        return info

    def completed_step(self) -> bool:
        """Returns whether the instance asks for an event."""
        enter, terminate = c.c_bool(True), c.c_bool(True)
        assert self.call("CompletedIntegratorStep", c.c_bool(True), c.byref(enter), c.byref(terminate)) == OK
        assert not terminate.value
        return enter.value

    def number(self, function: str) -> int:
        count = c.c_size_t(99)
        assert self.call(function, c.byref(count)) == OK, self.errors
        return count.value
