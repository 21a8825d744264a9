#!/usr/bin/env python3
"""Writes tests/scenes/stiff_strut.json and .csv: two rods held by one stiff, strongly damped strut.

The equations of two_rods.py, with steps refined until two runs agree. No code of this project is used.

    python bench/peers/stiff_reference.py FOLDER     default: tests/scenes
"""

import json
import sys
from pathlib import Path

import numpy as np

sys.path.insert(0, str(Path(__file__).resolve().parent))
from two_rods import G, R, TwoRods, run

PIVOT, Q0 = (1.2, -0.8), (0.0, -0.5)
END, STEP = 2.0, 0.02
REST = float(TwoRods(pivot=PIVOT).strut(R(Q0[0]), R(Q0[0] + Q0[1]), R(0), R(0))[0])
RODS = TwoRods(pivot=PIVOT, stiffness=1e7, damping=1e4, length=REST)


def record(time, y):
    a, b, da, db, work = y
    s = RODS.slope(y)
    kinetic = R(2) / 3 * da * da + db * db / 6 + np.cos(a - b) * da * db / 2
    length = RODS.strut(a, b, da, db)[0]
    potential = G * (R("1.5") * np.sin(a) + np.sin(b) / 2) + R(RODS.stiffness) * (length - R(REST)) ** 2 / 2
    values = [time, a, b - a, da, db - da, s[2], s[3] - s[2], kinetic, potential, work, 0]
    return ",".join(np.format_float_scientific(float(v), precision=16, trim="-") if v else "0" for v in values)


def body(name, parent, x):
    return {
        "name": name,
        "parent": parent,
        "joint": {
            "type": "revolute",
            "axis": [0.0, 0.0, 1.0],
            "mdh": {"gamma": 0.0, "b": 0.0, "alpha": 0.0, "a": x, "theta": 0.0, "d": 0.0},
            "placement": {"R": [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]], "p": [x, 0.0, 0.0]},
        },
        "mass": 1.0,
        "com": [0.5, 0.0, 0.0],
        "inertia": [0.0, 1 / 12, 1 / 12, 0.0, 0.0, 0.0],
    }


def main():
    root = Path(__file__).resolve().parent.parent.parent
    folder = Path(sys.argv[1]) if len(sys.argv) > 1 else root / "tests" / "scenes"
    start = (Q0[0], Q0[0] + Q0[1], 0, 0, 0)
    coarse, fine = (list(run(RODS.slope, start, STEP, round(END / STEP), cuts)) for cuts in (160, 240))
    difference = [max(float(abs(x[i] - y[i])) for x, y in zip(coarse, fine, strict=True)) for i in range(4)]
    lines = ["t,q1,q2,qd1,qd2,qdd1,qdd2,kinetic,potential,work,loop_residual"]
    lines += [record(i * STEP, y) for i, y in enumerate(fine)]
    energy = [sum(float(x) * s for x, s in zip(line.split(",")[7:10], (1, 1, -1), strict=True)) for line in lines[1:]]
    scene = {
        "format": "mbs-scene/1",
        "name": "stiff_strut",
        "title": "two slender rods 1 m / 1 kg each, tip held by a strut of 1e7 N/m and 1e4 N s/m",
        "set": "public",
        "gravity": [0.0, -9.81, 0.0],
        "bodies": [body("rod1", -1, 0.0), body("rod2", 0, 1.0)],
        "loops": [],
        "forces": [
            {
                "name": "strut",
                "type": "spring_damper",
                "body_a": -1,
                "point_a": [*PIVOT, 0.0],
                "body_b": 1,
                "point_b": [1.0, 0.0, 0.0],
                "k": RODS.stiffness,
                "c": RODS.damping,
                "rest_length": REST,
            }
        ],
        "inputs": [],
        "initial": {"q": list(Q0), "qd": [0.0, 0.0]},
        "time": {"t_end": END, "dt_out": STEP},
        "reference": {
            "csv": "stiff_strut.csv",
            "columns": "t,q*,qd*,qdd*,kinetic,potential,work,loop_residual",
            "method": "bench/peers/stiff_reference.py: Lagrange's equations by hand, 80-bit, extrapolated midpoint rule",
            "tolerance": "fixed steps, halved until they agree",
            "self_difference": {"q": max(difference[:2]), "qd": max(difference[2:])},
            "energy_minus_work_spread": max(energy) - min(energy),
            "note": "",
        },
        "source": "own",
    }
    (folder / "stiff_strut.csv").write_text("\n".join(lines) + "\n")
    (folder / "stiff_strut.json").write_text(json.dumps(scene, indent=1) + "\n")
    print(f"stiff_strut: two runs differ by {max(difference[:2]):.1e} rad, energy by {max(energy) - min(energy):.1e} J")


if __name__ == "__main__":
    main()
