"""The contact models of models/ against closed forms and conservation laws."""

from __future__ import annotations

import math
from itertools import pairwise

import pytest
from scipy.integrate import quad, solve_ivp

from tests.fmi.raw import OK, Slave

G = 9.81


@pytest.fixture
def slave(fmu, instance):
    """Returns a function: name of a model, tolerance and start values -> an initialised instance."""

    def initialized(name: str, rtol: float = 1e-9, start: dict[str, float] | None = None) -> Slave:
        return instance(fmu(name)).initialize(start={"solver.rtol": rtol, "solver.atol": rtol / 100, **(start or {})})

    return initialized


def friction_of(contact: str, coefficient: float) -> dict[str, float]:
    return {f"{contact}.friction": coefficient, f"{contact}.static_friction": coefficient}


def rebound(v: float, k: float, damping: float, width: float) -> float:
    """Velocity after a contact that begins with v, with weight; quantities per mass."""

    def slope(_, y):
        u, s = y[0] / width, damping * y[1]
        h = width * (u**3 - u**4 / 2 if 0 < u < 1 else max(u - 0.5, 0))
        return [y[1], G - k * h * (s + math.hypot(1, s))]

    def left(_, y):
        return y[0]

    left.terminal, left.direction = True, -1
    return -solve_ivp(slope, (0, 1), [1e-12, v], events=left, rtol=1e-11, atol=1e-14, max_step=1e-3, method="DOP853").y[1, -1]


def test_the_bouncing_ball_loses_what_its_damping_says(slave):
    one, flights = slave("bouncing_ball"), []
    for k in range(300):
        assert one.step(k * 0.01, 0.01) == OK, one.errors
        energy = one.get("energy.total") / 0.058
        if one.get("floor.depth") < 0 and (not flights or flights[-1] - energy > 1e-3):
            flights.append(energy)
    speeds = [math.sqrt(2 * (energy - G * 0.0335)) for energy in flights]
    assert speeds[0] == pytest.approx(math.sqrt(2 * G), rel=1e-6) and len(speeds) >= 4
    for v, after in pairwise(speeds):
        assert after == pytest.approx(rebound(v, 3e4 / 0.058, 0.06, 1e-4), abs=1e-6)


def test_the_block_creeps_above_the_angle_of_friction(slave):
    for friction in (0.5, 0.365):
        one = slave("incline_block", start=friction_of("slope", friction))
        assert one.step(0, 2.0) == OK, one.errors
        creep = 1e-3 * math.atanh(math.tan(math.radians(20)) / friction) / 4
        assert one.get("center.velocity[1]") == pytest.approx(creep, abs=1e-9)


@pytest.mark.parametrize("friction", [0.3, 0.363])
def test_the_block_slides_below_it(slave, friction):
    """While it slides fast, m v_x' = m g_x - mu N and m v_z' = N - m g_z in any vibration of N."""
    v = 0.1
    one = slave("incline_block", rtol=1e-10, start=friction_of("slope", friction) | {"block[1].qd0": v})
    assert one.step(0, 1.0) == OK, one.errors
    down, normal = G * math.sin(math.radians(20)), G * math.cos(math.radians(20))
    rise = one.get("center.velocity[3]")
    assert one.get("center.velocity[1]") == pytest.approx(v + down - friction * (normal + rise), abs=1e-9)
    path = v + down / 2 - friction * (normal / 2 + one.get("center.position[3]") - 0.05)
    assert one.get("center.position[1]") == pytest.approx(path, abs=1e-9)


@pytest.mark.parametrize("count", [1, 2])
def test_as_many_balls_leave_the_cradle_as_have_met_it(slave, count):
    released = {f"ball{k}.q0": -math.radians(40) for k in range(1, count + 1)}
    one, highest = slave("newtons_cradle", rtol=1e-10, start=released), [0.0] * 5
    for k in range(85):
        assert one.step(k * 0.01, 0.01) == OK, one.errors
        if k >= 35:
            highest = [max(high, math.degrees(abs(one.get(f"ball{i}.q")))) for i, high in enumerate(highest, 1)]
    assert highest[5 - count :] == pytest.approx([40] * count, abs=0.3)
    assert max(highest[: 5 - count]) < 0.6
    assert abs(one.get("energy.balance")) < 1e-8


def test_the_wheel_spins_then_rolls(slave):
    one = slave("driven_wheel", start={"wheel.qd0": 300})
    for k in range(30):
        assert one.step(k * 0.01, 0.01) == OK, one.errors
        # friction is mu N at any torque
        gained = 0.8 * (G * (k + 1) * 0.01 + one.get("fork.qd"))
        assert one.get("tyre.slip") > 0.05 and one.get("track.qd") == pytest.approx(gained, abs=1e-8)
    assert one.step(0.3, 9.7) == OK, one.errors
    assert one.get("track.qd") == pytest.approx(20 * (0.3 - one.get("tyre.depth") / 2), abs=1e-7)
    assert one.get("tyre.slip") < 1e-6


@pytest.mark.parametrize("part", [1.02, 0.98])
def test_the_gripper_holds_the_box_above_its_threshold(slave, part):
    """F is the force of the controller; the threshold of friction is m g / (2 F)."""
    one, settled = slave("parallel_gripper", rtol=1e-9), 1.4
    assert one.step(0, settled) == OK, one.errors
    assert one.get("box[3].q") == pytest.approx(0.25, abs=1e-3)
    force = 5000 * (one.get("left.q_ref") - one.get("left.q"))
    threshold = 0.5 * G / (2 * force)
    for pad in ("left_pad", "right_pad"):
        for name, value in friction_of(pad, part * threshold).items():
            assert one.set(name, value) == OK
    velocities = []
    for k in range(2):
        assert one.step(settled + k * 0.1, 0.1) == OK, one.errors
        velocities.append(one.get("box[3].qd"))
    if part > 1:
        assert velocities[1] == pytest.approx(-1e-3 * math.atanh(1 / part) / 4, abs=1e-9)
    else:
        assert velocities[1] - velocities[0] == pytest.approx(-(1 - part) * G * 0.1, abs=1e-8)


def test_steps_of_bdf_grow_soon_after_a_contact_sticks(slave):
    """Sticking begins within microseconds. With CVODE's own bound of growth the ball takes a tenth more right-hand sides."""
    one = slave("rolling_ball", rtol=1e-8, start={"solver.method": "bdf", "solver.atol": 1e-8})
    for k in range(200):
        assert one.step(k * 0.01, 0.01) == OK, one.errors
    assert one.get("solver.rhs_evaluations") < 15400


def test_the_block_rocks_as_housner_found(slave):
    """The time until the first impact, and the angular velocity that remains after it."""
    alpha, theta = math.atan(0.1 / 0.4), math.radians(7)
    p2 = 50 * G * math.hypot(0.1, 0.4) / (2.8333 + 50 * (0.1**2 + 0.4**2))
    speed = lambda angle: math.sqrt(2 * p2 * (math.cos(alpha - theta) - math.cos(alpha - angle)))
    # substitution angle = theta (1 - u^2): without a singularity at the start
    impact = quad(lambda u: 2 * theta * u / speed(theta * (1 - u * u)), 0, 1)[0]
    # a stiff floor: compared with the rigid limit
    one, angles = slave("rocking_block", rtol=1e-7), []
    for k in range(300):
        assert one.step(k * 0.002, 0.002) == OK, one.errors
        angles.append(one.get("block[3].q"))
    after = next(k for k, angle in enumerate(angles) if angle > 0)
    share = angles[after] / (angles[after] - angles[after - 1])
    assert 0.002 * (after + 1 - share) == pytest.approx(impact, rel=2e-4)
    remains = speed(0) * (1 - 1.5 * math.sin(alpha) ** 2)
    highest = alpha - math.acos(remains**2 / (2 * p2) + math.cos(alpha))
    assert max(angles) == pytest.approx(highest, rel=1e-3)
