"""Selects the importer of a file."""

from __future__ import annotations

from argparse import Namespace
from importlib import import_module
from pathlib import Path

from build_fmu.errors import UserError
from build_fmu.importers.draft import Draft

# modules and the extensions of their files; dh_table suggests other formats for some of its extensions
IMPORTERS = {"scene_json": (".json",), "urdf": (".urdf", ".xml"), "redysim": (".m", ".mat"),
             "dh_table": (".csv", ".tsv", ".txt", ".xlsx", ".xls", ".ods", ".xlsb", ".numbers")}  # fmt: skip
# the importers that use an option
OPTIONS = {
    "loop": ("redysim",), "pivot": ("redysim",), "dh": ("dh_table",), "angles": ("dh_table",), "stops": ("dh_table", "urdf"),
    "snap": ("urdf",), "frames": ("urdf",), "floating": ("urdf",), "contact": ("urdf",), "limits": ("urdf",), "pose": ("urdf",),
    "density": ("urdf", "dh_table"), "mass": ("urdf", "dh_table"),
}  # fmt: skip
WORDS = {"redysim": "ReDySim's files", "dh_table": "DH tables", "urdf": "URDF files"}
KINDS = ".json (mbs-scene/1), .urdf, inputs.m and inputs.mat (ReDySim) or their folder, .csv or .xlsx (DH table)"


def read(source: Path, options: Namespace) -> Draft:
    """Returns the draft of a file; the importer depends on the file extension."""
    if not source.exists():
        raise UserError(f"'{source}' does not exist")
    if source.suffix == ".toml":
        raise UserError(f"'{source}' is already a model file; build the FMU with `build-fmu build {source.name}`")
    name = "redysim" if source.is_dir() else next((name for name, endings in IMPORTERS.items() if source.suffix.lower() in endings), None)
    if name is None:
        raise UserError(f"unsupported file type: '{source}'; supported: {KINDS}")
    for option, users in OPTIONS.items():
        # options at their defaults are None, False or an empty list
        if name not in users and getattr(options, option, None):
            raise UserError(f"--{option} has no effect on '{source.name}': it applies to {' and '.join(WORDS[user] for user in users)}")
    return import_module(f"build_fmu.importers.{name}").read(source, options)
