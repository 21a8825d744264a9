"""Derivatives held against what others say: closed forms, and Pinocchio's derivatives of the KR5."""

from __future__ import annotations

import math
import tomllib

import numpy as np
import pytest

from tests.fmi.conftest import ROOT
from tests.fmi.raw import OK, Slave
from tests.fmi.test_directional import derivative

JOINTS = [f"joint{i + 1}" for i in range(6)]
Q, QD = [0.3, -0.7, 0.4, 1.1, -0.6, 0.2], [0.5, -0.2, 0.9, 0.3, -1.0, 0.8]
TAU = [10.0, -60.0, 25.0, 2.0, -3.0, 1.0]


def jacobian(slave, unknowns: list[str], knowns: list[str]) -> np.ndarray:
    return np.array([derivative(slave, unknowns, {known: 1.0}) for known in knowns]).T


@pytest.fixture(scope="module")
def robot():
    """Pinocchio's KR5 from the same DH parameters: (module, model, data, damping)."""
    pin = pytest.importorskip("pinocchio")
    links = tomllib.loads((ROOT / "models" / "kuka_kr5.toml").read_text())["link"]
    model, parent, damping = pin.Model(), 0, []
    turn = lambda axis, degrees: pin.SE3(pin.AngleAxis(math.radians(degrees), np.array(axis, float)).toRotationMatrix(), np.zeros(3))
    shift = lambda *xyz: pin.SE3(np.eye(3), np.array(xyz, float))
    for i, link in enumerate(links):
        of = lambda field, link=link: link.get(field, 0.0)
        place = (
            turn([0, 0, 1], of("gamma"))
            * shift(0, 0, of("b"))
            * turn([1, 0, 0], of("alpha"))
            * shift(of("a"), 0, 0)
            * turn([0, 0, 1], of("theta"))
            * shift(0, 0, of("d"))
        )
        parent = model.addJoint(parent, pin.JointModelRZ(), place, f"joint{i + 1}")
        xx, yy, zz, xy, xz, yz = [*link["inertia"], 0, 0, 0][:6]
        inertia = pin.Inertia(link["mass"], np.array(link["com"], float), np.array([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]]))
        model.appendBodyToJoint(parent, inertia, pin.SE3.Identity())
        damping.append(of("damping"))
        model.armature[i] = of("armature")
    model.gravity.linear = np.array([0, 0, -9.81])
    return pin, model, model.createData(), np.array(damping)


def kr5(fmu) -> Slave:
    slave = Slave(fmu("kuka_kr5"))
    assert slave.setup() == OK and slave.call("EnterInitializationMode") == OK
    for k, joint in enumerate(JOINTS):
        for ending, value in ((".q0", Q[k]), (".qd0", QD[k]), (".tau", TAU[k])):
            assert slave.set(joint + ending, value) == OK
    return slave


def test_accelerations_by_torques_are_the_inverse_mass_matrix(fmu, robot):
    pin, model, data, _ = robot
    with kr5(fmu) as slave:
        assert slave.call("ExitInitializationMode") == OK
        found = jacobian(slave, [f"{joint}.qdd" for joint in JOINTS], [f"{joint}.tau" for joint in JOINTS])
    expected = pin.computeMinverse(model, data, np.array(Q))
    expected = np.triu(expected) + np.triu(expected, 1).T
    assert np.abs(found - expected).max() < 1e-11 * np.abs(expected).max()


def test_accelerations_by_start_values_are_those_of_pinocchio(fmu, robot):
    pin, model, data, damping = robot
    with kr5(fmu) as slave:
        accelerations = [f"{joint}.qdd" for joint in JOINTS]
        assert slave.reals(accelerations) == pytest.approx(pin.aba(model, data, np.array(Q), np.array(QD), TAU - damping * QD), rel=1e-10)
        by_q = jacobian(slave, accelerations, [f"{joint}.q0" for joint in JOINTS])
        by_qd = jacobian(slave, accelerations, [f"{joint}.qd0" for joint in JOINTS])
    dq, dqd, inverse = (
        np.array(part) for part in pin.computeABADerivatives(model, data, np.array(Q), np.array(QD), TAU - damping * QD)[:3]
    )
    inverse = np.triu(inverse) + np.triu(inverse, 1).T
    dqd = dqd - inverse @ np.diag(damping)
    assert np.abs(by_q - dq).max() < 1e-10 * np.abs(dq).max()
    assert np.abs(by_qd - dqd).max() < 1e-10 * np.abs(dqd).max()


def test_accelerations_by_mass_and_center_are_those_of_the_regressor(fmu, robot):
    """M d qdd = -Y d pi, with pi = mass, its first and second moments about the link's origin."""
    pin, model, data, damping = robot
    body = model.inertias[6]
    mass, c = body.mass, body.lever
    qdd = pin.aba(model, data, np.array(Q), np.array(QD), TAU - damping * QD)
    regressor = pin.computeJointTorqueRegressor(model, data, np.array(Q), np.array(QD), qdd)[:, -10:]
    inverse = np.linalg.inv(pin.crba(model, data, np.array(Q)))

    def by(d_mass: float, dc: np.ndarray) -> np.ndarray:
        dh = d_mass * c + mass * dc
        moments = d_mass * (c @ c * np.eye(3) - np.outer(c, c)) + mass * (2 * c @ dc * np.eye(3) - np.outer(dc, c) - np.outer(c, dc))
        order = [(0, 0), (0, 1), (1, 1), (0, 2), (1, 2), (2, 2)]
        return -inverse @ regressor @ np.array([d_mass, *dh, *(moments[place] for place in order)])

    with kr5(fmu) as slave:
        accelerations = [f"{joint}.qdd" for joint in JOINTS]
        assert derivative(slave, accelerations, {"link6.mass": 1.0}) == pytest.approx(by(1.0, np.zeros(3)), rel=1e-8, abs=1e-9)
        assert derivative(slave, accelerations, {"link6.com[3]": 1.0}) == pytest.approx(by(0.0, np.array([0, 0, 1.0])), rel=1e-8, abs=1e-9)


def test_a_pendulum(fmu):
    """inertia qdd = tau - mass g l cos q - damping qd, by all of them."""
    with Slave(fmu("pendulum")) as slave:
        model = tomllib.loads((ROOT / "models" / "pendulum.toml").read_text())
        link = model["link"][0]
        mass, length = link["mass"], link["com"][0]
        inertia = mass * length**2 + [*link.get("inertia", []), 0, 0, 0][2]
        assert slave.setup() == OK and slave.call("EnterInitializationMode") == OK
        q, tau = 0.4, 2.0
        assert slave.set("pivot.q0", q) == OK and slave.set("pivot.tau", tau) == OK
        assert slave.get("pivot.qdd") == pytest.approx((tau - mass * 9.81 * length * math.cos(q)) / inertia, rel=1e-12)
        assert derivative(slave, ["pivot.qdd"], {"pivot.tau": 1.0}) == pytest.approx([1 / inertia], rel=1e-14)
        assert derivative(slave, ["pivot.qdd"], {"pivot.q0": 1.0}) == pytest.approx(
            [mass * 9.81 * length * math.sin(q) / inertia], rel=1e-13
        )
        assert derivative(slave, ["pivot.q", "pivot.qd"], {"pivot.q0": 2.0, "pivot.qd0": -3.0}) == [2.0, -3.0]


def test_computed_torque_obeys_its_error_equation(fmu):
    """qdd = qdd_ref + kd (qd_ref - qd) + kp (q_ref - q), whatever the robot is: so are its derivatives."""
    with Slave(fmu("kuka_kr5_computed_torque")) as slave:
        assert slave.setup(start=0.2) == OK and slave.call("EnterInitializationMode") == OK
        kp, kd = slave.get("joint1.kp"), slave.get("joint1.kd")
        for k, joint in enumerate(JOINTS):
            assert slave.set(f"{joint}.q0", Q[k]) == OK and slave.set(f"{joint}.qd0", QD[k]) == OK
        accelerations = [f"{joint}.qdd" for joint in JOINTS]
        unit = np.eye(6)
        for k, joint in enumerate(JOINTS):
            assert derivative(slave, accelerations, {f"{joint}.q0": 1.0}) == pytest.approx(-kp * unit[k], rel=1e-9, abs=1e-8)
            assert derivative(slave, accelerations, {f"{joint}.qd0": 1.0}) == pytest.approx(-kd * unit[k], rel=1e-9, abs=1e-8)
        error = slave.get("joint1.q_ref") - slave.get("joint1.q"), slave.get("joint1.qd_ref") - slave.get("joint1.qd")
        assert derivative(slave, accelerations, {"joint1.kp": 1.0}) == pytest.approx(error[0] * unit[0], rel=1e-9, abs=1e-9)
        assert derivative(slave, accelerations, {"joint1.kd": 1.0}) == pytest.approx(error[1] * unit[0], rel=1e-9, abs=1e-9)


def test_an_arm_beside_a_loop_is_a_pendulum(built):
    """inertia qdd = -mass g l cos q: it neither feels the four-bar nor does assembly move it."""
    arm = """[[link]]
name = "arm"
parent = "ground"
joint_name = "arm_j"
q = 0.5
qd = 0.2
mass = 1
com = [0.2, 0, 0]
inertia = [0.01, 0.01, 0.01]

[[loop]]"""
    with Slave(built((ROOT / "models" / "four_bar.toml").read_text().replace("[[loop]]", arm))) as slave:
        assert slave.setup() == OK and slave.call("EnterInitializationMode") == OK
        outputs = ["arm_j.q", "arm_j.qd", "arm_j.qdd", "crank_joint.q", "crank_joint.qdd"]
        by_q = 9.81 * 0.2 * math.sin(0.5) / 0.05
        assert derivative(slave, outputs, {"arm_j.q0": 1.0}) == pytest.approx([1, 0, by_q, 0, 0], rel=1e-13)
        assert derivative(slave, outputs, {"arm_j.qd0": 1.0}) == [0, 1, 0, 0, 0]
