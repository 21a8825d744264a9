"""Saved states: the run after a restore is the run that was not interrupted, bit for bit."""

from __future__ import annotations

import ctypes as c
import math
import subprocess
import sys
from pathlib import Path

import pytest

from build_fmu.report.sweep import METHODS
from tests.fmi.raw import ERROR, OK, Slave

ROOT = Path(__file__).resolve().parents[2]
WATCHED = [
    "rail.q",
    "hinge.q",
    "idle.q",
    "rail.qd",
    "hinge.qd",
    "hinge.qdd",
    "energy.total",
    "energy.work",
    "energy.balance",
    "solver.error_estimate",
    "hinge.tau",
    "pole.mass",
]


def drive(slave, first, last, forced):
    for k in range(first, last):
        if forced:
            assert slave.set("hinge.tau", math.sin(k)) == OK
        assert slave.step(k * 0.01, 0.01) == OK, slave.errors
    return slave.reals(WATCHED) + [slave.get("solver.steps"), slave.get("solver.rhs_evaluations")]


@pytest.mark.parametrize("forced", [False, True])
@pytest.mark.parametrize("method", METHODS)
def test_restore_repeats_the_run_bit_for_bit(fmu, method, forced):
    start = {"solver.method": method, "hinge.q0": 1.0}
    with Slave(fmu("cart")) as slave, Slave(fmu("cart")) as other:
        slave.initialize(start=start)
        other.initialize(start=start)
        expected = drive(other, 0, 80, forced)  # never saved, never restored
        drive(slave, 0, 30, forced)
        state = slave.save()
        assert drive(slave, 30, 80, forced) == expected
        assert slave.set("pole.mass", 9.0) == OK
        for _ in range(2):
            assert slave.call("SetFMUstate", state) == OK
            assert slave.last_time() == pytest.approx(0.3)
            assert drive(slave, 30, 80, forced) == expected
        # bytes, in a new instance that has done nothing yet
        content = slave.serialize(state)
        with Slave(fmu("cart")) as fresh:
            status, copy = fresh.deserialize(content)
            assert status == OK
            assert fresh.call("SetFMUstate", copy) == OK
            assert drive(fresh, 30, 80, forced) == expected
        assert slave.call("FreeFMUstate", c.byref(state)) == OK and not state.value


@pytest.mark.parametrize("rtol", [1e-60, 0.1])
def test_states_at_the_limits_of_the_tolerance(fmu, rtol):
    for name in ("pendulum", "four_bar"):
        with Slave(fmu(name)) as slave:
            slave.initialize(start={"solver.rtol": rtol})
            assert slave.step(0, 0.01) == OK, slave.errors
            assert slave.call("SetFMUstate", slave.save()) == OK, slave.errors


@pytest.mark.parametrize("method", METHODS)
def test_a_state_saved_after_a_change_of_a_parameter(fmu, method):
    """The steps since the last restart, which CVODE repeats, were taken with other parameters."""
    with Slave(fmu("cart")) as slave, Slave(fmu("cart")) as fresh:
        slave.initialize(start={"solver.method": method, "hinge.q0": 1.0})
        drive(slave, 0, 30, False)
        assert slave.set("pole.mass", 9.0) == OK
        state = slave.save()
        content = slave.serialize(state)
        expected = drive(slave, 30, 50, False)
        assert slave.call("SetFMUstate", state) == OK
        assert drive(slave, 30, 50, False) == expected
        _, copy = fresh.deserialize(content)
        assert fresh.call("SetFMUstate", copy) == OK
        assert drive(fresh, 30, 50, False) == expected
        assert slave.call("FreeFMUstate", c.byref(state)) == OK and fresh.call("FreeFMUstate", c.byref(copy)) == OK


def test_restore_brings_back_life_and_start_values(fmu):
    with Slave(fmu("cart")) as slave:
        instantiated = slave.save()
        slave.initialize(start={"hinge.q0": 2.0})
        stepping = slave.save()
        assert slave.step(0, 0.01) == OK
        assert slave.set("hinge.tau", 1e308) == OK
        assert slave.step(0.01, 0.01) == ERROR
        assert slave.call("SetFMUstate", stepping) == OK
        assert slave.step(0, 0.01) == OK
        assert slave.call("SetFMUstate", instantiated) == OK
        assert slave.get("hinge.q0") == 0.3
        slave.initialize()
        assert slave.get("hinge.q") == 0.3


def test_a_saved_state_can_be_written_over(fmu):
    with Slave(fmu("cart")) as slave:
        slave.initialize()
        state = slave.save()
        address = state.value
        slave.run(0.1, 0.01)
        assert slave.call("GetFMUstate", c.byref(state)) == OK and state.value == address
        slave.run(0.2, 0.01, start=0.1)
        assert slave.call("SetFMUstate", state) == OK
        assert slave.last_time() == pytest.approx(0.1)


def test_foreign_states_are_refused(fmu):
    with Slave(fmu("cart")) as slave, Slave(fmu("cart")) as other:
        foreign = other.save()
        assert slave.call("SetFMUstate", foreign) == ERROR
        assert slave.call("SetFMUstate", c.c_void_p(12345)) == ERROR
        assert slave.call("FreeFMUstate", c.byref(c.c_void_p(12345))) == ERROR


def test_damaged_bytes_are_refused(fmu):
    with Slave(fmu("cart")) as slave, Slave(fmu("pendulum")) as other:
        slave.initialize()
        slave.run(0.1, 0.01)
        content = slave.serialize(slave.save())
        for length in (0, 1, 10, len(content) // 2, len(content) - 1):
            assert slave.deserialize(content[:length])[0] == ERROR
        assert slave.deserialize(content + b"\0")[0] == ERROR
        for i in range(0, len(content), 7):
            assert slave.deserialize(content[:i] + bytes([content[i] ^ 1]) + content[i + 1 :])[0] == ERROR
        assert other.deserialize(content)[0] == ERROR
        assert slave.call("DeSerializeFMUstate", None, c.c_size_t(4), c.byref(c.c_void_p())) == ERROR
        assert slave.deserialize(content)[0] == OK


def test_serialized_bytes_work_in_another_process(fmu, fmu_file, tmp_path):
    with Slave(fmu("cart")) as slave:
        slave.initialize(start={"solver.method": "bdf"})
        slave.run(0.3, 0.01)
        (tmp_path / "state").write_bytes(slave.serialize(slave.save()))
        slave.run(0.6, 0.01, start=0.3)
        expected = slave.reals(WATCHED)
    program = f"""
from pathlib import Path
from tests.fmi.raw import Slave, Unpacked
slave = Slave(Unpacked(Path({str(fmu_file("cart"))!r}), Path({str(tmp_path / "fmu")!r})))
status, state = slave.deserialize(Path({str(tmp_path / "state")!r}).read_bytes())
assert status == 0 and slave.call("SetFMUstate", state) == 0
slave.run(0.6, 0.01, start=0.3)
print(slave.reals({WATCHED!r}))
"""
    run = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True, cwd=ROOT)
    assert run.returncode == 0, run.stderr
    assert run.stdout.strip() == str(expected)


def test_an_inertia_that_is_negative_by_rounding_stays_accepted(built):
    """As from a CAD program: after a reset, a restored state and a tuned parameter the same inertia counts as possible."""
    model = """name = "rounded"
[[link]]
name = "arm"
mass = 1
com = [0.1, 0, 0]
inertia = [-1e-18, 0.01, 0.01]
[fmu]
tunable = ["arm.mass"]
"""
    with Slave(built(model)) as slave:
        slave.initialize()
        saved = slave.save()
        slave.run(0.1, 0.1)
        first = slave.get("arm.q")
        assert slave.call("SetFMUstate", saved) == OK
        slave.run(0.1, 0.1)
        assert slave.get("arm.q") == first
        assert slave.set("arm.mass", 1.0) == OK
        assert slave.step(0.1, 0.1) == OK, slave.errors
        assert slave.call("FreeFMUstate", c.byref(saved)) == OK
        assert slave.call("Reset") == OK
        slave.initialize()
        slave.run(0.1, 0.1)
        assert slave.get("arm.q") == first


def test_a_reset_forgets_the_largest_displacement(built, instance):
    """The warning of a motion below the tolerance counts displacements of the present run only, also of a run that starts with a saved state."""
    model = """name = "slide"
gravity = [0, 0, 0]
link = [{name = "rail", joint = "prismatic", mass = 1}]
[solver]
rtol = 1e-6
"""
    warnings = []
    for moved_before in (False, True):
        slave = instance(built(model)).initialize()
        saved = slave.save()
        if moved_before:
            assert slave.set("rail.tau", 10.0) == OK
            slave.run(1, 0.1)
        assert slave.call("Reset") == OK
        assert slave.call("SetFMUstate", saved) == OK
        assert slave.set("rail.tau", 2e-7) == OK
        slave.run(1, 0.1)
        assert slave.call("Terminate") == OK
        warnings.append([text for _, _, text in slave.messages if "m at most, and the solver's tolerance" in text])
    assert len(warnings[0]) == 1
    assert warnings[1] == warnings[0]
