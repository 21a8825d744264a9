"""`build-fmu show`: runs an FMU or a model, or takes a recorded CSV, and writes the page or a film."""

from __future__ import annotations

import argparse
import math
import tempfile
from pathlib import Path

from build_fmu.cli.terminal import SEVERAL, targets_after, warn
from build_fmu.errors import UserError
from build_fmu.files import whole_file

FEWEST_PICTURES = 250


def add(commands) -> None:
    """Adds the command and its arguments."""
    command = commands.add_parser("show", help="write a page that plays a run: the mechanism beside linked plots", description="Write one HTML file that "
                                  "plays a run in any browser, without network. An FMU or a model file is run first; with a CSV its record is played.")
    command.add_argument("targets", nargs="*", type=Path, metavar="FMU|MODEL|CSV", help="what to run, a record to play, or both")
    command.add_argument("-o", "--output", type=Path, metavar="PAGE", help="file to write (default: NAME.html here)")
    command.add_argument("--stop", type=float, metavar="T", help="stop time in s (default: the FMU's own)")
    command.add_argument("--step", type=float, metavar="H", help="time between two pictures in s (default: the FMU's own, or a part of it that gives 250 pictures)")
    command.add_argument("--start", **SEVERAL, metavar="NAME=VALUE", help="start values, as for simulate")
    command.add_argument("--input", **SEVERAL, metavar="NAME=EXPR|FILE.csv", help="inputs, as for simulate")
    command.add_argument("--gif", type=Path, metavar="FILM", help="write a film (.gif) for reports; a page only with -o")
    command.add_argument("--mp4", type=Path, metavar="FILM", help="the same as .mp4, by the program ffmpeg")
    command.add_argument("--speed", type=float, default=1.0, metavar="X", help="of a film: seconds of the run in a second (default: 1)")
    command.add_argument("--rate", type=float, default=20.0, metavar="N", help="of a film: pictures in a second (default: 20)")
    command.set_defaults(run=run)


def run(options: argparse.Namespace) -> int:
    """Writes the page and returns the exit code."""
    from build_fmu.show.film import film
    from build_fmu.show.page import page
    from build_fmu.show.runs import about, recorded

    mechanism, record = _targets([*options.targets, *targets_after(options.input, options.start)])
    target = options.output or Path((record or mechanism).with_suffix(".html").name)
    films = _films(options)
    if target.suffix.lower() not in (".html", ".htm"):
        raise UserError(f"'{target}' is no name for a page: it must end in .html")
    asked = [word for word, value in (("--stop", options.stop), ("--step", options.step), ("--start", options.start), ("--input", options.input)) if value]
    if record and asked:
        raise UserError(f"{asked[0]} belongs to a run, and '{record}' is a recorded one")
    with tempfile.TemporaryDirectory() as folder:
        model = _model(mechanism) if mechanism else None
        if record:
            shown, title = recorded(record, model), record.stem
        else:
            shown, title = _simulated(mechanism, model, Path(folder), options)
    name = model.model_name if model else title
    for path in films:
        if model is None:
            raise UserError(f"'{path}' needs a mechanism: give the FMU or the model file, too")
        count = film(path, name, shown, model, options.speed, options.rate)
        print(f"{path}  {path.stat().st_size / 1024:.0f} kB, {count} pictures, t = {shown.time[0]:g} to {shown.time[-1]:g} s")
    if films and not options.output:
        return 0
    text, stride = page(name, about(model, shown, record), shown, model)
    whole_file(target, lambda temporary: temporary.write_text(text, encoding="utf-8", newline="\n"))
    every = f", one row in {stride}" if stride > 1 else ""
    print(f"{target}  {len(text.encode()) / 1024:.0f} kB, t = {shown.time[0]:g} to {shown.time[-1]:g} s{every}; open it in a browser")
    return 0


def _films(options: argparse.Namespace) -> list[Path]:
    """Returns the films that are asked for; what is wrong with them shows before the run."""
    films = [path for path in (options.gif, options.mp4) if path]
    for path, ending in ((options.gif, ".gif"), (options.mp4, ".mp4")):
        if path and path.suffix.lower() != ending:
            raise UserError(f"'{path}' must end in {ending}")
    if options.mp4:
        from build_fmu.show.film import encoder

        encoder()
    for word, value in (("--speed", options.speed), ("--rate", options.rate)):
        if not (math.isfinite(value) and value > 0):
            raise UserError(f"{word} must be a positive number, got {value:g}")
    return films


def _targets(targets: list[Path]) -> tuple[Path | None, Path | None]:
    """Returns the FMU or model and the CSV among the arguments."""
    if not targets:
        raise UserError("show needs an FMU, a model file or a record, for example `build-fmu show arm.fmu`")
    mechanisms = [t for t in targets if t.suffix in (".fmu", ".toml")]
    records = [t for t in targets if t.suffix.lower() == ".csv"]
    for other in targets:
        if other not in mechanisms and other not in records:
            raise UserError(f"'{other}' is neither an FMU (.fmu), a model file (.toml) nor a record (.csv)")
    if len(mechanisms) > 1 or len(records) > 1:
        raise UserError("show takes one FMU or model file, one CSV, or one of both")
    return next(iter(mechanisms), None), next(iter(records), None)


def _model(mechanism: Path):
    """Describes a model file, or the one that an FMU contains; None for an FMU without one."""
    from build_fmu.model.describe import describe
    from build_fmu.model.resources import model_in

    model = describe(mechanism) if mechanism.suffix == ".toml" else model_in(mechanism)
    if model is None:
        warn([f"'{mechanism}' contains no model file: the page has plots and no mechanism"])
    return model


def _simulated(mechanism: Path, model, folder: Path, options: argparse.Namespace) -> tuple:
    from build_fmu.fmu.build import build
    from build_fmu.run.session import Session
    from build_fmu.run.simulate import Settings, simulate, time_grid
    from build_fmu.show.runs import run_of

    fmu = mechanism
    if mechanism.suffix == ".toml":
        fmu = folder / f"{model.model_identifier}.fmu"
        build(model, mechanism, fmu)
    with Session(fmu) as session:
        step = options.step if options.step is not None or model is None else _smooth(time_grid(session, Settings(options.stop)))
        result = simulate(session, Settings(options.stop, step, None, options.start, options.input))
        warn(result.warnings)
        return run_of(session, result), session.description.modelName


def _smooth(times: list[float]) -> float:
    """Returns a step that plays smoothly where the model's own is coarse: a whole part of it."""
    count = len(times) - 1
    return (times[1] - times[0]) / math.ceil(FEWEST_PICTURES / count)
