"""Plots simulation results: positions, velocities, torques, energy, one panel per group and unit."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

from build_fmu.draw.figure import INK, plain_axes, save, titled_figure
from build_fmu.draw.groups import (
    GROUPS,
    OF_THE_MODEL,
    group_of,
    joint_parts,
    label_of,
    largest_energy,
    noise_of,
    noise_range,
    rank_of,
    title_of,
)
from build_fmu.errors import UserError
from build_fmu.run.session import Session
from build_fmu.run.simulate import Result

FORMATS = (".png", ".svg", ".pdf")
DASHES = ("-", "--", ":", "-.")
MOST_NAMED = 12


@dataclass
class Panel:
    """One panel: the curves of one group in one unit."""

    kind: str
    unit: str
    curves: list[tuple[str, np.ndarray]] = field(default_factory=list)
    energy: float = 0.0  # largest of the run, in the unit of the panel


def panels(session: Session, result: Result, asked: bool) -> list[Panel]:
    """Groups the curves. With `asked`, all recorded outputs are plotted, otherwise the groups plotted by default."""
    found: dict[tuple[str, str], Panel] = {}
    parts, energy = joint_parts(result.names), largest_energy({name: result[name] for name in result.names})
    active = [name for name, column in result.inputs.items() if np.any(column != 0)]
    for name in [*result.names, *([] if asked else active)]:
        kind = group_of(name)
        if not asked and not (kind in GROUPS and GROUPS[kind].drawn):
            continue
        shown, column = session.display(name), result[name]
        if not asked and (kind == "tau" or name == "energy.work") and not np.any(column != 0):
            continue
        panel = found.setdefault((kind, shown.unit), Panel(kind, shown.unit))
        column = _open_turns(column) if kind == "angle" else column
        panel.curves.append((_label(name, kind, parts), column * shown.factor + shown.offset))
        panel.energy = energy * shown.factor
    return sorted(found.values(), key=lambda p: rank_of(p.kind))


def _open_turns(angle: np.ndarray) -> np.ndarray:
    """Inserts a gap where an angle jumps between pi and -pi."""
    shown = np.array(angle, float)
    shown[1:][np.abs(np.diff(angle)) > 1.5 * np.pi] = np.nan
    return shown


def plot(path: Path, session: Session, result: Result, asked: Sequence[str] = ()) -> None:
    """Writes the picture (.png, .svg or .pdf); raises UserError for other formats or without outputs."""
    if path.suffix.lower() not in FORMATS:
        raise UserError(f"'{path}' is not a picture name: it must end in {', '.join(FORMATS)}")
    drawn = panels(session, result, bool(asked)) or panels(session, result, True)
    if not drawn:
        raise UserError("the FMU has no outputs to plot")
    columns = 1 if len(drawn) <= 2 else 2
    rows = -(-len(drawn) // columns)
    with titled_figure(session.description.modelName, 7.4 if columns == 1 else 11.5, 0.7 + 2.9 * rows) as figure:
        grid = figure.add_gridspec(rows, columns)
        for i, panel in enumerate(drawn):
            # a single last panel fills the row
            last = i == len(drawn) - 1 and len(drawn) % columns
            axes = figure.add_subplot(grid[-1, :] if last else grid[i // columns, i % columns])
            _draw(axes, panel, result.time, time_label=i >= len(drawn) - columns)
        save(figure, [path])


def _draw(axes, panel: Panel, time: np.ndarray, time_label: bool) -> None:
    from matplotlib import colormaps

    many = len(panel.curves) > MOST_NAMED
    palette = colormaps["viridis"] if many else colormaps["tab10"]
    for i, (label, values) in enumerate(panel.curves):
        colour = palette(i / max(1, len(panel.curves) - 1)) if many else palette(i % 10)
        named = not many or i in (0, len(panel.curves) - 1)
        # dashes keep coincident curves visible, and curves of equal colours apart
        style = DASHES[(i if panel.kind == "energy" else 0 if many else i // 10) % len(DASHES)]
        axes.plot(time, values, style, color=colour, lw=1.1 if many or panel.kind == "balance" else 1.6, label=label if named else None)
    unit = f" [{panel.unit}]" if panel.unit else ""
    only = len(panel.curves) == 1 and panel.kind in GROUPS and panel.kind not in OF_THE_MODEL
    axes.set_title(title_of(panel.kind) + (f": {panel.curves[0][0].strip()}" if only else ""), loc="left", fontsize=10, color=INK)
    axes.set_ylabel(f"{GROUPS[panel.kind].symbol if panel.kind in GROUPS else panel.kind}{unit}")
    if time_label:
        axes.set_xlabel("time [s]")
    _set_ranges(axes, panel, time)
    plain_axes(axes)
    if len(panel.curves) > 1 or panel.kind not in GROUPS:
        axes.legend(loc="upper left", bbox_to_anchor=(1.0, 1.02), frameon=False, fontsize=8.5, handlelength=1.6)


def _set_ranges(axes, panel: Panel, time: np.ndarray) -> None:
    axes.set_xlim(time[0], time[-1])
    known = np.concatenate([values[np.isfinite(values)] for _, values in panel.curves])
    low, high = (known.min(), known.max()) if len(known) else (-1.0, 1.0)
    noise = noise_of(panel.kind, max(abs(low), abs(high)), panel.energy)
    if high - low <= noise:
        middle, half = (low + high) / 2, noise_range(panel.kind, noise)
        axes.set_ylim(middle - half, middle + half)
    if (panel.kind == "angle" or all(np.all(np.isfinite(values)) for _, values in panel.curves)) and panel.kind != "balance":
        axes.ticklabel_format(axis="y", style="sci", scilimits=(-3, 5))


def _label(name: str, kind: str, parts: dict[str, str]) -> str:
    label = label_of(name, kind, parts)
    # matplotlib interprets $ as mathematics and hides names that start with _
    return (" " if label.startswith("_") else "") + label.replace("$", r"\$")
