"""The expressions of a ReDySim input file: numbers, names with fields, + - * / ^, brackets, ranges, elements, transposes, functions.

Other names are function files in the folder of the input file.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from pathlib import Path

import numpy as np

from build_fmu.errors import UserError, did_you_mean
from build_fmu.importers.matlab_text import Source, Token

LARGEST, DEEPEST = 100_000, 100
ELEMENTWISE: dict[str, Callable] = {
    "sqrt": np.sqrt, "sin": np.sin, "cos": np.cos, "tan": np.tan, "abs": np.abs, "asin": np.arcsin, "acos": np.arccos,
    "atan": np.arctan, "exp": np.exp, "deg2rad": np.deg2rad, "rad2deg": np.rad2deg,
}  # fmt: skip
FILLED: dict[str, Callable] = {"zeros": np.zeros, "ones": np.ones, "eye": lambda shape: np.eye(*shape)}
OTHERS = (*FILLED, "sum", "length", "numel", "transpose", "atan2")
CONSTANTS = {"pi": math.pi, "eps": 2.0**-52}


class Values:
    """The variables of a file: 2-D arrays by name, and the line where each got its value."""

    def __init__(self, path: Path) -> None:
        self.path = path
        self.arrays: dict[str, np.ndarray] = {}
        self.lines: dict[str, int] = {}
        self.outputs: list[str] = []  # of the function header, in order; empty for a .mat file
        self.skipped: list[str] = []  # errors that a tolerant reader skipped


Call = Callable[[str, Sequence[np.ndarray]], "Values | None"]


class Expressions:
    """Evaluates the expression at the current token of `stream`; `call(name, arguments)` runs a function file, None if there is none."""

    def __init__(self, source: Source, stream: list[Token], call: Call | None) -> None:
        self.source, self.stream, self.call = source, stream, call
        self.at, self.depth = 0, 0
        self.values = Values(source.path)

    def _expression(self, ranges: bool = False) -> np.ndarray:
        self.depth += 1
        if self.depth > DEEPEST:
            raise self.error("nested too deeply")
        value = self._sum()
        if ranges and self.peek().text == ":":
            self.at += 1
            stop, step = self._sum(), np.ones((1, 1))
            if self.peek().text == ":":
                self.at += 1
                step, stop = stop, self._sum()
            value = self._range(*(self._scalar(v, "a range") for v in (value, step, stop)))
        self.depth -= 1
        return value

    def _range(self, start: float, step: float, stop: float) -> np.ndarray:
        count = math.floor((stop - start) / step * (1 + 1e-12) + 1e-9) + 1 if step else 0
        if count > LARGEST:
            raise self.error(f"a range of more than {LARGEST} elements")
        return start + step * np.arange(max(0, count), dtype=float).reshape(1, -1)

    def _sum(self) -> np.ndarray:
        value = self._product()
        while self.peek().text in ("+", "-") and self.peek().kind == "mark" and not self._starts_element():
            operator = self.next().text
            value = self._apply(operator, value, self._product())
        return value

    def _starts_element(self) -> bool:
        """Inside [ ], `1 -2` are two elements and `1 - 2` or `1-2` are one."""
        token, after = self.peek(), self.stream[self.at + 1]
        return self.in_matrix and token.spaced and not after.spaced

    def _product(self) -> np.ndarray:
        value = self._signed()
        while self.peek().kind == "mark" and self.peek().text in ("*", "/", ".*", "./"):
            operator = self.next().text
            value = self._apply(operator, value, self._signed())
        return value

    def _signed(self) -> np.ndarray:
        token = self.peek()
        if token.kind == "mark" and token.text in ("+", "-"):
            self.at += 1
            self.depth += 1
            if self.depth > DEEPEST:
                raise self.error("nested too deeply")
            value = self._signed()
            self.depth -= 1
            return -value if token.text == "-" else value
        return self._power()

    def _power(self) -> np.ndarray:
        value = self._element_of()
        while self.peek().kind == "mark" and self.peek().text in ("^", ".^"):
            operator = self.next().text
            negative = self.peek().text == "-"
            self.at += negative or self.peek().text == "+"
            exponent = self._element_of()
            value = self._apply(operator, value, -exponent if negative else exponent)
        return value

    def _element_of(self) -> np.ndarray:
        token = self.next()
        if token.kind == "number":
            value = np.array([[float(token.text.lower().replace("d", "e"))]])
        elif token.text == "(":
            inside, self.in_matrix = self.in_matrix, False
            value = self._expression(ranges=True)
            self.expect(")")
            self.in_matrix = inside
        elif token.text == "[":
            value = self._matrix()
        elif token.kind == "name":
            value = self._named(token)
        else:
            self.at -= 1
            raise self.error(f"expected a number, a name or a bracket, got '{_shown(token)}'")
        while self.peek().text in ("'", ".'") and self.peek().kind == "mark":
            self.at += 1
            value = value.T
        return value

    in_matrix = False

    def _matrix(self) -> np.ndarray:
        inside, self.in_matrix = self.in_matrix, True
        rows: list[list[np.ndarray]] = [[]]
        while self.peek().text != "]":
            token = self.peek()
            if token.text == ";":
                self.at += 1
                rows.append([])
            elif token.text == ",":
                self.at += 1
            elif token.kind in ("stop", "end"):
                raise self.error("'[' is not closed")
            else:
                rows[-1].append(self._expression(ranges=True))
        self.at += 1
        self.in_matrix = inside
        try:
            blocks = [np.hstack(row) for row in rows if row]
            return np.vstack(blocks) if blocks else np.zeros((0, 0))
        except ValueError:
            raise self.error("the rows of the matrix differ in length") from None

    def _named(self, token: Token) -> np.ndarray:
        name, arrays = token.text, self.values.arrays
        # inside [ ], `a (1)` are two elements
        called = self.peek().text == "(" and not (self.in_matrix and self.peek().spaced)
        if name in arrays:
            return self._pick(name, self._arguments(arrays[name])) if called else arrays[name]
        if name in CONSTANTS and not called:
            return np.array([[CONSTANTS[name]]])
        if name == "end" and self.array_size is not None:
            return np.array([[float(self.array_size)]])
        if called and (name in ELEMENTWISE or name in OTHERS):
            return self._function(token, self._arguments(None))
        other = self.call(name, self._arguments(None) if called else []) if self.call else None
        if other is not None:
            if not other.outputs or other.outputs[0] not in other.arrays:
                raise self.source.error(token.line, f"{name}() returns no result")
            return other.arrays[other.outputs[0]]
        near = did_you_mean(name, [*arrays, *CONSTANTS, *ELEMENTWISE, *OTHERS])
        raise self.source.error(token.line, f"'{name}' is undefined{near}")

    array_size: int | None = None

    def _arguments(self, array: np.ndarray | None) -> list[np.ndarray]:
        """Reads `( ... )`; inside the index of an array `end` is its length."""
        self.expect("(")
        inside, size = self.in_matrix, self.array_size
        self.in_matrix, self.array_size = False, None if array is None else array.size
        found = []
        while self.peek().text != ")":
            if self.peek().text == ":" and self.stream[self.at + 1].text in (")", ","):
                raise self.error("':' as an index is not supported")
            found.append(self._expression(ranges=True))
            if self.peek().text == ",":
                self.at += 1
            elif self.peek().text != ")":
                raise self.error(f"expected ')', got '{_shown(self.peek())}'")
        self.at += 1
        self.in_matrix, self.array_size = inside, size
        return found

    def _pick(self, name: str, indices: list[np.ndarray]) -> np.ndarray:
        array, line = self.values.arrays[name], self.stream[self.at - 1].line
        wanted = [[self._index(x, line, name) for x in i.ravel()] for i in indices]
        try:
            if len(wanted) == 1:
                flat = array.ravel(order="F")[wanted[0]]
                return flat.reshape(-1, 1) if array.shape[1] == 1 and array.shape[0] > 1 else flat.reshape(1, -1)
            if len(wanted) == 2:
                return array[np.ix_(wanted[0], wanted[1])]
        except IndexError:
            raise self.source.error(
                line, f"index {max(max(w, default=0) for w in wanted) + 1} exceeds the {array.size} elements of '{name}'"
            ) from None
        raise self.source.error(line, f"'{name}' takes one or two indices")

    def _index(self, x: float, line: int, name: str) -> int:
        if not (x == x and abs(x) < 1e9 and x == int(x) and x >= 1):
            raise self.source.error(line, f"an index of '{name}' must be a positive integer, got {x:g}")
        return int(x) - 1

    def _function(self, token: Token, arguments: list[np.ndarray]) -> np.ndarray:
        name, count = token.text, len(arguments)
        if name in FILLED:
            return self._filled(token, [self._scalar(a, name) for a in (arguments or [np.ones((1, 1))])])
        if count != (2 if name == "atan2" else 1):
            raise self.source.error(token.line, f"{name} takes {2 if name == 'atan2' else 1} argument(s), got {count}")
        argument = arguments[0]
        if name == "atan2":
            return np.arctan2(*arguments)
        if name == "sum":
            return np.atleast_2d(argument.sum(axis=0 if min(argument.shape) > 1 else None))
        if name in ("length", "numel"):
            return np.array([[float(max(argument.shape) if name == "length" and argument.size else argument.size)]])
        if name == "transpose":
            return argument.T
        with np.errstate(all="ignore"):
            return self._finite(ELEMENTWISE[name](argument), token.line)

    def _filled(self, token: Token, sizes: list[float]) -> np.ndarray:
        sizes = sizes * 2 if len(sizes) == 1 else sizes
        if len(sizes) != 2 or any(not 0 <= s <= LARGEST for s in sizes) or sizes[0] * sizes[1] > LARGEST:
            raise self.source.error(token.line, f"{token.text}({', '.join(f'{s:g}' for s in sizes)}) is not supported")
        return FILLED[token.text]((int(sizes[0]), int(sizes[1])))

    def _apply(self, operator: str, x: np.ndarray, y: np.ndarray) -> np.ndarray:
        line = self.stream[self.at - 1].line
        if operator in ("*", "/", "^") and x.size != 1 and y.size != 1:
            if operator != "*" or x.shape[1] != y.shape[0]:
                raise self.source.error(
                    line, f"'{operator}': incompatible arrays of {x.shape[0]} x {x.shape[1]} and {y.shape[0]} x {y.shape[1]}"
                )
            return self._finite(x @ y, line)
        if x.size != 1 and y.size != 1 and x.shape != y.shape:
            raise self.source.error(
                line, f"'{operator}': incompatible arrays of {x.shape[0]} x {x.shape[1]} and {y.shape[0]} x {y.shape[1]}"
            )
        with np.errstate(all="ignore"):
            table = {"+": np.add, "-": np.subtract, "*": np.multiply, "/": np.divide, "^": np.power}
            return self._finite(table[operator.lstrip(".")](x, y), line)

    def _finite(self, value: np.ndarray, line: int) -> np.ndarray:
        if not np.all(np.isfinite(value)):
            raise self.source.error(line, "the result is not a finite real number")
        return value

    def _scalar(self, value: np.ndarray, what: str) -> float:
        if value.size != 1:
            raise self.error(f"{what} requires scalars")
        return value.item()

    # tokens

    def peek(self) -> Token:
        return self.stream[self.at]

    def next(self) -> Token:
        token = self.stream[self.at]
        if token.kind == "stop":
            raise self.error("unexpected end of file in a statement")
        self.at += 1
        return token

    def name(self) -> str:
        token = self.next()
        if token.kind != "name":
            raise self.source.error(token.line, f"expected a name, got '{_shown(token)}'")
        return token.text

    def expect(self, text: str) -> None:
        token = self.peek()
        if token.text != text:
            raise self.error(f"expected '{text}', got '{_shown(token)}'")
        self.at += 1

    def error(self, sentence: str) -> UserError:
        return self.source.error(self.peek().line, sentence)


def _shown(token: Token) -> str:
    return "the end of the line" if token.text == "\n" else token.text or "the end of the file"
