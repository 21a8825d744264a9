"""An FMU of FMI 3.0 as a master in C sees it: every call with its status, nothing checked, nothing repaired."""

from __future__ import annotations

import ctypes as c
import zipfile
from collections.abc import Callable, Sequence
from pathlib import Path
from xml.etree import ElementTree as xml

from tests.fmi.raw import ERROR, OK

Logger = c.CFUNCTYPE(None, c.c_void_p, c.c_int, c.c_char_p, c.c_char_p)
Update = c.CFUNCTYPE(None, c.c_void_p, c.c_double, *[c.c_bool] * 4, c.POINTER(c.c_bool), c.POINTER(c.c_double))
TYPES = {"Float64": c.c_double, "Int32": c.c_int32, "String": c.c_char_p}


def array(kind, values: Sequence):
    return (kind * len(values))(*values)


def count(number: int):
    return c.c_size_t(number)


class Unpacked3:
    """An FMU unpacked in a folder: its library, its token and its variables (name -> type, value reference)."""

    def __init__(self, fmu: Path, folder: Path) -> None:
        with zipfile.ZipFile(fmu) as archive:
            archive.extractall(folder)
        self.folder = folder
        self.xml = xml.parse(folder / "modelDescription.xml").getroot()
        self.token = self.xml.get("instantiationToken")
        identifier = self.xml.find("CoSimulation").get("modelIdentifier")
        self.elements = {element.get("name"): element for element in self.xml.find("ModelVariables")}
        self.variables = {name: (element.tag, int(element.get("valueReference"))) for name, element in self.elements.items()}
        self.library = c.CDLL(str(folder / "binaries" / "x86_64-linux" / f"{identifier}.so"))
        for interface in ("CoSimulation", "ModelExchange", "ScheduledExecution"):
            getattr(self.library, f"fmi3Instantiate{interface}").restype = c.c_void_p
        self.library.fmi3GetVersion.restype = c.c_char_p

    def named(self, causality: str, kind: str = "Float64") -> list[str]:
        """Returns the names of one causality and type in the order of the description."""
        return [name for name, element in self.elements.items() if element.get("causality") == causality and element.tag == kind]

    def references(self, names: Sequence[str]):
        return array(c.c_uint, [self.variables[name][1] for name in names])


class Slave3:
    """One instance. `messages` has (status, category, text) of every call of the logger."""

    def __init__(
        self,
        fmu: Unpacked3,
        *,
        token: str | None = None,
        resources: bytes | None = b"",
        name: bytes | None = b"slave",
        interface: str = "CoSimulation",
        event_mode: bool = False,
        update: Callable | None = None,
        early_return: bool = False,
    ) -> None:
        self.fmu, self.messages, self.logger = fmu, [], Logger(self._log)
        path = str(fmu.folder / "resources").encode() + b"/" if resources == b"" else resources
        of_cs = (c.c_bool(event_mode), c.c_bool(early_return), None, count(0))
        self.update = Update(update) if update else None
        callbacks = {"CoSimulation": [self.update], "ScheduledExecution": [None] * 3}.get(interface, [])
        self.component = c.c_void_p(
            getattr(fmu.library, f"fmi3Instantiate{interface}")(
                name,
                (fmu.token if token is None else token).encode(),
                path,
                c.c_bool(False),
                c.c_bool(False),
                *(of_cs if interface == "CoSimulation" else ()),
                None,
                self.logger,
                *callbacks,
            )
        )

    def __enter__(self) -> Slave3:
        assert self.component.value, self.messages
        return self

    def __exit__(self, *_) -> None:
        self.fmu.library.fmi3FreeInstance(self.component)
        self.component = c.c_void_p()

    def _log(self, _, status, category, message) -> None:
        self.messages.append((status, category.decode(), message.decode()))

    @property
    def errors(self) -> list[str]:
        return [text for status, _, text in self.messages if status == ERROR]

    def call(self, function: str, *arguments) -> int:
        """Calls fmi3<function> of this instance."""
        return getattr(self.fmu.library, f"fmi3{function}")(self.component, *arguments)

    # --- life ---

    def enter(self, start: float = 0.0, stop: float | None = None, tolerance: float | None = None) -> int:
        return self.call(
            "EnterInitializationMode",
            c.c_bool(tolerance is not None),
            c.c_double(tolerance or 0),
            c.c_double(start),
            c.c_bool(stop is not None),
            c.c_double(stop or 0),
        )

    def initialize(self, start: dict | None = None) -> Slave3:
        """Goes to the first communication point with these start values."""
        assert self.enter() == OK, self.errors
        for name, value in (start or {}).items():
            assert self.set(name, value) == OK, self.errors
        assert self.call("ExitInitializationMode") == OK, self.errors
        return self

    def do_step(self, current: float, size: float):
        """Returns the status, the three flags and the last successful time."""
        flags, time = [c.c_bool(True) for _ in range(3)], c.c_double(-1)
        status = self.call("DoStep", c.c_double(current), c.c_double(size), c.c_bool(False), *map(c.byref, flags), c.byref(time))
        return status, [flag.value for flag in flags], time.value

    def run(self, first: int, last: int, size: float) -> None:
        for k in range(first, last):
            assert self.do_step(k * size, size) == (OK, [False] * 3, k * size + size), self.errors

    # --- values ---

    def set(self, name: str, value) -> int:
        kind, reference = self.fmu.variables[name]
        value = value.encode() if isinstance(value, str) else value
        return self.call(f"Set{kind}", array(c.c_uint, [reference]), count(1), array(TYPES[kind], [value]), count(1))

    def get(self, names: Sequence[str], kind: str = "Float64") -> list:
        values = (TYPES[kind] * len(names))()
        status = self.call(f"Get{kind}", self.fmu.references(names), count(len(names)), values, count(len(names)))
        assert status == OK, self.errors
        return list(values)

    def everything(self) -> list:
        """Returns all numeric outputs."""
        return self.get(self.fmu.named("output")) + self.get(self.fmu.named("output", "Int32"), "Int32")

    # --- saved states ---

    def save(self) -> c.c_void_p:
        state = c.c_void_p()
        assert self.call("GetFMUState", c.byref(state)) == OK, self.errors
        return state

    def serialize(self, state: c.c_void_p) -> bytes:
        size = c.c_size_t()
        assert self.call("SerializedFMUStateSize", state, c.byref(size)) == OK
        content = c.create_string_buffer(size.value)
        assert self.call("SerializeFMUState", state, content, size) == OK
        return content.raw

    def deserialize(self, content: bytes) -> tuple[int, c.c_void_p]:
        state = c.c_void_p()
        return self.call("DeserializeFMUState", content, count(len(content)), c.byref(state)), state

    # --- derivatives ---

    def derivative(self, function: str, unknowns: Sequence[str], knowns: Sequence[str], seed: Sequence[float]) -> tuple[int, list[float]]:
        """Calls GetDirectionalDerivative or GetAdjointDerivative."""
        result = (c.c_double * (len(unknowns) if function == "GetDirectionalDerivative" else len(knowns)))()
        status = self.call(
            function,
            self.fmu.references(unknowns),
            count(len(unknowns)),
            self.fmu.references(knowns),
            count(len(knowns)),
            array(c.c_double, seed),
            count(len(seed)),
            result,
            count(len(result)),
        )
        return status, list(result)
