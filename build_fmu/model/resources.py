"""A model file and the tables it refers to: beside each other in a folder, or in the resources of an FMU."""

from __future__ import annotations

import shutil
import zipfile
from dataclasses import replace
from pathlib import Path
from tempfile import TemporaryDirectory

from build_fmu.errors import UserError
from build_fmu.model.describe import Description, describe

RESOURCES = "resources/"
MODEL_IN_FMU = RESOURCES + "model.toml"


def attach(names: list[str], model: Path, folder: Path) -> None:
    """Copies the files that a model file refers to into a folder."""
    for name in names:
        shutil.copyfile(model.parent / name, folder / name)


def model_in(fmu: Path) -> Description | None:
    """Returns the description of the model file in an FMU, or None if there is none; raises UserError for a damaged archive."""
    with TemporaryDirectory() as folder:
        return unpack_model(fmu, Path(folder))


def unpack_model(fmu: Path, folder: Path) -> Description | None:
    """Copies the model file of an FMU, model.toml, and the files it refers to into a folder; returns what `model_in` returns."""
    if not fmu.is_file():
        raise UserError(f"FMU '{fmu}' does not exist")
    try:
        with zipfile.ZipFile(fmu) as archive:
            if MODEL_IN_FMU not in archive.namelist():
                return None
            for name in archive.namelist():
                plain = name.removeprefix(RESOURCES)
                if plain and name.startswith(RESOURCES) and "/" not in plain and "\\" not in plain:
                    (folder / plain).write_bytes(archive.read(name))
            # meshes are not in the FMU: they are looked for beside it, where `build` writes it
            return replace(describe(folder / "model.toml"), folder=fmu.parent)
    except (zipfile.BadZipFile, zipfile.LargeZipFile, OSError) as error:
        raise UserError(f"'{fmu}' is not a readable FMU: {error}") from None
