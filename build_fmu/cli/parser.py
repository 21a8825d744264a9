"""The argument parser of the commands: errors are one line, values are checked while they are read."""

from __future__ import annotations

import argparse
import json
import math
import sys
from collections.abc import Sequence
from typing import Any, NoReturn

from build_fmu.errors import did_you_mean


class Parser(argparse.ArgumentParser):
    """An ArgumentParser whose errors are one line, with the most similar option, command or value."""

    wants_json = False

    def parse_known_args(self, args: Sequence[str] | None = None, namespace: Any = None) -> Any:
        """Remembers whether errors are printed as JSON, too."""
        self.wants_json = "--json" in (sys.argv if args is None else args)
        return super().parse_known_args(args, namespace)

    def error(self, message: str) -> NoReturn:
        """Exits with code 2."""
        self.exit(self.complain(message.removeprefix("argument ")))

    def complain(self, message: str) -> int:
        """Prints the line on wrong arguments and returns the exit code."""
        sentence = f"{self.prog}: {message}; `{self.prog} --help` lists the options"
        if self.wants_json:
            print(json.dumps({"errors": [sentence]}, indent=2, ensure_ascii=False))
        print(sentence, file=sys.stderr)
        return 2

    def _get_value(self, action: argparse.Action, arg_string: str) -> Any:
        # the arguments of a command are checked by its own parser
        if not arg_string and action.nargs != argparse.PARSER:
            raise argparse.ArgumentError(action, "the value must not be empty")
        return super()._get_value(action, arg_string)

    def _check_value(self, action: argparse.Action, value: Any) -> None:
        if action.choices is not None and value not in action.choices:
            known = [str(choice) for choice in action.choices]
            hint = did_you_mean(str(value), known) or f"; available: {', '.join(known)}"
            raise argparse.ArgumentError(action, f"unknown value '{value}'{hint}")

    def refuse(self, rest: Sequence[str]) -> NoReturn:
        """Reports arguments that no option takes."""
        first = rest[0].partition("=")[0]
        if first.startswith("-"):
            self.error(f"unknown option '{first}'{did_you_mean(first, self._option_string_actions)}")
        self.error(f"unexpected argument '{rest[0]}'")


def number(text: str) -> float:
    """Returns a finite number."""
    try:
        value = float(text)
    except ValueError:
        raise argparse.ArgumentTypeError(f"'{text}' is not a number") from None
    if not math.isfinite(value):
        raise argparse.ArgumentTypeError(f"must be finite, got {text}")
    return value


def positive(text: str) -> float:
    """Returns a number above 0."""
    value = number(text)
    if value <= 0:
        raise argparse.ArgumentTypeError(f"must be a positive number, got {text}")
    return value


def tolerance(text: str) -> float:
    """Returns a relative tolerance."""
    value = number(text)
    if not 0 < value < 1:
        raise argparse.ArgumentTypeError(f"tolerances must be between 0 and 1, got {text}")
    return value


def count(text: str) -> int:
    """Returns a whole number above 0."""
    value = positive(text)
    if value != int(value):
        raise argparse.ArgumentTypeError(f"must be a whole number, got {text}")
    return int(value)
