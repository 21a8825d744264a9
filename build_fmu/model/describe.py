"""Runs the compiled program `describe` and returns its description of a model file.

Only C++ interprets model files; Python uses the resulting table of variables.
"""

from __future__ import annotations

import json
import re
import subprocess
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

from build_fmu import native
from build_fmu.errors import UserError

FORMAT = 1
IMPORTED = "convert it with `build-fmu import`"
FOREIGN = {".fmu": "it is already an FMU"} | dict.fromkeys(
    (".urdf", ".xacro", ".xml", ".sdf", ".m", ".mat", ".csv", ".xlsx", ".json"), IMPORTED
)


@dataclass(frozen=True)
class Variable:
    """One FMI variable in SI units; `display_unit` is the unit shown to the user."""

    name: str
    value_reference: int
    type: str
    causality: str
    variability: str
    initial: str | None = None
    start: Any = None
    unit: str | None = None
    display_unit: str | None = None
    quantity: str | None = None
    min: float | None = None
    max: float | None = None
    nominal: float | None = None
    description: str = ""
    derivative: str | None = None  # the state whose time derivative this is
    dimensions: tuple[int, ...] = ()  # of an array, by rows; its start value is a tuple


@dataclass(frozen=True)
class Unknown:
    """A row of the model structure; `dependencies` None: all, `kinds` None: all dependent."""

    name: str
    dependencies: list[str] | None = None
    kinds: list[str] | None = None


@dataclass(frozen=True)
class Array:
    """An array variable of FMI 3.0 and the names of its elements, by rows; `suffix` tells it from others of the same name."""

    name: str
    value_reference: int
    suffix: str
    dimensions: list[int]
    elements: list[str]


@dataclass(frozen=True)
class Description:
    """The table of variables of a model, and the warnings (`file:line:column: warning: ...`)."""

    model_name: str
    model_identifier: str
    description: str
    guid: str
    generation_tool: str
    default_experiment: dict[str, float]
    capabilities: dict[str, Any]
    log_categories: list[dict[str, str]]
    units: list[dict[str, Any]]
    variables: list[Variable]
    outputs: list[Unknown]
    initial_unknowns: list[Unknown]
    drawing: dict[str, Any]
    resources: list[str] = field(default_factory=list)  # files that the model file refers to
    warnings: list[str] = field(default_factory=list)
    report: dict[str, Any] = field(default_factory=dict)
    features: list[str] = field(default_factory=list)  # features of the library that the model uses
    depends_on_time: bool = False  # outputs at a communication point depend on the time itself, through prescribed motion
    folder: Path | None = None  # of the model file, to which its meshes are relative
    derivatives: list[Unknown] = field(default_factory=list)  # in the order of the states
    event_indicators: list[str] = field(default_factory=list)  # variables
    model_exchange: dict[str, Any] | None = None  # capabilities; None: not offered
    no_model_exchange: str = ""  # the reason
    arrays: list[Array] = field(default_factory=list)
    origin: dict[str, str] = field(default_factory=dict)  # version, author, license and copyright where the model file gives them

    @property
    def needs_own_library(self) -> bool:
        """Returns whether the method is one of specialised libraries only."""
        return any(v.name == "solver.method" and v.start == "taylor" for v in self.variables)

    @property
    def joints(self) -> tuple[int, int]:
        """Returns the numbers of moving and of fixed joints; of a joint with several DOF the drawing has links `arm[1]`, `arm[2]`."""
        names = [(re.sub(r"\[\d\]$", "", link["name"]), link["type"]) for link in self.drawing["links"]]
        moving = {name for name, kind in names if kind != "fixed"}
        return len(moving), len({name for name, _ in names} - moving)

    def select(self, causality: str) -> list[Variable]:
        """Returns the variables of one causality, in the table's order."""
        return [v for v in self.variables if v.causality == causality]


def describe(model: Path) -> Description:
    """Describes a model file; raises UserError with one line per error."""
    if model.is_dir():
        raise UserError(f"'{model}' is a folder, not a model file (.toml)")
    if not model.is_file():
        raise UserError(f"model file '{model}' " + ("is not a regular file" if model.exists() else "does not exist"))
    if model.suffix.lower() in FOREIGN:
        raise UserError(f"'{model}' is not a model file (.toml): {FOREIGN[model.suffix.lower()]}")
    program = native.describe_program()
    try:
        run = subprocess.run([str(program), str(model)], capture_output=True, stdin=subprocess.DEVNULL, check=False)
    except OSError as error:
        raise UserError(f"cannot run '{program}': {error.strerror}") from None
    messages = run.stderr.decode("utf-8", "replace").strip()
    if run.returncode < 0:
        raise UserError(f"'{program.name}' was terminated by signal {-run.returncode} while reading '{model}'")
    if run.returncode != 0:
        raise UserError(messages or f"'{program.name}' failed with exit code {run.returncode} and without a message")
    try:
        table = json.loads(run.stdout)
    except ValueError as error:
        raise UserError(f"the output of '{program.name}' is not valid JSON: {error}") from None
    return replace(from_table(table, messages.splitlines()), folder=model.parent)


def from_table(table: dict[str, Any], warnings: list[str]) -> Description:
    """Converts the JSON table to a Description; raises UserError for another version of the format."""
    if table.get("format") != FORMAT:
        raise UserError(f"the output of `describe` has format {table.get('format')}, but this build_fmu requires {FORMAT}: rebuild both")
    known = Variable.__dataclass_fields__
    return Description(
        model_name=table["model_name"],
        model_identifier=table["model_identifier"],
        description=table.get("description") or "",
        guid=table["guid"],
        generation_tool=table["generation_tool"],
        default_experiment=table["default_experiment"],
        capabilities=table["capabilities"],
        log_categories=table.get("log_categories", []),
        units=table.get("units", []),
        variables=[Variable(**{k: v for k, v in row.items() if k in known}) for row in table["variables"]],
        outputs=[_unknown(row) for row in table["outputs"]],
        initial_unknowns=[_unknown(row) for row in table["initial_unknowns"]],
        drawing=table["drawing"],
        report=table.get("report", {}),
        features=table.get("features", []),
        depends_on_time=table.get("depends_on_time", False),
        resources=table.get("resources", []),
        derivatives=[_unknown(row) for row in table.get("derivatives", [])],
        event_indicators=table.get("event_indicators", []),
        model_exchange=table.get("model_exchange"),
        no_model_exchange=table.get("no_model_exchange", ""),
        arrays=[Array(**row) for row in table.get("arrays", [])],
        origin=table.get("origin", {}),
        warnings=[line for line in warnings if line.strip()],
    )


def _unknown(row: dict[str, Any]) -> Unknown:
    return Unknown(row["name"], row.get("dependencies"), row.get("kinds"))
