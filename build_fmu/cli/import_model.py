"""`build-fmu import`: converts a file of another format to a model file and checks it with `describe`."""

from __future__ import annotations

import argparse
import os
import sys
from pathlib import Path

from build_fmu.cli.parser import positive
from build_fmu.cli.streams import add_options, emit
from build_fmu.cli.terminal import output_file, warn
from build_fmu.errors import InvalidArgument, UserError
from build_fmu.files import whole_file
from build_fmu.importers.draft import Draft, legal
from build_fmu.importers.read import read
from build_fmu.importers.toml_writer import model_text, run_command
from build_fmu.model.describe import describe


def add(commands) -> None:
    """Adds the command and its arguments."""
    command = commands.add_parser(
        "import",
        help="convert a URDF, an MJCF, an SDF, a DH table, ReDySim files or a scene to a model file",
        description="Convert a URDF (.urdf, .xacro), an MJCF (.xml), an SDF (.sdf), a DH table (.csv, .xlsx), ReDySim's inputs.m, "
        "inputs.mat or folder, or a scene (.json) to a model file. Omitted content is listed.",
    )
    command.add_argument("source", type=Path, metavar="FILE", help="file or folder to import")
    command.add_argument(
        "-o", "--output", type=Path, metavar="MODEL", help="output file or folder (default: FILE's name with .toml in the current folder)"
    )
    command.add_argument("--name", metavar="NAME", help="name of the model and of its file (default: the name in FILE, or that of FILE)")
    command.add_argument("--force", action="store_true", help="overwrite an existing model file")
    command.add_argument(
        "--loop",
        action="append",
        default=[],
        metavar="LINK:x,y,z=LINK:x,y,z",
        help="ReDySim: two coincident points, each in the frame of its link (m), or a TOML file with [[loop]] tables; once per loop",
    )
    command.add_argument(
        "--pivot", action="append", default=[], metavar="LINK=x,y,z", help="ReDySim: joint position of a link on the ground (m)"
    )
    command.add_argument("--arg", action="append", default=[], metavar="NAME=VALUE", help="URDF: argument of a xacro file")
    command.add_argument("--snap", action="store_true", help="URDF, SDF: round angles such as 1.5708 to exact multiples of 90 degrees")
    command.add_argument(
        "--frames", action="store_true", help="URDF, MJCF, SDF: add link frames (MJCF: and sites) as [[frame]] tables, which have outputs"
    )
    command.add_argument(
        "--contact",
        choices=("ground", "all"),
        help="URDF, MJCF, SDF: convert collision shapes to contacts with the ground plane z = 0: those of the feet (ground) or all",
    )
    command.add_argument("--no-shapes", dest="shapes", action="store_false", help="URDF, MJCF, SDF: omit shapes that are drawn only")
    command.add_argument("--limits", action="store_true", help="URDF, MJCF, SDF: convert limits of drives to limits of [[actuator]] tables")
    command.add_argument(
        "--pose",
        action="append",
        default=[],
        metavar="JOINT=VALUE",
        help="URDF, MJCF, SDF: start position (rad, m), with * as wildcard, for example '*_knee=-1.2'; once per joint or pattern",
    )
    command.add_argument("--keyframe", metavar="NAME", help="MJCF: start in this keyframe")
    command.add_argument("--hold", action="store_true", help="URDF, MJCF, SDF: add a PD controller that holds the start position")
    command.add_argument("--floating", action="store_true", help="URDF: use a floating base instead of a fixed one")
    command.add_argument(
        "--stops",
        type=_stops,
        metavar="STIFFNESS|none",
        help="URDF, MJCF, SDF, DH table: stiffness of stops at joint limits (N m/rad, N/m; default: by the masses; tables: none), or none",
    )
    command.add_argument(
        "--density", type=positive, metavar="D", help="URDF, SDF, DH table: density (kg/m3) of links without mass, by shapes or lengths"
    )
    command.add_argument("--mass", type=positive, metavar="M", help="URDF, SDF, DH table: the same, by the total mass (kg) of these links")
    command.add_argument("--dh", choices=("modified", "standard"), help="DH table: convention (modified: Craig, Khalil; standard: distal)")
    command.add_argument("--angles", choices=("rad", "deg"), help="DH table: unit of angles without a unit in the header")
    add_options(command, reports=True)
    command.set_defaults(run=run)


def _stops(text: str) -> float | str:
    return text if text == "none" else positive(text)


def run(options: argparse.Namespace) -> int:
    """Imports one file and returns the exit code; omissions are listed on stderr."""
    draft = read(options.source, options)
    if options.name:
        if legal(options.name) != options.name:
            raise InvalidArgument(
                f"--name: '{options.name}' is not a valid model name; use letters, digits and _, for example '{legal(options.name)}'"
            )
        draft.name = options.name
    target = output_file(options.output, f"{_file_name(options, draft)}.toml", (".toml",))
    if target.exists() and not options.force:
        raise UserError(f"'{target}' already exists; choose another name with -o or overwrite it with --force")
    folder = Path.cwd() if options.on_stdout else target.resolve().parent
    for shape in draft.shapes:
        if "file" in shape.fields:
            file = os.path.realpath(shape.fields["file"]) if options.on_stdin else shape.fields["file"]  # a link beside it
            shape.fields["file"] = Path(os.path.relpath(file, folder)).as_posix()
    text = model_text(draft, target.name)
    whole_file(target, lambda temporary: temporary.write_text(text, encoding="utf-8", newline="\n"))
    for title, sentences in (("omitted", draft.lost), ("check", draft.doubts)):
        for sentence in sentences:
            print(f"{title}: {sentence}", file=sys.stderr)
    try:
        model = describe(target)
    except UserError as error:
        raise UserError(f"{error}\n'{target}' was written, but the model is incomplete or invalid; see the messages above") from None
    warn(model.warnings)
    counts = {"link": len(draft.links), "moving joint": model.joints[0], "loop": len(model.drawing.get("loops", []))}
    counts |= {what: len(ties) for what, ties in (("coupling", draft.couplings), ("actuator", draft.actuators)) if ties}
    mass = sum(link.mass for link in draft.links)
    facts = {what.replace(" ", "_") + "s": n for what, n in counts.items()}
    emit(options, {"model": target, **facts, "mass": mass, "omitted": draft.lost, "check": draft.doubts, "warnings": model.warnings})
    words = ", ".join(f"{n} {what}{'' if n == 1 else 's'}" for what, n in counts.items())
    if draft.inputs:
        print(f"to run it with its inputs: {run_command(draft, str(target))}")
    print(f"{target}  {words}, {mass:.6g} kg")
    return 0


def _file_name(options: argparse.Namespace, draft: Draft) -> str:
    """Returns the stem of the model file: that of the source, or of its folder for ReDySim files, which all have the same name."""
    source = options.source
    return draft.name if options.name or source.is_dir() or source.suffix.lower() in (".m", ".mat") else source.stem
