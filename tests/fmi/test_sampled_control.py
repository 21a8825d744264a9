"""[controller] sample_time and delay: a zero-order hold inside the FMU, against discrete closed forms and an integration of its own."""

from __future__ import annotations

import ctypes as c
from math import cos, sin

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from scipy.linalg import expm

from build_fmu.report.sweep import METHODS
from tests.command_line import command
from tests.fmi.raw import OK, Slave, Unpacked

PERIOD = 0.02
MASSES = (2.0, 0.5)
DAMPING = (1.5, 0.3)
KP, KD, TARGET = np.diag([120.0, 30.0]), np.diag([18.0, 3.0]), np.array([0.4, -0.2])

# Two carts on one rail, the second on the first: M and the damping are constant.
CARTS = """
name = "carts"
gravity = [0, 0, -9.81]
link = [
  {name = "cart", joint = "prismatic", mass = 2.0, alpha = 1.5707963267948966, q = 0.1, damping = 1.5},
  {name = "rider", joint = "prismatic", mass = 0.5, qd = 0.3, damping = 0.3},
]
[controller]
law = "pd"
kp = [120, 30]
kd = [18, 3]
target = [0.4, -0.2]
SAMPLING
[solver]
rtol = 1e-12
atol = 1e-14
[fmu]
outputs = ["acceleration", "energy"]
tunable = ["cart.kp", "cart.target"]
"""


def carts(built, sampling: str) -> Unpacked:
    return built(CARTS.replace("SAMPLING", sampling))


def discrete_carts(delay: float, count: int) -> tuple[np.ndarray, list[np.ndarray]]:
    """Returns the states at the sampling instants, and the torques sampled there: x+ = A x + B u between all changes of u."""
    mass = np.array([[sum(MASSES), MASSES[1]], [MASSES[1], MASSES[1]]])
    inverse = np.linalg.inv(mass)
    system = np.zeros((6, 6))  # of (q, qd, u)
    system[:2, 2:4] = np.eye(2)
    system[2:4, 2:4] = -inverse @ np.diag(DAMPING)
    system[2:4, 4:] = inverse
    late, part = divmod(delay, PERIOD)
    late = int(late)
    x, torques, states = np.array([0.1, 0.0, 0.0, 0.3]), [], []
    for k in range(count + 1):
        states.append(x)
        torques.append(KP @ (TARGET - x[:2]) - KD @ x[2:])
        for duration, index in ((part, k - late - 1), (PERIOD - part, k - late)):
            held = torques[index] if index >= 0 else np.zeros(2)
            x = (expm(system * duration) @ np.concatenate([x, held]))[:4]
    return np.array(states), torques


STATE = ["cart.q", "rider.q", "cart.qd", "rider.qd"]


@pytest.mark.parametrize("method", METHODS)
@pytest.mark.parametrize("delay", (0.0, 0.005, 0.047))
def test_a_linear_plant_under_sampled_control_has_its_closed_form(built, method, delay):
    states, torques = discrete_carts(delay, 25)
    with Slave(carts(built, f"sample_time = {PERIOD}\ndelay = {delay}")) as slave:
        slave.initialize(start={"solver.method": method})
        for k in range(25):
            assert slave.reals(STATE) == pytest.approx(states[k], abs=1e-10), k
            assert slave.step(k * PERIOD, PERIOD) == OK, slave.errors
            late = k - int(delay / PERIOD)
            if late >= 0:
                assert slave.reals(["cart.tau", "rider.tau"]) == pytest.approx(torques[late], abs=1e-8)
        assert abs(slave.get("energy.balance")) < 1e-10
        assert abs(slave.get("energy.work")) > 0.01


@pytest.mark.parametrize("method", METHODS)
def test_the_communication_step_does_not_change_the_samples(built, method):
    fmu = carts(built, f"sample_time = {PERIOD}\ndelay = 0.03")
    ends = []
    for steps in (1, 7, 30, 93):
        with Slave(fmu) as slave:
            slave.initialize(start={"solver.method": method})
            for k in range(steps):
                assert slave.step(0.6 * k / steps, 0.6 * (k + 1) / steps - 0.6 * k / steps) == OK, slave.errors
            ends.append(slave.reals([*STATE, "cart.tau", "rider.tau"]))
    for end in ends[1:]:
        assert end == pytest.approx(ends[0], abs=1e-9)


def test_samples_are_counted_from_the_start_time(built):
    fmu, ends = carts(built, f"sample_time = {PERIOD}\ndelay = 0.01"), []
    for start in (0.0, 1234.567):
        with Slave(fmu) as slave:
            assert slave.setup(start) == OK
            assert slave.call("EnterInitializationMode") == slave.call("ExitInitializationMode") == OK
            slave.run(start + 0.33, 0.033, start)
            ends.append(slave.reals(STATE))
    assert ends[1] == pytest.approx(ends[0], abs=1e-9)


@pytest.mark.parametrize("method", METHODS)
def test_a_run_restored_within_a_sample_is_the_run(built, method):
    fmu = carts(built, f"sample_time = {PERIOD}\ndelay = 0.047")
    names = [*STATE, "cart.tau", "cart.qdd", "energy.work"]
    with Slave(fmu) as slave, Slave(fmu) as other:
        slave.initialize(start={"solver.method": method})
        other.initialize(start={"solver.method": method})
        slave.run(0.33, 0.03)  # within a sample, with torques on their way
        content = slave.serialize(slave.save())
        slave.run(0.6, 0.03, 0.33)
        expected = slave.reals(names)
        status, state = other.deserialize(content)
        assert status == OK and other.call("SetFMUstate", state) == OK, other.errors
        other.run(0.6, 0.03, 0.33)
        assert other.reals(names) == expected
        assert other.call("Reset") == OK
        other.initialize(start={"solver.method": method})
        other.run(0.33, 0.03)
        other.run(0.6, 0.03, 0.33)
        assert other.reals(names) == expected


def test_tuned_gains_act_with_the_next_sample(built):
    with Slave(carts(built, f"sample_time = {PERIOD}")) as slave:
        slave.initialize()
        slave.run(0.03, 0.03)
        torque = slave.get("cart.tau")
        assert slave.set("cart.kp", 500.0) == OK
        assert slave.get("cart.tau") == torque
        assert slave.step(0.03, 0.005) == OK and slave.get("cart.tau") == torque
        assert slave.step(0.035, 0.005) == OK and slave.get("cart.tau") == torque  # the limit from the left
        at, speed = slave.reals(["cart.q", "cart.qd"])
        assert slave.step(0.04, 0.005) == OK
        assert slave.get("cart.tau") == pytest.approx(500 * (0.4 - at) - 18 * speed, rel=1e-12)


def directional(slave: Slave, unknowns: list[str], known: str) -> list[float]:
    references = [[slave.fmu.variables[name][1] for name in names] for names in (unknowns, [known])]
    found = (c.c_double * len(unknowns))()
    status = slave.call(
        "GetDirectionalDerivative",
        (c.c_uint * len(unknowns))(*references[0]),
        c.c_size_t(len(unknowns)),
        (c.c_uint * 1)(*references[1]),
        c.c_size_t(1),
        (c.c_double * 1)(1.0),
        found,
    )
    assert status == OK, slave.errors
    return list(found)


def test_derivatives_hold_the_torque(built):
    """During the run the torque depends on added inputs only; in initialization mode it is that of the law, or 0 before a delay."""
    sampling = f"sample_time = {PERIOD}\ninput = true"
    unknowns = ["cart.tau", "rider.tau", "cart.qdd", "rider.qdd"]
    inverse = np.linalg.inv([[2.5, 0.5], [0.5, 0.5]])
    with Slave(carts(built, sampling)) as slave:
        assert slave.setup() == OK and slave.call("EnterInitializationMode") == OK
        assert slave.reals(["cart.tau", "rider.tau"]) == pytest.approx([120 * 0.3, -30 * 0.2 - 0.9])
        assert directional(slave, unknowns, "cart.kp") == pytest.approx([0.3, 0, *(0.3 * inverse[:, 0])])
        assert slave.call("ExitInitializationMode") == OK
        slave.run(0.05, 0.05)
        assert directional(slave, unknowns, "cart.tau_added") == pytest.approx([1, 0, *inverse[:, 0]])
        references = (c.c_uint * 2)(*(slave.fmu.variables[name][1] for name in ("cart.tau", "cart.qdd")))
        rates = (c.c_double * 2)()
        assert slave.call("GetRealOutputDerivatives", references, c.c_size_t(2), (c.c_int * 2)(1, 1), rates) == OK, slave.errors
        qdd = np.array(slave.reals(["cart.qdd", "rider.qdd"]))
        assert rates[0] == 0 and rates[1] == pytest.approx(-(inverse @ (np.array(DAMPING) * qdd))[0], rel=1e-9)
    with Slave(carts(built, sampling + "\ndelay = 0.01")) as slave:
        assert slave.setup() == OK and slave.call("EnterInitializationMode") == OK
        assert slave.reals(["cart.tau", "rider.tau"]) == [0, 0]
        assert directional(slave, unknowns, "cart.kp") == [0, 0, 0, 0]


ARM = """
name = "arm"
gravity = [0, -9.81, 0]
START
[[link]]
name = "arm"
mass = 1.5
com = [0.4, 0, 0]
inertia = [0.01, 0.05, 0.07]
q = 0.3
damping = 0.2
[[trajectory]]
joint = "arm"
type = "quintic"
to = 1.2
start = 0.013
duration = 0.5
[[actuator]]
joint = "arm"
time_constant = 0.01
torque_limit = 9
torque_limit_width = 9
[controller]
law = "LAW"
kp = KP
kd = 3
sample_time = 0.01
delay = 0.004
[solver]
method = "METHOD"
rtol = 1e-11
atol = 1e-13
[fmu]
outputs = ["acceleration", "energy", "actuator"]
"""


def reference(time: float) -> tuple[float, float, float]:
    s = min(max((time - 0.013) / 0.5, 0), 1)
    return (
        0.3 + 0.9 * s**3 * (10 - 15 * s + 6 * s * s),
        0.9 * 30 * s * s * (1 - s) ** 2 / 0.5,
        0.9 * 60 * s * (1 - s) * (1 - 2 * s) / 0.25,
    )


def soft_limit(torque: float, limit: float = 9.0, width: float = 9.0) -> float:
    def onset(x: float) -> float:
        u = min(max(x / width, 0), 1)
        return width * u**3 * (1 - u / 2) + max(x - width, 0)

    return torque - onset(torque - limit + width / 2) + onset(-torque - limit + width / 2)


def simulated_arm(law: str, stop: float) -> np.ndarray:
    """The arm with lag and limit, integrated between the changes of the torque: an independent simulation."""
    inertia, weight, damping, lag, period, delay = 0.07 + 1.5 * 0.16, 1.5 * 9.81 * 0.4, 0.2, 0.01, 0.01, 0.004

    def command_at(time: float, q: float, qd: float) -> float:
        wanted, rate, acceleration = reference(time)
        pd = 40 * (wanted - q) + 3 * (rate - qd)
        if law == "pd":
            return pd
        if law == "gravity_compensation":
            return pd + weight * cos(q)
        if law == "feed_forward":
            return pd + inertia * acceleration + weight * cos(wanted) + damping * rate
        return inertia * (acceleration + pd) + weight * cos(q) + damping * qd

    y, held = np.array([0.3, 0.0, 0.0]), 0.0
    for k in range(round(stop / period)):
        sampled = command_at(k * period, y[0], y[1])
        for begin, end, torque in ((0, delay, held), (delay, period, sampled)):

            def slope(_, z, torque=torque):
                moving = soft_limit(z[2]) - weight * cos(z[0]) - damping * z[1]
                return [z[1], moving / inertia, (torque - z[2]) / lag]

            y = solve_ivp(slope, (k * period + begin, k * period + end), y, "DOP853", rtol=1e-12, atol=1e-14).y[:, -1]
        held = sampled
    return y


@pytest.mark.parametrize("law", ("pd", "gravity_compensation", "feed_forward", "computed_torque"))
def test_all_laws_act_through_the_actuator_of_a_pendulum(built, law):
    q, qd, lagged = simulated_arm(law, 0.6)
    for method in ("erk", "bdf"):
        with Slave(built(ARM.replace("LAW", law).replace("KP", "40").replace("START", "").replace("METHOD", method))) as slave:
            slave.initialize()
            slave.run(0.6, 0.05)
            assert slave.reals(["arm.q", "arm.qd", "arm.tau_joint"]) == pytest.approx([q, qd, soft_limit(lagged)], abs=2e-9)
            assert abs(slave.get("energy.balance")) < 1e-8


def test_a_start_in_equilibrium_stays_there(built):
    """Until the first torques arrive, those of the law at rest act."""
    model = ARM.replace("LAW", "pd").replace("KP", "40").replace("METHOD", "dirk").replace("to = 1.2", "to = 0.3")
    with Slave(built(model.replace("START", 'start = "equilibrium"'))) as slave:
        slave.initialize()
        q = slave.get("arm.q")
        assert soft_limit(40 * (0.3 - q)) == pytest.approx(1.5 * 9.81 * 0.4 * cos(q), rel=1e-9) and sin(q) < 0.3
        slave.run(0.3, 0.03)
        assert slave.reals(["arm.q", "arm.qd"]) == pytest.approx([q, 0], abs=1e-9)


def test_an_unstable_sample_time_is_unstable(built):
    """Gains that any continuous law of this plant supports fail at 25 Hz."""
    ends = []
    for sampling in ("", "sample_time = 0.002", "sample_time = 0.04"):
        text = CARTS.replace("SAMPLING", sampling).replace("kp = [120, 30]", "kp = [4000, 1000]").replace("kd = [18, 3]", "kd = [180, 30]")
        with Slave(built(text)) as slave:
            slave.initialize()
            slave.run(1.0, 0.02)
            ends.append(abs(slave.get("rider.q") + 0.2))
    assert ends[0] < 1e-3 and ends[1] < 1e-3 and ends[2] > 1


@pytest.mark.parametrize("start", [2.0**28, 2.0**30, 1.75e9])
def test_samples_of_a_run_that_starts_late_are_those_of_a_run_from_zero(built, start):
    """Seconds since 1970, for example. The instants of samples are rounded to the resolution of such a time."""

    def rows(begin: float) -> np.ndarray:
        found = []
        with Slave(fmu) as slave:
            assert (slave.setup(begin), slave.call("EnterInitializationMode"), slave.call("ExitInitializationMode")) == (OK, OK, OK)
            for k in range(64):
                assert slave.step(begin + k / 1024, 1 / 1024) == OK, slave.errors
                found.append(slave.reals(["cart.q", "rider.q", "cart.tau", "rider.tau"]))
        return np.array(found)

    fmu = built(CARTS.replace("SAMPLING", "sample_time = 0.003\ndelay = 0.001"))
    assert np.abs(rows(start) - rows(0.0)).max() < 1e3 * np.spacing(start)


@pytest.mark.parametrize(
    ("fields", "sentence"),
    [
        ("sample_time = 0", "model.toml:13:15: controller: sample_time must be > 0, got 0"),
        ("sample_time = -1\ndelay = 0.1", "model.toml:13:15: controller: sample_time must be > 0, got -1"),
        ("sample_time = 1e-9", "model.toml:13:15: controller: sample_time must be >= 1e-06 s, got 1e-09"),
        ("sample_time = 0.01\ndelay = -0.1", "model.toml:14:9: controller: delay must be >= 0, got -0.1"),
        ("delay = 0.1", "model.toml:13:9: controller: sample_time is required with delay"),
        ("sample_time = 0.01\ndelay = 11", "model.toml:14:9: controller: delay must be <= 1000 sample_time, 10 s, got 11"),
    ],
)
def test_bad_sampling_is_refused_in_one_sentence(tmp_path, fields, sentence):
    (tmp_path / "model.toml").write_text(CARTS.replace("SAMPLING", fields))
    done = command("check", tmp_path / "model.toml")
    assert done.returncode != 0
    assert sentence in done.stdout + done.stderr
    assert (done.stdout + done.stderr).count("controller: ") == 1
