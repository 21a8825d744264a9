"""Model exchange: start orientations of any length, and their derivatives."""

from __future__ import annotations

import numpy as np
import pytest

from tests.fmi.raw import MODEL_EXCHANGE, OK, Slave
from tests.fmi.test_directional import derivative, differences

# a spinning body in a tree, and beside two coupled joints: then start values are assembled
SPINNING = """name = "spinning"
[[link]]
name = "body"
joint = "spherical"
drive = "free"
mass = 1
inertia = [0.1, 0.2, 0.3]
qd = [0.5, -0.3, 2]
"""
COUPLED = """
[[link]]
name = "driver"
parent = "ground"
mass = 1
inertia = [0.1, 0.1, 0.1]
[[link]]
name = "follower"
parent = "ground"
mass = 1
inertia = [0.1, 0.1, 0.1]
[[coupling]]
name = "pair"
joints = ["driver", "follower"]
ratios = [1, -1]
"""


@pytest.mark.parametrize("more", ["", COUPLED])
def test_rates_of_a_start_orientation_of_any_length(built, more):
    """The state has unit length, and so have the rates and their derivatives by the start value."""
    orientation = [f"body.quaternion0[{i}]" for i in (1, 2, 3, 4)]
    rates = [f"body.quaternion_rate[{i}]" for i in (1, 2, 3, 4)]
    length = 1.1
    with Slave(built(SPINNING + more), kind=MODEL_EXCHANGE) as slave:
        assert (slave.setup(), slave.call("EnterInitializationMode")) == (OK, OK)
        start = length * np.array([0.5, -0.5, 0.1, 0.7]) / np.linalg.norm([0.5, -0.5, 0.1, 0.7])
        for name, value in zip(orientation, start, strict=True):
            slave.set(name, value)
        q, omega = start / length, np.array([slave.get(f"body.omega[{i}]") for i in (1, 2, 3)])
        expected = 0.5 * np.array([-q[1:] @ omega, *(q[0] * omega + np.cross(q[1:], omega))])
        assert slave.reals(rates) == pytest.approx(expected, abs=1e-14)
        for name in orientation:
            assert derivative(slave, rates, {name: 1}) == pytest.approx(differences(slave, rates, {name: 1}), abs=1e-8)
        before = slave.reals(rates)
        assert slave.call("ExitInitializationMode") == OK
        assert slave.reals(rates) == pytest.approx(before, abs=1e-14)
