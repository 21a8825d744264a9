"""Misuse of saved states: freed, foreign, truncated at every length, every byte changed, from every state of the instance into every other."""

from __future__ import annotations

import ctypes as c
import itertools

import pytest

from tests.fmi.raw import ERROR, OK, Slave
from tests.fmi.subjects import SIZE, STATES, SUBJECTS, Checks, refused

check = Checks()


def running(subject, slave):
    subject.bring_to(slave, "step")
    slave.run(3 * SIZE, SIZE)
    return slave


@check("GetFMUstate", "SetFMUstate", "SerializedFMUstateSize", "SerializeFMUstate", "DeSerializeFMUstate")
def null_pointers(subject, slave, function):
    running(subject, slave)
    size, none = c.c_size_t(), c.c_size_t(0)
    arguments = {
        "GetFMUstate": [None],
        "SetFMUstate": [None],
        "SerializedFMUstateSize": [None, c.byref(size)],
        "SerializeFMUstate": [None, c.create_string_buffer(10), c.c_size_t(10)],
        "DeSerializeFMUstate": [None, none, None],
    }
    refused(slave, slave.call(function, *arguments[function]))


@check()
def more_null_pointers(subject, slave):
    state = running(subject, slave).save()
    refused(slave, slave.call("SerializedFMUstateSize", state, None))
    refused(slave, slave.call("SerializeFMUstate", state, None, c.c_size_t(1 << 20)))
    refused(slave, slave.call("DeSerializeFMUstate", slave.serialize(state), c.c_size_t(100), None))
    assert slave.call("FreeFMUstate", None) == OK
    assert slave.call("FreeFMUstate", c.byref(c.c_void_p())) == OK


@check("set", "size", "serialize", "free", "overwrite")
def a_freed_state_is_none(subject, slave, case):
    state = running(subject, slave).save()
    stale = c.c_void_p(state.value)
    assert slave.call("FreeFMUstate", c.byref(state)) == OK and not state.value
    assert slave.call("FreeFMUstate", c.byref(state)) == OK, "nothing is left to be freed"
    calls = {
        "set": lambda: slave.call("SetFMUstate", stale),
        "size": lambda: slave.call("SerializedFMUstateSize", stale, c.byref(c.c_size_t())),
        "serialize": lambda: slave.call("SerializeFMUstate", stale, c.create_string_buffer(10000), c.c_size_t(10000)),
        "free": lambda: slave.call("FreeFMUstate", c.byref(stale)),
        "overwrite": lambda: slave.call("GetFMUstate", c.byref(stale)),
    }
    refused(slave, calls[case]())


@check("set", "free", "overwrite", "serialize")
def another_instances_state_is_none(subject, slave, case):
    running(subject, slave)
    with Slave(subject.fmu) as other:
        state = running(subject, other).save()
        calls = {
            "set": lambda: slave.call("SetFMUstate", state),
            "free": lambda: slave.call("FreeFMUstate", c.byref(state)),
            "overwrite": lambda: slave.call("GetFMUstate", c.byref(state)),
            "serialize": lambda: slave.call("SerializeFMUstate", state, c.create_string_buffer(10000), c.c_size_t(10000)),
        }
        refused(slave, calls[case]())
        assert other.call("SetFMUstate", state) == OK


@check(1, 8, 2**31, 2**63, 2**64 - 1)
def an_address_that_is_none(subject, slave, address):
    running(subject, slave)
    refused(slave, slave.call("SetFMUstate", c.c_void_p(address)))
    refused(slave, slave.call("FreeFMUstate", c.byref(c.c_void_p(address))))


@check()
def bytes_cut_at_every_length(subject, slave):
    content = slave.serialize(running(subject, slave).save())
    for length in range(len(content)):
        assert slave.deserialize(content[:length])[0] == ERROR, length


@check(0, 1, 2, 3, 4, 5, 6, 7)
def bytes_with_one_bit_changed(subject, slave, bit):
    content = bytearray(slave.serialize(running(subject, slave).save()))
    for place in range(len(content)):
        content[place] ^= 1 << bit
        assert slave.deserialize(bytes(content))[0] == ERROR, place
        content[place] ^= 1 << bit
    assert slave.deserialize(bytes(content))[0] == OK


@check("longer", "twice", "zeros", "ones", "text", "older version", "newer version", "other model")
def bytes_of_something_else(subject, slave, case):
    content = slave.serialize(running(subject, slave).save())
    version = content.index(b"state ") + 6
    guid = subject.fmu.guid.encode()
    made = {
        "longer": content + b"\0",
        "twice": content * 2,
        "zeros": bytes(len(content)),
        "ones": b"\xff" * len(content),
        "text": b"<xml/>" * 100,
        "older version": content[:version] + b"0.0.9" + content[version + 5 :],
        "newer version": content[:version] + b"9.1.0" + content[version + 5 :],
        "other model": content.replace(guid, guid[:-1] + b"0"),
    }
    if made[case] == content:
        made[case] = content.replace(guid, guid[:-1] + b"1")
    refused(slave, slave.deserialize(made[case])[0])


@check(0, 1, -1)
def buffers_of_the_wrong_size(subject, slave, excess):
    state = running(subject, slave).save()
    content = slave.serialize(state)
    size = len(content) + excess if excess else 0
    buffer = c.create_string_buffer(b"\xaa" * (len(content) + 8), len(content) + 8)
    status = slave.call("SerializeFMUstate", state, buffer, c.c_size_t(size))
    if excess > 0:
        assert status == OK and buffer.raw[: len(content)] == content
    else:
        refused(slave, status)
        assert set(buffer.raw) == {0xAA}, "nothing was written"
    assert buffer.raw[len(content) :] == b"\xaa" * 8


@check(2**63, 2**64 - 1)
def sizes_beyond_memory(subject, slave, size):
    """Too small a buffer cannot be known, but a foreign header can: nothing behind it is read."""
    running(subject, slave)
    refused(slave, slave.call("DeSerializeFMUstate", b"x" * 4096, c.c_size_t(size), c.byref(c.c_void_p())))


@check(*(f"{a} -> {b}" for a, b in itertools.product(STATES, STATES)))
def a_state_of_one_life_set_in_another(subject, slave, case):
    first, second = case.split(" -> ")
    subject.bring_to(slave, first)
    state = slave.save()
    content = slave.serialize(state)
    assert slave.call("Reset") == OK
    subject.bring_to(slave, second)
    assert slave.call("SetFMUstate", state) == OK, slave.errors
    assert slave.serialize(slave.save()) == content, "everything is as it was"
    status = slave.call("ExitInitializationMode")
    assert (status == OK) == (first == "initialization")


@check()
def a_state_of_initialization_with_start_values(subject, slave):
    start = next((name for name in subject.fixed if name.endswith("q0")), None) or pytest.skip("no start value")
    assert slave.setup() == OK and slave.call("EnterInitializationMode") == OK
    assert slave.set(start, 0.05) == OK
    state = slave.save()
    assert slave.call("ExitInitializationMode") == OK, slave.errors
    slave.run(2 * SIZE, SIZE)
    expected = slave.reals(subject.outputs)
    for _ in range(2):
        assert slave.call("SetFMUstate", state) == OK and slave.get(start) == 0.05
        assert slave.call("ExitInitializationMode") == OK
        slave.run(2 * SIZE, SIZE)
        assert slave.reals(subject.outputs) == expected


@check()
def a_state_with_tuned_parameters_and_inputs(subject, slave):
    running(subject, slave)
    tuned, given = subject.tunables[:1], subject.inputs[:1]
    for name in [*tuned, *given]:
        assert slave.set(name, 0.25) == OK
    state = slave.save()
    before = slave.reals(subject.outputs + tuned + given)
    for name in [*tuned, *given]:
        assert slave.set(name, 0.5) == OK
    slave.run(5 * SIZE, SIZE, start=3 * SIZE)
    assert slave.call("SetFMUstate", state) == OK
    assert slave.reals(subject.outputs + tuned + given) == before


@check("erk", "adams", "dirk", "bdf", "exponential", "auto")
def a_long_run_cut_anywhere(subject, slave, method):
    """What follows a restored state, here and in another instance, is the run that was not interrupted."""
    slave.initialize(start={"solver.method": method})
    slave.run(20 * SIZE, SIZE)
    content = slave.serialize(slave.save())
    slave.run(40 * SIZE, SIZE, start=20 * SIZE)
    expected = slave.reals(subject.outputs)
    with Slave(subject.fmu) as other:
        status, state = other.deserialize(content)
        assert status == OK and other.call("SetFMUstate", state) == OK, other.errors
        assert other.serialize(state) == content
        other.run(40 * SIZE, SIZE, start=20 * SIZE)
        assert other.reals(subject.outputs) == expected


@check()
def a_thousand_states_at_once(subject, slave):
    running(subject, slave)
    states = [slave.save() for _ in range(1000)]
    assert len({state.value for state in states}) == 1000
    for state in states[::2]:
        assert slave.call("FreeFMUstate", c.byref(state)) == OK
    assert slave.call("SetFMUstate", states[501]) == OK
    # the rest goes with the instance


@pytest.mark.parametrize("name", SUBJECTS)
@pytest.mark.parametrize("what", check.names)
def test_abuse_of_states(subject, what, name):
    check.run(what, subject(name))
