"""Checks of the arguments of Python functions: a wrong one is a UserError."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Mapping, Sequence
from numbers import Integral
from pathlib import Path

import numpy as np
from numpy.typing import ArrayLike

from build_fmu.errors import UserError, listed


def number(what: str, value: object) -> float:
    """Returns a number, also one that is not finite."""
    try:
        return float(value)
    except (TypeError, ValueError):
        raise UserError(f"{what} must be a number, got {_shown(value)}") from None


def finite(kind: str, name: str, value):
    """Returns the value of a parameter or input; raises UserError for anything but a finite number."""
    try:
        known = math.isfinite(float(value))
    except (TypeError, ValueError):
        raise UserError(f"{kind} '{name}' must be a number or a string, got {type(value).__name__}") from None
    if not known:
        raise UserError(f"{kind} '{name}' must be finite, got {value}")
    return value


def positive(what: str, value: object, unit: str = "time in s") -> float:
    """Returns a finite number above 0."""
    try:
        found = float(value)
    except (TypeError, ValueError):
        found = math.nan
    if not (math.isfinite(found) and found > 0):
        raise UserError(f"{what} must be a positive {unit}, got {_shown(value)}")
    return found


def whole(name: str, value: int, least: int) -> int:
    """Returns an integer of at least this value."""
    if not isinstance(value, Integral) or value < least:
        raise UserError(f"'{name}' must be an integer of at least {least}, got {_shown(value)}")
    return value


def names_of(what: str, names: Iterable[str] | None) -> tuple[str, ...]:
    """Returns a list of names; None: an empty one."""
    found = () if names is None else names
    if isinstance(found, (str, bytes)) or not isinstance(found, Iterable):
        raise UserError(f"{what} must be a list of names, got {_shown(names)}")
    found = tuple(found)
    for name in found:
        if not isinstance(name, str):
            raise UserError(f"{what} must be a list of names, got the entry {_shown(name)}")
    return found


def mapping(what: str, values: Mapping | None) -> dict:
    """Returns values by name; None: no values."""
    if values is not None and not isinstance(values, Mapping):
        raise UserError(f"{what} must be a dictionary of values by name, got {_shown(values)}")
    return dict(values or {})


def path_of(what: str, value: str | Path) -> Path:
    """Returns the path of a file."""
    try:
        return Path(value)
    except TypeError:
        raise UserError(f"{what} must be a path, got {_shown(value)}") from None


def numbers(values: ArrayLike, what: str) -> np.ndarray:
    """Returns an array of numbers."""
    try:
        return np.asarray(values, dtype=float)
    except (TypeError, ValueError) as error:
        raise UserError(f"{what} must be numbers: {error}") from None


def vector(values: ArrayLike, names: Sequence[str], letter: str) -> np.ndarray:
    """Returns a copy of finite numbers, one for each name."""
    array = np.array(numbers(values, f"'{letter}'"))
    if array.shape != (len(names),):
        raise UserError(f"'{letter}' must have the shape ({len(names)},) ({listed(names) or 'no entries'}), got {array.shape}")
    if not np.isfinite(array).all():
        raise UserError(f"'{letter}' is not finite: entry '{names[int(np.argmin(np.isfinite(array)))]}'")
    return array


def each(values: ArrayLike, names: Sequence[str], what: str) -> np.ndarray:
    """Returns a number for each name; a single one applies to all."""
    array = numbers(values, f"'{what}'")
    if array.shape not in ((), (len(names),)):
        raise UserError(f"'{what}' must be a number or have the shape ({len(names)},) ({listed(names)}), got {array.shape}")
    return np.array(np.broadcast_to(array, len(names)))


def measured(values: ArrayLike, names: Sequence[str], letter: str) -> np.ndarray:
    """Returns rows of finite measurements."""
    array = numbers(values, f"'{letter}'")
    if array.ndim != 2 or array.shape[1] != len(names) or not np.isfinite(array).all():
        raise UserError(f"'{letter}' must be finite and have the shape (rows, {len(names)}), got {array.shape}")
    return array


def by_rows(function: Callable[..., np.ndarray], *arguments: ArrayLike) -> np.ndarray:
    """Applies a function of vectors to rows; a vector belongs to each row of the others."""
    arrays = [numbers(a, "arguments") for a in arguments]
    if all(a.ndim < 2 for a in arrays):
        return function(*arrays)
    count = max(len(a) for a in arrays if a.ndim > 1)
    if any(a.ndim > 2 or (a.ndim == 2 and len(a) != count) for a in arrays):
        raise UserError(f"the arguments must be vectors or have {count} rows, got shapes {', '.join(str(a.shape) for a in arrays)}")
    return np.array([function(*(a[i] if a.ndim == 2 else a for a in arrays)) for i in range(count)])


def _shown(value: object) -> str:
    """Returns a short text in one line."""
    text = f"'{value}'" if isinstance(value, str) else " ".join(repr(value).split())
    return text if len(text) <= 60 else f"a {type(value).__name__}"
