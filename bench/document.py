#!/usr/bin/env python3
"""Puts the figures of out/bench into the pages that show them.

    python bench/document.py            pages with new figures into out/bench
    python bench/document.py --docs     and into docs/, with the plots

A page marks what is measured by `<!-- measured NAME -->` and `<!-- end -->`; what stands between is replaced.
"""

from __future__ import annotations

import argparse
import re
import shutil
from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent
PAGES = ("performance.md", "stability_peers.md")
SIZES = (1, 2, 6, 7, 30, 100, 1000)


def header(core: str) -> str:
    lines = [line[2:] for line in core.splitlines() if line.startswith("# ")]
    return "\n".join(f"* {line}" for line in lines) + "\n"


def recursions(core: str) -> str:
    """The table of forward and inverse dynamics in ns, with Pinocchio's where it was there."""
    figures = dict(line.split() for line in core.splitlines() if line and not line.startswith("#"))

    def cell(name: str) -> str:
        return f"{float(figures[name]):,.0f}" if name in figures else "–"

    def ratio(name: str) -> str:
        return f"{float(figures[name]):.1f}×" if name in figures else "–"

    lines = ["| joints | angles | forward dynamics, ns | Pinocchio `aba` slower by | inverse dynamics, ns | Pinocchio `rnea` slower by |", "| --- " * 6 + "|"]
    for kind, words in (("right_angle", "right"), ("any_angle", "any")):
        for n in SIZES:
            scene = f"{kind}_chain_{n}"
            lines.append(
                f"| {n} | {words} | {cell(f'{scene}.forward_dynamics_ns')} | {ratio(f'{scene}.forward_dynamics_times_faster_than_pinocchio')} "
                f"| {cell(f'{scene}.inverse_dynamics_ns')} | {ratio(f'{scene}.inverse_dynamics_times_faster_than_pinocchio')} |"
            )
    return "\n".join(lines) + "\n"


def steps(text: str) -> str:
    lines = ["| metric | value |", "| --- | --- |"]
    return "\n".join(lines + [f"| `{name}` | {value} |" for name, value in (line.split() for line in text.splitlines())]) + "\n"


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--docs", action="store_true", help="write into docs/ too")
    parser.add_argument("--figures", type=Path, default=ROOT / "out" / "bench")
    options = parser.parse_args()
    makers = {"core.txt": {"machine": header, "recursions": recursions}, "do_step.txt": {"do_step": steps},
              "peers.md": {"peers": str}, "extreme.md": {"extreme": str}}
    blocks = {}
    for file, made in makers.items():
        if (options.figures / file).exists():
            text = (options.figures / file).read_text()
            blocks.update((name, maker(text)) for name, maker in made.items())
        else:
            print(f"{file} is not there: its figures stay as they are")
    for name in PAGES:
        page = (ROOT / "docs" / name).read_text(encoding="utf-8")
        for mark in re.findall(r"<!-- measured (\w+) -->", page):
            if mark in blocks:
                page = re.sub(rf"(<!-- measured {mark} -->\n).*?(<!-- end -->)", lambda found: f"{found[1]}\n{blocks[found[0].split()[2]]}\n{found[2]}", page, flags=re.S)
        (options.figures / name).write_text(page, encoding="utf-8")
        if options.docs:
            (ROOT / "docs" / name).write_text(page, encoding="utf-8")
    if options.docs:
        for picture in sorted(options.figures.glob("peers_*.*g")):
            shutil.copy(picture, ROOT / "docs" / "pictures" / picture.name)
    print(f"pages with these figures: {options.figures}" + (", docs" if options.docs else ""))


if __name__ == "__main__":
    main()
