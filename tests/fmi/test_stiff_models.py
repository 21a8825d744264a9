"""The stiff models of models/ against statics and closed forms written by hand."""

from __future__ import annotations

import itertools
import math

import numpy as np
import pytest

from tests.fmi.conftest import ROOT
from tests.fmi.raw import ERROR, OK, Slave


def run(slave: Slave, names: list[str], stop: float, size: float) -> dict[str, np.ndarray]:
    rows = [slave.reals(names)]
    for k in range(round(stop / size)):
        assert slave.step(k * size, size) == OK, slave.errors
        rows.append(slave.reals(names))
    return dict(zip(names, np.array(rows).T, strict=True))


def changed(model: str, *replacements: tuple[str, str]) -> str:
    """Returns the text of a model with some of it replaced."""
    text = (ROOT / "models" / f"{model}.toml").read_text()
    for old, new in replacements:
        assert text.count(old) == 1
        text = text.replace(old, new)
    return text


def test_the_stiff_arm_swings_as_one_with_rigid_joints(fmu, built):
    """Apart from vibrations the stiff joints deflect according to gravity and inertia forces, and the shoulder moves as with a rigid arm."""
    names = ["shoulder.q", "elbow.q", "wrist.q", "energy.kinetic", "energy.balance"]
    with Slave(fmu("stiff_arm")) as slave:
        soft = run(slave.initialize(start={"elbow.q0": 0.0, "wrist.q0": 0.0}), names, 1, 0.02)
    rigid_arm = changed(
        "stiff_arm",
        ('joint_name = "elbow"', 'joint_name = "elbow"\ndrive = "locked"'),
        ('joint_name = "wrist"', 'joint_name = "wrist"\ndrive = "locked"'),
    )
    with Slave(built(rigid_arm)) as slave:
        rigid = run(slave.initialize(start={"elbow.q0": 0.0, "wrist.q0": 0.0}), ["shoulder.q"], 1, 0.02)
    # 1e4 N m/rad bend by less than 1 mrad under the weights of a kilogram, 1e7 a thousandfold less
    assert np.abs(soft["shoulder.q"] - rigid["shoulder.q"]).max() < 5e-3
    assert np.abs(soft["elbow.q"]).max() < 3e-3 and np.abs(soft["wrist.q"]).max() < 3e-6
    assert np.abs(soft["energy.balance"]).max() < 1e-5 * soft["energy.kinetic"].max()


@pytest.mark.parametrize("speed", [4.5, 5.0, 5.5])
def test_the_governor_settles_where_virtual_work_says(built, speed):
    """Virtual work with stiff rods: (2 m l^2 w^2 + k) cos q = 2 m g l + M g + k (2 - 1.1), l = 1 m."""
    governor = changed(
        "governor",
        ('joint_name = "spin"', 'joint_name = "spin"\ndrive = "motion"'),
        ("damping = 5\n", "damping = 300\n"),
        ("qd = 6.283185307179586", f"qd = {speed}"),
    )
    with Slave(built(governor)) as slave:
        slave.initialize()
        assert slave.step(0, 40) == OK, slave.errors
        a, b, lift = slave.reals(["arm_a.q", "arm_b.q", "lift.q"])
    assert a == pytest.approx(b, abs=1e-9)
    assert math.cos(a) == pytest.approx((2 * 5 * 9.81 + 10 * 9.81 + 200 * 0.9) / (2 * 5 * speed**2 + 200), rel=2e-4)
    assert lift == pytest.approx(-math.cos(a), abs=5e-4), "the rods are nearly rigid"


def test_the_governor_balances_its_energy(fmu):
    with Slave(fmu("governor")) as slave:
        table = run(slave.initialize(), ["spin.qd", "lift.q", "energy.kinetic", "energy.balance"], 5, 0.02)
    assert np.ptp(table["lift.q"]) > 0.05
    assert np.abs(table["energy.balance"]).max() < 1e-5 * table["energy.kinetic"].max()


@pytest.mark.parametrize("method", ["adams", "bdf"])
def test_the_block_sticks_and_slips(fmu, method):
    """It tears off at static friction / stiffness and swings back around sliding friction / stiffness."""
    with Slave(fmu("stick_slip")) as slave:
        table = run(slave.initialize(start={"solver.method": method}), ["block.q", "block.qd", "energy.balance", "energy.work"], 5, 0.005)
    stretch = table["block.q"] + 0.1 * 0.005 * np.arange(len(table["block.q"]))
    late = stretch[len(stretch) // 2 :]
    # the swing: from 6 N at 0.1 m/s with 10 rad/s about 3 N
    assert 0.03 + math.hypot(0.03, 0.01) < late.max() < 0.065, "tearing off takes a little longer"
    assert late.min() == pytest.approx(0.06 - late.max(), abs=5e-4)
    tears = np.count_nonzero((stretch[:-1] > 0.03) & (stretch[1:] <= 0.03))
    assert tears == round(5 / 0.9) or tears == round(5 / 0.9) - 1
    assert np.abs(table["energy.balance"]).max() < 1e-4


@pytest.mark.parametrize("method", ["erk", "bdf"])
def test_the_pendulum_comes_to_rest_on_its_stop(fmu, method):
    """Statics: the stop carries the moment of the weight."""
    with Slave(fmu("pendulum_stops")) as slave:
        table = run(slave.initialize(start={"solver.method": method}), ["rod.q", "rod.qd", "energy.balance", "energy.kinetic"], 5, 0.01)
    assert table["rod.q"].min() < -math.pi / 4 and np.count_nonzero(np.diff(np.sign(table["rod.qd"]))) > 4
    q, speed = table["rod.q"][-1], table["rod.qd"][-1]
    depth, width = -math.pi / 4 - q, math.radians(0.5)
    assert 0 < depth < width
    assert 2e4 * (depth**3 / width**2 - depth**4 / (2 * width**3)) == pytest.approx(2 * 9.81 * 0.5 * math.cos(q), rel=1e-4)
    assert abs(speed) < 1e-3
    assert np.abs(table["energy.balance"]).max() < 1e-5 * table["energy.kinetic"].max()


# a slow oscillation of 0.1 m into a stop at 0.05 m, or through a play of 0.0975 m; with or without a free vibration of 1e4 rad/s
SWING = """name = "swing"
gravity = [0, 0, 0]
link = [
  {name = "x", joint = "prismatic", mass = 1, stiffness = 100, qd = 1%s},
%s  {name = "z", parent = "ground", joint = "prismatic", mass = 1, stiffness = 37},
]
%s
"""
VIBRATION = '  {name = "y", joint = "prismatic", mass = 0.01, stiffness = 1e6, q = 1e-5},\n'
STOP = ", upper = 0.05, stop_stiffness = 1e5, stop_width = 1e-4"
PLAY = '[[coupling]]\nname = "c"\njoints = ["x", "z"]\nratios = [1, -1]\nstiffness = 1e5\nbacklash = 0.195\nwidth = 1e-4'


@pytest.mark.parametrize(("stop", "play", "end"), [(STOP, "", -0.0119790), ("", PLAY, -0.007059)])
@pytest.mark.parametrize("rtol", [1e-6, 1e-10])
def test_auto_does_not_step_over_stops_and_backlash(built, stop, play, end, rtol):
    """Ends computed by DOP853 of the two or three equations of motion, with the force law of the pages."""
    with Slave(built(SWING % (stop, VIBRATION, play))) as slave:
        slave.initialize(start={"solver.rtol": rtol}).run(4, 0.4)
        assert slave.get("x.q") == pytest.approx(end, abs=2e-6 if rtol < 1e-9 else 1e-4), slave.get("solver.active")


def swing_with_short_touches(what: str, depth: float) -> str:
    """Returns a model that passes a stop or the end of a play by a part of its amplitude."""
    reach = 0.1 * (1 - depth)
    stop = STOP.replace("0.05", f"{reach}").replace("1e-4", "1e-5")
    play = PLAY.replace("0.195", f"{2 * reach}").replace("1e-4", "1e-5")
    return SWING % {"stop": (stop, "", ""), "coupling": ("", "", play)}[what]


@pytest.mark.parametrize(
    ("what", "depth", "method"),
    [
        *itertools.product(["stop"], [1e-3, 3e-4], ["erk", "auto", "adams", "bdf", "dirk"]),
        ("coupling", 1e-4, "erk"),
        ("coupling", 1e-4, "auto"),
    ],
)
@pytest.mark.parametrize("step", [0.4, 0.01])
def test_a_short_touch_is_noticed(built, what, depth, step, method):
    """The oscillation passes a stop or the end of a play by a small part of its amplitude, in a few ms; steps are ten times as long."""
    ends = []
    for rtol in (1e-6, 1e-8, 1e-12):
        with Slave(built(swing_with_short_touches(what, depth))) as slave:
            slave.initialize(start={"solver.rtol": rtol, "solver.method": method}).run(4, step)
            ends.append(slave.get("x.q"))
    # without the touch: 0.1 sin(40)
    assert abs(ends[2] - 0.1 * math.sin(40)) > 1e-3
    assert ends[0] == pytest.approx(ends[2], abs=1e-4) and ends[1] == pytest.approx(ends[2], abs=5e-5 if method == "dirk" else 1e-5)


# two masses on a spring that slide at 0.5 m/s and vibrate; the torque balances the friction of the first
SLIDING = """name = "sliding"
gravity = [0, 0, 0]
link = [
  {name = "x", joint = "prismatic", mass = 1, qd = 1.0005, friction = 5, friction_velocity = 1e-5},
  {name = "z", parent = "ground", joint = "prismatic", mass = 1},
]
coupling = [{name = "c", joints = ["x", "z"], ratios = [1, -1], stiffness = 50}]
"""


@pytest.mark.parametrize("method", ["erk", "auto", "adams", "bdf", "dirk"])
def test_short_reversals_against_friction_are_noticed(built, method):
    """Its velocity falls to -5e-4 m/s for a few ms, then sticks. End computed by scipy's Radau at 1e-12."""
    with Slave(built(SLIDING)) as slave:
        slave.initialize(start={"solver.method": method, "solver.rtol": 1e-8, "x.tau": 5.0}).run(4, 0.4)
        assert slave.get("x.q") == pytest.approx(2.03829489, abs=3e-6)


@pytest.mark.parametrize("method", ["adams", "bdf", "dirk"])
def test_states_saved_around_a_short_touch(built, method):
    """The stop is touched from 0.155 to 0.159 s; CVODE returns to the start of the step and restarts there."""
    fmu = built(swing_with_short_touches("stop", 3e-4))
    names, states, rows, size = ["x.q", "x.qd", "energy.balance", "solver.error_estimate"], [], [], 0.002
    with Slave(fmu) as slave, Slave(fmu) as other:
        slave.initialize(start={"solver.method": method})
        other.initialize(start={"solver.method": method})
        for k in range(120):
            states.append(slave.serialize(slave.save()))
            assert slave.step(k * size, size) == OK, slave.errors
            rows.append(slave.reals(names))
        for k in range(65, 117):
            assert other.call("SetFMUstate", other.deserialize(states[k])[1]) == OK, other.errors
            for later in range(k, k + 3):
                assert other.step(later * size, size) == OK, other.errors
                assert other.reals(names) == rows[later], k


def test_exponential_warns_of_stops(built):
    with Slave(built(SWING % (STOP, VIBRATION, "")), logging=True) as slave:
        slave.initialize(start={"solver.method": "exponential"})
        assert any("may pass stops" in message for *_, message in slave.messages)


MOTOR = """name = "motor"
link = [{name = "a", mass = 70, com = [1, 0, 0], alpha = 1.5707963267948966, static_friction = 36}]
[[actuator]]
joint = "a"
rotor_inertia = 1.55
stiffness = 1.5e5
resistance = 1
torque_constant = 2.19e4
inductance = 6.3e-4
[solver]
rtol = 8.7e-8
"""


def test_auto_fails_only_if_every_method_exhausts_its_steps(built):
    """Current and speed of this motor oscillate at 7e5 1/s: 1 s takes more explicit steps than permitted."""
    ends = {}
    for method in ("erk", "dirk", "auto"):
        with Slave(built(MOTOR)) as slave:
            slave.initialize(start={"solver.method": method, "a.voltage": -5.6e-5})
            assert slave.step(0, 1) == (ERROR if method == "erk" else OK), slave.errors
            ends[method] = slave.get("a.q")
    assert abs(ends["auto"] - ends["dirk"]) < 1e-6


@pytest.mark.parametrize(
    ("method", "advice"),
    [("erk", "use solver.method auto"), ("adams", "use solver.method auto"), ("bdf", "loosen solver.rtol"), ("dirk", "loosen solver.rtol")],
)
def test_a_step_that_is_too_stiff_fails_in_bounded_time_and_says_what_to_do(fmu, method, advice):
    with Slave(fmu("stiff_arm")) as slave:
        slave.initialize(start={"solver.method": method, "wrist.damping": 0.0})
        assert slave.step(0, 1e-4) == OK
        before = slave.reals(["shoulder.q", "wrist.q"])
        assert slave.set("wrist.stiffness", 1e15) == OK
        assert slave.step(1e-4, 0.1) == ERROR
        (sentence,) = slave.errors
        assert f"110000 internal steps of {method}" in sentence and "did not reach the end of the step" in sentence
        # 1e15 N m/rad against some 0.005 kg m2
        assert 1e8 < float(sentence.split("a rate of ")[1].split()[0]) < 1e9
        assert advice in sentence and "(joint 'wrist'); the state is the one at 0.0001 s" in sentence and ".;" not in sentence
        assert slave.last_time() == 1e-4 and slave.reals(["shoulder.q", "wrist.q"]) == before
        assert slave.call("Reset") == OK
        slave.messages.clear()
        slave.initialize(start={"solver.method": method, "solver.max_step": 1e-9})
        assert slave.step(0, 0.1) == ERROR and "solver.max_step forbids longer steps: raise it" in slave.errors[0]
        assert slave.call("Reset") == OK
        slave.messages.clear()
        slave.initialize(start={"solver.method": "bdf"})
        assert slave.step(0, 0.1) == OK


def test_a_top_at_1000_rad_per_s_keeps_its_spin(fmu):
    with Slave(fmu("top")) as slave:
        table = run(slave.initialize(start={"top.omega0[3]": 1000.0}), ["top.omega[3]", "energy.balance", "energy.kinetic"], 5, 0.01)
    assert np.abs(table["top.omega[3]"] - 1000).max() < 1e-5
    assert np.abs(table["energy.balance"]).max() < 1e-6 * table["energy.kinetic"].max()


VIBRATING = """
name = "vibrating"
[[link]]
name = "one"
mass = 2
com = [0.3, 0, 0]
stiffness = 1e8
[[link]]
name = "two"
a = 0.6
mass = 1
com = [0.2, 0, 0]
inertia = [0, 0.01, 0.01]
stiffness = 1e8
[fmu]
outputs = ["energy", "solver"]
"""


def test_undamped_vibrations_follow_their_modes_in_few_steps(built):
    """Torques of 1 kN m that change every ms; the arm vibrates at 8e3 and 5e4 rad/s with 1e-5 rad, so its equations are linear."""
    reach = 0.6 * 0.2
    coupled = 0.01 + 0.2**2 + reach
    mass = np.array([[2 * 0.3**2 + 0.6**2 + coupled + reach, coupled], [coupled, 0.01 + 0.2**2]])
    root = np.linalg.inv(np.linalg.cholesky(mass))
    squares, modes = np.linalg.eigh(1e8 * root @ root.T)
    modes, w = root.T @ modes, np.sqrt(squares)
    amplitude, rate = np.zeros(2), np.zeros(2)
    with Slave(built(VIBRATING)) as slave:
        slave.initialize()
        for k in range(300):
            torque = np.array([1e3 * (-1) ** k, 1e3 * (k % 3)])
            for name, value in zip(("one.tau", "two.tau"), torque, strict=True):
                assert slave.set(name, value) == OK
            assert slave.step(k * 1e-3, 1e-3) == OK, slave.errors
            rest, angle = modes.T @ torque / squares, w * 1e-3
            offset = amplitude - rest
            amplitude, rate = (
                rest + offset * np.cos(angle) + rate / w * np.sin(angle),
                rate * np.cos(angle) - offset * w * np.sin(angle),
            )
            assert slave.reals(["one.q", "two.q"]) == pytest.approx(modes @ amplitude, abs=1e-8)
        assert slave.get("solver.active") == 5  # exponential
        assert slave.get("solver.rhs_evaluations") < 20 * 300
        assert abs(slave.get("energy.balance")) < 1e-4 * slave.get("energy.potential")
