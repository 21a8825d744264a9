"""The report as one self-contained HTML page: recommendations, work–precision diagram, and the figures of all runs."""

from __future__ import annotations

from html import escape
from pathlib import Path

from build_fmu.draw.html_page import figures, from_markdown, write_html_page
from build_fmu.report.machine import TIME, machine_lines
from build_fmu.report.pages import Report, advice, cost, duration, method
from build_fmu.report.sweep import Point

STYLE = """
.advice li { margin: .2rem 0; } .picture { overflow-x: auto; } .picture svg { max-width: 100%; height: auto; }
"""


def write_html(path: Path, report: Report, picture: Path) -> None:
    """Writes the page; `picture` is the diagram (.svg)."""
    title = f"{report.name}: accuracy and {TIME}"
    drawn = picture.read_text(encoding="utf-8")
    lines = [*([report.note] if report.note else []), *machine_lines(), f"{len(report.points)} runs in {report.seconds:.0f} s"]
    parts = [
        f"<h1>{escape(title)}</h1><p class=small>{escape('; '.join(lines))}</p>",
        f"<ul class=advice>{''.join(f'<li>{escape(line)}</li>' for line in advice(report))}</ul>",
        f"<div class=picture>{drawn[drawn.index('<svg') :]}</div>",
        f"<p class=small>{from_markdown(method(report))}</p><h2>All runs</h2>",
    ]
    for step, inputs, points in report.sections:
        head = f"Communication step size {duration(step)}, {inputs}: {sum(p.good for p in points)} runs"
        parts.append(f"<details{' open' if step == report.step else ''}><summary>{head}</summary>{_table(points, report.unit)}</details>")
    write_html_page(path, title, "".join(parts), STYLE)


def _table(points: list[Point], unit: str) -> str:
    rows = []
    for p in points:
        numbers = [f"{p.error:.1e}", cost(p.us_per_ms), f"{p.rhs_per_ms:.3g}"] if p.good else ["", "", ""]
        note = "" if p.outcome.status == "ok" else f"{p.outcome.status}: {p.outcome.message}"
        rows.append([escape(p.method), f"{p.rtol:.0e}", *numbers, escape(note)])
    return figures(["method", "rtol", f"error [{escape(unit)}]", "µs per ms", "right-hand sides per ms", ""], rows, range(2, 5))
