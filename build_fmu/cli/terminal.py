"""Shared by the commands: list arguments, console output and progress bars."""

from __future__ import annotations

import sys
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path

# an option with several values that may be repeated
SEVERAL = {"nargs": "+", "action": "extend", "default": []}


def targets_after(*lists: list[str]) -> list[Path]:
    """Removes FMUs and model files from the end of option values (`--input a=1 arm.fmu`) and returns them."""
    found = []
    for values in lists:
        while values and "=" not in values[-1] and values[-1].endswith((".fmu", ".toml")):
            found.append(Path(values.pop()))
    return found


def output_file(given: Path | None, name: str) -> Path:
    """Returns the file to write: the given file, or `name` in the given or the current folder."""
    if given is None:
        return Path(name)
    return given / name if given.is_dir() else given


def warn(lines: Sequence[str]) -> None:
    """Prints lines on stderr."""
    for line in lines:
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
