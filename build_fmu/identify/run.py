"""The identification of a run: motion and torques in, parameters with standard errors out."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

from build_fmu.errors import UserError, listed, unknown
from build_fmu.files import whole_file
from build_fmu.identify.base import Base, Estimate, base_of, estimate
from build_fmu.identify.consistent import Fit, Problem, fit, inner
from build_fmu.identify.filtering import END, PER_PERIOD, low_pass, step_size
from build_fmu.identify.model_file import with_parameters
from build_fmu.identify.parameters import INERTIAL, Plant

CUTOFF = 10.0  # Hz
STANDARD = 9.81  # m/s2, gravity of arbitrary motions, in lengths of the model
ROUNDING = 1e-8  # length of a column of arbitrary motions, relative to the largest one
SAMPLES = 40  # arbitrary motions per column of the regressor, which determine the base
POOR = 100.0  # condition number of the scaled regressor
EXACT = 1e-6  # residual of data without noise, relative to the torques
CORRELATED = 0.3  # correlation of neighbouring residuals


@dataclass(frozen=True)
class Run:
    """Rows of measurements; velocities and accelerations None: from the positions."""

    time: np.ndarray
    q: np.ndarray
    torques: np.ndarray
    qd: np.ndarray | None = None
    qdd: np.ndarray | None = None


@dataclass(frozen=True)
class Identification:
    """The result of an identification.

    `values` and `errors` belong to the base parameters `names`; `pi` and `covariance` to all parameters `parameters`. `residuals` are
    root mean squares of the torques (n) that the model leaves: `before` with the model file, `after` with the identified one.
    """

    plant: Plant
    free: np.ndarray  # mask of the identified parameters
    base: Base
    names: list[str]
    values: np.ndarray
    errors: np.ndarray
    start: np.ndarray
    condition: float
    noise: np.ndarray
    parameters: list[str]
    pi: np.ndarray
    covariance: np.ndarray  # of pi
    before: np.ndarray
    after: np.ndarray
    rows: int
    method: str
    warnings: list[str] = field(default_factory=list)

    def write(self, target: str | Path, source: str | Path, origin: str = "Parameters identified by build-fmu identify") -> None:
        """Writes the model file `source` with the identified parameters; `origin` becomes the first comment."""
        chosen = [name for name, free in zip(self.plant.owners(), self.free, strict=True) if free]
        numbers = dict(zip(self.parameters, self.pi.tolist(), strict=True))
        try:
            text = Path(source).read_text(encoding="utf-8-sig")
        except OSError as error:
            raise UserError(f"cannot read '{source}': {error.strerror}") from None
        text = with_parameters(text, self.plant, numbers, chosen, origin)
        whole_file(Path(target), lambda temporary: temporary.write_text(text, encoding="utf-8", newline="\n"))

    def added(self, link: str) -> tuple[np.ndarray, np.ndarray]:
        """Returns the ten parameters that were added to a link, such as a payload, and their covariance."""
        if link not in self.plant.links:
            raise unknown("link", link, self.plant.links)
        first = self.parameters.index(f"{link}.{INERTIAL[0]}")
        part = slice(first, first + len(INERTIAL))
        return self.pi[part] - self.plant.start()[part], self.covariance[part, part]


def identify(plant: Plant, run: Run, chosen: Sequence[str] = (), cutoff: float | None = None) -> Identification:
    """Identifies the chosen links and parameters of joints, by default all; `cutoff` (Hz) of the filter where derivatives are missing."""
    if cutoff is not None and not cutoff > 0:
        raise UserError(f"the cutoff must be a positive frequency in Hz, got {cutoff:g}")
    free = plant.chosen(chosen)
    if not free.any():
        raise UserError("no parameters to identify: the model has no links that its joints move")
    columns, torques, before, method = equations(plant, run, cutoff)
    base = base_of(arbitrary(plant), plant.names, free)
    if columns.shape[0] * columns.shape[1] <= len(base.names):
        raise UserError(f"the run has {len(columns)} rows of {columns.shape[1]} torques, too few for {len(base.names)} base parameters")
    sizes = _rms(run.torques)
    found = estimate(columns[:, :, base.independent], torques, sizes)
    start = plant.start()
    values = base.combine @ start + found.change
    fitted = _consistent(plant, free, base, found, values, columns, sizes)
    left = torques - columns @ (fitted.pi - start)
    best = torques - columns[:, :, base.independent] @ found.change
    warnings = [*_excitation(base, found), *_misfit(plant, found, fitted, best, left)]
    if (_rms(best) > EXACT * _rms(columns @ start)).all():
        warnings += _correlation(plant, best)
    return Identification(
        plant=plant,
        free=free,
        base=base,
        names=base.names,
        values=values,
        errors=found.errors,
        start=base.combine @ start,
        condition=found.condition,
        noise=found.noise,
        parameters=plant.names,
        pi=fitted.pi,
        covariance=fitted.covariance,
        before=before,
        after=_rms(left),
        rows=len(columns),
        method=method,
        warnings=warnings,
    )


def arbitrary(plant: Plant) -> np.ndarray:
    """Returns the stacked regressor of arbitrary motions, which excite all parameters that have an effect.

    Lengths, times and torques are relative to the size and the gravity of the model. Columns that are rounding are set to 0.
    """
    random, n = np.random.default_rng(0), len(plant.joints)
    count = -(-SAMPLES * len(plant.names) // (10 * n))
    lengths, rate = np.where(plant.sliding, plant.size, 1), np.sqrt(plant.gravity / (STANDARD * plant.size)) or 1.0
    # friction differs from damping above its velocity
    speeds = np.maximum(lengths * rate, [plant.values[f"{joint}.friction_velocity"] for joint in plant.joints])
    q, qd, qdd = (x * random.uniform(-1, 1, (count, n)) for x in (3 * lengths, 3 * speeds, 9 * lengths * rate**2))
    columns = plant.equations(q, qd, qdd)[1] / (np.where(plant.sliding, 1, plant.size) * plant.size * rate**2)[:, None]
    columns = columns.reshape(count * n, -1)
    sizes = np.linalg.norm(columns[:, : 10 * len(plant.links)], axis=0) * np.tile(
        plant.size ** np.repeat([0, 1, 2], [1, 3, 6]), len(plant.links)
    )
    columns[:, np.flatnonzero(sizes <= ROUNDING * sizes.max(initial=0))] = 0
    return columns


def equations(plant: Plant, run: Run, cutoff: float | None) -> tuple[np.ndarray, np.ndarray, np.ndarray, str]:
    """Returns W, the torques that the model file leaves, their root mean squares, and how they were filtered."""
    if run.qdd is not None and run.qd is not None and cutoff is None:
        model, columns = plant.equations(run.q, run.qd, run.qdd)
        return columns, run.torques - model, _rms(run.torques - model), "measured accelerations, no filter"
    step = step_size(run.time)
    cutoff = cutoff or min(CUTOFF, 0.2 / step)
    if cutoff * step > 0.5:
        raise UserError(f"the cutoff of {cutoff:g} Hz is above half the sampling rate, {0.5 / step:g} Hz")
    every, drop = max(1, int(1 / (PER_PERIOD * cutoff * step))), int(np.ceil(END / (cutoff * step)))
    if len(run.time) <= 2 * drop + 2 * every:
        raise UserError(f"the run is too short for a filter of {cutoff:g} Hz, which omits {END / cutoff:g} s at each end: raise the cutoff")
    q = low_pass(run.q, step, cutoff)
    qd = low_pass(run.q, step, cutoff, 1) if run.qd is None else low_pass(run.qd, step, cutoff)
    if run.qdd is not None:
        qdd = low_pass(run.qdd, step, cutoff)
    else:
        qdd = low_pass(run.q, step, cutoff, 2) if run.qd is None else low_pass(run.qd, step, cutoff, 1)
    # torques and regressor pass the same filter; then rows at the distance at which filtered noise is independent
    torques = low_pass(run.torques, step, cutoff)[::every]
    model, columns = plant.equations(q[::every], qd[::every], qdd[::every])
    model, columns = low_pass(model, every * step, cutoff), low_pass(columns, every * step, cutoff)
    kept = slice(-(-drop // every), -(-drop // every) * -1, max(1, int(0.5 / (cutoff * every * step))))
    text = f"zero-phase low-pass filter, 1/(1 + (f/{cutoff:g} Hz)^6), for motion, torques and regressor"
    difference = (torques - model)[kept]
    return columns[kept], difference, _rms(difference), text


def _consistent(
    plant: Plant, free: np.ndarray, base: Base, found: Estimate, values: np.ndarray, columns: np.ndarray, torque: np.ndarray
) -> Fit:
    """Returns the physically consistent parameters nearest to the model file; `torque` is the root mean square of each joint's torque."""
    start, many = plant.start(), 10 * len(plant.links)
    factors = {k: inner(start[k : k + 10], plant.size) for k in range(0, many, 10) if free[k]}
    factors = {k: factor for k, factor in factors.items() if factor is not None}
    losses = np.flatnonzero(free[many:]) + many
    # a loss that is a tenth of all torques of its joint
    sizes = np.sqrt(np.mean(columns[:, :, losses] ** 2, axis=0)).sum(axis=0)
    owners = [plant.joints.index(plant.names[k].rpartition(".")[0]) for k in losses]
    scales = np.where(sizes > 0, 0.1 * torque[owners] / np.where(sizes > 0, sizes, 1), 0)
    scales = np.maximum(scales, start[losses])
    scales[scales == 0] = 1
    return fit(Problem(start, list(factors), list(factors.values()), losses, scales, base.combine, values, found.information))


def _excitation(base: Base, found: Estimate) -> list[str]:
    """Warnings of a run that does not determine all base parameters."""
    hidden = [name for name, error in zip(base.names, found.errors, strict=True) if not np.isfinite(error)]
    if hidden:
        return [f"poor excitation: the run does not determine {listed(hidden)}; `--design` proposes a trajectory"]
    if found.condition > POOR:
        worst = base.names[int((found.errors * np.linalg.norm(found.information, axis=0)).argmax())]
        return [
            f"poor excitation: condition number {found.condition:.3g} of the scaled regressor is above {POOR:g}, mainly by {worst}; "
            "`--design` proposes a trajectory"
        ]
    return []


def _misfit(plant: Plant, found: Estimate, fitted: Fit, best: np.ndarray, left: np.ndarray) -> list[str]:
    """Warnings of torques that the parameters do not explain."""
    size = len(found.change)
    if fitted.distance <= size + 5 * np.sqrt(2 * size):
        return []
    j = int((_rms(left) / np.maximum(_rms(best), 1e-300)).argmax())
    reason = (
        "no physically consistent parameters agree with the base parameters"
        if fitted.converged
        else "the search for physically consistent parameters did not converge to the base parameters"
    )
    return [f"{reason}: torque '{plant.torques[j]}' has a residual of {_rms(left)[j]:.3g} instead of {_rms(best)[j]:.3g}"]


def _correlation(plant: Plant, best: np.ndarray) -> list[str]:
    """Warnings of residuals that are not independent noise."""
    both = (best[1:] * best[:-1]).mean(axis=0) / np.maximum((best**2).mean(axis=0), 1e-300)
    j = int(both.argmax())
    if both[j] <= CORRELATED:
        return []
    return [
        f"residuals of '{plant.torques[j]}' are correlated from row to row ({both[j]:.2f}): the model lacks an effect or the noise is "
        "coloured, and the standard errors are too small"
    ]


def _rms(values: np.ndarray) -> np.ndarray:
    return np.sqrt(np.mean(values**2, axis=0))
