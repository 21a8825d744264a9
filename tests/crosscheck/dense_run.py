"""Trajectories and drive torques of a model file by the dense formulation: results of an independent program for tests/fmi/redysim_cases.py.

    python -m tests.crosscheck.dense_run       prints every figure again, about five minutes

Accelerations are those of `dense_motion` in long doubles, integrated by SciPy's DOP853, or Radau if stiff. Positions and velocities are moved to the loop
constraints at each output time. Nothing of the C++ core is used.
"""

from __future__ import annotations

import tomllib
from collections.abc import Callable, Iterable
from math import cos, pi, sin
from pathlib import Path

import numpy as np
from scipy.integrate import solve_ivp

from build_fmu.run.expressions import compile_expression
from tests.crosscheck.dense_motion import Dense
from tests.fmi.redysim_cases import Case
from tests.fmi.redysim_dense_cases import DENSE_CASES

MODELS = Path(__file__).resolve().parents[2] / "models"
Law = Callable[[float, np.ndarray, np.ndarray], np.ndarray]


class Run:
    """A model without its trajectories and controller: `law(t, q, qd)` gives the generalised forces. Quaternions are part of q."""

    def __init__(self, name: str, law: Law | None = None, inverse: bool = False) -> None:
        file = tomllib.loads((MODELS / f"{name}.toml").read_text(encoding="utf-8"))
        self.courses, self.gains = file.pop("trajectory", []), file.get("controller", {})
        self.dense, self.law = Dense(file | {"inverse": inverse}), law
        self.dofs = self.dense.scene.dofs
        self.names = [dof.name for dof in self.dofs]
        links = self.dense.scene.links
        self.free = [k for k, dof in enumerate(self.dofs) if not links[dof.link].table.get("hold")]
        start = self.dense.scene.start()
        self.places: list[tuple[str, slice]] = []  # of the positions
        count = 0
        for dof in self.dofs:
            if not dof.part:  # None, or the first of a ball
                size = 1 if dof.part is None else 4
                self.places.append((dof.variable("q") if size == 1 else f"{dof.joint}.quaternion", slice(count, count + size)))
                count += size
        self.q = np.concatenate([np.atleast_1d(start[name]).astype(float) for name, _ in self.places])
        self.qd = np.array(
            [float(start[dof.variable("qd")] if dof.part is None else start[f"{dof.joint}.omega"][dof.part]) for dof in self.dofs]
        )

    def solve(self, q: np.ndarray, qd: np.ndarray, inputs: dict[str, float]):
        state = {name: q[place] if place.stop - place.start > 1 else q[place.start] for name, place in self.places}
        for dof, x in zip(self.dofs, qd, strict=True):
            if dof.part is None:
                state[dof.variable("qd")] = x
            else:
                state.setdefault(f"{dof.joint}.omega", [0, 0, 0])[dof.part] = x
        return self.dense.solve(state, inputs)

    def rate(self, q: np.ndarray, qd: np.ndarray) -> np.ndarray:
        """Derivative of q: omega is in axes of the body."""
        rate, k = np.empty(len(q)), 0
        for _, place in self.places:
            if place.stop - place.start == 1:
                rate[place], k = qd[k], k + 1
                continue
            (w, x, y, z), (a, b, c) = q[place], qd[k : k + 3]
            rate[place] = np.array([-x * a - y * b - z * c, w * a + y * c - z * b, w * b + z * a - x * c, w * c + x * b - y * a]) / 2
            k += 3
        return rate

    def slope(self, t: float, state: np.ndarray) -> np.ndarray:
        q, qd = np.split(state, [len(self.q)])
        tau = self.law(t, q, qd) if self.law else np.zeros(len(qd))
        qdd = self.solve(q, qd, {dof.variable("tau"): x for dof, x in zip(self.dofs, tau, strict=True)}).qdd
        return np.concatenate([self.rate(q, qd), qdd.astype(float)])

    def closed(self, q: np.ndarray, qd: np.ndarray, free: Iterable[int] = ()) -> tuple[np.ndarray, np.ndarray]:
        """Moves `free` joints (default: all) to the loop constraints by the smallest correction. No quaternions."""
        q, qd = q.copy(), qd.copy()
        moves = list(free) or list(range(len(qd)))
        for _ in range(8 if "loop" in self.dense.scene.file else 0):
            rows = self.solve(q, qd, {}).rows
            J = rows.J.astype(float)
            q[moves] -= np.linalg.lstsq(J[:, moves], rows.phi.astype(float), rcond=1e-10)[0]
            qd[moves] -= np.linalg.lstsq(J[:, moves], J @ qd, rcond=1e-10)[0]
            if np.abs(rows.phi).max() < 1e-15:
                break
        return q, qd

    def until(self, times: Iterable[float], rtol: float = 1e-11, method: str = "DOP853") -> dict[float, tuple[np.ndarray, np.ndarray]]:
        """Positions and velocities at the times."""
        found, t = {}, 0.0
        q, qd = self.closed(self.q, self.qd, self.free)
        for end in times:
            run = solve_ivp(self.slope, (t, end), np.concatenate([q, qd]), method, rtol=rtol, atol=rtol / 100)
            t, (q, qd) = end, self.closed(*np.split(run.y[:, -1], [len(q)]))
            found[end] = q, qd
        return found

    def torques(self, q: np.ndarray, qd: np.ndarray, qdd: dict[str, float]) -> list[float]:
        """Forces of the prescribed joints for their accelerations; needs `inverse`."""
        motion = self.solve(q, qd, {f"{name}.qdd": x for name, x in qdd.items()})
        force = motion.force - motion.rows.J.T @ motion.multipliers
        return [float(force[self.names.index(name)]) for name in qdd]


def cycloid(first: np.ndarray, last: np.ndarray, duration: float, t: float) -> tuple[np.ndarray, np.ndarray]:
    """ReDySim's joint trajectory: position and velocity."""
    rise, w = (last - first) / duration, 2 * pi / duration
    t = min(t, duration)
    return first + rise * (t - sin(w * t) / w), rise * (1 - cos(w * t))


def forces(run: Run, case: Case) -> Law:
    """Torques of a case: its inputs, springs and dampers in joints, and the file's PD control along cycloids."""
    positions = {name: place.start for name, place in run.places}
    inputs = {run.names.index(name.removesuffix(".tau")): compile_expression(text) for name, text in case.inputs.items()}
    joints = [(k, positions[f"{name}.q"], name) for k, name in enumerate(run.names) if f"{name}.q" in positions]
    courses = [(k, at, table) for k, at, name in joints for table in run.courses if table["joint"] == name]
    first = run.q.copy()

    def law(t: float, q: np.ndarray, qd: np.ndarray) -> np.ndarray:
        tau = np.zeros(len(qd))
        for k, at, name in joints:
            stiffness, rest, damping = (float(case.start.get(f"{name}.{key}", 0)) for key in ("stiffness", "rest", "damping"))
            tau[k] = stiffness * (rest - q[at]) - damping * qd[k]
        for k, expression in inputs.items():
            tau[k] += expression(t)
        for k, at, table in courses:
            q_r, qd_r = cycloid(first[at], table["to"], table["duration"], t)
            tau[k] += run.gains["kp"] * (q_r - q[at]) + run.gains["kd"] * (qd_r - qd[k])
        return tau

    return law


def inverse(run: Run, case: Case, time: float, steps: int = 12) -> dict[str, float]:
    """Drive torques of a case at a time; the loops follow the driven joints from the start."""
    inputs = {name: compile_expression(text) for name, text in case.inputs.items()}
    driven = list(dict.fromkeys(name.rpartition(".")[0] for name in inputs))
    moves = [run.names.index(name) for name in driven]
    q, qd = run.q.copy(), np.zeros(len(run.qd))
    for name, value in case.start.items():
        q[run.names.index(name.removesuffix(".q0"))] = float(value)
    for t in np.linspace(0, time, steps + 1):
        for name, k in zip(driven, moves, strict=True):
            q[k], qd[k] = inputs[f"{name}.q"](t), inputs[f"{name}.qd"](t)
        q, qd = run.closed(q, qd, [k for k in range(len(qd)) if k not in moves])
    zero = compile_expression("0")
    torques = run.torques(q, qd, {name: inputs.get(f"{name}.qdd", zero)(time) for name in driven})
    return {f"{name}.tau": tau for name, tau in zip(driven, torques, strict=True)}


def values(case: Case) -> dict[float, dict[str, float]]:
    """Variables of a case at the times of its known figures."""
    run = Run(case.model, inverse=case.inverse)
    times = list(dict.fromkeys(known.time for known in case.known))
    if case.inverse:
        return {t: inverse(run, case, t) for t in times}
    run.law = forces(run, case)
    options = {"rtol": 1e-9, "method": "Radau"} if case.start.get("solver.method") == "bdf" else {}
    positions = [(name, place.start) for name, place in run.places if place.stop - place.start == 1]
    return {t: {name: q[at] for name, at in positions} for t, (q, _) in run.until(times, **options).items()}


def main() -> None:
    for case in DENSE_CASES:
        found = values(case)
        for known in case.known:
            print(
                f"{case.example}, {case.run}, {known.time:g} s:", *(f"{found[known.time][name]:.12g}" for name in known.names), flush=True
            )


if __name__ == "__main__":
    main()
