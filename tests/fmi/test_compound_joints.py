"""Joints with several DOF through the built FMU, against equations derived here."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np
import pytest
from fmpy import extract, read_model_description
from fmpy.fmi2 import FMU2Slave
from scipy.integrate import solve_ivp
from scipy.spatial.transform import Rotation

from tests.fmi.conftest import ROOT, build_fmu
from tests.fmi.raw import ERROR, OK, Slave


class Run:
    """One instance of a model text, with variables by name."""

    def __init__(self, text: str, folder: Path, name: str):
        (folder / f"{name}.toml").write_text(text)
        fmu = build_fmu(folder / f"{name}.toml", folder / f"{name}.fmu")
        description = read_model_description(str(fmu))
        self.references = {v.name: v.valueReference for v in description.modelVariables}
        self.slave = FMU2Slave(
            guid=description.guid,
            unzipDirectory=extract(str(fmu), str(folder / name)),
            modelIdentifier=description.coSimulation.modelIdentifier,
            instanceName=name,
        )
        self.slave.instantiate()
        self.slave.setupExperiment()
        self.slave.enterInitializationMode()

    def get(self, *names: str) -> np.ndarray:
        return np.array(self.slave.getReal([self.references[name] for name in names]))

    def array(self, name: str, size: int) -> np.ndarray:
        return self.get(*(f"{name}[{i + 1}]" for i in range(size)))

    def put(self, values: dict[str, float]) -> None:
        self.slave.setReal([self.references[name] for name in values], list(values.values()))

    def start(self) -> None:
        self.slave.exitInitializationMode()


FREE_BODY = """
name = "body"
gravity = [0, 0, 0]
[[link]]
name = "body"
joint = "free"
mass = 2
inertia = [1.0, 2.0, 3.5]
qd = [0.3, -0.2, 0.1, 0.4, 3.0, -0.2]
[solver]
rtol = 1e-10
[fmu]
outputs = ["acceleration", "energy", "solver", "momentum"]
"""


def euler_body(omega: np.ndarray, inertia: np.ndarray) -> np.ndarray:
    return np.cross(inertia * omega, omega) / inertia


def rotated(q: np.ndarray, v: np.ndarray) -> np.ndarray:
    w, u = q[0], q[1:]
    return v + 2 * np.cross(u, np.cross(u, v) + w * v)


def integrate_euler(q, omega, inertia, time):
    """Euler's equations and the quaternion."""

    def slope(_, y):
        w, x, yy, z = y[:4]
        a, b, c = y[4:]
        dq = 0.5 * np.array([-x * a - yy * b - z * c, w * a + yy * c - z * b, w * b + z * a - x * c, w * c + x * b - yy * a])
        return np.concatenate([dq, euler_body(y[4:], inertia)])

    end = solve_ivp(slope, (0, time), np.concatenate([q, omega]), rtol=1e-12, atol=1e-14, method="DOP853").y[:, -1]
    return end[:4], end[4:]


def test_a_tumbling_body_follows_eulers_equations_through_all_angles(tmp_path):
    run = Run(FREE_BODY, tmp_path, "body")
    run.start()
    inertia = np.array([1.0, 2.0, 3.5])
    momentum = run.array("momentum.angular", 3)
    steepest = 0.0
    for k in range(500):
        run.slave.doStep(k * 0.02, 0.02)
        steepest = max(steepest, abs(run.array("body.angle", 3)[1]))
    assert steepest > math.radians(80), "the run must come near the singular angle"
    q, omega = integrate_euler(np.array([1.0, 0, 0, 0]), np.array([0.4, 3.0, -0.2]), inertia, 10.0)
    assert run.array("body.omega", 3) == pytest.approx(omega, abs=1e-7)
    own = run.array("body.quaternion", 4)
    assert own * np.sign(own @ q) == pytest.approx(q, abs=1e-7)
    assert run.get("body[1].q", "body[2].q", "body[3].q") == pytest.approx([3.0, -2.0, 1.0], abs=1e-9)
    assert run.array("momentum.angular", 3) == pytest.approx(momentum, abs=1e-7)
    assert run.array("body.alpha", 3) == pytest.approx(euler_body(run.array("body.omega", 3), inertia), abs=1e-12)


def test_a_torque_in_link_axes_accelerates_the_body(tmp_path):
    run = Run(FREE_BODY.replace("0.4, 3.0, -0.2]", "0, 0, 0]"), tmp_path, "pushed")
    run.put({"body.tau[1]": 1.0, "body.tau[2]": -4.0, "body.tau[3]": 7.0, "body[2].tau": 6.0})
    run.start()
    assert run.array("body.alpha", 3) == pytest.approx([1, -2, 2], abs=1e-13)
    assert run.get("body[2].qdd")[0] == pytest.approx(3, abs=1e-13)
    run.slave.doStep(0.0, 0.5)
    assert run.get("energy.balance")[0] == pytest.approx(0, abs=1e-9)


def test_start_orientation_is_a_parameter(tmp_path):
    run = Run(FREE_BODY, tmp_path, "turned")
    half = math.sqrt(0.5)
    run.put({"body.quaternion0[1]": half, "body.quaternion0[2]": 0, "body.quaternion0[3]": 0, "body.quaternion0[4]": half})
    assert run.array("body.angle", 3) == pytest.approx([math.pi / 2, 0, 0], abs=1e-15)


@pytest.mark.parametrize("length", [0, 1e-7, 1e101, 1e155, 1e300])
def test_a_start_orientation_has_a_length(built, length):
    with Slave(built(FREE_BODY)) as slave:
        assert slave.setup() == OK and slave.call("EnterInitializationMode") == OK
        for i in range(1, 5):
            assert slave.set(f"body.quaternion0[{i}]", length * (i == 2)) == OK
        assert slave.call("ExitInitializationMode") == ERROR
        assert "body.quaternion0 must not be zero" in slave.errors[-1]


@pytest.mark.parametrize("angles", [(0.3, math.pi / 2, 0.2), (0.3, -math.pi / 2, 0.2), (2.5, math.pi / 2 - 1e-9, -1.0), (3.0, 1.5, -3.0)])
def test_the_angles_give_the_orientation_also_where_they_are_singular(tmp_path, angles):
    """At 90 deg about x only the sum or the difference of the others is determined."""
    run = Run(FREE_BODY, tmp_path, "body")
    x, y, z, w = Rotation.from_euler("ZXY", angles).as_quat()
    run.put({f"body.quaternion0[{i}]": value for i, value in enumerate((w, x, y, z), 1)})
    run.start()
    turn = Rotation.from_euler("ZXY", run.array("body.angle", 3)).inv() * Rotation.from_euler("ZXY", angles)
    assert turn.magnitude() < 1e-14


def test_the_top_keeps_its_three_integrals(tmp_path):
    run = Run((ROOT / "models/top.toml").read_text(), tmp_path, "top")
    run.start()
    up = lambda: rotated(np.array([1, -1, -1, -1]) * run.array("top.quaternion", 4), np.array([0.0, 0, 1]))
    about_vertical = lambda: up() @ (np.array([0.012, 0.012, 0.001]) * run.array("top.omega", 3))
    before = about_vertical()
    for k in range(200):
        run.slave.doStep(k * 0.01, 0.01)
    # spin about the figure axis, momentum about the vertical, energy
    assert run.array("top.omega", 3)[2] == pytest.approx(200, abs=1e-9)
    assert about_vertical() == pytest.approx(before, abs=1e-8)
    assert run.get("energy.balance")[0] == pytest.approx(0, abs=1e-7)
    # slow precession at m g l / (I3 omega3), to the order of its nutation
    slow = 9.81 * 0.1 / (0.001 * 200)
    assert run.array("top.angle", 3)[0] != pytest.approx(0, abs=0.1 * slow)


def cycloid(start: float, end: float, duration: float, time: float) -> tuple[float, float, float]:
    s = time / duration
    rate = (end - start) / duration
    return (
        start + (end - start) * (s - math.sin(2 * math.pi * s) / (2 * math.pi)),
        rate * (1 - math.cos(2 * math.pi * s)),
        rate * 2 * math.pi / duration * math.sin(2 * math.pi * s),
    )


ARM_START, ARM_END = (0.3803, -0.6198, 1.2867), -math.pi / 2


def test_the_space_robot_under_pd_control_ends_where_redysim_does(tmp_path):
    run = Run((ROOT / "models/space_robot.toml").read_text(), tmp_path, "space_robot")
    run.start()
    h, largest = 0.01, 0.0
    for k in range(3000):
        for i, start in enumerate(ARM_START, 1):
            q, qd = run.get(f"joint{i}.q", f"joint{i}.qd")
            wanted = cycloid(start, ARM_END, 30, k * h)
            run.put({f"joint{i}.tau": 49 * (wanted[0] - q) + 14 * (wanted[1] - qd)})
        run.slave.doStep(k * h, h)
        largest = max(largest, *map(abs, run.array("momentum.linear", 3)), *map(abs, run.array("momentum.angular", 3)))
    # ReDySim prints 7 digits; the torques are held for 10 ms here
    assert run.get("base[1].q", "base[2].q", "base.angle[1]") == pytest.approx([0.07182897, 0.03810805, 1.038754], abs=2e-6)
    assert largest < 1e-10


def test_the_space_robot_follows_a_prescribed_motion_to_the_exact_end_pose(tmp_path):
    text = (ROOT / "models/space_robot.toml").read_text().replace("joint_name", 'drive = "motion"\njoint_name')
    run = Run(text, tmp_path, "space_motion")

    def apply(time: float) -> None:
        for i, start in enumerate(ARM_START, 1):
            run.put(dict(zip((f"joint{i}.q", f"joint{i}.qd", f"joint{i}.qdd"), cycloid(start, ARM_END, 30, time), strict=True)))

    apply(0)
    run.start()
    for k in range(3000):
        run.slave.doStep(k * 0.01, 0.01)
        apply((k + 1) * 0.01)
    end = run.get("base[1].q", "base[2].q", "base.angle[1]")
    assert end == pytest.approx([0.07184232258, 0.0381927257, 1.036175915247], abs=1e-6)


def test_a_universal_joint_equals_two_revolute_joints(tmp_path):
    body = "mass = 2\ncom = [0.1, 0.2, 0.3]\ninertia = [0.02, 0.03, 0.04]\n"
    universal = 'name = "u"\n[[link]]\nname = "body"\njoint = "universal"\nalpha = 0.4\na = 0.2\n'
    universal += "q = [0.3, -0.7]\nqd = [1, 2]\n" + body
    # the second axis is the turned y: a link frame turned by -90 deg about x, and back
    half = math.pi / 2
    pair = 'name = "p"\n[[link]]\nname = "cross"\nalpha = 0.4\na = 0.2\nq = 0.3\nqd = 1\n'
    pair += f'[[link]]\nname = "turned"\nalpha = {-half}\nq = -0.7\nqd = 2\n'
    pair += f'[[link]]\nname = "body"\njoint = "fixed"\nalpha = {half}\n' + body
    one, other = Run(universal, tmp_path, "u"), Run(pair, tmp_path, "p")
    assert one.get("body[1].qdd", "body[2].qdd") == pytest.approx(other.get("cross.qdd", "turned.qdd"), abs=1e-12)
    assert one.get("energy.total") == pytest.approx(other.get("energy.total"), abs=1e-13)


def test_cylindrical_and_planar_joints_are_in_the_stated_order(tmp_path):
    run = Run(
        'name = "c"\ngravity = [0, 0, 0]\n[[link]]\nname = "rod"\njoint = "cylindrical"\nmass = 2\ninertia = [1, 1, 4]\n', tmp_path, "c"
    )
    run.put({"rod[1].tau": 8.0, "rod[2].tau": 6.0})
    assert run.get("rod[1].qdd", "rod[2].qdd") == pytest.approx([2, 3])
    run = Run('name = "s"\ngravity = [0, -9, 0]\n[[link]]\nname = "disc"\njoint = "planar"\nmass = 2\ninertia = [1, 1, 4]\n', tmp_path, "s")
    run.put({"disc[1].tau": 8.0, "disc[3].tau": 6.0})
    assert run.get("disc[1].qdd", "disc[2].qdd", "disc[3].qdd") == pytest.approx([4, -9, 1.5])
