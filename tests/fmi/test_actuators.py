"""[[actuator]]: gears, limits, lags and DC motors through the FMU, against closed forms, quadrature and laws of energy."""

from __future__ import annotations

import ctypes as c
import math

import numpy as np
import pytest

from build_fmu.model.describe import describe
from build_fmu.report.sweep import METHODS
from tests.fmi.conftest import ROOT
from tests.fmi.raw import OK, Slave, Unpacked

INERTIA = 0.3

WHEEL = """
name = "wheel"
gravity = [0, 0, 0]
{top}

[[link]]
name = "wheel"
mass = 1
inertia = [0.2, 0.2, 0.3]
{link}

[[actuator]]
joint = "wheel"
{fields}

[solver]
rtol = 1e-12
atol = 1e-14

[fmu]
outputs = ["acceleration", "energy", "solver", "actuator"]
"""


def wheel(built, fields: str, link: str = "", top: str = "") -> Unpacked:
    return built(WHEEL.format(fields=fields, link=link, top=top))


def expected(slave: Slave, values: dict[str, float], tolerance: float) -> None:
    found = slave.reals(list(values))
    for (name, value), number in zip(values.items(), found, strict=True):
        assert number == pytest.approx(value, abs=tolerance * max(1.0, abs(value))), name


def test_a_rigid_gear_adds_the_reflected_inertia_and_no_outputs(built):
    fmu = wheel(built, "gear_ratio = 20\nrotor_inertia = 1e-3")
    assert not fmu.named("output", ".tau_joint") and not fmu.named("output", ".saturated")
    with Slave(fmu) as slave:
        slave.initialize(start={"wheel.tau": 2.0})
        assert slave.get("wheel.qdd") == pytest.approx(2 / (INERTIA + 20**2 * 1e-3), rel=1e-14)


# A pendulum that a loop holds, and a slider-crank whose rod and crank are in line at the start.
HELD = """
name = "held"
gravity = [0, -9.81, 0]
[[link]]
name = "arm"
mass = 1
com = [0.1, 0, 0]
inertia = [0.1, 0.1, 0.1]
[[loop]]
name = "pin"
type = "point"
link_a = "arm"
link_b = "ground"
point_a = [0.2, 0, 0]
point_b = [0.2, 0, 0]
directions = [[0, 1, 0]]
[[actuator]]
joint = "arm"
gear_ratio = 20
FIELDS
[solver]
method = "METHOD"
[fmu]
outputs = ["actuator"]
"""
HEAVY = HELD.replace("[0.1, 0.1, 0.1]", "[3e7, 3e7, 3e7]")
DEAD_POINT = """
name = "crank"
gravity = [0, -9.81, 0]
link = [
  {name = "crank", gamma = 1.3, mass = 1, com = [0.05, 0, 0], inertia = [0.01, 0.01, 0.01], qd = 10},
  {name = "rod", a = 0.1, mass = 0.5, com = [0.15, 0, 0], inertia = [0.005, 0.005, 0.005], qd = -13.333333333333334},
  {name = "arm", parent = "ground", joint = "prismatic", alpha = 1.5707963267948966, gamma = 2.8707963267948964, mass = 1, q = 0.4},
]
[[loop]]
name = "pin"
type = "point"
link_a = "rod"
link_b = "arm"
point_a = [0.3, 0, 0]
directions = [[1, 0, 0], [0, 1, 0]]
[[actuator]]
joint = "arm"
FIELDS
[solver]
method = "METHOD"
[fmu]
outputs = ["actuator"]
"""


@pytest.mark.parametrize(
    "model, fields, drive, output, final",
    [
        (HELD, "resistance = 2\ntorque_constant = 0.03\ninductance = 0.02", "arm.voltage", "arm.current", 1.5),
        (HEAVY, "resistance = 2\ntorque_constant = 0.03\ninductance = 0.02", "arm.voltage", "arm.current", 1.5),
        (HELD, "time_constant = 0.01", "arm.tau", "arm.tau_joint", 3.0),
        (DEAD_POINT, "time_constant = 0.01", "arm.tau", "arm.tau_joint", 3.0),
    ],
)
@pytest.mark.parametrize("method", METHODS)
def test_currents_and_lags_at_joints_that_loops_hold(built, method, model, fields, drive, output, final):
    with Slave(built(model.replace("FIELDS", fields).replace("METHOD", method))) as slave:
        slave.initialize(start={drive: 3.0})
        for k in range(10):
            assert slave.step(k * 0.05, 0.05) == OK, slave.errors
            assert slave.get(output) == pytest.approx(final * (1 - math.exp(-(k + 1) * 5)), rel=2e-5)


@pytest.mark.parametrize("step", [0.05, 0.005, 0.003])
def test_lags_keep_the_tolerance_between_the_ends_of_steps(built, step):
    """Stability limits the steps of the explicit method, and one step serves several communication steps."""
    model = HEAVY.replace("FIELDS", "time_constant = 0.01").replace("METHOD", "erk")
    with Slave(built(model)) as slave:
        slave.initialize(start={"arm.tau": 3.0})
        for k in range(round(0.5 / step)):
            assert slave.step(k * step, step) == OK, slave.errors
            assert slave.get("arm.tau_joint") == pytest.approx(3 * (1 - math.exp(-(k + 1) * step / 0.01)), abs=3e-5)


def test_gains_of_dc_motors_are_voltages_per_error(tmp_path):
    """docs/actuators.md; a joint without a motor keeps N m/rad."""
    links = ("turn", "revolute"), ("slide", "prismatic"), ("plain", "revolute")
    text = "".join(f'[[link]]\nname = "{name}"\njoint = "{kind}"\nmass = 1\ninertia = [1, 1, 1]\n' for name, kind in links)
    text += "".join(f'[[actuator]]\njoint = "{name}"\nresistance = 1\ntorque_constant = 0.1\n' for name in ("turn", "slide"))
    text += '[controller]\nlaw = "pd"\nkp = [1, 2, 3]\nkd = [1, 2, 3]\n[fmu]\ntunable = ["turn.kp", "turn.kd", "slide.kp", "slide.kd", "plain.kp", "plain.kd"]\n'
    (tmp_path / "motors.toml").write_text('name = "motors"\n' + text)
    model = describe(tmp_path / "motors.toml")
    assert {v.name: v.unit for v in model.variables if v.name.endswith((".kp", ".kd"))} == {
        "turn.kp": "V/rad",
        "turn.kd": "V.s/rad",
        "slide.kp": "V/m",
        "slide.kd": "V.s/m",
        "plain.kp": "N.m/rad",
        "plain.kd": "N.m.s/rad",
    }
    bases = {unit["name"]: unit for unit in model.units}
    # V = kg m2 s-3 A-1
    assert bases["V.s/rad"]["base"] == {"kg": 1, "m": 2, "s": -2, "A": -1, "rad": -1}
    assert bases["V/m"]["base"] == {"kg": 1, "m": 1, "s": -3, "A": -1}


def test_armature_beside_an_elastic_gear_is_on_the_side_of_the_joint(built):
    fmu = wheel(built, "gear_ratio = 20\nrotor_inertia = 1e-3\nstiffness = 50", link="armature = 0.15")
    with Slave(fmu) as slave:
        slave.initialize(start={"wheel.tau": 2.0})
        slave.run(0.5, 0.02)
        omega = math.sqrt(50 * (1 / 0.4 + 1 / (INERTIA + 0.15)))
        twist = 2 / (0.4 * omega**2) * (1 - math.cos(omega * 0.5))
        assert slave.get("wheel.tau_joint") == pytest.approx(50 * twist, rel=1e-9)


def test_outputs_exist_on_request_only(built):
    text = WHEEL.format(fields="gear_ratio = 20\nrotor_inertia = 1e-3\nstiffness = 50\ntorque_limit = 1", link="", top="")
    names = {"wheel.motor_q", "wheel.motor_qd", "wheel.tau_joint", "wheel.saturated"}
    assert names <= set(built(text).named("output"))
    assert not names & set(built(text.replace(', "actuator"', "")).named("output"))


@pytest.mark.parametrize("method", METHODS)
def test_a_lag_follows_its_closed_form(built, method):
    """x = u (1 - exp(-t/T)): a second input starts from the value reached."""
    lag, torque = 0.05, 3.0
    with Slave(wheel(built, f"time_constant = {lag}")) as slave:
        slave.initialize(start={"solver.method": method, "wheel.tau": torque})
        assert slave.get("wheel.tau_joint") == 0
        slave.run(0.1, 0.02)
        rest = math.exp(-0.1 / lag)
        speed = torque / INERTIA * (0.1 - lag * (1 - rest))
        expected(slave, {"wheel.tau_joint": torque * (1 - rest), "wheel.qd": speed}, 1e-9)
        assert slave.set("wheel.tau", 0.0) == OK
        slave.run(0.2, 0.02, start=0.1)
        left = torque * (1 - rest)
        expected(
            slave,
            {"wheel.tau_joint": left * rest, "wheel.qd": speed + left * lag * (1 - rest) / INERTIA},
            1e-9,
        )


@pytest.mark.parametrize("method", METHODS)
def test_a_lag_sees_inputs_that_move_within_a_step(built, method):
    """u = s t: x = s (t - T (1 - exp(-t/T)))."""
    lag, slope, stop = 0.05, 7.0, 0.1
    with Slave(wheel(built, f"time_constant = {lag}")) as slave:
        slave.initialize(start={"solver.method": method})
        reference = (c.c_uint * 1)(slave.fmu.variables["wheel.tau"][1])
        assert slave.call("SetRealInputDerivatives", reference, c.c_size_t(1), (c.c_int * 1)(1), (c.c_double * 1)(slope)) == OK
        assert slave.step(0, stop) == OK, slave.errors
        expected(slave, {"wheel.tau": slope * stop, "wheel.tau_joint": slope * (stop - lag * (1 - math.exp(-stop / lag)))}, 1e-9)


def test_limits_bound_the_torque_and_the_speed(built):
    with Slave(wheel(built, "torque_limit = 2\nspeed_limit = 5")) as slave:
        slave.initialize(start={"wheel.tau": 1.9})
        expected(slave, {"wheel.tau_joint": 1.9, "wheel.saturated": 0}, 1e-15)
        assert slave.set("wheel.tau", 8.0) == OK
        expected(slave, {"wheel.tau_joint": 2, "wheel.saturated": 0.75}, 1e-15)
        slave.run(0.6, 0.05)
        expected(slave, {"wheel.qd": 2 / INERTIA * 0.6}, 1e-10)  # not yet near the limit
        slave.run(5, 0.05, start=0.6)
        speed = slave.get("wheel.qd")
        assert 4.95 < speed < 5 and slave.get("wheel.saturated") > 0.99
        assert slave.set("wheel.tau", -8.0) == OK
        expected(slave, {"wheel.tau_joint": -2, "wheel.qdd": -2 / INERTIA}, 1e-14)  # braking is not limited


@pytest.mark.parametrize("method", METHODS)
def test_the_elastic_two_mass_oscillator_has_its_closed_form(built, method):
    """Twist s: s'' = tau/J - k s (1/J + 1/M), with the rotor's J on the joint side; the mean moves by tau/(J + M)."""
    ratio, rotor, stiffness, torque = -20.0, 1e-3, 50.0, 2.0
    reflected = ratio**2 * rotor
    omega = math.sqrt(stiffness * (1 / reflected + 1 / INERTIA))
    fmu = wheel(built, f"gear_ratio = {ratio}\nrotor_inertia = {rotor}\nstiffness = {stiffness}", link="qd = 0.5\nq = 0.2")
    with Slave(fmu) as slave:
        slave.initialize(start={"solver.method": method, "wheel.tau": torque})
        expected(slave, {"wheel.motor_q": ratio * 0.2, "wheel.motor_qd": ratio * 0.5, "wheel.tau_joint": 0}, 1e-15)
        stop = 1.0
        slave.run(stop, 0.02)
        twist = torque / (reflected * omega**2) * (1 - math.cos(omega * stop))
        rate = torque / (reflected * omega) * math.sin(omega * stop)
        mean = 0.2 + 0.5 * stop + 0.5 * torque / (reflected + INERTIA) * stop**2
        speed = 0.5 + torque / (reflected + INERTIA) * stop
        share = reflected / (reflected + INERTIA)
        q, qd = mean - share * twist, speed - share * rate
        values = {
            "wheel.q": q,
            "wheel.qd": qd,
            "wheel.motor_q": ratio * (q + twist),
            "wheel.motor_qd": ratio * (qd + rate),
            "wheel.tau_joint": stiffness * twist,
            "energy.kinetic": 0.5 * INERTIA * qd**2 + 0.5 * reflected * (qd + rate) ** 2,
            "energy.potential": 0.5 * stiffness * twist**2,
        }
        expected(slave, values, 1e-9)
        assert abs(slave.get("energy.balance")) < 1e-9


BACKLASH = {"gear_ratio": 10.0, "rotor_inertia": 2e-3, "stiffness": 80.0, "backlash": 0.06, "backlash_width": 0.02}


def play_energy(twist: float) -> float:
    """Integral of the gear's torque k h(|s| - b/2)."""
    depth, width = abs(twist) - BACKLASH["backlash"] / 2, BACKLASH["backlash_width"]
    if depth <= 0:
        return 0.0
    u = min(depth / width, 1.0)
    soft = width**2 * u**4 * (0.25 - 0.1 * u)
    return BACKLASH["stiffness"] * (soft + (depth - width * u) * (width + depth - width * u) / 2)


@pytest.mark.parametrize("method", METHODS)
def test_the_oscillator_with_backlash_agrees_with_quadrature(built, method):
    """Constant torque from rest: mu s'^2 / 2 = tau mu / J s - E(s), so the time to a twist is an integral over pieces."""
    torque = 3.0
    reflected = BACKLASH["gear_ratio"] ** 2 * BACKLASH["rotor_inertia"]
    mu = 1 / (1 / reflected + 1 / INERTIA)
    play, width = BACKLASH["backlash"] / 2, BACKLASH["backlash_width"]
    target = play + 1.7 * width
    nodes, weights = np.polynomial.legendre.leggauss(60)
    time = 0.0
    for low, high in ((0.0, play), (play, play + width), (play + width, target)):
        a, b = math.sqrt(low), math.sqrt(high)  # s = x^2: smooth at the start
        for x, weight in zip(0.5 * (b - a) * nodes + 0.5 * (a + b), 0.5 * (b - a) * weights, strict=True):
            speed = math.sqrt(2 / mu * (torque * mu / reflected * x * x - play_energy(x * x)))
            time += weight * 2 * x / speed
    rate = math.sqrt(2 / mu * (torque * mu / reflected * target - play_energy(target)))
    with Slave(wheel(built, "\n".join(f"{name} = {value}" for name, value in BACKLASH.items()))) as slave:
        slave.initialize(start={"solver.method": method, "wheel.tau": torque})
        for k in range(8):
            assert slave.step(k * time / 8, time / 8) == OK, slave.errors
        ratio = BACKLASH["gear_ratio"]
        q, qd, motor_q, motor_qd = slave.reals(["wheel.q", "wheel.qd", "wheel.motor_q", "wheel.motor_qd"])
        assert motor_q / ratio - q == pytest.approx(target, abs=1e-9)
        assert motor_qd / ratio - qd == pytest.approx(rate, abs=1e-9)
        expected(slave, {"wheel.tau_joint": BACKLASH["stiffness"] * 1.2 * width, "energy.potential": play_energy(target)}, 1e-8)


@pytest.mark.parametrize("method", METHODS)
@pytest.mark.parametrize("inductance", [0.0, 0.02])
def test_the_step_response_of_a_dc_motor_has_its_closed_form(built, method, inductance):
    ratio, rotor, resistance, constant, voltage, stop = 8.0, 1e-3, 1.5, 0.2, 12.0, 0.3
    inertia, gain = INERTIA + ratio**2 * rotor, ratio * constant
    fields = f"gear_ratio = {ratio}\nrotor_inertia = {rotor}\nresistance = {resistance}\ntorque_constant = {constant}\n"
    with Slave(wheel(built, fields + f"inductance = {inductance}")) as slave:
        assert "wheel.tau" not in slave.fmu.variables
        slave.initialize(start={"solver.method": method, "wheel.voltage": voltage})
        slave.run(stop, 0.05)
        final = voltage / gain
        if inductance == 0:
            decay = math.exp(-(gain**2) / (resistance * inertia) * stop)
            speed, current = final * (1 - decay), voltage / resistance * decay
        else:  # L M w'' + R M w' + gain^2 w = gain V, both roots real
            half = resistance / (2 * inductance)
            root = math.sqrt(half**2 - gain**2 / (inductance * inertia))
            a, b = -half + root, -half - root
            speed = final * (1 + (b * math.exp(a * stop) - a * math.exp(b * stop)) / (a - b))
            current = inertia / gain * final * a * b * (math.exp(a * stop) - math.exp(b * stop)) / (a - b)
        expected(slave, {"wheel.qd": speed, "wheel.current": current, "wheel.tau_joint": gain * current}, 1e-10)


# Every part of an actuator at once.
FULL = """gear_ratio = 12
rotor_inertia = 2e-3
stiffness = 60
damping = 0.4
backlash = 0.02
torque_limit = 3
speed_limit = 4
time_constant = 0.02
resistance = 1.2
inductance = 0.01
torque_constant = 0.15"""


@pytest.mark.parametrize("method", METHODS)
def test_a_saved_state_continues_bit_for_bit(built, method):
    with Slave(wheel(built, FULL)) as slave:
        slave.initialize(start={"solver.method": method, "wheel.voltage": 20.0})
        slave.run(0.1, 0.01)
        content = slave.serialize(slave.save())
        outputs = [o for o in slave.fmu.named("output") if not o.startswith("solver.")]

        def rest() -> list[float]:
            assert slave.set("wheel.voltage", -15.0) == OK
            slave.run(0.3, 0.01, start=0.1)
            return slave.reals(outputs)

        first = rest()
        status, state = slave.deserialize(content)
        assert status == OK and slave.call("SetFMUstate", state) == OK
        assert rest() == first


@pytest.mark.parametrize("method", METHODS)
def test_energy_is_accounted_for(built, method):
    """The motor's torque does work, the gear's damping takes it; electrical energy is outside."""
    with Slave(wheel(built, FULL)) as slave:
        slave.initialize(start={"solver.method": method, "solver.rtol": 1e-9, "solver.atol": 1e-11})
        for k in range(100):
            assert slave.set("wheel.voltage", 25 * math.sin(0.4 * k)) == OK
            assert slave.step(k * 0.02, 0.02) == OK, slave.errors
            assert abs(slave.get("energy.balance")) < 1e-7
        assert slave.get("energy.total") > 0.01


def looped(fields: str) -> str:
    """The five-bar whose drives follow targets that they cannot reach fast enough."""
    text = (ROOT / "models" / "five_bar.toml").read_text(encoding="utf-8")
    for joint in ("left_drive", "right_drive"):
        text += f'\n[[actuator]]\njoint = "{joint}"\n{fields}\n'
    return text + '\n[controller]\nlaw = "pd"\nkp = 40\nkd = 1\ninput = true\n'


def test_two_actuators_in_their_limits_drive_a_loop(built):
    """Saturated most of the time; no failure, no drift, energy accounted for."""
    fmu = built(
        looped("gear_ratio = 20\nrotor_inertia = 1e-4\nstiffness = 60\ndamping = 0.3\nbacklash = 0.01\ntorque_limit = 1.5\nspeed_limit = 6")
    )
    with Slave(fmu) as slave:
        slave.initialize(start={"solver.rtol": 1e-8, "solver.atol": 1e-10})
        for k in range(1000):
            assert slave.set("left_drive.tau_added", 60 * math.sin(0.031 * k)) == OK
            assert slave.set("right_drive.tau_added", 60 * math.sin(0.047 * k)) == OK
            assert slave.step(k * 0.01, 0.01) == OK, slave.errors
        assert abs(slave.get("energy.balance")) < 1e-6
        assert all(gap < 1e-10 for gap in slave.reals(slave.fmu.named("output", ".gap")))


def test_a_controller_acts_through_the_actuator(built):
    """.tau is what the law asks for, .tau_joint what arrives; without limits both agree."""
    controller = '\n[controller]\nlaw = "pd"\nkp = 30\nkd = 2\ntarget = 1\n'
    with Slave(built(WHEEL.format(fields="torque_limit = 5", link="", top="") + controller)) as slave:
        slave.initialize()
        expected(slave, {"wheel.tau": 30, "wheel.tau_joint": 5, "wheel.qdd": 5 / INERTIA}, 1e-14)
    voltage = "resistance = 2\ntorque_constant = 0.5"
    with Slave(built(WHEEL.format(fields=voltage, link="", top="") + controller)) as slave:
        slave.initialize()
        expected(slave, {"wheel.voltage": 30, "wheel.current": 15, "wheel.tau_joint": 7.5}, 1e-14)


ARM = """alpha = 1.5707963267948966
com = [0.5, 0, 0]
q = 0.3"""


@pytest.mark.parametrize(
    "fields", [FULL, "time_constant = 0.1", "torque_limit = 2", "gear_ratio = 5\nrotor_inertia = 1e-3\nstiffness = 30"]
)
def test_a_start_in_equilibrium_rests_in_every_part(built, fields):
    top = 'start = "equilibrium"'
    text = WHEEL.format(fields=fields, link=ARM, top=top).replace("gravity = [0, 0, 0]", "gravity = [0, 0, -9.81]")
    with Slave(built(text)) as slave:
        drive = "wheel.voltage" if "wheel.voltage" in slave.fmu.variables else "wheel.tau"
        gain = 12 * 0.15 / 1.2 if drive == "wheel.voltage" else 1
        slave.initialize(start={drive: 1.5 / gain})
        # m g l cos(q) = tau is an unstable and a stable branch below the horizontal
        angle = -math.acos(1.5 / (9.81 * 0.5))
        expected(slave, {"wheel.q": angle, "wheel.tau_joint": 1.5}, 1e-9)
        slave.run(1.0, 0.1)
        expected(slave, {"wheel.q": angle, "wheel.qd": 0, "wheel.tau_joint": 1.5}, 1e-8)


def test_an_inverse_model_ends_at_the_joint(built):
    rigid = WHEEL.format(fields="gear_ratio = 20\nrotor_inertia = 1e-3", link="", top="inverse = true").replace(', "actuator"', "")
    elastic = WHEEL.format(fields=FULL, link="", top="inverse = true").replace(', "actuator"', "")
    motion = {"wheel.q": 0.0, "wheel.qd": 0.0, "wheel.qdd": 2.0}
    with Slave(built(rigid)) as slave:
        slave.initialize(start=motion)
        expected(slave, {"wheel.tau": 2 * (INERTIA + 20**2 * 1e-3)}, 1e-14)
        assert "wheel.tau_joint" not in slave.fmu.variables
    with Slave(built(elastic)) as slave:
        slave.initialize(start=motion)
        expected(slave, {"wheel.tau_joint": 2 * INERTIA}, 1e-14)
        assert not {"wheel.tau", "wheel.voltage", "wheel.motor_q"} & set(slave.fmu.variables)


# every tunable number: the file's value, another one
ELASTIC = {
    "stiffness": (50.0, 70.0),
    "damping": (0.5, 0.8),
    "backlash": (0.02, 0.03),
    "backlash_width": (0.01, 0.02),
    "torque_limit": (2.0, 1.5),
    "torque_limit_width": (0.4, 0.6),
    "speed_limit": (1.2, 1.0),
    "speed_limit_width": (0.8, 0.5),
    "time_constant": (0.05, 0.08),
}
MOTOR = {"resistance": (2.0, 1.5), "inductance": (0.01, 0.02), "torque_constant": (0.1, 0.15), "torque_limit": (3.0, 2.0)}
GEAR = {"stiffness": "gear_stiffness", "damping": "gear_damping"}


def actuator_fields(numbers: dict[str, float], fixed: str) -> str:
    return fixed + "".join(f"\n{name} = {value}" for name, value in numbers.items())


@pytest.mark.parametrize(
    ("numbers", "fixed"), [(ELASTIC, "gear_ratio = 20\nrotor_inertia = 1e-3"), (MOTOR, "gear_ratio = 30\ntorque_limit_width = 0.2")]
)
def test_a_tuned_number_acts_as_that_of_the_file(built, numbers, fixed):
    tunable = "".join(f'"wheel.{GEAR.get(name, name)}", ' for name in numbers)
    before = WHEEL.format(fields=actuator_fields({name: pair[0] for name, pair in numbers.items()}, fixed), link="", top="")
    fmu = built(before.replace("[fmu]", f"[fmu]\ntunable = [{tunable}]"))
    source = fmu.named("input")[0]

    def run(of, values: dict[str, float], later: bool = False) -> list[float]:
        with Slave(of) as slave:
            slave.initialize(start={source: 6.0} | ({} if later else values))
            if later:
                for name, value in values.items():
                    assert slave.set(name, value) == OK, slave.errors
            slave.run(0.5, 0.1)
            assert abs(slave.get("energy.balance")) < 1e-9
            return slave.reals(["wheel.q", "wheel.qd", "wheel.qdd", "wheel.tau_joint", "energy.total"])

    first = run(fmu, {})
    for name, (_, value) in numbers.items():
        changed = {field: pair[1] if field == name else pair[0] for field, pair in numbers.items()}
        expected_values = run(built(WHEEL.format(fields=actuator_fields(changed, fixed), link="", top="")), {})
        tuned = {f"wheel.{GEAR.get(name, name)}": value}
        assert run(fmu, tuned) == pytest.approx(expected_values, rel=1e-9), name
        assert run(fmu, tuned, later=True) == pytest.approx(expected_values, rel=1e-9), name
        assert max(abs(a - b) for a, b in zip(first, expected_values, strict=True)) > 1e-6, name


def test_a_gear_tuned_under_load_keeps_the_balance(built):
    """The change of the stored energy is not work."""
    text = WHEEL.format(fields="gear_ratio = 20\nrotor_inertia = 1e-3\nstiffness = 50", link="", top="")
    with Slave(built(text.replace("[fmu]", '[fmu]\ntunable = ["wheel.gear_stiffness"]'))) as slave:
        slave.initialize(start={"wheel.tau": 3.0})
        slave.run(0.2, 0.1)
        before = slave.get("energy.potential")
        assert before > 1e-3 and slave.set("wheel.gear_stiffness", 100.0) == OK
        assert slave.get("energy.potential") == pytest.approx(2 * before, rel=1e-12)
        slave.run(0.5, 0.1, 0.2)
        assert abs(slave.get("energy.balance")) < 1e-10


def test_derivatives_by_tunable_numbers_are_exact(built):
    names = {"wheel.torque_limit": 2.0, "wheel.torque_limit_width": 1.0, "wheel.speed_limit": 3.0, "wheel.speed_limit_width": 2.0}
    text = WHEEL.format(fields="\n".join(f"{name[6:]} = {value}" for name, value in names.items()), link="qd = 1.7", top="")
    fmu = built(text.replace("[fmu]", f"[fmu]\ntunable = {list(names)}"))

    def acceleration(values: dict[str, float]) -> float:
        with Slave(fmu) as slave:
            return slave.initialize(start=values).get("wheel.qdd")

    with Slave(fmu) as slave:
        assert slave.setup() == OK and slave.call("EnterInitializationMode") == OK
        assert slave.set("wheel.tau", 1.9) == OK
        unknown = (c.c_uint * 1)(fmu.variables["wheel.qdd"][1])
        for name, value in names.items():
            known, found = (c.c_uint * 1)(fmu.variables[name][1]), (c.c_double * 1)()
            one = c.c_size_t(1)
            assert slave.call("GetDirectionalDerivative", unknown, one, known, one, (c.c_double * 1)(1), found) == OK, slave.errors
            sides = [acceleration({"wheel.tau": 1.9, name: value + sign * 1e-6}) for sign in (-1, 1)]
            assert found[0] == pytest.approx((sides[1] - sides[0]) / 2e-6, rel=1e-6, abs=1e-8) and found[0] != 0, name


def test_a_width_beyond_its_tuned_limit_is_refused(built):
    text = WHEEL.format(fields="torque_limit = 2\ntorque_limit_width = 1", link="", top="")
    with Slave(built(text.replace("[fmu]", '[fmu]\ntunable = ["wheel.torque_limit"]')), logging=True) as slave:
        slave.initialize()
        assert slave.set("wheel.torque_limit", 0.5) == OK
        assert slave.step(0, 0.1) != OK
        assert "wheel.torque_limit_width must be <= wheel.torque_limit" in slave.errors[-1]


def test_an_inverse_model_has_no_tunable_actuator(built):
    text = WHEEL.format(fields="torque_limit = 2", link="", top="inverse = true")
    assert not built(text.replace("[fmu]", '[fmu]\ntunable = ["wheel.torque_limit"]')).named("parameter", "torque_limit")


@pytest.mark.slow
def test_a_six_bar_in_its_limits_runs_for_ten_thousand_seconds(built):
    """Two drives that are limited in torque or speed half of the time; 20 s of CPU time."""
    text = (ROOT / "models/space_six_bar.toml").read_text()
    text = text.replace('joint = "planar"\ndrive = "free"', 'joint = "fixed"').replace("gravity = [0, 0, 0]", "gravity = [0, -9.81, 0]")
    for bar in range(1, 6):
        text = text.replace(f'name = "bar{bar}"', f'name = "bar{bar}"\ndamping = {5 if bar == 5 else 2}')
    text = text.replace('name = "bar5"', 'name = "bar5"\ndrive = "free"').split("[fmu]")[0] + '[fmu]\noutputs = ["energy", "actuator"]\n'
    limits = "".join(f'[[actuator]]\njoint = "joint{k}"\ntorque_limit = 120\nspeed_limit = 2\n' for k in (1, 4))
    step, steps, limited, worst = 0.1, 100_000, 0, 0.0
    with Slave(built(text.replace("[solver]", limits + "[solver]"))) as slave:
        slave.initialize(start={"solver.rtol": 1e-9, "solver.atol": 1e-11})
        for k in range(steps):
            torques = (200 * math.sin(0.7 * k * step), 200 * math.cos(0.43 * k * step))
            assert slave.set_reals(["joint1.tau", "joint4.tau"], torques) == OK
            assert slave.step(k * step, step) == OK, slave.errors
            *saturated, balance = slave.reals(["joint1.saturated", "joint4.saturated", "energy.balance"])
            limited += sum(value > 0.01 for value in saturated)
            worst = max(worst, abs(balance)) if math.isfinite(balance) else math.inf
    assert limited > 0.5 * 2 * steps
    assert worst < 1e-6
