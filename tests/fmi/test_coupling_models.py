"""The models of gears and mimic joints in models/ against their reduced models in independent coordinates."""

from __future__ import annotations

import math

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from tests.fmi.raw import OK, Slave

G = 9.81


@pytest.fixture
def slave(fmu, instance):
    """Returns a function: name of a model, torques -> an initialised instance."""

    def initialized(name: str, torques: dict[str, float]) -> Slave:
        one = instance(fmu(name)).initialize(start={"solver.rtol": 1e-11, "solver.atol": 1e-13})
        for joint, torque in torques.items():
            assert one.set(f"{joint}.tau", torque) == OK
        return one

    return initialized


def course(one: Slave, joints: list[str], stop: float, size: float) -> tuple[np.ndarray, np.ndarray]:
    """Returns the times and the positions, one row a joint."""
    rows = [one.reals([f"{joint}.q" for joint in joints])]
    for k in range(round(stop / size)):
        assert one.step(k * size, size) == OK, one.errors
        rows.append(one.reals([f"{joint}.q" for joint in joints]))
    return np.arange(len(rows)) * size, np.array(rows).T


def solved(slope, start: list[float], times: np.ndarray) -> np.ndarray:
    return solve_ivp(slope, (0, times[-1]), start, t_eval=times, method="DOP853", rtol=1e-12, atol=1e-14).y


def no_gaps(one: Slave, *couplings: str) -> None:
    assert max(abs(one.get(f"{name}.gap")) for name in couplings) < 8e-12  # terms up to 1e4, four units in the last place


def test_the_planetary_gear_accelerates_by_its_reduced_inertia(slave):
    """At the sun: sun + (carrier + planets on their circle + planets turning at 1 - 60/18 of the carrier's speed) / 3.5^2."""
    turning = 1 - 60 / 18
    carrier = 6e-4 + 0.01 + 3 * 0.16 * 0.042**2 + 3 * 2.6e-5 * turning**2
    inertia, drag = 8.2e-5 + 1.2e-4 + carrier / 3.5**2, 2e-4 + 0.01 / 3.5**2
    one = slave("planetary_gear", {"sun": 0.5, "carrier": -0.35})
    torque, speed = 0.5 - 0.35 / 3.5, math.radians(2100)
    sun = (torque - drag * speed) / inertia
    planets = [-60 / 18 * sun / 3.5] * 3
    found = one.reals([f"{joint}.qdd" for joint in ("sun", "carrier", "planet1", "planet2", "planet3")])
    assert found == pytest.approx([sun, sun / 3.5, *planets], rel=1e-12)
    # the only force on the second and the third planet
    for mesh in ("ring_mesh2", "ring_mesh3"):
        assert 18 * one.get(f"{mesh}.lambda") == pytest.approx(2.6e-5 * turning * sun / 3.5, rel=1e-12)
    # with bearing friction: an exponential approach to torque / drag
    times, (angle, slow) = course(one, ["sun", "carrier"], 1, 0.1)
    fall = drag / inertia
    last = torque / drag
    expected = last * times + (speed - last) * (1 - np.exp(-fall * times)) / fall
    assert angle == pytest.approx(expected, rel=1e-9, abs=1e-9)
    assert slow == pytest.approx(angle / 3.5, abs=1e-11)
    no_gaps(one, "sun_mesh", "ring_mesh1", "ring_mesh2", "ring_mesh3")


def test_the_differential_wrist_pitches_by_the_mean_and_rolls_by_half_the_difference(slave):
    """Lagrange's equations in pitch and roll. The pitch axis is (sin roll, cos roll, 0) in axes of the hand."""
    motor, drag, (A, B, C), m, c = 2e-5 + 0.0125, 0.02, (1.9e-3, 2.6e-3, 1.1e-3), 0.9, 0.09
    weight = (m * c + 0.15 * 0.02) * G
    left, right = 0.2, -0.3

    def slope(_, y):
        pitch, roll, pitch_rate, roll_rate = y
        s, k = math.sin(roll), math.cos(roll)
        inertia = 2 * motor + 6e-5 + 0.15 * 0.02**2 + m * c**2 + A * s * s + B * k * k
        change = 2 * (A - B) * s * k
        return [
            pitch_rate,
            roll_rate,
            (left + right + weight * math.cos(pitch) - 2 * drag * pitch_rate - change * roll_rate * pitch_rate) / inertia,
            (left - right - 2 * drag * roll_rate + change * pitch_rate**2 / 2) / (2 * motor + C),
        ]

    one = slave("differential_wrist", {"left": left, "right": right})
    times, (q1, q2, pitch, roll) = course(one, ["left", "right", "pitch", "roll"], 2, 0.1)
    expected = solved(slope, [math.radians(-30), math.radians(20), 0, 0], times)
    assert pitch == pytest.approx(expected[0], abs=1e-8) and roll == pytest.approx(expected[1], abs=1e-8)
    assert pitch == pytest.approx((q1 + q2) / 2, abs=1e-11) and roll == pytest.approx((q1 - q2) / 2, abs=1e-11)
    no_gaps(one, "mean", "difference")


def test_one_torque_closes_and_opens_the_mimic_hand(slave):
    """One coordinate q: proximal phalanges at q, distal ones at 1.6 q from the vertical."""
    (m1, c1, i1), (m2, c2, i2), length, ratio = (0.06, 0.025, 1.5e-5), (0.03, 0.018, 5e-6), 0.05, 1.6

    def slope(torque, y):
        q, rate = y
        swing = m2 * length * c2 * ratio
        inertia = i1 + m1 * c1**2 + m2 * length**2 + (i2 + m2 * c2**2) * ratio**2 + 2 * swing * math.cos((ratio - 1) * q)
        change = -2 * swing * (ratio - 1) * math.sin((ratio - 1) * q)
        weight = G * ((m1 * c1 + m2 * length) * math.sin(q) + m2 * c2 * ratio * math.sin(ratio * q))
        motor = torque - 0.15 * (q - math.radians(-20)) - 0.02 * rate
        return [rate, (motor - 2 * weight - change * rate**2) / (2 * inertia + 4e-4)]

    one, state = slave("mimic_hand", {}), [math.radians(15), 0]
    for phase, torque in enumerate((0.0, 0.12, -0.03)):
        assert one.set("left_proximal.tau", torque) == OK
        state = solved(lambda _, y, torque=torque: slope(torque, y), state, np.array([0, 0.5]))[:, -1]
        assert one.step(phase * 0.5, 0.5) == OK, one.errors
        q = one.get("left_proximal.q")
        assert q == pytest.approx(state[0], abs=1e-9) and one.get("left_proximal.qd") == pytest.approx(state[1], abs=1e-8)
        assert math.degrees(q) > 15 if torque > 0 else math.degrees(q) < -12
        assert one.get("right_proximal.q") == pytest.approx(q, abs=1e-11)
        for distal in ("left_distal", "right_distal"):
            assert one.get(f"{distal}.q") == pytest.approx(0.6 * q, abs=1e-11)
    no_gaps(one, "left_linkage", "fingers", "right_linkage")
