"""Integrates a model-exchange FMU in CasADi, with exact Jacobians, from the states `start` of the job: daebuilder.py JOB.json (see jobs.py)."""

import sys
from pathlib import Path

import casadi
from fmpy import extract
from jobs import main

sys.path.insert(0, str(Path(__file__).parents[3] / "examples"))
from fmi3_for_casadi import readable


def run(job: dict) -> list[list[float]]:
    ((name, file),) = job["fmus"].items()
    dae = casadi.DaeBuilder(name, readable(Path(extract(file))), {"debug": False})
    slopes = dae.create("slopes", ["x", "u"], ["ode"])
    x, u = (casadi.MX.sym(kind, slopes.size1_in(kind)) for kind in ("x", "u"))
    options = {"reltol": 1e-11, "abstol": 1e-12, "max_num_steps": 10**6}
    times = [k * job["step"] for k in range(job["steps"] + 1)]
    solver = casadi.integrator("solver", "cvodes", {"x": x, "u": u, "ode": slopes(x, u)}, 0, times, options)
    states = solver(x0=[job["start"].get(state, 0) for state in dae.x()])["xf"]
    return [[float(states[dae.x().index(output), k]) for _, output in job["outputs"]] for k in range(len(times))]


main(run, casadi.__version__)
