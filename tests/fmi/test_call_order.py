"""Which call is allowed when: every function in every state, against the table of the standard."""

from __future__ import annotations

import ctypes as c

import pytest

from tests.fmi.exchange import EventInfo, Exchange, Exchange3
from tests.fmi.raw import DO_STEP_STATUS, ERROR, LAST_SUCCESSFUL_TIME, OK, TERMINATED, Slave
from tests.fmi.raw3 import Slave3

STATES = ("instantiated", "initialization", "step", "failed", "terminated")
REAL, ONE = "hinge.q", c.c_size_t(1)
DOUBLES, INTS = c.c_double * 1, c.c_int * 1


def reference(slave, name):
    return (c.c_uint * 1)(slave.fmu.variables[name][1])


def get_saved(slave, function):
    """Calls a function on a state saved just before."""
    state = c.c_void_p()
    if slave.call("GetFMUstate", c.byref(state)) != OK:
        return ERROR
    return function(state)


# name: (a correct call, the states in which it succeeds)
everywhere = set(STATES)
CALLS = {
    "SetDebugLogging": (lambda s: s.call("SetDebugLogging", 0, c.c_size_t(0), None), everywhere),
    "SetupExperiment": (lambda s: s.setup(), {"instantiated"}),
    "EnterInitializationMode": (lambda s: s.call("EnterInitializationMode"), {"instantiated"}),
    "ExitInitializationMode": (lambda s: s.call("ExitInitializationMode"), {"initialization"}),
    "Terminate": (lambda s: s.call("Terminate"), {"step", "failed"}),
    "Reset": (lambda s: s.call("Reset"), everywhere),
    "GetReal output": (lambda s: s.try_get(REAL)[0], everywhere - {"instantiated"}),
    "GetReal input": (lambda s: s.try_get("hinge.tau")[0], everywhere),
    "GetReal parameter": (lambda s: s.try_get("hinge.q0")[0], everywhere),
    "GetInteger": (lambda s: s.try_get("solver.steps")[0], everywhere - {"instantiated"}),
    "GetString": (lambda s: s.try_get("solver.method")[0], everywhere),
    "GetBoolean of nothing": (lambda s: s.call("GetBoolean", None, c.c_size_t(0), None), everywhere),
    "SetReal input": (lambda s: s.set("hinge.tau", 1.0), {"instantiated", "initialization", "step"}),
    "SetReal fixed": (lambda s: s.set("hinge.q0", 1.0), {"instantiated", "initialization"}),
    "SetReal tunable": (lambda s: s.set("pole.mass", 1.0), {"instantiated", "initialization", "step"}),
    "SetReal output": (lambda s: s.set(REAL, 1.0), set()),
    "SetReal of nothing": (lambda s: s.call("SetReal", None, c.c_size_t(0), None), {"instantiated", "initialization", "step"}),
    "SetInteger output": (lambda s: s.set("solver.steps", 1), set()),
    "SetString": (lambda s: s.set("solver.method", "bdf"), {"instantiated", "initialization"}),
    "SetBoolean": (lambda s: s.call("SetBoolean", (c.c_uint * 1)(0), ONE, INTS(0)), set()),
    "GetFMUstate": (lambda s: s.call("GetFMUstate", c.byref(c.c_void_p())), everywhere),
    "SetFMUstate": (lambda s: get_saved(s, lambda state: s.call("SetFMUstate", state)), everywhere),
    "FreeFMUstate": (lambda s: get_saved(s, lambda state: s.call("FreeFMUstate", c.byref(state))), everywhere),
    "FreeFMUstate of nothing": (lambda s: s.call("FreeFMUstate", c.byref(c.c_void_p())), everywhere),
    "serialization": (lambda s: get_saved(s, lambda state: s.deserialize(s.serialize(state))[0]), everywhere),
    "GetDirectionalDerivative": (
        lambda s: s.call("GetDirectionalDerivative", reference(s, REAL), ONE, reference(s, "hinge.tau"), ONE, DOUBLES(1), DOUBLES()),
        {"initialization", "step", "terminated"},
    ),  # the failed step's forces are infinite
    "SetRealInputDerivatives": (
        lambda s: s.call("SetRealInputDerivatives", reference(s, "hinge.tau"), ONE, INTS(1), DOUBLES(1)),
        {"instantiated", "initialization", "step"},
    ),
    "GetRealOutputDerivatives": (
        lambda s: s.call("GetRealOutputDerivatives", reference(s, REAL), ONE, INTS(1), DOUBLES()),
        {"step", "failed", "terminated"},
    ),
    "DoStep": (lambda s: s.step(0, 0.01), {"step"}),
    "CancelStep": (lambda s: s.call("CancelStep"), set()),
    "GetStatus": (lambda s: s.call("GetStatus", DO_STEP_STATUS, INTS()), {"step", "failed", "terminated"}),
    "GetRealStatus": (lambda s: s.call("GetRealStatus", LAST_SUCCESSFUL_TIME, DOUBLES()), {"step", "failed", "terminated"}),
    "GetIntegerStatus": (lambda s: s.call("GetIntegerStatus", DO_STEP_STATUS, INTS()), set()),
    "GetBooleanStatus": (lambda s: s.call("GetBooleanStatus", TERMINATED, INTS()), {"step", "failed", "terminated"}),
    "GetStringStatus": (lambda s: s.call("GetStringStatus", 1, (c.c_char_p * 1)()), set()),
}


def bring_to(slave: Slave, state: str) -> Slave:
    """Leads a fresh instance to a state; `failed` by an infinite acceleration."""
    if state == "instantiated":
        return slave
    assert slave.setup() == OK
    assert slave.call("EnterInitializationMode") == OK
    if state == "initialization":
        return slave
    assert slave.call("ExitInitializationMode") == OK, slave.errors
    if state == "failed":
        assert slave.set("hinge.tau", 1e308) == OK
        assert slave.set("rail.tau", 1e308) == OK
        assert slave.step(0, 0.01) == ERROR
        assert "the state is the one at" in slave.errors[-1]
    if state == "terminated":
        assert slave.call("Terminate") == OK
    return slave


@pytest.mark.parametrize("state", STATES)
@pytest.mark.parametrize("function", CALLS)
def test_every_function_in_every_state(fmu, function, state):
    call, allowed = CALLS[function]
    with Slave(fmu("cart")) as slave:
        bring_to(slave, state)
        before = len(slave.errors)
        status = call(slave)
        assert status == (OK if state in allowed else ERROR), slave.errors
        assert len(slave.errors) == before + (status == ERROR), "an error is one sentence, success is silent"


@pytest.mark.parametrize("state", STATES)
def test_a_refused_call_leaves_the_life_as_it_was(fmu, state):
    with Slave(fmu("cart")) as slave:
        bring_to(slave, state)
        for call, allowed in CALLS.values():
            if state not in allowed:
                assert call(slave) == ERROR
        if state in ("failed", "terminated"):
            assert slave.call("Reset") == OK
            state = "instantiated"
        for function in (["EnterInitializationMode"] if state == "instantiated" else []) + (
            ["ExitInitializationMode"] if state != "step" else []
        ):
            assert slave.call(function) == OK, slave.errors
        assert slave.step(0, 0.01) == OK, slave.errors


def flags(kind, size: int) -> list:
    return [c.byref(kind()) for _ in range(size)]


def exchange_calls(version: int, states: int) -> dict[str, tuple]:
    """Functions of model exchange with correct arguments."""
    numbers = (c.c_double * states)(), c.c_size_t(states)
    shared = {
        "EnterEventMode": (),
        "EnterContinuousTimeMode": (),
        "SetTime": (c.c_double(0.01),),
        "SetContinuousStates": numbers,
        "GetContinuousStates": numbers,
        "GetNominalsOfContinuousStates": numbers,
        "GetEventIndicators": (None, c.c_size_t(0)),
    }
    if version == 2:
        return shared | {
            "GetDerivatives": numbers,
            "NewDiscreteStates": (c.byref(EventInfo()),),
            "CompletedIntegratorStep": (1, *flags(c.c_int, 2)),
        }
    return shared | {
        "GetContinuousStateDerivatives": numbers,
        "GetNumberOfContinuousStates": flags(c.c_size_t, 1),
        "GetNumberOfEventIndicators": flags(c.c_size_t, 1),
        "UpdateDiscreteStates": (*flags(c.c_bool, 5), *flags(c.c_double, 1)),
        "CompletedIntegratorStep": (c.c_bool(True), *flags(c.c_bool, 2)),
    }


def step_calls(version: int, reference: int) -> dict[str, tuple]:
    """Functions of co-simulation with correct arguments."""
    rate = (c.c_uint * 1)(reference), ONE, INTS(1), DOUBLES()
    if version == 3:
        step = (c.c_double(0), c.c_double(0.01), c.c_bool(True), *flags(c.c_bool, 3), *flags(c.c_double, 1))
        return {"GetOutputDerivatives": (*rate, ONE), "DoStep": step}
    kinds = {
        "GetStatus": (DO_STEP_STATUS, INTS()),
        "GetRealStatus": (LAST_SUCCESSFUL_TIME, DOUBLES()),
        "GetBooleanStatus": (TERMINATED, INTS()),
    }
    return kinds | {"GetRealOutputDerivatives": rate, "SetRealInputDerivatives": rate, "DoStep": (c.c_double(0), c.c_double(0.01), 1)}


def lives(one, version: int, *rest: str):
    """Brings a fresh instance from one state to the next."""
    yield "instantiated"
    assert (one.enter() if version == 3 else one.setup() or one.call("EnterInitializationMode")) == OK
    yield "initialization"
    for function in ("ExitInitializationMode", *rest, "Terminate"):
        assert one.call(function) == OK, one.errors
        yield function


def refuses_all(one, calls: dict[str, tuple], version: int, *rest: str) -> None:
    for state in lives(one, version, *rest):
        for function, arguments in calls.items():
            before = len(one.errors)
            assert one.call(function, *arguments) == ERROR, (state, function)
            assert len(one.errors) == before + 1 and one.errors[-1].startswith(f"fmi{version}{function}: ")


@pytest.mark.parametrize("version", [2, 3])
def test_functions_of_model_exchange_are_refused_in_every_state_of_co_simulation(fmu, fmu3, version):
    with Exchange(fmu("cart")) as tool:
        calls = exchange_calls(version, len(tool.states))
    with Slave(fmu("cart")) if version == 2 else Slave3(fmu3("cart")) as slave:
        refuses_all(slave, calls, version)


@pytest.mark.parametrize("version", [2, 3])
def test_functions_of_co_simulation_are_refused_in_every_state_of_model_exchange(fmu, fmu3, version):
    unpacked = (fmu if version == 2 else fmu3)("cart")
    with (Exchange if version == 2 else Exchange3)(unpacked) as tool:
        refuses_all(tool, step_calls(version, unpacked.variables[REAL][1]), version, "EnterContinuousTimeMode", "EnterEventMode")


@pytest.mark.parametrize("state", STATES)
def test_can_be_freed_in_every_state(fmu, state):
    slave = bring_to(Slave(fmu("cart"), memory=True), state)
    assert len(slave.blocks) == 1
    slave.free()
    assert not slave.blocks


def test_no_instance_is_an_error_and_no_crash(fmu):
    library = fmu("cart").library
    assert library.fmi2Reset(None) == ERROR
    assert library.fmi2DoStep(None, c.c_double(0), c.c_double(1), 1) == ERROR
    library.fmi2FreeInstance(None)


def test_null_arguments_are_refused(fmu):
    with Slave(fmu("cart")) as slave:
        bring_to(slave, "step")
        for function in ("GetReal", "GetInteger", "GetString", "SetReal", "SetInteger", "SetString", "SetBoolean", "GetBoolean"):
            assert slave.call(function, None, ONE, None) == ERROR
        assert slave.call("GetFMUstate", None) == ERROR
        assert slave.call("SetFMUstate", None) == ERROR
        assert slave.call("GetRealStatus", LAST_SUCCESSFUL_TIME, None) == ERROR
        assert slave.call("SetDebugLogging", 1, ONE, None) == ERROR


def test_unknown_value_references_are_refused(fmu):
    with Slave(fmu("cart")) as slave:
        bring_to(slave, "step")
        for reference_ in (1000, 2**32 - 1):
            for function, values in (
                ("GetReal", DOUBLES()),
                ("GetInteger", INTS()),
                ("GetString", (c.c_char_p * 1)()),
                ("SetReal", DOUBLES()),
                ("SetInteger", INTS()),
                ("SetString", (c.c_char_p * 1)(b"erk")),
            ):
                assert slave.call(function, (c.c_uint * 1)(reference_), ONE, values) == ERROR
                assert str(reference_) in slave.errors[-1]


def test_number_and_percent_signs_of_a_message_are_doubled(fmu):
    """`#r12#` is a reference to a variable, and the message is a printf format."""
    with Slave(fmu("cart")) as slave:
        names = (c.c_char_p * 1)(b"a#r12#b%d")
        assert slave.call("SetDebugLogging", 1, ONE, names) == ERROR
        assert "a##r12##b%" in slave.errors[-1]


def test_log_categories(fmu):
    def switch(slave, on, *names):
        return slave.call("SetDebugLogging", on, c.c_size_t(len(names)), (c.c_char_p * max(1, len(names)))(*names))

    with Slave(fmu("cart")) as slave:
        assert switch(slave, 1, b"logNonsense") == ERROR
        assert "logNonsense" in slave.errors[-1]
        count = len(slave.messages)
        slave.call("Reset")
        assert len(slave.messages) == count, "events are off at first"
        assert switch(slave, 1) == OK
        slave.call("Reset")
        assert slave.messages[-1] == (OK, "logEvents", "reset")
        assert switch(slave, 0) == OK
        count = len(slave.messages)
        assert slave.call("CancelStep") == ERROR
        assert len(slave.messages) == count
