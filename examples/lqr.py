"""A linear-quadratic regulator holds a double pendulum upright; the FMU's model gives its matrices. Torque on both joints."""

from pathlib import Path

import numpy as np

import build_fmu as rds

STEP, STEPS = 0.01, 300  # s, 1
m = rds.load(Path(__file__).parents[1] / "models" / "double_pendulum.toml")
goal = m.state(q=[np.pi / 2, 0], qd=[0, 0])  # upright: gravity points to -y
held = m.hold(goal)
A, B = m.linearise(goal, held, STEP)

# the Riccati equation of the sampled system, by iteration
Q, R = np.diag([10.0, 10, 1, 1]), 0.01 * np.eye(2)
P = Q
for _ in range(2000):
    K = np.linalg.solve(R + B.T @ P @ B, B.T @ P @ A)
    P = Q + A.T @ P @ (A - B @ K)

x = goal + [0.3, -0.3, 0, 0]
for k in range(STEPS):
    if k % 50 == 0:
        print(f"{k * STEP:.1f} s   largest error (rad, rad/s) {abs(x - goal).max():.1e}")
    x = m.step(x, held - K @ (x - goal), STEP)
print(f"{STEPS * STEP:.1f} s   largest error (rad, rad/s) {abs(x - goal).max():.1e}")
print(f"largest eigenvalue {abs(np.linalg.eigvals(A)).max():.3f}, with the regulator {abs(np.linalg.eigvals(A - B @ K)).max():.3f}")
