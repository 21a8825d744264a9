"""Writes documentation/index.html of an FMU: what the model is, its variables with units, how to run it, its licence."""

from __future__ import annotations

from html import escape

from build_fmu.model.describe import Description, Variable

STYLE = """
:root { color-scheme: light dark }
body { font: 16px/1.5 system-ui, sans-serif; max-width: 62rem; margin: 2rem auto; padding: 0 1rem }
table { border-collapse: collapse; width: 100%; margin: .5rem 0 1.5rem }
th, td { text-align: left; padding: .25rem .8rem .25rem 0; border-bottom: 1px solid #8884; vertical-align: top }
td.n { font-variant-numeric: tabular-nums; white-space: nowrap }
code, pre { font-family: ui-monospace, monospace; font-size: .92em }
pre { background: #8881; padding: .8rem 1rem; overflow-x: auto }
img { max-width: 100%; background: white; border-radius: 6px }
""".strip()

REPORT = ('<h2>What accuracy costs</h2>\n<p><img src="report.svg" alt="error against run time"></p>\n'
          '<p>Advice and tables: <a href="report.html">report.html</a>, <a href="report.md">report.md</a>, <a href="report.csv">report.csv</a>.</p>')

GROUPS = (
    ("input", "Inputs", "Held during a communication step, unless the master gives their derivatives."),
    ("output", "Outputs", ""),
    ("parameter", "Parameters", "Set them before initialisation; <em>tunable</em> ones also between steps."),
    ("calculatedParameter", "Calculated parameters", ""),
    ("local", "Local variables", ""),
)


def documentation(model: Description, played: bool = False, has_report: bool = False) -> bytes:
    """Returns the page, UTF-8; it needs no file but ../model.png, run.html if there is a run to play, and the report if there is one."""
    name = escape(model.model_name)
    parts = [
        f'<!DOCTYPE html>\n<html lang="en">\n<head>\n<meta charset="utf-8">\n<title>{name}</title>',
        f"<style>\n{STYLE}\n</style>\n</head>\n<body>\n<h1>{name}</h1>",
    ]
    if model.description:
        parts.append(f"<p>{escape(model.description)}</p>")
    parts.append(f"<p>A multibody system of {len(model.drawing['links'])} links as an FMI 2.0 co-simulation FMU, made by "
                 f"{escape(model.generation_tool)}. All values are in SI units and radians.</p>")
    parts.append(f'<p><img src="../model.png" alt="{name} at its start pose"></p>')
    if played:
        parts.append('<p><a href="run.html">Play its default experiment</a>: the motion without inputs, in three dimensions beside its plots.</p>')
    parts += [_links(model), _run(model)]
    if has_report:
        parts.append(REPORT)
    for causality, title, note in GROUPS:
        rows = model.select(causality)
        if rows:
            parts.append(f"<h2>{title}</h2>" + (f"\n<p>{note}</p>" if note else "") + "\n" + _table(rows))
    parts.append('<h2>Licence</h2>\n<p>The simulation library is under the BSD 3-clause licence; it contains parts of other '
                 'free works. See <a href="licenses/license.txt">licenses/license.txt</a>. The model file is in '
                 "<code>resources/model.toml</code>.</p>\n</body>\n</html>\n")
    return "\n".join(parts).encode()


def _links(model: Description) -> str:
    links = model.drawing["links"]
    rows = []
    for link in links:
        parent = "ground" if link["parent"] < 0 else links[link["parent"]]["name"]
        rows.append(f'<tr><td>{escape(link["name"])}</td><td>{escape(parent)}</td><td>{escape(link["type"])}</td>'
                    f'<td class="n">{link["mass"]:.6g}</td></tr>')
    head = "<tr><th>link</th><th>on</th><th>joint</th><th>mass [kg]</th></tr>"
    return f"<h2>Mechanism</h2>\n<table>\n{head}\n" + "\n".join(rows) + "\n</table>"


def _run(model: Description) -> str:
    stop = model.default_experiment.get("stop_time", 1)
    file = escape(model.model_identifier)
    inputs = model.select("input")
    example = f" --input &quot;{escape(inputs[0].name)}=sin(2*pi*t)&quot;" if inputs else ""
    return (f"<h2>Run it</h2>\n<pre>from fmpy import simulate_fmu\nresult = simulate_fmu('{file}.fmu', stop_time={stop:g})</pre>\n"
            f"<pre>build-fmu simulate {file}.fmu{example} --plot {file}.png</pre>")


def _table(variables: list[Variable]) -> str:
    rows = []
    for v in variables:
        start = "" if v.start is None else _value(v.start)
        note = " (tunable)" if v.variability == "tunable" else ""
        rows.append(f'<tr><td><code>{escape(v.name)}</code></td><td class="n">{escape(v.unit or "")}</td>'
                    f'<td class="n">{escape(start)}</td><td>{escape(v.description)}{note}</td></tr>')
    head = "<tr><th>name</th><th>unit</th><th>start</th><th>meaning</th></tr>"
    return f"<table>\n{head}\n" + "\n".join(rows) + "\n</table>"


def _value(value: object) -> str:
    return f"{value:.12g}" if isinstance(value, float) else str(value).lower() if isinstance(value, bool) else str(value)
