"""FMI 3.0: outputs at internal steps of a communication step, and early return. The reference is the same FMU driven to these times."""

from __future__ import annotations

import ctypes as c

import numpy as np
import pytest

from build_fmu.report.sweep import METHODS
from tests.fmi.raw import ERROR, OK
from tests.fmi.raw3 import Slave3, array, count

LENGTH, TIGHT = 0.5, {"solver.rtol": 1e-11, "solver.atol": 1e-13}
DRIVEN = """
name = "driven"

[[link]]
name = "turntable"
drive = "motion"
alpha = 1.5707963267948966
mass = 1.0

[[link]]
name = "arm"
a = 0.5
mass = 0.7
com = [0.2, 0, 0]
inertia = [0.01, 0.02, 0.02]
"""


def positions(fmu) -> list[str]:
    return [name for name in fmu.named("output") if name.endswith((".q", ".qd"))]


class Recorder:
    """A callback that reads outputs, and asks for an early return at its `leave`th call, at `leave_at` or at once."""

    def __init__(self, leave: int = 0, leave_at: float = -1.0) -> None:
        self.slave, self.leave, self.leave_at = None, leave, leave_at
        self.times, self.values, self.flags, self.refused = [], [], set(), []

    def __call__(self, _, time, set_requested, get_allowed, finished, can_return, early, at) -> None:
        self.flags.add((set_requested, get_allowed, finished, can_return))
        self.times.append(time)
        self.values.append(self.slave.get(positions(self.slave.fmu)))
        assert self.slave.get(["time"]) == [time]
        if len(self.times) == self.leave:
            early[0], at[0] = True, self.leave_at


def updated(fmu, recorder: Recorder, early: bool = False) -> Slave3:
    recorder.slave = Slave3(fmu, update=recorder, early_return=early)
    return recorder.slave


def expected(fmu, times, start: dict) -> np.ndarray:
    """The outputs at these times, of an instance without the callback."""
    with Slave3(fmu) as slave:
        slave.initialize(start)
        rows, before = [], 0.0
        for time in times:
            assert slave.do_step(before, time - before)[0] == OK, slave.errors
            rows.append(slave.get(positions(fmu)))
            before = time
        return np.array(rows)


@pytest.mark.parametrize("method", METHODS)
@pytest.mark.parametrize("name", ["kuka_kr5", "four_bar", "kuka_kr5_computed_torque", "everything"])
def test_each_internal_step_is_reported_with_its_outputs(fmu3, name, method):
    fmu, recorder = fmu3(name), Recorder()
    start = {"solver.method": method, "solver.rtol": 1e-8, "solver.atol": 1e-10}
    with updated(fmu, recorder) as slave:
        slave.initialize(start)
        slave.run(0, 2, LENGTH)
        assert recorder.flags == {(False, True, True, False)}
        assert len(recorder.times) > 5
        times = np.array(recorder.times)
        assert (np.diff(times) > 0).all() and 0 < times[0] and times[-1] < 2 * LENGTH
        rows = np.array([*recorder.values, slave.get(positions(fmu))])
    reference = expected(fmu, [*recorder.times, 2 * LENGTH], {"solver.method": "erk", **TIGHT})
    assert np.ptp(reference, axis=0).max() > 0.01, "the model must move"
    assert np.abs(rows - reference).max() < 1e-5 * max(1.0, np.abs(reference).max())


def test_outputs_follow_a_prescribed_motion_that_was_set_before_the_step(built3):
    fmu, recorder = built3(DRIVEN), Recorder()
    with updated(fmu, recorder) as slave, Slave3(fmu) as other:
        for one in (slave, other):
            one.initialize(TIGHT).run(0, 1, LENGTH)
            assert one.set("turntable.qd", 3.0) == OK
        recorder.times, recorder.values = [], []
        slave.run(1, 2, LENGTH)
        rows, before = [], LENGTH
        for time in recorder.times:
            assert other.do_step(before, time - before)[0] == OK, other.errors
            rows.append(other.get(positions(fmu)))
            before = time
    assert len(rows) > 5 and np.ptp(rows, axis=0).max() > 0.1
    assert np.abs(np.array(recorder.values) - rows).max() < 1e-8


def test_without_callback_there_is_no_update(fmu3):
    silent, recorder = Slave3(fmu3("kuka_kr5")), Recorder()
    with silent, updated(fmu3("kuka_kr5"), recorder) as slave:
        for one in (silent, slave):
            one.initialize()
            assert one.do_step(0, 1e-6) == (OK, [False] * 3, 1e-6)
        assert recorder.times == [], "a communication step of one internal step"
        assert slave.everything() == silent.everything()


@pytest.mark.parametrize("method", METHODS)
def test_an_early_return_ends_the_step_where_it_is_asked_for(fmu3, method):
    fmu, start = fmu3("kuka_kr5"), {"solver.method": method}
    at_once, later = Recorder(leave=2), Recorder(leave=2, leave_at=0.3)
    for recorder in (at_once, later):
        with updated(fmu, recorder, early=True) as slave:
            slave.initialize(start)
            status, flags, time = slave.do_step(0, LENGTH)
            assert (status, flags) == (OK, [False, False, True])
            assert recorder.flags == {(False, True, True, True)}
            assert time == (recorder.times[1] if recorder is at_once else 0.3)
            assert slave.get(["time"]) == [time]
            assert slave.do_step(time, LENGTH - time) == (OK, [False] * 3, LENGTH)
            rows = np.array([slave.get(positions(fmu))])
        assert np.abs(rows - expected(fmu, [LENGTH], {"solver.method": method, **TIGHT})).max() < 1e-4
    assert len(later.times) > 2


def test_an_early_return_that_the_master_did_not_allow_is_not_made(fmu3):
    recorder = Recorder(leave=1)
    with updated(fmu3("kuka_kr5"), recorder) as slave:
        slave.initialize().run(0, 1, LENGTH)
    assert len(recorder.times) > 1


def test_functions_of_a_communication_point_are_refused_during_an_update(fmu3):
    fmu, outcomes = fmu3("kuka_kr5"), {}
    recorder = Recorder()

    def probe(*arguments) -> None:
        recorder(*arguments)
        slave = recorder.slave
        derivative, order = (c.c_double * 1)(), array(c.c_int, [1])
        outcomes["derivative"] = slave.call("GetOutputDerivatives", fmu.references(["joint1.q"]), count(1), order, derivative, count(1))
        outcomes["rate"] = derivative[0] - slave.get(["joint1.qd"])[0]
        outcomes["set"] = slave.set("joint1.tau", 1.0)
        for function in ("Reset", "Terminate"):
            outcomes[function] = slave.call(function)
        outcomes["state"] = slave.call("GetFMUState", c.byref(c.c_void_p()))
        outcomes["step"] = slave.do_step(arguments[1], 0.1)[0]

    with Slave3(fmu, update=probe) as slave, Slave3(fmu, update=Recorder.__call__.__get__(silent := Recorder())) as other:
        recorder.slave, silent.slave = slave, other
        for one in (slave, other):
            one.initialize().run(0, 1, LENGTH)
        assert outcomes.pop("derivative") == OK and outcomes.pop("rate") == 0
        assert set(outcomes.values()) == {ERROR}
        assert all(text.endswith("not allowed while the instance is in intermediate update mode") for text in slave.errors)
        assert slave.everything() == other.everything()


def test_internal_steps_that_end_at_samples_are_updated_too(built3):
    """Some steps end exactly at an instant of a sample."""
    fmu = built3("""name = "sampled"
[[link]]
name = "arm"
mass = 1
com = [0.5, 0, 0]
[controller]
law = "pd"
kp = 20
kd = 2
target = 0.3
sample_time = 0.01
""")
    recorder = Recorder()
    with updated(fmu, recorder) as slave:
        slave.initialize()
        assert slave.do_step(0.0, LENGTH)[0] == OK
        (steps,) = slave.get(["solver.steps"], "Int32")
    assert np.diff([0, *recorder.times, LENGTH]).max() < 0.0101
    assert len(recorder.times) == steps - 1
