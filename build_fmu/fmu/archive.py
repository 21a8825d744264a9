"""Writes an FMU: a zip file with reproducible bytes, written atomically."""

from __future__ import annotations

import zipfile
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from build_fmu.files import whole_file

EPOCH = (1980, 1, 1, 0, 0, 0)  # the earliest time of the zip format, used for all files
UNIX = 3  # the system of the file permissions


@dataclass(frozen=True)
class Entry:
    """One file of the archive; `name` uses forward slashes."""

    name: str
    content: bytes
    executable: bool = False


def write_archive(target: Path, entries: Sequence[Entry]) -> None:
    """Writes the entries in order; on failure raises UserError and keeps an existing target."""
    whole_file(target, lambda temporary: _write_zip(temporary, entries))


def _write_zip(path: Path, entries: Sequence[Entry]) -> None:
    with zipfile.ZipFile(path, "w", zipfile.ZIP_DEFLATED, compresslevel=6) as archive:
        for entry in entries:
            info = zipfile.ZipInfo(entry.name, EPOCH)
            info.compress_type = zipfile.ZIP_DEFLATED
            info.create_system = UNIX
            info.external_attr = (0o100755 if entry.executable else 0o100644) << 16
            archive.writestr(info, entry.content)
