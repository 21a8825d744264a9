"""Reads the numeric arrays of a MATLAB level 5 file (.mat): tagged elements, plain or compressed."""

from __future__ import annotations

import struct
import zlib
from pathlib import Path

import numpy as np

from build_fmu.errors import UserError
from build_fmu.importers.fields import LARGEST
from build_fmu.importers.matlab_expression import Values

NUMBERS = {1: "i1", 2: "u1", 3: "i2", 4: "u2", 5: "i4", 6: "u4", 7: "f4", 9: "f8", 12: "i8", 13: "u8"}  # data type of an element
MATRIX, COMPRESSED = 14, 15
STRUCT, NUMERIC_CLASSES = 2, range(6, 16)
COMPLEX = 0x0800


def read_values(path: Path) -> Values:
    """Returns the numeric variables, also those in structs; strings and cells are skipped. Raises UserError for a damaged file."""
    try:
        content = path.read_bytes()
    except OSError as error:
        raise UserError(f"cannot read '{path}': {error.strerror}") from None
    if content.startswith(b"\x89HDF") or content[:10] == b"MATLAB 7.3":
        raise UserError(f"'{path}' is a MATLAB 7.3 file: save it again with save('{path.name}', '-v7')")
    if len(content) < 128 or content[126:128] not in (b"IM", b"MI"):
        raise UserError(f"'{path}' is not a MATLAB level 5 file")
    order = "<" if content[126:128] == b"IM" else ">"
    values = Values(path)
    try:
        for kind, data in _elements(content[128:], order):
            if kind == COMPRESSED:
                inflate = zlib.decompressobj()
                kind, data = next(_elements(inflate.decompress(data, LARGEST), order))
            if kind == MATRIX:
                _store(values, *_matrix(data, order))
    except (struct.error, zlib.error, ValueError, StopIteration, IndexError, RecursionError):
        raise UserError(f"'{path}' is damaged: inconsistent element sizes") from None
    return values


def _store(values: Values, name: str, content: np.ndarray | dict | None) -> None:
    """Stores a variable; a field of a struct is stored under its own name unless a variable has that name."""
    if isinstance(content, dict):
        for field, inner in content.items():
            if not isinstance(inner, dict):
                _store(values, field if field not in values.arrays else f"{name}.{field}", inner)
    elif content is not None:
        values.arrays[name] = content


def _elements(data: bytes, order: str):
    """Yields (data type, bytes) of each element; a small element holds its data in the tag."""
    at = 0
    while at + 8 <= len(data):
        kind, size = struct.unpack_from(order + "II", data, at)
        if kind >> 16:
            size, kind = kind >> 16, kind & 0xFFFF
            yield kind, data[at + 4 : at + 4 + size]
            at += 8
            continue
        if at + 8 + size > len(data):
            raise ValueError
        yield kind, data[at + 8 : at + 8 + size]
        # compressed elements are not padded
        at += 8 + size + (-size % 8 if kind != COMPRESSED else 0)


def _matrix(data: bytes, order: str) -> tuple[str, np.ndarray | dict | None]:
    parts = list(_elements(data, order))
    flags = struct.unpack_from(order + "I", parts[0][1])[0]
    shape = np.frombuffer(parts[1][1], order + "i4")
    name = parts[2][1].decode("ascii", "replace")
    if flags & 0xFF == STRUCT and shape.prod() == 1:
        size = struct.unpack_from(order + "i", parts[3][1])[0]
        fields = [parts[4][1][i : i + size].rstrip(b"\0").decode("ascii", "replace") for i in range(0, len(parts[4][1]), size)]
        return name, {field: _matrix(inner, order)[1] for field, (_, inner) in zip(fields, parts[5:], strict=True)}
    if flags & 0xFF not in NUMERIC_CLASSES or flags & COMPLEX or len(shape) != 2:
        return name, None
    kind, numbers = parts[3] if len(parts) > 3 else (9, b"")
    array = np.frombuffer(numbers, order + NUMBERS[kind]) if kind in NUMBERS else None
    if array is None or array.size != shape.prod():
        raise ValueError
    return name, array.astype(float).reshape(shape, order="F")
