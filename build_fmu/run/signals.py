"""The inputs of a simulation: `NAME=EXPRESSION`, `NAME=FILE.csv` or a whole `FILE.csv`, as functions of time."""

from __future__ import annotations

import csv
import io
import math
import re
import sys
from bisect import bisect_right
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Protocol

from build_fmu.errors import InvalidArgument, UserError, did_you_mean, named
from build_fmu.run.branches import Split
from build_fmu.run.expressions import Expression, compile_expression
from build_fmu.run.taylor import Interval

# after names in tables, without signs of multiplication
UNITS = ("s", "m", "m/s", "m/s2", "rad", "rad/s", "rad/s2", "N", "Nm", "V", "A", "W", "J", "1", "")
OTHER_TABLES = re.compile(r".*\.(mat|txt|dat|tsv|xlsx?|ods|json|npy|npz|h5|hdf5|parquet)", re.IGNORECASE)
MODES = ("none", "expressions", "all")  # the signals that change during a step
UnitOf = Callable[[str], str | None]  # the unit of a variable, None for an unknown one


class Signal(Protocol):
    """A function of time (s) with Taylor coefficients over a range of time, or a point at which to `Split` the range."""

    def __call__(self, t: float) -> float:
        """Returns the value."""

    def series(self, low: float, high: float, order: int) -> list[Interval]:
        """Returns the coefficients over the range; raises Split where the range must be divided."""


class Table:
    """Linear interpolation between rows, constant outside; of two rows at the same time the later one holds from then on."""

    def __init__(self, times: Sequence[float], values: Sequence[float]) -> None:
        """Takes non-decreasing times (s) and a value for each."""
        self.times, self.values = times, values

    def __call__(self, t: float) -> float:
        """Returns the value."""
        i = bisect_right(self.times, t)
        if i == 0:
            return self.values[0]
        if i == len(self.times):
            return self.values[-1]
        weight = (t - self.times[i - 1]) / (self.times[i] - self.times[i - 1])
        return (1 - weight) * self.values[i - 1] + weight * self.values[i]

    def series(self, low: float, high: float, order: int) -> list[Interval]:
        """Returns value and slope; raises Split for a row inside the range."""
        i = bisect_right(self.times, low)
        if i < len(self.times) and self.times[i] < high:
            grain = 4 * math.ulp(self.times[i])
            raise Split(self.times[i] - grain, self.times[i] + grain)
        ends = sorted((self(low), self(high)))
        if 0 < i < len(self.times):
            slope = (self.values[i] - self.values[i - 1]) / (self.times[i] - self.times[i - 1])
            return [(ends[0], ends[1]), (slope, slope)]
        return [(ends[0], ends[1])]


def parse_inputs(arguments: Sequence[str], find: Callable[[str], str], unit: UnitOf = lambda _: None) -> dict[str, Signal]:
    """Returns the signals by input; `find` checks a name, `unit` returns its unit. Raises UserError, also for duplicate inputs."""
    signals: dict[str, Signal] = {}
    expressions: dict[str, Signal] = {}
    for argument in arguments:
        name, equals, source = (part.strip() for part in argument.partition("="))
        if OTHER_TABLES.fullmatch(source if equals else name):
            raise InvalidArgument(f"'{source or name}' is not a CSV file: tables of inputs are read from CSV only")
        if not equals and _is_table(name):
            new = _columns(Path(name), find, unit)
        elif not equals or not source:
            raise InvalidArgument(f"'{argument}' is not an input: write NAME=EXPRESSION, NAME=FILE.csv or FILE.csv")
        elif _is_table(source):
            new = {find(name): _only_column(Path(source), name, unit)}
        else:
            # equal expressions share one signal, which is analysed once
            new = {find(name): expressions.setdefault(source, expression_of(source, f"input '{name}'"))}
        for key, signal in new.items():
            if key in signals:
                raise InvalidArgument(f"duplicate input '{key}'")
            signals[key] = signal
    return signals


def tables_of(arguments: Sequence[str]) -> list[Path]:
    """Returns the CSV files that the arguments name, without standard input."""
    sources = (argument.rpartition("=")[2].strip() for argument in arguments)
    return [Path(source) for source in sources if _is_table(source) and source != "-"]


def expression_of(text: str, owner: str) -> Expression:
    """Returns the function of t (s) in an argument; raises InvalidArgument, whose message begins with the owner."""
    try:
        return compile_expression(text)
    except UserError as error:
        raise InvalidArgument(f"{owner}: {error}") from None


def number_of(text: str, owner: str) -> float:
    """Returns the value of an expression without t; raises UserError, whose message begins with the owner."""
    expression = expression_of(text, owner)
    if not expression.is_constant:
        raise InvalidArgument(f"{owner}: '{text}' depends on t, but must be constant")
    try:
        return expression(0.0)
    except UserError as error:
        raise UserError(f"{owner}: {error}") from None


def _is_table(source: str) -> bool:
    return source == "-" or source.lower().endswith(".csv")


def read_table(path: Path, unit: UnitOf = lambda _: None) -> dict[str, list[float]]:
    """Reads a CSV of numbers with a column `time` or `t` (s) that never decreases, returned as `time`; `-` is standard input.

    Columns are separated by semicolons, tabs or commas; with the first two numbers may have decimal commas. A unit after a name, `t [s]`,
    must be an SI unit or rad, and for names that `unit` knows the unit of the variable. Raises UserError with the line.
    """
    try:
        text = (sys.stdin.buffer.read() if path == Path("-") else path.read_bytes()).decode("utf-8-sig")
    except (OSError, UnicodeDecodeError) as error:
        raise UserError(f"cannot read '{path}': {getattr(error, 'strerror', None) or 'not a text file'}") from None
    first = text.partition("\n")[0]
    separator = next((mark for mark in ";\t" if mark in first), ",")
    rows = [[cell.strip().strip('"') for cell in row] for row in csv.reader(io.StringIO(text, newline=""), delimiter=separator)]
    mark = "." if separator == "," else ","  # of decimals
    head = [_without_unit(path, cell, unit) for cell in rows[0]] if rows else []
    if "time" not in head:
        if "t" not in head:
            raise UserError(f"'{path}' has no column 'time' or 't' in the first line{named(head) if any(head) else ''}")
        head[head.index("t")] = "time"
    table: dict[str, list[float]] = {name: [] for name in head}
    if len(table) != len(head):
        raise UserError(f"{path}:1: duplicate column '{next(name for name in head if head.count(name) > 1)}'")
    for line, row in enumerate(rows[1:], start=2):
        if not any(row):
            continue
        if len(row) != len(head):
            raise UserError(f"{path}:{line}: {len(row)} values, but the first line has {len(head)} columns")
        for name, cell in zip(head, row, strict=True):
            table[name].append(_number(cell, f"{path}:{line}: column '{name}'", mark))
        times = table["time"]
        if len(times) > 1 and times[-1] < times[-2]:
            raise UserError(f"{path}:{line}: time decreases from {times[-2]:g} to {times[-1]:g} s")
    if not table["time"]:
        raise UserError(f"'{path}' has no rows")
    return table


def _without_unit(path: Path, cell: str, unit: UnitOf) -> str:
    found = re.fullmatch(r"(\S+)\s+[\[(](.*)[\])]", cell)
    if found is None:
        return cell
    given, known = _plain(found[2]), "s" if found[1] in ("time", "t") else unit(found[1])
    if given not in UNITS:
        raise UserError(f"'{path}': column '{cell}': values must be in SI units and rad")
    if known and given and given != _plain(known):
        raise UserError(f"'{path}': column '{cell}': the unit of '{found[1]}' is {known}")
    return found[1]


def _plain(unit: str) -> str:
    """Returns a unit without signs of multiplication."""
    return re.sub(r"[\s.*·^]", "", unit)


def parse_start(arguments: Sequence[str], kind: str = "start value") -> dict[str, str]:
    """Splits NAME=VALUE arguments; raises UserError for anything else, with the kind of value."""
    values: dict[str, str] = {}
    for argument in arguments:
        name, equals, value = (part.strip() for part in argument.partition("="))
        if not equals or not name or not value:
            raise InvalidArgument(f"'{argument}' is not a {kind}: write NAME=VALUE")
        if name in values:
            raise InvalidArgument(f"duplicate {kind} of '{name}'")
        values[name] = value
    return values


def _columns(path: Path, find: Callable[[str], str], unit: UnitOf) -> dict[str, Signal]:
    table = read_table(path, unit)
    try:
        return {find(column): _column(table, column) for column in table if column != "time"}
    except UserError as error:
        raise UserError(f"{path}:1: {error}") from None


def _column(table: dict[str, list[float]], name: str) -> Signal:
    return Table(table["time"], table[name])


def _only_column(path: Path, name: str, unit: UnitOf) -> Signal:
    table = read_table(path, lambda column: unit(column) if column == name else None)
    others = [column for column in table if column != "time"]
    if name in table:
        return _column(table, name)
    if len(others) == 1:
        return _column(table, others[0])
    raise UserError(f"'{path}' has no column '{name}'{did_you_mean(name, others)}")


def _number(text: str, where: str, mark: str) -> float:
    try:
        value = float(text.replace("_", "?").replace(mark, "."))  # 1_000 is Python's notation
    except ValueError:
        raise UserError(f"{where}: '{text}' is not a number") from None
    if not math.isfinite(value):
        raise UserError(f"{where}: '{text}' is not a finite number")
    return value
