"""The masters: each runs an .ssp file and returns the watched values at t = 0, step, 2 step, ….

All of them step the FMUs in parallel (Jacobi scheme): the inputs of a step are the outputs at its start. Each runs in a separate process:

python masters.py NAME JOB.json ANSWER.json

A job contains `ssp` (the file), `step` in s, `steps` and `watched`, a list of [element, variable].
"""

from __future__ import annotations

import ctypes
import importlib.metadata
import importlib.util
import json
import math
import subprocess
import sys
import sysconfig
import tempfile
import time
from collections.abc import Sequence
from dataclasses import asdict, dataclass
from pathlib import Path

import numpy as np
from system import unpack


@dataclass
class Job:
    ssp: str
    step: float
    steps: int
    watched: Sequence[tuple[str, str]]


def fmpy(job: Job) -> list[list[float]]:
    """A loop over the FMUs in FMPy, with the connections of the system description."""
    from fmpy import extract, instantiate_fmu, read_model_description
    from fmpy.ssp.ssd import read_ssd

    folder = tempfile.mkdtemp()
    unpack(Path(job.ssp), Path(folder))
    system = read_ssd(job.ssp).system
    fmus, number = {}, {}
    for component in system.elements:
        archive = str(Path(folder) / component.source)
        description = read_model_description(archive)
        fmus[component.name] = instantiate_fmu(extract(archive), description, "CoSimulation")
        number |= {(component.name, variable.name): variable.valueReference for variable in description.modelVariables}
    wires = [((c.startElement, c.startConnector), (c.endElement, c.endConnector)) for c in system.connections]

    def get(element: str, name: str) -> float:
        fmu = fmus[element]
        return (fmu.getFloat64 if hasattr(fmu, "getFloat64") else fmu.getReal)([number[element, name]])[0]

    def transfer() -> None:
        values = [get(*source) for source, _ in wires]
        for value, (_, sink) in zip(values, wires, strict=True):
            fmu = fmus[sink[0]]
            (fmu.setFloat64 if hasattr(fmu, "setFloat64") else fmu.setReal)([number[sink]], [value])

    for fmu in fmus.values():
        if hasattr(fmu, "setupExperiment"):  # FMI 2.0
            fmu.setupExperiment(startTime=0)
        fmu.enterInitializationMode()
    transfer()
    for fmu in fmus.values():
        fmu.exitInitializationMode()
    transfer()
    rows = [[get(*variable) for variable in job.watched]]
    for step in range(job.steps):
        for fmu in fmus.values():
            fmu.doStep(step * job.step, job.step)
        transfer()
        rows.append([get(*variable) for variable in job.watched])
    for fmu in fmus.values():
        fmu.terminate()
        fmu.freeInstance()
    return rows


def ecospy(job: Job) -> list[list[float]]:
    # Ecos needs oneTBB, which is missing in its package; `tbb` from PyPI contains it
    for file in (Path(sysconfig.get_path("data")) / "lib").glob("libtbb.so*"):
        ctypes.CDLL(str(file), mode=ctypes.RTLD_GLOBAL)
    from ecospy import EcosSimulation

    with EcosSimulation(step_size=job.step, ssp_path=job.ssp) as simulation:
        if not simulation.init():
            raise RuntimeError("Ecos could not initialise the system")
        rows = []
        for step in range(job.steps + 1):
            if step:
                simulation.step()
            rows.append([simulation.get_real(f"{element}::{name}") for element, name in job.watched])
        return rows


def libcosimpy(job: Job) -> list[list[float] | None]:
    from libcosimpy.CosimEnums import CosimVariableType
    from libcosimpy.CosimExecution import CosimExecution
    from libcosimpy.CosimObserver import CosimObserver

    with tempfile.TemporaryDirectory() as folder:
        # time resolution of 1 ns
        execution = CosimExecution.from_ssp_file(str(unpack(Path(job.ssp), Path(folder))), round(job.step * 1e9))
        observer = CosimObserver.create_last_value()
        execution.add_observer(observer)
        index = {name: execution.slave_index_from_instance_name(name) for name in {element for element, _ in job.watched}}
        number = {
            (name, variable.name.decode()): variable.reference
            for name, slave in index.items()
            for variable in execution.slave_variables(slave)
            if variable.type == CosimVariableType.REAL.value
        }
        rows: list[list[float] | None] = [None]  # the observer has no values before the first step
        for step in range(job.steps):
            if not execution.step():
                raise RuntimeError(f"step {step} failed")
            rows.append([observer.last_real_values(index[name], [number[name, variable]])[0] for name, variable in job.watched])
        return rows


MASTERS = {"fmpy": fmpy, "ecospy": ecospy, "libcosimpy": libcosimpy}
NAMES = {"fmpy": "FMPy", "ecospy": "Ecos", "libcosimpy": "libcosim"}


def run(master: str, job: Job) -> dict | None:
    """Runs one master in a separate process; returns its version, its rows and its wall-clock time."""
    if importlib.util.find_spec(master) is None:
        print(f"{NAMES[master]} is omitted; to install it: `pip install {master}`")
        return None
    answer, order = (Path(job.ssp).with_name(f"{master}{ending}.json") for ending in ("", "_job"))
    answer.unlink(missing_ok=True)
    order.write_text(json.dumps(asdict(job)))
    done = subprocess.run([sys.executable, __file__, master, str(order), str(answer)], capture_output=True, text=True)
    if done.returncode != 0 or not answer.exists():
        print(f"{NAMES[master]} failed: {(done.stderr or done.stdout).strip().splitlines()[-1:]}")
        return None
    told = json.loads(answer.read_text())
    told["rows"] = np.array([row or [math.nan] * len(job.watched) for row in told["rows"]])
    return told


if __name__ == "__main__":
    name, order, answer = sys.argv[1:]
    begin = time.perf_counter()
    rows = MASTERS[name](Job(**json.loads(Path(order).read_text())))
    Path(answer).write_text(json.dumps({"version": importlib.metadata.version(name), "seconds": time.perf_counter() - begin, "rows": rows}))
