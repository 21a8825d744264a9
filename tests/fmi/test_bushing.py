"""Bushings: spring-dampers in six directions between two frames, against closed forms and the gradient of their potential."""

from __future__ import annotations

import math

import numpy as np
import pytest

from tests.crosscheck.scene_fmu import Library
from tests.fmi.raw import OK, Slave
from tests.fmi.test_sensors import turn, vector

RPY = (0.4, -0.7, 1.1)
AXES = turn(2, RPY[2]) @ turn(1, RPY[1]) @ turn(0, RPY[0])
K, C = [300.0, 500.0, 900.0, 2.0, 3.0, 5.0], [4.0, 3.0, 2.0, 0.1, 0.2, 0.3]
TIGHT = {"solver.rtol": 1e-11, "solver.atol": 1e-13}


@pytest.fixture(scope="module")
def library(fmu_file, tmp_path_factory) -> Library:
    fmu_file("pendulum")  # skips where nothing is built
    return Library(tmp_path_factory.mktemp("bushings"))


def body(q: list, qd: list | None = None, damping: list | None = None) -> str:
    """A block whose frame has the axes of the bushing where it has no force."""
    return f"""
name = "mount"
gravity = [0, 0, 0]
link = [{{name = "block", joint = "free", mass = 2, inertia = [0.1, 0.1, 0.1], q = {[float(x) for x in q]}, qd = {qd or [0] * 6}}}]
[[bushing]]
name = "mount"
link_a = "ground"
link_b = "block"
point_a = [1, 2, 3]
rpy_a = {list(RPY)}
rpy_b = {list(RPY)}
stiffness = {K}
damping = {damping or [0] * 6}
"""


def quaternion(axis, angle: float) -> list[float]:
    return [math.cos(angle / 2), *(math.sin(angle / 2) * np.asarray(axis))]


@pytest.mark.parametrize("k", range(3))
def test_a_displacement_along_an_axis_is_answered_along_it(library, k):
    library.load(body([*(np.array([1, 2, 3]) + 0.02 * AXES[:, k]), 1, 0, 0, 0]))
    values, _ = library.start({})
    found = np.array([values[f"block[{i}].qdd"] for i in (1, 2, 3)])
    assert found == pytest.approx(-K[k] * 0.02 / 2 * AXES[:, k], rel=1e-12, abs=1e-13)
    assert vector(values, "block.alpha") == pytest.approx([0, 0, 0], abs=1e-12)
    assert values["energy.potential"] == pytest.approx(K[k] * 0.02**2 / 2, rel=1e-12)


@pytest.mark.parametrize("angle", [1e-6, 0.3, -1.5, 3.1, -3.14])
@pytest.mark.parametrize("k", range(3))
def test_a_turn_about_an_axis_has_the_torque_stiffness_times_angle(library, k, angle):
    library.load(body([1, 2, 3, *quaternion(AXES[:, k], angle)]))
    values, _ = library.start({})
    # the axis is the same in the frame of the block
    assert vector(values, "block.alpha") == pytest.approx(-K[3 + k] * angle / 0.1 * AXES[:, k], rel=1e-12, abs=1e-13)
    assert values["energy.potential"] == pytest.approx(K[3 + k] * angle**2 / 2, rel=1e-12, abs=1e-15)


@pytest.mark.parametrize("k", range(6))
def test_a_free_block_oscillates_as_a_damped_mass(library, k):
    """x = x0 exp(-d t) (cos w t + d / w sin w t), d = c / 2m, w^2 = k / m - d^2."""
    start, inertia = 0.1, 2 if k < 3 else 0.1
    moved = [*(np.array([1, 2, 3]) + start * AXES[:, k]), 1, 0, 0, 0] if k < 3 else [1, 2, 3, *quaternion(AXES[:, k - 3], start)]
    library.load(body(moved, damping=C))
    d = C[k] / (2 * inertia)
    w = math.sqrt(K[k] / inertia - d * d)
    with Slave(library) as slave:
        slave.initialize(start=TIGHT)
        for i in range(10):
            assert slave.step(0.05 * i, 0.05) == OK
        t = 0.5
        x = start * math.exp(-d * t) * (math.cos(w * t) + d / w * math.sin(w * t))
        if k < 3:
            found = AXES[:, k] @ (np.array([slave.get(f"block[{i}].q") for i in (1, 2, 3)]) - [1, 2, 3])
        else:
            found = 2 * math.asin(AXES[:, k - 3] @ [slave.get(f"block.quaternion[{i}]") for i in (2, 3, 4)])
        assert found == pytest.approx(x, abs=1e-9)
        assert abs(slave.get("energy.balance")) < 1e-9


# a bushing between two bodies of a chain and one to the ground, far from small rotations
CHAIN = """
name = "chain"
gravity = [0, 0, 0]
inverse = true
link = [
  {name = "a", joint = "universal", mass = 1, com = [0.1, 0.2, 0.3], inertia = [0.1, 0.2, 0.25]},
  {name = "b", joint = "prismatic", alpha = 0.5, a = 0.3, mass = 1, com = [0.1, 0, 0]},
  {name = "c", joint = "universal", alpha = 1, a = 0.2, d = 0.1, theta = 0.3, mass = 1, inertia = [0.1, 0.1, 0.15]},
]
[[bushing]]
name = "one"
link_a = "a"
link_b = "c"
point_a = [0.3, 0.1, 0]
point_b = [0, 0.2, 0.1]
rpy_a = [0.2, 0.4, -0.3]
rpy_b = [-1, 0.5, 0.8]
stiffness = [30, 50, 90, 2, 3, 5]
[[bushing]]
name = "two"
link_a = "c"
link_b = "ground"
point_b = [0.5, 0.5, 0.2]
rpy_a = [1, 2, 3]
stiffness = [10, 20, 15, 7, 1, 4]
"""


def test_forces_are_the_gradient_of_the_potential(library):
    """Inverse dynamics at rest, against differences of energy.potential."""
    library.load(CHAIN)
    joints = ["a[1]", "a[2]", "b", "c[1]", "c[2]"]

    def at(q) -> dict[str, float]:
        return library.start({f"{joint}.q": x for joint, x in zip(joints, q, strict=True)})[0]

    for q in ([0.1, -0.2, 0.1, 0.3, 0.2], [1.2, -0.9, -0.2, 0.8, -1.4], [-2.1, 1.1, 0.3, 2.0, 0.7]):
        tau = [at(q)[f"{joint}.tau"] for joint in joints]
        for k in range(5):
            far, near, near_, far_ = (
                at([x + step * 1e-3 * (i == k) for i, x in enumerate(q)])["energy.potential"] for step in (-2, -1, 1, 2)
            )
            slope = (8 * (near_ - near) - (far_ - far)) / 12e-3
            assert tau[k] == pytest.approx(slope, rel=1e-9, abs=1e-8)


def test_two_free_bodies_keep_their_momentum_and_energy(library):
    """Force and torque act on both bodies at one point."""
    free = lambda name, q, qd: (
        f'{{name = "{name}", parent = "ground", joint = "free", mass = 1.5, com = [0.1, 0, 0.1], inertia = [0.1, 0.2, 0.25], q = {q}, qd = {qd}}}'
    )
    library.load(f"""
name = "pair"
gravity = [0, 0, 0]
link = [{free("a", [0, 0, 0, 0.3, 0.2, 0.1], [1, 0, 0.5, 1, -2, 3])}, {free("b", [0.5, 0.2, 0, -0.5, 0.4, 0.9], [0, 1, 0, 0.5, 1, -1])}]
[[bushing]]
name = "joint"
link_a = "a"
link_b = "b"
point_a = [0.3, 0, 0.1]
rpy_a = [0.1, 0.2, 0.3]
stiffness = {[k / 10 for k in K]}
damping = {[c / 10 for c in C]}
[fmu]
outputs = ["energy", "momentum"]
""")
    with Slave(library) as slave:
        slave.initialize(start=TIGHT)
        names = [f"momentum.{what}[{k}]" for what in ("linear", "angular") for k in (1, 2, 3)]
        before, energy = slave.reals(names), slave.get("energy.total")
        slave.run(1, 0.05)
        assert slave.reals(names) == pytest.approx(before, abs=1e-9)
        assert abs(slave.get("energy.balance")) < 1e-9 and slave.get("energy.total") < energy - 0.1
