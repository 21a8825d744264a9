"""Taylor coefficients of functions over a range of time, as intervals, which bound the error of a polynomial.

A series is a list of intervals `(low, high)`. The k-th one contains f^(k)(t) / k! for every t of the range, up to rounding. Omitted
coefficients are zero. A range of one point gives the Taylor coefficients at that point.
"""

from __future__ import annotations

import math

Interval = tuple[float, float]
Series = list[Interval]


class Unbounded(Exception):
    """A function has no finite bound over the range; it may have one on a part of it."""


def constant(x: float) -> Series:
    """Returns the series of a number."""
    return [(x, x)]


def time_in(low: float, high: float) -> Series:
    """Returns the series of the time itself."""
    return [(low, high), (1.0, 1.0)]


def add(a: Series, b: Series) -> Series:
    """Returns a + b."""
    if len(a) < len(b):
        a, b = b, a
    return [(x[0] + y[0], x[1] + y[1]) for x, y in zip(a, b, strict=False)] + a[len(b) :]


def negative(a: Series) -> Series:
    """Returns -a."""
    return [(-high, -low) for low, high in a]


def multiply(a: Series, b: Series, order: int) -> Series:
    """Returns a b up to the order."""
    return [_sum_of_products(a, b, k, 0) for k in range(min(len(a) + len(b) - 1, order + 1))]


def divide(a: Series, b: Series, order: int) -> Series:
    """Returns a / b."""
    result: Series = []
    for k in range(len(a) if len(b) == 1 else order + 1):
        rest = _minus(a[k] if k < len(a) else (0.0, 0.0), _sum_of_products(b, result, k, 1))
        result.append(_quotient(rest, b[0]))
    return result


def exponential(a: Series, order: int) -> Series:
    """Returns exp a."""
    result = [(_finite(math.exp, a[0][0]), _finite(math.exp, a[0][1]))]
    if len(a) > 1:
        for k in range(1, order + 1):
            result.append(_scaled(_sum_of_products(_weighted(a), result, k, 1), 1 / k))
    return result


def sine_and_cosine(a: Series, order: int) -> tuple[Series, Series]:
    """Returns sin a and cos a."""
    sine, cosine = [_sine(a[0], math.sin, -math.pi / 2)], [_sine(a[0], math.cos, -math.pi)]
    if len(a) > 1:
        slopes = _weighted(a)
        for k in range(1, order + 1):
            now = _scaled(_sum_of_products(slopes, cosine, k, 1), 1 / k), _scaled(_sum_of_products(slopes, sine, k, 1), -1 / k)
            sine.append(now[0])
            cosine.append(now[1])
    return sine, cosine


def power(a: Series, exponent: float, order: int) -> Series:
    """Returns a to a constant power; a base that is not positive requires an integer power."""
    low, high = a[0]
    whole = abs(exponent) < 1e6 and exponent == int(exponent)
    if not whole and low < 0 or exponent < 0 and low <= 0 <= high:
        raise Unbounded
    ends = sorted(_finite(lambda x: x**exponent, x) for x in (low, high))
    if whole and exponent % 2 == 0 and low < 0 < high:
        ends[0] = 0.0
    result = [(ends[0], ends[1])]
    if len(a) == 1 or exponent == 0 or order == 0:
        return result
    if low <= 0 <= high:
        if not whole or exponent > 30:
            raise Unbounded  # derivatives of a fractional power do not exist at 0
        rest = power(a, exponent - 1, order)
        return result + multiply(a, rest, order)[1:]
    for k in range(1, order + 1):
        terms = (0.0, 0.0)
        for i in range(1, min(k, len(a) - 1) + 1):
            terms = _plus(terms, _scaled(_product(a[i], result[k - i]), exponent * i - (k - i)))
        result.append(_quotient(terms, (k * low, k * high)))
    return result


def logarithm(a: Series, order: int) -> Series:
    """Returns the natural logarithm of a."""
    if a[0][0] <= 0:
        raise Unbounded
    result = [(math.log(a[0][0]), math.log(a[0][1]))]
    for k in range(1, order + 1 if len(a) > 1 else 1):
        rest = _scaled(_sum_of_products(a, _weighted(result), k, 1), 1 / k)
        result.append(_quotient(_minus(a[k] if k < len(a) else (0.0, 0.0), rest), a[0]))
    return result


def magnitude(a: Interval) -> float:
    """Returns the largest absolute value; infinite if there is no bound."""
    value = max(abs(a[0]), abs(a[1]))
    return math.inf if math.isnan(a[0]) or math.isnan(a[1]) else value


def _plus(a: Interval, b: Interval) -> Interval:
    return a[0] + b[0], a[1] + b[1]


def _minus(a: Interval, b: Interval) -> Interval:
    return a[0] - b[1], a[1] - b[0]


def _scaled(a: Interval, factor: float) -> Interval:
    return (a[0] * factor, a[1] * factor) if factor >= 0 else (a[1] * factor, a[0] * factor)


def _product(a: Interval, b: Interval) -> Interval:
    if a[0] == a[1]:
        return _scaled(b, a[0])
    if b[0] == b[1]:
        return _scaled(a, b[0])
    ends = (a[0] * b[0], a[0] * b[1], a[1] * b[0], a[1] * b[1])
    return min(ends), max(ends)


def _quotient(a: Interval, b: Interval) -> Interval:
    if b[0] <= 0 <= b[1]:
        raise Unbounded
    ends = (a[0] / b[0], a[0] / b[1], a[1] / b[0], a[1] / b[1])
    return min(ends), max(ends)


def _sum_of_products(a: Series, b: Series, k: int, first: int) -> Interval:
    """Returns the sum of a_i b_(k-i) for i from `first`."""
    low = high = 0.0
    for i in range(max(first, k - len(b) + 1), min(k, len(a) - 1) + 1):
        term = _product(a[i], b[k - i])
        low += term[0]
        high += term[1]
    return low, high


def _weighted(a: Series) -> Series:
    return [_scaled(x, i) for i, x in enumerate(a)]


def _finite(function, x: float) -> float:
    try:
        return function(x)
    except (OverflowError, ValueError, ZeroDivisionError):
        raise Unbounded from None


def _sine(a: Interval, function, trough: float) -> Interval:
    """Returns the range of sin or cos, which has a minimum at `trough`."""
    turn = 2 * math.pi
    if not a[1] - a[0] < turn:
        return -1.0, 1.0
    ends = function(a[0]), function(a[1])
    holds = [math.floor((a[1] - at) / turn) != math.floor((a[0] - at) / turn) for at in (trough, trough + math.pi)]
    return -1.0 if holds[0] else min(ends), 1.0 if holds[1] else max(ends)
