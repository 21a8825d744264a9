"""Prints the model file of a chain of N four-bars: `python models/generate_four_bar_chain.py 10 > models/four_bar_chain.toml`.

Each four-bar is a parallelogram (crank and rocker 0.2 m, coupler and base 0.3 m) that stands on the coupler of the one
before, the first on the ground; 3 N joints, N loops, N degrees of freedom. All data are round numbers of our own.
"""

from __future__ import annotations

import math
import sys

LENGTHS = {"crank": 0.2, "rocker": 0.2, "coupler": 0.3}
MASSES = {"crank": 0.5, "rocker": 0.6, "coupler": 0.8}


def link(kind: str, number: int, parent: str, a: float, q: float) -> str:
    length, mass = LENGTHS[kind], MASSES[kind]
    across = mass * length**2 / 12
    drive = "" if kind == "crank" else ', drive = "free"'
    return (
        f'  {{ name = "{kind}{number}", joint_name = "{kind}{number}_joint", parent = "{parent}", a = {a}, q = {q!r}, mass = {mass}, '
        f"com = [{length / 2}, 0, 0], inertia = [{across / 100:.6g}, {across:.6g}, {across:.6g}]{drive} }},\n"
    )


def model(count: int) -> str:
    """Returns the text of the model file; crank k starts at 1 + 0.1 sin(k) rad to its base, which closes the loops."""
    links, loops = "", ""
    for k in range(1, count + 1):
        base, angle = "ground" if k == 1 else f"coupler{k - 1}", 1 + 0.1 * math.sin(k)
        links += link("crank", k, base, 0, angle) + link("rocker", k, base, 0.3, angle) + link("coupler", k, f"crank{k}", 0.2, -angle)
        loops += (
            f'  {{ name = "loop{k}", type = "revolute", link_a = "rocker{k}", point_a = [0.2, 0, 0], link_b = "coupler{k}", '
            "point_b = [0.3, 0, 0] },\n"
        )
    return (
        f"# Chain of {count} parallelogram four-bars, each on the coupler of the one before.\n"
        "# Made by generate_four_bar_chain.py; shows that the cost of loops grows with their number and no faster.\n\n"
        f'name = "four_bar_chain"\ndescription = "Chain of {count} four-bars"\ngravity = [0, -9.81, 0]\n\n'
        f"link = [\n{links}]\n\nloop = [\n{loops}]\n\n[fmu]\nstop_time = 1\nstep_size = 0.01\n"
    )


if __name__ == "__main__":
    if len(sys.argv) != 2 or not sys.argv[1].isdigit() or int(sys.argv[1]) < 1:
        sys.exit("usage: generate_four_bar_chain.py N")
    print(model(int(sys.argv[1])), end="")
