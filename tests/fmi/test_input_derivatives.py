"""Inputs that move as polynomials over a step are integrated as such, hold for one step, and travel with saved states."""

from __future__ import annotations

import ctypes as c
import math

import pytest

from build_fmu.report.sweep import METHODS
from tests.fmi.raw import ERROR, OK, Slave

MASS, LENGTH, GRAVITY = 1.5, 0.7, 9.81

# a slider without gravity along it, a pendulum, a guided joint, and a port
RIG = f"""
name = "rig"
gravity = [0, -{GRAVITY}, 0]

[[link]]
name = "slider"
joint = "prismatic"
joint_name = "rail"
mass = {MASS}

[[link]]
name = "bob"
parent = "ground"
joint_name = "hinge"
mass = {MASS}
com = [{LENGTH}, 0, 0]

[[link]]
name = "arm"
parent = "ground"
joint_name = "guided"
drive = "motion"
mass = 1
com = [0.3, 0, 0]

[[link]]
name = "float"
parent = "ground"
joint = "prismatic"
joint_name = "lift"
drive = "free"
mass = {MASS}

[[frame]]
name = "handle"
link = "float"
port = "ground"

[solver]
rtol = 1e-11
atol = 1e-13
"""


@pytest.fixture(scope="module")
def rig(built):
    return built(RIG)


def set_derivatives(slave, name, *values) -> int:
    """Sets the first, second ... time derivative of an input."""
    reference, count = slave.fmu.variables[name][1], len(values)
    return slave.call(
        "SetRealInputDerivatives",
        (c.c_uint * count)(*[reference] * count),
        c.c_size_t(count),
        (c.c_int * count)(*range(1, count + 1)),
        (c.c_double * count)(*values),
    )


def polynomial(t, *derivatives):
    return sum(d * t**k / math.factorial(k) for k, d in enumerate(derivatives))


def pendulum(torque, end, q=0.0, qd=0.0, steps=4000):
    """The pendulum's own equation by classical Runge-Kutta steps."""
    inertia, h = MASS * LENGTH**2, end / steps
    f = lambda t, q, qd: (qd, (torque(t) - MASS * GRAVITY * LENGTH * math.cos(q)) / inertia)
    for k in range(steps):
        t = k * h
        a = f(t, q, qd)
        b = f(t + h / 2, q + h / 2 * a[0], qd + h / 2 * a[1])
        d = f(t + h / 2, q + h / 2 * b[0], qd + h / 2 * b[1])
        e = f(t + h, q + h * d[0], qd + h * d[1])
        q, qd = (x + h / 6 * (k1 + 2 * k2 + 2 * k3 + k4) for x, k1, k2, k3, k4 in zip((q, qd), a, b, d, e, strict=True))
    return q, qd


@pytest.mark.parametrize("method", METHODS)
@pytest.mark.parametrize("derivatives", [(2.0,), (2.0, -3.0), (2.0, -3.0, 5.0), (2.0, -3.0, 5.0, 7.0)])
def test_forces_of_joints_and_ports(rig, method, derivatives):
    with Slave(rig) as slave:
        slave.initialize(start={"solver.method": method})
        for name in ("rail.tau", "hinge.tau", "handle.force[3]"):
            assert slave.set(name, derivatives[0]) == OK
            assert set_derivatives(slave, name, *derivatives[1:]) == OK, slave.errors
        assert slave.step(0, 0.8) == OK
        exact = polynomial(0.8, 0, 0, *derivatives) / MASS, polynomial(0.8, 0, *derivatives) / MASS
        assert slave.reals(["rail.q", "rail.qd"]) == pytest.approx(exact, rel=1e-9)
        assert slave.reals(["lift.q", "lift.qd"]) == pytest.approx(exact, rel=1e-9)
        expected = pendulum(lambda t: polynomial(t, *derivatives), 0.8)
        assert slave.reals(["hinge.q", "hinge.qd"]) == pytest.approx(expected, rel=1e-8)
        # the value reached stays, its derivatives are gone
        assert slave.get("rail.tau") == pytest.approx(polynomial(0.8, *derivatives), rel=1e-14)
        assert slave.get("rail.qdd") == pytest.approx(polynomial(0.8, *derivatives) / MASS, rel=1e-12)
        before = slave.get("rail.qd")
        assert slave.step(0.8, 0.5) == OK
        assert slave.get("rail.qd") - before == pytest.approx(0.5 * polynomial(0.8, *derivatives) / MASS, rel=1e-9)


@pytest.mark.parametrize("method", METHODS)
def test_the_work_follows(rig, method):
    with Slave(rig) as slave:
        slave.initialize(start={"solver.method": method})
        for name in ("rail.tau", "hinge.tau", "handle.force[3]", "guided.q"):
            assert set_derivatives(slave, name, 1.0, 2.0, -3.0) == OK
        slave.step(0, 0.6)
        assert slave.get("energy.work") > 0.1
        assert slave.get("energy.balance") == pytest.approx(0, abs=1e-8)


ROD = """name = "rod"
link = [{name = "rod", mass = 1, com = [0.3, 0, 0], qd = 0.5}, {name = "end", a = 0.5, mass = 1, com = [0.3, 0, 0]}]
fmu = {outputs = ["power", "acceleration"]}
"""
BETWEEN = {
    "nothing": "",
    "lag": '[[actuator]]\njoint = "rod"\ntime_constant = 0.01\n',
    "limit": '[[actuator]]\njoint = "rod"\ntorque_limit = 0.1\n',
    "gear": '[[actuator]]\njoint = "rod"\nrotor_inertia = 0.01\nstiffness = 100\nbacklash = 0.01\n',
    "controller": '[controller]\nlaw = "pd"\njoints = ["rod"]\nkp = 5\nkd = 1\n',
}


@pytest.mark.parametrize("between", BETWEEN)
def test_a_derivative_does_not_change_what_was_read_before(built, between):
    with Slave(built(ROD + BETWEEN[between])) as slave:
        slave.initialize()
        names = [name for name in ("rod.power", "rod.tau", "rod.tau_joint", "end.power", "rod.qdd") if name in slave.fmu.variables]
        driven = [name for name in slave.fmu.named("input") if name.endswith(".tau")]
        assert slave.set_reals(driven, [2.0] * len(driven)) == OK and slave.step(0, 0.01) == OK
        before = slave.reals(names)
        for name in driven:
            assert set_derivatives(slave, name, 7) == OK
        assert slave.reals(names) == before
        assert slave.step(0.01, 0) == OK and slave.reals(names) == before


@pytest.mark.parametrize("name", ["guided.q", "guided.qd", "guided.qdd"])
def test_prescribed_motion_is_one_chain_of_derivatives(rig, name):
    chain = [0.2, -0.5, 0.7, 1.1, -1.3, 1.7]
    first = ["guided.q", "guided.qd", "guided.qdd"].index(name)
    with Slave(rig) as slave:
        slave.initialize()
        chain = chain[: first + 4]
        for i, part in enumerate(["guided.q", "guided.qd", "guided.qdd"]):
            if i <= first:
                assert slave.set(part, chain[i]) == OK
        assert set_derivatives(slave, name, *chain[first + 1 :]) == OK
        for t in (0.0, 0.3):
            if t:
                assert slave.step(0, t) == OK
            q, qd, qdd = (polynomial(t, *chain[k:]) for k in range(3))
            slave.step(t, 0)  # passes no time and uses nothing up
            weight = 0.3 * GRAVITY * math.cos(q) + 0.3**2 * qdd
            assert slave.get("guided.tau") == pytest.approx(weight, rel=1e-12)
        # it goes on smoothly from there, with the acceleration it has reached
        assert slave.step(0.3, 0.4) == OK
        q = q + 0.4 * qd + 0.08 * qdd
        assert slave.get("guided.tau") == pytest.approx(0.3 * GRAVITY * math.cos(q) + 0.3**2 * qdd, rel=1e-12)


@pytest.mark.parametrize("method", METHODS)
def test_saved_states_carry_them(rig, method):
    watched = ["rail.q", "hinge.q", "hinge.qd", "hinge.qdd", "lift.qd", "guided.tau", "energy.work", "energy.balance"]

    def go(slave):
        ends = []
        for k, size in enumerate((0.05, 0.01, 0.1, 0.02)):
            if k == 2:
                assert slave.set("hinge.tau", 1.0) == OK and set_derivatives(slave, "hinge.tau", 4.0, 4.0) == OK
            assert slave.step(slave.last_time(), size) == OK
            ends += slave.reals(watched)
        return ends

    with Slave(rig) as slave:
        slave.initialize(start={"solver.method": method})
        for name in ("rail.tau", "hinge.tau", "handle.force[3]", "guided.qdd"):
            assert set_derivatives(slave, name, 3.0, -2.0) == OK
        pending = slave.save()
        expected = go(slave)
        assert slave.step(slave.last_time(), 0.01) == OK
        assert slave.call("SetFMUstate", pending) == OK
        assert go(slave) == expected
        with Slave(rig) as fresh:
            status, state = fresh.deserialize(slave.serialize(pending))
            assert status == OK and fresh.call("SetFMUstate", state) == OK
            assert go(fresh) == expected
            after = fresh.save()
            assert fresh.step(fresh.last_time(), 0.3) == OK
            end = fresh.reals(watched)
            with Slave(rig) as third:  # in the middle of what the derivatives began, where they are over
                status, state = third.deserialize(fresh.serialize(after))
                assert status == OK and third.call("SetFMUstate", state) == OK
                assert third.step(third.last_time(), 0.3) == OK
                assert third.reals(watched) == end
        assert slave.call("Reset") == OK
        slave.initialize(start={"solver.method": method})
        assert slave.step(0, 0.1) == OK and slave.get("rail.q") == 0, "forgotten by a reset"


def test_setting_zero_derivatives_changes_no_bit(fmu):
    ends = []
    for zeros in (False, True):
        with Slave(fmu("cart")) as slave:
            slave.initialize(start={"solver.method": "adams"})
            for k in range(30):
                if zeros:
                    assert set_derivatives(slave, "hinge.tau", 0.0, 0.0, 0.0) == OK
                assert slave.step(k * 0.01, 0.01) == OK
            ends.append(slave.reals(["hinge.q", "rail.qd"]) + [slave.get("solver.steps")])
    assert ends[0] == ends[1]


def test_what_is_refused(rig):
    with Slave(rig) as slave:
        slave.initialize()
        one, call = c.c_size_t(1), slave.call
        assert call("SetRealInputDerivatives", None, c.c_size_t(0), None, None) == OK
        assert call("SetRealInputDerivatives", None, one, None, None) == ERROR
        tau = (c.c_uint * 1)(rig.variables["rail.tau"][1])
        for order in (-1, 0, 4):
            assert call("SetRealInputDerivatives", tau, one, (c.c_int * 1)(order), (c.c_double * 1)(1)) == ERROR
            assert "the order must be 1 to 3" in slave.errors[-1]
        for bad in (math.nan, math.inf):
            assert set_derivatives(slave, "rail.tau", 1.0, bad) == ERROR
        assert set_derivatives(slave, "rail.q", 1.0) == ERROR and "not an input" in slave.errors[-1]
        assert call("SetRealInputDerivatives", (c.c_uint * 1)(999), one, (c.c_int * 1)(1), (c.c_double * 1)(1)) == ERROR
        assert slave.step(0, 0.1) == OK and slave.get("rail.q") == 0, "a refused call changes nothing"
