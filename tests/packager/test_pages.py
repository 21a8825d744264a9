"""Links, anchors and paths in README and docs/ lead to files and headings of the tree; tables are complete."""

from __future__ import annotations

import re
import statistics
import unicodedata
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[2]
PAGES = [*sorted(ROOT.glob("*.md")), *sorted((ROOT / "docs").rglob("*.md")), ROOT / "models" / "README.md"]
LINK = re.compile(r"\]\(([^)#\s]+)(?:#[^)\s]*)?\)")
ANCHOR = re.compile(r"\]\(([^)#\s]*)#([^)\s]+)\)")
HEADING = re.compile(r"^#+ +(.+?) *$", re.MULTILINE)
SEPARATOR = re.compile(r"\|(?: *:?-+:? *\|)+")
PATH = re.compile(r"`((?:[\w.*-]+/)+[\w.*-]+\.(?:hpp|cpp|h|py|js|sh|md))`")
BASES = ("", "fmu_src", "docs", "build_fmu")


def code_removed(text: str) -> str:
    return re.sub(r"^```.*?^```", "", text, flags=re.MULTILINE | re.DOTALL)


def missing(page: Path, text: str) -> list[str]:
    """Returns link targets and paths of the page that do not exist."""
    links = [target for target in LINK.findall(text) if "://" not in target and not (page.parent / target).exists()]
    paths = [
        path for path in PATH.findall(text) if not path.startswith("out/") and not any(any((ROOT / base).glob(path)) for base in BASES)
    ]
    return links + paths


@pytest.mark.parametrize("page", PAGES, ids=lambda page: page.relative_to(ROOT).as_posix())
def test_links_and_paths_exist(page):
    assert not missing(page, code_removed(page.read_text(encoding="utf-8")))


def test_a_wrong_path_is_found():
    text = "see [this](docs/nowhere.md) and `dynamics/nowhere.hpp`, [that](docs/index.md#top), `dynamics/aba.hpp` and `tests/fmi/test_abuse_*.py`"
    assert missing(ROOT / "README.md", text) == ["docs/nowhere.md", "dynamics/nowhere.hpp"]


def anchors(text: str) -> set[str]:
    """Returns the anchors of a page that are the same on GitHub and in the site of mkdocs."""
    github, mkdocs = set(), set()
    for heading in HEADING.findall(code_removed(text)):
        title = re.sub(r"\[([^\]]*)\]\([^)]*\)", r"\1", heading).replace("`", "").replace("*", "").lower()
        github.add(re.sub(r"[^\w\- ]", "", title).replace(" ", "-"))
        ascii_title = unicodedata.normalize("NFKD", title).encode("ascii", "ignore").decode()
        mkdocs.add(re.sub(r"[-\s]+", "-", re.sub(r"[^\w\s-]", "", ascii_title).strip()))
    return github & mkdocs


def missing_anchors(page: Path, text: str) -> list[str]:
    """Returns links to headings that their page does not have."""
    found = []
    for target, anchor in ANCHOR.findall(text):
        other = page.parent / target if target else page
        if "://" not in target and other.suffix == ".md" and anchor not in anchors(other.read_text(encoding="utf-8")):
            found.append(f"{target}#{anchor}")
    return found


def loose_rows(text: str) -> list[str]:
    """Returns the first rows of tables whose second row is not a separator."""
    lines = ["", *(line.strip() for line in text.splitlines()), ""]
    return [
        line
        for before, line, after in zip(lines, lines[1:], lines[2:], strict=False)
        if line.startswith("|") and not before.startswith("|") and not SEPARATOR.fullmatch(after)
    ]


@pytest.mark.parametrize("page", PAGES, ids=lambda page: page.relative_to(ROOT).as_posix())
def test_anchors_exist(page):
    assert not missing_anchors(page, code_removed(page.read_text(encoding="utf-8")))


@pytest.mark.parametrize("page", PAGES, ids=lambda page: page.relative_to(ROOT).as_posix())
def test_tables_have_a_header(page):
    assert not loose_rows(code_removed(page.read_text(encoding="utf-8")))


def test_a_wrong_anchor_is_found():
    text = "[a](docs/index.md#nowhere), [b](#quick-start), [c](docs/model_file.md#shape-a-solid-of-the-drawing), [d](#slow-start)"
    assert missing_anchors(ROOT / "README.md", text) == ["docs/index.md#nowhere", "#slow-start"]


def test_a_broken_table_is_found():
    text = "| a | b |\n| --- | ---: |\n| 1 | 2 |\n\n| 3 | 4 |\n| 5 | 6 |\n"
    assert loose_rows(text) == ["| 3 | 4 |"]


def page(name: str) -> str:
    return (ROOT / "docs" / name).read_text(encoding="utf-8")


def ratios_of_peers() -> list[dict[str, float]]:
    """Returns the ratios to our CPU time of each row with an error of 1e-3 to 1e-9, by program."""
    names, rows = [], []
    for line in page("performance.md").splitlines():
        cells = [cell.strip() for cell in line.strip("|").split("|")]
        if cells[0] == "error":
            names = cells
        elif names and re.fullmatch(r"1e-0[3-9]", cells[0]):
            found = {name: re.search(r"\(([\d.]+)×\)", cell) for name, cell in zip(names, cells, strict=True)}
            rows.append({name: float(match[1]) for name, match in found.items() if match})
    return rows


def test_figures_of_the_readme_are_those_of_the_pages():
    readme = (ROOT / "README.md").read_text(encoding="utf-8")
    rows = ratios_of_peers()
    others = [[value for name, value in row.items() if name in ("Pinocchio", "MuJoCo", "Drake", "Exudyn")] for row in rows]
    nearest = [min(values) for values in others if values]
    pattern = r"takes ([\d.]+) to ([\d.]+) times our CPU time at equal error, in the median ([\d.]+) times"
    low, high, median = map(float, re.search(pattern, readme).groups())
    assert len(nearest) == 35 and (low, median, high) == (min(nearest), statistics.median(nearest), max(nearest))
    compiled = [min(values) / row["`--specialise`"] for row, values in zip(rows, others, strict=True) if values]
    low, high, median = min(compiled), max(compiled), statistics.median(compiled)
    assert f"and {low:.2g} to {high:.0f} times, in the median {median:.2g} times, that of [a library compiled for the model]" in readme
    generated = [value for row in rows for name, value in row.items() if name in ("CasADi", "heyoka")]
    low, high = re.search(r"heyoka takes ([\d.]+) to ([\d.]+) times our CPU time", readme).groups()
    assert float(low) == min(generated) and float(high) == max(generated)
    trees = [row for row in rows if "heyoka" in row]
    compiled = [row[name] / row["`--specialise`"] for row in trees for name in ("CasADi", "heyoka")]
    assert f"and {min(compiled):.2g} to {max(compiled):.2g} times that of a library compiled for the model" in readme

    size = re.search(r"shared library, MB \|[^|]*\| ([\d.]+)[, ]", page("performance.md"))[1]
    assert f"the same {size} MB library" in readme

    compiled = re.search(r"a loop in C\+\+ \| (\d+ µs) \|", page("inverse.md"))[1]
    paper = re.search(r"ReDySim in MATLAB[^|]*\| ([\d.]+) s \|", page("inverse.md"))[1]
    assert f"in {compiled} instead of {1e3 * float(paper):.0f} ms" in readme

    clients = page("interop.md").partition("| client |")[2].partition("\n\n")[0].splitlines()[2:]
    masters = [line for line in clients if "a checker" not in line and "| fails |" not in line]
    assert "tests in [nine masters]" in readme and len(masters) == 9
