"""Atomic file output."""

from __future__ import annotations

import os
import tempfile
from collections.abc import Callable
from pathlib import Path

from build_fmu.errors import UserError


def whole_file(target: Path, write: Callable[[Path], object]) -> None:
    """Calls `write(temporary_path)` in the folder of the target and renames the file, so readers see the old or the new file.

    Creates missing folders. Raises UserError if the file cannot be written.
    """
    temporary = None
    try:
        if target.is_dir():
            raise UserError(f"'{target}' is a folder, not a file name")
        target.parent.mkdir(parents=True, exist_ok=True)
        # the suffix of the target, which some writers use to choose the format
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
