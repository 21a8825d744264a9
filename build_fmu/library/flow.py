"""The derivative of a step: Gauss collocation of order 6, differentiated exactly, with as many intervals as necessary."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from build_fmu.errors import UserError
from build_fmu.library.evaluation import Evaluation

ROOT15 = np.sqrt(15)
# Gauss-Legendre with three stages (Hairer, Norsett, Wanner, Solving Ordinary Differential Equations I, table II.7.4)
STAGES = np.array(
    [
        [5 / 36, 2 / 9 - ROOT15 / 15, 5 / 36 - ROOT15 / 30],
        [5 / 36 + ROOT15 / 24, 2 / 9, 5 / 36 - ROOT15 / 24],
        [5 / 36 + ROOT15 / 30, 2 / 9 + ROOT15 / 15, 5 / 36],
    ]
)
TIMES = STAGES.sum(axis=1)
WEIGHTS = np.array([5 / 18, 4 / 9, 5 / 18])
ACCURACY = 1e-8  # of A and B, relative to the largest entry
MOST_INTERVALS = 512
NEWTON = 1e-13  # relative change of the last iteration
MOST_ITERATIONS = 12


def step_derivative(equations: Evaluation, x: np.ndarray, u: np.ndarray, h: float) -> tuple[np.ndarray, np.ndarray]:
    """Returns A and B, the derivatives of the state at time h by the state and by inputs that are held; raises UserError."""
    if equations.next_event < h:
        time = equations.next_event
        raise UserError(f"a trajectory changes at t = {time:g} s, inside the step of {h:g} s: use a shorter step")
    if not len(x):
        return np.empty((0, 0)), np.empty((0, len(u)))
    before, count = None, 1
    while count <= MOST_INTERVALS:
        now = _derivative(equations, x, u, h, count)
        if now is not None:
            if before is not None and abs(now - before).max(initial=0) <= ACCURACY * abs(now).max(initial=0):
                return now[:, : len(x)], now[:, len(x) :]
            before = now
        count *= 2
    raise UserError(f"the derivative of a step of {h:g} s does not converge with {MOST_INTERVALS} intervals: use a shorter step")


def _derivative(equations: Evaluation, x: np.ndarray, u: np.ndarray, h: float, count: int) -> np.ndarray | None:
    """Returns [A, B] with `count` intervals, or None if Newton's iteration or a stage fails."""
    n, total = len(x), np.hstack([np.eye(len(x)), np.zeros((len(x), len(u)))])
    slope = np.tile(equations.slope(x, u), (3, 1))
    step = h / count
    for k in range(count):
        try:
            found = _interval(equations, x, u, k * step + step * TIMES, step, slope)
        except (UserError, np.linalg.LinAlgError):
            return None  # a stage is out of reach: shorter intervals may succeed
        if found is None:
            return None
        slope, by_state, by_input = found
        x = x + step * WEIGHTS @ slope
        total = by_state @ total
        total[:, n:] += by_input
    return total


def _held(inputs: Sequence[str], time: float) -> np.ndarray:
    """Returns the matrix that maps inputs at 0 to those at `time`: prescribed joints move by q + qd t + qdd t^2/2."""
    held, row = np.eye(len(inputs)), {name: k for k, name in enumerate(inputs)}
    for velocity in (name for name in inputs if name.endswith(".qd")):
        position, acceleration = (row[velocity.removesuffix("qd") + letter] for letter in ("q", "qdd"))
        held[position, [row[velocity], acceleration]] = time, time**2 / 2
        held[row[velocity], acceleration] = time
    return held


def _interval(equations: Evaluation, x: np.ndarray, u: np.ndarray, times: np.ndarray, h: float, slope: np.ndarray):
    """Returns the slopes at the three stages, and the derivatives of the state after h; None if the iteration fails."""
    n = len(x)
    inputs = [_held(equations.inputs, time) for time in times]
    for _ in range(MOST_ITERATIONS):
        points = x + h * STAGES @ slope
        values, jacobians, by_inputs = [], [], []
        for point, time, held in zip(points, times, inputs, strict=True):
            values.append(equations.slope(point, held @ u, time))
            both = equations.jacobian(equations.slopes, [*equations.states, *equations.inputs])
            jacobians.append(both[:, :n])
            by_inputs.append(both[:, n:] @ held)
        # K_i = f(x + h sum_j a_ij K_j), linearised
        matrix = np.eye(3 * n) - h * np.block([[STAGES[i, j] * jacobians[i] for j in range(3)] for i in range(3)])
        change = np.linalg.solve(matrix, (np.array(values) - slope).ravel()).reshape(3, n)
        slope = slope + change
        if not np.isfinite(slope).all():
            return None
        if abs(h * change).max() <= NEWTON * max(1.0, abs(x).max()):
            by_state, by_input = (np.linalg.solve(matrix, np.vstack(parts)).reshape(3, n, -1) for parts in (jacobians, by_inputs))
            summed = [h * np.einsum("i,ijk->jk", WEIGHTS, part) for part in (by_state, by_input)]
            return slope, np.eye(n) + summed[0], summed[1]
    return None
