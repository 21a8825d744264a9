#!/usr/bin/env python3
"""The history of the figures with targets: one JSON line per commit in docs/figures_history.jsonl, and its plot.

    python bench/history.py         draws docs/pictures/figures_history.svg

document.py adds the line of a run of `make bench`. A line holds the worst result of each target of that time, by its metric.
"""

from __future__ import annotations

import json
import re
from pathlib import Path
from typing import Any

import tables

ROOT = Path(__file__).resolve().parent.parent
FILE = "figures_history.jsonl"
PICTURE = "figures_history.svg"
COLUMNS = 4


def entry(figures: str, core: str) -> dict[str, Any] | None:
    """Returns the line of a run by its lines `scene.metric value` and the header of core.txt; None without a commit."""
    commit = re.search(r"commit ([0-9a-f]+(?: with changes)?)", core)
    if not commit:
        return None
    heads = {key: found[1].strip() for key in ("machine", "compiler") if (found := re.search(rf"^# {key} (.*)", core, re.M))}
    found = tables.figures(figures)
    worst = dict(filter(None, (target.worst(found) for target in tables.TARGETS)))
    return {"commit": commit[1], **heads, "figures": worst}


def with_entry(text: str, new: dict[str, Any]) -> str:
    """Returns the lines with a new one, which replaces that of the same commit."""
    kept = [line for line in text.splitlines() if json.loads(line)["commit"] != new["commit"]]
    return "\n".join([*kept, json.dumps(new, ensure_ascii=False)]) + "\n"


def courses(lines: list[dict[str, Any]]) -> list[tuple[tables.Target, list[float]]]:
    """Returns the results of each target that was measured, NaN where it was not."""
    found = []
    for target in tables.TARGETS:
        results = [target.worst(line["figures"]) for line in lines]
        if any(results):
            found.append((target, [float("nan") if result is None else result[1] for result in results]))
    return found


def draw(text: str, picture: Path) -> None:
    """Plots each target over the commits; the dashed line is its bound, a vertical line is a change of the processor."""
    import matplotlib

    matplotlib.use("svg")
    # the same file for the same figures
    matplotlib.rcParams.update({"svg.hashsalt": "history", "svg.fonttype": "none", "font.size": 7})
    from matplotlib import pyplot

    lines = [json.loads(line) for line in text.splitlines()]
    commits, found = [line["commit"] for line in lines], courses(lines)
    processors = [line.get("machine", "").partition(",")[0] for line in lines]
    changes = [k for k in range(1, len(commits)) if processors[k] != processors[k - 1]]
    rows = -(-len(found) // COLUMNS)
    figure, axes = pyplot.subplots(rows, COLUMNS, figsize=(11, 1.9 * rows), squeeze=False)
    for axis in axes.flat[len(found) :]:
        axis.set_visible(False)
    for axis, (target, results) in zip(axes.flat, found, strict=False):
        axis.plot(range(len(commits)), results, "o-", markersize=3, color="#2f6fb5")
        axis.axhline(target.bound, linestyle="--", linewidth=1, color="#c8455a")
        axis.set_title("\n".join(_wrapped(target.words)), fontsize=7)
        axis.set_xticks(range(len(commits)), [commit[:7] for commit in commits], rotation=90)
        for place in changes:
            axis.axvline(place - 0.5, linewidth=0.8, color="0.6")
        if target.bound > 0 and min(result for result in results if result == result) < target.bound / 20:
            axis.set_yscale("log")
        axis.margins(0.15)
    figure.tight_layout()
    figure.savefig(picture, metadata={"Date": None})
    pyplot.close(figure)


def _wrapped(words: str) -> list[str]:
    from textwrap import wrap

    return wrap(words, 46)[:2]


if __name__ == "__main__":
    draw((ROOT / "docs" / FILE).read_text(encoding="utf-8"), ROOT / "docs" / "pictures" / PICTURE)
