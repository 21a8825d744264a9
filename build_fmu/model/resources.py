"""Files that a model file takes tables from: they stand beside it, in a folder and in an FMU's resources."""

from __future__ import annotations

import shutil
import zipfile
from pathlib import Path

RESOURCES = "resources/"
MODEL_IN_FMU = RESOURCES + "model.toml"


def attach(names: list[str], model: Path, folder: Path) -> None:
    """Copies the files of a model file's folder to another one."""
    for name in names:
        shutil.copyfile(model.parent / name, folder / name)


def extract_model(archive: zipfile.ZipFile, folder: Path) -> Path:
    """Writes the model file that an FMU of ours carries, and what it needs, into the folder; returns it."""
    for name in archive.namelist():
        plain = name.removeprefix(RESOURCES)
        if plain and name.startswith(RESOURCES) and "/" not in plain and "\\" not in plain:
            (folder / plain).write_bytes(archive.read(name))
    return folder / "model.toml"
