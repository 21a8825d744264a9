"""A robot with drives and a controller as one .ssp file, run by several masters; two FMUs are built by PythonFMU.

python examples/cosimulation/run.py [-o out/cosimulation]

Needs `pip install 'build-fmu[cosimulation]'`; masters that are not installed are omitted. Prints a table and writes cosimulation.png.
"""

from __future__ import annotations

import argparse
import importlib.util
import sys
from pathlib import Path

import matplotlib
import numpy as np

matplotlib.use("Agg")
from masters import MASTERS, NAMES, Job, run
from matplotlib import pyplot
from system import JOINTS, STEP, STOP, connections, make_fmus, pack, watched

STYLES = {"fmpy": {"linewidth": 3, "alpha": 0.35}, "ecospy": {"linestyle": "--"}, "libcosimpy": {"linestyle": ":", "linewidth": 2}}


def table(results: dict[str, dict]) -> None:
    """Prints the difference of each master from the loop in FMPy, and the tracking error."""
    columns = watched()
    q, reference = (
        [columns.index((element, f"{joint}.{kind}")) for joint in JOINTS] for element, kind in (("arm", "q"), ("controller", "reference"))
    )
    base = results["fmpy"]["rows"]
    print("master      version   joints and torques, maximum difference from FMPy   tracking error [rad]   time [s]")
    for name, told in results.items():
        rows = told["rows"]
        error = np.nanmax(np.abs(rows[:, q] - rows[:, reference]))
        print(f"{NAMES[name]:<11} {told['version']:<9} {np.nanmax(np.abs(rows - base)):<54.1e} {error:<22.4f} {told['seconds']:.1f}")


def draw(results: dict[str, dict], target: Path) -> None:
    """Draws two joints and their drives, all masters in the same plots."""
    columns = watched()
    figure, axes = pyplot.subplots(2, 2, sharex=True, figsize=(10, 6), layout="constrained")
    for side, joint in enumerate(("joint2", "joint3")):
        for row, (element, kind, said) in enumerate((("arm", "q", "position, rad"), ("drive", "torque", "torque of the drive, N m"))):
            ax, k = axes[row, side], columns.index((element, f"{joint}.{kind}"))
            for name, told in results.items():
                ax.plot(np.arange(len(told["rows"])) * STEP, told["rows"][:, k], label=NAMES[name], **STYLES[name])
            ax.set(title=joint if row == 0 else "", ylabel=said, xlabel="time, s" if row else "")
            ax.grid(alpha=0.3)
    axes[0, 0].legend()
    figure.savefig(target, dpi=120)


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("-o", "--output", type=Path, default=Path("out/cosimulation"), metavar="DIR", help="folder to write into")
    folder = parser.parse_args().output.resolve()
    if importlib.util.find_spec("pythonfmu") is None:
        print("PythonFMU is required for the controller and the drive: `pip install 'build-fmu[cosimulation]'`", file=sys.stderr)
        return 1
    ssp = folder / "kuka_kr5.ssp"
    pack(ssp, make_fmus(folder), connections(), watched(), STOP)
    job = Job(str(ssp), STEP, round(STOP / STEP), watched())
    results = {name: told for name in MASTERS if (told := run(name, job)) is not None}
    if "fmpy" not in results:
        return 1
    table(results)
    draw(results, folder / "cosimulation.png")
    print(f"{ssp}\n{folder / 'cosimulation.png'}")
    return 0


if __name__ == "__main__":
    raise SystemExit(main())
