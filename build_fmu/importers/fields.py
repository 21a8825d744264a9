"""Checked access to the fields of a parsed file; errors name the file and the field."""

from __future__ import annotations

import math
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from build_fmu.errors import UserError, did_you_mean

LARGEST = 50_000_000  # bytes


class Fields:
    """A mapping of the file with its path, for example `bodies[2].joint`."""

    def __init__(self, source: str, where: str, data: Any) -> None:
        if not isinstance(data, dict):
            raise UserError(f"{source}: '{where}' must be an object, got {_kind(data)}")
        self.source, self.where, self.data = source, where, data

    def error(self, key: str, sentence: str) -> UserError:
        """Returns the exception for a field of this object."""
        return UserError(f"{self.source}: {self._path(key)}: {sentence}")

    def known(self, *keys: str) -> None:
        """Raises UserError for a key that is not among the given ones."""
        for key in self.data:
            if key not in keys:
                raise UserError(f"{self.source}: {self._path(key)}: unknown field{did_you_mean(key, keys)}")

    def need(self, key: str) -> Any:
        """Returns the value of a required field."""
        if key not in self.data:
            raise UserError(f"{self.source}: {self._path(key)} is missing")
        return self.data[key]

    def text(self, key: str, default: str | None = None, among: Sequence[str] = ()) -> str:
        value = self.need(key) if default is None else self.data.get(key, default)
        if not isinstance(value, str):
            raise self.error(key, f"must be a string, got {_kind(value)}")
        if among and value not in among:
            raise self.error(key, f"must be one of {', '.join(among)}, got '{value}'{did_you_mean(value, among)}")
        return value

    def number(self, key: str, default: float | None = None) -> float:
        value = self.need(key) if default is None else self.data.get(key, default)
        return self._number(key, value)

    def index(self, key: str, low: int, high: int) -> int:
        """Returns an integer from low to high."""
        value = self.need(key)
        if isinstance(value, bool) or not isinstance(value, int) or not low <= value <= high:
            raise self.error(key, f"must be an integer from {low} to {high}, got {_short(value)}")
        return value

    def vector(self, key: str, length: int, default: Sequence[float] | None = None) -> list[float]:
        value = self.need(key) if default is None else self.data.get(key, list(default))
        if not isinstance(value, list) or len(value) != length:
            raise self.error(key, f"must be {length} numbers, got {_short(value)}")
        return [self._number(f"{key}[{i}]", x) for i, x in enumerate(value)]

    def list(self, key: str) -> list[Any]:
        value = self.data.get(key, [])
        if not isinstance(value, list):
            raise self.error(key, f"must be a list, got {_kind(value)}")
        return value

    def inner(self, key: str) -> Fields:
        return Fields(self.source, self._path(key, quoted=False), self.need(key))

    def items(self, key: str) -> list[Fields]:
        return [Fields(self.source, f"{self._path(key, quoted=False)}[{i}]", x) for i, x in enumerate(self.list(key))]

    def _number(self, key: str, value: Any) -> float:
        if isinstance(value, bool) or not isinstance(value, int | float):
            raise self.error(key, f"must be a number, got {_kind(value)}")
        if not math.isfinite(value):
            raise self.error(key, f"must be a finite number, got {value}")
        return float(value)

    def _path(self, key: str, quoted: bool = True) -> str:
        path = f"{self.where}.{key}" if self.where else key
        return f"'{path}'" if quoted else path


def read_text(path: Path) -> str:
    """Returns the content of a text file; raises UserError."""
    try:
        if path.stat().st_size > LARGEST:
            raise UserError(f"'{path}' is larger than {LARGEST // 1_000_000} MB: too large for a description of a mechanism")
        content = path.read_bytes()
        # Excel's "Unicode text" is UTF-16
        return content.decode("utf-16" if content[:2] in (b"\xff\xfe", b"\xfe\xff") else "utf-8-sig")
    except UnicodeDecodeError:
        return content.decode("latin-1")
    except OSError as error:
        raise UserError(f"cannot read '{path}': {error.strerror}") from None


def _kind(value: Any) -> str:
    names = {bool: "true or false", str: "a string", list: "a list", dict: "an object", type(None): "null"}
    return names.get(type(value), f"the number {value}" if isinstance(value, int | float) else type(value).__name__)


def _short(value: Any) -> str:
    text = repr(value)
    return text if len(text) <= 60 else text[:57] + "…"
