"""The motion of a KUKA KR5 between two poses with the smallest torques, by collocation in CasADi.

A model-exchange FMU gives the accelerations and their exact derivatives. Its solver of co-simulation then plays the torques.
Requires `pip install casadi`.
"""

from pathlib import Path

import numpy as np
from fmi3_for_casadi import readable
from fmpy import extract, simulate_fmu
from ready import FOLDER, MODELS

from build_fmu.cli import main as build_fmu

try:
    import casadi as ca
except ImportError:
    raise SystemExit("mpc_casadi.py needs CasADi: pip install casadi") from None

JOINTS = [f"joint{i}" for i in range(1, 7)]
START, GOAL = np.zeros(6), np.array([0.8, 0.6, -0.9, 0.5, 0.7, 0.3])  # rad, at rest
SPEED, TORQUE = 6.0, np.array([400, 400, 200, 10, 5, 0.01])  # rad/s, N m, limits
STOP, INTERVALS, DEGREE = 0.8, 16, 5  # s, 1, 1; the torques are constant in an interval


def planned(arm: ca.Function) -> tuple[np.ndarray, float]:
    """Returns the torques of each interval, and the largest derivative of the Lagrangian, which should be 0."""
    slope = ca.collocation_coeff(ca.collocation_points(DEGREE, "radau"))[0]
    plan, size = ca.Opti(), arm.size1_in(0)
    x = plan.variable(size, INTERVALS * DEGREE + 1)  # q, qd, energy.work
    u = plan.variable(6, INTERVALS)
    scale = np.r_[np.ones(6), np.full(6, SPEED), np.full(size - 12, 100)]
    for k in range(INTERVALS):
        piece = x[:, k * DEGREE : (k + 1) * DEGREE + 1]
        rates = ca.horzcat(*(arm(piece[:, j], TORQUE * u[:, k]) for j in range(1, DEGREE + 1)))
        plan.subject_to(ca.vec((piece @ slope - STOP / INTERVALS * rates) / scale) == 0)
    plan.subject_to(x[:, 0] == np.pad(START, (0, size - 6)))
    plan.subject_to(x[:12, -1] == np.pad(GOAL, (0, 6)))
    plan.subject_to(plan.bounded(-1, ca.vec(x[6:12, :]) / SPEED, 1))
    plan.subject_to(plan.bounded(-1, ca.vec(u), 1))
    plan.minimize(STOP / INTERVALS * ca.sumsqr(u))
    plan.set_initial(x[:6, :], np.linspace(START, GOAL, x.shape[1]).T)
    # Gauss-Newton: the curvature of the cost alone
    weight, rows = ca.MX.sym("weight"), ca.MX.sym("rows", plan.g.numel())
    gauss = ca.Function("gauss", [plan.x, plan.p, weight, rows], [ca.triu(weight * ca.hessian(plan.f, plan.x)[0])])
    plan.solver("ipopt", {"hess_lag": gauss, "print_time": False}, {"tol": 1e-7, "print_level": 0, "sb": "yes"})
    solution = plan.solve()
    # one fmi3GetAdjointDerivative for each point; the solver itself uses directional derivatives
    lagrangian = ca.gradient(plan.f + ca.dot(plan.lam_g, plan.g), plan.x)
    return TORQUE[:, None] * solution.value(u), abs(solution.value(lagrangian)).max()


def main() -> None:
    FOLDER.mkdir(exist_ok=True)
    fmu = FOLDER / "kuka_kr5_fmi3.fmu"
    if build_fmu(["build", "--no-show", "--fmi", "3", str(MODELS / "kuka_kr5.toml"), "-o", str(fmu)]) != 0:
        raise SystemExit(1)
    dae = ca.DaeBuilder("arm", readable(Path(extract(fmu))), {"debug": False})
    torques, slope = planned(dae.create("arm", ["x", "u"], ["ode"]))
    print(f"adjoint derivative of the Lagrangian: {slope:.1e}")

    step = STOP / INTERVALS
    names = [("time", float), *((f"{joint}.tau", float) for joint in JOINTS)]
    inputs = np.array([(k * step, *torques[:, k]) for k in range(INTERVALS)], dtype=names)  # held for a step
    result = simulate_fmu(
        str(fmu),
        fmi_type="CoSimulation",
        stop_time=STOP,
        output_interval=step,
        input=inputs,
        start_values={"solver.rtol": 1e-9},
        output=[f"{joint}.{part}" for part in ("q", "qd") for joint in JOINTS],
    )
    error = [abs(result[f"{joint}.q"][-1] - goal) for joint, goal in zip(JOINTS, GOAL, strict=True)]
    speed = [abs(result[f"{joint}.qd"][-1]) for joint in JOINTS]
    print(f"co-simulation ends {max(error):.1e} rad from the goal, at {max(speed):.1e} rad/s")


if __name__ == "__main__":
    main()
