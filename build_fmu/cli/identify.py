"""`build-fmu identify`: masses, inertias, friction and armatures of a model from measured motion and torques."""

from __future__ import annotations

import argparse
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from build_fmu.cli.parser import number, positive
from build_fmu.cli.streams import STREAM, add_options, emit
from build_fmu.cli.terminal import SEVERAL, console, output_file, warn
from build_fmu.errors import InvalidArgument, UserError, did_you_mean, unknown

if TYPE_CHECKING:
    from build_fmu.identify.parameters import Plant
    from build_fmu.identify.run import Identification, Run
    from build_fmu.library.model import Model

SPEED = 1.0  # rad/s, m/s
DURATION = 10.0  # s
UNITS = ("rad", "rad/s", "N.m"), ("m", "m/s", "N")  # of rotating and of sliding joints


def add(commands) -> None:
    """Adds the command and its arguments."""
    command = commands.add_parser(
        "identify",
        help="identify masses, inertias, friction and armatures from measured motion and torques",
        description="Identify the parameters of a model from a measured run and write a model file that reproduces it. With --design, "
        "propose an exciting trajectory instead. All values are in SI units and rad.",
    )
    command.add_argument("model", type=Path, metavar="MODEL", help="model file (.toml)")
    command.add_argument(
        "runs",
        nargs="*",
        type=Path,
        metavar="RUN.csv",
        help="columns 'time' or 't' (s), <joint>.q, <joint>.tau, and optionally .qd, .qdd; several files with equal times are joined",
    )
    command.add_argument(
        "-o", "--output", type=Path, metavar="FILE", help="file or folder (default: MODEL_identified.toml or MODEL_motion.csv)"
    )
    command.add_argument("--force", action="store_true", help="overwrite an existing file")
    command.add_argument(
        "--parameters",
        **SEVERAL,
        metavar="NAME",
        help="links, and <joint>.damping, .friction, .armature, with * as wildcard (default: all)",
    )
    command.add_argument("--payload", metavar="LINK", help="identify this link and those of --parameters, and report the added body")
    command.add_argument(
        "--cutoff",
        type=positive,
        metavar="HZ",
        help="cutoff of the filter of motion and torques (default: 10 without .qd, .qdd, which it differentiates; else no filter)",
    )
    command.add_argument("--design", action="store_true", help="propose a trajectory and write it as a table")
    command.add_argument(
        "--range",
        **SEVERAL,
        type=_range,
        metavar="JOINT=LOW:HIGH",
        help="design: positions, with * as wildcard (default: the stops of the model)",
    )
    command.add_argument(
        "--speed",
        **SEVERAL,
        type=_speed,
        metavar="JOINT=V",
        help=f"design: maximum speeds (default: of the actuator, else {SPEED:g} rad/s, m/s)",
    )
    command.add_argument("--duration", type=positive, metavar="T", help=f"design: duration in s (default: {DURATION:g})")
    add_options(command, reports=True)
    command.set_defaults(run=run)


def _range(text: str) -> tuple[str, tuple[float, float]]:
    name, _, ends = text.partition("=")
    low, colon, high = ends.partition(":")
    if not name or not colon or number(low) >= number(high):
        raise argparse.ArgumentTypeError(f"'{text}' is not a range: write JOINT=LOW:HIGH")
    return name, (number(low), number(high))


def _speed(text: str) -> tuple[str, float]:
    name, _, value = text.partition("=")
    return name, positive(value)


def run(options: argparse.Namespace) -> int:
    """Identifies or designs, and writes the file."""
    from build_fmu.library.model import load

    if options.design == bool(options.runs):
        raise InvalidArgument("identify requires a measured run, or --design" if not options.runs else "--design takes no measured run")
    _check_options(options)
    with load(options.model) as model:
        warn(model.description.warnings)
        chosen = [*options.parameters, *([options.payload] if options.payload else [])]
        if options.design:
            return _design(options, model, chosen)
        return _identify(options, model, chosen)


def _check_options(options: argparse.Namespace) -> None:
    """Raises InvalidArgument for options without effect."""
    for word in ("range", "speed", "duration"):
        if getattr(options, word) and not options.design:
            raise InvalidArgument(f"--{word} applies to --design, not to a measured run")
    if options.cutoff and options.design:
        raise InvalidArgument("--cutoff applies to a measured run, not to --design")


def _identify(options: argparse.Namespace, model: Model, chosen: list[str]) -> int:
    from build_fmu.identify.run import equations, identify
    from build_fmu.library.model import load

    plant = model.plant()
    if options.payload and options.payload not in plant.links:
        raise unknown("link", options.payload, plant.links)
    target = _target(options, f"{options.model.stem}_identified.toml", model)
    measured = _read(options.runs, plant)
    result = identify(plant, measured, chosen, options.cutoff)
    payload = _payload(result, options.payload) if options.payload else {}
    sources = ", ".join("standard input" if path == STREAM else path.name for path in options.runs)
    result.write(target, options.model, f"Parameters identified by build-fmu identify from {sources}")
    # the residual of the file itself, not of the numbers in memory
    with load(target) as written:
        left = equations(written.plant(), measured, options.cutoff)[2]
    warn(result.warnings)
    emit(options, {"model": target, **_facts(result), "residual": dict(zip(plant.torques, left.tolist(), strict=True)), **payload})
    _print(result, left)
    for name, (value, error) in payload.get("payload", {}).items():
        unit = {"mass": "kg", "com": "m"}.get(name.partition("[")[0], "kg.m2")
        print(f"payload {name:12} {value:12.6g} +- {error:.2g} {unit}")
    print(f"{target}  {len(result.names)} base parameters, condition number {result.condition:.3g}, {result.rows} rows, {result.method}")
    return 0


def _target(options: argparse.Namespace, name: str, model: Model) -> Path:
    """Returns the file to write; raises UserError if the model would not find its files from there."""
    if options.on_stdout:
        return options.output
    target = output_file(options.output, name, (Path(name).suffix,))
    if target.exists() and not options.force:
        raise UserError(f"'{target}' already exists; choose another name with -o or overwrite it with --force")
    others = [] if options.design else [*model.description.resources]
    if others and target.resolve().parent != options.model.resolve().parent:
        raise UserError(f"the model refers to '{others[0]}' beside it: write '{target.name}' into its folder with -o")
    return target


def _read(files: list[Path], plant: Plant) -> Run:
    """Returns the columns of the driven joints; raises UserError."""
    from build_fmu.identify.run import Run
    from build_fmu.run.signals import read_table

    table: dict[str, list[float]] = {}
    for path in files:
        new = read_table(path)
        if table and new["time"] != table["time"]:
            raise UserError(f"the times of '{path}' differ from those of '{files[0]}'")
        if twice := [name for name in new if name != "time" and name in table]:
            raise UserError(f"'{path}' repeats column '{twice[0]}' of another file")
        table |= new

    def columns(names: list[str], needed: bool) -> np.ndarray | None:
        missing = [name for name in names if name not in table]
        if len(missing) == len(names) and not needed:
            return None
        if missing:
            raise UserError(f"'{files[0]}' has no column '{missing[0]}'{did_you_mean(missing[0], table)}")
        return np.column_stack([table[name] for name in names])

    q, qd, qdd = (columns([f"{joint}.{letter}" for joint in plant.joints], letter == "q") for letter in ("q", "qd", "qdd"))
    return Run(np.array(table["time"]), q, columns(list(plant.torques), True), qd, qdd)


def _facts(result: Identification) -> dict:
    rows = zip(result.names, result.values, result.errors, result.start, strict=True)
    every = zip(result.parameters, result.pi, np.sqrt(np.diag(result.covariance)), result.plant.start(), strict=True)
    return {
        "base": [{"name": n, "value": v, "error": e, "before": b} for n, v, e, b in rows],
        "parameters": [{"name": n, "value": v, "error": e, "before": b} for n, v, e, b in every],
        "condition": result.condition,
        "rows": result.rows,
        "method": result.method,
        "noise": dict(zip(result.plant.torques, result.noise, strict=True)),
        "residual_before": dict(zip(result.plant.torques, result.before, strict=True)),
        "warnings": result.warnings,
    }


def _payload(result: Identification, link: str) -> dict:
    """Returns mass, center of mass and inertia about it of the added body, with standard errors."""
    from build_fmu.identify.parameters import PLACES, body_of

    vector, covariance = result.added(link)
    names = ["mass", "com[1]", "com[2]", "com[3]", *(f"inertia[{k}]" for k in range(1, 7))]
    mass, error = vector[0], np.sqrt(covariance[0, 0])
    if mass <= 2 * error:
        raise UserError(f"link '{link}' has no payload: its mass would be {mass:.3g} +- {error:.2g} kg")

    def numbers(ten: np.ndarray) -> np.ndarray:
        mass, com, inertia = body_of(ten)
        return np.array([mass, *com, *(inertia[i, j] for i, j in PLACES)])

    small = 1e-6 * np.maximum(abs(vector), 1e-6 * abs(vector).max())
    slopes = np.column_stack([(numbers(vector + d) - numbers(vector - d)) / (2 * d.sum()) for d in np.diag(small)])
    errors = np.sqrt(np.einsum("ij,jk,ik->i", slopes, covariance, slopes))
    return {"payload": dict(zip(names, zip(numbers(vector).tolist(), errors.tolist(), strict=True), strict=True))}


def _print(result: Identification, left: np.ndarray) -> None:
    """Prints the base parameters and the residuals."""
    from rich import box
    from rich.markup import escape
    from rich.table import Table

    table = Table(box=box.SIMPLE_HEAD, title="base parameters, SI units", title_justify="left")
    for head, justify in (("", "left"), ("model file", "right"), ("identified", "right"), ("standard error", "right")):
        table.add_column(head, justify=justify)
    for name, before, value, error in zip(result.names, result.start, result.values, result.errors, strict=True):
        table.add_row(escape(name), f"{before:.5g}", f"{value:.5g}", f"{error:.2g}")
    console().print(table)
    table = Table(box=box.SIMPLE_HEAD, title="root mean square of the residual", title_justify="left")
    for head, justify in (("", "left"), ("model file", "right"), ("identified", "right")):
        table.add_column(head, justify=justify)
    for name, slides, before, after in zip(result.plant.torques, result.plant.sliding.tolist(), result.before, left, strict=True):
        table.add_row(escape(f"{name} [{UNITS[slides][2]}]"), f"{before:.4g}", f"{after:.4g}")
    console().print(table)


def _design(options: argparse.Namespace, model: Model, chosen: list[str]) -> int:
    from build_fmu.identify.design import design, limits_of
    from build_fmu.identify.run import POOR
    from build_fmu.run.simulate import Result
    from build_fmu.run.tables import write_csv

    plant = model.plant()
    low, high, speed = _limits(options, plant)
    target = _target(options, f"{options.model.stem}_motion.csv", model)
    duration = options.duration or DURATION
    found = design(plant, limits_of(plant, low, high, speed), duration, duration / 1000, chosen)
    names = [f"{joint}.{letter}" for letter in ("q", "qd", "qdd") for joint in plant.joints]
    write_csv(target, Result(found.time, [*names, *plant.torques], np.hstack([found.q, found.qd, found.qdd, found.torques])))
    peak = abs(found.torques).max(axis=0)
    emit(
        options,
        {"file": target, "condition": found.condition, "rows": len(found.time), "torque": dict(zip(plant.torques, peak, strict=True))},
    )
    ends = found.q.min(axis=0), found.q.max(axis=0), abs(found.qd).max(axis=0), peak
    for joint, name, slides, a, b, v, t in zip(plant.joints, plant.torques, plant.sliding.tolist(), *ends, strict=True):
        q, qd, tau = UNITS[slides]
        print(f"{joint}: position {a:.4g} to {b:.4g} {q}, speed up to {v:.4g} {qd}, {name} of the model file up to {t:.4g} {tau}")
    print(f"{target}  {len(found.time)} rows, {duration:g} s, condition number {found.condition:.3g}")
    if found.condition > POOR:
        warn([f"poor excitation: a condition number above {POOR:g}; use larger ranges and speeds, or identify fewer parameters"])
    return 0


def _limits(options: argparse.Namespace, plant: Plant) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Returns positions and speeds; raises UserError for a joint without a range."""
    ranges, speeds = _by_joint(options.range, plant), _by_joint(options.speed, plant)
    low, high, speed = (np.empty(len(plant.joints)) for _ in range(3))
    for k, joint in enumerate(plant.joints):
        low[k], high[k] = ranges.get(joint) or (plant.values.get(f"{joint}.{end}", np.inf) for end in ("lower", "upper"))
        if not np.isfinite([low[k], high[k]]).all():
            raise UserError(f"joint '{joint}' has no stops on both sides: give its range, for example --range '{joint}=-1:1' or '*=-1:1'")
        speed[k] = speeds.get(joint) or plant.values.get(f"{joint}.speed_limit", SPEED)
    return low, high, speed


def _by_joint(arguments: list[tuple], plant: Plant) -> dict:
    """Returns the value of each joint; a later argument replaces an earlier one."""
    from build_fmu.run.simulate import matches

    values = {}
    for pattern, value in arguments:
        if not (found := matches(pattern, plant.joints)):
            raise unknown("joint", pattern, plant.joints)
        values |= dict.fromkeys(found, value)
    return values
