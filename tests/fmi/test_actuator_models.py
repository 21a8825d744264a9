"""The models with elastic, limited drives against a dense formulation of the mechanism and the law of docs/actuators.md."""

from __future__ import annotations

import math
import tomllib

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from tests.crosscheck.dense_motion import Dense
from tests.fmi.conftest import ROOT
from tests.fmi.raw import OK


def onset(x: float, width: float) -> float:
    u = x / width
    return width * (u**3 - u**4 / 2 if 0 < u < 1 else max(u - 0.5, 0))


class Reference:
    """Joints by dense matrices, motors by their own equations, references by quintic polynomials."""

    def __init__(self, name: str) -> None:
        file = tomllib.loads((ROOT / "models" / f"{name}.toml").read_text())
        self.controller, self.moves, self.drives = (file.pop(key) for key in ("controller", "trajectory", "actuator"))
        self.dense = Dense(file)
        self.joints = [dof.joint for dof in self.dense.scene.dofs]
        start = self.dense.scene.start()
        self.start = {joint: start[f"{joint}.q"] for joint in self.joints}

    def wanted(self, move: dict, time: float) -> tuple[float, float]:
        span, begin = move["duration"], self.start[move["joint"]]
        way = math.radians(move["to"]) - begin
        s = min(max((time - move.get("start", 0)) / span, 0), 1)
        return begin + way * (10 * s**3 - 15 * s**4 + 6 * s**5), way * 30 * (s * (1 - s)) ** 2 / span

    def solve(self, q, qd, torque):
        state = {f"{joint}.{what}": x for what, values in (("q", q), ("qd", qd)) for joint, x in zip(self.joints, values, strict=True)}
        return self.dense.solve(state, {f"{joint}.tau": x for joint, x in torque.items()})

    def weight(self, q: np.ndarray) -> np.ndarray:
        falling = self.solve(q, 0 * q, {}).qdd
        return -(self.dense.M @ falling).astype(float)

    def slope(self, time: float, y: np.ndarray) -> np.ndarray:
        """y: q, qd of the joints, then angle and speed of the motors, divided by their gears."""
        n = len(self.joints)
        q, qd, (angle, speed) = y[:n], y[n : 2 * n], y[2 * n :].reshape(2, -1)
        weight = np.zeros(n)
        if self.controller["law"] == "gravity_compensation":
            weight = self.weight(q)
        torque, motor = {}, []
        gains = zip(*np.broadcast_arrays(self.controller["kp"], self.controller["kd"], np.zeros(len(self.drives)))[:2], strict=True)
        for k, (drive, move, (kp, kd)) in enumerate(zip(self.drives, self.moves, gains, strict=True)):
            i, limit, top = self.joints.index(drive["joint"]), drive["torque_limit"], drive["speed_limit"]
            position, rate = self.wanted(move, time)
            asked = kp * (position - q[i]) + kd * (rate - qd[i]) + weight[i]
            pull = asked - onset(asked - 0.975 * limit, 0.05 * limit) + onset(-asked - 0.975 * limit, 0.05 * limit)
            u = min(max((abs(speed[k]) - 0.95 * top) / (0.05 * top), 0), 1)
            pull *= 1 - (10 * u**3 - 15 * u**4 + 6 * u**5) * (pull * speed[k] > 0)
            gear = drive["stiffness"] * (angle[k] - q[i]) + drive["damping"] * (speed[k] - qd[i])
            torque[drive["joint"]] = gear
            motor.append((pull - gear) / (drive["gear_ratio"] ** 2 * drive["rotor_inertia"]))
        return np.concatenate([qd, self.solve(q, qd, torque).qdd, speed, motor])


@pytest.mark.parametrize(
    ("name", "begin", "end"),
    [
        ("series_elastic_leg", 0.0, 0.015),
        ("series_elastic_leg", 0.54, 0.56),
        ("kuka_kr5_harmonic", 0.0, 0.01),
        ("kuka_kr5_harmonic", 0.24, 0.25),
    ],
    ids=["landing", "hop", "start", "limited"],
)
def test_follows_the_dense_formulation(fmu, instance, name, begin, end):
    reference = Reference(name)
    one = instance(fmu(name)).initialize(start={"solver.rtol": 1e-11, "solver.atol": 1e-13})
    gears = np.array([drive["gear_ratio"] for drive in reference.drives])
    driven = [drive["joint"] for drive in reference.drives]

    def state() -> np.ndarray:
        moving = one.reals([f"{joint}.{what}" for what in ("q", "qd") for joint in reference.joints])
        return np.concatenate(
            [moving, *(np.array(one.reals([f"{joint}.{what}" for joint in driven])) / gears for what in ("motor_q", "motor_qd"))]
        )

    step = 0.005
    for k in range(round(begin / step)):
        assert one.step(k * step, step) == OK, one.errors
    before = state()
    for k in range(round(begin / step), round(end / step)):
        assert one.step(k * step, step) == OK, one.errors
    expected = solve_ivp(reference.slope, (begin, end), before, method="LSODA", rtol=1e-9, atol=1e-11).y[:, -1]
    assert state() == pytest.approx(expected, rel=1e-7, abs=1e-8)
    assert np.abs(state() - before).max() > 1e-4


def test_the_leg_hops_and_stands(fmu, instance):
    one = instance(fmu("series_elastic_leg")).initialize(start={"solver.rtol": 1e-8})
    heights, forces, most = [], [], 0.0
    for k in range(300):
        assert one.step(k * 0.005, 0.005) == OK, one.errors
        heights.append(one.get("foot.depth"))
        forces.append(one.get("foot.force[3]"))
        most = max(most, one.get("knee.saturated"))
    # in the air after the hop; then the weight rests on the foot
    assert min(heights[100:]) < -0.04 and most > 0.5
    assert forces[-1] == pytest.approx(6.4 * 9.81, rel=2e-2)
    assert abs(one.get("energy.balance")) < 1e-5


def test_the_arm_reaches_its_pose_within_its_limits(fmu, instance):
    """At rest the gears are twisted by the weight."""
    one = instance(fmu("kuka_kr5_harmonic")).initialize()
    reference, saturated = Reference("kuka_kr5_harmonic"), 0.0
    for k in range(150):
        assert one.step(k * 0.01, 0.01) == OK, one.errors
        saturated = max(saturated, one.get("joint1.saturated"))
    assert saturated > 0.05
    q = np.array(one.reals([f"{joint}.q" for joint in reference.joints]))
    assert q == pytest.approx(np.radians([move["to"] for move in reference.moves]), abs=2e-3)
    weight = reference.weight(q)
    twist = np.array(one.reals([f"{joint}.motor_q" for joint in reference.joints])) / 100 - q
    assert twist * [drive["stiffness"] for drive in reference.drives] == pytest.approx(weight, abs=0.05 * np.abs(weight).max())
