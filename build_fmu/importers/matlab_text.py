"""Splits MATLAB text into tokens, for the part of the language that ReDySim's input files use."""

from __future__ import annotations

import re
from dataclasses import dataclass
from pathlib import Path

from build_fmu.errors import UserError

TOKEN = re.compile(
    r"""(?P<number>(\d+\.?\d*|\.\d+)([eEdD][+-]?\d+)?)
      | (?P<name>[A-Za-z]\w*(\.[A-Za-z]\w*)*)
      | (?P<string>"[^"\n]*"|'[^'\n]*')
      | (?P<mark>==|~=|<=|>=|&&|\|\||\.\*|\./|\.\^|\.'|[-+*/^=()\[\],;:<>~@{}!\\&|'.])""",
    re.VERBOSE,
)
OPENING, CLOSING = "([{", ")]}"


@dataclass(frozen=True)
class Token:
    """`kind` is number, name, string, mark, end (of a statement: newline, comma or semicolon) or stop."""

    kind: str
    text: str
    line: int
    spaced: bool  # preceded by a blank


class Source:
    """A file and its lines, for messages."""

    def __init__(self, path: Path) -> None:
        self.path = path

    def error(self, line: int, sentence: str) -> UserError:
        return UserError(f"{self.path}:{line}: {sentence}")


def tokens(source: Source, text: str) -> list[Token]:
    """Returns the tokens; a line end inside [ ] is a semicolon, inside ( ) it is ignored. Raises UserError with the line."""
    lexer = _Lexer(source)
    in_comment = 0
    number = 1
    for number, line in enumerate(text.replace("\r\n", "\n").replace("\r", "\n").split("\n"), start=1):
        stripped = line.strip()
        # markers of block comments are on separate lines
        in_comment += stripped in ("%{", "#{")
        if in_comment:
            in_comment -= stripped in ("%}", "#}")
        elif not lexer.read(number, line):
            lexer.end_line(number)
    if lexer.open_brackets:
        raise source.error(number, f"'{lexer.open_brackets[-1]}' is not closed")
    return [*lexer.found, Token("stop", "", number, False)]


class _Lexer:
    """The tokens found so far and the brackets that are open."""

    def __init__(self, source: Source) -> None:
        self.source = source
        self.found: list[Token] = []
        self.open_brackets: list[str] = []

    def read(self, number: int, line: str) -> bool:
        """Appends the tokens of a line; returns whether it continues on the next one."""
        at, spaced = 0, True
        while at < len(line):
            if line[at] in " \t\f\v":
                at, spaced = at + 1, True
                continue
            if line[at] in "%#":
                return False
            if line.startswith("...", at):
                return True
            # here a quote is a transpose, not the start of a string
            word = "'" if self._is_transpose(number, line[at], spaced) else ""
            kind = "mark"
            if not word:
                match = TOKEN.match(line, at)
                if not match:
                    raise self.source.error(number, f"unexpected character '{line[at]}'")
                kind, word = str(match.lastgroup), match.group()
            if kind == "mark" and word in OPENING + CLOSING:
                self._bracket(number, word)
            ends = kind == "mark" and word in ";," and not self.open_brackets
            self.found.append(Token("end" if ends else kind, word, number, spaced))
            at, spaced = at + len(word), False
        return False

    def end_line(self, number: int) -> None:
        """Ends a row of a matrix or a statement."""
        if not self.open_brackets:
            self.found.append(Token("end", "\n", number, False))
        elif self.open_brackets[-1] == "[":
            self.found.append(Token("mark", ";", number, False))
        else:
            raise self.source.error(number, f"'{self.open_brackets[-1]}' is not closed")

    def _is_transpose(self, number: int, char: str, spaced: bool) -> bool:
        before = self.found[-1] if self.found and self.found[-1].line == number else None
        follows = before is not None and (before.kind in ("number", "name") or before.text in (")", "]", "'"))
        return char == "'" and follows and not (spaced and self.open_brackets[-1:] == ["["])

    def _bracket(self, number: int, word: str) -> None:
        if word in OPENING:
            self.open_brackets.append(word)
        elif not self.open_brackets or OPENING.index(self.open_brackets.pop()) != CLOSING.index(word):
            raise self.source.error(number, f"'{word}' has no opening bracket")
