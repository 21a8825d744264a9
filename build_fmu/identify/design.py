"""Exciting trajectories: Fourier series within limits, at rest at both ends, with a small condition number of the regressor."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from build_fmu.arguments import each
from build_fmu.errors import UserError
from build_fmu.identify.base import base_of
from build_fmu.identify.parameters import Plant
from build_fmu.identify.run import arbitrary

HARMONICS = 5
TRIALS = 10  # random trajectories, of which the best one is improved
COARSE = 12  # rows per period of the highest harmonic in the search
FINE = 200  # rows per harmonic at which the limits are observed
MARGIN = 1e-3  # of the limits
MOST_ROWS = 1e6  # of a trajectory


@dataclass(frozen=True)
class Trajectory:
    """A proposed motion: rows of n joints, torques of the model file; `condition` is that of the scaled regressor."""

    time: np.ndarray
    q: np.ndarray
    qd: np.ndarray
    qdd: np.ndarray
    torques: np.ndarray
    condition: float


@dataclass(frozen=True)
class Limits:
    """Positions (low, high) and speeds of n joints."""

    low: np.ndarray
    high: np.ndarray
    speed: np.ndarray


def limits_of(plant: Plant, low: ArrayLike, high: ArrayLike, speed: ArrayLike) -> Limits:
    """Returns checked limits; raises UserError."""
    limits = Limits(*(each(x, plant.joints, what) for x, what in ((low, "low"), (high, "high"), (speed, "speed"))))
    for joint, a, b, v in zip(plant.joints, limits.low, limits.high, limits.speed, strict=True):
        if not (np.isfinite(b - a) and b > a):
            raise UserError(f"the range of joint '{joint}' must be finite and increase, got {a:g} to {b:g}")
        if not v > 0:
            raise UserError(f"the speed of joint '{joint}' must be positive, got {v:g}")
    return limits


def design(plant: Plant, limits: Limits, duration: float, step: float, chosen=(), rounds: int = 150, seed: int = 0) -> Trajectory:
    """Returns a trajectory of this duration (s) with rows every `step` (s): the best of a random search with adapted step size."""
    if not (0 < duration < np.inf and 0 < step <= duration):
        raise UserError(f"duration and step must be positive times in s, step at most the duration, got {duration:g} and {step:g}")
    if duration / step > MOST_ROWS:
        raise UserError(f"{duration / step:.3g} rows are too many: use a shorter duration or a longer step")
    base = base_of(arbitrary(plant), plant.names, plant.chosen(chosen))
    random, n = np.random.default_rng(seed), len(plant.joints)
    times = np.arange(0, duration, duration / (COARSE * HARMONICS))
    levers = np.where(plant.sliding, 1, plant.size)  # torques are compared as forces

    def rate(series: np.ndarray) -> float:
        torques, columns = plant.equations(*_motion(series, limits, duration, times))
        sizes = np.sqrt(np.mean((torques / levers) ** 2, axis=0))
        weights = 1 / (levers * np.maximum(sizes, 1e-6 * max(sizes.max(), 1e-300)))
        return _condition((columns[:, :, base.independent] * weights[:, None]).reshape(-1, len(base.names)))

    best = min((random.normal(size=(2, HARMONICS, n)) for _ in range(TRIALS)), key=rate)
    value, size = rate(best), 0.5
    for _ in range(rounds):
        trial = best + size * random.normal(size=best.shape)
        reached = rate(trial)
        # a fifth of the trials succeed at the best step size
        size *= 1.5 if reached < value else 0.9
        if reached < value:
            best, value = trial / np.sqrt(np.mean(trial**2)), reached
    times = np.arange(round(duration / step) + 1) * step
    q, qd, qdd = _motion(best, limits, duration, times)
    return Trajectory(times, q, qd, qdd, plant.equations(q, qd, qdd)[0], value)


def _motion(series: np.ndarray, limits: Limits, duration: float, times: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Returns positions, velocities and accelerations of sines and cosines (2 x harmonics x n), scaled to the limits."""
    k = np.arange(1, HARMONICS + 1)
    w = 2 * np.pi * k / duration
    # at rest at both ends: the sines have no velocity there, the cosines no acceleration
    sines, cosines = (part - np.outer(v, v @ part) / (v @ v) for part, v in zip(series, (k, k**2), strict=True))

    def at(t: np.ndarray, order: int) -> np.ndarray:
        shift = np.pi / 2 * order
        return (np.sin(np.outer(t, w) + shift) * w**order) @ sines + (np.cos(np.outer(t, w) + shift) * w**order) @ cosines

    fine = np.linspace(0, duration, FINE * HARMONICS)
    q, qd = at(fine, 0), at(fine, 1)
    low, high = q.min(axis=0), q.max(axis=0)
    factor = (1 - MARGIN) * np.minimum((limits.high - limits.low) / (high - low), limits.speed / abs(qd).max(axis=0))
    middle = (limits.high + limits.low) / 2 - factor * (high + low) / 2
    return middle + factor * at(times, 0), factor * at(times, 1), factor * at(times, 2)


def _condition(columns: np.ndarray) -> float:
    scaled = columns / np.maximum(np.linalg.norm(columns, axis=0), 1e-300)
    values = np.linalg.eigvalsh(scaled.T @ scaled)
    return float(np.sqrt(values[-1] / max(values[0], 1e-16 * values[-1])))
