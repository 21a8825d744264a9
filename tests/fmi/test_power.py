"""The output group "power": <joint>.power, the power of each drive; <frame>.power, that of a port."""

from __future__ import annotations

import ctypes as c

import numpy as np
import pytest

from tests.fmi.raw import OK, Slave
from tests.fmi.test_drives import expect_independence

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


# a body on a moved rail that ports in both kinds of axes push and turn; nothing else does work on it
PUSHED = """
name = "pushed"
link = [
  {name = "rail", joint = "prismatic", drive = "RAIL", mass = 2, alpha = 1.57},
  {name = "base", joint = "free", drive = "free", parent = "ground", mass = 3, inertia = [0.3, 0.4, 0.5], q = [0.1, 0.2, 0.3, 0.3, 0.2, -0.4]},
  {name = "arm", mass = 1, drive = "free", com = [0.3, 0, 0.1], inertia = [0.1, 0.2, 0.3], a = 0.5, alpha = 1, q = 0.2, qd = 0.3},
]
frame = [
  {name = "hook", link = "arm", position = [0.3, -0.1, 0.2], port = "ground", outputs = ["power"]},
  {name = "jet", link = "base", position = [0.1, 0.4, 0], rpy = [0.4, 0.5, 0.6], port = "frame", outputs = ["power"]},
]
fmu = {outputs = ["energy"]}
"""
WRENCH = {"force[1]": 3.0, "force[2]": -2.0, "force[3]": 30.0, "torque[1]": 0.3, "torque[2]": -0.5, "torque[3]": 0.4}


def test_the_power_of_ports_is_the_change_of_energy(built):
    step, ends = 1e-3, 100
    with Slave(built(PUSHED.replace("RAIL", "free"))) as slave:
        slave.initialize()
        total, powers = [], []
        for k in range(2 * ends + 1):
            for sign, port in ((1, "hook"), (-1, "jet")):
                for name, value in WRENCH.items():
                    assert slave.set(f"{port}.{name}", sign * value) == OK
            if k:
                assert slave.step((k - 1) * step, step) == OK
            total.append(slave.get("energy.total"))
            powers.append(slave.reals(["hook.power", "jet.power"]))
        powers = np.array(powers)
        assert np.abs(powers).max(axis=0).min() > 1, "each port does work"
        # Simpson's rule
        work = step / 3 * (powers[:-2:2] + 4 * powers[1:-1:2] + powers[2::2]).sum()
        assert work == pytest.approx(total[-1] - total[0], rel=1e-6)
        # a changed input counts at once, through its own port only
        hook, jet = powers[-1]
        for name, value in WRENCH.items():
            assert slave.set(f"hook.{name}", 2 * value) == OK
        assert slave.reals(["hook.power", "jet.power"]) == pytest.approx([2 * hook, jet], rel=1e-12)


def test_the_power_of_a_port_depends_on_its_wrench_and_on_jumps(built):
    fmu = built(PUSHED.replace("RAIL", "motion").replace('parent = "ground", ', ""))
    assert fmu.dependencies("Outputs")["hook.power"] == {"rail.q", "rail.qd", *(f"hook.{name}" for name in WRENCH)}
    scalar = next(s for s in fmu.xml.iter("ScalarVariable") if s.get("name") == "hook.power")
    assert (scalar.get("causality"), scalar[0].get("unit"), scalar[0].get("quantity")) == ("output", "W", "Power")


MOTOR = """
name = "motor"
link = [
  {name = "arm", mass = 1, com = [0.2, 0, 0], inertia = [0.1, 0.1, 0.1], qd = 1.5},
  {name = "hand", parent = "ground", mass = 1, com = [0.2, 0, 0], inertia = [0.1, 0.1, 0.1], qd = 1.5},
]
actuator = [
  {joint = "arm", gear_ratio = 20, resistance = 2, torque_constant = 0.05},
  {joint = "hand", torque_limit = 3, torque_limit_width = 1, speed_limit = 1.6, speed_limit_width = 0.5},
]
fmu = {outputs = ["power", "actuator", "energy", "acceleration"], tunable = ["arm.resistance", "arm.torque_constant",
  "hand.torque_limit", "hand.torque_limit_width", "hand.speed_limit", "hand.speed_limit_width"]}
"""


def test_initial_outputs_name_the_parameters_of_actuators(built):
    fmu = built(MOTOR)
    with Slave(fmu) as slave:
        assert slave.setup() == OK and slave.call("EnterInitializationMode") == OK
        assert slave.set("arm.voltage", 5.0) == OK and slave.set("hand.tau", 3.1) == OK
        numbers = [n for n in fmu.named("parameter") if n.startswith(("arm.", "hand."))]
        expect_independence(slave, fmu.dependencies("InitialUnknowns"), {n: slave.get(n) for n in numbers})
