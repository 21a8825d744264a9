"""Standard streams of a command: `-` as input and output file, --quiet and --json."""

from __future__ import annotations

import argparse
import io
import json
import math
import os
import sys
import tempfile
from collections.abc import Iterator
from contextlib import ExitStack, contextmanager, redirect_stderr, redirect_stdout, suppress
from pathlib import Path
from typing import Any, TextIO

from build_fmu.errors import InvalidArgument, UserError

STREAM = Path("-")
READ = ("model", "models", "target", "targets", "source")  # the options that name input files
WRITTEN = {
    "build": ("output", ".fmu"),
    "identify": ("output", ".toml"),
    "import": ("output", ".toml"),
    "show": ("output", ".html"),
    "simulate": ("csv", ".csv"),
}


def add_options(command: argparse.ArgumentParser, reports: bool) -> None:
    """Adds --quiet and, for a command that reports, --json."""
    command.add_argument("-q", "--quiet", action="store_true", help="print errors only")
    if reports:
        command.add_argument("--json", action="store_true", help="print the results as one JSON object")


def open_closed_streams() -> None:
    """Replaces standard streams that the caller has closed (`>&-`) by the null device."""
    while (descriptor := os.open(os.devnull, os.O_RDWR)) <= 2:
        pass
    os.close(descriptor)
    for number, (name, mode) in enumerate((("stdin", "r"), ("stdout", "w"), ("stderr", "w"))):
        if getattr(sys, name) is None:
            setattr(sys, name, open(number, mode, encoding="utf-8", closefd=False))


@contextmanager
def standard_streams(options: argparse.Namespace) -> Iterator[None]:
    """Replaces `-` by files, sends messages to stderr where results are on stdout, and copies an output file to stdout at the end."""
    options.stdout = sys.stdout
    wants_json, quiet = getattr(options, "json", False), getattr(options, "quiet", False)
    with ExitStack() as kept:
        names = _files(options, Path(kept.enter_context(tempfile.TemporaryDirectory()))) if _has_stream(options) else {}
        written = next((Path(path) for path, name in names.items() if name == "<stdout>"), None)
        options.on_stdin, options.on_stdout = "<stdin>" in names.values(), written is not None
        if written and wants_json:
            raise InvalidArgument("--json and an output file `-` both write to stdout: remove one of them")
        real, nothing, messages = sys.stdout, io.StringIO(), io.StringIO()
        options.stdout, errors = (_Renamed(stream, names) if names else stream for stream in (sys.stdout, sys.stderr))
        kept.enter_context(redirect_stderr(nothing if quiet else errors))
        kept.enter_context(redirect_stdout(nothing if quiet or wants_json else messages if written else options.stdout))
        try:
            yield
        except UserError as error:
            error.args = (_renamed(str(error), names),)
            raise
        finally:
            # also a file that a failed command has completed
            if written and written.is_file():
                _copy(written, real)
            errors.write(messages.getvalue())


def emit(options: argparse.Namespace, facts: dict[str, Any]) -> None:
    """Prints the results as JSON if --json is given."""
    if getattr(options, "json", False):
        options.stdout.write(json.dumps(_plain(facts), indent=2, ensure_ascii=False) + "\n")


def _has_stream(options: argparse.Namespace) -> bool:
    return any(value == STREAM or (isinstance(value, list) and STREAM in value) for value in vars(options).values())


def _files(options: argparse.Namespace, folder: Path) -> dict[str, str]:
    """Replaces `-` in the options by files, an input in a folder like the current one; returns their shown names."""
    names = {}
    for key in READ:
        value = getattr(options, key, None)
        if value == STREAM or (isinstance(value, list) and STREAM in value):
            data = sys.stdin.buffer.read()
            folder = _linked(folder)
            file = folder / f"stdin{_ending(data) if options.command == 'import' else '.toml'}"
            file.unlink(missing_ok=True)
            file.write_bytes(data)
            setattr(options, key, file if value == STREAM else [file if one == STREAM else one for one in value])
            names[str(file)] = "<stdin>"
    key, ending = WRITTEN.get(options.command, ("", ""))
    if not key and getattr(options, "output", None) == STREAM:
        raise InvalidArgument(f"{options.command} writes several files: -o requires the name of a folder, not `-`")
    if getattr(options, key, None) == STREAM:
        file = folder / f"stdout{ending}"
        file.unlink(missing_ok=True)
        setattr(options, key, file)
        names[str(file)] = "<stdout>"
    return {**names, f"{folder}{os.sep}": ""}


def _linked(folder: Path) -> Path:
    """Copies the current folder and those above it as folders of links, with short names; returns the copy of the current one."""
    here = Path.cwd()
    for original in [*reversed(here.parents), here]:
        folder /= "_"
        folder.mkdir()
        with suppress(OSError):  # a folder that cannot be listed
            for entry in os.scandir(original):
                if entry.name != "_":
                    (folder / entry.name).symlink_to(original / entry.name)
    return folder


def _ending(data: bytes) -> str:
    """Returns the extension of a file to import, by its first character."""
    first = data.removeprefix(b"\xef\xbb\xbf").lstrip()[:1]
    return {b"<": ".xml", b"{": ".json"}.get(first, ".csv")


def _copy(file: Path, stream: TextIO) -> None:
    binary = getattr(stream, "buffer", None)
    if binary:
        stream.flush()
        binary.write(file.read_bytes())
        binary.flush()
    else:
        stream.write(file.read_text(encoding="utf-8"))


def _plain(value: Any) -> Any:
    """Returns the value in the types of JSON; numbers that are not finite become null."""
    if isinstance(value, dict):
        return {str(key): _plain(part) for key, part in value.items()}
    if isinstance(value, list | tuple):
        return [_plain(part) for part in value]
    if value is None or isinstance(value, str | bool | int):
        return value
    if isinstance(value, Path):
        return str(value)
    return float(value) if math.isfinite(value) else None


def _renamed(text: str, names: dict[str, str]) -> str:
    for path, name in names.items():
        text = text.replace(path, name)
    return text


class _Renamed(io.TextIOBase):
    """A stream on which files that stand for standard streams have the names of these."""

    def __init__(self, stream: TextIO, names: dict[str, str]) -> None:
        self.stream, self.names = stream, names

    def write(self, text: str) -> int:
        return self.stream.write(_renamed(text, self.names))

    def flush(self) -> None:
        self.stream.flush()

    def isatty(self) -> bool:
        return self.stream.isatty()

    def fileno(self) -> int:
        return self.stream.fileno()

    @property
    def encoding(self) -> str:
        return self.stream.encoding
