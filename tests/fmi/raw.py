"""An FMU as a master in C sees it: every call with its status, nothing checked, nothing repaired."""

from __future__ import annotations

import ctypes as c
import zipfile
from pathlib import Path
from xml.etree import ElementTree as xml

OK, WARNING, DISCARD, ERROR, FATAL, PENDING = range(6)
MODEL_EXCHANGE, CO_SIMULATION = 0, 1
DO_STEP_STATUS, PENDING_STATUS, LAST_SUCCESSFUL_TIME, TERMINATED = range(4)

Logger = c.CFUNCTYPE(None, c.c_void_p, c.c_char_p, c.c_int, c.c_char_p, c.c_char_p)
Allocate = c.CFUNCTYPE(c.c_void_p, c.c_size_t, c.c_size_t)
Free = c.CFUNCTYPE(None, c.c_void_p)


class Callbacks(c.Structure):
    _fields_ = [("logger", Logger), ("allocate", Allocate), ("free", Free), ("step_finished", c.c_void_p), ("environment", c.c_void_p)]


class Unpacked:
    """An FMU unpacked in a folder: its library, its GUID and its variables (name -> type, value reference)."""

    def __init__(self, fmu: Path, folder: Path) -> None:
        with zipfile.ZipFile(fmu) as archive:
            archive.extractall(folder)
        self.folder = folder
        self.xml = xml.parse(folder / "modelDescription.xml").getroot()
        self.guid = self.xml.get("guid")
        self.identifier = self.xml.find("CoSimulation").get("modelIdentifier")
        self.library_path = folder / "binaries" / "linux64" / f"{self.identifier}.so"
        self.variables, self.causalities = {}, {}
        for scalar in self.xml.iter("ScalarVariable"):
            name = scalar.get("name")
            self.variables[name], self.causalities[name] = (scalar[0].tag, int(scalar.get("valueReference"))), scalar.get("causality")
        self.library = c.CDLL(str(self.library_path))
        self.library.fmi2Instantiate.restype = c.c_void_p
        self.library.fmi2GetVersion.restype = self.library.fmi2GetTypesPlatform.restype = c.c_char_p

    def named(self, causality: str, ending: str = "") -> list[str]:
        """Returns the names of one causality in the order of the description."""
        return [name for name, own in self.causalities.items() if own == causality and name.endswith(ending)]

    def dependencies(self, group: str) -> dict[str, set[str]]:
        """Returns what may be set and each unknown of Outputs or InitialUnknowns depends on; where no list stands, on all of it."""
        scalars = list(self.xml.iter("ScalarVariable"))
        names = [scalar.get("name") for scalar in scalars]
        of_all = {"input"} if group == "Outputs" else {"input", "parameter"}
        every = [str(i) for i, scalar in enumerate(scalars, 1) if scalar.get("causality") in of_all]
        return {
            names[int(row.get("index")) - 1]: {names[int(i) - 1] for i in row.get("dependencies", " ".join(every)).split() if i in every}
            for row in self.xml.find(f"ModelStructure/{group}")
        }

    def location(self) -> str:
        return (self.folder / "resources").as_uri()


class Slave:
    """One instance. `messages` holds (status, category, text) of every call of the logger."""

    def __init__(
        self,
        fmu: Unpacked,
        *,
        guid: str | None = None,
        location: str | bytes | None = None,
        logging: bool = False,
        kind: int = CO_SIMULATION,
        memory: bool = False,
        name: str = "slave",
    ) -> None:
        self.fmu, self.messages, self.blocks = fmu, [], {}
        self.callbacks = Callbacks(Logger(self._log), Allocate(), Free(), None, None)
        if memory:
            self.callbacks.allocate, self.callbacks.free = Allocate(self._allocate), Free(self._free)
        location = fmu.location() if location is None else location
        encoded = location if isinstance(location, bytes) else location.encode()
        self.component = c.c_void_p(
            fmu.library.fmi2Instantiate(name.encode(), kind, (guid or fmu.guid).encode(), encoded, c.byref(self.callbacks), 0, int(logging))
        )

    def __enter__(self) -> Slave:
        assert self.component.value, self.messages
        return self

    def __exit__(self, *_) -> None:
        self.free()

    def free(self) -> None:
        self.fmu.library.fmi2FreeInstance(self.component)
        self.component = c.c_void_p()

    def _log(self, _, name, status, category, message) -> None:
        # the message is a printf format without arguments
        text = message.decode()
        assert "%" not in text.replace("%%", "")
        self.messages.append((status, category.decode(), text.replace("%%", "%")))

    def _allocate(self, count, size):
        block = c.create_string_buffer(count * size)
        self.blocks[c.addressof(block)] = block
        return c.addressof(block)

    def _free(self, address) -> None:
        del self.blocks[address]

    @property
    def errors(self) -> list[str]:
        return [text for status, _, text in self.messages if status == ERROR]

    def call(self, function: str, *arguments) -> int:
        """Calls fmi2<function> of this instance."""
        return getattr(self.fmu.library, f"fmi2{function}")(self.component, *arguments)

    # --- life ---

    def setup(self, start: float = 0.0, stop: float | None = None, tolerance: float | None = None) -> int:
        return self.call(
            "SetupExperiment",
            int(tolerance is not None),
            c.c_double(tolerance or 0),
            c.c_double(start),
            int(stop is not None),
            c.c_double(stop or 0),
        )

    def initialize(self, **values) -> Slave:
        """Sets start values and goes to the first communication point."""
        assert self.setup() == OK
        assert self.call("EnterInitializationMode") == OK
        for name, value in values.pop("start", {}).items():
            assert self.set(name, value) == OK, self.errors
        assert self.call("ExitInitializationMode") == OK, self.errors
        return self

    def step(self, current: float, size: float) -> int:
        return self.call("DoStep", c.c_double(current), c.c_double(size), 1)

    def run(self, stop: float, size: float, start: float = 0.0) -> None:
        for k in range(round((stop - start) / size)):
            assert self.step(start + k * size, size) == OK, self.errors

    def last_time(self) -> float:
        time = c.c_double()
        assert self.call("GetRealStatus", LAST_SUCCESSFUL_TIME, c.byref(time)) == OK
        return time.value

    # --- values ---

    def set(self, name: str, value) -> int:
        kind, reference = self.fmu.variables[name]
        types = {"Real": c.c_double, "Integer": c.c_int, "String": c.c_char_p}
        value = value.encode() if isinstance(value, str) else value
        return self.call(f"Set{kind}", (c.c_uint * 1)(reference), c.c_size_t(1), (types[kind] * 1)(value))

    def try_get(self, name: str):
        kind, reference = self.fmu.variables[name]
        value = ({"Real": c.c_double, "Integer": c.c_int, "String": c.c_char_p}[kind] * 1)()
        status = self.call(f"Get{kind}", (c.c_uint * 1)(reference), c.c_size_t(1), value)
        return status, value[0].decode() if kind == "String" and value[0] else value[0]

    def get(self, name: str):
        status, value = self.try_get(name)
        assert status == OK, self.errors
        return value

    def reals(self, names: list[str]) -> list[float]:
        references = [self.fmu.variables[name][1] for name in names]
        values = (c.c_double * len(names))()
        assert self.call("GetReal", (c.c_uint * len(names))(*references), c.c_size_t(len(names)), values) == OK, self.errors
        return list(values)

    def set_reals(self, names: list[str], values) -> int:
        references = [self.fmu.variables[name][1] for name in names]
        return self.call("SetReal", (c.c_uint * len(names))(*references), c.c_size_t(len(names)), (c.c_double * len(names))(*values))

    # --- saved states ---

    def save(self) -> c.c_void_p:
        state = c.c_void_p()
        assert self.call("GetFMUstate", c.byref(state)) == OK, self.errors
        return state

    def serialize(self, state: c.c_void_p) -> bytes:
        size = c.c_size_t()
        assert self.call("SerializedFMUstateSize", state, c.byref(size)) == OK
        content = c.create_string_buffer(size.value)
        assert self.call("SerializeFMUstate", state, content, size) == OK
        return content.raw

    def deserialize(self, content: bytes) -> tuple[int, c.c_void_p]:
        state = c.c_void_p()
        return self.call("DeSerializeFMUstate", content, c.c_size_t(len(content)), c.byref(state)), state
