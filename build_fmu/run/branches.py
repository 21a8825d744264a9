"""Taylor series of expressions over a range of time, and the points at which they are not smooth.

Comparisons, `sign`, `floor`, `abs`, `min` and `max` depend on the sign of a *guard*. The expression is smooth over a range on which
no guard changes its sign. Otherwise `Split` gives the time at which to divide the range.
"""

from __future__ import annotations

import ast
import math
from collections.abc import Callable

from build_fmu.run import taylor
from build_fmu.run.taylor import Interval, Unbounded

Series = Callable[[float, float, int], list[Interval]]


class Split(Exception):
    """The range must be divided: one form holds up to `before`, the next one from `after` (s)."""

    def __init__(self, before: float, after: float) -> None:
        """Takes the last time of one form and the first time of the next one."""
        super().__init__()
        self.before, self.after = before, after


def halves(low: float, high: float) -> Split:
    """Returns the split in the middle."""
    middle = low + (high - low) / 2
    return Split(middle, middle)


def inside(low: float, high: float) -> tuple[float, float]:
    """Returns the range without its end points, at which the adjacent forms may hold."""
    grain = min(4 * math.ulp(max(abs(low), abs(high))), (high - low) / 4)
    return low + grain, high - grain


def series_of(tree: ast.expr) -> Series:
    """Returns the series of a checked expression as a function of the range (s) and the order."""
    node = _compiled(tree)

    def series(low: float, high: float, order: int) -> list[Interval]:
        try:
            return node(low, high, order)
        except Unbounded:
            raise halves(low, high) from None

    return series


def _compiled(tree: ast.expr) -> Series:
    if isinstance(tree, ast.Constant):
        number = taylor.constant(float(tree.value))
        return lambda low, high, order: number
    if isinstance(tree, ast.Name):
        number = taylor.constant(math.pi)
        return (lambda low, high, order: taylor.time_in(low, high)) if tree.id == "t" else (lambda low, high, order: number)
    if isinstance(tree, ast.UnaryOp):
        return _unary(tree)
    if isinstance(tree, ast.BinOp):
        return _binary(tree)
    if isinstance(tree, ast.Call):
        return _call(tree)
    if isinstance(tree, ast.IfExp):
        test, first, second = (_compiled(part) for part in (tree.test, tree.body, tree.orelse))
        return lambda low, high, order: (first if _sign(test, low, high) else second)(low, high, order)
    if isinstance(tree, ast.BoolOp):
        return _chain([_compiled(part) for part in tree.values], isinstance(tree.op, ast.And))
    return _comparison(tree)


def _unary(tree: ast.UnaryOp) -> Series:
    inner = _compiled(tree.operand)
    if isinstance(tree.op, ast.USub):
        return lambda low, high, order: taylor.negative(inner(low, high, order))
    if isinstance(tree.op, ast.Not):
        return lambda low, high, order: taylor.constant(float(not _sign(inner, low, high)))
    return inner


def _binary(tree: ast.BinOp) -> Series:
    first, second = _compiled(tree.left), _compiled(tree.right)
    kind = type(tree.op)
    if kind is ast.Pow:
        return lambda low, high, order: _power(first(low, high, order), second(low, high, order), order)
    rule = {
        ast.Add: lambda a, b, order: taylor.add(a, b),
        ast.Sub: lambda a, b, order: taylor.add(a, taylor.negative(b)),
        ast.Mult: taylor.multiply,
        ast.Div: taylor.divide,
    }[kind]
    return lambda low, high, order: rule(first(low, high, order), second(low, high, order), order)


def _power(base: list[Interval], exponent: list[Interval], order: int) -> list[Interval]:
    if len(exponent) == 1 and exponent[0][0] == exponent[0][1]:
        return taylor.power(base, exponent[0][0], order)
    return taylor.exponential(taylor.multiply(exponent, taylor.logarithm(base, order), order), order)


def _call(tree: ast.Call) -> Series:
    name, arguments = tree.func.id, [_compiled(argument) for argument in tree.args]
    inner = arguments[0]
    if name in ("min", "max"):
        for other in arguments[1:]:
            inner = _chosen(inner, other, -1 if name == "min" else 1)
        return inner
    if name == "abs":
        return lambda low, high, order: (taylor.negative if _sign(inner, low, high) < 0 else list)(inner(low, high, order))
    if name == "sign":
        return lambda low, high, order: taylor.constant(float(_sign(inner, low, high)))
    if name == "floor":
        return lambda low, high, order: taylor.constant(_floor(inner, low, high))
    smooth = {
        "sin": lambda a, order: taylor.sine_and_cosine(a, order)[0],
        "cos": lambda a, order: taylor.sine_and_cosine(a, order)[1],
        "tan": lambda a, order: taylor.divide(*taylor.sine_and_cosine(a, order), order),
        "exp": taylor.exponential,
        "sqrt": lambda a, order: taylor.power(a, 0.5, order),
    }[name]
    return lambda low, high, order: smooth(inner(low, high, order), order)


def _difference(first: Series, second: Series) -> Series:
    return lambda low, high, order: taylor.add(first(low, high, order), taylor.negative(second(low, high, order)))


def _chosen(first: Series, second: Series, side: int) -> Series:
    guard = _difference(first, second)
    return lambda low, high, order: (second if _sign(guard, low, high) * side < 0 else first)(low, high, order)


def _chain(parts: list[Series], both: bool) -> Series:
    def series(low: float, high: float, order: int) -> list[Interval]:
        for part in parts[:-1]:
            if bool(_sign(part, low, high)) != both:
                return part(low, high, order)
        return parts[-1](low, high, order)

    return series


def _comparison(tree: ast.Compare) -> Series:
    terms = [_compiled(part) for part in (tree.left, *tree.comparators)]
    guards = [_difference(a, b) for a, b in zip(terms, terms[1:], strict=False)]
    holds = {ast.Lt: (-1,), ast.LtE: (-1, 0), ast.Gt: (1,), ast.GtE: (0, 1), ast.Eq: (0,), ast.NotEq: (-1, 1)}
    wanted = [holds[type(op)] for op in tree.ops]

    def series(low: float, high: float, order: int) -> list[Interval]:
        return taylor.constant(float(all(_sign(guard, low, high) in signs for guard, signs in zip(guards, wanted, strict=True))))

    return series


def _sign(guard: Series, low: float, high: float) -> int:
    """Returns the sign of the guard inside the range; raises Split where it changes."""
    value, slope = _value_and_slope(guard, low, high)
    if value[0] > 0 or value[1] < 0 or value[0] == value[1]:
        return (value[0] > 0) - (value[0] < 0)
    if slope[0] < 0 < slope[1]:
        raise halves(low, high)
    low, high = inside(low, high)
    first, last = (_at(guard, t) for t in (low, high))
    if first * last < 0:
        raise _crossing(lambda t: _at(guard, t), low, high)
    return (first > 0) - (first < 0) or (last > 0) - (last < 0)


def _floor(inner: Series, low: float, high: float) -> float:
    value, slope = _value_and_slope(inner, low, high)
    if math.floor(value[0]) == math.floor(value[1]):
        return float(math.floor(value[0]))
    if slope[0] < 0 < slope[1]:
        raise halves(low, high)
    low, high = inside(low, high)
    first, last = (_at(inner, t) for t in (low, high))
    below = math.floor(min(first, last))
    if max(first, last) <= below + 1:
        return float(below)
    level = below + 1 if first < last else math.ceil(first) - 1
    raise _crossing(lambda t: _at(inner, t) - level, low, high)


def _value_and_slope(guard: Series, low: float, high: float) -> tuple[Interval, Interval]:
    series = guard(low, high, 1)
    value = series[0]
    if math.isnan(value[0]) or math.isnan(value[1]) or math.inf in (-value[0], value[1]):
        raise Unbounded
    return value, series[1] if len(series) > 1 else (0.0, 0.0)


def _at(guard: Series, t: float) -> float:
    return guard(t, t, 0)[0][0]


def _crossing(guard: Callable[[float], float], low: float, high: float) -> Split:
    """Returns the split at the only zero of a guard, by a modified method of false position."""
    begin, end = guard(low), guard(high)
    for turn in range(200):
        grain = 2 * math.ulp(max(abs(low), abs(high)))
        if high - low <= 2 * grain or begin == 0 or end == 0:
            break
        middle = low - begin * (high - low) / (end - begin)
        # move past the zero, so that both ends approach it
        middle += grain if middle - low < high - middle else -grain
        if turn % 4 == 3 or not low < middle < high:
            middle = low + (high - low) / 2
        value = guard(middle)
        if (value < 0) == (begin < 0) and value != 0:
            low, begin = middle, value
        else:
            high, end = middle, value
    # with an exact zero or rounding, each side must get its own form
    zero = low if begin == 0 else high
    grain = 2 * math.ulp(abs(zero))
    return Split(zero - grain, zero + grain) if begin == 0 or end == 0 else Split(low - grain, high + grain)
