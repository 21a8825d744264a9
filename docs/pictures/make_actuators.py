"""Draws an arm under PD control with an ideal drive and with a torque limit.

python docs/pictures/make_actuators.py      after `make build`; writes actuators.png beside this file
"""

from __future__ import annotations

import math
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
from tests.fmi.raw import OK, Slave, Unpacked

LIMIT = 6.0  # N m

# q = 0: hanging, q = pi: upright
ARM = """
name = "arm"
gravity = [9.81, 0, 0]

[[link]]
name = "arm"
mass = 2
com = [0.5, 0, 0]
inertia = [0.001, 0.17, 0.17]
damping = 0.5

[controller]
law = "pd"
kp = 60
kd = 9
target = 3.141592653589793

[fmu]
outputs = ["acceleration", "energy", "solver", "actuator"]
"""
ACTUATOR = f'\n[[actuator]]\njoint = "arm"\ntorque_limit = {LIMIT}\n'


def simulate(text: str, torque: str, times: np.ndarray) -> np.ndarray:
    """Returns angle and torque on the joint at `times`."""
    with tempfile.TemporaryDirectory() as folder:
        model_file, target = Path(folder) / "arm.toml", Path(folder) / "arm.fmu"
        model_file.write_text(text, encoding="utf-8")
        build(describe(model_file), model_file, target)
        with Slave(Unpacked(target, Path(folder) / "fmu")) as slave:
            slave.initialize()
            rows = [slave.reals(["arm.q", torque])]
            for before, time in zip(times[:-1], times[1:], strict=True):
                assert slave.step(before, time - before) == OK
                rows.append(slave.reals(["arm.q", torque]))
    return np.array(rows)


def main() -> None:
    """Writes actuators.png."""
    times = np.linspace(0, 8, 801)
    figure, (angle, torque) = plt.subplots(2, 1, figsize=(8, 5), sharex=True, layout="constrained")
    for label, color, rows in (
        ("without limit", "tab:blue", simulate(ARM, "arm.tau", times)),
        (f"torque_limit = {LIMIT:g} N m", "tab:red", simulate(ARM + ACTUATOR, "arm.tau_joint", times)),
    ):
        angle.plot(times, np.degrees(rows[:, 0]), color=color, label=label)
        torque.plot(times, rows[:, 1], color=color)
        print(f"{label}: {math.degrees(rows[-1, 0]):.2f} deg at {times[-1]:g} s")
    angle.axhline(180, color="black", linewidth=0.6, linestyle="--", label="target")
    angle.set_ylabel("angle, deg")
    angle.set_yticks(range(0, 271, 45))
    angle.legend(loc="center right", fontsize=8)
    torque.axhline(9.81, color="gray", linewidth=0.6, linestyle=":")
    torque.text(times[-1], 9.81, "weight at the horizontal", ha="right", va="bottom", fontsize=7, color="gray")
    torque.set_ylabel("torque on the joint, N m")
    torque.set_ylim(-30, 60)
    torque.set_xlabel("time, s")
    picture = Path(__file__).with_name("actuators.png")
    figure.savefig(picture, dpi=110)
    print(f"{picture.relative_to(ROOT)}, {picture.stat().st_size / 1024:.0f} kB")


if __name__ == "__main__":
    main()
