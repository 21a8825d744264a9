"""Draws docs/pictures/live.png: the page of `build-fmu show --live models/kuka_kr5.toml` while the mouse pulls the arm.

python docs/pictures/make_live.py      after `make wasm`; writes live.png beside this file
"""

from __future__ import annotations

import sys
import tempfile
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
sys.path.insert(0, str(ROOT))

from build_fmu.cli import main
from tests.packager.chromium import Page

SET = """for (const [name, value] of Object.entries(VALUES)) {
  const field = document.querySelector(`.controls input[aria-label="${name}"]`);
  field.value = value;
  field.onchange();
}"""
VALUES = '{"joint1.damping": 5, "joint2.damping": 20, "joint3.damping": 20, "joint4.damping": 2, "joint5.damping": 2, "joint6.damping": 1}'


def draw(target: Path) -> None:
    """Writes the picture."""
    with tempfile.TemporaryDirectory() as folder:
        file = Path(folder) / "page.html"
        main(["show", "--live", str(ROOT / "models" / "kuka_kr5.toml"), "-o", str(file)])
        with Page(file.as_uri() + "#paused", Path(folder)) as page:
            page.wait("document.documentElement.dataset.live")
            page.value(SET.replace("VALUES", VALUES))
            page.value("play(true)")
            page.wait("now > 3")
            page.value("play(false)")
            x, y = page.tip()
            page.mouse("pressed", x, y)
            page.mouse("moved", x + 150, y - 150)
            page.wait("now > 3.9")
            page.value("play(false), redraw()")
            page.screenshot(target)
    print(f"{target}  {target.stat().st_size / 1024:.0f} kB")


if __name__ == "__main__":
    draw(ROOT / "docs" / "pictures" / "live.png")
