"""Runs FMUs in libcosim: cosim.py JOB.json (see jobs.py)."""

import importlib.metadata

from jobs import main
from libcosimpy.CosimEnums import CosimVariableType
from libcosimpy.CosimExecution import CosimExecution
from libcosimpy.CosimObserver import CosimObserver
from libcosimpy.CosimSlave import CosimLocalSlave


def run(job: dict) -> list[list[float]]:
    # its clock counts nanoseconds
    execution = CosimExecution.from_step_size(step_size=round(job["step"] * 1e9))
    index, reference, slaves = {}, {}, []
    for name, file in job["fmus"].items():
        slaves.append(CosimLocalSlave(fmu_path=file, instance_name=name))
        index[name] = execution.add_local_slave(slaves[-1])
        for variable in execution.slave_variables(index[name]):
            if variable.type == CosimVariableType.REAL.value:
                reference[name, variable.name.decode()] = variable.reference
    for source, sink in job["connections"]:
        execution.connect_real_variables(index[source[0]], reference[tuple(source)], index[sink[0]], reference[tuple(sink)])
    observer = CosimObserver.create_last_value()
    execution.add_observer(observer)
    rows = []
    for k in range(job["steps"] + 1):
        if k and not execution.step():
            raise RuntimeError(f"step {k} failed")
        rows.append([observer.last_real_values(index[name], [reference[name, variable]])[0] for name, variable in job["outputs"]])
    rows[0] = None  # it reads the first outputs after the first step
    return rows


main(run, importlib.metadata.version("libcosimpy"))
