"""Motions of trajectories after a rest: no step passes one unseen, whatever the method."""

from __future__ import annotations

import numpy as np
import pytest

import build_fmu
from tests.fmi.conftest import ROOT
from tests.fmi.raw import OK, Slave

# An arm under PD control without gravity rests, and moves 0.5 rad and back in 0.6 s.
FOLLOWER = """
name = "follower"
gravity = [0, 0, 0]
[[link]]
name = "arm"
mass = 1
com = [0.25, 0, 0]
inertia = [0.02, 0.02, 0.02]
TRAJECTORY
[controller]
law = "pd"
kp = 1000
kd = 100
[solver]
method = "METHOD"
[fmu]
outputs = ["energy", "solver"]
"""
REST = "[0, 0, 0, 0, 0]"
MOVES = {
    "table": f"type = 'table'\ntime = [0, 6, 6.3, 6.6, 12]\nq = [0, 0, 0.5, 0, 0]\nqd = {REST}\nqdd = {REST}",
    "polynomial": "type = 'polynomial'\ncoefficients = [0, 0, 0, 1000, -5000, 8333.333333333334, -4629.62962962963]\nstart = 6\nduration = 0.6",
    "cycloid": "type = 'cycloid'\nto = 0.5\nstart = 6\nduration = 0.3",
}

# A paddle on a trajectory reaches a ball at rest at 1 m.
PADDLE = """
name = "paddle"
gravity = [0, 0, 0]
[[link]]
name = "paddle"
joint = "prismatic"
drive = "motion"
mass = 1
[[link]]
name = "ball"
parent = "ground"
joint = "prismatic"
q = 1
mass = 1
[[contact]]
name = "touch"
link_a = "paddle"
shape_a = "sphere"
radius_a = 0.1
link_b = "ball"
shape_b = "sphere"
radius_b = 0.1
stiffness = 1e5
width = 1e-4
[[trajectory]]
joint = "paddle"
type = "TYPE"
to = 2
start = 1
duration = 0.3
[solver]
method = "METHOD"
[fmu]
outputs = ["energy", "solver"]
"""

# A pendulum on a drive at 50 rad/s: the force of the drive changes faster than the state.
FAN = """
name = "fan"
link = [
  {name = "hub", drive = "motion", alpha = 1.5707963267948966, mass = 1, com = [0.3, 0, 0]},
  {name = "blade", alpha = 1.5707963267948966, a = 0.5, mass = 1, com = [0.3, 0, 0], inertia = [0.01, 0.01, 0.01]},
]
trajectory = [{joint = "hub", type = "speed", speed = 50}]
[solver]
method = "METHOD"
[fmu]
outputs = ["energy"]
"""


@pytest.fixture
def run(tmp_path):
    def result(text: str, stop: float, step: float):
        path = tmp_path / "model.toml"
        path.write_text(text, encoding="utf-8")
        with build_fmu.load(path) as model:
            return model.simulate(stop, step)

    return result


@pytest.mark.parametrize("kind", MOVES)
@pytest.mark.parametrize("method", ["adams", "bdf", "auto"])
def test_a_controlled_joint_follows_a_move_after_a_rest(run, method, kind):
    text = FOLLOWER.replace("TRAJECTORY", "[[trajectory]]\njoint = 'arm'\n" + MOVES[kind])
    result, reference = (run(text.replace("METHOD", name), 8, 0.01) for name in (method, "erk"))
    assert np.ptp(reference["arm.q"]) > 0.4
    assert np.abs(result["arm.q"] - reference["arm.q"]).max() < 1e-4
    assert np.abs(result["energy.balance"]).max() < 1e-4


@pytest.mark.parametrize("method", ["adams", "bdf", "auto"])
def test_the_loop_of_a_driven_four_bar_follows_its_crank(run, method):
    text = (ROOT / "models/four_bar.toml").read_text().replace("hold = true", 'drive = "motion"')
    text = text[: text.index("[report]")] + "[[trajectory]]\njoint = 'crank_joint'\n" + MOVES["table"]
    result = run(text.replace("rtol = 1e-8", f'method = "{method}"'), 8, 0.01)
    crank, tilt = result["crank_joint.q"], result["joint2.q"]
    assert np.ptp(crank) > 0.4
    # the pin of the coupler is on the circle of the rocker's tip
    x, y = 0.05 * np.cos(crank) - 0.15 - 0.13 * np.cos(tilt), 0.05 * np.sin(crank) - 0.13 * np.sin(tilt)
    assert np.abs(np.hypot(x, y) - 0.1).max() < 1e-8
    at = np.abs(result.time - 6.3).argmin()
    assert abs(tilt[at] - tilt[0]) > 0.05
    assert np.abs(result["energy.balance"]).max() < 1e-4


@pytest.mark.parametrize(
    "text", [FOLLOWER.replace("TRAJECTORY", "[[trajectory]]\njoint = 'arm'\n" + MOVES["table"]), PADDLE.replace("TYPE", "quintic")]
)
@pytest.mark.parametrize("method", ["adams", "bdf", "auto"])
def test_a_state_saved_in_a_move_repeats_the_run_bit_for_bit(built, method, text):
    fmu = built(text.replace("METHOD", method))
    joint = "arm.q" if "arm" in text else "ball.q"
    save, end = (617, 680) if "arm" in text else (117, 180)

    def drive(slave, first, last):
        values = []
        for k in range(first, last):
            assert slave.step(k / 100, 0.01) == OK, slave.errors
            values.append((slave.get(joint), slave.get("energy.balance")))
        return values

    with Slave(fmu) as slave, Slave(fmu) as other, Slave(fmu) as fresh:
        slave.initialize()
        other.initialize()
        drive(slave, 0, save)
        expected = drive(other, 0, end)[save:]
        assert np.ptp([q for q, _ in expected]) > 0.1
        content = slave.serialize(slave.save())
        assert drive(slave, save, end) == expected
        status, copy = fresh.deserialize(content)
        assert status == OK
        assert fresh.call("SetFMUstate", copy) == OK
        assert drive(fresh, save, end) == expected


@pytest.mark.parametrize("step", [0.001, 2])
@pytest.mark.parametrize("kind", ["quintic", "cycloid"])
@pytest.mark.parametrize("method", ["erk", "adams", "bdf", "dirk", "auto"])
def test_a_paddle_on_a_trajectory_hits_a_ball(run, method, kind, step):
    text = PADDLE.replace("TYPE", kind)
    result = run(text.replace("METHOD", method), 2, step)
    reference = run(text.replace('"METHOD"', '"erk"\nrtol = 1e-9\nmax_step = 1e-3'), 2, 2)
    assert reference["ball.q"][-1] > 2
    assert abs(result["ball.q"][-1] - reference["ball.q"][-1]) < 1e-3


@pytest.mark.parametrize("method", ["erk", "dirk", "auto"])
def test_the_work_of_a_drive_is_part_of_the_error_test(run, method):
    result = run(FAN.replace("METHOD", method), 2, 0.5)
    assert np.abs(result["energy.work"]).max() > 1
    assert np.abs(result["energy.balance"]).max() < 1e-5 * result["energy.total"].max()
