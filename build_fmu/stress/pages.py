"""The results as a CSV, as Markdown with a summary for the docs, and as a picture of all cases."""

from __future__ import annotations

import csv
import io
import math
from collections.abc import Iterable, Sequence
from pathlib import Path

from build_fmu.draw.figure import save, titled_figure
from build_fmu.files import whole_file
from build_fmu.report.machine import machine_lines
from build_fmu.stress.cases import GROUPS
from build_fmu.stress.run import LARGEST_GAP, LONG_SHARE, REST, Verdict

KINDS = {"finished": "#2a9d57", "doubtful": "#e9a23b", "slow": "#8fa3b0", "refused": "#7a5fb5", "failed": "#d1342f"}
MEANING = {
    "finished": "all steps returned fmi2OK, all values were finite, the constraint violation of loops was at most "
    f"{LARGEST_GAP:g} m, and the energy balance error at most 1000 times the relative tolerance (at least 1e-8) per second of motion. "
    "If only the energy misses its bound, the case is repeated with 0.1 to 1e-4 of the absolute tolerance and an error of rtol per step. "
    "If it then meets the bound, the motion is small compared with the tolerance, or fast; the note gives the figures. "
    f"With displacements of at most {REST:g} m or rad the energy is not judged",
    "doubtful": "constraint violation or energy balance error above these bounds",
    "slow": "CPU time limit reached; the note gives the time reached",
    "refused": "the modified model file or its initial configuration is not accepted",
    "failed": "a step failed, a value was not finite, or the process hung or crashed",
}
LEGEND = (
    "*Energy balance*: error over the exchanged energy, the maximum of kinetic energy, change of potential energy and work.",
    "*Gap*: maximum constraint violation of loops (m, rad). *Error*: maximum distance of a joint from a run of another method at a",
    "tolerance 1000 times tighter; in chaotic motions it includes the growth of small differences. *Steps*, *right-hand sides*: of the",
    "solver. *s*: CPU time. The *note* ends with another method that finishes the case, if any.",
)
SUMMARY_BEGIN, SUMMARY_END = "<!-- summary -->", "<!-- end of summary -->"
COLUMNS = (
    "model",
    "group",
    "case",
    "verdict",
    "message",
    "remedy",
    "method",
    "reached_s",
    "energy_balance",
    "gap",
    "error",
    "unit",
    "steps",
    "rhs",
    "seconds",
    "after_failure",
)


def write_csv(path: Path, verdicts: Sequence[Verdict]) -> None:
    """Writes one row per case."""
    text = io.StringIO()
    writer = csv.writer(text, lineterminator="\n")
    writer.writerow(COLUMNS)
    for v in verdicts:
        numbers = ["" if math.isnan(x) else f"{x:.4g}" for x in (v.balance, v.gap, v.error)]
        writer.writerow(
            [
                v.model,
                v.case.group,
                v.case.label,
                v.kind,
                v.message,
                v.remedy,
                v.method,
                f"{v.reached:.6g}",
                *numbers,
                v.unit,
                v.steps,
                v.rhs,
                "" if math.isnan(v.seconds) else f"{v.seconds:.4g}",
                v.after,
            ]
        )
    whole_file(path, lambda temporary: temporary.write_text(text.getvalue(), encoding="utf-8"))


def write_page(path: Path, verdicts: Sequence[Verdict], picture: str, seconds: float, taken: float) -> None:
    """Writes the Markdown page. `docs/pictures/make_stability.py` copies the summary between the two comments into the docs."""
    lines = [
        "# Extreme cases",
        "",
        *introduction(seconds),
        "",
        SUMMARY_BEGIN,
        *measured(verdicts, seconds, taken),
        "",
        *summary(verdicts),
        "",
        *not_finished(verdicts),
        SUMMARY_END,
        "",
        f"![all cases]({picture})",
        "",
    ]
    for model in dict.fromkeys(v.model for v in verdicts):
        lines += [f"## {model}", "", *table([v for v in verdicts if v.model == model]), ""]
    whole_file(path, lambda temporary: temporary.write_text("\n".join(lines).rstrip() + "\n", encoding="utf-8"))


def measured(verdicts: Sequence[Verdict], seconds: float, taken: float) -> list[str]:
    """Returns number of cases, CPU time, machine and date."""
    models = len({v.model for v in verdicts})
    lines = [
        f"{len(verdicts)} cases of {models} model{'s' * (models != 1)}, {seconds:g} s of CPU time per case, "
        f"{taken:.0f} s wall-clock time in total.",
        "",
    ]
    return [*lines, *(f"* {line}" for line in machine_lines())]


def introduction(seconds: float) -> list[str]:
    """Returns the introduction of the page."""
    lines = [
        "Each model is changed as listed below and simulated through its FMU. Each case runs in a separate process with a limit of "
        f"{seconds:g} s of CPU time ({LONG_SHARE * seconds:g} s for the long run). Motions last up to 2 s.",
        "",
    ]
    lines += [f"* **{group}**: {words}" for group, words in GROUPS.items()]
    return [*lines, "", "Criteria:", "", *(f"* *{kind}*: {words}" for kind, words in MEANING.items()), "", *LEGEND]


def summary(verdicts: Sequence[Verdict]) -> list[str]:
    """Returns a table of the groups: cases by result, and maximum energy balance error and gap of the finished cases."""
    lines = ["| cases | " + " | ".join(KINDS) + " | max. energy balance | max. gap |", "| --- |" + " ---: |" * (len(KINDS) + 2)]
    for group in GROUPS:
        rows = [v for v in verdicts if v.case.group == group]
        if not rows:
            continue
        counts = [str(sum(v.kind == kind for v in rows) or "") for kind in KINDS]
        good = [v for v in rows if v.kind == "finished"]
        balance, gap = _maximum(v.balance for v in good if not v.small), _maximum(v.gap for v in good)
        lines.append(f"| {group} | {' | '.join(counts)} | {number(balance)} | {number(gap)} |")
    total = [str(sum(v.kind == kind for v in verdicts) or "") for kind in KINDS]
    return [*lines, f"| **all {len(verdicts)}** | {' | '.join(total)} | | |"]


def not_finished(verdicts: Sequence[Verdict]) -> list[str]:
    """Returns a table of the unfinished cases, with equal ones in one row."""
    rest: dict[tuple[str, str, str, str, str], list[str]] = {}
    for v in verdicts:
        if v.kind != "finished":
            message = "" if v.kind == "slow" else v.message
            rest.setdefault((v.kind, v.case.group, v.case.label, message, v.remedy), []).append(v.model)
    if not rest:
        return ["All cases finished."]
    lines = ["| result | case | models | message | remedy |", "| --- | --- | --- | --- | --- |"]
    order = list(KINDS)
    for (kind, group, label, message, remedy), models in sorted(rest.items(), key=lambda item: (-order.index(item[0][0]), *item[0][1:])):
        lines.append(f"| {kind} | {group}, {label} | {', '.join(models)} | {_cell(message)} | {remedy} |")
    return lines


def table(verdicts: Sequence[Verdict]) -> list[str]:
    """Returns the table of one model's cases."""
    lines = [
        "| case | result | energy balance | gap | error | steps | right-hand sides | s | |",
        "| --- | --- |" + " ---: |" * 6 + " --- |",
    ]
    for v in verdicts:
        counts = ["" if n is None else str(n) for n in (v.steps, v.rhs)]
        note = "; ".join(part for part in (_cell(v.message), v.remedy) if part)
        lines.append(
            f"| {v.case.group}, {v.case.label} | {v.kind} | {number(v.balance)} | {number(v.gap)} | {number(v.error)} | "
            f"{' | '.join(counts)} | {'' if math.isnan(v.seconds) else f'{v.seconds:.2g}'} | {note} |"
        )
    return lines


def _maximum(values: Iterable[float]) -> float:
    return max((x for x in values if not math.isnan(x)), default=math.nan)


def number(x: float) -> str:
    """Returns a number with one digit; an empty text for nan."""
    return "" if math.isnan(x) else f"{x:.0e}"


def _cell(text: str) -> str:
    return text.replace("|", "\\|")


def write_pictures(paths: Sequence[Path], verdicts: Sequence[Verdict]) -> None:
    """Draws one square per case, models in rows and cases in columns; the darker the green, the smaller the energy balance error."""
    from matplotlib.patches import Patch, Rectangle

    models = list(dict.fromkeys(v.model for v in verdicts))
    labels = list(dict.fromkeys((v.case.group, v.case.label) for v in sorted(verdicts, key=lambda v: list(GROUPS).index(v.case.group))))
    with titled_figure("Extreme cases", max(8, 3 + 0.24 * len(labels)), 4 + 0.22 * len(models), font_size=8) as figure:
        axes = figure.subplots()
        for v in verdicts:
            x, y = labels.index((v.case.group, v.case.label)), models.index(v.model)
            axes.add_patch(Rectangle((x, y), 0.92, 0.92, color=KINDS[v.kind], alpha=depth(v)))
            if v.kind != "finished":
                axes.text(x + 0.46, y + 0.48, v.kind[0].upper(), ha="center", va="center", color="white", weight="bold")
        axes.set_xlim(0, len(labels))
        axes.set_ylim(len(models), 0)
        axes.set_yticks([y + 0.46 for y in range(len(models))], [m.replace("$", r"\$") for m in models])
        axes.set_xticks([x + 0.46 for x in range(len(labels))], [f"{group}, {label}" for group, label in labels], rotation=90)
        axes.tick_params(length=0)
        axes.spines[:].set_visible(False)
        named = {k: f"{k[0].upper()}: {k}" for k in KINDS} | {"finished": "finished (pale: larger energy balance error)"}
        axes.legend(
            handles=[Patch(color=c, label=named[k]) for k, c in KINDS.items()],
            loc="lower center",
            bbox_to_anchor=(0.5, 1.0),
            ncol=5,
            frameon=False,
        )
        save(figure, paths)


def depth(v: Verdict) -> float:
    """Returns the opacity of a case: 1 for an energy balance error of at most 1e-12, a quarter from 1e-3 on."""
    if v.kind != "finished":
        return 1.0
    return 0.8 if math.isnan(v.balance) else min(1.0, max(0.25, -math.log10(max(v.balance, 1e-16)) / 12))
