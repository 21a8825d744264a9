"""Steps: any size, right end times, honest failures, bit-equal reruns."""

from __future__ import annotations

import contextlib
import ctypes as c
import math
import random
import threading

import pytest

from build_fmu.report.sweep import METHODS
from tests.fmi.raw import DO_STEP_STATUS, ERROR, OK, Slave

STATE = ["rail.q", "hinge.q", "idle.q", "rail.qd", "hinge.qd", "idle.qd", "energy.balance"]


@pytest.fixture
def slave(fmu):
    with Slave(fmu("cart")) as slave:
        yield slave.initialize()


@pytest.mark.parametrize("method", METHODS)
def test_the_motion_does_not_depend_on_whole_turns(fmu, method):
    """Error weights stay above the rounding of an angle of 1e6 rad, which is 1e-10 rad."""
    turned = []
    for start in (0.4, 0.4 + 160_000 * math.tau):
        with Slave(fmu("pendulum")) as slave:
            slave.initialize(start={"pivot.q0": start, "solver.method": method, "solver.rtol": 1e-10, "solver.atol": 1e-12})
            slave.run(0.2, 0.01)
            turned.append(slave.get("pivot.q") - start)
    assert turned[1] == pytest.approx(turned[0], abs=1e-7) and abs(turned[0]) > 0.01


@pytest.mark.parametrize("method", METHODS)
def test_a_limit_without_a_reciprocal_is_an_honest_failure(fmu, method):
    with Slave(fmu("pendulum")) as slave:
        slave.initialize(start={"solver.method": method, "solver.max_step": 1e-310})
        assert slave.step(0, 0.01) == ERROR and slave.errors


@pytest.mark.parametrize("size", [math.nan, math.inf, -math.inf, -0.01])
def test_bad_step_sizes_are_refused(slave, size):
    assert slave.step(0, size) == ERROR
    assert "step size" in slave.errors[-1]
    assert slave.last_time() == 0
    assert slave.step(0, 0.01) == OK, "a refused step changes nothing"


@pytest.mark.parametrize("current", [math.nan, math.inf, -1.0, 0.5, 1e-6])
def test_a_wrong_communication_point_is_refused(slave, current):
    assert slave.step(current, 0.01) == ERROR
    assert slave.step(0, 0.01) == OK


def test_a_repeated_or_backward_step_is_refused(slave):
    assert slave.step(0, 0.01) == OK
    assert slave.step(0, 0.01) == ERROR
    assert slave.step(0.02, 0.01) == ERROR
    assert slave.step(0.01, 0.01) == OK


@pytest.mark.parametrize("size", [1e-3, 1e-9, 1e-12])
def test_even_the_shortest_steps_are_told_apart(slave, size):
    assert slave.step(0, size) == OK
    assert slave.step(0, size) == ERROR
    assert slave.step(size, size) == OK


def test_a_step_of_no_length_does_nothing(slave):
    before = slave.reals(STATE)
    assert slave.step(0, 0.0) == OK
    assert slave.reals(STATE) == before and slave.last_time() == 0


@pytest.mark.parametrize("size", [5e-324, 1e-310, 1e-200])
def test_steps_too_short_to_divide_by_pass_no_time(slave, size):
    for k in range(3):
        assert slave.step(k * size, size) == OK, slave.errors
    assert slave.step(3 * size, 0.01) == OK and slave.last_time() == 0.01


def test_a_clock_that_adds_up_is_accepted(slave):
    time = 0.0
    for _ in range(1000):
        assert slave.step(time, 1e-3) == OK
        time += 1e-3
    assert slave.last_time() == time


def test_a_clock_that_counts_nanoseconds_is_accepted(slave):
    for k in range(300):
        assert slave.step(round(k / 300, 9), round((k + 1) / 300, 9) - round(k / 300, 9)) == OK
    assert slave.last_time() == pytest.approx(1, abs=1e-8)


def test_steps_past_the_stop_time_are_refused_but_rounding_is_not(fmu):
    with Slave(fmu("cart")) as slave:
        assert slave.setup(stop=0.3) == OK
        assert slave.call("EnterInitializationMode") == OK
        assert slave.call("ExitInitializationMode") == OK
        assert slave.step(0, 0.1) == OK and slave.step(0.1, 0.1) == OK
        assert slave.step(0.2, 0.11) == ERROR
        assert "stop time" in slave.errors[-1]
        assert 0.2 + 0.1 > 0.3  # by rounding
        assert slave.step(0.2, 0.1) == OK


@pytest.mark.parametrize(
    ("start", "stop", "tolerance"),
    [
        (math.nan, None, None),
        (math.inf, None, None),
        (1.0, 0.5, None),
        (0.0, math.nan, None),
        (0.0, math.inf, None),
        (0.0, None, math.nan),
        (0.0, None, -1e-3),
        (0.0, None, math.inf),
    ],
)
def test_a_senseless_experiment_is_refused(fmu, start, stop, tolerance):
    with Slave(fmu("cart")) as slave:
        assert slave.setup(start, stop, tolerance) == ERROR
        assert slave.setup() == OK


@pytest.mark.parametrize("start", [-5.0, 1e6])
def test_any_start_time(fmu, start):
    ends = []
    for begin in (0.0, start):
        with Slave(fmu("cart")) as slave:
            assert slave.setup(begin) == OK
            assert slave.call("EnterInitializationMode") == OK
            assert slave.call("ExitInitializationMode") == OK
            slave.run(begin + 0.5, 0.125, start=begin)
            assert slave.last_time() == begin + 0.5
            ends.append(slave.reals(STATE))
    assert ends[0] == pytest.approx(ends[1], rel=1e-6, abs=1e-7)


@pytest.mark.parametrize("method", METHODS)
def test_without_an_absolute_tolerance_a_start_at_zero_is_possible(fmu, method):
    ends = []
    for atol in (0.0, 1e-12):
        with Slave(fmu("pendulum")) as slave:
            tolerances = {"solver.method": method, "solver.rtol": 1e-8, "solver.atol": atol}
            slave.initialize(start={"pivot.q0": 0.0, "pivot.qd0": 0.0, "pivot.tau": 0.5, **tolerances})
            slave.run(0.5, 0.01)
            ends.append(slave.reals(["pivot.q", "pivot.qd"]))
    assert ends[0] == pytest.approx(ends[1], rel=1e-5, abs=1e-6) and abs(ends[0][0]) > 0.01


ARM = """
name = "arm"

[[link]]
name = "upper"
drive = "DRIVE"
alpha = 1.5707963267948966
mass = 1.0
com = [0.2, 0, 0]
inertia = [0.01, 0.02, 0.02]

[[link]]
name = "lower"
a = 0.5
mass = 0.7
com = [0.2, 0, 0]
inertia = [0.01, 0.02, 0.02]

[fmu]
outputs = ["solver"]
"""
SAMPLED = ARM.replace("DRIVE", "torque") + '[controller]\nlaw = "pd"\nkp = 0\nkd = 0\nsample_time = 0.1\n'
TRAJECTORY = '[[trajectory]]\njoint = "upper"\ntype = "cycloid"\nto = 1\nstart = 0.5\nduration = 0.3\n'


def course(fmu, method: str, parts: int, jump: float | None = None) -> list[float]:
    """Right-hand sides and motion of 2 s, with a jump of the prescribed joint at 0.5 s."""
    with Slave(fmu) as slave:
        slave.initialize(start={"solver.method": method})
        slave.run(0.5, 0.5 / parts)
        assert jump is None or slave.set("upper.q", jump) == OK
        slave.run(2.0, 1.5 / parts, 0.5)
        return [slave.get("solver.rhs_evaluations"), *slave.reals(["lower.q", "lower.qd"])]


@pytest.mark.parametrize("method", ["adams", "bdf"])
@pytest.mark.parametrize(
    ("model", "jump"),
    [(SAMPLED, None), (ARM.replace("DRIVE", "motion") + TRAJECTORY, None), (ARM.replace("DRIVE", "motion"), 0.3)],
    ids=["samples", "trajectory", "jump"],
)
def test_multistep_methods_continue_while_inputs_are_constant(built, model, jump, method):
    """Also where samples, trajectories or jumps change the inputs within a step."""
    assert course(built(model), method, 32, jump) == course(built(model), method, 1, jump)


def test_samples_of_a_constant_torque_cost_nothing(built):
    assert course(built(SAMPLED), "adams", 32) == course(built(ARM.replace("DRIVE", "torque")), "adams", 32)


@pytest.mark.parametrize("method", METHODS)
def test_the_step_size_does_not_matter(fmu, method):
    ends = []
    for sizes in ([1.0], [0.25] * 4, [0.001] * 1000, [0.3, 0.001, 0.1, 0.599]):
        with Slave(fmu("cart")) as slave:
            slave.initialize(start={"solver.method": method})
            time = 0.0
            for size in sizes:
                assert slave.step(time, size) == OK
                time += size
            ends.append(slave.reals(STATE))
    for end in ends[1:]:
        assert end == pytest.approx(ends[0], rel=1e-5, abs=1e-5)


@pytest.mark.parametrize("seed", range(4))
def test_methods_agree_where_torques_and_parameters_change_at_any_time(fmu, seed):
    """What a method keeps beyond a communication point is forgotten there."""
    draw = random.Random(seed)
    fine = {"solver.rtol": 1e-8, "solver.atol": 1e-10}
    with contextlib.ExitStack() as open_now:
        slaves = [open_now.enter_context(Slave(fmu("double_pendulum"))) for _ in METHODS]
        for slave, method in zip(slaves, METHODS, strict=True):
            slave.initialize(start={**fine, "solver.method": method})
        time = 0.0
        for _ in range(300):
            changes = {}
            if draw.random() < 0.06:
                changes[draw.choice(["shoulder.tau", "elbow.tau"])] = draw.uniform(-5, 5)
            if draw.random() < 0.03:
                changes[draw.choice(["rod1.mass", "rod2.mass", "elbow.damping"])] = draw.uniform(0.5, 2)
            size = draw.choice([1e-3, 3e-3, 1e-4])
            for slave in slaves:
                for name, value in changes.items():
                    assert slave.set(name, value) == OK
                assert slave.step(time, size) == OK
            time += size
        ends = [slave.reals([f"{joint}.{part}" for joint in ("shoulder", "elbow") for part in ("q", "qd", "qdd")]) for slave in slaves]
    for end in ends:
        assert end == pytest.approx(ends[0], abs=1e-5)


@pytest.mark.parametrize("method", METHODS)
def test_reset_reruns_bit_for_bit(fmu, method):
    def run(slave):
        slave.initialize(start={"solver.method": method, "hinge.q0": 1.1, "pole.mass": 0.7})
        for k in range(50):
            assert slave.set("hinge.tau", math.sin(k)) == OK
            assert slave.step(k * 0.01, 0.01) == OK
        return slave.reals(STATE + ["hinge.qdd", "energy.total"]) + [slave.get("solver.steps")]

    with Slave(fmu("cart")) as slave:
        first = run(slave)
        assert slave.call("Reset") == OK
        assert slave.get("hinge.q0") == 0.3 and slave.get("pole.mass") == 0.5 and slave.get("solver.method") == "auto"
        assert slave.get("hinge.tau") == 0
        assert run(slave) == first
        assert slave.call("Terminate") == OK
        assert slave.call("Reset") == OK
        assert run(slave) == first
    with Slave(fmu("cart")) as slave:
        assert run(slave) == first


def test_two_instances_do_not_know_each_other(fmu):
    with Slave(fmu("cart")) as alone:
        alone.initialize()
        alone.run(0.5, 0.01)
        expected = alone.reals(STATE)
    with Slave(fmu("cart")) as one, Slave(fmu("cart")) as two:
        one.initialize()
        two.initialize(start={"hinge.q0": 2.0, "solver.method": "bdf", "pole.mass": 3.0})
        for k in range(50):
            assert one.step(k * 0.01, 0.01) == two.step(k * 0.01, 0.01) == OK
        assert one.reals(STATE) == expected != two.reals(STATE)


def test_threads_with_an_instance_each_agree(fmu):
    results = [None] * 4

    def run(i):
        with Slave(fmu("cart")) as slave:
            slave.initialize()
            slave.run(1, 0.01)
            results[i] = slave.reals(STATE)

    threads = [threading.Thread(target=run, args=(i,)) for i in range(4)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert results[0] is not None and all(result == results[0] for result in results)


@pytest.mark.parametrize("method", METHODS)
def test_a_failed_step_keeps_the_last_good_state(fmu, method):
    with Slave(fmu("cart")) as slave:
        slave.initialize(start={"solver.method": method})
        slave.run(0.1, 0.01)
        before = slave.reals(STATE)
        assert slave.set("hinge.tau", 1e308) == OK
        assert slave.set("rail.tau", 1e308) == OK
        assert slave.step(0.1, 0.01) == ERROR
        assert "state is the one at" in slave.errors[-1]
        time = slave.last_time()
        assert 0.1 - 1e-12 <= time < 0.11
        if time == pytest.approx(0.1):
            assert slave.reals(STATE[:6]) == before[:6]
        status = c.c_int(-1)
        assert slave.call("GetStatus", DO_STEP_STATUS, c.byref(status)) == OK and status.value == ERROR
        assert slave.step(time, 0.01) == ERROR, "only after a reset"
        assert slave.call("Reset") == OK
        slave.initialize(start={"solver.method": method})
        slave.run(0.1, 0.01)
        assert slave.reals(STATE) == before


def test_nothing_is_printed(fmu, capfd):
    with Slave(fmu("cart"), logging=True) as slave:
        slave.initialize()
        assert slave.set("hinge.tau", 1e308) == OK
        assert slave.step(0, 0.01) == ERROR
        assert slave.step(0, 0.01) == ERROR
    captured = capfd.readouterr()
    assert captured.out == captured.err == ""


# Rounding beside larger motions is not named.
@pytest.mark.parametrize(("model", "start", "named"), [("rolling_ball", {}, 0), ("cart", {"solver.atol": 1e3}, 1)])
def test_unresolved_motions_are_named_at_the_end(fmu, model, start, named):
    with Slave(fmu(model), logging=True) as slave:
        slave.initialize(start=start)
        slave.run(0.5, 0.01)
        assert slave.call("Terminate") == OK
        assert sum("resolve this motion" in text for _, _, text in slave.messages) == named
