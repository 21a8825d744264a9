"""Selects the importer of a file."""

from __future__ import annotations

import re
from argparse import Namespace
from importlib import import_module
from pathlib import Path

from build_fmu.errors import InvalidArgument, UserError
from build_fmu.importers.draft import Draft
from build_fmu.importers.holding import hold_start

# modules and the extensions of their files; dh_table suggests other formats for some of its extensions
IMPORTERS = {"scene_json": (".json",), "mjcf": (".mjcf",), "sdf": (".sdf", ".world"), "urdf": (".urdf", ".xml", ".xacro"),
             "redysim": (".m", ".mat"),
             "dh_table": (".csv", ".tsv", ".txt", ".xlsx", ".xls", ".ods", ".xlsb", ".numbers")}  # fmt: skip
# the importers that use an option
TREES = ("urdf", "mjcf", "sdf")
ROOTS = {b"mujoco": "mjcf", b"mujocoinclude": "mjcf", b"sdf": "sdf"}  # of .xml files; others are URDF
OPTIONS = {
    "loop": ("redysim",), "pivot": ("redysim",), "dh": ("dh_table",), "angles": ("dh_table",), "stops": ("dh_table", *TREES),
    "snap": ("urdf", "sdf"), "frames": TREES, "floating": ("urdf",), "contact": TREES, "limits": TREES, "pose": TREES, "no-shapes": TREES,
    "density": ("dh_table", "urdf", "sdf"), "mass": ("dh_table", "urdf", "sdf"), "keyframe": ("mjcf",), "arg": ("urdf",), "hold": TREES,
}  # fmt: skip
WORDS = {"redysim": "ReDySim's files", "dh_table": "DH tables", "urdf": "URDF files", "mjcf": "MJCF files", "sdf": "SDF files"}
KINDS = (
    ".json (mbs-scene/1), .urdf, .xacro, .sdf, .xml (URDF, MJCF or SDF), "
    "inputs.m and inputs.mat (ReDySim) or their folder, .csv or .xlsx (DH table)"
)
ROOT = re.compile(rb"<(?![?!])\s*([^\s/>]+)")


def read(source: Path, options: Namespace) -> Draft:
    """Returns the draft of a file; the importer depends on the file extension."""
    if not source.exists():
        raise UserError(f"'{source}' does not exist")
    if source.suffix == ".toml":
        raise UserError(f"'{source}' is already a model file; build the FMU with `build-fmu build {source.name}`")
    name = "redysim" if source.is_dir() else next((name for name, endings in IMPORTERS.items() if source.suffix.lower() in endings), None)
    if source.suffix.lower() == ".xml":
        name = ROOTS.get(_root(source), name)
    if name is None:
        raise UserError(f"unsupported file type: '{source}'; supported: {KINDS}")
    given = {**vars(options), "no-shapes": not options.shapes}
    for option, users in OPTIONS.items():
        # options at their defaults are None, False or an empty list
        if name not in users and given.get(option):
            *first, last = (WORDS[user] for user in users)
            kinds = f"{', '.join(word.removesuffix(' files') for word in first)} and {last}" if first else last
            raise InvalidArgument(f"--{option} has no effect on '{source.name}': it applies to {kinds}")
    draft = import_module(f"build_fmu.importers.{name}").read(source, options)
    if options.hold:
        hold_start(draft)
    return draft


def _root(source: Path) -> bytes:
    """Returns the tag of the first element of an XML file."""
    found = ROOT.search(re.sub(rb"<!--.*?-->", b"", source.read_bytes(), flags=re.DOTALL))
    return found[1] if found else b""
