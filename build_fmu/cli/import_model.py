"""`build-fmu import`: writes the model file of a foreign file and lets `describe` judge it."""

from __future__ import annotations

import argparse
import sys
from pathlib import Path

from build_fmu.cli.terminal import warn
from build_fmu.errors import UserError
from build_fmu.files import whole_file
from build_fmu.importers.draft import Draft, legal
from build_fmu.importers.read import read
from build_fmu.importers.toml_writer import model_text, run_command
from build_fmu.model.describe import describe


def add(commands) -> None:
    """Adds the command and its arguments."""
    command = commands.add_parser("import", help="write a model file from a URDF, a DH table, ReDySim's files or a scene",
                                  description="Write a model file from a URDF (.urdf), a DH table (.csv, .xlsx), ReDySim's inputs.m or inputs.mat or their "
                                  "folder, or a scene (.json). What it cannot hold is listed.")
    command.add_argument("source", type=Path, metavar="FILE", help="what to import")
    command.add_argument("-o", "--output", type=Path, metavar="MODEL", help="file or folder to write (default: here, FILE's name with .toml)")
    command.add_argument("--name", metavar="NAME", help="name of the model and its file (default: the one in FILE, else FILE's own)")
    command.add_argument("--force", action="store_true", help="write over an existing model file")
    command.add_argument("--loop", action="append", default=[], metavar="LINK:x,y,z=LINK:x,y,z", help="ReDySim: two points that coincide (each in its "
                         "link's frame, m), or a TOML file with [[loop]] tables; repeat it for each loop")
    command.add_argument("--pivot", action="append", default=[], metavar="LINK=x,y,z", help="ReDySim: where a link stands on the ground (m)")
    command.add_argument("--snap", action="store_true", help="URDF: make angles such as 1.5708 exact multiples of 90 degrees")
    command.add_argument("--frames", action="store_true", help="URDF: keep the frames of its links as [[frame]] tables, with outputs")
    command.add_argument("--floating", action="store_true", help="URDF: let the root link float free instead of standing on the ground")
    command.add_argument("--stops", type=float, metavar="STIFFNESS", help="URDF, DH table: make the limits of joints stops of this stiffness (N m/rad, N/m)")
    command.add_argument("--dh", choices=("modified", "standard"), help="DH table: which convention (modified: Craig, Khalil; standard: distal)")
    command.add_argument("--angles", choices=("rad", "deg"), help="DH table: unit of the angles, where its head does not say")
    command.set_defaults(run=run)


def run(options: argparse.Namespace) -> int:
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
    warn(model.warnings)
    # the drawing has a link for each freedom of a joint with several
    counts = {"link": len(draft.links), "moving joint": sum(link.joint != "fixed" for link in draft.links), "loop": len(model.drawing.get("loops", []))}
    words = ", ".join(f"{n} {what}{'' if n == 1 else 's'}" for what, n in counts.items())
    if draft.inputs:
        print(f"with its inputs: {run_command(draft, str(target))}")
    print(f"{target}  {words}, {sum(link.mass for link in draft.links):.6g} kg")
    return 0


def _file_name(options: argparse.Namespace, draft: Draft) -> str:
    """Returns the model file's name without its ending: the source's; ReDySim's files are all called alike, there it is their folder's."""
    source = options.source
    return draft.name if options.name or source.is_dir() or source.suffix.lower() in (".m", ".mat") else source.stem
