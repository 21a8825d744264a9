"""Reads the values that a ReDySim input file assigns, by a recursive parser for a small grammar, without `eval`.

Statements: `x = e`, `x(i) = e`, `x(i, j) = e`, `[x y] = inputs()`, `load`, counting `for` loops, function headers.
"""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import numpy as np

from build_fmu.errors import UserError
from build_fmu.importers import matlab_file
from build_fmu.importers.fields import read_text
from build_fmu.importers.matlab_expression import LARGEST, Call, Expressions, Values
from build_fmu.importers.matlab_text import Source, Token, tokens

MOST_STATEMENTS = 500_000
IDLE = ("clc", "clear", "close", "save", "format", "return", "global", "hold", "disp", "fprintf")
UNKNOWN_STATEMENTS = ("if", "while", "switch", "try", "function")
BLOCKS = ("for", "if", "while", "switch", "try")


def read_values(path: Path, call: Call | None = None, arguments: Sequence[np.ndarray] = (), tolerant: bool = False) -> Values:
    """Returns what the file assigns; `call(name, arguments)` answers `[a b] = name(...)`, `arguments` are those of the file itself.

    Raises UserError with file and line; a tolerant reader skips a faulty statement instead, and its variables stay undefined.
    """
    source = Source(path)
    reader = _Reader(source, tokens(source, read_text(path)), call)
    reader.given, reader.tolerant = arguments, tolerant
    try:
        return reader.read()
    except RecursionError:
        raise UserError(f"{path}: nested too deeply") from None


class _Reader(Expressions):
    given: Sequence[np.ndarray] = ()
    tolerant = False
    count = 0  # of statements
    lost: frozenset[str] = frozenset()  # variables that a skipped statement assigns

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
                self._try_statement(token)

    def _try_statement(self, token: Token) -> None:
        start = self.at
        try:
            self._statement(token)
        except UserError as error:
            if not self.tolerant or token.text in BLOCKS or self.count > MOST_STATEMENTS:
                raise
            self.values.skipped.append(str(error))
            self.at, self.depth, self.in_matrix, self.array_size = start, 0, False, None
            several = token.text == "["
            while self.peek().kind not in ("end", "stop"):
                word = self.next()
                if word.kind == "name" and (several or word is token):
                    self.values.arrays.pop(word.text, None)
                    self.lost |= {word.text}
                several = several and word.text != "]"

    def _statement(self, token: Token) -> None:
        self.count += 1
        if self.count > MOST_STATEMENTS:
            raise self.error(f"more than {MOST_STATEMENTS} statements")
        if token.kind == "name" and token.text == "function":
            return self._header() if self.count == 1 else self._skip_the_rest()
        if token.kind == "name" and token.text == "for":
            return self._for()
        if token.kind == "name" and token.text in IDLE:
            return self._skip_statement()
        if token.kind == "name" and token.text == "load" and self.stream[self.at + 1].text != "=":
            return self._load("")
        if token.kind == "mark" and token.text == "[":
            self._several()
        elif token.kind == "name" and token.text not in UNKNOWN_STATEMENTS:
            self._assignment()
        else:
            raise self.error(f"unsupported statement '{token.text}'; supported: assignments, load and counting loops")
        if self.peek().kind not in ("end", "stop"):
            raise self.error(f"unexpected '{self.peek().text}'")

    def _header(self) -> None:
        """`function [a b] = name(...)`, `function a = name` or `function name(...)`; the arguments get the given values."""
        self.at += 1
        names: list[str] = []
        while self.peek().kind not in ("end", "stop"):
            token = self.next()
            if token.text == "=":
                self.values.outputs = names
                names = []
            elif token.kind == "name":
                names.append(token.text)
        # the first name is that of the function
        for name, value in zip(names[1:], self.given, strict=False):
            self._store(name, value, token.line)

    def _skip_the_rest(self) -> None:
        """Skips local functions, which start with a second header."""
        self.at = len(self.stream) - 1

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
        self.at += 1  # the `end`

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
                raise self.source.error(line, f"unexpected '{token.text}' in a list of results")
        self.at += 1
        self.expect("=")
        function = self.name()
        arguments = self._arguments(None) if self.peek().text == "(" else []
        other = self.call(function, arguments) if self.call else None
        if other is None:
            raise self.source.error(line, f"unknown function '{function}': {function}.m does not exist in the folder of this file")
        # variables of a .mat file have no order
        outputs = other.outputs or names
        if len(names) > len(outputs):
            raise self.source.error(line, f"{function}() returns {len(outputs)} results, {len(names)} are requested")
        for name, output in zip(names, outputs, strict=False):
            if name != "~" and output in other.arrays:
                self._store(name, other.arrays[output], line)

    def _load(self, prefix: str) -> None:
        """`load('x.mat')` and `load x.mat` give its variables, `s = load('x.mat')` the fields of s."""
        line = self.next().line
        words = []
        while self.peek().kind not in ("end", "stop"):
            words.append(self.next())
        texts = [word.text.strip("'\"") for word in words if word.kind in ("string", "name")]
        if not texts or any(word.kind == "mark" and word.text not in "()," for word in words):
            raise self.source.error(line, "load requires the name of a .mat file, for example load('inputs.mat')")
        file = texts[0] if texts[0].lower().endswith(".mat") else f"{texts[0]}.mat"
        path = self.source.path.parent / file.replace("\\", "/")
        if not path.is_file():
            raise self.source.error(line, f"load: '{file}' does not exist in the folder of this file")
        for name, array in matlab_file.read_values(path).arrays.items():
            if name in texts[1:] or len(texts) == 1:
                self._store(prefix + name, array, line)

    def _assignment(self) -> None:
        line = self.peek().line
        name = self.name()
        indices = None
        if self.peek().text == "(":
            indices = self._arguments(self.values.arrays.get(name))
        if self.peek().kind in ("end", "stop") and indices is None:
            raise self.source.error(line, f"'{name}' is not an assignment")
        self.expect("=")
        if self.peek().text == "load" and "load" not in self.values.arrays:
            return self._load(f"{name}.")
        value = self._expression(ranges=True)
        if indices is None:
            return self._store(name, value, line)
        self._element(name, indices, value, line)

    def _store(self, name: str, value: np.ndarray, line: int) -> None:
        self.values.arrays[name] = np.array(value)
        self.values.lines[name] = line
        self.lost -= {name}

    def _element(self, name: str, indices: list[np.ndarray], value: np.ndarray, line: int) -> None:
        if value.size != 1 or any(i.size != 1 for i in indices) or not 1 <= len(indices) <= 2:
            raise self.source.error(line, f"'{name}(...)' must be assigned a scalar")
        if name in self.lost:
            raise self.source.error(line, f"other elements of '{name}' are unknown")
        where = [self._index(i.item(), line, name) for i in indices]
        old = self.values.arrays.get(name, np.zeros((0, 0)))
        if len(where) == 1:
            # a vector grows along its length; a new vector is a row
            where = [where[0], 0] if old.shape[1] == 1 and old.shape[0] > 1 else [0, where[0]]
            if 1 < old.shape[0] and 1 < old.shape[1]:
                raise self.source.error(line, f"'{name}' is a matrix: specify row and column")
        shape = [max(old.shape[k], where[k] + 1) for k in (0, 1)]
        if shape[0] * shape[1] > LARGEST:
            raise self.source.error(line, f"'{name}' would have more than {LARGEST} elements")
        new = np.zeros(shape)
        new[: old.shape[0], : old.shape[1]] = old
        new[where[0], where[1]] = value.item()
        self._store(name, new, line)
