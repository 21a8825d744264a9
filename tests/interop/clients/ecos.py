"""Runs FMUs in Ecos: ecos.py JOB.json (see jobs.py)."""

import importlib.metadata

from ecospy import EcosSimulation, EcosSimulationStructure
from jobs import main


def run(job: dict) -> list[list[float]]:
    with EcosSimulationStructure() as structure:
        for name, file in job["fmus"].items():
            structure.add_model(name, file)
        for source, sink in job["connections"]:
            structure.make_real_connection("::".join(source), "::".join(sink))
        with EcosSimulation(structure=structure, step_size=job["step"]) as simulation:
            simulation.init()
            rows = []
            for k in range(job["steps"] + 1):
                if k:
                    simulation.step()
                rows.append([simulation.get_real("::".join(variable)) for variable in job["outputs"]])
            return rows


main(run, importlib.metadata.version("ecospy"))
