"""Figures of fixed style and with reproducible bytes."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import Any

from build_fmu.files import whole_file

INK, GRID = "#22303c", "#e3e7ea"
# no date and no program version: equal input gives equal files
METADATA = {".png": {"Software": None}, ".svg": {"Date": None}, ".pdf": {"CreationDate": None}}


@contextmanager
def new_figure(width: float, height: float, dpi: int = 130, settings: dict[str, Any] | None = None, **more: Any) -> Iterator:
    """Yields a matplotlib figure (size in inches) that ignores the user's own settings; draw and save it inside the block."""
    import matplotlib
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure

    with matplotlib.rc_context():
        matplotlib.rcdefaults()
        matplotlib.rcParams.update({"svg.hashsalt": "build_fmu", **(settings or {})})
        figure = Figure(figsize=(width, height), dpi=dpi, **more)
        FigureCanvasAgg(figure)
        yield figure


@contextmanager
def titled_figure(title: str, width: float, height: float, font_size: float = 9) -> Iterator:
    """Yields a figure with a title and room for plots."""
    settings = {"font.size": font_size, "axes.axisbelow": True, "axes.formatter.use_mathtext": True}
    with new_figure(width, height, settings=settings, layout="constrained") as figure:
        figure.suptitle(title.replace("$", r"\$"), x=0.01, ha="left", fontsize=14, weight="bold", color=INK)
        yield figure


def plain_axes(axes) -> None:
    """Gives a plot a light grid and no frame at the top and right."""
    axes.grid(color=GRID, lw=0.8)
    axes.spines[["top", "right"]].set_visible(False)


def save(figure, paths: Sequence[Path]) -> None:
    """Writes the figure to each path, in the format of its extension."""
    for path in paths:
        kind = METADATA[path.suffix.lower()]
        whole_file(path, lambda temporary, kind=kind: figure.savefig(temporary, metadata=kind))
