"""Two arms that hold each other by a pad: ports connected by their terminals, as one .ssp file, run by several masters.

python examples/cosimulation/ports.py [-o out/ports]

The arms are FMUs of FMI 3.0; each has a terminal of force, motion and power. The pad is a spring-damper made with PythonFMU. Prints the
difference of each master from the loop in FMPy, and the energy that the coupling adds: the power of both ports is that of the pad, with
opposite sign, if the coupling is exact.
"""

from __future__ import annotations

import argparse
import subprocess
import sys
import xml.etree.ElementTree as ET
from pathlib import Path
from zipfile import ZipFile

import fmpy
import numpy as np
from masters import MASTERS, NAMES, Job, run
from system import Wire, pack

from build_fmu.cli import main as build_fmu

HERE = Path(__file__).parent
STEP, STOP = 0.001, 1.0  # s
LINK = """
[[link]]
name = "upper"
a = {base}
mass = 2
com = [0.15, 0, 0]
inertia = [0.001, 0.02, 0.02]
q = {upper}
stiffness = 40
rest = {upper}
[[link]]
name = "lower"
a = 0.3
mass = {mass}
com = [0.15, 0, 0]
inertia = [0.001, 0.01, 0.01]
q = {lower}
stiffness = 40
rest = {lower}
"""
PORT = """
[[frame]]
name = "tip"
link = "lower"
position = [0.3, 0, 0]
port = "ground"
outputs = ["pose", "velocity", "acceleration", "power"]
"""
# both tips start at the same point
ARMS = {
    "left": {"base": 0, "upper": 0.6, "lower": -1.2, "mass": 1},
    "right": {"base": 0.990403, "upper": 2.5415927, "lower": 1.2, "mass": 3},
}
HEAD = 'name = "{}"\ngravity = [0, -9.81, 0]\n[solver]\nrtol = 1e-9\natol = 1e-11\n'
# (element, terminal) of each arm and the terminal of the pad
LINKS = [(("left", "tip"), ("pad", "a")), (("right", "tip"), ("pad", "b"))]
WATCHED = [("left", "tip.power"), ("right", "tip.power"), ("pad", "energy"), ("pad", "loss")]
WATCHED += [(arm, f"tip.position[{i}]") for arm in ARMS for i in (1, 2)]


def make_fmus(folder: Path) -> dict[str, Path]:
    """Builds both arms and the pad."""
    folder.mkdir(parents=True, exist_ok=True)
    for name, numbers in ARMS.items():
        model = folder / f"{name}.toml"
        model.write_text(HEAD.format(name) + LINK.format(**numbers) + PORT)
        if build_fmu(["build", "--no-show", "--fmi", "3", str(model), "-o", str(folder)]) != 0:
            raise SystemExit(1)
    subprocess.run([sys.executable, "-m", "pythonfmu", "build", "-f", HERE / "pad.py", "-d", folder], check=True)
    return {name: folder / file for name, file in {"left": "left.fmu", "right": "right.fmu", "pad": "Pad.fmu"}.items()}


def members(fmu: Path, terminal: str) -> dict[str, str]:
    """The members of a terminal and their variables. Without a list of terminals, the variables `<terminal>.<member>` are it."""
    with ZipFile(fmu) as archive:
        if "terminalsAndIcons/terminalsAndIcons.xml" in archive.namelist():
            root = ET.fromstring(archive.read("terminalsAndIcons/terminalsAndIcons.xml"))
            found = root.find(f"Terminals/Terminal[@name='{terminal}']")
            return {member.get("memberName"): member.get("variableName") for member in found}
    names = [variable.name for variable in fmpy.read_model_description(str(fmu)).modelVariables]
    return {name.removeprefix(f"{terminal}."): name for name in names if name.startswith(f"{terminal}.")}


def connect(fmus: dict[str, Path]) -> list[Wire]:
    """Connects terminals: the members of one name, from the output to the input, as the matching rule `bus` has it."""
    causality = {
        (element, variable.name): variable.causality
        for element, fmu in fmus.items()
        for variable in fmpy.read_model_description(str(fmu)).modelVariables
    }
    wires = []
    for (a, port_a), (b, port_b) in LINKS:
        of_a, of_b = members(fmus[a], port_a), members(fmus[b], port_b)
        for member in of_a.keys() & of_b.keys():
            ends = (a, of_a[member]), (b, of_b[member])
            wires.append(ends if causality[ends[0]] == "output" else ends[::-1])
    return sorted(wires)


def added_energy(rows: np.ndarray) -> float:
    """Returns work of both ports and loss of the damper plus change of the spring's energy, J (trapezoidal rule); 0 if they agree."""
    left, right, energy, loss = rows[1:, :4].T  # the pad answers after the first step
    rate = left + right + loss
    return float(STEP * (rate.sum() - (rate[0] + rate[-1]) / 2) + energy[-1] - energy[0])


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("-o", "--output", type=Path, default=Path("out/ports"), metavar="DIR", help="folder to write into")
    folder = parser.parse_args().output.resolve()
    fmus = make_fmus(folder)
    ssp, wires = folder / "ports.ssp", connect(fmus)
    pack(ssp, fmus, wires, WATCHED, STOP)
    job = Job(str(ssp), STEP, round(STOP / STEP), WATCHED)
    results = {name: told for name in MASTERS if name != "libcosimpy" and (told := run(name, job)) is not None}  # libcosim: FMI 2.0 only
    if "fmpy" not in results:
        return 1
    print(f"{len(wires)} connections of {len(LINKS)} pairs of terminals")
    print("master      version   maximum difference from FMPy   energy added [J]   largest power [W]")
    for name, told in results.items():
        rows = told["rows"]
        difference = np.abs(rows - results["fmpy"]["rows"]).max()
        print(f"{NAMES[name]:<11} {told['version']:<9} {difference:<30.1e} {added_energy(rows):<18.2e} {np.abs(rows[:, :2]).max():.1f}")
    return 0


if __name__ == "__main__":
    raise SystemExit(main())
