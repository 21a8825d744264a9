"""The frame and the style of self-contained HTML pages."""

from __future__ import annotations

import re
from collections.abc import Sequence
from html import escape
from pathlib import Path

from build_fmu.files import whole_file

STYLE = """
body { font: 15px/1.5 system-ui, sans-serif; color: #22303c; margin: 2rem auto; max-width: 76rem; padding: 0 1rem; }
h1 { margin-bottom: 0; } h2 { margin-top: 2.5rem; } .small { color: #5b6b78; font-size: 13px; }
table { border-collapse: collapse; } th { text-align: left; font-weight: 600; }
.figures td, .figures th { padding: 2px 10px 2px 0; border-bottom: 1px solid #e4e9ed; vertical-align: top; font-size: 13px; }
.figures td.n { text-align: right; font-variant-numeric: tabular-nums; white-space: nowrap; } .figures th.n { text-align: right; }
.wide { overflow-x: auto; } summary { cursor: pointer; font-weight: 600; padding: .3rem 0; }
"""


def write_html_page(path: Path, title: str, body: str, style: str = "", script: str = "") -> None:
    """Writes a page of this title and HTML body, with optional style and script."""
    text = (
        f"<!DOCTYPE html><html lang=en><meta charset=utf-8><meta name=viewport content='width=device-width'><title>{escape(title)}</title>"
        f"<style>{STYLE}{style}</style>{f'<script>{script}</script>' if script else ''}<body>{body}</body></html>\n"
    )
    whole_file(path, lambda temporary: temporary.write_text(text, encoding="utf-8"))


def figures(heads: Sequence[str], rows: Sequence[Sequence[str]], numbers: range = range(0), anchors: Sequence[str] = ()) -> str:
    """Returns a table of HTML cells; the columns in `numbers` are aligned right, `anchors` are the ids of the rows."""
    side = [" class=n" if i in numbers else "" for i in range(len(heads))]
    head = "".join(f"<th{c}>{h}</th>" for c, h in zip(side, heads, strict=True))
    marks = [f" id='{anchor}'" for anchor in anchors] or [""] * len(rows)
    lines = ["".join(f"<td{c}>{cell}</td>" for c, cell in zip(side, row, strict=True)) for row in rows]
    body = "".join(f"<tr{mark}>{line}</tr>" for mark, line in zip(marks, lines, strict=True))
    return f"<div class=wide><table class=figures><tr>{head}</tr>{body}</table></div>"


def from_markdown(text: str) -> str:
    """Returns the HTML of a Markdown text with `code` and *emphasis*."""
    return re.sub(r"`(.+?)`", r"<code>\1</code>", re.sub(r"\*(.+?)\*", r"<em>\1</em>", escape(text)))
