"""Thousands of lives in one process leave its memory as it was. Slow: run by `pytest -m slow`."""

from __future__ import annotations

import ctypes as c

import pytest

from tests.fmi.raw import OK, Slave

RESETS, INSTANCES = 100_000, 10_000
ALLOWED = 1000  # kB: what the allocator and Python keep to and fro

pytestmark = pytest.mark.slow


def kilobytes() -> int:
    with open("/proc/self/statm") as memory:
        return int(memory.read().split()[1]) * 4


@pytest.mark.parametrize("method", ["erk", "bdf", "auto"])
@pytest.mark.parametrize("name", ["pendulum", "four_bar"])
def test_resets(fmu, name, method):
    count = RESETS if (name, method) == ("pendulum", "erk") else RESETS // 10
    with Slave(fmu(name)) as slave:
        first = None
        for k in range(count):
            slave.initialize(start={"solver.method": method})
            assert slave.step(0, 0.01) == OK
            if k % 1000 == 0:
                values = slave.reals(slave.fmu.named("output", ".q"))
                first = first or values
                assert values == first
                state = slave.save()
                assert slave.call("FreeFMUstate", c.byref(state)) == OK
            assert slave.call("Reset") == OK
            if k == count // 10:
                before = kilobytes()
        assert not slave.messages
        grown = kilobytes() - before
    print(f"{count} resets of {name} with {method}: {grown} kB")
    assert grown < ALLOWED


@pytest.mark.parametrize("name", ["pendulum", "kuka_kr5", "kuka_kr5_computed_torque"])
def test_instances(fmu, name):
    count = INSTANCES if name == "kuka_kr5" else INSTANCES // 10
    for k in range(count):
        with Slave(fmu(name)) as slave:
            slave.initialize()
            assert slave.step(0, 0.01) == OK
            slave.save()  # left to the instance
        if k == count // 10:
            before = kilobytes()
    grown = kilobytes() - before
    print(f"{count} instances of {name}: {grown} kB")
    assert grown < ALLOWED
