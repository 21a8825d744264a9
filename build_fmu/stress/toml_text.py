"""Writes a parsed TOML document back: tables, arrays of tables, numbers that read back exactly. Comments are lost."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any


def toml_text(document: dict[str, Any]) -> str:
    """Returns the text of the document."""
    return "\n".join(_table(document, "")) + "\n"


def _table(table: dict[str, Any], path: str) -> Iterator[str]:
    # plain values come first: after a header they would belong to it
    for key, value in table.items():
        if not isinstance(value, dict) and not _is_table_list(value):
            yield f"{key} = {_value(value)}"
    for key, value in table.items():
        name = f"{path}{key}"
        if isinstance(value, dict):
            yield f"\n[{name}]"
            yield from _table(value, f"{name}.")
        elif _is_table_list(value):
            for row in value:
                yield f"\n[[{name}]]"
                yield from _table(row, f"{name}.")


def _is_table_list(value: Any) -> bool:
    return isinstance(value, list) and bool(value) and all(isinstance(row, dict) for row in value)


def _value(value: Any) -> str:
    if isinstance(value, bool):
        return "true" if value else "false"
    if isinstance(value, str):
        escaped = "".join(f"\\u{ord(c):04X}" if ord(c) < 0x20 or c in '"\\\x7f' else c for c in value)
        return f'"{escaped}"'
    if isinstance(value, list):
        return "[" + ", ".join(map(_value, value)) + "]"
    if isinstance(value, dict):
        return "{" + ", ".join(f"{k} = {_value(v)}" for k, v in value.items()) + "}"
    return repr(value)
