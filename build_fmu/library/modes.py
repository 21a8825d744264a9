"""Undamped modes of small motions about a state at rest."""

from __future__ import annotations

import re
from dataclasses import dataclass

import numpy as np

from build_fmu.errors import UserError
from build_fmu.library.evaluation import Evaluation

COORDINATE = re.compile(r".*\.(q(\[\d+\])?|quaternion\[\d\]|motor_q)")
RATE = re.compile(r".*\.(qd(\[\d+\])?|omega\[\d\]|motor_qd)")
AT_REST = 1e-6  # rad/s2, m/s2: acceleration of a state at rest
ROUNDING = 1e-14  # square of a free motion, relative to the largest square
REAL = 1e-8  # imaginary part of a square that is rounding, relative to the largest square


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


def modes_at(equations: Evaluation, x: np.ndarray, u: np.ndarray) -> Modes:
    """Returns the modes; raises UserError if the state is not at rest.

    With q' = G v and v' = a(q), small motions follow v'' = (da/dq) G v.
    """
    coordinates = [n for n in equations.states if COORDINATE.fullmatch(n)]
    rates = [n for n in equations.states if RATE.fullmatch(n)]
    slopes = dict(zip(equations.states, equations.slopes, strict=True))
    moving = dict(zip(equations.states, equations.slope(x, u), strict=True))
    worst = max([*coordinates, *rates], key=lambda n: abs(moving[n]), default=None)
    if worst is None:
        return Modes(np.empty(0), np.empty((0, 0)), [])
    if abs(moving[worst]) > AT_REST:
        name = equations.name_of(slopes[worst])
        raise UserError(f"modes require a state at rest, but '{name}' is {moving[worst]:.3g}: use an equilibrium or holding inputs")
    G = equations.jacobian([slopes[n] for n in coordinates], rates)
    stiffness = -equations.jacobian([slopes[n] for n in rates], coordinates)
    squares, vectors = np.linalg.eig(stiffness @ G)
    if abs(squares.imag).max(initial=0) > REAL * abs(squares).max(initial=0):
        raise UserError("the forces at this state have no potential, so there are no undamped modes: use `linearise`")
    rounding = ROUNDING * abs(squares).max(initial=0)
    squares = np.where(abs(squares) <= rounding, 0, squares.real)
    order = np.argsort(squares)
    shapes = (G @ vectors).real[:, order]
    largest = np.take_along_axis(shapes, abs(shapes).argmax(axis=0)[None, :], axis=0)
    resolution = float(np.sqrt(rounding)) / (2 * np.pi)
    return Modes(squares[order], shapes / largest, [equations.name_of(n) for n in coordinates], resolution)
