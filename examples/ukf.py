"""An unscented Kalman filter: angles and velocities of a falling double pendulum from noisy angles, predicted by the FMU."""

from pathlib import Path

import numpy as np

import build_fmu as rds

STEP, STEPS, NOISE = 0.01, 200, 0.02  # s, 1, rad
random = np.random.default_rng(1)
m = rds.load(Path(__file__).parents[1] / "models" / "double_pendulum.toml")
n, seen = len(m.states), len(m.positions)
H, process, noise = np.eye(seen, n), np.diag([1e-8] * seen + [1e-5] * seen), NOISE**2 * np.eye(seen)

truth = m.start()
deviation = np.array([0.1] * seen + [1.0] * seen)
estimate, covariance = truth + random.normal(0, deviation), np.diag(deviation**2)
errors, measured = [], []
for _ in range(STEPS):
    # symmetric sigma points with equal weights
    spread = np.linalg.cholesky(n * covariance).T
    moved = np.array([m.step(point, None, STEP) for point in (*(estimate + spread), *(estimate - spread))])
    estimate = moved.mean(axis=0)
    covariance = (moved - estimate).T @ (moved - estimate) / (2 * n) + process

    truth = m.step(truth, None, STEP)
    measurement = truth[:seen] + random.normal(0, NOISE, seen)
    gain = np.linalg.solve(H @ covariance @ H.T + noise, H @ covariance).T
    estimate = estimate + gain @ (measurement - H @ estimate)
    covariance = (np.eye(n) - gain @ H) @ covariance
    covariance = (covariance + covariance.T) / 2
    errors.append(estimate - truth)
    measured.append(measurement - truth[:seen])

rms = lambda rows: float(np.sqrt(np.mean(np.square(rows[STEPS // 2 :]))))
print(f"rms error of angles: measured {rms(measured):.4f} rad, filtered {rms(np.array(errors)[:, :seen]):.4f} rad")
print(f"rms error of velocities: filtered {rms(np.array(errors)[:, seen:]):.3f} rad/s")
