"""Writes modelDescription.xml (FMI 2.0, model exchange and co-simulation) from a model's table.

Equal tables give equal bytes: variables are in the order of the table, numbers have the shortest exact form, and the file
does not depend on date or machine. It contains a date only if the environment variable SOURCE_DATE_EPOCH sets it.
"""

from __future__ import annotations

import math
import os
import re
from collections.abc import Sequence
from datetime import UTC, datetime
from typing import Any
from xml.etree import ElementTree as xml

from build_fmu.errors import UserError
from build_fmu.model.describe import Description, Unknown, Variable

CAPABILITIES = (
    "needsExecutionTool",
    "canHandleVariableCommunicationStepSize",
    "canInterpolateInputs",
    "maxOutputDerivativeOrder",
    "canRunAsynchronuously",  # spelling of the standard
    "canBeInstantiatedOnlyOncePerProcess",
    "canNotUseMemoryManagementFunctions",
    "canGetAndSetFMUstate",
    "canSerializeFMUstate",
    "providesDirectionalDerivative",
)
EXCHANGE = (
    "needsExecutionTool",
    "completedIntegratorStepNotNeeded",
    "canBeInstantiatedOnlyOncePerProcess",
    "canNotUseMemoryManagementFunctions",
    "canGetAndSetFMUstate",
    "canSerializeFMUstate",
    "providesDirectionalDerivative",
)
FORBIDDEN = re.compile("[^\\t\\n\\r -\ud7ff\ue000-\ufffd\U00010000-\U0010ffff]")
BASE_UNITS = ("kg", "m", "s", "A", "K", "mol", "cd", "rad", "factor", "offset")


def model_description(model: Description) -> bytes:
    """Returns the XML file's content, UTF-8."""
    root = xml.Element(
        "fmiModelDescription",
        attributes(
            fmiVersion="2.0",
            modelName=model.model_name,
            guid=model.guid,
            description=model.description or None,
            **model.origin,
            generationTool=model.generation_tool,
            generationDateAndTime=generation_date(),
            variableNamingConvention="structured",
            numberOfEventIndicators=None if model.model_exchange is None else len(model.event_indicators),
        ),
    )
    if model.model_exchange is not None:
        flags = {name: model.model_exchange[name] for name in EXCHANGE if name in model.model_exchange}
        xml.SubElement(root, "ModelExchange", attributes(modelIdentifier=model.model_identifier, **flags))
    flags = {name: model.capabilities[name] for name in CAPABILITIES if name in model.capabilities}
    xml.SubElement(root, "CoSimulation", attributes(modelIdentifier=model.model_identifier, **flags))
    common_elements(root, model)
    variables = xml.SubElement(root, "ModelVariables")
    index = {variable.name: i for i, variable in enumerate(model.variables, start=1)}
    states = reinitialised_states(model)
    for variable in model.variables:
        _variable(variables, variable, index, variable.name in states)
    _structure(root, model, index)
    return file_content(root)


def generation_date() -> str | None:
    """Returns the time of SOURCE_DATE_EPOCH (s since 1970, UTC); None if the variable is not set."""
    text = os.environ.get("SOURCE_DATE_EPOCH", "")
    if not text:
        return None
    try:
        return datetime.fromtimestamp(int(text), UTC).strftime("%Y-%m-%dT%H:%M:%SZ")
    except (ValueError, OverflowError, OSError):
        raise UserError(f"environment variable SOURCE_DATE_EPOCH is '{text}', not a number of seconds since 1970") from None


def corrects_states(model: Description) -> bool:
    """Whether a completed step may request an event that changes states: quaternions and closed loops drift."""
    return not (model.model_exchange or {}).get("completedIntegratorStepNotNeeded", True)


def reinitialised_states(model: Description) -> set[str | None]:
    """Returns the names of the states that an event of model exchange may change: all or none."""
    can_be_set = any(variable.name == "state.apply" for variable in model.variables)
    return {variable.derivative for variable in model.variables if can_be_set or corrects_states(model)}


def file_content(root: xml.Element) -> bytes:
    """Returns the indented XML file, UTF-8; raises UserError for a character that XML does not have."""
    for field, text in root.items():
        if wrong := FORBIDDEN.search(text):
            raise UserError(f"{field} of the FMU contains the character U+{ord(wrong[0]):04X}, which XML does not allow")
    xml.indent(root)
    return b'<?xml version="1.0" encoding="UTF-8"?>\n' + xml.tostring(root, encoding="utf-8") + b"\n"


def common_elements(root: xml.Element, model: Description) -> None:
    """Adds units, log categories and the default experiment, which are equal in FMI 2.0 and 3.0."""
    _units(root, model)
    if model.log_categories:
        categories = xml.SubElement(root, "LogCategories")
        for row in model.log_categories:
            xml.SubElement(categories, "Category", attributes(name=row["name"], description=row.get("description")))
    experiment = model.default_experiment
    xml.SubElement(
        root,
        "DefaultExperiment",
        attributes(
            startTime=real(experiment.get("start_time", 0)),
            stopTime=real(experiment.get("stop_time")),
            tolerance=real(experiment.get("tolerance")),
            stepSize=real(experiment.get("step_size")),
        ),
    )


def _units(root: xml.Element, model: Description) -> None:
    if not model.units:
        return
    definitions = xml.SubElement(root, "UnitDefinitions")
    for row in model.units:
        unit = xml.SubElement(definitions, "Unit", attributes(name=row["name"]))
        base = row.get("base")
        if base is not None:
            powers = {k: real(base[k]) if k in ("factor", "offset") else base[k] for k in BASE_UNITS if k in base}
            xml.SubElement(unit, "BaseUnit", attributes(**powers))
        for display in row.get("display", []):
            factor, offset = real(display.get("factor")), real(display.get("offset"))
            xml.SubElement(unit, "DisplayUnit", attributes(name=display["name"], factor=factor, offset=offset))


def identity(variable: Variable) -> dict[str, Any]:
    """Returns the attributes of a variable of any type, which are equal in FMI 2.0 and 3.0."""
    return {
        "name": variable.name,
        "valueReference": variable.value_reference,
        "description": variable.description or None,
        "causality": variable.causality,
        "variability": variable.variability,
        # the standard forbids it for inputs, whose start values are always exact
        "initial": None if variable.causality == "input" else variable.initial,
    }


def dependencies(row: Unknown, number: dict[str, int], independent: Sequence[int] = ()) -> dict[str, str]:
    """Returns what an unknown depends on by the numbers of variables, ascending, on which some importers rely; none: on all.

    `independent` are numbers before those of the row.
    """
    if row.dependencies is None:
        return {}
    # each kind stays with its variable
    kinds = row.kinds or ["dependent"] * len(row.dependencies)
    pairs = [(first, "dependent") for first in independent]
    pairs += sorted(zip((number[name] for name in row.dependencies), kinds, strict=True))
    return attributes(
        dependencies=" ".join(str(i) for i, _ in pairs),
        dependenciesKind=" ".join(kind for _, kind in pairs) if pairs and row.kinds else None,
    )


def _variable(parent: xml.Element, variable: Variable, index: dict[str, int], reinit: bool) -> None:
    scalar = xml.SubElement(parent, "ScalarVariable", attributes(**identity(variable)))
    number = real if variable.type == "Real" else lambda value: value
    limits = {"min": number(variable.min), "max": number(variable.max)}
    details: dict[str, Any] = {"quantity": variable.quantity}
    if variable.type == "Real":
        details |= {"unit": variable.unit, "displayUnit": variable.display_unit, **limits, "nominal": real(variable.nominal)}
    elif variable.type == "Integer":
        details |= limits
    else:
        details = {}
    derivative = None if variable.derivative is None else index[variable.derivative]
    course = {"start": number(variable.start), "derivative": derivative, "reinit": reinit or None}
    xml.SubElement(scalar, variable.type, attributes(**details, **course))


def _structure(root: xml.Element, model: Description, index: dict[str, int]) -> None:
    structure = xml.SubElement(root, "ModelStructure")
    for tag, rows in (("Outputs", model.outputs), ("Derivatives", model.derivatives), ("InitialUnknowns", model.initial_unknowns)):
        if rows:
            group = xml.SubElement(structure, tag)
            for row in rows:
                xml.SubElement(group, "Unknown", index=str(index[row.name]), **dependencies(row, index))


def real(value: float | None) -> str | None:
    """Returns the shortest decimal of exactly this double, in XML Schema notation."""
    if value is None:
        return None
    value = float(value)
    if math.isinf(value):
        return "INF" if value > 0 else "-INF"
    return "NaN" if math.isnan(value) else repr(value)


def attributes(**values: Any) -> dict[str, str]:
    """Returns the attributes in the given order, without None."""
    text = {True: "true", False: "false"}
    return {k: text[v] if isinstance(v, bool) else str(v) for k, v in values.items() if v is not None}
