"""Zero-phase low-pass filter and derivatives of measured signals, in the frequency domain."""

from __future__ import annotations

import numpy as np

from build_fmu.errors import UserError

ORDER = 6  # H = 1 / (1 + (f / cutoff)^6), real: no phase; 6e-5 of the amplitude is lost at a fifth of the cutoff
END = 2.0  # periods of the cutoff that are omitted at each end of the run
EQUAL = 1e-3  # relative differences of the step size
PER_PERIOD = 24  # rows per period of the cutoff at which the regressor, with its jumps of friction, is evaluated


def step_size(time: np.ndarray) -> float:
    """Returns the step size (s); raises UserError if the rows have no equal distance."""
    steps = np.diff(time)
    mean = (time[-1] - time[0]) / max(len(steps), 1)
    if len(steps) < 2 or abs(steps - mean).max() > EQUAL * mean:
        worst = int(abs(steps - mean).argmax()) if len(steps) else 0
        raise UserError(
            "derivatives require equal time steps, but the "
            + (f"step at t = {time[worst]:g} s is {steps[worst]:g} s (mean {mean:g} s)" if len(steps) > 1 else "run has fewer than 3 rows")
            + ": resample the run or give the columns .qd and .qdd"
        )
    return mean


def low_pass(signal: np.ndarray, step: float, cutoff: float, derivative: int = 0) -> np.ndarray:
    """Returns the filtered columns (rows first), or a derivative of them by time.

    The signal is continued at both ends by point reflection, so it stays continuous with its slope.
    """
    flat = signal.reshape(len(signal), -1)
    slope = (flat[-1] - flat[0]) / (len(flat) - 1)
    line = flat[0] + slope * np.arange(len(flat))[:, None]
    # without the line between its ends, the continued signal is odd and periodic; the filter keeps a line as it is
    rest = flat - line
    whole = np.concatenate([rest, -rest[-2:0:-1]])
    frequency = np.fft.rfftfreq(len(whole), step)
    response = (2j * np.pi * frequency) ** derivative / (1 + (frequency / cutoff) ** ORDER)
    smooth = np.fft.irfft(response[:, None] * np.fft.rfft(whole, axis=0), len(whole), axis=0)[: len(flat)]
    if derivative < 2:
        smooth += (line, slope / step)[derivative]
    return smooth.reshape(signal.shape)
