"""Inputs that hold a model at rest."""

from __future__ import annotations

import numpy as np

from build_fmu.library.evaluation import Evaluation
from build_fmu.library.modes import mass_factor, mass_matrix, rates_of, sizes_of_terms

ROUNDS = 3
RANK = 1e-12  # effect of inputs that is rounding, relative to the largest one
HELD = 1e-9  # of the largest acceleration at the start, or of the terms of an acceleration: rest


def holding_inputs(
    equations: Evaluation, energy: Evaluation, x: np.ndarray, u: np.ndarray, fixed: np.ndarray
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Returns u with the change of least norm that holds x at rest, the rates x' that remain, and which of them are rounding.

    Inputs of the mask `fixed` stay.
    """
    first = abs(equations.slope(x, u)).max(initial=0)
    factor = mass_factor(mass_matrix(equations, energy, x, u))
    for _ in range(ROUNDS):
        missing = equations.slope(x, u)
        B = np.where(fixed, 0, equations.jacobian(equations.slopes, equations.inputs))
        weights = _weights(equations, factor, B)
        u = u - np.linalg.lstsq(weights @ B, weights @ missing, rcond=RANK)[0]
    left = equations.slope(x, u)
    allowed = HELD * np.maximum(max(first, 1.0), sizes_of_terms(equations, equations.slopes, x, u))
    return u, left, abs(left) <= allowed


def _weights(equations: Evaluation, factor: np.ndarray, B: np.ndarray) -> np.ndarray:
    """Returns factors of the rows of x' that make them comparable in any units.

    Accelerations get `factor`, L' of M = L L': their sum of squares is twice the energy of accelerations (Gauss's principle).
    """
    rows = [equations.states.index(n) for n in rates_of(equations)]
    weights = np.zeros((len(B), len(B)))
    weights[np.ix_(rows, rows)] = factor
    # states of actuators: as large as the largest of these
    largest, sizes = abs(weights @ B).max(initial=0), abs(B).max(axis=1, initial=0)
    others = [k for k in range(len(B)) if k not in rows]
    weights[others, others] = np.where(sizes > 0, (largest or 1.0) / np.where(sizes > 0, sizes, 1), 1.0)[others]
    return weights
