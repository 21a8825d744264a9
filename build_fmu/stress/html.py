"""The results as one self-contained HTML page: a map of all cases, the unfinished ones, and the figures of each case."""

from __future__ import annotations

import math
import re
from collections.abc import Sequence
from html import escape
from pathlib import Path

from build_fmu.draw.html_page import figures, from_markdown, write_html_page
from build_fmu.report.machine import machine_lines
from build_fmu.stress.cases import GROUPS
from build_fmu.stress.pages import KINDS, LEGEND, MEANING, depth, number
from build_fmu.stress.run import LONG_SHARE, Verdict

STYLE = """
.map { font-size: 11px; } .map th { font-weight: 400; padding: 0 6px 0 0; white-space: nowrap; }
.map thead th { writing-mode: vertical-rl; transform: rotate(180deg); padding: 4px 0; }
.map td { padding: 0 1px 1px 0; } .map .first { padding-left: 6px; }
.map a { display: block; width: 14px; height: 14px; border-radius: 2px; }
.tag { display: inline-block; border-radius: 3px; padding: 0 6px; color: #fff; font-size: 12px; }
.counts span { margin-right: 1.2rem; } tr:target { background: #fff6d6; } dt { font-weight: 600; } dd { margin: 0 0 .3rem 1.5rem; }
"""
# a link to a row in a collapsed table opens the table
SCRIPT = """
function show() { const row = document.getElementById(location.hash.slice(1)); if (!row) return;
  const fold = row.closest("details"); if (fold) fold.open = true; row.scrollIntoView({ block: "center" }); }
addEventListener("hashchange", show); addEventListener("load", show);
"""


def write_html(path: Path, verdicts: Sequence[Verdict], seconds: float, taken: float) -> None:
    """Writes the page."""
    models = list(dict.fromkeys(v.model for v in verdicts))
    parts = [
        f"<h1>Extreme cases</h1><p class=small>{len(verdicts)} case{'s' * (len(verdicts) != 1)} of "
        f"{len(models)} model{'s' * (len(models) != 1)} in {taken:.0f} s. "
        f"{escape('; '.join(machine_lines()))}</p>",
        _counts(verdicts),
        _words(seconds),
        "<h2>All cases</h2><p>One square per case; pale green: larger energy balance error. "
        "Hover over a square for details, click it for its row.</p>",
        _map(verdicts, models),
        "<h2>Unfinished cases</h2>",
        _not_finished(verdicts),
        "<h2>Results by model</h2>",
        _legend(),
    ]
    for model in models:
        rows = [v for v in verdicts if v.model == model]
        good = sum(v.kind == "finished" for v in rows)
        summary = f"<summary>{escape(model)}: {good} of {len(rows)} finished</summary>"
        parts.append(f"<details{' open' if len(models) == 1 else ''}>{summary}{_table(rows)}</details>")
    write_html_page(path, "Extreme cases", "".join(parts), STYLE, SCRIPT)


def _counts(verdicts: Sequence[Verdict]) -> str:
    found = ((kind, sum(v.kind == kind for v in verdicts)) for kind in KINDS)
    return "<p class=counts>" + "".join(f"<span>{_tag(kind)} {count}</span>" for kind, count in found if count) + "</p>"


def _words(seconds: float) -> str:
    groups = "".join(f"<dt>{escape(group)}</dt><dd>{escape(words)}</dd>" for group, words in GROUPS.items())
    kinds = "".join(f"<dt>{_tag(kind)}</dt><dd>{escape(words)}</dd>" for kind, words in MEANING.items())
    return (
        f"<p>Each model is changed as listed below and simulated through its FMU. Each case runs in a separate process with a limit of "
        f"{seconds:g} s of CPU time ({LONG_SHARE * seconds:g} s for the long run). Motions last up to 2 s.</p>"
        f"<details><summary>Cases</summary><dl>{groups}</dl></details><details open><summary>Criteria</summary><dl>{kinds}</dl></details>"
    )


def _legend() -> str:
    return f"<p class=small>{from_markdown(' '.join(LEGEND))}</p>"


def _map(verdicts: Sequence[Verdict], models: Sequence[str]) -> str:
    cases = list(dict.fromkeys((v.case.group, v.case.label) for v in verdicts))
    found = {(v.model, v.case.group, v.case.label): v for v in verdicts}
    starts = {case for before, case in zip([("", ""), *cases], cases, strict=False) if before[0] != case[0]}
    side = {case: " class=first" if case in starts else "" for case in cases}
    head = "".join(f"<th{side[c]}>{escape(c[0])}, {escape(c[1])}</th>" for c in cases)
    body = ""
    for model in models:
        squares = ""
        for case in cases:
            v = found.get((model, *case))
            square = ""
            if v:
                style = f"background:{KINDS[v.kind]};opacity:{depth(v):.2f}"
                square = f"<a href='#{_id(v)}' title='{escape(_words_of(v), quote=True)}' style='{style}'></a>"
            squares += f"<td{side[case]}>{square}</td>"
        body += f"<tr><th>{escape(model)}</th>{squares}</tr>"
    return f"<div class=wide><table class=map><thead><tr><th></th>{head}</tr></thead><tbody>{body}</tbody></table></div>"


def _words_of(v: Verdict) -> str:
    words = f"{v.model}: {v.case.group}, {v.case.label}: {v.kind}"
    if v.message:
        words += f", {v.message}"
    return words + ("" if math.isnan(v.balance) else f"; energy balance {v.balance:.0e}")


def _not_finished(verdicts: Sequence[Verdict]) -> str:
    rest = sorted((v for v in verdicts if v.kind != "finished"), key=lambda v: -list(KINDS).index(v.kind))
    if not rest:
        return "<p>All cases finished.</p>"
    rows = [(_tag(v.kind), f"<a href='#{_id(v)}'>{escape(v.model)}</a>", _case(v), escape(v.message), escape(v.remedy)) for v in rest]
    return figures(("", "model", "case", "message", "remedy"), rows)


def _table(verdicts: Sequence[Verdict]) -> str:
    heads = ("case", "", "method", "energy balance", "gap", "error", "steps", "right-hand sides", "s", "note")
    rows = []
    for v in verdicts:
        counts = ["" if n is None else f"{n:,}".replace(",", "\u2009") for n in (v.steps, v.rhs)]
        error = "" if math.isnan(v.error) else f"{number(v.error)} {escape(v.unit)}"
        seconds = "" if math.isnan(v.seconds) else f"{v.seconds:.2g}"
        note = escape("; ".join(part for part in (v.message, v.remedy) if part))
        rows.append((_case(v), _tag(v.kind), escape(v.method), number(v.balance), number(v.gap), error, *counts, seconds, note))
    return figures(heads, rows, range(3, 9), [_id(v) for v in verdicts])


def _case(v: Verdict) -> str:
    return f"{escape(v.case.group)}, {escape(v.case.label)}"


def _tag(kind: str) -> str:
    return f"<span class=tag style='background:{KINDS[kind]}'>{kind}</span>"


def _id(v: Verdict) -> str:
    return re.sub(r"[^A-Za-z0-9]+", "-", f"{v.model}-{v.case.group}-{v.case.label}")
