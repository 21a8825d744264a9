"""Parameters of bodies with positive density, and of joints >= 0, that agree with estimated base parameters.

The matrix of second moments P of a link is positive definite. The search minimises the convex function

    |R (B pi - target)|^2 + weight (sum of 2 (trace(P / P0) - log det(P / P0) - 4) + sum of ((loss - loss0) / scale)^2)

with P0 of the model file (the divergence of Lee, Wensing and Park, 2020). It follows the minimum for decreasing weights by Newton's method.
Directions that the data do not determine stay at the model file.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from build_fmu.identify.parameters import pseudo_inertia, vector_of

WEAK = 1e-6  # last weight: a standard deviation of 1000 in the logarithm of second moments
LIMIT = 1e-5  # smallest weight relative to the sum of squares, for base parameters that no body has
STAGES = (0.1, 0.8)  # smallest and largest factor of the weight
FEW, MANY = 4, 8  # rounds at a weight, after which the factor decreases or increases
SLENDER = 1e-4  # smallest eigenvalue of the second moments of a start value, relative to their sum
ROUNDS = 1000
DONE = 0.1  # predicted decrease of the function, relative to the weight
INSIDE = 0.9  # part of the way to a singular P
DUST = 1e-13  # a loss that is rounding, relative to its scale
LOWER = tuple((i, j) for i in range(4) for j in range(i + 1))
# orthonormal symmetric matrices
BASIS = np.array([(np.outer(a, b) + np.outer(b, a)) / (2 if i == j else np.sqrt(2)) for i, j in LOWER for a, b in [np.eye(4)[[i, j]]]])


@dataclass(frozen=True)
class Fit:
    """All parameters with their covariance, and the remaining difference to the base parameters in standard deviations squared."""

    pi: np.ndarray
    covariance: np.ndarray
    distance: float
    converged: bool


@dataclass(frozen=True)
class Problem:
    """The bodies by first index in `pi` and Cholesky factor of P0, the losses by index, and the weighted base parameters.

    A point is the list of factors of P and the losses divided by their scales.
    """

    start: np.ndarray
    first: Sequence[int]
    factors: Sequence[np.ndarray]
    losses: Sequence[int]
    scales: np.ndarray
    combine: np.ndarray
    target: np.ndarray
    information: np.ndarray

    def parameters(self, factors: Sequence[np.ndarray], y: np.ndarray) -> np.ndarray:
        """Returns `pi`."""
        pi = self.start.copy()
        for first, factor in zip(self.first, factors, strict=True):
            pi[first : first + 10] = vector_of(factor @ factor.T)
        pi[self.losses] = y * self.scales
        return pi

    def misfit(self, factors: Sequence[np.ndarray], y: np.ndarray) -> np.ndarray:
        """Returns the difference to the base parameters in standard deviations."""
        return self.information @ (self.combine @ self.parameters(factors, y) - self.target)

    def cost(self, factors: Sequence[np.ndarray], y: np.ndarray, weight: float) -> float:
        """Returns the function that is minimised."""
        relative = [np.linalg.solve(former, factor) for former, factor in zip(self.factors, factors, strict=True)]
        far = sum(2 * ((A**2).sum() - 2 * np.log(np.diag(A)).sum() - 4) for A in relative)
        return float((self.misfit(factors, y) ** 2).sum() + weight * (far + ((y - self.start[self.losses] / self.scales) ** 2).sum()))

    def linear(self, factors: Sequence[np.ndarray], y: np.ndarray, weight: float) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Returns residual and rows of the Newton step, and derivatives of `pi`.

        The unknowns are the entries of X in P = L (1 + X) L', in BASIS, and the losses.
        """
        many = 10 * len(self.first)
        slopes = np.zeros((len(self.start), many + len(y)))
        near = np.zeros(many + len(y))
        for b, (first, former, factor) in enumerate(zip(self.first, self.factors, factors, strict=True)):
            part, relative = slice(10 * b, 10 * b + 10), np.linalg.solve(former, factor)
            slopes[first : first + 10, part] = np.array([vector_of(factor @ E @ factor.T) for E in BASIS]).T
            near[part] = (BASIS * (relative.T @ relative - np.eye(4))).sum(axis=(1, 2))
        slopes[self.losses, np.arange(many, many + len(y))] = self.scales
        near[many:] = y - self.start[self.losses] / self.scales
        rows = np.vstack([self.information @ self.combine @ slopes, np.sqrt(weight) * np.eye(len(near))])
        return np.concatenate([self.misfit(factors, y), np.sqrt(weight) * near]), rows, slopes


def inner(vector: np.ndarray, size: float) -> np.ndarray | None:
    """Returns the factor of a body, moved inside the possible ones if it is at their limit; None for a body without mass.

    `size` (m) is a length of the model.
    """
    if vector[0] <= 0:
        return None
    mass, com = vector[0], vector[1:4] / vector[0]
    # second moments about the center of mass
    second = pseudo_inertia(vector)[:3, :3] - mass * np.outer(com, com)
    values, axes = np.linalg.eigh(second)
    least = SLENDER * max(values.sum(), 1e-6 * mass * (com @ com), 1e-9 * mass * size**2)
    second = axes @ np.diag(np.maximum(values, least)) @ axes.T
    shift = np.eye(4)
    shift[:3, 3] = com
    return shift @ np.linalg.cholesky(np.block([[second, np.zeros((3, 1))], [np.zeros((1, 3)), np.full((1, 1), mass)]]))


def fit(problem: Problem) -> Fit:
    """Returns the parameters nearest to the model file that agree best with the base parameters."""
    many = 10 * len(problem.first)
    factors, y = list(problem.factors), np.maximum(problem.start[problem.losses] / problem.scales, 0)
    held, converged = y <= 0, False  # losses at 0
    distance = (problem.misfit(factors, y) ** 2).sum()
    weight = max(WEAK, distance / max(many + len(y), 1))
    stage, spent = STAGES[0], 0
    for _ in range(ROUNDS):
        spent += 1
        residual, rows, slopes = problem.linear(factors, y, weight)
        free = np.concatenate([np.ones(many, dtype=bool), ~held])
        step = np.zeros(len(free))
        Q, R = np.linalg.qr(rows[:, free])
        step[free] = -np.linalg.solve(R, Q.T @ residual)
        decrease = ((rows @ step) ** 2).sum()
        moved = None if decrease <= DONE * weight else _moved(problem, factors, y, weight, step)
        if moved is not None:
            factors, y = moved
            held |= (y <= 0) & ~held
            continue
        # the minimum of this weight, with these losses at 0: a loss that decreases the function leaves 0
        slope = np.where(held, (rows.T @ residual)[many:], 0)
        gain = np.where(slope < 0, (slope / np.linalg.norm(rows[:, many:], axis=0)) ** 2, 0)
        if gain.max(initial=0) > DONE * weight:
            held[gain.argmax()] = False
            continue
        distance = (problem.misfit(factors, y) ** 2).sum()
        last = max(WEAK, LIMIT * distance)
        if weight <= last:
            converged = decrease <= max(1, DONE * weight)
            break
        # close to the limit of possible bodies, the minima of distant weights are many steps apart
        stage = max(stage**2, STAGES[0]) if spent <= FEW else min(np.sqrt(stage), STAGES[1]) if spent > MANY else stage
        weight, spent = max(stage * weight, last), 0
    pi = problem.parameters(factors, np.where(y > DUST, y, 0))
    spread = slopes @ np.linalg.inv(np.linalg.qr(rows, mode="r"))
    return Fit(pi, spread @ spread.T, float((problem.misfit(factors, y) ** 2).sum()), bool(converged))


def _moved(problem: Problem, factors: Sequence[np.ndarray], y: np.ndarray, weight: float, step: np.ndarray):
    """Returns a point along the step with a smaller cost, at most where a loss becomes 0; None if there is none."""
    many = 10 * len(factors)
    changes = [np.tensordot(step[10 * b : 10 * b + 10], BASIS, 1) for b in range(len(factors))]
    lowest = min((np.linalg.eigvalsh(X)[0] for X in changes), default=0.0)
    length = min(1.0, -INSIDE / lowest if lowest < 0 else 1.0)
    down = step[many:] < 0
    reach = np.where(down, -y / np.where(down, step[many:], -1), np.inf)
    length = min(length, reach.min(initial=np.inf))
    before = problem.cost(factors, y, weight)
    while length > 1e-12 or not length:
        new = [L @ np.linalg.cholesky(np.eye(4) + length * X) for L, X in zip(factors, changes, strict=True)]
        moved = np.where(reach <= length, 0, y + length * step[many:])
        if not length or problem.cost(new, moved, weight) < before:
            return new, moved
        length /= 2
    return None
