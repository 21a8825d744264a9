#!/usr/bin/env python3
"""Writes the figures of out/bench into the documentation pages.

    python bench/document.py            updated pages in out/bench
    python bench/document.py --docs     the same in docs/, with the plots

The text between `<!-- measured NAME -->` and `<!-- end -->` is replaced. All lines `scene.metric value` of a run are also written to
figures.txt. A run adds a line to the history of figures (history.py).
"""

from __future__ import annotations

import argparse
import re
import shutil
from collections.abc import Callable
from pathlib import Path

import history
import tables

ROOT = Path(__file__).resolve().parent.parent
PAGES = ("performance.md", "stability_peers.md", "specialise.md", "contact.md", "benchmarks.md")
LINES = ("core.txt", "do_step.txt", "latency.txt", "accuracy.txt", "parts.txt", "straight_line.txt", "peers.txt", "benchmarks.txt")
PICTURES = ("peers_*.svg", "contact_scenes.svg", "benchmarks.svg", "accuracy.png", history.PICTURE)


def machine(folder: Path) -> str:
    """Machine, flags, versions and commit, as recorded by the stages."""
    lines = [line[2:] for line in read(folder / "core.txt").splitlines() if line.startswith("# ")]
    lines = [line for line in lines if not line.startswith("Pinocchio")]  # listed below with the others
    versions = read(folder / "peers.md").split(";")[0].strip()
    if versions:
        lines.append(versions)
    load = read(folder / "load.txt").split()
    if load:
        lines.append(f"load average during the run: {load[0]} to {load[1]}; the run took {load[2]} minutes")
    if load[3:]:
        lines.append("quick run: few repetitions, runs above 0.05 s of CPU time omitted from the comparison; approximate figures")
    commits = {found[1] for name in LINES for found in re.finditer(r"commit ([0-9a-f]+(?: with changes)?)", read(folder / name))}
    if len(commits) > 1:
        lines.append(f"from different commits: {', '.join(sorted(commits))}")
    return "\n".join(f"* {line}" for line in lines) + "\n"


def read(file: Path) -> str:
    return file.read_text(encoding="utf-8") if file.exists() else ""


def every_line(folder: Path) -> str:
    found: dict[str, float] = {}
    for name in LINES:
        found.update(tables.figures(read(folder / name)))
    found.update(tables.derived(found))
    return "".join(f"{name} {value:.6g}\n" for name, value in found.items())


def blocks(folder: Path) -> dict[str, str]:
    """Returns the new text of each mark; a mark whose file is missing is omitted."""
    makers: dict[str, tuple[str, Callable[[str], str]]] = {
        "recursions": ("core.txt", tables.recursions),
        "right_hand_sides": ("core.txt", tables.right_hand_sides),
        "do_step": ("do_step.txt", tables.steps),
        "latency": ("latency.txt", tables.latencies),
        "parts": ("parts.txt", tables.parts),
        "peers": ("peers.md", str),
        "losses": ("losses.md", str),
        "straight_line": ("straight_line.txt", tables.straight_lines),
        "extreme": ("extreme.md", str),
        "contact": ("contact_figures.md", str),
        "benchmarks": ("benchmarks_table.md", str),
        "targets": ("figures.txt", tables.targets),
    }
    found = {}
    for mark, (file, maker) in makers.items():
        text = read(folder / file)
        if text:
            found[mark] = maker(text)
        else:
            print(f"{file} not found: `{mark}` is unchanged")
    if (folder / "core.txt").exists():
        found["machine"] = machine(folder)
    return found


def with_old_rows(new: str, old: str) -> str:
    """Returns the new table with the old rows of the targets that this run did not measure."""

    def target(row: str) -> str:
        return row.rsplit("|", 3)[0]

    rows = {target(line): line for line in old.splitlines() if line.startswith("|")}
    return "\n".join(rows.get(target(line), line) if "| not measured |" in line else line for line in new.splitlines()) + "\n"


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--docs", action="store_true", help="also write to docs/")
    parser.add_argument("--figures", type=Path, default=ROOT / "out" / "bench")
    options = parser.parse_args()
    (options.figures / "figures.txt").write_text(every_line(options.figures), encoding="utf-8")
    found = blocks(options.figures)

    def fresh(match: re.Match[str]) -> str:
        return f"{match[1]}\n{with_old_rows(found[match[2]], match[0])}\n{match[3]}" if match[2] in found else match[0]

    past, new = read(ROOT / "docs" / history.FILE), history.entry(read(options.figures / "figures.txt"), read(options.figures / "core.txt"))
    if new:
        (options.figures / history.FILE).write_text(history.with_entry(past, new), encoding="utf-8")
        history.draw(history.with_entry(past, new), options.figures / history.PICTURE)
    for name in PAGES:
        page = re.sub(r"(<!-- measured (\w+) -->\n).*?(<!-- end -->)", fresh, read(ROOT / "docs" / name), flags=re.S)
        (options.figures / name).write_text(page, encoding="utf-8")
        if options.docs:
            (ROOT / "docs" / name).write_text(page, encoding="utf-8")
    if options.docs:
        if new:
            shutil.copy(options.figures / history.FILE, ROOT / "docs" / history.FILE)
        for pattern in PICTURES:
            for picture in sorted(options.figures.glob(pattern)):
                shutil.copy(picture, ROOT / "docs" / "pictures" / picture.name)
    print(f"pages with these figures: {options.figures}" + (", docs" if options.docs else ""))


if __name__ == "__main__":
    main()
