"""ReDySim's contact law, whose force jumps at a touch-down: the motion of a falling point against its closed form, until it is lowest."""

from __future__ import annotations

import math

import numpy as np
import pytest

from tests.fmi.raw import OK, Slave

MASS, STIFFNESS, DAMPING, DEPTH = 2.0, 4000.0, 60.0, 1e-5
GRAVITY, HEIGHT = 9.81, 0.37
MODEL = f"""name = "drop"
gravity = [0, 0, -{GRAVITY}]
[[link]]
name = "point"
joint = "prismatic"
mass = {MASS}
q = {HEIGHT}
[[contact]]
name = "foot"
link_a = "point"
shape_a = "points"
points_a = [[0, 0, 0]]
law = "redysim"
K = {STIFFNESS}
Cv = {DAMPING}
v_max = 3
mu = 0
Ch = 100
[fmu]
outputs = ["energy"]
"""


def fallen(time: float) -> tuple[float, float]:
    """Height and velocity: free fall, then a damped spring from the depth at which the force begins."""
    touch = math.sqrt(2 * (HEIGHT + DEPTH) / GRAVITY)
    if time <= touch:
        return HEIGHT - 0.5 * GRAVITY * time**2, -GRAVITY * time
    rest, decay = -MASS * GRAVITY / STIFFNESS, 0.5 * DAMPING / MASS
    pulse = math.sqrt(STIFFNESS / MASS - decay**2)
    first, t = -DEPTH - rest, time - touch
    other = (-GRAVITY * touch + decay * first) / pulse
    cosine, sine = math.cos(pulse * t), math.sin(pulse * t)
    rate = (pulse * other - decay * first) * cosine - (pulse * first + decay * other) * sine
    return rest + math.exp(-decay * t) * (first * cosine + other * sine), math.exp(-decay * t) * rate


@pytest.mark.parametrize("rtol", [1e-4, 1e-6, 1e-8])
@pytest.mark.parametrize("method", ["erk", "adams", "dirk", "bdf", "auto"])
def test_a_touch_down_is_exact(built, method, rtol):
    errors, balances = [], []
    with Slave(built(MODEL)) as slave:
        slave.initialize(start={"solver.method": method, "solver.rtol": rtol, "solver.atol": rtol / 100})
        for k in range(29):
            assert slave.step(0.01 * k, 0.01) == OK
            errors.append(np.subtract(slave.reals(["point.q", "point.qd"]), fallen(0.01 * (k + 1))))
            balances.append(slave.get("energy.balance"))
    height, velocity = np.abs(errors).max(axis=0)
    # of 0.37 m, 2.7 m/s and 7.3 J
    assert height < 3 * rtol and velocity < 50 * rtol and np.abs(balances).max() < 50 * rtol
