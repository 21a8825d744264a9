"""The masters: each runs an .ssp file and returns the watched values at t = 0, STEP, 2 STEP, ….

All of them step the FMUs in parallel (Jacobi scheme): the inputs of a step are the outputs at its start. Each runs in a separate process:

python masters.py NAME SYSTEM.ssp ANSWER.json
"""

from __future__ import annotations

import ctypes
import importlib.metadata
import json
import sys
import sysconfig
import tempfile
import time
from pathlib import Path

from system import STEP, STOP, unpack, watched

STEPS = round(STOP / STEP)


def fmpy(ssp: Path) -> list[list[float]]:
    """A loop over the FMUs in FMPy, with the connections of the system description."""
    from fmpy import extract, instantiate_fmu, read_model_description
    from fmpy.ssp.ssd import read_ssd

    folder = tempfile.mkdtemp()
    unpack(ssp, folder)
    system = read_ssd(str(ssp)).system
    fmus, number = {}, {}
    for component in system.elements:
        archive = str(Path(folder) / component.source)
        description = read_model_description(archive)
        fmus[component.name] = instantiate_fmu(extract(archive), description, "CoSimulation")
        number |= {(component.name, variable.name): variable.valueReference for variable in description.modelVariables}
    wires = [((c.startElement, c.startConnector), (c.endElement, c.endConnector)) for c in system.connections]

    def get(element: str, name: str) -> float:
        return fmus[element].getReal([number[element, name]])[0]

    def transfer() -> None:
        values = [get(*source) for source, _ in wires]
        for value, (_, sink) in zip(values, wires, strict=True):
            fmus[sink[0]].setReal([number[sink]], [value])

    for fmu in fmus.values():
        fmu.setupExperiment(startTime=0, stopTime=STOP)
        fmu.enterInitializationMode()
    transfer()
    for fmu in fmus.values():
        fmu.exitInitializationMode()
    transfer()
    rows = [[get(*variable) for variable in watched()]]
    for step in range(STEPS):
        for fmu in fmus.values():
            fmu.doStep(step * STEP, STEP)
        transfer()
        rows.append([get(*variable) for variable in watched()])
    for fmu in fmus.values():
        fmu.terminate()
        fmu.freeInstance()
    return rows


def ecospy(ssp: Path) -> list[list[float]]:
    # Ecos needs oneTBB, which is missing in its package; `tbb` from PyPI contains it
    for file in (Path(sysconfig.get_path("data")) / "lib").glob("libtbb.so*"):
        ctypes.CDLL(str(file), mode=ctypes.RTLD_GLOBAL)
    from ecospy import EcosSimulation

    with EcosSimulation(step_size=STEP, ssp_path=str(ssp)) as simulation:
        if not simulation.init():
            raise RuntimeError("Ecos could not initialise the system")
        rows = []
        for step in range(STEPS + 1):
            if step:
                simulation.step()
            rows.append([simulation.get_real(f"{element}::{name}") for element, name in watched()])
        return rows


def libcosimpy(ssp: Path) -> list[list[float] | None]:
    from libcosimpy.CosimEnums import CosimVariableType
    from libcosimpy.CosimExecution import CosimExecution
    from libcosimpy.CosimObserver import CosimObserver

    with tempfile.TemporaryDirectory() as folder:
        # time resolution of 1 ns
        execution = CosimExecution.from_ssp_file(str(unpack(ssp, Path(folder))), round(STEP * 1e9))
        observer = CosimObserver.create_last_value()
        execution.add_observer(observer)
        index = {name: execution.slave_index_from_instance_name(name) for name in {element for element, _ in watched()}}
        number = {
            (name, variable.name.decode()): variable.reference
            for name, slave in index.items()
            for variable in execution.slave_variables(slave)
            if variable.type == CosimVariableType.REAL.value
        }
        rows: list[list[float] | None] = [None]  # the observer has no values before the first step
        for step in range(STEPS):
            if not execution.step():
                raise RuntimeError(f"step {step} failed")
            rows.append([observer.last_real_values(index[name], [number[name, variable]])[0] for name, variable in watched()])
        return rows


MASTERS = {"fmpy": fmpy, "ecospy": ecospy, "libcosimpy": libcosimpy}

if __name__ == "__main__":
    name, ssp, answer = sys.argv[1:]
    begin = time.perf_counter()
    rows = MASTERS[name](Path(ssp))
    Path(answer).write_text(json.dumps({"version": importlib.metadata.version(name), "seconds": time.perf_counter() - begin, "rows": rows}))
