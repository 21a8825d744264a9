"""Draws the picture of the README: a robot in its start pose and its free fall, drawn by the packager.

python docs/pictures/make.py      after `make build`; writes kuka_kr5.png beside this file
"""

from __future__ import annotations

import io
import sys
import tempfile
from pathlib import Path

from PIL import Image

ROOT = Path(__file__).resolve().parents[2]
sys.path.insert(0, str(ROOT))

from build_fmu.draw.drawing import draw
from build_fmu.draw.plots import plot
from build_fmu.fmu.build import build
from build_fmu.model.describe import describe
from build_fmu.run.session import Session
from build_fmu.run.simulate import Settings, simulate

SHOWN = ["*.q", "energy.kinetic", "energy.potential", "energy.total"]
COLOURS = 256  # sufficient for flat areas and thin lines; halves the file size


def main() -> None:
    """Writes kuka_kr5.png."""
    model_file = ROOT / "models" / "kuka_kr5.toml"
    model = describe(model_file)
    robot = Image.open(io.BytesIO(draw(model.drawing, model.model_name))).convert("RGB")
    with tempfile.TemporaryDirectory() as folder:
        fmu, curves_file = Path(folder) / "kuka_kr5.fmu", Path(folder) / "curves.png"
        build(model, model_file, fmu)
        with Session(fmu) as session:
            result = simulate(session, Settings(stop=1, step=0.002, outputs=SHOWN))
            session.description.modelName = "free fall"  # the name of the robot is the title on the left
            plot(curves_file, session, result, SHOWN)
        curves = Image.open(curves_file).convert("RGB")
    robot = robot.resize((round(robot.width * curves.height / robot.height), curves.height), Image.Resampling.LANCZOS)
    picture = Image.new("RGB", (robot.width + curves.width, curves.height), "white")
    picture.paste(robot, (0, 0))
    picture.paste(curves, (robot.width, 0))
    target = Path(__file__).with_name("kuka_kr5.png")
    picture.quantize(COLOURS).save(target, optimize=True)
    print(f"{target.relative_to(ROOT)}  {picture.width} x {picture.height}, {target.stat().st_size / 1024:.0f} kB")


if __name__ == "__main__":
    main()
