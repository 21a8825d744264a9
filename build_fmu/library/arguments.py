"""Checks of the arguments of `Model`."""

from __future__ import annotations

import math
from numbers import Integral, Real

from build_fmu.errors import UserError


def finite(kind: str, name: str, value):
    """Returns the value; raises UserError for a number that is not finite."""
    if isinstance(value, Real) and not math.isfinite(value):
        raise UserError(f"{kind} '{name}' must be finite, got {value}")
    return value


def positive(what: str, value: float | None) -> float:
    """Returns a time in s above 0; raises UserError for anything else."""
    try:
        time = float(value)
    except (TypeError, ValueError):
        time = math.nan
    if not (math.isfinite(time) and time > 0):
        raise UserError(f"{what} must be a positive time in s, got {value}")
    return time


def whole(name: str, value: int, least: int) -> int:
    """Returns an integer of at least this value; raises UserError for anything else."""
    if not isinstance(value, Integral) or value < least:
        raise UserError(f"'{name}' must be an integer of at least {least}, got {value}")
    return value
