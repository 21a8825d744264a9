"""Values of a model at its first communication point, through the built library: one load, a resources folder for each scene."""

from __future__ import annotations

import ctypes as c
import json
import subprocess
from pathlib import Path

from build_fmu import native
from tests.fmi.raw import OK, Slave


class Refused(Exception):
    """A scene that `describe` or the FMU does not take."""


class Library:
    """The library of all FMUs and `describe`; plays the part of an unpacked FMU for `Slave`."""

    def __init__(self, folder: Path) -> None:
        self.folder = folder
        (folder / "resources").mkdir(parents=True, exist_ok=True)
        self.describe = native.describe_program()
        self.library = c.CDLL(str(native.library()))
        self.library.fmi2Instantiate.restype = c.c_void_p
        self.guid, self.variables, self.outputs = "", {}, []

    def location(self) -> str:
        return (self.folder / "resources").as_uri()

    def load(self, text: str) -> list[str]:
        """Makes `text` the model of the next slaves; returns the warnings of `describe`."""
        path = self.folder / "resources" / "model.toml"
        path.write_text(text)
        run = subprocess.run([self.describe, path], capture_output=True, text=True, timeout=120)
        lines = [line.replace(f"{path}:", "model.toml:") for line in run.stderr.splitlines()]
        if run.returncode != 0:
            raise Refused("describe: " + "; ".join(lines or [f"exit code {run.returncode}"]))
        table = json.loads(run.stdout)
        self.guid = table["guid"]
        self.variables = {v["name"]: (v["type"], v["value_reference"]) for v in table["variables"]}
        self.outputs = [v["name"] for v in table["variables"] if v["causality"] == "output" and v["type"] == "Real"]
        return lines

    def start(self, inputs: dict[str, float]) -> tuple[dict[str, float], list[str]]:
        """All outputs after initialization with these inputs, and the warnings of the log."""
        slave = Slave(self, logging=True)
        if not slave.component.value:
            raise Refused("fmi2Instantiate: " + "; ".join(text for _, _, text in slave.messages))
        try:
            done = slave.setup() == OK and slave.call("EnterInitializationMode") == OK
            done = done and slave.set_reals(list(inputs), list(inputs.values())) == OK
            if not done or slave.call("ExitInitializationMode") != OK:
                raise Refused("; ".join(slave.errors) or "initialization without an error message")
            values = dict(zip(self.outputs, slave.reals(self.outputs), strict=True))
        finally:
            slave.free()
        return values, [f"{category}: {text}" for _, category, text in slave.messages]
