"""One FMU instance in FMPy: open, set, step, read. Errors are one sentence."""

from __future__ import annotations

import os
import shutil
from collections.abc import Sequence
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Any

from build_fmu.errors import UserError, did_you_mean, unknown
from build_fmu.run.fmu_file import FMI3_TYPES, read_description

WARNING = 1  # fmi2Warning and fmi3Warning; higher is worse


@dataclass(frozen=True)
class Display:
    """Display unit: displayed value = value * factor + offset."""

    unit: str
    factor: float = 1.0
    offset: float = 0.0


class Session:
    """An instance of a co-simulation FMU of FMI 2.0 or 3.0; use it in a `with` block."""

    kind = "CoSimulation"

    def __init__(self, fmu: Path) -> None:
        """Reads the description and extracts the FMU; raises UserError if that fails."""
        import fmpy

        self.description = read_description(fmu)
        try:
            self.folder: str | None = fmpy.extract(str(fmu))
        except Exception as error:  # a damaged archive fails in many ways
            raise UserError(f"'{fmu}' cannot be unpacked: {error}") from None
        self.variables = {v.name: v for v in self.description.modelVariables}
        self.log: list[tuple[int, str]] = []
        self.instance = None

    def __enter__(self) -> Session:
        here = Path.cwd()
        try:
            self.instance = self._instantiated()
        except Exception as error:
            os.chdir(here)  # FMPy changes into the folder of the library and stays there on failure
            self.close()
            raise UserError(f"'{self.description.modelName}' cannot be loaded: {self._reason(str(error))}") from None
        return self

    def _instantiated(self) -> Any:
        import fmpy
        from fmpy import fmi2

        if self.is_fmi3:
            return fmpy.instantiate_fmu(self.folder, self.description, self.kind, logger=self._logged)
        # FMPy's own function passes the messages of all instances to the logger of the newest one, even after it is freed
        callbacks = fmi2.fmi2CallbackFunctions()
        callbacks.logger = fmi2.fmi2CallbackLoggerTYPE(self._logged)
        callbacks.allocateMemory = fmi2.fmi2CallbackAllocateMemoryTYPE(fmpy.calloc)
        callbacks.freeMemory = fmi2.fmi2CallbackFreeMemoryTYPE(fmpy.free)
        exchange = self.kind == "ModelExchange"
        part = self.description.modelExchange if exchange else self.description.coSimulation
        instance = (fmi2.FMU2Model if exchange else fmi2.FMU2Slave)(
            guid=self.description.guid, unzipDirectory=self.folder, modelIdentifier=part.modelIdentifier
        )
        instance.instantiate(callbacks=callbacks)
        return instance

    def __exit__(self, *_: object) -> None:
        self.close()

    def close(self) -> None:
        """Frees the instance and removes the extracted files."""
        if self.instance is not None:
            self.instance.freeInstance()
            self.instance = None
        if self.folder is not None:
            shutil.rmtree(self.folder, ignore_errors=True)
            self.folder = None

    def names(self, causality: str) -> list[str]:
        """Returns the names of a causality's variables, in the FMU's order."""
        return [v.name for v in self.description.modelVariables if v.causality == causality]

    def find(self, name: str, kind: str, among: Sequence[str]) -> str:
        """Returns the name if it is among the given ones; otherwise raises UserError with the most similar name of that kind."""
        if name in among:
            return name
        if not among:
            raise UserError(f"unknown {kind} '{name}': '{self.description.modelName}' has no {kind}s")
        own = [known for known in among if self.variables[known].causality == kind] or among
        if name in self.variables:
            found = _article(self.variables[name].causality)
            raise UserError(f"'{name}' is {found}, not {_article(kind)}{did_you_mean(name, own)}")
        raise unknown(kind, name, own)

    def display(self, name: str) -> Display:
        """Returns the display unit of a variable."""
        variable = self.variables[name]
        for unit in self.description.unitDefinitions:
            if unit.name == variable.unit:
                for shown in unit.displayUnits:
                    if shown.name == variable.displayUnit:
                        return Display(shown.name, float(shown.factor or 1), float(shown.offset or 0))
        return Display(variable.unit or "")

    def initialise(self, start: float, stop: float, tolerance: float | None, values: dict[str, Any]) -> None:
        """Initialises the FMU at `start` (s) with the given start values."""
        if not self.is_fmi3:
            self._guarded(f"when setting up t = {start:g} s", lambda: self.instance.setupExperiment(tolerance, start, stop))
        self.write(values)
        experiment = (tolerance, start, stop) if self.is_fmi3 else ()
        self._guarded("during initialization", lambda: self.instance.enterInitializationMode(*experiment))
        self._log("logStatusError", "logStatusWarning")
        self._guarded("during initialization", self.instance.exitInitializationMode)

    def restart(self, values: dict[str, Any]) -> None:
        """Resets the FMU and initialises it at t = 0, for a run of any length."""
        self._guarded("when resetting", self.instance.reset)
        self.initialise(0.0, 1e9, None, values)

    def _log(self, *categories: str) -> None:
        """Switches on these categories of messages alone; FMPy knows all or none."""
        if {category.name for category in self.description.logCategories}.issuperset(categories):
            self._guarded("when its log was switched", lambda: self.instance.setDebugLogging(True, categories))

    def write(self, values: dict[str, Any]) -> None:
        """Sets variables by name (SI units)."""
        for name, value in values.items():
            self._guarded(f"when setting '{name}' = {value}", partial(self._set, self.variables[name], value))

    def _set(self, variable: Any, value: Any) -> None:
        convert = {"Real": float, "String": str}.get(variable.type, int)
        self._function("set", variable.type)([variable.valueReference], [convert(value)])

    @property
    def is_fmi3(self) -> bool:
        """Returns whether the FMU has the interface of FMI 3.0."""
        return self.description.fmiVersion.startswith("3.")

    def _function(self, verb: str, kind: str):
        """Returns FMPy's function that sets or gets variables of a type."""
        kind = "Integer" if kind == "Enumeration" else kind
        return getattr(self.instance, verb + (FMI3_TYPES[kind] if self.is_fmi3 else kind))

    @property
    def follows_inputs(self) -> bool:
        """Returns whether inputs can change during a step and the step size may vary."""
        known = self.description.coSimulation
        return bool(not self.is_fmi3 and known.canInterpolateInputs and known.canHandleVariableCommunicationStepSize)

    def write_slopes(self, slopes: dict[str, list[float]]) -> None:
        """Sets the first, second, ... time derivatives of real inputs for the next step."""
        orders = [
            (self.variables[name].valueReference, order, value)
            for name, values in slopes.items()
            for order, value in enumerate(values, start=1)
        ]
        if orders:
            references, numbers, values = zip(*orders, strict=True)
            self._guarded(
                "when setting derivatives of inputs (--interpolate none avoids them)",
                lambda: self.instance.setRealInputDerivatives(references, numbers, values),
            )

    def read(self, names: Sequence[str]) -> list[float]:
        """Returns the values of numeric variables (SI units)."""
        reals = [n for n in names if self.variables[n].type == "Real"]
        references = [self.variables[n].valueReference for n in reals]
        numbers = self._guarded("when reading its outputs", lambda: self._function("get", "Real")(references))
        values = dict(zip(reals, numbers, strict=True))
        for name in names:
            variable = self.variables[name]
            if variable.type in ("Integer", "Enumeration", "Boolean"):
                call = partial(self._function("get", variable.type), [variable.valueReference])
                values[name] = self._guarded(f"when reading '{name}'", call)[0]
        return [values[n] for n in names]

    def step(self, time: float, size: float) -> None:
        """Advances from `time` by `size` (s); raises UserError with the message of the FMU."""
        self._guarded(f"in the step from t = {time:g} s", lambda: self.instance.doStep(time, size))

    def terminate(self) -> None:
        """Ends the simulation; the FMU then logs its final warnings."""
        self._guarded("when terminating", self.instance.terminate)

    def warnings(self) -> list[str]:
        """Returns the FMU's warnings so far, each once."""
        return list(dict.fromkeys(text for status, text in self.log if status == WARNING))

    def _guarded(self, when: str, call):
        seen = len(self.log)
        try:
            return call()
        except Exception as error:  # FMPy has several exception types; the FMU's log gives the reason
            raise UserError(f"the FMU failed {when}: {self._reason(str(error), seen)}") from None

    def _reason(self, fallback: str, since: int = 0) -> str:
        said = self.log[since:]
        texts = [text for status, text in said if status > WARNING] or [text for status, text in said if status == WARNING]
        return texts[-1] if texts else fallback

    def _logged(self, *arguments: Any) -> None:
        status, _category, message = arguments[-3:]  # in both versions
        text = (message or b"").decode("utf-8", "replace").strip()
        # the message of FMI 2.0 is a format of printf; those of our FMUs have no arguments
        self.log.append((status, text if self.is_fmi3 else text.replace("%%", "%")))


def _article(causality: str) -> str:
    return f"an {causality}" if causality[0] in "aeiou" else f"a {causality} variable" if causality == "local" else f"a {causality}"
