"""Draws docs/pictures/accuracy.png, what accuracy costs on the KUKA KR5: python docs/pictures/make_accuracy.py"""

import sys
from pathlib import Path

import matplotlib
import numpy as np
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure

ROOT = Path(__file__).resolve().parents[2]
sys.path.insert(0, str(ROOT))

from build_fmu.report.command import Wish, make_report
from build_fmu.report.machine import processor
from build_fmu.report.pages import advice, draw_panel

report = make_report(ROOT / "models" / "kuka_kr5.toml", Wish(steps=[0.01]))
print("\n".join(advice(report)))
matplotlib.rcParams.update({"font.size": 9, "axes.axisbelow": True})
figure = Figure(figsize=(8.6, 4.9), dpi=130, layout="constrained")
FigureCanvasAgg(figure)
figure.suptitle("KUKA KR5, six joints: what accuracy costs", x=0.01, ha="left", fontsize=13, weight="bold", color="#22303c")
axes = figure.subplots()
draw_panel(axes, report.points, report)
axes.set_xlabel("largest joint error in 1 s of free fall [rad], more accurate to the right")
axes.set_ylabel("computing time for 1 ms of motion [µs]")
axes.set_title(f"communication step 10 ms; {processor()}, one thread", loc="left", fontsize=9, color="#5a6872")
real_time = axes.secondary_yaxis("right", functions=(lambda us: 1000 / np.maximum(us, 1e-9), lambda factor: 1000 / np.maximum(factor, 1e-9)))
real_time.set_ylabel("times faster than real time")
real_time.yaxis.set_major_formatter(lambda y, _: f"{y:g}")
axes.legend(loc="upper center", bbox_to_anchor=(0.5, -0.13), ncol=3, frameon=False, fontsize=8.5)
figure.savefig(ROOT / "docs" / "pictures" / "accuracy.png", metadata={"Software": None})
