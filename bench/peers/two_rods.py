"""Two slender rods of 1 m in a plane, in 80-bit arithmetic: the independent reference for the stiff and the extreme scenes.

Lagrange's equations, derived by hand for the absolute angles a and b; optional strut from the tip to a point of the ground, optional
torque at the shoulder. The extrapolated midpoint rule (Gragg, Bulirsch, Stoer; 2 to 14 subdivisions) integrates them.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass

import numpy as np

R = np.longdouble
G = R("9.81")
COUNTS = [2 * (k + 1) for k in range(7)]


@dataclass
class TwoRods:
    masses: tuple[float, float] = (1.0, 1.0)
    pivot: tuple[float, float] | None = None  # of the strut
    stiffness: float = 0.0
    damping: float = 0.0
    length: float = 0.0
    torque: float = 0.0

    def strut(self, a, b, da, db):
        """Length, its rate and the derivatives with respect to a and b."""
        x, y = np.cos(a) + np.cos(b) - R(self.pivot[0]), np.sin(a) + np.sin(b) - R(self.pivot[1])
        length = np.hypot(x, y)
        along_a = (-x * np.sin(a) + y * np.cos(a)) / length
        along_b = (-x * np.sin(b) + y * np.cos(b)) / length
        return length, along_a * da + along_b * db, along_a, along_b

    def slope(self, y):
        """y = a, b, da, db, work of the damper"""
        a, b, da, db, _ = y
        m1, m2 = (R(mass) for mass in self.masses)
        m11, m22, m12 = m1 / 3 + m2, m2 / 3, m2 * np.cos(a - b) / 2
        s = m2 * np.sin(a - b) / 2
        f1 = R(self.torque) - s * db * db - (m1 / 2 + m2) * G * np.cos(a)
        f2 = s * da * da - m2 / 2 * G * np.cos(b)
        power = R(0)
        if self.pivot is not None:
            length, rate, along_a, along_b = self.strut(a, b, da, db)
            tension = R(self.stiffness) * (length - R(self.length)) + R(self.damping) * rate
            f1, f2, power = f1 - tension * along_a, f2 - tension * along_b, -R(self.damping) * rate * rate
        det = m11 * m22 - m12 * m12
        return np.array([da, db, (m22 * f1 - m12 * f2) / det, (m11 * f2 - m12 * f1) / det, power])


def gbs_step(slope: Callable, y, h):
    table = []
    first = slope(y)
    for k, count in enumerate(COUNTS):
        small = h / count
        before, now = y, y + small * first
        for _ in range(count - 1):
            before, now = now, before + 2 * small * slope(now)
        row = [(before + now + small * slope(now)) / 2]
        for j in range(k):
            row.append(row[j] + (row[j] - table[-1][j]) / ((R(count) / COUNTS[k - 1 - j]) ** 2 - 1))
        table.append(row)
    return table[-1][-1]


def run(slope: Callable, y, step: float, rows: int, cuts: int, before_cut: Callable[[int], None] = lambda cut: None) -> Iterator:
    """Yields y at each row; `before_cut` is called before each step with its number."""
    h = R(str(step)) / cuts
    y = np.array([R(value) for value in y])
    yield y
    for row in range(rows):
        for cut in range(cuts):
            before_cut(row * cuts + cut)
            y = gbs_step(slope, y, h)
        yield y
