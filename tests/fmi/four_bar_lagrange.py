"""Four-bars by Euler and Lagrange, cut at the coupler's tip: nothing of it comes from this project's algorithms.

Cut-section method: the crank (one link, angle q1) and the rocker with the coupler (two links, angles q2, q3) are two
manipulators with closed-form inertias, Christoffel terms and gravity (M. W. Spong, M. Vidyasagar, Robot Dynamics and
Control, 1989, ch. 6), joined by their tips: D qdd + C + G = tau + J^T f, J qdd = -Jdot qd. Classical Runge-Kutta with a
small fixed step, nothing projected.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy import cos, sin

G = 9.81


@dataclass(frozen=True)
class FourBar:
    """Lengths (m), masses (kg) with the centre at mid-length, moments of inertia about it (kg m^2): crank, rocker, coupler."""

    base: float
    lengths: tuple[float, float, float]
    masses: tuple[float, float, float]
    inertias: tuple[float, float, float]

    def inertia(self, q: np.ndarray) -> np.ndarray:
        (l1, l2, l3), (m1, m2, m3), (i1, i2, i3) = self.lengths, self.masses, self.inertias
        d22 = m2 * l2**2 / 4 + i2 + i3 + m3 * (l2**2 + l3**2 / 4 + l2 * l3 * cos(q[2]))
        d23 = i3 + m3 * (l3**2 / 4 + l2 * l3 / 2 * cos(q[2]))
        return np.array([[i1 + m1 * l1**2 / 4, 0, 0], [0, d22, d23], [0, d23, i3 + m3 * l3**2 / 4]])

    def velocity_terms(self, q: np.ndarray, qd: np.ndarray) -> np.ndarray:
        h = -self.masses[2] * self.lengths[1] * self.lengths[2] / 2 * sin(q[2])
        return np.array([0, h * qd[2] * (2 * qd[1] + qd[2]), -h * qd[1] ** 2])

    def gravity_terms(self, q: np.ndarray) -> np.ndarray:
        (l1, l2, l3), (m1, m2, m3) = self.lengths, self.masses
        tip = m3 * l3 / 2 * cos(q[1] + q[2])
        return G * np.array([m1 * l1 / 2 * cos(q[0]), (m2 / 2 + m3) * l2 * cos(q[1]) + tip, tip])

    def gap(self, q: np.ndarray) -> np.ndarray:
        """Tip of the coupler minus tip of the crank."""
        (l1, l2, l3), a = self.lengths, q[1] + q[2]
        return np.array([self.base + l2 * cos(q[1]) + l3 * cos(a) - l1 * cos(q[0]), l2 * sin(q[1]) + l3 * sin(a) - l1 * sin(q[0])])

    def jacobian(self, q: np.ndarray) -> np.ndarray:
        (l1, l2, l3), a = self.lengths, q[1] + q[2]
        x3, y3 = -l3 * sin(a), l3 * cos(a)
        return np.array([[l1 * sin(q[0]), -l2 * sin(q[1]) + x3, x3], [-l1 * cos(q[0]), l2 * cos(q[1]) + y3, y3]])

    def jacobian_rate_times_qd(self, q: np.ndarray, qd: np.ndarray) -> np.ndarray:
        (l1, l2, l3), a, w = self.lengths, q[1] + q[2], qd[1] + qd[2]
        return np.array(
            [
                l1 * cos(q[0]) * qd[0] ** 2 - l2 * cos(q[1]) * qd[1] ** 2 - l3 * cos(a) * w**2,
                l1 * sin(q[0]) * qd[0] ** 2 - l2 * sin(q[1]) * qd[1] ** 2 - l3 * sin(a) * w**2,
            ]
        )

    def accelerations(self, q: np.ndarray, qd: np.ndarray, tau: float) -> tuple[np.ndarray, np.ndarray]:
        """Returns qdd and the force that the crank's tip puts on the coupler's tip."""
        J = self.jacobian(q)
        matrix = np.block([[self.inertia(q), -J.T], [J, np.zeros((2, 2))]])
        forces = np.array([tau, 0, 0]) - self.velocity_terms(q, qd) - self.gravity_terms(q)
        solution = np.linalg.solve(matrix, np.concatenate([forces, -self.jacobian_rate_times_qd(q, qd)]))
        return solution[:3], solution[3:]

    def simulate(
        self, times: np.ndarray, q: list[float], qd: list[float], tau: float = 0, steps_per_interval: int = 50
    ) -> dict[str, np.ndarray]:
        """Returns q, qd, qdd and the cut force f at `times`, with constant torque at the crank."""

        def rate(y: np.ndarray) -> np.ndarray:
            return np.concatenate([y[3:], self.accelerations(y[:3], y[3:], tau)[0]])

        y, rows = np.array([*q, *qd], dtype=float), []
        for k, time in enumerate(times):
            for _ in range(steps_per_interval if k > 0 else 0):
                h = (time - times[k - 1]) / steps_per_interval
                k1 = rate(y)
                k2 = rate(y + h / 2 * k1)
                k3 = rate(y + h / 2 * k2)
                k4 = rate(y + h * k3)
                y = y + h / 6 * (k1 + 2 * k2 + 2 * k3 + k4)
            rows.append((y[:3], y[3:], *self.accelerations(y[:3], y[3:], tau)))
        return {name: np.array([row[i] for row in rows]) for i, name in enumerate(("q", "qd", "qdd", "f"))}


REDYSIM = FourBar(0.15, (0.05, 0.13, 0.10), (1.5, 5, 3), (0.0003125, 0.00704166666666667, 0.0025))
CLOSED = np.arccos(-0.65)  # both other angles when the crank is at 0
HOEKEN = FourBar(-0.0895, (0.038, 0.1152, 0.1152), (1.5, 3, 5), (0.0001805, 0.00331776, 0.0055296))
