"""`build-fmu show`: runs an FMU or a model, or takes a recorded CSV, and writes the page."""

from __future__ import annotations

import math
import sys
import tempfile
import zipfile
from argparse import Namespace
from pathlib import Path

import numpy as np

from build_fmu.archive import whole_file
from build_fmu.build import build
from build_fmu.describe import Description, describe
from build_fmu.errors import UserError
from build_fmu.resources import MODEL_IN_FMU, extract_model
from build_fmu.session import Session
from build_fmu.show.film import encoder, film
from build_fmu.show.page import Run, page
from build_fmu.signals import read_table
from build_fmu.simulate import Result, Settings, simulate, time_grid

FEWEST_PICTURES = 250


def run(options: Namespace) -> int:
    """Writes the page and returns the exit code."""
    # a target may stand after a list: --input a=1 arm.fmu
    for values in (options.input, options.start):
        while values and "=" not in values[-1] and values[-1].endswith((".fmu", ".toml")):
            options.targets.append(Path(values.pop()))
    mechanism, record = _targets(options.targets)
    target = options.output or Path((record or mechanism).with_suffix(".html").name)
    films = _films(options)
    if target.suffix.lower() not in (".html", ".htm"):
        raise UserError(f"'{target}' is no name for a page: it must end in .html")
    asked = [word for word, value in (("--stop", options.stop), ("--step", options.step), ("--start", options.start), ("--input", options.input)) if value]
    if record and asked:
        raise UserError(f"{asked[0]} belongs to a run, and '{record}' is a recorded one")
    with tempfile.TemporaryDirectory() as folder:
        model = _model(mechanism, Path(folder)) if mechanism else None
        if record:
            shown, title = _recorded(record, model), record.stem
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


def _films(options: Namespace) -> list[Path]:
    """Returns the films that are asked for; what is wrong with them shows before the run."""
    films = [path for path in (options.gif, options.mp4) if path]
    for path, ending in ((options.gif, ".gif"), (options.mp4, ".mp4")):
        if path and path.suffix.lower() != ending:
            raise UserError(f"'{path}' must end in {ending}")
    if options.mp4:
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


def _model(mechanism: Path, folder: Path) -> Description | None:
    """Describes the model, also the one that an FMU of ours carries; None for another tool's FMU."""
    if mechanism.suffix == ".toml":
        return describe(mechanism)
    if not mechanism.is_file():
        raise UserError(f"there is no FMU '{mechanism}'")
    try:
        with zipfile.ZipFile(mechanism) as archive:
            if MODEL_IN_FMU not in archive.namelist():
                print(f"'{mechanism}' holds no model file: the page has plots and no mechanism", file=sys.stderr)
                return None
            return describe(extract_model(archive, folder))
    except (zipfile.BadZipFile, OSError, zipfile.LargeZipFile) as error:
        raise UserError(f"'{mechanism}' is not a readable FMU: {error}") from None


def _simulated(mechanism: Path, model: Description | None, folder: Path, options: Namespace) -> tuple[Run, str]:
    fmu = mechanism
    if mechanism.suffix == ".toml":
        fmu = folder / f"{model.model_identifier}.fmu"
        build(model, mechanism, fmu)
    with Session(fmu) as session:
        step = options.step if options.step is not None or model is None else _smooth(time_grid(session, Settings(options.stop)))
        result = simulate(session, Settings(options.stop, step, None, options.start, options.input))
        for line in result.warnings:
            print(line, file=sys.stderr)
        return run_of(session, result), session.description.modelName


def _smooth(times: list[float]) -> float:
    """Returns a step that plays smoothly where the model's own is coarse: a whole part of it."""
    count = len(times) - 1
    return (times[1] - times[0]) / math.ceil(FEWEST_PICTURES / count)


def run_of(session: Session, result: Result) -> Run:
    """Returns what a page needs of a simulated run: outputs, inputs that were used, units."""
    columns = {name: result[name] for name in result.names} | {name: values for name, values in result.inputs.items() if np.any(values != 0)}
    units = {}
    for name in columns:
        display = session.display(name)
        # an offset would be wrong for differences; no unit of ours has one
        units[name] = (display.unit, display.factor)
    return Run(result.time, columns, units)


def _recorded(record: Path, model: Description | None) -> Run:
    table = read_table(record)
    columns = {name: np.array(values) for name, values in table.items() if name != "time"}
    if not columns:
        raise UserError(f"'{record}' has no column but time")
    units = {}
    if model:
        shown = {unit["name"]: {d["name"]: float(d.get("factor", 1)) for d in unit.get("display", [])} for unit in model.units}
        for variable in model.variables:
            factor = shown.get(variable.unit, {}).get(variable.display_unit)
            units[variable.name] = (variable.display_unit, factor) if factor else (variable.unit or "", 1.0)
        known = {v.name for v in model.variables}
        joints = [f"{link.get('joint')}.q" for link in model.drawing["links"] if link["type"] != "fixed"]
        missing = [name for name in joints if name in known and name not in columns]
        if missing:
            print(f"'{record}' has no column '{missing[0]}'{f' and {len(missing) - 1} more' if len(missing) > 1 else ''}: these joints stand still",
                  file=sys.stderr)
    return Run(np.array(table["time"]), columns, units)


def about(model: Description | None, shown: Run, record: Path | None) -> str:
    """Returns the line under the title: what the model says of itself, its joints, its mass."""
    parts = [model.description] if model and model.description else []
    if model:
        links = model.drawing["links"]
        counts = {"revolute": 0, "prismatic": 0, "fixed": 0}
        for link in links:
            counts[link["type"]] = counts.get(link["type"], 0) + 1
        loops = len(model.drawing.get("loops", []))
        words = [f"{count} {kind}" for kind, count in counts.items() if count] + ([f"{loops} loop{'s' if loops > 1 else ''}"] if loops else [])
        parts.append(f"{', '.join(words)}, {sum(link['mass'] for link in links):.4g} kg")
    if record:
        parts.append(f"record {record.name}, {len(shown.time)} rows")
    return " · ".join(parts)
