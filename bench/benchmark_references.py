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
    run = solve_ivp(slope, (0, times[-1]), start, method, t_eval=times, rtol=rtol, atol=rtol / 10)
    if not run.success:
        raise RuntimeError(run.message)
    return run.y[0]


def four_bars(count: int) -> Callable[[np.ndarray], np.ndarray]:
    """Common angle q of the upright rods: I q'' = -c cos q; the horizontal rods only translate."""
    inertia, moment = (count + 1) / 3 + count, G * ((count + 1) / 2 + count)
    return lambda times: solved(lambda t, y: [y[1], -moment * np.cos(y[0]) / inertia], [np.pi / 2, -1], times)


def slider_crank(times: np.ndarray) -> np.ndarray:
    """Crank angle q: the rod mirrors the crank, the slider is at 2 sin q. d/dt (I q') = I' q'^2 / 2 + g sin q."""

    def slope(t, y):
        s, c = np.sin(y[0]), np.cos(y[0])
        inertia = 1 / 3 + 1 / 12 + s * s / 4 + 9 / 4 * c * c + 2 * c * c
        return [y[1], (G * s + 4 * s * c * y[1] ** 2) / inertia]

    return solved(slope, [-np.pi / 2, 0], times)


def governor(times: np.ndarray) -> np.ndarray:
    """Height s of the slider: both arms have the angle u from the shaft downwards; the angular momentum about the shaft is constant."""
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
        s, u, ds, du = y
        x, z = np.sin(u) / 2, 1 - np.cos(u) / 2 - s
        length = np.hypot(x, z)
        by_s, by_u = -z / length, (x * np.cos(u) + z * np.sin(u)) / 2 / length
        force = 2 * (8e5 * (length - 0.5) + 4e4 * (by_s * ds + by_u * du))
        spin = momentum / inertia(u)
        turn = spin**2 * slope_of_inertia(u) / 2 - 2 * G * (mass / 2 + 5) * np.sin(u) - force * by_u
        return [ds, du, -G - force * by_s / 3, turn / of_arms]

    return solved(slope, [0.5, np.pi / 3, 0, 0], times, "LSODA", 1e-12)


def squeezer(times: np.ndarray) -> np.ndarray:
    return known(SQUEEZER, times)


def bricard(times: np.ndarray) -> np.ndarray:
    return known(BRICARD, times)
