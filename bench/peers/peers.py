"""Simulators of the comparison, their methods, and the start of their processes."""

from __future__ import annotations

import argparse
import json
import os
import subprocess
import sys
import zipfile
from dataclasses import dataclass
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parent.parent))
import built
import mjcf
from bare import bare
from scenes import ROOT, Scene
from worker import Worker

HERE = Path(__file__).resolve().parent
# loose runs have few steps, and errors that scatter
TOLERANCES = (1e-1, 3e-2, 1e-2, 3e-3, 1e-3, 3e-4, *(10.0 ** (-k) for k in range(4, 13)))
FINER_TOLERANCES = (*TOLERANCES, 1e-13, 1e-14)  # of methods that are still above rounding there
TAYLOR_TOLERANCES = (1e-1, 1e-2, 1e-4, 1e-6, 1e-8, 1e-10, 1e-12, 1e-14)  # each is compiled for itself
LARGEST_FOR_SERIES = 7  # joints
CUTS = tuple(float(2**k) for k in range(14))


@dataclass(frozen=True)
class Curve:
    """A method of a simulator, and its tolerances or numbers of steps, coarse to fine."""

    peer: str
    method: str
    label: str
    values: tuple[float, ...]
    process: str = ""  # empty: that of the simulator

    @property
    def worker(self) -> str:
        return self.process or self.peer


def curves(scene: Scene) -> list[Curve]:
    """The suitable methods for the scene. docs/performance.md lists the limitations of the simulators."""
    found = [Curve("ReDySim-FMU", method, f"ReDySim-FMU, {method}", FINER_TOLERANCES) for method in scene.methods]
    smooth_tree = not (scene.has_loops or scene.stiff)
    own = method_of_library(scene)
    found += [Curve("specialised", own, f"ReDySim-FMU --specialise, {own}", FINER_TOLERANCES)]
    if smooth_tree and scene.joints <= LARGEST_FOR_SERIES:
        found += [Curve("specialised", "taylor", "ReDySim-FMU --specialise, taylor", FINER_TOLERANCES, "specialised-taylor")]
    if scene.stiff:
        found += [
            Curve("Pinocchio", "bdf", "Pinocchio + CVODE BDF", TOLERANCES),
            Curve("Pinocchio", "bdf_exact", "Pinocchio + CVODE BDF, derivatives", TOLERANCES),
            Curve("Pinocchio", "erk5", "Pinocchio + ARKODE ERK 5", TOLERANCES),
        ]
    else:
        found += [
            Curve("Pinocchio", "adams", "Pinocchio + CVODE Adams", TOLERANCES),
            Curve("Pinocchio", "erk5", "Pinocchio + ARKODE ERK 5", TOLERANCES),
            Curve("Pinocchio", "erk8", "Pinocchio + ARKODE ERK 8", TOLERANCES),
            Curve("Pinocchio", "erk8_stop", "Pinocchio + ARKODE ERK 8, stops", TOLERANCES),
        ]
    found += [Curve("MuJoCo", "RK4", "MuJoCo RK4", CUTS), Curve("MuJoCo", "implicitfast", "MuJoCo implicitfast", CUTS)]
    if scene.has_loops:
        found += [Curve("Drake", "sap", "Drake SAP", CUTS)]
    elif scene.stiff:
        found += [Curve("Drake", method, f"Drake {method}", TOLERANCES) for method in ("radau3", "implicit_euler", "runge_kutta3")]
    else:
        found += [Curve("Drake", method, f"Drake {method}", TOLERANCES) for method in ("runge_kutta3", "runge_kutta5")]
    if smooth_tree:
        found += [
            Curve("CasADi", "dense", "CasADi C + DOP853", FINER_TOLERANCES),
            Curve("CasADi", "stop", "CasADi C + DOP853, stops", FINER_TOLERANCES),
            Curve("heyoka", "taylor", "heyoka Taylor", TAYLOR_TOLERANCES),
        ]
    if not scene.has_loops:
        found += [
            Curve("Exudyn", "RK44", "Exudyn RK44", CUTS),
            Curve("Exudyn", "RK67", "Exudyn RK67", CUTS),
            Curve("Exudyn", "DOPRI5", "Exudyn DOPRI5", TOLERANCES),
        ]
    if scene.has_loops or scene.stiff:
        found += [
            Curve("Exudyn", "GeneralizedAlpha", "Exudyn generalized alpha", CUTS),
            Curve("Exudyn", "TrapezoidalIndex2", "Exudyn trapezoidal", CUTS),
        ]
    return found


def method_of_library(scene: Scene) -> str:
    """The only method of the library that is compiled for a scene."""
    return "bdf" if scene.stiff else "erk"


def command_line(doc: str) -> argparse.ArgumentParser:
    """Returns a parser with the options of every comparison; `doc` is the docstring of the script."""
    parser = argparse.ArgumentParser(description=doc.splitlines()[0])
    parser.add_argument("-o", "--output", type=Path, default=ROOT / "out" / "bench")
    parser.add_argument("--programs", type=Path, default=ROOT / "build" / "bench" / "bench" / "peers")
    parser.add_argument("--python", type=Path, default=built.PYTHON, help="Python interpreter of the simulators' environment")
    return parser


class Peers:
    """Starts the processes; `programs`: folder of the compiled runners, `python`: interpreter of the simulators' environment."""

    def __init__(self, programs: Path, python: Path, work: Path):
        self.programs, self.python, self.work = programs, python, work
        work.mkdir(parents=True, exist_ok=True)

    def missing(self) -> dict[str, str]:
        """Simulators that are not available, with the reason."""
        found = {}
        for peer, program in (("Pinocchio", "pinocchio_runner"), ("MuJoCo", "mujoco_runner")):
            if not (self.programs / program).exists():
                found[peer] = f"{program} was not built, its PyPI package is not installed"
        for peer, module in (("Drake", "pydrake"), ("Exudyn", "exudyn"), ("CasADi", "casadi, scipy"), ("heyoka", "heyoka")):
            if not built.imports(self.python, module):
                found[peer] = f"Python cannot import {module}"
        return found

    def versions(self) -> dict[str, str]:
        """{peer: version}, from the installed packages."""
        code = "import importlib.metadata as m, json; print(json.dumps({d.metadata['Name'].lower(): d.version for d in m.distributions()}))"
        if not self.python.exists():
            return {}
        installed = json.loads(subprocess.run([self.python, "-c", code], capture_output=True, text=True, check=True).stdout)
        names = {"Pinocchio": "pin", "MuJoCo": "mujoco", "Drake": "drake", "Exudyn": "exudyn", "CasADi": "casadi", "heyoka": "heyoka"}
        return {peer: installed[name] for peer, name in names.items() if name in installed}

    def start(self, peer: str, scene: Scene) -> Worker:
        command = getattr(self, f"_{peer.lower().replace('-', '_')}")(scene)
        return Worker(command, str(self.work / f"{scene.name}_{peer}.log"))

    def _file(self, scene: Scene) -> Path:
        file = self.work / f"{scene.name}.json"
        file.write_text(json.dumps(scene.data), encoding="utf-8")
        return file

    def _redysim_fmu(self, scene: Scene, method: str = "") -> list:
        # the other simulators do not integrate the work
        folder = self.work / "-".join(filter(None, ("bare", method)))
        folder.mkdir(exist_ok=True)
        model = bare(scene.model, folder, ("solver",), method)
        options = ["--specialise"] if method else []
        return fmu_command(self.programs / "fmu_runner", model, folder, scene.rows, scene.step, scene.torques, *options)

    def _specialised(self, scene: Scene) -> list:
        return self._redysim_fmu(scene, method_of_library(scene))

    def _specialised_taylor(self, scene: Scene) -> list:
        return self._redysim_fmu(scene, "taylor")

    def _pinocchio(self, scene: Scene) -> list:
        file = self.work / f"{scene.name}.txt"
        file.write_text(scene.text())
        return [self.programs / "pinocchio_runner", file]

    def _mujoco(self, scene: Scene) -> list:
        file = self.work / f"{scene.name}.xml"
        file.write_text(mjcf.write(scene, scene.step / CUTS[-1]))
        return [self.programs / "mujoco_runner", file, scene.rows, repr(scene.step), *map(repr, scene.torques)]

    def _drake(self, scene: Scene) -> list:
        return [self.python, HERE / "drake_peer.py", self._file(scene)]

    def _exudyn(self, scene: Scene) -> list:
        return [self.python, HERE / "exudyn_peer.py", self._file(scene)]

    def _heyoka(self, scene: Scene) -> list:
        return [self.python, HERE / "heyoka_peer.py", self._file(scene)]

    def _casadi(self, scene: Scene) -> list:
        folder = self.work / f"{scene.name}_generated"
        subprocess.run([self.python, HERE / "generated.py", self._file(scene), folder, os.environ.get("CXX", "c++")], check=True)
        return [folder / f"dop853_{scene.name}", scene.rows, repr(scene.step)]


def fmu_command(runner: Path, model: Path, work: Path, rows: int, step: float, torques: list[float], *options: str) -> list:
    """Builds the model's FMU with options of `build-fmu build`, unpacks it and returns the command line of fmu_runner."""
    built.existing(runner)
    archive = work / f"{model.stem}.fmu"
    build = [sys.executable, "-m", "build_fmu", "build", model, "-o", archive, *options]
    subprocess.run(build, cwd=ROOT, check=True, stdout=subprocess.DEVNULL)
    folder = work / model.stem
    with zipfile.ZipFile(archive) as opened:
        opened.extractall(folder)
    from fmpy import read_model_description

    description = read_model_description(archive)
    at = {variable.name: variable for variable in description.modelVariables}
    library = folder / "binaries" / "linux64" / f"{description.coSimulation.modelIdentifier}.so"
    solver = [at[f"solver.{name}"].valueReference for name in ("method", "rtol", "atol", "rhs_evaluations")]
    outputs = [v.valueReference for v in description.modelVariables if v.causality == "output" and v.name.endswith(".q")]
    joints = [v.name[:-2] for v in description.modelVariables if v.causality == "output" and v.name.endswith(".q")]
    inputs = [(at[f"{joint}.tau"].valueReference, torque) for joint, torque in zip(joints, torques, strict=False) if f"{joint}.tau" in at]
    command = [runner, library, (folder / "resources").as_uri(), description.guid, rows, repr(step), *solver]
    return [*command, len(outputs), *outputs, len(inputs), *(word for vr, torque in inputs for word in (vr, repr(torque)))]
