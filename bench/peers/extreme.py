#!/usr/bin/env python3
"""Stiff and extreme scenes in this project's FMU, MuJoCo, Drake and Exudyn: success, error and CPU time.

    python bench/peers/extreme.py -o out/bench

Initial settings of a typical user: fixed steps of 1 ms (0.5 ms where a torque switches every 0.5 ms), or error control with tolerance
1e-6. Scenes are neutral files as in tests/scenes; our models are imported from them. References: two_rods.py, and for the
parallelogram the equivalent pendulum. Writes extreme.md.
"""

from __future__ import annotations

import copy
import json
import subprocess
import sys
from pathlib import Path

import numpy as np

sys.path.insert(0, str(Path(__file__).resolve().parent))
from peers import Peers, command_line
from scenes import ROOT, Scene, public, referred
from two_rods import G, R, TwoRods, run
from work_precision import error_of
from worker import Gone

TOLERANCE = 1e-6
LIMIT = 60.0  # s of CPU time or wall-clock time


def imported(data: dict, title: str, methods: tuple[str, ...], work: Path) -> Scene:
    """Writes the scene and our model of it."""
    file = work / f"{data['name']}.json"
    file.write_text(json.dumps(data))
    model = file.with_suffix(".toml")
    model.unlink(missing_ok=True)
    subprocess.run(
        [sys.executable, "-m", "build_fmu", "import", file, "-o", model],
        cwd=ROOT,
        check=True,
        stdout=subprocess.DEVNULL,
        stderr=subprocess.DEVNULL,
    )
    return Scene(data["name"], model, title, methods, data)


def relative(rows) -> list[list[float]]:
    """Absolute angles of two rods as joint angles."""
    return [[float(y[0]), float(y[1] - y[0])] for y in rows]


def rods(name: str, title: str, work: Path, masses=(1.0, 1.0), torque=0.0, frequency=0.0) -> Scene:
    data = copy.deepcopy(public("double_pendulum", "double_pendulum", "", ()).data)
    data.update(name=name, time={"t_end": 2.0, "dt_out": 0.02})
    for body, mass in zip(data["bodies"], masses, strict=True):
        body.update(mass=mass, inertia=[0.0, mass / 12, mass / 12, 0.0, 0.0, 0.0])
    if torque:
        data["inputs"] = [{"joint": 0, "type": "bangbang", "amplitude": torque, "frequency": frequency}]
    scene = imported(data, title, ("erk",), work)
    system = TwoRods(masses=masses, torque=torque)

    def switch(cut: int) -> None:
        system.torque = torque if cut % 2 == 0 else -torque

    cuts = round(2 * frequency * scene.step) if frequency else 20
    scene.reference = relative(run(system.slope, (0, 0, 0, 0, 0), scene.step, scene.rows, cuts, switch))
    return scene


def parallelogram(work: Path) -> Scene:
    """Starts in a flat configuration, where two branches meet, and swings through flat configurations; equivalent to a single pendulum."""
    data = copy.deepcopy(public("fourbar_forced", "four_bar", "", ()).data)
    length, masses, speed = 0.2, (0.5, 0.5, 0.8), 2.0
    data.update(
        name="flat_parallelogram",
        inputs=[],
        initial={"q": [0.0, 0.0, 0.0], "qd": [speed, speed, -speed]},
        time={"t_end": 3.0, "dt_out": 0.03},
    )
    for body, mass, rod, x in zip(data["bodies"], masses, (length, length, 0.3), (0.0, 0.3, length), strict=True):
        body.update(mass=mass, com=[rod / 2, 0.0, 0.0], inertia=[0.0, mass * rod**2 / 12, mass * rod**2 / 12, 0.0, 0.0, 0.0])
        body["joint"]["mdh"]["a"] = x
        body["joint"]["placement"]["p"] = [x, 0.0, 0.0]
    # crank and rocker pivot on the ground at 0 and 0.3 m; the coupler is a child of the rocker and closes the loop at the crank
    data["bodies"][2]["parent"] = 1
    data["initial"]["q"][2] = float(np.pi)
    data["loops"][0].update(body_a=0, point_a=[length, 0.0, 0.0], body_b=2, point_b=[0.3, 0.0, 0.0])
    scene = imported(data, "parallelogram through flat configurations, where the loop is singular", ("erk",), work)
    inertia = R(length) ** 2 * (R(masses[0]) / 3 + R(masses[1]) / 3 + R(masses[2]))
    weight = G * R(length) * (R(masses[0]) / 2 + R(masses[1]) / 2 + R(masses[2]))
    rows = run(lambda y: np.array([y[1], -weight * np.cos(y[0]) / inertia]), (0, speed), scene.step, scene.rows, 30)
    scene.reference = [[float(y[0]), float(y[0]), float(R(np.pi) - y[0])] for y in rows]
    return scene


def cases(work: Path) -> list[tuple[Scene, float]]:
    """Scenes with their fixed step size."""
    strut = public("stiff_strut", "stiff_strut", "two rods with a strut of 1e7 N/m and 1e4 N s/m", ("bdf", "dirk", "erk"), stiff=True)
    return [
        (referred(strut), 1e-3),
        (rods("heavy_tip", "two rods, the outer one 1e6 times heavier", work, masses=(1.0, 1e6)), 1e-3),
        (rods("light_tip", "two rods, the outer one 1e6 times lighter", work, masses=(1.0, 1e-6)), 1e-3),
        (parallelogram(work), 1e-3),
        (rods("switching", "two rods, torque of ±20 N m at the shoulder, 1 kHz", work, torque=20.0, frequency=1000.0), 5e-4),
    ]


def attempts(scene: Scene, step: float) -> list[tuple[str, str, float, str]]:
    """(peer, method, value, words)"""
    cuts = round(scene.step / step)
    flip, fixed, controlled = "~" if scene.frequency else "", f"{1e3 * step:g} ms", f"tolerance {TOLERANCE:.0e}"
    found = [
        ("ReDySim-FMU", f"{method}{flip or ':'}{cuts}", TOLERANCE, f"{method}, {controlled}, `fmi2DoStep` of {fixed}")
        for method in scene.methods
    ]
    found += [("MuJoCo", f"{method}{flip}", cuts, f"{method}, {fixed}") for method in ("Euler", "RK4", "implicitfast")]
    if scene.has_loops:
        found += [("Drake", "sap", cuts, f"SAP, {fixed}")]
    else:
        found += [
            ("Drake", f"{method}:{step!r}", TOLERANCE, f"{method}, {controlled}, maximum step {fixed}")
            for method in ("runge_kutta3", "radau3")
        ]
        found += [("Exudyn", "RK44", cuts, f"RK44, {fixed}"), ("Exudyn", "DOPRI5", TOLERANCE, f"DOPRI5, {controlled}")]
    found += [("Exudyn", "GeneralizedAlpha", cuts, f"generalized alpha, {fixed}")]
    return found


def table(scene: Scene, step: float, peers: Peers, absent: dict[str, str], limit: float) -> str:
    lines = [
        f"**{scene.title}**",
        "",
        "| simulator | settings | maximum error, rad | CPU time, ms per simulated second |",
        "| --- | --- | --- | --- |",
    ]
    workers = {}
    for peer, method, value, words in attempts(scene, step):
        if peer in absent:
            continue
        print(f"  {peer}, {words}", flush=True)
        try:
            if peer not in workers:
                workers[peer] = peers.start(peer, scene)
            answer = workers[peer].ask(method, value, limit)
        except Gone:
            workers.pop(peer).close()
            lines.append(f"| {peer} | {words} | no result within {limit:.0f} s, or the process crashed | |")
            continue
        if answer.rows is None:
            lines.append(f"| {peer} | {words} | failed: {answer.failure} | |")
            continue
        error = error_of(scene, answer.rows)
        judged = f"{error:.1e}" if error < 1 else f"{error:.1e}, wrong solution"
        lines.append(f"| {peer} | {words} | {judged} | {1e3 * answer.seconds / scene.end:.3g} |")
    for worker in workers.values():
        worker.close()
    return "\n".join(lines) + "\n"


def main() -> None:
    parser = command_line(__doc__)
    parser.add_argument("--limit", type=float, default=LIMIT, help="time limit of a run, s")
    options = parser.parse_args()
    options.output.mkdir(parents=True, exist_ok=True)
    work = ROOT / "build" / "peers_work"
    peers = Peers(options.programs, options.python, work)
    absent = peers.missing()
    for peer in ("MuJoCo", "Drake", "Exudyn"):
        if peer in absent:
            print(f"{peer} is skipped: {absent[peer]}")
    text = []
    for scene, step in cases(work):
        print(f"{scene.name}: {scene.title}", flush=True)
        text.append(table(scene, step, peers, absent, options.limit))
    versions = ", ".join(f"{peer} {version}" for peer, version in peers.versions().items() if peer in ("MuJoCo", "Drake", "Exudyn"))
    (options.output / "extreme.md").write_text(f"{versions}.\n\n" + "\n".join(text))
    print(f"wrote {options.output}/extreme.md")


if __name__ == "__main__":
    main()
