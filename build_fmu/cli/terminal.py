"""Shared by the commands: list arguments, console output and progress bars."""

from __future__ import annotations

import os
import sys
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path

from build_fmu.errors import InvalidArgument, UserError

# an option with several values that may be repeated
SEVERAL = {"nargs": "+", "action": "extend", "default": []}


def targets_after(*lists: list[str]) -> list[Path]:
    """Removes FMUs and model files from the end of option values (`--input a=1 arm.fmu`) and returns them."""
    found = []
    for values in lists:
        while values and "=" not in values[-1] and values[-1].endswith((".fmu", ".toml")):
            found.append(Path(values.pop()))
    return found


def output_file(given: Path | None, name: str, endings: Sequence[str]) -> Path:
    """Returns the file to write: the given file, or `name` in the given or the current folder; raises UserError if it is unsuitable."""
    into_folder = given is not None and os.path.isdir(given)  # False for a name that no file can have
    target = Path(name) if given is None else given / name if into_folder else given
    if target.suffix.lower() not in endings:
        missing = "; to write into a folder, create it first" if given is not None and not target.suffix and not into_folder else ""
        raise InvalidArgument(f"'{target}' must end in {' or '.join(endings)}{missing}")
    if not target.parent.is_dir():
        raise UserError(f"cannot write '{target}': the folder '{target.parent}' does not exist")
    return target


def output_folder(given: Path | None, option: str = "-o") -> Path:
    """Returns the folder to write into, by default the current one; raises UserError for the name of a file, before the run."""
    if given is not None and given.is_file():
        raise UserError(f"'{given}' is a file: {option} requires the name of a folder")
    return given or Path(".")


def warn(lines: Sequence[str], printed: Sequence[str] = ()) -> None:
    """Prints lines on stderr, except those that were `printed` with their place in a file."""
    for line in lines:
        if not any(known.endswith(line) for known in printed):
            print(line, file=sys.stderr)


def console():
    """Returns a rich console on stdout, with wide lines for files and pipes."""
    from rich.console import Console

    return Console() if sys.stdout.isatty() else Console(width=160)


@contextmanager
def bar(*columns) -> Iterator:
    """Yields a rich progress bar, shown if stderr is a terminal."""
    from rich.console import Console
    from rich.progress import BarColumn, Progress, TextColumn

    screen = Console(stderr=True)
    with Progress(
        TextColumn("{task.description}"), BarColumn(), *columns, console=screen, transient=True, disable=not screen.is_terminal
    ) as shown:
        yield shown


@contextmanager
def sweep_bar() -> Iterator[Callable[[Path], Callable[[str, int, int], None]]]:
    """Yields a function that returns the progress function of a target."""
    from rich.progress import TextColumn, TimeElapsedColumn

    with bar(TextColumn("{task.completed:.0f}/{task.total:.0f}"), TimeElapsedColumn()) as shown:
        task = shown.add_task("", total=1)

        def of(target: Path) -> Callable[[str, int, int], None]:
            return lambda text, done, total: shown.update(task, description=f"{Path(target).stem}: {text}", completed=done, total=total)

        yield of
