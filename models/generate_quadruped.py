"""Prints the model file and the gait of the quadruped:

`python models/generate_quadruped.py model > models/quadruped.toml`, `python models/generate_quadruped.py gait > models/quadruped_trot.csv`.

Masses and dimensions: URDF of Solo 12 (Open Dynamic Robot Initiative, BSD 3-clause), whose feet are lumped into the shanks here.
Foot radius, contact parameters, gains and gait: own choice.
"""

from __future__ import annotations

import math
import sys

LEGS = {"front_left": (1, 1), "front_right": (1, -1), "hind_left": (-1, 1), "hind_right": (-1, -1)}  # signs of x and y of the hip
LENGTH = 0.16  # m, of thigh and shank
HEIGHT = 0.24  # m, of the hips above the centers of the feet
FOOT = 0.016  # m, radius
# gait: the feet of a diagonal are on the ground for STANCE of each PERIOD, half a period after the other diagonal
PERIOD, STANCE, STRIDE, LIFT = 0.4, 0.6, 0.08, 0.03  # s, -, m, m
START, STEPS, ROWS = 0.5, 10, 20  # s, periods, rows per period

HEADER = """# Quadruped with 12 joints that stands for 0.5 s, trots for 4 s and stands again, under PD control of all joints.
# Masses and dimensions: Solo 12, Open Dynamic Robot Initiative (BSD 3-clause); the feet are lumped into the shanks.
# Written by generate_quadruped.py, as is the gait in quadruped_trot.csv.

name = "quadruped"
description = "Quadruped that stands and trots under PD control"

[[link]]
name = "trunk"
joint = "free"
drive = "free"
mass = 1.16115091
inertia = [0.00578574, 0.01938108, 0.02476124]
q = [0, 0, {height:g}, 1, 0, 0, 0]
"""
LEG = """
[[link]]
name = "{leg}_hip"
parent = "trunk"
joint_name = "{leg}_abduction"
gamma = 1.5707963267948966
alpha = 1.5707963267948966
a = {hip_y:g}
theta = 1.5707963267948966
d = {hip_x:g}
mass = 0.14853845
com = [0, {com_y:g}, {com_x:g}]
inertia = [0.00041107, 0.00041193, 3.024e-05, 0, 0, {product:g}]

[[link]]
name = "{leg}_thigh"
joint_name = "{leg}_flexion"
alpha = 1.5707963267948966
theta = 3.141592653589793
d = {thigh_y:g}
mass = 0.14853845
com = [0.078707, {thigh_com:g}, {thigh_com_y:g}]
inertia = [3.024e-05, 0.00041107, 0.00041193, 0, {product:g}, 0]
q = {flexion:.6f}

[[link]]
name = "{leg}_shank"
joint_name = "{leg}_knee"
a = 0.16
theta = -1.5707963267948966
d = {shank_y:g}
mass = 0.03763607
com = [0, 0.102249, {shank_com_y:g}]
inertia = [1.488192e-04, 2.690086e-06, 1.491392e-04, 0, 0, {shank_product:g}]
q = {knee:.6f}
"""
CONTACT = """
[[contact]]
name = "{leg}_foot"
link_a = "{leg}_shank"
shape_a = "sphere"
point_a = [0, 0.16, {foot_y:g}]
radius_a = {foot:g}
stiffness = 3e4
damping = 2
friction = 0.7
friction_velocity = 1e-3
outputs = ["force", "depth", "point", "slip"]
"""
FOOTER = """
[controller]
law = "pd"
kp = 20
kd = 0.3

[solver]
rtol = 1e-4

[fmu]
stop_time = 5
step_size = 0.001
"""


def joints(front: int, x: float, z: float) -> tuple[float, float]:
    """Returns flexion and knee angle (rad) for a foot at x, z relative to the hip (m); knees point towards the middle of the trunk."""
    knee = -front * 2 * math.acos(math.hypot(x, z) / (2 * LENGTH))
    return math.atan2(-x, -z) - knee / 2, knee


def foot(phase: float, share: float) -> tuple[float, float]:
    """Returns x and the lift of a foot (m) at a phase of its period; `share` scales the gait."""
    if phase < STANCE:
        return share * STRIDE * (0.5 - phase / STANCE), 0.0
    # swing: a polynomial of degree 5 that starts and ends with the velocity of the stance and zero acceleration
    s, slope = (phase - STANCE) / (1 - STANCE), -(1 - STANCE) / STANCE
    blend = s**3 * (10 + s * (-15 + 6 * s))
    return share * STRIDE * ((1 - slope) * blend + slope * s - 0.5), share * LIFT * 64 * (s * (1 - s)) ** 3


def gait() -> str:
    """Returns the table of the joints that move in the sagittal plane."""
    names = [f"{leg}_{joint}.q" for leg in LEGS for joint in ("flexion", "knee")]
    lines = ["time," + ",".join(names)]
    for row in range(STEPS * ROWS + 1):
        period = row / ROWS
        # the first and the last two periods change the amplitude
        share = min(1.0, period / 2, (STEPS - period) / 2)
        cells = []
        for front, side in LEGS.values():
            x, lift = foot((period + (0 if front == side else 0.5)) % 1, share)
            cells += joints(front, x, lift - HEIGHT)
        lines.append(f"{START + PERIOD * period:.2f}," + ",".join(f"{angle:.6f}" for angle in cells))
    return "\n".join(lines) + "\n"


def model() -> str:
    """Returns the text of the model file; the feet touch the ground at the start."""
    text, contacts, trajectories = HEADER.format(height=HEIGHT + FOOT), "", ""
    for leg, (front, side) in LEGS.items():
        flexion, knee = joints(front, 0.0, -HEIGHT)
        text += LEG.format(
            leg=leg,
            hip_y=0.0875 * side,
            hip_x=0.1946 * front,
            com_y=-0.01 * side,
            com_x=-0.078707 * front,
            product=-4.671e-05 * side,
            thigh_y=0.014 * side,
            thigh_com=-1.377e-05 * side,
            thigh_com_y=0.01935853 * side,
            flexion=flexion,
            shank_y=0.03745 * side,
            shank_com_y=0.00789921 * side,
            shank_product=-3.099187e-06 * side,
            knee=knee,
        )
        contacts += CONTACT.format(leg=leg, foot_y=0.008 * side, foot=FOOT)
        for joint in ("flexion", "knee"):
            trajectories += f'\n[[trajectory]]\njoint = "{leg}_{joint}"\ntype = "table"\nfile = "quadruped_trot.csv"\n'
    return text + contacts + trajectories + FOOTER


if __name__ == "__main__":
    writers = {"model": model, "gait": gait}
    if len(sys.argv) != 2 or sys.argv[1] not in writers:
        sys.exit("usage: generate_quadruped.py model|gait")
    sys.stdout.write(writers[sys.argv[1]]())
