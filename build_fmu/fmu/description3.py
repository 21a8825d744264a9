"""Writes modelDescription.xml (FMI 3.0, model exchange and co-simulation) from a model's table.

The variables are those of the FMI 2.0 description, with the same value references, and `time`, or arrays of them (`arrays.py`).
Equal tables give equal bytes.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import replace
from typing import Any
from xml.etree import ElementTree as xml

from build_fmu.fmu.description import (
    attributes,
    common_elements,
    corrects_states,
    dependencies,
    file_content,
    generation_date,
    identity,
    real,
    reinitialised_states,
)
from build_fmu.model.describe import Description, Unknown, Variable

TIME = 0  # value reference of the independent variable; those of the table start at 1
LONGEST_LIST = 500  # longer lists of dependencies are omitted
TYPES = {"Real": "Float64", "Integer": "Int32"}  # all others have the same name in both versions
# capabilities of FMI 2.0 and their names in FMI 3.0; the others do not exist there
RENAMED = {
    "needsExecutionTool": "needsExecutionTool",
    "canBeInstantiatedOnlyOncePerProcess": "canBeInstantiatedOnlyOncePerProcess",
    "canGetAndSetFMUstate": "canGetAndSetFMUState",
    "canSerializeFMUstate": "canSerializeFMUState",
    "providesDirectionalDerivative": "providesDirectionalDerivatives",
    "canHandleVariableCommunicationStepSize": "canHandleVariableCommunicationStepSize",
    "maxOutputDerivativeOrder": "maxOutputDerivativeOrder",
}


def model_description(model: Description) -> bytes:
    """Returns the XML file's content, UTF-8."""
    root = xml.Element(
        "fmiModelDescription",
        attributes(
            fmiVersion="3.0",
            modelName=model.model_name,
            instantiationToken=model.guid,
            description=model.description or None,
            **model.origin,
            generationTool=model.generation_tool,
            generationDateAndTime=generation_date(),
            variableNamingConvention="structured",
        ),
    )
    if model.model_exchange is not None:
        needed = {"needsCompletedIntegratorStep": corrects_states(model)}
        xml.SubElement(root, "ModelExchange", attributes(modelIdentifier=model.model_identifier, **_flags(model.model_exchange), **needed))
    updates = {"providesIntermediateUpdate": True, "canReturnEarlyAfterIntermediateUpdate": True}
    xml.SubElement(root, "CoSimulation", attributes(modelIdentifier=model.model_identifier, **_flags(model.capabilities), **updates))
    common_elements(root, model)
    variables = xml.SubElement(root, "ModelVariables")
    time = {"name": "time", "valueReference": TIME, "description": "Simulation time", "causality": "independent"}
    xml.SubElement(variables, "Float64", attributes(**time, variability="continuous", unit=_seconds(model)))
    reference = {variable.name: variable.value_reference for variable in model.variables}
    states = reinitialised_states(model)
    for variable in model.variables:
        _variable(variables, variable, reference, variable.name in states)
    structure = xml.SubElement(root, "ModelStructure")
    with_time = (TIME,) if model.depends_on_time else ()
    groups = (
        ("Output", _by_parameters(model, model.outputs)),
        ("ContinuousStateDerivative", _by_parameters(model, model.derivatives)),
        ("InitialUnknown", model.initial_unknowns),
    )
    for tag, rows in groups:
        for row in rows:
            xml.SubElement(structure, tag, valueReference=str(reference[row.name]), **dependencies(row, reference, with_time))
    for name in model.event_indicators if model.model_exchange is not None else []:
        xml.SubElement(structure, "EventIndicator", valueReference=str(reference[name]))
    return file_content(root)


def _by_parameters(model: Description, rows: Sequence[Unknown]) -> Iterator[Unknown]:
    """Yields the rows with the tunable parameters that act on them, which FMI 2.0 does not list: at most those of initialization mode."""
    tunable = {variable.name for variable in model.select("parameter") if variable.variability == "tunable"}
    initially = {row.name: row.dependencies for row in model.initial_unknowns}
    for row in rows:
        given = initially.get(row.name)
        found = tunable if given is None else tunable.intersection(given)
        if row.dependencies is None or not found:
            yield row
        elif len(row.dependencies) + len(found) > LONGEST_LIST:
            yield replace(row, dependencies=None, kinds=None)
        else:
            kinds = [*row.kinds, *["dependent"] * len(found)] if row.kinds else None
            yield replace(row, dependencies=[*row.dependencies, *found], kinds=kinds)


def _flags(capabilities: dict[str, Any]) -> dict[str, Any]:
    flags = {new: capabilities[old] for old, new in RENAMED.items() if old in capabilities}
    # every model with directional derivatives has adjoint ones
    return flags | {"providesAdjointDerivatives": flags.get("providesDirectionalDerivatives", False)}


def _seconds(model: Description) -> str | None:
    return "s" if any(unit["name"] == "s" for unit in model.units) else None


def _variable(parent: xml.Element, variable: Variable, reference: dict[str, int], reinit: bool) -> None:
    kind = TYPES.get(variable.type, variable.type)
    number = real if variable.type == "Real" else lambda value: value
    details: dict[str, Any] = {}
    if variable.type in TYPES:
        details = {"quantity": variable.quantity, "min": number(variable.min), "max": number(variable.max)}
    if variable.type == "Real":
        details |= {"unit": variable.unit, "displayUnit": variable.display_unit, "nominal": real(variable.nominal)}
        derivative = None if variable.derivative is None else reference[variable.derivative]
        readable = variable.causality == "output" and variable.variability == "continuous"
        details |= {"derivative": derivative, "reinit": reinit or None, "intermediateUpdate": readable or None}
    element = xml.SubElement(
        parent,
        kind,
        attributes(**identity(variable), **details, start=None if kind == "String" else _start(variable, number)),
    )
    for length in variable.dimensions:
        xml.SubElement(element, "Dimension", attributes(start=length))
    if kind == "String" and variable.start is not None:
        xml.SubElement(element, "Start", value=variable.start)


def _start(variable: Variable, number: Callable[[Any], Any]) -> Any:
    return " ".join(number(value) for value in variable.start) if isinstance(variable.start, tuple) else number(variable.start)
