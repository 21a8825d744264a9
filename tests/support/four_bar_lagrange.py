"""The four-bar of ReDySim by Euler and Lagrange, cut at the coupler's tip: nothing of it comes from this project's algorithms.

Cut-section method: crank (one link, angle q1) and rocker with coupler (two links, angles q2, q3) are two manipulators
with closed-form inertias, Christoffel terms and gravity (M. W. Spong, M. Vidyasagar, Robot Dynamics and Control, 1989, ch. 6),
joined by their tips: D qdd + C + G = tau + J^T f, J qdd = -Jdot qd. Classical Runge-Kutta with a small fixed step.
"""

from __future__ import annotations

import numpy as np

G = 9.81
BASE, CRANK, ROCKER, COUPLER = 0.15, 0.05, 0.13, 0.10
MASS = np.array([1.5, 5.0, 3.0])
IZZ = np.array([0.0003125, 0.00704166666666667, 0.0025])


def inertia(q: np.ndarray) -> np.ndarray:
    _, m2, m3 = MASS
    i1, i2, i3 = IZZ
    c3 = np.cos(q[2])
    d22 = m2 * (ROCKER / 2)**2 + i2 + i3 + m3 * (ROCKER**2 + (COUPLER / 2)**2 + ROCKER * COUPLER * c3)
    d23 = i3 + m3 * ((COUPLER / 2)**2 + ROCKER * COUPLER / 2 * c3)
    d33 = i3 + m3 * (COUPLER / 2)**2
    return np.array([[i1 + MASS[0] * (CRANK / 2)**2, 0, 0], [0, d22, d23], [0, d23, d33]])


def velocity_terms(q: np.ndarray, qd: np.ndarray) -> np.ndarray:
    h = -MASS[2] * ROCKER * COUPLER / 2 * np.sin(q[2])
    return np.array([0, h * qd[2] * (2 * qd[1] + qd[2]), -h * qd[1]**2])


def gravity_terms(q: np.ndarray) -> np.ndarray:
    m1, m2, m3 = MASS
    tip = m3 * COUPLER / 2 * np.cos(q[1] + q[2])
    return G * np.array([m1 * CRANK / 2 * np.cos(q[0]), (m2 / 2 + m3) * ROCKER * np.cos(q[1]) + tip, tip])


def gap(q: np.ndarray) -> np.ndarray:
    """Tip of the coupler minus tip of the crank."""
    a = q[1] + q[2]
    return np.array([BASE + ROCKER * np.cos(q[1]) + COUPLER * np.cos(a) - CRANK * np.cos(q[0]),
                     ROCKER * np.sin(q[1]) + COUPLER * np.sin(a) - CRANK * np.sin(q[0])])


def jacobian(q: np.ndarray) -> np.ndarray:
    a = q[1] + q[2]
    x3, y3 = -COUPLER * np.sin(a), COUPLER * np.cos(a)
    return np.array([[CRANK * np.sin(q[0]), -ROCKER * np.sin(q[1]) + x3, x3], [-CRANK * np.cos(q[0]), ROCKER * np.cos(q[1]) + y3, y3]])


def jacobian_rate_times_qd(q: np.ndarray, qd: np.ndarray) -> np.ndarray:
    a, w = q[1] + q[2], qd[1] + qd[2]
    return np.array([CRANK * np.cos(q[0]) * qd[0]**2 - ROCKER * np.cos(q[1]) * qd[1]**2 - COUPLER * np.cos(a) * w**2,
                     CRANK * np.sin(q[0]) * qd[0]**2 - ROCKER * np.sin(q[1]) * qd[1]**2 - COUPLER * np.sin(a) * w**2])


def accelerations(q: np.ndarray, qd: np.ndarray, tau: float) -> tuple[np.ndarray, np.ndarray]:
    """Returns qdd and the force that the crank's tip puts on the coupler's tip."""
    J = jacobian(q)
    matrix = np.block([[inertia(q), -J.T], [J, np.zeros((2, 2))]])
    right = np.concatenate([np.array([tau, 0, 0]) - velocity_terms(q, qd) - gravity_terms(q), -jacobian_rate_times_qd(q, qd)])
    solution = np.linalg.solve(matrix, right)
    return solution[:3], solution[3:]


def energy(q: np.ndarray, qd: np.ndarray) -> float:
    m1, m2, m3 = MASS
    height = m1 * CRANK / 2 * np.sin(q[0]) + (m2 / 2 + m3) * ROCKER * np.sin(q[1]) + m3 * COUPLER / 2 * np.sin(q[1] + q[2])
    return 0.5 * qd @ inertia(q) @ qd + G * height


def simulate(times: np.ndarray, tau: float, steps_per_interval: int = 50) -> dict[str, np.ndarray]:
    """Returns q, qd, qdd and the cut force f at `times`, from rest with the crank at 0 and constant torque."""
    closed = np.arccos(-0.65)
    y = np.array([0, closed, closed, 0, 0, 0])

    def rate(y: np.ndarray) -> np.ndarray:
        return np.concatenate([y[3:], accelerations(y[:3], y[3:], tau)[0]])

    rows = []
    for k, time in enumerate(times):
        if k > 0:
            h = (time - times[k - 1]) / steps_per_interval
            for _ in range(steps_per_interval):
                k1 = rate(y)
                k2 = rate(y + h / 2 * k1)
                k3 = rate(y + h / 2 * k2)
                k4 = rate(y + h * k3)
                y = y + h / 6 * (k1 + 2 * k2 + 2 * k3 + k4)
        qdd, force = accelerations(y[:3], y[3:], tau)
        rows.append((y[:3], y[3:], qdd, force))
    return {name: np.array([row[i] for row in rows]) for i, name in enumerate(("q", "qd", "qdd", "f"))}
