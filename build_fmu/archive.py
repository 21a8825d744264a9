"""Writes an FMU: a zip whose bytes depend on its content alone, and which appears whole or not at all."""

from __future__ import annotations

import os
import tempfile
import zipfile
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from build_fmu.errors import UserError

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


def whole_file(target: Path, write) -> None:
    """Calls `write(temporary_path)` beside the target and renames: readers see the old file or the new one.

    Makes missing folders. Raises UserError when the file system refuses.
    """
    temporary = None
    try:
        if target.is_dir():
            raise UserError(f"'{target}' is a folder, not a file name")
        target.parent.mkdir(parents=True, exist_ok=True)
        # same suffix as the target: some writers choose the format by it
        handle, name = tempfile.mkstemp(prefix=f".{target.stem}-", suffix=target.suffix, dir=target.parent)
        os.close(handle)
        temporary = Path(name)
        write(temporary)
        mask = os.umask(0)
        os.umask(mask)
        temporary.chmod(0o666 & ~mask)
        temporary.replace(target)
        temporary = None
    except OSError as error:
        raise UserError(f"cannot write '{target}': {error.strerror or error}") from None
    finally:
        if temporary is not None:
            temporary.unlink(missing_ok=True)
