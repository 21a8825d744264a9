"""Principal axes in the order and with the signs of MuJoCo, which an aligned free joint takes as its frame."""

from __future__ import annotations

import math

import numpy as np

TINY = 1e-12  # off-diagonal element and difference of moments, kg m2, that MuJoCo neglects
TURNS = 500


def principal_axes(inertia: np.ndarray) -> np.ndarray:
    """Returns the axes as columns, largest moment first: Jacobi's method from the identity, largest element first, as in MuJoCo."""
    axes = np.eye(3)
    for _ in range(TURNS):
        d = axes.T @ inertia @ axes
        p, q = max(((1, 2), (0, 2), (0, 1)), key=lambda at: abs(d[at]))
        if abs(d[p, q]) < TINY:
            break
        # tangent of the smaller angle that makes d[p, q] zero
        ratio = (d[q, q] - d[p, p]) / (2 * d[p, q])
        tangent = math.copysign(1 / (abs(ratio) + math.hypot(1, ratio)), ratio)
        cosine = 1 / math.hypot(1, tangent)
        turn = np.eye(3)
        turn[[p, q], [p, q]], turn[p, q], turn[q, p] = cosine, tangent * cosine, -tangent * cosine
        axes = axes @ turn
    moments = np.diag(axes.T @ inertia @ axes).copy()
    for k in (0, 1, 0):
        if moments[k] + TINY < moments[k + 1]:
            moments[[k, k + 1]] = moments[[k + 1, k]]
            axes[:, k], axes[:, k + 1] = axes[:, k + 1].copy(), -axes[:, k]
    return axes
