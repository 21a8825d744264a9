"""Puts one FMU into an FMU container and runs that in FMPy: container.py JOB.json (see jobs.py)."""

import importlib.metadata
import json
import subprocess
import sys
import tempfile
from pathlib import Path

from fmpy import simulate_fmu
from jobs import main


def run(job: dict) -> list[list[float]]:
    ((_, file),) = job["fmus"].items()
    fmu = Path(file)
    with tempfile.TemporaryDirectory() as folder:
        description = {
            "name": "container.fmu",
            "fmu": [fmu.name],
            "step_size": job["step"],
            "auto_link": True,
            "auto_input": True,
            "auto_output": True,
        }
        (Path(folder) / "container.json").write_text(json.dumps(description))
        program = Path(sys.executable).with_name("fmucontainer")
        made = subprocess.run(
            [program, "-fmu-directory", fmu.parent, "-container", Path(folder) / "container.json"],
            capture_output=True,
            text=True,
            cwd=folder,
        )
        found = [*Path(folder).rglob("container.fmu"), *fmu.parent.glob("container.fmu")]
        if not found:
            raise RuntimeError(made.stdout + made.stderr)
        names = [variable for _, variable in job["outputs"]]
        result = simulate_fmu(
            str(found[0]), output=names, output_interval=job["step"], stop_time=job["steps"] * job["step"], step_size=job["step"]
        )
        return [[float(row[name]) for name in names] for row in result]


main(run, importlib.metadata.version("fmu_manipulation_toolbox"))
