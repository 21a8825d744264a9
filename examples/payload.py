"""Payload identification: the parameters of the tool of a KUKA KR5 from motion and noisy torques, with standard errors."""

from pathlib import Path

import numpy as np

import build_fmu as rds

MASS, COM = 2.5, np.array([0.03, -0.02, 0.15])  # kg, m: flange with payload
NAMES = ["link6.mass", "link6.com[1]", "link6.com[2]", "link6.com[3]"]
random = np.random.default_rng(1)
m = rds.load(Path(__file__).parents[1] / "models" / "kuka_kr5.toml", tunable=NAMES)

# ten seconds of motion in all joints
t = np.arange(0, 10, 0.1)[:, None]
w = np.array([0.7, 0.9, 1.1, 1.7, 2.1, 2.3])
q, qd, qdd = 0.6 * np.sin(w * t), 0.6 * w * np.cos(w * t), -0.6 * w**2 * np.sin(w * t)

# the measurement, of an arm that the identification does not know
m.parameters = dict(zip(NAMES, [MASS, *COM], strict=True))
measured = m.inverse(q, qd, qdd) + random.normal(0, 0.05, q.shape)  # N m
m.parameters = {}

result = m.identify(t, q, measured, qd, qdd, parameters=["link6"])
true = [MASS, *(MASS * COM)]
for name, value, error, truth in zip(result.names[:4], result.values, result.errors, true, strict=False):
    unit = "kg" if name.endswith(".m") else "kg m"  # mass, or mass times center of mass
    print(f"{name:9} {value:9.5f} +- {error:.5f}   true {truth:9.5f} {unit}")
