"""Copies the summary and the picture of `build-fmu stress` into docs/stability.md.

build-fmu stress models/*.toml -o out/stress
python docs/pictures/make_stability.py out/stress      replaces the text between the two comments
"""

from __future__ import annotations

import shutil
import sys
from pathlib import Path

HERE = Path(__file__).resolve().parent
ROOT = HERE.parents[1]
sys.path.insert(0, str(ROOT))

from build_fmu.stress.pages import SUMMARY_BEGIN, SUMMARY_END


def taken_over(document: str, page: str) -> str:
    """Returns the document with the summary of the page."""
    before, _, rest = document.partition(SUMMARY_BEGIN)
    after = rest.partition(SUMMARY_END)[2]
    summary = page.partition(SUMMARY_BEGIN)[2].partition(SUMMARY_END)[0]
    if not (after and summary):
        raise SystemExit(f"both files must contain {SUMMARY_BEGIN} and {SUMMARY_END}")
    return before + SUMMARY_BEGIN + summary + SUMMARY_END + after


def main(folder: Path) -> None:
    """Rewrites the document and copies the picture."""
    document = ROOT / "docs" / "stability.md"
    page = (folder / "stress.md").read_text(encoding="utf-8")
    document.write_text(taken_over(document.read_text(encoding="utf-8"), page), encoding="utf-8")
    shutil.copyfile(folder / "stress.png", HERE / "stress.png")


if __name__ == "__main__":
    main(Path(sys.argv[1]))
