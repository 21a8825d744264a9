"""Payload identification: mass and centre of mass at the tool of a KUKA KR5 from motion and noisy torques, by the FMU's inverse."""

from pathlib import Path

import numpy as np

import build_fmu as rds

NAMES = ["link6.mass", "link6.com[1]", "link6.com[2]", "link6.com[3]"]
TRUTH = np.array([2.5, 0.03, -0.02, 0.15])  # kg, m: flange with payload
random = np.random.default_rng(1)
m = rds.load(Path(__file__).parents[1] / "models" / "kuka_kr5.toml", tunable=NAMES)

# ten seconds of motion in all joints
t = np.arange(0, 10, 0.1)[:, None]
w = np.array([0.7, 0.9, 1.1, 1.7, 2.1, 2.3])
q, qd, qdd = 0.6 * np.sin(w * t), 0.6 * w * np.cos(w * t), -0.6 * w**2 * np.sin(w * t)


def torques(values):
    m.parameters = dict(zip(NAMES, values, strict=True))
    return m.inverse(q, qd, qdd).ravel()


noise = 0.05  # N m
measured = torques(TRUTH) + random.normal(0, noise, q.size)
estimate = np.array([1.0, 0, 0, 0.1])
for _ in range(6):  # Gauss-Newton
    now = torques(estimate)
    Y = np.column_stack([(torques(estimate + 1e-4 * d) - torques(estimate - 1e-4 * d)) / 2e-4 for d in np.eye(4)])
    estimate = estimate + np.linalg.lstsq(Y, measured - now, rcond=None)[0]
errors = noise * np.sqrt(np.diag(np.linalg.inv(Y.T @ Y)))
for name, value, error, true in zip(NAMES, estimate, errors, TRUTH, strict=True):
    print(f"{name:13} {value:8.4f} +- {error:.4f}   true {true:8.4f}")
