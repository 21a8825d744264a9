"""Parameters of bodies with positive density, and of joints >= 0, that agree with estimated base parameters.

The matrix of second moments of a link is P = L U U' L' with P0 = L L' of the model file and U = I there. U is triangular with the diagonal
exp(theta): every theta is a possible body (log-Cholesky parameters of Rucker and Wensing, 2022, relative to the model file). Directions
that the data do not determine stay at the model file: the term WEAK theta adds a standard deviation of 1 / WEAK to each theta.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from build_fmu.identify.parameters import pseudo_inertia, vector_of

WEAK = 0.03
SLENDER = 1e-4  # smallest eigenvalue of the second moments of a start value, relative to their sum
ROUNDS = 200
DONE = 1e-3  # decrease of the sum of squares, which is in standard deviations
LOWER = tuple((i, j) for i in range(4) for j in range(i + 1))


@dataclass(frozen=True)
class Bodies:
    """Links with free parameters: first index in `pi` and Cholesky factor of their start value."""

    first: Sequence[int]
    factors: Sequence[np.ndarray]

    def apply(self, theta: np.ndarray, pi: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Returns `pi` with the parameters of the links, and their derivatives (parameters x theta)."""
        pi, slopes = pi.copy(), np.zeros((len(pi), len(theta)))
        for b, (first, factor) in enumerate(zip(self.first, self.factors, strict=True)):
            U = np.zeros((4, 4))
            for k, (i, j) in enumerate(LOWER):
                U[i, j] = np.exp(theta[10 * b + k]) if i == j else theta[10 * b + k]
            pi[first : first + 10] = vector_of(factor @ U @ U.T @ factor.T)
            for k, (i, j) in enumerate(LOWER):
                dU = np.zeros((4, 4))
                dU[i, j] = U[i, i] if i == j else 1
                half = factor @ dU @ U.T @ factor.T
                slopes[first : first + 10, 10 * b + k] = vector_of(half + half.T)
        return pi, slopes


@dataclass(frozen=True)
class Fit:
    """All parameters with their covariance, and the remaining difference to the base parameters in standard deviations squared."""

    pi: np.ndarray
    covariance: np.ndarray
    distance: float


def inner(vector: np.ndarray) -> np.ndarray | None:
    """Returns the factor of a body, moved inside the possible ones if it is at their limit; None for a body without mass."""
    if vector[0] <= 0:
        return None
    mass, com = vector[0], vector[1:4] / vector[0]
    # second moments about the center of mass
    second = pseudo_inertia(vector)[:3, :3] - mass * np.outer(com, com)
    values, axes = np.linalg.eigh(second)
    least = SLENDER * max(values.sum(), 1e-6 * mass * (com @ com), 1e-9 * mass)
    second = axes @ np.diag(np.maximum(values, least)) @ axes.T
    shift = np.eye(4)
    shift[:3, 3] = com
    return shift @ np.linalg.cholesky(np.block([[second, np.zeros((3, 1))], [np.zeros((1, 3)), np.full((1, 1), mass)]]))


def fit(start: np.ndarray, bodies: Bodies, losses: Sequence[int], scales: np.ndarray, combine: np.ndarray, target, information) -> Fit:
    """Returns the parameters nearest to the model file that agree best with the base parameters `target`.

    `losses` are indices of parameters >= 0 in `pi`, `scales` their sizes. Levenberg-Marquardt with projection on the bounds.
    """
    many, losses = 10 * len(bodies.first), list(losses)

    def parts(x: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        pi, slopes = bodies.apply(x[:many], start)
        pi[losses] = x[many:]
        derivative = np.hstack([slopes, np.eye(len(pi))[:, losses]])
        weak = WEAK * np.concatenate([x[:many], (x[many:] - start[losses]) / scales])
        rows = np.vstack([information @ combine @ derivative, WEAK * np.diag(np.concatenate([np.ones(many), 1 / scales]))])
        return np.concatenate([information @ (combine @ pi - target), weak]), rows, derivative

    x = np.concatenate([np.zeros(many), np.maximum(start[losses], 0)])
    residual, rows, derivative = parts(x)
    damping = 1e-3
    for _ in range(ROUNDS):
        slope = rows.T @ residual
        bound = np.concatenate([np.zeros(many, dtype=bool), (x[many:] <= 0) & (slope[many:] > 0)])
        sizes = np.linalg.norm(rows, axis=0)
        step = np.zeros_like(x)
        system = np.vstack([rows[:, ~bound], np.sqrt(damping) * np.diag(sizes[~bound])])
        Q, R = np.linalg.qr(system)
        step[~bound] = -np.linalg.solve(R, Q[: len(residual)].T @ residual)
        step *= min(1, 2 / max(abs(step[:many]).max(initial=0), 2))  # exp(theta) changes by a factor of at most e^2
        trial = x + step
        trial[many:] = np.maximum(trial[many:], 0)
        new = parts(trial)
        before, after = residual @ residual, new[0] @ new[0]
        if not after < before:
            damping *= 10
            if damping > 1e12:
                break
            continue
        x, (residual, rows, derivative), damping = trial, new, max(damping / 10, 1e-14)
        if before - after < DONE:
            break
    spread = derivative @ np.linalg.inv(np.linalg.qr(rows, mode="r"))
    pi = bodies.apply(x[:many], start)[0]
    pi[losses] = x[many:]
    left = residual[: len(information)]
    return Fit(pi, spread @ spread.T, float(left @ left))
