"""Mistreatment of life and time: steps, experiments, orders of calls. A reset brings back the first run bit for bit."""

from __future__ import annotations

import ctypes as c
import itertools
import math

import pytest

from tests.fmi.raw import DO_STEP_STATUS, ERROR, LAST_SUCCESSFUL_TIME, OK, PENDING_STATUS, TERMINATED
from tests.fmi.subjects import SIZE, STATES, SUBJECTS, Checks, Double, Int, Text, refused

check = Checks()


# --- steps ---


@check(math.nan, math.inf, -math.inf, -1.0, -SIZE, -5e-324, -1e300)
def steps_of_impossible_size(subject, slave, size):
    subject.bring_to(slave, "step")
    refused(slave, slave.step(0, size))
    assert slave.last_time() == 0 and slave.step(0, SIZE) == OK


@check(1e12, 1e300)
def a_step_of_ages(subject, slave, size):
    """No computer reaches its end, unless all comes to rest: told soon, not after hours."""
    subject.bring_to(slave, "step")
    if slave.step(0, size) != OK:
        refused(slave, ERROR)
        assert slave.last_time() < size


@check(math.nan, math.inf, -math.inf, -1.0, 1.0, 0.5 * SIZE, 1e300)
def steps_from_somewhere_else(subject, slave, current):
    subject.bring_to(slave, "step")
    assert slave.step(0, SIZE) == OK
    refused(slave, slave.step(current, SIZE))
    assert slave.last_time() == SIZE and slave.step(SIZE, SIZE) == OK


@check(0.0, -0.0, 5e-324, 1e-320, 1e-300, 1e-100, 1e-30, 1e-18)
def steps_of_hardly_any_size(subject, slave, size):
    subject.bring_to(slave, "step")
    for _ in range(5):
        assert slave.step(slave.last_time(), size) == OK, slave.errors
    assert slave.step(slave.last_time(), SIZE) == OK, slave.errors


@check(*range(8))
def steps_of_changing_size(subject, slave, seed):
    subject.bring_to(slave, "step")
    time, state = 0.0, seed + 1
    for _ in range(12):
        state = state * 1103515245 % 2**31
        size = SIZE * 10 ** (state / 2**31 * 4 - 3)
        assert slave.step(time, size) == OK, slave.errors
        time += size
        assert slave.last_time() == time


@check("end", "beyond", "far beyond", "rounding", "size 0 at the end", "start after stop")
def steps_with_a_stop_time(subject, slave, case):
    stop = 3 * SIZE
    if case == "start after stop":
        refused(slave, slave.setup(1.0, 0.5))
        return
    assert slave.setup(stop=stop) == OK and slave.call("EnterInitializationMode") == OK
    assert slave.call("ExitInitializationMode") == OK
    size = {"end": stop, "beyond": stop * (1 + 1e-6), "far beyond": 1e6, "rounding": stop * (1 + 1e-12), "size 0 at the end": stop}[case]
    status = slave.step(0, size)
    if "beyond" in case:
        refused(slave, status)
        assert slave.step(0, SIZE) == OK
        return
    assert status == OK
    assert slave.step(size, 0.0) == OK
    refused(slave, slave.step(size, SIZE))


@check(1, -1)
def a_communication_point_off_by_rounding(subject, slave, sign):
    subject.bring_to(slave, "step")
    for k in range(20):
        assert slave.step(k * SIZE * (1 + sign * 1e-12), SIZE) == OK, slave.errors


@check("repeat", "back", "gap")
def steps_out_of_order(subject, slave, case):
    subject.bring_to(slave, "step")
    slave.run(2 * SIZE, SIZE)
    refused(slave, slave.step({"repeat": SIZE, "back": 0, "gap": 3 * SIZE}[case], SIZE))
    assert slave.step(2 * SIZE, SIZE) == OK


@check(1e-300, 1e-14, 1e-3, 0.1, 1.0, 1e300)
def tolerances_of_any_size(subject, slave, tolerance):
    assert slave.setup(tolerance=tolerance) == OK and slave.call("EnterInitializationMode") == OK
    assert slave.call("ExitInitializationMode") == OK
    slave.run(3 * SIZE, SIZE)


@check(math.nan, math.inf, -math.inf, 0.0, -1e-6)
def tolerances_that_are_none(subject, slave, tolerance):
    call = slave.call("SetupExperiment", 1, c.c_double(tolerance), c.c_double(0), 0, c.c_double(0))
    refused(slave, call)


@check(math.nan, math.inf, -1.0, 0.0)
def tolerances_and_stops_that_are_not_defined_do_not_count(subject, slave, value):
    assert slave.call("SetupExperiment", 0, c.c_double(value), c.c_double(0), 0, c.c_double(value)) == OK


@check(math.nan, math.inf, -math.inf)
def experiments_at_no_time(subject, slave, time):
    refused(slave, slave.setup(time))
    refused(slave, slave.setup(0.0, time))


@check(-1e5, -1.0, 1e-300, 1.0, 1e5, 1e7, 1e9, 1e17)
def experiments_that_start_anywhere(subject, slave, start):
    assert slave.setup(start) == OK and slave.call("EnterInitializationMode") == OK
    assert slave.call("ExitInitializationMode") == OK, slave.errors
    size = SIZE if abs(start) <= 1e9 else abs(start) * 1e-9
    assert slave.last_time() == start
    if size <= 1:
        assert slave.step(start, size) == OK, slave.errors
        assert slave.last_time() == start + size


@check()
def an_experiment_set_up_twice(subject, slave):
    assert slave.setup(5.0) == OK and slave.setup(0.0) == OK


@check()
def a_run_without_an_experiment(subject, slave):
    assert slave.call("EnterInitializationMode") == OK and slave.call("ExitInitializationMode") == OK
    slave.run(3 * SIZE, SIZE)
    assert slave.reals(subject.outputs) == subject.alone


@check(0, 1, 2, -1)
def the_flag_of_a_step_may_be_anything(subject, slave, flag):
    subject.bring_to(slave, "step")
    assert slave.call("DoStep", c.c_double(0), c.c_double(SIZE), flag) == OK


# --- orders of calls ---


@check(*STATES)
def a_reset_from_everywhere(subject, slave, state):
    subject.bring_to(slave, state)
    assert slave.call("Reset") == OK and slave.call("Reset") == OK


@check(
    *(
        f"{a}, {b}"
        for a, b in itertools.product(
            ("SetupExperiment", "EnterInitializationMode", "ExitInitializationMode", "Terminate", "DoStep"), STATES
        )
    )
)
def what_changes_life_at_the_right_time_only(subject, slave, case):
    function, state = case.split(", ")
    subject.bring_to(slave, state)
    allowed = {
        "SetupExperiment": {"instantiated"},
        "EnterInitializationMode": {"instantiated"},
        "ExitInitializationMode": {"initialization"},
        "Terminate": {"step", "failed"},
        "DoStep": {"step"},
    }[function]
    call = {"SetupExperiment": slave.setup, "DoStep": lambda: slave.step(0, SIZE)}.get(function, lambda: slave.call(function))
    status = call()
    if state in allowed:
        assert status == OK, slave.errors
    else:
        refused(slave, status)
        assert function in slave.errors[-1]


@check("values", "a setting", "a step", "terminate", "a state")
def after_the_end(subject, slave, case):
    subject.bring_to(slave, "step")
    slave.run(2 * SIZE, SIZE)
    before = slave.reals(subject.outputs)
    assert slave.call("Terminate") == OK
    if case == "values":
        assert slave.reals(subject.outputs) == before
    elif case == "a state":
        state = slave.save()
        assert slave.call("Reset") == OK and slave.call("SetFMUstate", state) == OK
        assert slave.reals(subject.outputs) == before
        refused(slave, slave.step(2 * SIZE, SIZE))
    else:
        names = [*subject.inputs, *subject.fixed, *subject.tunables]
        calls = {
            "a setting": lambda: slave.set(names[0], 0.0),
            "a step": lambda: slave.step(2 * SIZE, SIZE),
            "terminate": lambda: slave.call("Terminate"),
        }
        refused(slave, calls[case]())


@check(*STATES)
def no_step_can_be_cancelled(subject, slave, state):
    subject.bring_to(slave, state)
    refused(slave, slave.call("CancelStep"))


STATUSES = {"GetStatus": Int, "GetRealStatus": Double, "GetIntegerStatus": Int, "GetBooleanStatus": Int, "GetStringStatus": Text}


@check(*(f"{function} {kind}" for function in STATUSES for kind in (-1, 0, 1, 2, 3, 4, 1000)))
def a_status_of_each_kind(subject, slave, case):
    function, kind = case.split()
    good = {("GetStatus", DO_STEP_STATUS), ("GetRealStatus", LAST_SUCCESSFUL_TIME), ("GetBooleanStatus", TERMINATED)}
    subject.bring_to(slave, "step")
    status = slave.call(function, int(kind), STATUSES[function]())
    if (function, int(kind)) in good:
        assert status == OK
    else:
        refused(slave, status)
    refused(slave, slave.call(function, int(kind), None))


@check()
def the_last_good_time_after_a_failure(subject, slave):
    subject.bring_to(slave, "failed")
    assert 0 <= slave.last_time() < SIZE
    status, pending = Int(), Text()
    assert slave.call("GetStatus", DO_STEP_STATUS, status) == OK and status[0] == ERROR
    refused(slave, slave.call("GetStringStatus", PENDING_STATUS, pending))
    assert slave.call("Terminate") == OK


@check()
def an_initialization_that_is_left_and_entered_again(subject, slave):
    for _ in range(20):
        subject.bring_to(slave, "step")
        assert slave.call("Reset") == OK


@check(*range(6))
def calls_without_any_order(subject, slave, seed):
    """Legal arguments, any order: every answer is fmi2OK or fmi2Error."""
    import random

    draw, states = random.Random(seed), [c.c_void_p() for _ in range(3)]
    force = subject.inputs[0] if subject.inputs else subject.fixed[0]
    calls = [
        slave.setup,
        lambda: slave.call("EnterInitializationMode"),
        lambda: slave.call("ExitInitializationMode"),
        lambda: slave.call("Terminate"),
        lambda: slave.call("Reset"),
        lambda: slave.call("CancelStep"),
        lambda: slave.try_get(subject.output)[0],
        lambda: slave.set(force, draw.uniform(-1, 1)),
        lambda: slave.set("solver.method", draw.choice(["erk", "adams", "dirk", "bdf", "exponential", "auto"])),
        lambda: slave.call("GetFMUstate", c.byref(draw.choice(states))),
        lambda: slave.call("SetFMUstate", draw.choice(states)),
        lambda: slave.call("FreeFMUstate", c.byref(draw.choice(states))),
        lambda: slave.call("SetDebugLogging", 1, c.c_size_t(0), None),
    ]

    def step():
        time = Double()
        slave.call("GetRealStatus", LAST_SUCCESSFUL_TIME, time)
        return slave.step(time[0], draw.choice([SIZE, 0.0, 3 * SIZE]))

    for _ in range(300):
        answer = draw.choice([*calls, step, step, step])()
        assert answer in (OK, ERROR)


@pytest.mark.parametrize("name", SUBJECTS)
@pytest.mark.parametrize("what", check.names)
def test_abuse_of_life(subject, what, name):
    check.run(what, subject(name))
