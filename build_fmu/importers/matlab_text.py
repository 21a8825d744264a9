"""Splits MATLAB text into tokens: the small part of the language that ReDySim's input files use."""

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
    spaced: bool  # a blank stands before it


class Source:
    """A file and its lines, for messages."""

    def __init__(self, path: Path) -> None:
        self.path = path

    def error(self, line: int, sentence: str) -> UserError:
        return UserError(f"{self.path}:{line}: {sentence}")


def tokens(source: Source, text: str) -> list[Token]:
    """Returns the tokens; a line end inside [ ] is a semicolon, inside ( ) nothing. Raises UserError with the line."""
    found: list[Token] = []
    open_brackets: list[str] = []
    in_comment = 0
    continued = False
    for number, line in enumerate(text.replace("\r\n", "\n").replace("\r", "\n").split("\n"), start=1):
        stripped = line.strip()
        # block comments stand on lines of their own
        if stripped in ("%{", "#{"):
            in_comment += 1
        if in_comment:
            in_comment -= stripped in ("%}", "#}")
            continue
        at, spaced = 0, True
        continues = False
        while at < len(line):
            char = line[at]
            if char in " \t\f\v":
                at, spaced = at + 1, True
                continue
            if char in "%#":
                break
            if line.startswith("...", at):
                continues = True
                break
            before = found[-1] if found and found[-1].line == number else None
            quote = char == "'" and before is not None and (before.kind in ("number", "name") or before.text in (")", "]", "'"))
            if quote and not (spaced and open_brackets[-1:] == ["["]):
                found.append(Token("mark", "'", number, spaced))  # a transpose, not a text
                at, spaced = at + 1, False
                continue
            match = TOKEN.match(line, at)
            if not match:
                raise source.error(number, f"the character '{char}' does not belong here")
            kind, word = str(match.lastgroup), match.group()
            if kind == "mark" and word in OPENING:
                open_brackets.append(word)
            elif kind == "mark" and word in CLOSING:
                if not open_brackets or OPENING.index(open_brackets.pop()) != CLOSING.index(word):
                    raise source.error(number, f"'{word}' closes nothing")
            if kind == "mark" and word in ";," and not open_brackets:
                kind = "end"
            found.append(Token(kind, word, number, spaced))
            at, spaced = match.end(), False
        continued = continues
        if not continued and open_brackets[-1:] == ["["]:
            found.append(Token("mark", ";", number, False))
        elif not continued and not open_brackets:
            found.append(Token("end", "\n", number, False))
        elif not continued and open_brackets[-1:] != ["["]:
            raise source.error(number, f"'{open_brackets[-1]}' is not closed")
    if open_brackets:
        raise source.error(number, f"'{open_brackets[-1]}' is not closed")
    found.append(Token("stop", "", number, False))
    return found
