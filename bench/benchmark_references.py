"""References of the multibody benchmarks: closed forms, equations of motion derived by hand, published values and the dense formulation.

Each function returns an output variable at the given times; NaN where no reference is known.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from scipy.integrate import solve_ivp
from scipy.special import ellipj

G = 9.81
TIGHT = 1e-13
# problem Andrews of the Test Set for IVP Solvers (F. Mazzia, C. Magherini, 2008): the crank angle after 0.03 s
SQUEEZER = {0.03: 15.81077119629904}
# first joint of Bricard's mechanism by the dense formulation, tests/crosscheck/dense_run.py
BRICARD = {
    1: -1.03502845952,
    2: -2.89332820598,
    3: -2.88476160446,
    4: -1.01819918185,
    5: -6.72599597327e-05,
    6: -1.05195596242,
    7: -2.90174362146,
    8: -2.87604367039,
    9: -1.00147056004,
    10: -0.000269048883326,
}


def known(values: dict[float, float], times: np.ndarray) -> np.ndarray:
    """The values at their times, NaN elsewhere."""
    rows = np.full(len(times), np.nan)
    for time, value in values.items():
        rows[np.abs(times - time) < 1e-9] = value
    return rows


def pendulum(times: np.ndarray) -> np.ndarray:
    """Angle of the pendulum released from the horizontal: sin(alpha/2) = k cd(t sqrt(g/l)), k^2 = 1/2, alpha from below."""
    _, cn, dn, _ = ellipj(np.sqrt(G) * times, 0.5)
    return 1.5 * np.pi - 2 * np.arcsin(np.sqrt(0.5) * cn / dn)


def solved(slope: Callable, start: list[float], times: np.ndarray, method: str = "DOP853", rtol: float = TIGHT) -> np.ndarray:
    """One row per state."""
    run = solve_ivp(slope, (0, times[-1]), start, method, t_eval=times, rtol=rtol, atol=rtol / 10)
    if not run.success:
        raise RuntimeError(run.message)
    return run.y


def four_bars(count: int) -> Callable[[np.ndarray], np.ndarray]:
    """Common angle q of the upright rods: I q'' = -c cos q; the horizontal rods only translate."""
    inertia, moment = (count + 1) / 3 + count, G * ((count + 1) / 2 + count)
    return lambda times: solved(lambda t, y: [y[1], -moment * np.cos(y[0]) / inertia], [np.pi / 2, -1], times)[0]


def slider_crank(times: np.ndarray) -> np.ndarray:
    """Crank angle q: the rod mirrors the crank, the slider is at 2 sin q. d/dt (I q') = I' q'^2 / 2 + g sin q."""

    def slope(t, y):
        s, c = np.sin(y[0]), np.cos(y[0])
        inertia = 1 / 3 + 1 / 12 + s * s / 4 + 9 / 4 * c * c + 2 * c * c
        return [y[1], (G * s + 4 * s * c * y[1] ** 2) / inertia]

    return solved(slope, [-np.pi / 2, 0], times)[0]


def governor_motion(times: np.ndarray) -> np.ndarray:
    """Rows of the shaft's angle, the slider's height s and the angle u of both arms from the shaft downwards, whose angular momentum about
    the shaft is constant."""
    mass, across, along = 0.3, 0.3 * 1.0001 / 12, 0.3 * 0.0001 / 6  # of shaft and arm

    def inertia(u):
        x = np.sin(u)
        arm = mass * (0.05 + x / 2) ** 2 + 5 * (0.05 + x) ** 2 + along * np.cos(u) ** 2 + across * x * x
        return along + 0.005 + 2 * arm

    def slope_of_inertia(u):
        x, c = np.sin(u), np.cos(u)
        return 2 * (mass * (0.05 + x / 2) * c + 10 * (0.05 + x) * c + 2 * (across - along) * x * c)

    momentum, of_arms = inertia(np.pi / 3) * 2 * np.pi, 2 * (across + mass / 4 + 5)

    def slope(t, y):
        s, u, ds, du, _ = y
        x, z = np.sin(u) / 2, 1 - np.cos(u) / 2 - s
        length = np.hypot(x, z)
        by_s, by_u = -z / length, (x * np.cos(u) + z * np.sin(u)) / 2 / length
        force = 2 * (8e5 * (length - 0.5) + 4e4 * (by_s * ds + by_u * du))
        spin = momentum / inertia(u)
        turn = spin**2 * slope_of_inertia(u) / 2 - 2 * G * (mass / 2 + 5) * np.sin(u) - force * by_u
        return [ds, du, -G - force * by_s / 3, turn / of_arms, spin]

    return solved(slope, [0.5, np.pi / 3, 0, 0, 0], times, "LSODA", 1e-12)[[4, 0, 1]]


def governor(times: np.ndarray) -> np.ndarray:
    return governor_motion(times)[1]


def squeezer(times: np.ndarray) -> np.ndarray:
    return known(SQUEEZER, times)


def bricard(times: np.ndarray) -> np.ndarray:
    return known(BRICARD, times)


def stewart_motion(t: float) -> tuple[np.ndarray, ...]:
    """Position, velocity and acceleration of the platform's center, its rotation, angular velocity and acceleration (ground axes)."""
    size, rate, phase = np.array([0.05, 0.04, 0.03]), np.array([5.0, 7.0, 6.0]), np.array([0.3, 0.0, 1.0])
    center = np.array([0, 0, 0.8]) + size * np.sin(rate * t + phase)
    velocity, acceleration = size * rate * np.cos(rate * t + phase), -size * rate**2 * np.sin(rate * t + phase)
    # a rotation about a fixed axis, then one about z
    axis = np.array([2.0, 1.0, 0.0]) / np.sqrt(5)
    swings = ((0.3, 4.0), (0.2, 6.0))  # rad, rad/s
    (a, da, dda), (b, db, ddb) = ((s * np.sin(w * t), s * w * np.cos(w * t), -s * w * w * np.sin(w * t)) for s, w in swings)
    cross = np.array([[0, 0, axis[1]], [0, 0, -axis[0]], [-axis[1], axis[0], 0]])
    inner = np.eye(3) + np.sin(a) * cross + (1 - np.cos(a)) * cross @ cross
    outer = np.array([[np.cos(b), -np.sin(b), 0], [np.sin(b), np.cos(b), 0], [0, 0, 1]])
    z, turned = np.array([0, 0, 1.0]), outer @ axis
    omega = db * z + da * turned
    alpha = ddb * z + dda * turned + da * np.cross(db * z, turned)
    return center, velocity, acceleration, outer @ inner, omega, alpha


def stewart_forces(motion: tuple[np.ndarray, ...]) -> np.ndarray:
    """Rows of length, its two derivatives and force of the six pistons of `stewart_platform.toml`, by virtual power.

    A leg with its top at x = B + L s has the masses at B + c s and B + (L - d) s; slender rods add I s'' ds. The forces of pistons and legs
    on the platform balance its wrench: six linear equations.
    """
    center, velocity, acceleration, turn, omega, alpha = motion
    gravity, tensor = np.array([0, 0, -G]), turn @ np.diag([0.3, 0.4, 0.6]) @ turn.T
    wrench = np.concatenate([10 * (acceleration - gravity), tensor @ alpha + np.cross(omega, tensor @ omega)])
    columns, kinematics = [], []
    for base, top in zip((-10, 10, 110, 130, 230, 250), (-50, 50, 70, 170, 190, 290), strict=True):
        arm = turn @ (0.3 * np.array([np.cos(np.radians(top)), np.sin(np.radians(top)), 0]))
        leg = center + arm - 0.6 * np.array([np.cos(np.radians(base)), np.sin(np.radians(base)), 0])
        v = velocity + np.cross(omega, arm)
        a = acceleration + np.cross(alpha, arm) + np.cross(omega, np.cross(omega, arm))
        length = np.linalg.norm(leg)
        s = leg / length
        dl = s @ v
        ddl = (v @ v + leg @ a - dl**2) / length
        ds = (v - dl * s) / length
        dds = (a - ddl * s - 2 * dl * ds) / length
        across = np.eye(3) - np.outer(s, s)
        lower, upper = 0.2 * dds, ddl * s + 2 * dl * ds + (length - 0.25) * dds  # accelerations of both centers
        needed = across @ (2 * 0.2 * (lower - gravity) + (0.03 + 0.02) * dds + 1 * (length - 0.25) * (upper - gravity)) / length
        needed += 1 * s * (s @ (upper - gravity))
        wrench += np.concatenate([needed, np.cross(arm, needed)])
        columns.append(np.concatenate([s, np.cross(arm, s)]))
        kinematics.append([length, dl, ddl])
    return np.vstack([np.transpose(kinematics), np.linalg.solve(np.transpose(columns), wrench)])
