"""`build-fmu show`: simulates an FMU or a model, or reads results from a CSV, and writes the page or a film."""

from __future__ import annotations

import argparse
import math
import tempfile
from contextlib import ExitStack
from dataclasses import replace
from pathlib import Path

from build_fmu import native
from build_fmu.cli.parser import number, positive
from build_fmu.cli.streams import add_options
from build_fmu.cli.terminal import SEVERAL, output_file, targets_after, warn
from build_fmu.errors import InvalidArgument, UserError
from build_fmu.files import whole_file
from build_fmu.model.describe import FOREIGN

FEWEST_PICTURES = 250
SPEED, RATE = 1.0, 20.0  # of films: simulated seconds per second, frames per second


def add(commands) -> None:
    """Adds the command and its arguments."""
    command = commands.add_parser(
        "show",
        help="write an HTML page that plays a simulation in 3D with plots",
        description="Write one HTML file that "
        "plays a simulation in any browser, without network. An FMU or a model file is simulated first; a CSV is played as it is.",
    )
    command.add_argument(
        "targets",
        nargs="*",
        type=Path,
        metavar="FMU|MODEL|CSV",
        help="FMU or model file to simulate, or results (.csv) to play, optionally with their FMU or model file",
    )
    command.add_argument("-o", "--output", type=Path, metavar="PAGE", help="output file (default: NAME.html in the current folder)")
    command.add_argument("--stop", type=number, metavar="T", help="stop time in s (default: as in the FMU)")
    command.add_argument(
        "--step", type=positive, metavar="H", help="time between two frames in s (default: as in the FMU, or its fraction for 250 frames)"
    )
    command.add_argument("--start", **SEVERAL, metavar="NAME=VALUE", help="start values, as for simulate")
    command.add_argument("--input", **SEVERAL, metavar="NAME=EXPR|FILE.csv", help="inputs, as for simulate")
    command.add_argument(
        "--still", type=Path, metavar="PICTURE", help="draw the mechanism at one time (.png); the page is written only with -o"
    )
    command.add_argument("--at", type=number, metavar="T", help="time of --still in s (default: the start)")
    command.add_argument("--gif", type=Path, metavar="FILM", help="write a film (.gif); the page is written only with -o")
    command.add_argument("--mp4", type=Path, metavar="FILM", help="write a film (.mp4); requires the program ffmpeg")
    command.add_argument("--speed", type=positive, metavar="X", help=f"film: simulated seconds per second (default: {SPEED:g})")
    command.add_argument("--rate", type=positive, metavar="N", help=f"film: frames per second (default: {RATE:g})")
    command.add_argument("--live", action="store_true", help="write a live page: sliders and the mouse act on the running model")
    add_options(command, reports=False)
    command.set_defaults(run=run)


def run(options: argparse.Namespace) -> int:
    """Writes page and films and returns the exit code. After a failure they show the part before it; the error is raised then."""
    from build_fmu.draw.shapes import with_solids
    from build_fmu.show.film import film
    from build_fmu.show.page import page
    from build_fmu.show.runs import about, recorded

    mechanism, record = _targets([*options.targets, *targets_after(options.input, options.start)])
    target = output_file(options.output, (record or mechanism).with_suffix(".html").name, (".html", ".htm"))
    films = _films(options)
    asked = [
        word
        for word, value in (("--stop", options.stop), ("--step", options.step), ("--start", options.start), ("--input", options.input))
        if value
    ]
    if record and asked:
        raise InvalidArgument(f"{asked[0]} applies to a simulation, but '{record}' contains results")
    if options.live:
        _check_live(record, options)
    live = None
    with tempfile.TemporaryDirectory() as folder, ExitStack() as kept:
        model, mechanism = _model(mechanism, kept) if mechanism else (None, None)
        if model:
            model, trouble = with_solids(model)
            warn(trouble)
        if record:
            shown, title = recorded(record, model), record.stem
        elif options.live:
            shown, live, title = _live(mechanism, model, Path(folder), options)
        else:
            shown, title, _ = _simulated(mechanism, model, Path(folder), options)
    name = model.model_name if model else title
    if options.still:
        _still(options, name, shown, model)
    for path in films:
        if model is None:
            raise UserError(f"'{path}' requires the mechanism: add the FMU or the model file")
        count = film(path, name, shown, model, options.speed or SPEED, options.rate or RATE)
        print(f"{path}  {path.stat().st_size / 1024:.0f} kB, {count} frames, t = {shown.time[0]:g} to {shown.time[-1]:g} s")
    if options.output or not (films or options.still):
        text, stride = page(name, about(model, shown, record), shown, model, live)
        whole_file(target, lambda temporary: temporary.write_text(text, encoding="utf-8", newline="\n"))
        every = f", one row in {stride}" if stride > 1 else ""
        print(f"{target}  {len(text.encode()) / 1024:.0f} kB, t = {shown.time[0]:g} to {shown.time[-1]:g} s{every}; open it in a browser")
    if shown.failure:
        raise shown.failure
    return 0


def _films(options: argparse.Namespace) -> list[Path]:
    """Returns the requested films; invalid options are reported before the run."""
    films = [path for path in (options.gif, options.mp4) if path]
    if options.at is not None and not options.still:
        raise InvalidArgument("--at is the time of a picture: add --still PICTURE.png")
    for word, value in (("--speed", options.speed), ("--rate", options.rate)):
        if value is not None and not films:
            raise InvalidArgument(f"{word} applies to a film: add --gif FILM.gif or --mp4 FILM.mp4")
    for path, ending in ((options.still, ".png"), (options.gif, ".gif"), (options.mp4, ".mp4")):
        if path:
            output_file(path, path.name, (ending,))
    if options.mp4:
        from build_fmu.show.film import encoder

        encoder()
    return films


def _still(options: argparse.Namespace, name: str, shown, model) -> None:
    """Draws the mechanism at one time of the run."""
    import numpy as np

    from build_fmu.draw.drawing import draw
    from build_fmu.show.motion import Motion

    if model is None:
        raise UserError(f"'{options.still}' requires the mechanism: add the FMU or the model file")
    at = shown.time[0] if options.at is None else options.at
    if not shown.time[0] <= at <= shown.time[-1]:
        raise UserError(f"--at must be between {shown.time[0]:g} and {shown.time[-1]:g} s, got {at:g}")
    row = int(np.argmin(np.abs(shown.time - at)))
    content = draw(Motion(model.drawing, shown.columns).at(row), name, f"t = {shown.time[row]:g} s")
    whole_file(options.still, lambda temporary: temporary.write_bytes(content))
    print(f"{options.still}  {len(content) / 1024:.0f} kB, t = {shown.time[row]:g} s")


def _targets(targets: list[Path]) -> tuple[Path | None, Path | None]:
    """Returns the FMU or model and the CSV among the targets."""
    if not targets:
        raise InvalidArgument("show requires an FMU, a model file or a CSV with results, for example `build-fmu show arm.fmu`")
    mechanisms = [t for t in targets if t.suffix in (".fmu", ".toml")]
    records = [t for t in targets if t.suffix.lower() == ".csv"]
    for other in targets:
        if other not in mechanisms and other not in records:
            hint = f"; {FOREIGN[other.suffix.lower()]}" if other.suffix.lower() in FOREIGN else ""
            raise UserError(f"unsupported file type: '{other}'; supported: FMU (.fmu), model file (.toml), results (.csv){hint}")
    if len(mechanisms) > 1 or len(records) > 1:
        raise InvalidArgument("too many targets: give one FMU or model file, one CSV, or both")
    return next(iter(mechanisms), None), next(iter(records), None)


def _model(mechanism: Path, kept: ExitStack) -> tuple:
    """Describes a model file, or the one that an FMU contains (None for an FMU without one). Returns the file to run, too."""
    from build_fmu.model.describe import describe
    from build_fmu.model.inverse import inverse_of
    from build_fmu.model.resources import model_in

    if mechanism.suffix != ".toml":
        model = model_in(mechanism)
        if model is None:
            warn([f"'{mechanism}' contains no model file: the page has plots and no mechanism"])
        return model, mechanism
    try:
        model = describe(mechanism)
        warn(model.warnings)
        return model, mechanism
    except UserError as error:
        if not mechanism.is_file():
            raise
        # a model without masses cannot be simulated, but its joints can be prescribed
        model, file = kept.enter_context(inverse_of(mechanism))
        warn([str(error), f"'{mechanism}' cannot be simulated: the page shows its kinematics; move joints with --input JOINT.q=EXPR"])
        return replace(model, model_name=model.model_name.removesuffix("_inverse")), file


def _check_live(record: Path | None, options: argparse.Namespace) -> None:
    """Raises UserError for options that a live page cannot follow, or without the library that it needs."""
    if record:
        raise UserError(f"--live requires a model file or an FMU; '{record}' contains results")
    if options.input:
        raise InvalidArgument("--input applies to a recorded run: remove --live, where sliders set the inputs")
    for word, value in (("--still", options.still), ("--gif", options.gif), ("--mp4", options.mp4)):
        if value:
            raise InvalidArgument(f"{word} applies to a recorded run: remove --live")
    native.web_library()


def _live(mechanism: Path, model, folder: Path, options: argparse.Namespace) -> tuple:
    """Runs the model with a port on each link; returns the run, the data of the live page, and its title."""
    from build_fmu.model.resources import unpack_model
    from build_fmu.show.live import prepared, with_ports

    if mechanism.suffix != ".toml":
        if model is None:
            raise UserError(f"'{mechanism}' contains no model file: a page cannot compute it")
        unpack_model(mechanism, folder)
        mechanism = folder / "model.toml"
    with with_ports(model, mechanism) as (ported, file, frames):
        shown, title, start = _simulated(file, ported, folder, options)
        return (*prepared(ported, file, frames, shown, start), title)


def _simulated(mechanism: Path, model, folder: Path, options: argparse.Namespace) -> tuple:
    from build_fmu.fmu.build import build_for_run
    from build_fmu.run.session import Session
    from build_fmu.run.simulate import Settings, Stopped, simulate, start_values, time_grid
    from build_fmu.show.runs import run_of

    fmu = mechanism
    if mechanism.suffix == ".toml":
        fmu = folder / f"{model.model_identifier}.fmu"
        build_for_run(model, mechanism, fmu)
    with Session(fmu) as session:
        step = options.step if options.step is not None or model is None else _smooth(time_grid(session, Settings(options.stop)))
        failure = None
        try:
            result = simulate(session, Settings(options.stop, step, None, options.start, options.input))
        except Stopped as stopped:
            failure, result = stopped, stopped.result
        warn(result.warnings, model.warnings if mechanism.suffix == ".toml" else ())
        return run_of(session, result, failure), session.description.modelName, start_values(session, options.start)


def _smooth(times: list[float]) -> float:
    """Returns the model's step divided by an integer, for a smooth motion."""
    count = len(times) - 1
    return (times[1] - times[0]) / math.ceil(FEWEST_PICTURES / count)
