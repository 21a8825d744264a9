"""Loops that pass singular configurations, where two branches of motion meet."""

from __future__ import annotations

import numpy as np
import pytest

from build_fmu.report.sweep import METHODS
from tests.fmi.raw import Slave

JOINTS = ("crank", "rocker", "second")

GEARED_PARALLELOGRAM = """
name = "geared_parallelogram"
gravity = [0, -9.81, 0]
solver = { rtol = 1e-9 }

[[link]]
name = "crank"
parent = "ground"
gamma = 0.4
mass = 1
com = [0.2, 0, 0]
inertia = [0.001, 0.02, 0.02]
q = 0.9
qd = -5

[[link]]
name = "coupler"
parent = "crank"
drive = "free"
a = 0.4280604040144832
mass = 1.5
com = [0.25, 0.05, 0]
inertia = [0.001, 0.04, 0.04]
q = -0.9
qd = 5

[[link]]
name = "rocker"
parent = "ground"
drive = "free"
gamma = 0.56339038727075283
a = 0.5353688251239954
mass = 1
com = [0.2, 0.02, 0]
inertia = [0.001, 0.02, 0.02]
q = 0.73660961272924717
qd = -5

[[link]]
name = "wheel"
parent = "ground"
alpha = 0.7
mass = 2
inertia = [0.02, 0.02, 0.02]
qd = 3.8619402985

[[link]]
name = "second"
parent = "ground"
alpha = 1.1
mass = 2
com = [0.1, 0, 0]
inertia = [0.03, 0.03, 0.03]
q = 0.5
qd = 4
"""
PIN = """
[[loop]]
name = "pin"
type = "revolute"
link_a = "coupler"
link_b = "rocker"
point_a = [0.5282384940346811, 0.08708543124208137, 0]
point_b = [0.4280604040144832, 0, 0]
"""
PARALLEL = """
[[coupling]]
name = "parallel"
joints = ["crank", "rocker"]
ratios = [1, -1]
offset = 0.16339038727075283

[[coupling]]
name = "translation"
joints = ["crank", "coupler"]
ratios = [1, 1]
"""
GEAR = """
[[coupling]]
name = "gear"
joints = ["second", "rocker", "wheel", "crank"]
ratios = [-0.65, -0.52, 2.68, 2.07]
offset = 1.1549630013807914
"""


def positions(slave: Slave) -> np.ndarray:
    return np.array(slave.reals([f"{joint}.q" for joint in JOINTS]))


@pytest.mark.parametrize("method", METHODS)
def test_a_geared_parallelogram_stays_on_its_branch(built, method):
    """Flat configurations at any place within a step. On the branch the loop is equal to two rigid couplings, which are never singular.

    Columns of the gear without a lever of the loop kept a dependent row: most runs lost or gained several J.
    """
    stop = 1.5
    with Slave(built(GEARED_PARALLELOGRAM + PARALLEL + GEAR)) as slave:
        slave.initialize(start={"solver.method": "erk"})
        slave.run(stop, stop)
        expected = positions(slave)
    for exponent in (0, 1, 4, 8, 19):
        steps = round(stop / (0.001 * 1.15**exponent))
        with Slave(built(GEARED_PARALLELOGRAM + PIN + GEAR)) as slave:
            slave.initialize(start={"solver.method": method})
            slave.run(stop, stop / steps)
            assert abs(slave.get("energy.balance")) < 1e-6
            assert np.abs(positions(slave) - expected).max() < 2e-6
