"""Draws the motion of the four-bar by Lagrange's equations and by the FMU, and their difference.

python docs/pictures/make_four_bar.py      after `make build`; writes four_bar_lagrange.png beside this file
"""

from __future__ import annotations

import sys
import tempfile
from pathlib import Path

import matplotlib

matplotlib.use("Agg")
import matplotlib.pyplot as plt
import numpy as np

ROOT = Path(__file__).resolve().parents[2]
sys.path.insert(0, str(ROOT))

from build_fmu import build, describe
from tests.fmi.four_bar_lagrange import CLOSED, REDYSIM
from tests.fmi.raw import OK, Slave, Unpacked

JOINTS = {"crank_joint": "crank", "joint2": "rocker", "joint3": "coupler"}
ROWS = {"q": ("angle", "rad"), "qd": ("velocity", "rad/s"), "qdd": ("acceleration", "rad/s²")}


def simulate(fmu: Unpacked, times: np.ndarray, torque: float) -> dict[str, np.ndarray]:
    """Returns q, qd and qdd of the FMU at `times`."""
    with Slave(fmu) as slave:
        slave.initialize(start={"solver.rtol": 1e-10, "solver.atol": 1e-12})
        assert slave.set("crank_joint.tau", torque) == OK
        record = {row: [] for row in ROWS}
        for k, time in enumerate(times):
            if k > 0:
                assert slave.step(times[k - 1], time - times[k - 1]) == OK
            for row, values in record.items():
                values.append(slave.reals([f"{joint}.{row}" for joint in JOINTS]))
    return {row: np.array(values) for row, values in record.items()}


def main() -> None:
    """Writes four_bar_lagrange.png."""
    times = np.linspace(0, 1.33, 267)
    model_file = ROOT / "models" / "four_bar.toml"
    figure, axes = plt.subplots(2 * len(ROWS), 2, figsize=(9, 9), sharex=True, height_ratios=[3, 1] * len(ROWS), layout="constrained")
    with tempfile.TemporaryDirectory() as folder:
        target = Path(folder) / "four_bar.fmu"
        build(describe(model_file), model_file, target)
        fmu = Unpacked(target, Path(folder) / "fmu")
        for column, (title, torque) in enumerate((("free fall", 0), ("2 N m at the crank", 2))):
            lagrange = REDYSIM.simulate(times, [0, CLOSED, CLOSED], [0, 0, 0], torque)
            ours = simulate(fmu, times, torque)
            axes[0][column].set_title(title)
            for row, (name, (quantity, unit)) in enumerate(ROWS.items()):
                curves, difference = axes[2 * row][column], axes[2 * row + 1][column]
                for joint, text in enumerate(JOINTS.values()):
                    (line,) = curves.plot(times, ours[name][:, joint], linewidth=1, label=f"{text}, FMU")
                    curves.plot(
                        times[::6], lagrange[name][::6, joint], "o", markersize=2.5, color=line.get_color(), label=f"{text}, Lagrange"
                    )
                error = np.abs(ours[name] - lagrange[name]).max(axis=1)
                difference.semilogy(times[1:], np.maximum(error[1:], 1e-17), color="black", linewidth=0.8)
                curves.set_ylabel(f"{quantity}, {unit}")
                difference.set_ylabel(f"difference,\n{unit}", fontsize=7)
    figure.legend(*axes[0][0].get_legend_handles_labels(), loc="outside lower center", fontsize=8, ncols=6)
    for axis in axes[-1]:
        axis.set_xlabel("time, s")
    picture = Path(__file__).with_name("four_bar_lagrange.png")
    figure.savefig(picture, dpi=110)
    print(f"{picture.relative_to(ROOT)}, {picture.stat().st_size / 1024:.0f} kB")


if __name__ == "__main__":
    main()
