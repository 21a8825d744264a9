"""Base parameters: the combinations of parameters that determine the torques, and their weighted least-squares estimate."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

INDEPENDENT = 1e-8  # part of a column that is not in the span of the columns before it
ZERO = 1e-9  # coefficient of a combination, for columns of length 1, that is rounding
EXCITED = 1e-8  # singular value of the scaled regressor, relative to the largest one
QUIET = 1e-9  # smallest standard deviation of the noise, relative to the torques: exact data have no noise to weight them by
ROUNDS = 10  # of weights
SHOWN = 4  # terms of a name


@dataclass(frozen=True)
class Base:
    """The independent columns of the regressor; `combine` (base x parameters) maps parameters to base parameters."""

    independent: np.ndarray
    combine: np.ndarray
    names: list[str]


@dataclass(frozen=True)
class Estimate:
    """Base parameters relative to those of the model file; `noise` is the standard deviation of each joint's torque."""

    change: np.ndarray
    errors: np.ndarray  # standard errors; inf: not excited
    information: np.ndarray  # R: R'R is the inverse of the covariance
    condition: float  # of the regressor with columns of length 1
    noise: np.ndarray


def base_of(columns: np.ndarray, names: Sequence[str], free: np.ndarray) -> Base:
    """Returns the base of the free parameters, by a QR decomposition of a stacked regressor of arbitrary motions (rows x parameters).

    A column that depends on the columns before it is grouped with them. The last ones are masses, which are grouped first. All columns
    are compared with length 1, so the base does not depend on the units.
    """
    letters = [name.rpartition(".")[2] for name in names]
    late = {"Iyy": 1, "mz": 2, "m": 3}
    order = [k for k in _by_owner(names, [late.get(x, 0) for x in letters]) if free[k]]
    lengths = np.linalg.norm(columns, axis=0)
    basis, kept = np.zeros((len(columns), len(names))), []
    for k in order:
        if lengths[k] == 0:
            continue
        rest = columns[:, k] / lengths[k]
        for _ in range(2):
            rest = rest - basis[:, : len(kept)] @ (basis[:, : len(kept)].T @ rest)
        if (size := np.linalg.norm(rest)) > INDEPENDENT:
            basis[:, len(kept)] = rest / size
            kept.append(k)
    independent, combine = np.array(sorted(kept), dtype=int), np.zeros((len(kept), len(names)))
    others = [k for k in order if k not in set(kept) and lengths[k] > 0]
    scaled = columns / np.where(lengths > 0, lengths, 1)
    grouped = np.linalg.lstsq(scaled[:, independent], scaled[:, others], rcond=None)[0]
    grouped[abs(grouped) < ZERO] = 0
    combine[:, others] = grouped * lengths[others] / lengths[independent][:, None]
    combine[np.arange(len(kept)), independent] = 1
    return Base(independent, combine, [_name(names, k, row) for k, row in zip(independent, combine, strict=True)])


def _by_owner(names: Sequence[str], ranks: Sequence[int]) -> list[int]:
    """Order of the columns: link by link, in each the late ones last."""
    owners = list(dict.fromkeys(name.rpartition(".")[0] for name in names))
    return sorted(range(len(names)), key=lambda k: (owners.index(names[k].rpartition(".")[0]), ranks[k]))


def _name(names: Sequence[str], own: int, row: np.ndarray) -> str:
    """Returns the combination with its first terms."""
    terms = [names[own]]
    for k in np.flatnonzero(row):
        if k != own:
            factor = "" if abs(abs(row[k]) - 1) < ZERO else f"{abs(row[k]):.4g} "
            terms.append(f"{'-' if row[k] < 0 else '+'} {factor}{names[k]}")
    more = [f"+ {len(terms) - SHOWN} more"] if len(terms) > SHOWN + 1 else terms[SHOWN:]
    return " ".join([*terms[:SHOWN], *more])


def estimate(columns: np.ndarray, torques: np.ndarray, sizes: np.ndarray) -> Estimate:
    """Returns the least-squares solution of columns (rows x n x base) and torques (rows x n), weighted by the noise of each joint.

    `sizes` are root mean squares of the measured torques; `torques` may be their differences to those of a model.
    """
    rows, joints, size = columns.shape
    noise = np.maximum(np.sqrt(np.mean(torques**2, axis=0)), sizes)
    noise = np.where(noise > 0, noise, noise.max() or 1.0)
    least = QUIET * noise
    # the triangle of each joint's columns and torques, of which all else follows
    whole = np.concatenate([columns, torques[:, :, None]], axis=2).transpose(1, 0, 2)
    triangles = np.linalg.qr(whole, mode="r")
    for _ in range(ROUNDS):
        triangle = np.linalg.qr((triangles / noise[:, None, None]).reshape(-1, size + 1), mode="r")
        information, right_side = triangle[:size, :size], triangle[:size, size]
        lengths = np.linalg.norm(information, axis=0)
        lengths[lengths == 0] = 1
        left, values, right = np.linalg.svd(information / lengths)
        seen = values > EXCITED * values.max(initial=0)
        inverse = right[seen].T / values[seen] / lengths[:, None]
        solution = inverse @ (left.T @ right_side)[seen]
        squares = ((triangles @ np.append(solution, -1)) ** 2).sum(axis=1)
        used, noise = noise, np.maximum(np.sqrt(squares / max(rows - size / joints, 1)), least)
        if np.allclose(noise, used, rtol=1e-3, atol=0):
            break
    hidden = (right[~seen] ** 2).sum(axis=0) > EXCITED
    errors = np.where(hidden, np.inf, np.linalg.norm(inverse, axis=1))
    condition = float(values[0] / values[-1]) if values[-1] > 0 else np.inf
    return Estimate(solution, errors, information, condition, noise)
