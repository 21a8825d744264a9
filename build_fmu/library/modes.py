"""Undamped modes of small motions about a state at rest."""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from build_fmu.errors import UserError
from build_fmu.library.evaluation import Evaluation

COORDINATE = re.compile(r".*\.(q(\[\d+\])?|quaternion\[\d\]|motor_q)")
RATE = re.compile(r".*\.(qd(\[\d+\])?|omega\[\d\]|motor_qd)")
AT_REST = 1e-6  # rad/s2, m/s2: acceleration of a state at rest
ROUNDED = 1e-11  # of the terms of an acceleration: also a state at rest
ROUNDING = 1e-14  # square of a free motion, relative to the largest square
REAL = 1e-8  # imaginary part of a square that is rounding, relative to the largest square
SYMMETRIC = 1e-11  # asymmetry of the stiffness that is rounding, relative to its largest entry
REPEATED = 1e-7  # difference of squares that may be equal, relative to the largest square
INDEPENDENT = 1e-6  # smallest singular value of independent unit vectors


@dataclass(frozen=True)
class Modes:
    """Modes by increasing square of the angular frequency (rad²/s²); a negative one is an unstable direction."""

    squares: np.ndarray  # (k); 0 of free motions, and below the resolution
    shapes: np.ndarray  # (coordinates x k), largest entry 1
    coordinates: list[str]
    resolution: float = 0.0  # Hz, of frequencies that are rounding errors of the highest one

    @property
    def frequencies(self) -> np.ndarray:
        """Frequencies in Hz (k); NaN for an unstable direction."""
        return np.sqrt(np.where(self.squares < 0, np.nan, self.squares)) / (2 * np.pi)


def modes_at(equations: Evaluation, energy: Evaluation, x: np.ndarray, u: np.ndarray) -> Modes:
    """Returns the modes; raises UserError if the state is not at rest. `energy` is an instance of the model with the output group "energy".

    With q' = G v and v' = a(q), small motions follow v'' = (da/dq) G v.
    """
    coordinates = [n for n in equations.states if COORDINATE.fullmatch(n)]
    rates = rates_of(equations)
    if not rates:
        return Modes(np.empty(0), np.empty((0, 0)), [])
    slopes = dict(zip(equations.states, equations.slopes, strict=True))
    _check_rest(equations, x, u, slopes, [*coordinates, *rates])
    G = equations.jacobian([slopes[n] for n in coordinates], rates)
    stiffness = -equations.jacobian([slopes[n] for n in rates], coordinates)
    squares, vectors = _eigen(stiffness @ G, mass_matrix(equations, energy, x, u))
    rounding = ROUNDING * abs(squares).max(initial=0)
    squares = np.where(abs(squares) <= rounding, 0, squares)
    order = np.argsort(squares, kind="stable")
    shapes = (G @ vectors)[:, order]
    largest = np.take_along_axis(shapes, abs(shapes).argmax(axis=0)[None, :], axis=0)
    resolution = float(np.sqrt(rounding)) / (2 * np.pi)
    return Modes(squares[order], shapes / largest, [equations.name_of(n) for n in coordinates], resolution)


def rates_of(equations: Evaluation) -> list[str]:
    """Returns the velocities among the states, also of motors and of independent coordinates without a name."""
    return [n for n in equations.states if RATE.fullmatch(n)]


def sizes_of_terms(equations: Evaluation, slopes: Sequence[str], x: np.ndarray, u: np.ndarray) -> np.ndarray:
    """Returns the size of the terms whose sum a rate of the state is: |A| |x| + |B| |u|. Their rounding errors are relative to it."""
    return abs(equations.jacobian(slopes, [*equations.states, *equations.inputs])) @ abs(np.concatenate([x, u]))


def mass_matrix(equations: Evaluation, energy: Evaluation, x: np.ndarray, u: np.ndarray) -> np.ndarray:
    """Returns M of the rates at the positions of x: the derivatives of the kinetic energy v'Mv/2 by v, at unit vectors v."""
    rates, state = rates_of(equations), dict(zip(equations.states, x, strict=True))
    M = np.empty((len(rates), len(rates)))
    for row, moving in zip(M, rates, strict=True):
        velocities = {n: float(n == moving) for n in rates}
        energy.place(np.array([{**state, **velocities}.get(n, 0.0) for n in energy.states]), u)
        row[:] = energy.jacobian(["energy.kinetic"], rates)[0]
    return (M + M.T) / 2


def mass_factor(M: np.ndarray) -> np.ndarray:
    """Returns L' of M = L L', for entries in any units; of a singular M the roots of its diagonal."""
    roots = np.sqrt(np.maximum(np.diag(M), np.finfo(float).tiny))
    try:
        return np.linalg.cholesky(M / np.outer(roots, roots)).T * roots
    except np.linalg.LinAlgError:
        return np.diag(roots)


def _check_rest(equations: Evaluation, x: np.ndarray, u: np.ndarray, slopes: Mapping[str, str], names: Sequence[str]) -> None:
    moving = dict(zip(equations.states, equations.slope(x, u), strict=True))
    if max(abs(moving[n]) for n in names) <= AT_REST:
        return
    # springs: rounding errors of their forces may be larger
    sizes = sizes_of_terms(equations, [slopes[n] for n in names], x, u)
    excess = {n: abs(moving[n]) / max(AT_REST, ROUNDED * size) for n, size in zip(names, sizes, strict=True)}
    worst = max(excess, key=excess.get)
    if excess[worst] > 1:
        name = equations.name_of(slopes[worst])
        raise UserError(f"modes require a state at rest, but '{name}' is {moving[worst]:.3g}: use an equilibrium or holding inputs")


def _eigen(A: np.ndarray, M: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Returns eigenvalues and independent vectors of A, which is M^-1 K with a symmetric K if the forces have a potential."""
    factor = mass_factor(M)
    # S = L' A L'^-1 is symmetric where K is
    S = np.linalg.solve(factor.T, (factor @ A).T).T
    if abs(S - S.T).max() <= SYMMETRIC * abs(S).max():
        values, vectors = np.linalg.eigh((S + S.T) / 2)
    else:
        values, vectors = _nonsymmetric(S)
    return values, np.linalg.solve(factor, vectors)


def _nonsymmetric(S: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Returns real eigenvalues and vectors; where these depend on each other, a basis of the invariant subspace."""
    values, vectors = np.linalg.eig(S)
    largest = abs(values).max()
    if abs(values.imag).max() > REAL * largest:
        raise UserError("the forces at this state have no potential, so there are no undamped modes: use `linearise`")
    order = np.argsort(values.real)
    values, vectors = values.real[order], vectors[:, order]
    for group in np.split(np.arange(len(values)), np.flatnonzero(np.diff(values) > REPEATED * largest) + 1):
        if np.linalg.svd(vectors[:, group], compute_uv=False)[-1] <= INDEPENDENT or np.iscomplexobj(vectors):
            vectors[:, group] = _null_space(S - values[group].mean() * np.eye(len(S)), len(group))
    return values, vectors.real


def _null_space(matrix: np.ndarray, size: int) -> np.ndarray:
    """Returns a basis of the null space of the lowest power of the matrix that has this size."""
    power = np.eye(len(matrix))
    for _ in range(size):
        power = matrix @ power
        power /= abs(power).max() or 1.0
        _, singular, right = np.linalg.svd(power)
        if singular[-size] <= INDEPENDENT * singular[0]:
            break
    return right[-size:].T
