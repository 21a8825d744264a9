"""Writes an FMU: a zip whose bytes depend on its content alone, and which appears whole or not at all."""

from __future__ import annotations

import zipfile
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from build_fmu.files import whole_file

EPOCH = (1980, 1, 1, 0, 0, 0)  # the first time a zip can hold; no file's own time gets in
UNIX = 3  # the system whose permissions the entries carry


@dataclass(frozen=True)
class Entry:
    """One file of the archive; `name` uses forward slashes."""

    name: str
    content: bytes
    executable: bool = False


def write_archive(target: Path, entries: Sequence[Entry]) -> None:
    """Writes the entries in their order; raises UserError and leaves an existing target alone on failure."""
    whole_file(target, lambda temporary: _write_zip(temporary, entries))


def _write_zip(path: Path, entries: Sequence[Entry]) -> None:
    with zipfile.ZipFile(path, "w", zipfile.ZIP_DEFLATED, compresslevel=6) as archive:
        for entry in entries:
            info = zipfile.ZipInfo(entry.name, EPOCH)
            info.compress_type = zipfile.ZIP_DEFLATED
            info.create_system = UNIX
            info.external_attr = (0o100755 if entry.executable else 0o100644) << 16
            archive.writestr(info, entry.content)
