#!/usr/bin/env python3
"""Prints humanoid.toml: a trunk of three hinges on the ground, a neck, two arms of four and two legs of six hinges, 24 in all. Own data.

python bench/scenes/humanoid.py > bench/scenes/humanoid.toml
"""

import math

HALF = math.pi / 2


def rod(mass, length, radius):
    """Mass, center and inertia of a cylinder along y from the joint downwards."""
    across, along = mass * (3 * radius**2 + length**2) / 12, mass * radius**2 / 2
    return {"mass": mass, "com": [0, -length / 2, 0], "inertia": [across, along, across]}


def ball(mass, radius):
    return {"mass": mass, "inertia": [0.4 * mass * radius**2] * 3}


# name, parent, placement of the joint, body, start position
LINKS = [
    ("yaw", "ground", {}, ball(2, 0.06), 0.1),
    ("pitch", "yaw", {"alpha": HALF}, ball(2, 0.06), 0.2),
    ("roll", "pitch", {"alpha": -HALF, "gamma": HALF}, {"mass": 25, "com": [0, 0, 0.25], "inertia": [0.9, 0.8, 0.3]}, -0.1),
    ("neck", "roll", {"b": 0.55, "alpha": HALF}, {"mass": 4, "com": [0, 0.12, 0], "inertia": [0.02, 0.015, 0.02]}, 0.3),
]
for side, sign in (("left", 1), ("right", -1)):
    LINKS += [
        (f"{side}_shoulder", "roll", {"gamma": sign * HALF, "b": 0.45, "a": 0.2, "alpha": HALF}, ball(0.8, 0.05), 0.4 * sign),
        (f"{side}_lift", f"{side}_shoulder", {"alpha": HALF}, ball(0.8, 0.05), 0.5),
        (f"{side}_upper_arm", f"{side}_lift", {"alpha": -HALF}, rod(2.1, 0.3, 0.04), -0.3 * sign),
        (f"{side}_forearm", f"{side}_upper_arm", {"gamma": -HALF, "a": 0.3}, rod(1.6, 0.35, 0.03), 0.8),
        (f"{side}_hip", "roll", {"gamma": sign * HALF, "b": -0.1, "a": 0.1, "alpha": HALF}, ball(1.5, 0.06), 0.2 * sign),
        (f"{side}_spread", f"{side}_hip", {"alpha": HALF}, ball(1.5, 0.06), 0.3),
        (f"{side}_thigh", f"{side}_spread", {"alpha": -HALF}, rod(7, 0.42, 0.07), 0.4),
        (f"{side}_shank", f"{side}_thigh", {"gamma": -HALF, "a": 0.42}, rod(3.5, 0.4, 0.05), -0.9),
        (f"{side}_ankle", f"{side}_shank", {"gamma": -HALF, "a": 0.4}, ball(0.6, 0.04), 0.3),
        (f"{side}_foot", f"{side}_ankle", {"alpha": HALF}, {"mass": 1, "com": [0.05, 0, 0.03], "inertia": [2e-3, 4e-3, 4e-3]}, 0.1 * sign),
    ]


def main():
    print("# Humanoid of 24 hinges whose trunk stands on the ground, in free fall. Written by humanoid.py.\n")
    print('name = "humanoid"\ngravity = [0, 0, -9.81]\n')
    for name, parent, placement, body, start in LINKS:
        fields = {**placement, **body, "q": start}
        print(f'[[link]]\nname = "{name}"\nparent = "{parent}"')
        print("".join(f"{key} = {value!r}\n" for key, value in fields.items()))
    print("[fmu]\nstop_time = 0.5\nstep_size = 0.005")


if __name__ == "__main__":
    main()
