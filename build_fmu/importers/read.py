"""Selects the importer of a file."""

from __future__ import annotations

from argparse import Namespace
from pathlib import Path

from build_fmu.errors import UserError
from build_fmu.importers.draft import Draft

KINDS = ".json (mbs-scene/1), .urdf, inputs.m and inputs.mat (ReDySim) or their folder, .csv or .xlsx (DH table)"


def read(source: Path, options: Namespace) -> Draft:
    """Returns the draft of a file; the importer depends on the file extension or on the content."""
    if not source.exists():
        raise UserError(f"'{source}' does not exist")
    ending = source.suffix.lower()
    if ending == ".json":
        from build_fmu.importers import scene_json

        return scene_json.read(source)
    if ending in (".urdf", ".xml"):
        from build_fmu.importers import urdf

        return urdf.read(source, options)
    if ending in (".m", ".mat") or source.is_dir():
        from build_fmu.importers import redysim

        return redysim.read(source, options)
    if ending in (".csv", ".tsv", ".txt", ".xlsx", ".xls", ".ods", ".xlsb", ".numbers"):
        from build_fmu.importers import dh_table

        return dh_table.read(source, options)
    if ending == ".toml":
        raise UserError(f"'{source}' is already a model file; build the FMU with `build-fmu build {source.name}`")
    raise UserError(f"unsupported file type: '{source}'; supported: {KINDS}")
