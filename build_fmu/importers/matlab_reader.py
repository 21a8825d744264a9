"""Reads the values that a ReDySim input file assigns: a recursive reader of a small grammar, and never `eval`.

Statements: `x = e`, `x(i) = e`, `x(i, j) = e`, `[x y] = inputs()`, counting `for` loops, function headers. Expressions:
numbers, names with fields, + - * / ^, brackets, ranges, elements, transposes, and the functions below.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from pathlib import Path

import numpy as np

from build_fmu.errors import UserError, did_you_mean
from build_fmu.importers.fields import read_text
from build_fmu.importers.matlab_text import Source, Token, tokens

LARGEST, DEEPEST, MOST_STATEMENTS = 100_000, 100, 500_000
ELEMENTWISE: dict[str, Callable] = {
    "sqrt": np.sqrt, "sin": np.sin, "cos": np.cos, "tan": np.tan, "abs": np.abs, "asin": np.arcsin, "acos": np.arccos,
    "atan": np.arctan, "exp": np.exp, "deg2rad": np.deg2rad, "rad2deg": np.rad2deg,
}  # fmt: skip
OTHERS = ("zeros", "ones", "eye", "sum", "length", "numel", "transpose", "atan2")
CONSTANTS = {"pi": math.pi, "eps": 2.0**-52}
IDLE = ("clc", "clear", "close", "save", "format", "return", "global", "hold", "disp", "fprintf")
UNKNOWN_STATEMENTS = ("if", "while", "switch", "try", "function")


class Values:
    """The variables of a file: 2-D arrays by name, and the line where each got its value."""

    def __init__(self, path: Path) -> None:
        self.path = path
        self.arrays: dict[str, np.ndarray] = {}
        self.lines: dict[str, int] = {}
        self.outputs: list[str] = []  # of the function header, in its order


def read_values(path: Path, call: Callable[[str], Values] | None = None) -> Values:
    """Returns what the file assigns; `call(name)` answers `[a b] = name()`. Raises UserError with file and line."""
    source = Source(path)
    reader = _Reader(source, tokens(source, read_text(path)), call)
    try:
        return reader.read()
    except RecursionError:
        raise UserError(f"{path}: nested too deeply for an input file") from None


class _Reader:
    def __init__(self, source: Source, stream: list[Token], call: Callable[[str], Values] | None) -> None:
        self.source, self.stream, self.call = source, stream, call
        self.at, self.depth, self.count = 0, 0, 0
        self.values = Values(source.path)

    # statements

    def read(self) -> Values:
        self._statements(top=True)
        return self.values

    def _statements(self, top: bool = False) -> None:
        while True:
            token = self.peek()
            if token.kind == "stop":
                if not top:
                    raise self.error("a 'for' without 'end'")
                return
            if token.kind == "end":
                self.at += 1
            elif token.kind == "name" and token.text == "end":
                if not top:
                    return
                self.at += 1  # the end of the function itself
            else:
                self._statement(token)

    def _statement(self, token: Token) -> None:
        self.count += 1
        if self.count > MOST_STATEMENTS:
            raise self.error(f"more than {MOST_STATEMENTS} statements")
        if token.kind == "name" and token.text == "function":
            return self._header()
        if token.kind == "name" and token.text == "for":
            return self._for()
        if token.kind == "name" and token.text in IDLE:
            return self._skip_statement()
        if token.kind == "mark" and token.text == "[":
            self._several()
        elif token.kind == "name" and token.text not in UNKNOWN_STATEMENTS:
            self._assignment()
        else:
            raise self.error(f"cannot read a statement that starts with '{token.text}'; an input file holds assignments and counting loops")
        if self.peek().kind not in ("end", "stop"):
            raise self.error(f"'{self.peek().text}' does not belong here")

    def _header(self) -> None:
        """`function [a b] = name(...)`, `function a = name` or `function name(...)`."""
        self.at += 1
        names: list[str] = []
        while self.peek().kind not in ("end", "stop"):
            token = self.next()
            if token.text == "=":
                self.values.outputs = self.values.outputs or names
                names = []
            elif token.kind == "name":
                names.append(token.text)

    def _for(self) -> None:
        line = self.next().line
        bracket = self.peek().text == "("
        self.at += bracket
        name = self.name()
        self.expect("=")
        steps = self._expression(ranges=True).T
        if bracket:
            self.expect(")")
        body = self.at
        for step in steps:
            self.at = body
            self.values.arrays[name] = np.atleast_2d(step).T
            self._statements()
        if not len(steps):
            self._skip_body(line)
        self.at += 1  # its end

    def _skip_body(self, line: int) -> None:
        depth = 0
        while True:
            token = self.peek()
            if token.kind == "stop":
                raise self.source.error(line, "a 'for' without 'end'")
            if token.kind == "name" and token.text == "end" and not self._inside_brackets():
                if depth == 0:
                    return
                depth -= 1
            depth += token.kind == "name" and token.text == "for"
            self.at += 1

    def _inside_brackets(self) -> bool:
        before = self.stream[self.at - 1] if self.at else None
        return before is not None and before.kind == "mark"

    def _skip_statement(self) -> None:
        while self.peek().kind not in ("end", "stop"):
            self.at += 1

    def _several(self) -> None:
        """`[n dof type ...] = inputs();`: the other file's outputs by position."""
        line = self.next().line
        names = []
        while self.peek().text != "]":
            token = self.next()
            if token.kind == "name" or token.text == "~":
                names.append(token.text)
            elif token.text != ",":
                raise self.source.error(line, f"'{token.text}' does not belong into a list of results")
        self.at += 1
        self.expect("=")
        function = self.name()
        if self.peek().text == "(":
            while self.next().text != ")":
                pass
        if self.call is None or function not in ("inputs", "initials"):
            raise self.source.error(line, f"the function '{function}' is not known here; only inputs() gives several results")
        other = self.call(function)
        if len(names) > len(other.outputs):
            raise self.source.error(line, f"{function}() gives {len(other.outputs)} results, {len(names)} are asked for")
        for name, output in zip(names, other.outputs, strict=False):
            if name != "~" and output in other.arrays:
                self._store(name, other.arrays[output], line)

    def _assignment(self) -> None:
        line = self.peek().line
        name = self.name()
        indices = None
        if self.peek().text == "(":
            indices = self._arguments(self.values.arrays.get(name))
        if self.peek().kind in ("end", "stop") and indices is None:
            raise self.source.error(line, f"'{name}' alone is no assignment")
        self.expect("=")
        value = self._expression(ranges=True)
        if indices is None:
            return self._store(name, value, line)
        self._element(name, indices, value, line)

    def _store(self, name: str, value: np.ndarray, line: int) -> None:
        self.values.arrays[name] = np.array(value)
        self.values.lines[name] = line

    def _element(self, name: str, indices: list[np.ndarray], value: np.ndarray, line: int) -> None:
        if value.size != 1 or any(i.size != 1 for i in indices) or not 1 <= len(indices) <= 2:
            raise self.source.error(line, f"'{name}(...)' takes one number at a time")
        where = [self._index(i.item(), line, name) for i in indices]
        old = self.values.arrays.get(name, np.zeros((0, 0)))
        if len(where) == 1:
            # a vector grows along its length; a new one is a row
            where = [where[0], 0] if old.shape[1] == 1 and old.shape[0] > 1 else [0, where[0]]
            if 1 < old.shape[0] and 1 < old.shape[1]:
                raise self.source.error(line, f"'{name}' is a matrix: give a row and a column")
        shape = [max(old.shape[k], where[k] + 1) for k in (0, 1)]
        if shape[0] * shape[1] > LARGEST:
            raise self.source.error(line, f"'{name}' would get more than {LARGEST} elements")
        new = np.zeros(shape)
        new[: old.shape[0], : old.shape[1]] = old
        new[where[0], where[1]] = value.item()
        self._store(name, new, line)

    # expressions, weakest first

    def _expression(self, ranges: bool = False) -> np.ndarray:
        self.depth += 1
        if self.depth > DEEPEST:
            raise self.error("nested too deeply for an input file")
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
                raise self.error("nested too deeply for an input file")
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
            value = self._expression()
            self.expect(")")
            self.in_matrix = inside
        elif token.text == "[":
            value = self._matrix()
        elif token.kind == "name":
            value = self._named(token)
        else:
            self.at -= 1
            raise self.error(f"expected a number, a name or a bracket, got '{_shown(token)}'")
        while self.peek().text == "'" and self.peek().kind == "mark":
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
        near = did_you_mean(name, [*arrays, *CONSTANTS, *ELEMENTWISE, *OTHERS])
        raise self.source.error(token.line, f"'{name}' has no value here{near}")

    array_size: int | None = None

    def _arguments(self, array: np.ndarray | None) -> list[np.ndarray]:
        """Reads `( ... )`; inside the index of an array `end` is its length."""
        self.expect("(")
        inside, size = self.in_matrix, self.array_size
        self.in_matrix, self.array_size = False, None if array is None else array.size
        found = []
        while self.peek().text != ")":
            if self.peek().text == ":" and self.stream[self.at + 1].text in (")", ","):
                raise self.error("a lone ':' is not known here")
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
            raise self.source.error(line, f"'{name}' has {array.size} elements, number {max(max(w, default=0) for w in wanted) + 1} is asked for") from None
        raise self.source.error(line, f"'{name}' takes one or two indices")

    def _index(self, x: float, line: int, name: str) -> int:
        if not (x == x and abs(x) < 1e9 and x == int(x) and x >= 1):
            raise self.source.error(line, f"an index of '{name}' must be a whole number from 1 on, got {x:g}")
        return int(x) - 1

    def _function(self, token: Token, arguments: list[np.ndarray]) -> np.ndarray:
        name, count = token.text, len(arguments)
        if name in ("zeros", "ones", "eye"):
            sizes = [self._scalar(a, name) for a in (arguments or [np.ones((1, 1))])]
            sizes = sizes * 2 if len(sizes) == 1 else sizes
            if len(sizes) != 2 or any(not 0 <= s <= LARGEST for s in sizes) or sizes[0] * sizes[1] > LARGEST:
                raise self.source.error(token.line, f"{name}({', '.join(f'{s:g}' for s in sizes)}) is no array of this reader")
            return {"zeros": np.zeros, "ones": np.ones, "eye": lambda shape: np.eye(*shape)}[name]((int(sizes[0]), int(sizes[1])))
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

    def _apply(self, operator: str, x: np.ndarray, y: np.ndarray) -> np.ndarray:
        line = self.stream[self.at - 1].line
        if operator in ("*", "/", "^") and x.size != 1 and y.size != 1:
            if operator != "*" or x.shape[1] != y.shape[0]:
                raise self.source.error(line, f"'{operator}' between arrays of {x.shape[0]} x {x.shape[1]} and {y.shape[0]} x {y.shape[1]}")
            return self._finite(x @ y, line)
        if x.size != 1 and y.size != 1 and x.shape != y.shape:
            raise self.source.error(line, f"'{operator}' between arrays of {x.shape[0]} x {x.shape[1]} and {y.shape[0]} x {y.shape[1]}")
        with np.errstate(all="ignore"):
            table = {"+": np.add, "-": np.subtract, "*": np.multiply, "/": np.divide, "^": np.power}
            return self._finite(table[operator.lstrip(".")](x, y), line)

    def _finite(self, value: np.ndarray, line: int) -> np.ndarray:
        if not np.all(np.isfinite(value)):
            raise self.source.error(line, "the result is not a finite real number")
        return value

    def _scalar(self, value: np.ndarray, what: str) -> float:
        if value.size != 1:
            raise self.error(f"{what} needs single numbers")
        return value.item()

    # tokens

    def peek(self) -> Token:
        return self.stream[self.at]

    def next(self) -> Token:
        token = self.stream[self.at]
        if token.kind == "stop":
            raise self.error("the file ends in the middle of a statement")
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
