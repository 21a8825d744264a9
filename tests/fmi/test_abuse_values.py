"""Misuse of variables: refused with a message or tolerated, and a reset reproduces the first run bit for bit."""

from __future__ import annotations

import ctypes as c
import math

import pytest

from tests.fmi.raw import ERROR, OK, Slave
from tests.fmi.subjects import STATES, SUBJECTS, Checks, Double, Int, One, References, Text, refused

NONE = c.c_size_t(0)
VALUES = {"Real": Double, "Integer": Int, "Boolean": Int, "String": Text}
BAD = {"nan": math.nan, "inf": math.inf, "-inf": -math.inf}
WILD = {"largest": 1.7976931348623157e308, "smallest": 5e-324, "-largest": -1.7976931348623157e308, "-0": -0.0}

check = Checks()


def at(subject, slave, state="step"):
    return subject.bring_to(slave, state)


# --- null pointers and nothing ---


@check(*(f"{way}{kind}" for way in ("Get", "Set") for kind in VALUES))
def nothing_with_null_arrays_is_fine(subject, slave, function):
    assert at(subject, slave).call(function, None, NONE, None) == OK


@check(*(f"{way}{kind}" for way in ("Get", "Set") for kind in VALUES))
def null_references(subject, slave, function):
    refused(slave, at(subject, slave).call(function, None, One, VALUES[function[3:]]()))


@check(*(f"{way}{kind}" for way in ("Get", "Set") for kind in VALUES))
def null_values(subject, slave, function):
    refused(slave, at(subject, slave).call(function, References(0), One, None))


@check(2**64 - 1, 2**63, 2**60)
def counts_beyond_memory(subject, slave, count):
    """Behind the array there are more zeros, which are references as good as any."""
    at(subject, slave)
    n, references, reals, orders = c.c_size_t(count), (c.c_uint * 100_000)(), Double(), (c.c_int * 100_000)(*[1] * 100_000)
    for kind, values in VALUES.items():
        for way in ("Get", "Set"):
            refused(slave, slave.call(f"{way}{kind}", references, n, values()))
    for function in ("SetRealInputDerivatives", "GetRealOutputDerivatives"):
        refused(slave, slave.call(function, references, n, orders, reals))
    refused(slave, slave.call("GetDirectionalDerivative", references, n, references, One, reals, reals))
    refused(slave, slave.call("GetDirectionalDerivative", references, One, references, n, reals, reals))
    refused(slave, slave.call("SetDebugLogging", 1, n, Text(b"logAll")))


@check("Real", "Integer", "Boolean", "String")
def references_that_do_not_exist(subject, slave, kind):
    at(subject, slave)
    for reference in (0, len(subject.fmu.variables) + 1, 10**6, 2**31 - 1, 2**31, 2**32 - 1):
        for way in ("Get", "Set"):
            refused(slave, slave.call(f"{way}{kind}", References(reference), One, VALUES[kind]()))


@check("first", "middle", "last")
def one_unknown_reference_among_many_sets_nothing(subject, slave, place):
    at(subject, slave)
    if not subject.inputs:
        pytest.skip("no input")
    names = [subject.reference(name) for name in subject.inputs] * 3
    names[{"first": 0, "middle": len(names) // 2, "last": -1}[place]] = 99999
    before = slave.reals(subject.inputs)
    refused(
        slave,
        slave.call("SetReal", (c.c_uint * len(names))(*names), c.c_size_t(len(names)), (c.c_double * len(names))(*[3.0] * len(names))),
    )
    assert slave.reals(subject.inputs) == before


@check()
def the_same_reference_many_times(subject, slave):
    at(subject, slave)
    count = 5000
    references, values = (c.c_uint * count)(*[subject.reference(subject.output)] * count), (c.c_double * count)()
    assert slave.call("GetReal", references, c.c_size_t(count), values) == OK
    assert len(set(values)) == 1 and values[0] == slave.get(subject.output)
    references = (c.c_uint * count)(*[subject.reference(subject.input)] * count)
    assert slave.call("SetReal", references, c.c_size_t(count), (c.c_double * count)(*range(count))) == OK
    assert slave.get(subject.input) == count - 1, "the last one counts"


# --- kinds of variables that may not be set ---


@check("output", "fixed", "integer")
def what_cannot_be_set_at_a_communication_point(subject, slave, kind):
    at(subject, slave)
    name = subject.fixed[0] if kind == "fixed" else getattr(subject, kind)
    before = slave.get(name)
    refused(slave, slave.set(name, 1))
    assert slave.get(name) == before


@check(*STATES)
def outputs_cannot_be_set(subject, slave, state):
    at(subject, slave, state)
    for name in subject.outputs:
        assert slave.set(name, 0.0) == ERROR


@check(*STATES)
def the_method_cannot_be_nonsense(subject, slave, state):
    at(subject, slave, state)
    before = slave.get("solver.method")
    for text in ("", "ERK", " erk", "erk ", "%s%n%n", "e" * 100_000, "ü", "erk\n"):
        refused(slave, slave.set("solver.method", text))
    refused(slave, slave.call("SetString", subject.references("solver.method"), One, Text(None)))
    assert slave.get("solver.method") == before


@check()
def strings_that_are_no_utf8(subject, slave):
    assert slave.call("SetString", subject.references("solver.method"), One, Text(b"caf\xc3\xa9")) == ERROR


@check()
def a_string_stays_after_the_next_call(subject, slave):
    at(subject, slave)
    value = Text()
    assert slave.call("GetString", subject.references("solver.method"), One, value) == OK
    method = value[0]
    slave.run(0.002, 0.001)
    assert value[0] == method


# --- numbers beyond measure ---


@check(*BAD)
def inputs_must_be_finite(subject, slave, case):
    for state in ("initialization", "step"):
        with Slave(subject.fmu) as other:
            at(subject, other, state)
            for name in subject.inputs:
                refused(other, other.set(name, BAD[case]))
    at(subject, slave)


@check(*BAD)
def parameters_must_be_finite(subject, slave, case):
    for name in subject.fixed + subject.tunables:
        refused(slave, slave.set(name, BAD[case]))


@check(*WILD)
def inputs_of_any_size_are_borne(subject, slave, case):
    at(subject, slave)
    for name in subject.inputs:
        assert slave.set(name, WILD[case]) == OK
    for name in subject.outputs:
        assert slave.try_get(name)[0] in (OK, ERROR)
    assert slave.step(0, 0.001) in (OK, ERROR)
    for name in subject.outputs:
        status, value = slave.try_get(name)
        assert status == ERROR or not math.isnan(value), name


@check(*WILD)
def start_values_of_any_size_are_borne(subject, slave, case):
    starts = [name for name in subject.fixed if name.endswith(("q0", "qd0"))]
    assert slave.setup() == OK and slave.call("EnterInitializationMode") == OK
    for name in starts:
        assert slave.set(name, WILD[case]) == OK
    for name in subject.outputs:
        slave.try_get(name)
    if slave.call("ExitInitializationMode") == OK:
        assert slave.step(0, 0.001) in (OK, ERROR)


@check(*WILD)
def tunable_parameters_of_any_size_are_borne(subject, slave, case):
    at(subject, slave)
    for name in subject.tunables or [subject.tunable]:
        assert slave.set(name, WILD[case]) in (OK, ERROR)
    assert slave.step(0, 0.001) in (OK, ERROR)


@check("rtol", "atol", "max_step")
def solver_settings_out_of_bounds(subject, slave, setting):
    bad = {"rtol": (0.0, -1.0, 0.2, 1e300), "atol": (-1e-300, -1.0), "max_step": (-1e-300, -1.0)}
    for value in bad[setting]:
        refused(slave, slave.set(f"solver.{setting}", value))


@check("erk", "adams", "dirk", "bdf", "exponential", "auto")
def every_method_runs_at_the_smallest_rtol(subject, slave, method):
    slave.initialize(start={"solver.method": method, "solver.rtol": 1e-300})
    slave.step(0, 0.001)


@check("rtol 0.1", "atol 0", "atol 1e300", "max_step 1e-300", "max_step 1e300")
def solver_settings_at_their_bounds(subject, slave, case):
    setting, value = case.split()
    assert slave.setup() == OK and slave.call("EnterInitializationMode") == OK
    assert slave.set(f"solver.{setting}", float(value)) == OK
    assert slave.call("ExitInitializationMode") in (OK, ERROR)
    slave.step(0, 0.001)


@check("erk", "adams", "dirk", "bdf", "exponential", "auto")
def every_method_runs_every_model(subject, slave, method):
    slave.initialize(start={"solver.method": method})
    slave.run(0.01, 0.001)
    assert all(math.isfinite(value) for value in slave.reals(subject.outputs))


# --- derivatives ---


def directional(slave, unknowns, knowns, directions=None):
    found = (c.c_double * max(1, len(unknowns)))()
    directions = [1.0] * len(knowns) if directions is None else directions
    status = slave.call(
        "GetDirectionalDerivative",
        (c.c_uint * len(unknowns))(*unknowns),
        c.c_size_t(len(unknowns)),
        (c.c_uint * len(knowns))(*knowns),
        c.c_size_t(len(knowns)),
        (c.c_double * len(knowns))(*directions),
        found,
    )
    return status, list(found[: len(unknowns)])


@check("no unknowns", "no knowns", "neither")
def directional_derivatives_of_nothing(subject, slave, case):
    at(subject, slave)
    unknowns = [subject.reference(subject.output)] if case == "no knowns" else []
    knowns = [subject.reference(subject.input)] if case == "no unknowns" else []
    status, found = directional(slave, unknowns, knowns)
    assert status == OK and found == [0.0] * len(unknowns)


@check("unknowns", "knowns", "directions", "derivatives")
def directional_derivatives_with_a_null(subject, slave, case):
    at(subject, slave)
    arguments = {
        "unknowns": subject.references(subject.output),
        "nu": One,
        "knowns": subject.references(subject.input),
        "nk": One,
        "directions": Double(1),
        "derivatives": Double(),
    }
    arguments[case] = None
    refused(slave, slave.call("GetDirectionalDerivative", *arguments.values()))


@check("more knowns", "more unknowns")
def directional_derivatives_of_unequal_numbers(subject, slave, case):
    at(subject, slave)
    outputs, inputs = ([subject.reference(name) for name in names] for names in (subject.outputs, subject.inputs))
    if not inputs:
        pytest.skip("no input")
    unknowns, knowns = (outputs[:1], inputs * 7) if case == "more knowns" else (outputs * 7, inputs[:1])
    status, found = directional(slave, unknowns, knowns)
    assert status == OK and all(math.isfinite(value) for value in found)
    if case == "more unknowns":
        assert found == directional(slave, outputs, knowns)[1] * 7


@check(*BAD)
def directions_must_be_finite(subject, slave, case):
    at(subject, slave)
    refused(slave, directional(slave, [subject.reference(subject.output)], [subject.reference(subject.input)], [BAD[case]])[0])


@check("known as unknown", "unknown as known", "unknown reference", "known reference", "method")
def directional_derivatives_of_the_wrong_thing(subject, slave, case):
    at(subject, slave)
    output, known = subject.reference(subject.output), subject.reference(subject.input)
    no_state = subject.reference(next(name for name in subject.outputs if name.endswith((".qdd", ".tau"))))
    pairs = {
        "known as unknown": (known, known),
        "unknown as known": (output, no_state),
        "unknown reference": (2**32 - 1, known),
        "known reference": (output, 2**32 - 1),
        "method": (output, subject.reference("solver.rtol")),
    }
    refused(slave, directional(slave, [pairs[case][0]], [pairs[case][1]])[0])


def of_order(slave, function, reference, order, value=0.0):
    cell = Double(value)
    return slave.call(function, References(reference), One, Int(order), cell), cell[0]


@check(-2147483648, -1, 0, 4, 5, 1000, 2147483647)
def input_derivatives_of_any_order(subject, slave, order):
    refused(slave, of_order(at(subject, slave), "SetRealInputDerivatives", subject.reference(subject.input), order)[0])


@check(-2147483648, -1, 0, 2, 3, 1000, 2147483647)
def output_derivatives_of_any_order(subject, slave, order):
    refused(slave, of_order(at(subject, slave), "GetRealOutputDerivatives", subject.reference(subject.output), order)[0])


@check(*BAD)
def input_derivatives_must_be_finite(subject, slave, case):
    refused(slave, of_order(at(subject, slave), "SetRealInputDerivatives", subject.reference(subject.input), 1, BAD[case])[0])


@check(*WILD)
def input_derivatives_of_any_size_are_borne(subject, slave, case):
    at(subject, slave)
    for order in (1, 2, 3):
        assert of_order(slave, "SetRealInputDerivatives", subject.reference(subject.input), order, WILD[case])[0] == OK
    assert slave.step(0, 0.001) in (OK, ERROR)


@check("SetRealInputDerivatives", "GetRealOutputDerivatives")
def derivatives_with_nulls(subject, slave, function):
    at(subject, slave)
    assert slave.call(function, None, NONE, None, None) == OK
    refused(slave, slave.call(function, None, One, Int(1), Double()))
    refused(slave, slave.call(function, References(0), One, None, Double()))
    refused(slave, slave.call(function, References(0), One, Int(1), None))


@check("SetRealInputDerivatives of outputs", "GetRealOutputDerivatives of inputs", "GetRealOutputDerivatives of parameters")
def derivatives_of_the_wrong_thing(subject, slave, case):
    function, _, kind = case.split()
    name = {"outputs": lambda: subject.output, "inputs": lambda: subject.input, "parameters": lambda: subject.fixed[0]}[kind]()
    refused(slave, of_order(at(subject, slave), function, subject.reference(name), 1)[0])


@pytest.mark.parametrize("name", SUBJECTS)
@pytest.mark.parametrize("what", check.names)
def test_abuse_of_values(subject, what, name):
    check.run(what, subject(name))
