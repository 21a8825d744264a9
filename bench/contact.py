#!/usr/bin/env python3
"""Contact in this project's FMU, Drake, MuJoCo and Exudyn: error against CPU time.

    python bench/contact.py -o out/bench              all scenes
    python bench/contact.py -f bounce -r 3            selected scenes, three rounds

Each simulator is compared with the exact solution of its own contact law (peers/contact_scenes.py). Times as in
peers/work_precision.py. Writes contact_scenes.svg and .png (curves, without runs that a faster one of the same method beats),
contact.csv (all runs) and contact_figures.md (tables). Needs the program fmu_runner (scripts/bench.sh builds it) and the simulators of
scripts/peers.sh.
"""

from __future__ import annotations

import csv
import os
import re
import sys
from pathlib import Path

sys.path[:0] = [str(Path(__file__).resolve().parent / "peers"), str(Path(__file__).resolve().parent.parent)]
import built
from contact_scenes import ContactScene, scenes, write
from peers import CUTS, TOLERANCES, Curve, Peers
from scenes import ROOT
from summary import front, plot, plt, table
from summary import write as write_figure
from work_precision import compare, curves_command_line, medians

from build_fmu.report.machine import processor

STEPS = tuple(100 * cuts for cuts in CUTS)
PEERS = {"Drake": "pydrake", "MuJoCo": "mujoco", "Exudyn": "exudyn"}
OTHERS = (
    *(Curve("Drake", method, f"Drake {method}", TOLERANCES) for method in ("runge_kutta3", "cenic")),
    *(Curve("MuJoCo", method, f"MuJoCo {method}", STEPS) for method in ("Euler", "RK4")),
    Curve("Exudyn", "RK44", "Exudyn RK44", STEPS),
    Curve("Exudyn", "DOPRI5", "Exudyn DOPRI5", TOLERANCES),
)


class ContactPeers(Peers):
    """The simulators with contact; all but ours run in Python."""

    def missing(self) -> dict[str, str]:
        return {peer: f"Python cannot import {module}" for peer, module in PEERS.items() if not built.imports(self.python, module)}

    def _other(self, peer: str, scene: ContactScene) -> list:
        return [self.python, Path(__file__).parent / "peers" / "contact_peer.py", peer, scene.file]

    def _drake(self, scene: ContactScene) -> list:
        return self._other("Drake", scene)

    def _mujoco(self, scene: ContactScene) -> list:
        return self._other("MuJoCo", scene)

    def _exudyn(self, scene: ContactScene) -> list:
        return self._other("Exudyn", scene)


def error(scene: ContactScene, rows, curve: Curve) -> float:
    return scene.error(curve.peer, curve.method, rows)


def draw(results, folder: Path) -> None:
    figure, panels = plt.subplots(2, 2, figsize=(11, 8.4), layout="constrained")
    legend = {}
    for axes, (scene, points) in zip(panels.flat, results, strict=False):
        curves = dict.fromkeys(point.curve for point in points)
        best = [point for curve in curves for point in front([point for point in points if point.curve == curve])]
        plot(axes, scene, best, "position error, m")
        handles, labels = axes.get_legend_handles_labels()
        legend |= dict(zip(labels, handles, strict=True))
    figure.legend(legend.values(), legend.keys(), loc="outside lower center", ncol=5, frameon=False, fontsize=9)
    write_figure(figure, folder, "contact_scenes")


def main() -> None:
    options = curves_command_line(__doc__).parse_args()
    options.output.mkdir(parents=True, exist_ok=True)
    work = ROOT / "build" / "peers_work"
    peers = ContactPeers(options.programs, options.python, work)
    absent = peers.missing()
    for peer, reason in absent.items():
        print(f"{peer} is skipped: {reason}")
    results, records, loads = [], [], [os.getloadavg()[0]]
    for scene in scenes():
        if not re.search(options.filter, scene.name):
            continue
        print(f"{scene.name}: {scene.title}", flush=True)
        write(scene, work)
        chosen = [Curve("ReDySim-FMU", method, f"ReDySim-FMU, {method}", TOLERANCES) for method in scene.methods]
        chosen += [curve for curve in OTHERS if curve.peer not in absent]
        points, failures = compare(scene, peers, chosen, options.rounds, options.longest, 1, error)
        for line in failures:
            print(f"  {line}")
        for point in points:
            records.append([scene.name, point.curve.label, f"{point.value:g}", f"{point.error:.4g}", f"{point.median / scene.end:.6g}"])
        results.append((scene, points))
        loads.append(os.getloadavg()[0])
    draw(results, options.output)
    with (options.output / "contact.csv").open("w", newline="") as file:
        writer = csv.writer(file)
        writer.writerow(["scene", "method", "tolerance or steps", "error, m", "CPU time in s per simulated second"])
        writer.writerows(records)
    versions = ", ".join(f"{peer} {version}" for peer, version in peers.versions().items() if peer in PEERS and peer not in absent)
    head = f"{processor()}; {versions}; {medians(options.rounds)}, load average {min(loads):.1f} to {max(loads):.1f}.\n\n"
    (options.output / "contact_figures.md").write_text(head + "\n".join(table(scene, points) for scene, points in results))
    print(f"wrote contact_scenes.svg, contact_figures.md and contact.csv to {options.output}")


if __name__ == "__main__":
    main()
