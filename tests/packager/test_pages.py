"""Links and paths in README and docs/ lead to files of the tree."""

from __future__ import annotations

import re
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[2]
PAGES = [*sorted(ROOT.glob("*.md")), *sorted((ROOT / "docs").rglob("*.md")), ROOT / "models" / "README.md"]
LINK = re.compile(r"\]\(([^)#\s]+)(?:#[^)\s]*)?\)")
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
