"""The output group "power": <joint>.power, the power of each drive."""

from __future__ import annotations

import ctypes as c

import pytest

from tests.fmi.raw import OK, Slave

# a rail with prescribed motion, a controlled arm with a torque input, a driven and a free joint; no friction
ARM = """
name = "arm"
link = [
  {name = "rail", joint = "prismatic", drive = "motion", mass = 2, alpha = 1.57},
  {name = "arm", mass = 1, com = [0.3, 0, 0.1], inertia = [0.1, 0.2, 0.3], alpha = -1.57, q = 0.2, qd = 0.3},
  {name = "hand", mass = 0.4, com = [0.1, 0.05, 0], inertia = [0.01, 0.02, 0.03], a = 0.4, alpha = 0.3, q = -0.4},
  {name = "tail", drive = "free", mass = 0.2, com = [0.1, 0, 0], inertia = [0.01, 0.01, 0.01], a = 0.2},
]
controller = {law = "pd", joints = ["arm"], kp = 30, kd = 2, target = 1, input = true}
"""
DRIVES = ("rail", "arm", "hand")


@pytest.fixture(scope="module")
def arm(built):
    """Returns a function: the line of [fmu] -> the unpacked FMU of the arm."""
    return lambda settings: built(ARM + settings)


def drive(slave, steps: int) -> None:
    assert slave.set("hand.tau", 0.7) == OK and slave.set("arm.tau_added", -0.4) == OK
    assert slave.set("rail.qdd", 0.8) == OK and slave.set("rail.qd", 0.3) == OK
    for k in range(steps):
        assert slave.step(k * 0.01, 0.01) == OK


def work_rate(slave) -> float:
    """The time derivative of energy.work."""
    found = (c.c_double * 1)()
    reference = (c.c_uint * 1)(slave.fmu.variables["energy.work"][1])
    assert slave.call("GetRealOutputDerivatives", reference, c.c_size_t(1), (c.c_int * 1)(1), found) == OK
    return found[0]


def test_the_power_of_all_drives_is_the_rate_of_the_work(arm):
    with Slave(arm('fmu = {outputs = ["energy", "power"]}\n')) as slave:
        slave.initialize()
        drive(slave, 20)
        powers = slave.reals([f"{joint}.power" for joint in DRIVES])
        assert min(map(abs, powers)) > 1e-3
        assert sum(powers) == pytest.approx(work_rate(slave), rel=1e-12)
        torques = [slave.get("rail.tau"), slave.get("arm.tau"), 0.7]
        speeds = [0.3 + 0.8 * 0.2, slave.get("arm.qd"), slave.get("hand.qd")]
        assert powers == pytest.approx([tau * qd for tau, qd in zip(torques, speeds, strict=True)], rel=1e-12)
        # the work itself, over two short steps
        before = slave.get("energy.work")
        middle = None
        for k in (20, 20.02):
            assert slave.step(k * 0.01, 0.0002) == OK
            middle = middle or sum(slave.reals([f"{joint}.power" for joint in DRIVES]))
        assert (slave.get("energy.work") - before) / 0.0004 == pytest.approx(middle, rel=1e-5)


def test_the_description_of_power(arm):
    fmu = arm('fmu = {outputs = ["power"]}\n')
    shown = {s.get("name"): s for s in fmu.xml.iter("ScalarVariable") if s.get("name").endswith(".power")}
    assert list(shown) == [f"{joint}.power" for joint in DRIVES]
    for joint in DRIVES:
        scalar = shown[f"{joint}.power"]
        assert scalar.get("causality") == "output"
        assert (scalar[0].get("unit"), scalar[0].get("quantity")) == ("W", "Power")
        assert f"joint '{joint}'" in scalar.get("description")
    depends = fmu.dependencies("Outputs")
    motion = {"rail.q", "rail.qd"}
    assert depends["hand.power"] == {"hand.tau", *motion}
    assert depends["rail.power"] == {"arm.tau_added", "hand.tau", "rail.qdd", *motion}


def test_power_is_there_on_request_only(arm):
    assert not arm("").named("output", ".power")
