"""Fills the page with style, scripts and results: one self-contained HTML file."""

from __future__ import annotations

import base64
import json
from dataclasses import dataclass, field
from html import escape
from importlib import resources
from typing import Any

import numpy as np

from build_fmu.draw.groups import GROUPS, group_of, joint_parts, label_of, largest_energy, noise_of, noise_range, rank_of, title_of
from build_fmu.model.describe import Description

SCRIPTS = [f"{name}.js" for name in ("data", "mechanism", "extent", "gl", "view", "pose", "contacts", "shapes", "paint", "plots", "player")]
LIVE_SCRIPTS = ["core.js", "live.js"]
MOST_VALUES = 60_000  # in the page; of longer results every k-th row is kept
HIDDEN = ("solver",)


@dataclass
class Run:
    """Results over time in SI units, with display units."""

    time: np.ndarray
    columns: dict[str, np.ndarray]
    units: dict[str, tuple[str, float]] = field(default_factory=dict)  # name -> display unit, factor from SI
    failure: Exception | None = None  # of the simulation, after the last row


def page(title: str, about: str, run: Run, model: Description | None, live: dict[str, Any] | None = None) -> tuple[str, int]:
    """Returns the HTML text and the stride (1: all rows are included). With `live` (see live.py) the page computes."""
    columns = {name: values for name, values in run.columns.items() if name.split(".")[0] not in HIDDEN}
    stride = max(1, -(-len(run.time) * len(columns) // MOST_VALUES))
    rows = np.unique(np.append(np.arange(0, len(run.time), stride), len(run.time) - 1))
    with np.errstate(over="ignore"):  # before a failure
        values = np.array([column[rows] for column in columns.values()], np.float32)
    data = {
        "time": _base64(run.time[rows].astype(np.float64)),
        "values": _base64(values),
        "names": list(columns),
        "panels": _panels(columns, run.units, live is not None),
        "drawing": _drawing(model, columns),
        **({"live": live} if live else {}),
    }
    # names must not end the script element
    text = json.dumps(data, separators=(",", ":")).replace("<", "\\u003c")
    fields = {
        "TITLE": escape(title),
        "ABOUT": escape(about),
        "FAILURE": f'<p id="failure">{escape(str(run.failure))}</p>' if run.failure else "",
        "STYLE": _file("style.css"),
        "COMPUTES": " 'wasm-unsafe-eval'" if live else "",
        "SCRIPT": "\n".join(map(_file, [*SCRIPTS[:-1], *(LIVE_SCRIPTS if live else []), SCRIPTS[-1]])),
        "DATA": text,
    }
    filled = _file("page.html")
    for key, value in fields.items():
        filled = filled.replace(f"@{key}@", value)
    return filled, stride


def _file(name: str) -> str:
    return (resources.files("build_fmu.show") / name).read_text(encoding="utf-8").strip()


def _base64(array: np.ndarray) -> str:
    return base64.b64encode(array.astype(array.dtype.newbyteorder("<")).tobytes()).decode()


def _drawing(model: Description | None, columns: dict[str, np.ndarray]) -> dict[str, Any]:
    """Returns the mechanism in its initial configuration, with the columns of its joints and quaternions."""
    if model is None:
        return {"links": []}
    links, starts, parts = [], {variable.name for variable in model.variables}, joint_parts(columns)
    for link in model.drawing["links"]:
        name = f"{link['joint']}.q" if link.get("joint") and link["type"] != "fixed" else None
        extra = {"label": parts.get(link["joint"], link["joint"])} if link.get("joint") else {}
        if f"{link.get('joint')}.q0" in starts:
            extra["start_name"] = f"{link['joint']}.q0"
        links.append({**link, **extra, "q": name if name in columns else None, "q0": link.get("q", 0.0)})
    balls = []
    for ball in model.drawing.get("balls", []):
        names = [f"{ball['name']}.quaternion[{i}]" for i in range(1, 5)]
        if all(name in columns for name in names):
            balls.append({**ball, "columns": names})
    solids = [
        {
            "link": solid.link,
            "colour": solid.colour,
            "points": _base64(solid.points.astype(np.float32)),
            "triangles": _base64(solid.triangles.astype(np.uint16)),
        }
        for solid in model.drawing.get("solids", [])
    ]
    table = {key: value for key, value in model.drawing.items() if key != "shapes"}
    return {**table, "links": links, "balls": balls, **({"solids": solids} if solids else {})}


def _panels(columns: dict[str, np.ndarray], units: dict[str, tuple[str, float]], with_zeros: bool) -> list[dict[str, Any]]:
    joints = [name.removesuffix(".q") for name in columns if name.endswith(".q")]
    parts, energy = joint_parts(columns), largest_energy(columns)
    found: dict[tuple[str, str], dict[str, Any]] = {}
    for name, values in columns.items():
        kind = group_of(name)
        if kind == "tau" and not with_zeros and not np.any(values != 0):
            continue
        unit, factor = units.get(name, ("", 1.0))
        title, noise = title_of(kind), noise_of(kind, 0.0, energy * factor)
        panel = found.setdefault(
            (kind, unit),
            {
                "title": title[:1].upper() + title[1:] if kind in GROUPS else title,
                "unit": unit,
                "factor": factor,
                "noise": noise,
                "still": noise_range(kind, noise),
                "joints": len(joints),
                "curves": [],
            },
        )
        head = name.rpartition(".")[0]
        panel["curves"].append(
            {
                "name": name,
                "label": label_of(name, kind, parts) or name,
                "joint": joints.index(head) if head in joints else -1,
                "dash": kind == "energy",
            }
        )
    return [panel for (kind, _), panel in sorted(found.items(), key=lambda item: rank_of(item[0][0]))]
