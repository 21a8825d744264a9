"""Writes terminalsAndIcons.xml of FMI 3.0: each frame with force inputs is a terminal of its forces and motion."""

from __future__ import annotations

from xml.etree import ElementTree as xml

from build_fmu.fmu.description import attributes, file_content
from build_fmu.model.describe import Description, Variable

FLOWS = ("force", "torque")  # of a frame, as inputs


def terminals(model: Description) -> bytes | None:
    """Returns the XML file's content, UTF-8, or None if no frame has force inputs."""
    ports = dict.fromkeys(v.name.rpartition(".")[0] for v in model.select("input") if v.name.rpartition(".")[2] in ("force", "force[1]"))
    if not ports:
        return None
    root = xml.Element("fmiTerminalsAndIcons", attributes(fmiVersion="3.0"))
    group = xml.SubElement(root, "Terminals")
    for port in ports:
        text = f"Force and torque on frame '{port}', and its motion"
        terminal = xml.SubElement(group, "Terminal", attributes(name=port, matchingRule="bus", description=text))
        for variable in model.variables:
            owner, dot, member = variable.name.partition(".")
            if dot and owner == port and variable.causality in ("input", "output"):
                xml.SubElement(
                    terminal,
                    "TerminalMemberVariable",
                    attributes(variableName=variable.name, memberName=member, variableKind=_kind(variable, member)),
                )
    return file_content(root)


def _kind(variable: Variable, member: str) -> str:
    return "inflow" if variable.causality == "input" and member.startswith(FLOWS) else "signal"
