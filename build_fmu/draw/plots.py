"""Draws what a run did: positions, velocities, torques, energy, one panel for each kind and unit."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

from build_fmu.errors import UserError
from build_fmu.files import whole_file
from build_fmu.run.session import Session
from build_fmu.run.simulate import Result

FORMATS = (".png", ".svg", ".pdf")
TITLES = {"q": "joint position", "qd": "joint velocity", "qdd": "joint acceleration", "tau": "joint torque or force",
          "angle": "angles about z, x, y", "omega": "angular velocity in link axes", "alpha": "angular acceleration in link axes",
          "energy": "energy", "balance": "energy balance: total − start − work", "gap": "loop gap"}  # fmt: skip
ORDER = ("q", "angle", "qd", "omega", "qdd", "alpha", "tau", "energy", "balance", "gap")
BY_DEFAULT = ("q", "angle", "qd", "omega", "tau", "energy", "balance", "gap")
DASHES = ("-", "--", ":", "-.")
MOST_NAMED = 12


@dataclass
class Panel:
    """One set of axes: curves of one kind in one unit, ready to draw."""

    kind: str
    unit: str
    curves: list[tuple[str, np.ndarray]] = field(default_factory=list)


def panels(session: Session, result: Result, asked: bool) -> list[Panel]:
    """Groups the curves. With `asked`, every recorded output is drawn; else the kinds a person looks at first."""
    found: dict[tuple[str, str], Panel] = {}
    active = [name for name, column in result.inputs.items() if np.any(column != 0)]
    for name in [*result.names, *([] if asked else active)]:
        kind = _kind(name)
        if not asked and kind not in BY_DEFAULT:
            continue
        shown, column = session.display(name), result[name]
        if not asked and (kind == "tau" or name == "energy.work") and not np.any(column != 0):
            continue
        panel = found.setdefault((kind, shown.unit), Panel(kind, shown.unit))
        column = _open_turns(column) if kind == "angle" else column
        panel.curves.append((_label(name, kind), column * shown.factor + shown.offset))
    return sorted(found.values(), key=lambda p: ORDER.index(p.kind) if p.kind in ORDER else len(ORDER))


def _open_turns(angle: np.ndarray) -> np.ndarray:
    """Leaves a gap where an angle goes on at -pi after pi: no line is drawn across the panel."""
    shown = np.array(angle, float)
    shown[1:][np.abs(np.diff(angle)) > 1.5 * np.pi] = np.nan
    return shown


def plot(path: Path, session: Session, result: Result, asked: Sequence[str] = ()) -> None:
    """Writes the picture (.png, .svg or .pdf); raises UserError for another ending or nothing to draw."""
    if path.suffix.lower() not in FORMATS:
        raise UserError(f"'{path}' is no name for a picture: it must end in {', '.join(FORMATS)}")
    drawn = panels(session, result, bool(asked)) or panels(session, result, True)
    if not drawn:
        raise UserError("the FMU has no outputs to plot")
    import matplotlib
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure

    with matplotlib.rc_context():
        matplotlib.rcdefaults()
        matplotlib.rcParams.update({"svg.hashsalt": "build_fmu", "font.size": 9, "axes.axisbelow": True})
        columns = 1 if len(drawn) <= 2 else 2
        rows = -(-len(drawn) // columns)
        figure = Figure(figsize=(7.4 if columns == 1 else 11.5, 0.7 + 2.9 * rows), dpi=130, layout="constrained")
        FigureCanvasAgg(figure)
        figure.suptitle(session.description.modelName.replace("$", r"\$"), x=0.01, ha="left", fontsize=14, weight="bold", color="#22303c")
        grid = figure.add_gridspec(rows, columns)
        for i, panel in enumerate(drawn):
            # a lone last panel takes the whole row
            last = i == len(drawn) - 1 and len(drawn) % columns
            axes = figure.add_subplot(grid[-1, :] if last else grid[i // columns, i % columns])
            _draw(axes, panel, result.time, time_label=i >= len(drawn) - columns)
        metadata = {".png": {"Software": None}, ".svg": {"Date": None}, ".pdf": {"CreationDate": None}}
        whole_file(path, lambda temporary: figure.savefig(temporary, metadata=metadata[path.suffix.lower()]))


def _draw(axes, panel: Panel, time: np.ndarray, time_label: bool) -> None:
    from matplotlib import colormaps

    many = len(panel.curves) > MOST_NAMED
    palette = colormaps["viridis"] if many else colormaps["tab10"]
    for i, (label, values) in enumerate(panel.curves):
        colour = palette(i / max(1, len(panel.curves) - 1)) if many else palette(i % 10)
        named = not many or i in (0, len(panel.curves) - 1)
        # equal curves stay visible: later ones are thinner and dashed
        style = DASHES[i % len(DASHES)] if panel.kind == "energy" else "-"
        axes.plot(time, values, style, color=colour, lw=1.1 if many or panel.kind == "balance" else 1.6, label=label if named else None)
    unit = f" [{panel.unit}]" if panel.unit else ""
    only = len(panel.curves) == 1 and panel.kind in ("q", "qd", "qdd", "tau", "gap")
    title = TITLES.get(panel.kind, panel.kind) + (f": {panel.curves[0][0].strip()}" if only else "")
    axes.set_title(title, loc="left", fontsize=10, color="#22303c")
    axes.set_ylabel(f"{_symbol(panel.kind)}{unit}")
    if time_label:
        axes.set_xlabel("time [s]")
    axes.set_xlim(time[0], time[-1])
    low, high = axes.get_ylim()
    if panel.kind in ("q", "qd", "tau", "energy") and high - low < 1e-9 * max(1, abs(low), abs(high)):
        # rounding errors of something at rest are no motion
        axes.set_ylim((low + high) / 2 - 1, (low + high) / 2 + 1)
    axes.grid(color="#e3e7ea", lw=0.8)
    for side in ("top", "right"):
        axes.spines[side].set_visible(False)
    if (panel.kind == "angle" or all(np.all(np.isfinite(values)) for _, values in panel.curves)) and panel.kind != "balance":
        axes.ticklabel_format(axis="y", style="sci", scilimits=(-3, 5), useMathText=True)
    if len(panel.curves) > 1 or panel.kind not in TITLES:
        axes.legend(loc="upper left", bbox_to_anchor=(1.0, 1.02), frameon=False, fontsize=8.5, handlelength=1.6)


def _kind(name: str) -> str:
    head, _, tail = name.rpartition(".")
    if head == "energy":
        return "balance" if tail == "balance" else "energy"
    return tail.partition("[")[0] if head else name


def _label(name: str, kind: str) -> str:
    if kind in TITLES:
        head, _, tail = name.rpartition(".")
        # joints of several freedoms count theirs behind the kind: top.angle[2]
        name = tail if kind in ("energy", "balance") else head + tail[len(kind):]
    # matplotlib reads $ as mathematics and hides names that start with _
    return (" " if name.startswith("_") else "") + name.replace("$", r"\$")


def _symbol(kind: str) -> str:
    symbols = {"angle": "angle", "omega": r"$\omega$", "alpha": r"$\alpha$", "q": "$q$", "qd": r"$\dot{q}$", "qdd": r"$\ddot{q}$", "tau": r"$\tau$", "energy": "$E$", "balance": r"$\Delta E$"}
    return symbols.get(kind, kind)
