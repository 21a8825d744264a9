"""`build-fmu import`: chooses the importer by the file, writes the model file and lets `describe` judge it."""

from __future__ import annotations

import sys
from argparse import Namespace
from pathlib import Path

from build_fmu.archive import whole_file
from build_fmu.describe import describe
from build_fmu.errors import UserError
from build_fmu.importers.draft import Draft, legal
from build_fmu.importers.toml_writer import model_text, run_command

KINDS = ".json (mbs-scene/1), .urdf, inputs.m and inputs.mat (ReDySim) or their folder, .csv or .xlsx (DH table)"


def run(options: Namespace) -> int:
    """Imports one file and returns the exit code; what was lost is listed on stderr."""
    draft = read(options.source, options)
    if options.name:
        if legal(options.name) != options.name:
            raise UserError(f"--name: '{options.name}' is no name for a model; use letters, digits and _, for example '{legal(options.name)}'")
        draft.name = options.name
    name = f"{_file_name(options, draft)}.toml"
    target = options.output or Path(name)
    if target.is_dir():
        target = target / name
    if target.suffix != ".toml":
        raise UserError(f"'{target}' is no name for a model file: it must end in .toml")
    if target.exists() and not options.force:
        raise UserError(f"'{target}' exists already: choose another name with -o, or write over it with --force")
    text = model_text(draft, target.name)
    whole_file(target, lambda temporary: temporary.write_text(text, encoding="utf-8", newline="\n"))
    for title, sentences in (("not carried over", draft.lost), ("look at", draft.doubts)):
        for sentence in sentences:
            print(f"{title}: {sentence}", file=sys.stderr)
    try:
        model = describe(target)
    except UserError as error:
        raise UserError(f"{error}\n'{target}' is written, but the model in it is not complete or not sound: see the lines above") from None
    for warning in model.warnings:
        print(warning, file=sys.stderr)
    # the drawing has a link for each freedom of a joint with several
    counts = {"link": len(draft.links), "moving joint": sum(link.joint != "fixed" for link in draft.links), "loop": len(model.drawing.get("loops", []))}
    words = ", ".join(f"{n} {what}{'' if n == 1 else 's'}" for what, n in counts.items())
    if draft.inputs:
        print(f"with its inputs: {run_command(draft, str(target))}")
    print(f"{target}  {words}, {sum(link.mass for link in draft.links):.6g} kg")
    return 0


def _file_name(options: Namespace, draft: Draft) -> str:
    """Returns the model file's name without its ending: the source's; ReDySim's files are all called alike, there it is their folder's."""
    source = options.source
    return draft.name if options.name or source.is_dir() or source.suffix.lower() in (".m", ".mat") else source.stem


def read(source: Path, options: Namespace) -> Draft:
    """Returns the draft of a file by its ending and, where that says too little, its content."""
    if not source.exists():
        raise UserError(f"there is no file '{source}'")
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
        raise UserError(f"'{source}' is a model file already: `build-fmu build {source.name}` makes the FMU")
    raise UserError(f"'{source}' is of no kind that import knows: {KINDS}")
