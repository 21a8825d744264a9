"""Parses XML into elements that know their line, so that a message can name it."""

from __future__ import annotations

import xml.etree.ElementTree as ET
from pathlib import Path
from xml.parsers import expat

from build_fmu.errors import UserError


def parse(path: Path, content: bytes, names: bool = False) -> tuple[ET.Element, dict[int, int]]:
    """Returns the root and the line of each element by its id(); raises UserError with file, line, column.

    With `names`, tags and attributes of namespaces are called {namespace}name, else as they are written.
    """
    builder, lines = ET.TreeBuilder(), {}
    parser = expat.ParserCreate(namespace_separator="}") if names else expat.ParserCreate()
    parser.buffer_text = True

    def full(name: str) -> str:
        return "{" + name if "}" in name else name

    def start(tag: str, attributes: dict[str, str]) -> None:
        lines[id(builder.start(full(tag), {full(key): value for key, value in attributes.items()}))] = parser.CurrentLineNumber

    def end(tag: str) -> None:
        builder.end(full(tag))

    def entity(*_: object) -> None:
        # entities can blow a small file up without limit
        raise UserError(f"{path}:{parser.CurrentLineNumber}: XML entities are not read")

    parser.StartElementHandler, parser.EndElementHandler = start, end
    parser.CharacterDataHandler, parser.EntityDeclHandler = builder.data, entity
    try:
        parser.Parse(content, True)
    except expat.ExpatError as error:
        raise UserError(f"{path}:{error.lineno}:{error.offset + 1}: no XML: {expat.ErrorString(error.code)}") from None
    return builder.close(), lines
