"""Inverse FMUs: prescribed motion in, torques out, against published references."""

from __future__ import annotations

from math import cos, pi, sin
from pathlib import Path

import numpy as np
import pytest

from tests.fmi.raw import OK, Slave

SCENES = Path(__file__).resolve().parents[1] / "scenes"
OPEN = {
    "gripper_inverse": ("gripper_inverse", 1e-14),
    "gripper_redysim_inverse": ("gripper_redysim_inverse", 1e-14),
    "kuka_kr5_inverse": ("kr5_inverse", 1e-12),
}

# ReDySim's own result, seven digits: the KUKA KR5, every joint from 0 to 60 degrees on a cycloid in 1 s.
REDYSIM_KR5 = {
    0: (0, 128.7117, 14.53612, 0, 0, 0),
    0.25: (106.0031, 209.5310, 35.72768, -8.613520e-4, -0.1753215, 1.012746e-5),
    0.5: (-39.53028, 150.3598, 21.46336, 0.1967606, -0.3236363, 6.465742e-6),
    0.75: (-74.10312, 2.827468, -8.699738, -0.2915365, -0.06236583, -3.761628e-5),
    1: (0, 66.78584, 9.698057, 0.1305619, 0.05428358, 0),
}

# An independent program: ReDySim's gripper from (0, 0, 0, 90) to (60, 80, 80, 120) degrees in 1 s, eight decimals.
GRIPPER = {
    0: (0.8829, 0.1962, 0.04905, 0),
    0.25: (0.97437109, 0.22672515, 0.05743535, -0.00513509),
    0.5: (0.54092872, 0.03430231, -0.0107784, -0.03362433),
    0.75: (0.14881974, -0.1528396, -0.04680174, -0.0491989),
    1: (0.14400208, -0.15029792, -0.03757448, -0.04905),
}


def columns(table: np.ndarray, letter: str) -> np.ndarray:
    names = [name for name in table.dtype.names if name.rstrip("0123456789") == letter]
    return np.stack([table[name] for name in names], axis=1)


def read(scene: str) -> np.ndarray:
    return np.genfromtxt(SCENES / f"{scene}.csv", delimiter=",", names=True)


def cycloid(start: np.ndarray, end: np.ndarray, duration: float, time: float) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Eq. (1) of the ReDySim paper: position, velocity and acceleration."""
    rate, w = (end - start) / duration, 2 * pi / duration
    return start + rate * (time - sin(w * time) / w), rate * (1 - cos(w * time)), rate * w * sin(w * time)


def torques(slave: Slave, times, motions) -> np.ndarray:
    """Steps from time to time; at each the motion is set and the torques are read."""
    inputs = [[name for name in slave.fmu.named("input") if name.endswith(ending)] for ending in (".q", ".qd", ".qdd")]
    outputs = slave.fmu.named("output", ".tau")
    rows = []
    for k, motion in enumerate(motions):
        if k > 0:
            assert slave.step(times[k - 1], times[k] - times[k - 1]) == OK, slave.errors
        for names, values in zip(inputs, motion, strict=True):
            assert slave.set_reals(names, values) == OK, slave.errors
        rows.append(slave.reals(outputs))
    return np.array(rows)


@pytest.mark.parametrize("name", OPEN)
def test_torques_of_the_published_motions(fmu, name):
    scene, tolerance = OPEN[name]
    table = read(scene)
    motions = zip(columns(table, "q"), columns(table, "qd"), columns(table, "qdd"), strict=True)
    with Slave(fmu(name)) as slave:
        slave.initialize()
        error = np.abs(torques(slave, table["t"], motions) - columns(table, "tau"))
    assert error.max() < tolerance


def test_redysims_own_torques_to_all_printed_digits(fmu):
    goal = np.full(6, pi / 3)
    with Slave(fmu("kuka_kr5_inverse")) as slave:
        slave.initialize()
        found = torques(slave, list(REDYSIM_KR5), [cycloid(0 * goal, goal, 1, t) for t in REDYSIM_KR5])
    for row, printed in zip(found, REDYSIM_KR5.values(), strict=True):
        for value, seven_digits in zip(row, printed, strict=True):
            # half a unit of the seventh digit; what is printed as 0 is rounding
            assert value == pytest.approx(
                seven_digits, rel=0, abs=0.5000001 * 10.0 ** (np.floor(np.log10(abs(seven_digits))) - 6) if seven_digits else 1e-11
            )


def test_the_grippers_torques_of_an_independent_program(fmu):
    start, goal = np.radians([0, 0, 0, 90]), np.radians([60, 80, 80, 120])
    with Slave(fmu("gripper_redysim_inverse")) as slave:
        slave.initialize()
        found = torques(slave, list(GRIPPER), [cycloid(start, goal, 1, t) for t in GRIPPER])
    assert np.abs(found - np.array(list(GRIPPER.values()))).max() < 6e-9


def test_torque_and_multipliers_of_the_four_bar(fmu):
    table = read("fourbar_inverse")
    outputs = [
        "crank_joint.tau",
        "closure.lambda[1]",
        "closure.lambda[2]",
        "joint2.q",
        "joint3.q",
        "joint2.qd",
        "joint3.qd",
        "joint2.qdd",
        "joint3.qdd",
    ]
    with Slave(fmu("four_bar_inverse")) as slave:
        assert slave.setup() == OK
        assert slave.call("EnterInitializationMode") == OK
        rows = []
        for k, row in enumerate(table):
            motion = [row["q1"], row["qd1"], row["qdd1"]]
            assert slave.set_reals(["crank_joint.q", "crank_joint.qd", "crank_joint.qdd"], motion) == OK
            if k == 0:
                assert slave.call("ExitInitializationMode") == OK, slave.errors
            rows.append(slave.reals(outputs))
            if k + 1 < len(table):
                assert slave.step(row["t"], table["t"][k + 1] - row["t"]) == OK, slave.errors
        found = np.array(rows)
    for name, column, tolerance in (
        ("torque", 0, 1e-13),
        ("lambda_x", 1, 1e-8),
        ("lambda_y", 2, 1e-8),
        ("q2", 3, 1e-12),
        ("q3", 4, 1e-12),
        ("qd2", 5, 1e-10),
        ("qd3", 6, 1e-10),
        ("qdd2", 7, 1e-8),
        ("qdd3", 8, 1e-8),
    ):
        assert np.abs(found[:, column] - table[name]).max() < tolerance, name


def test_an_open_inverse_model_integrates_nothing(fmu):
    with Slave(fmu("gripper_inverse"), logging=True) as slave:
        assert not {"energy.work", "energy.balance"} & set(slave.fmu.variables)
        slave.initialize()
        assert any("solver none: all joints are prescribed" in text for _, _, text in slave.messages)
        slave.run(0.1, 0.01)
        assert slave.get("solver.steps") == slave.get("solver.rhs_evaluations") == 0


def test_the_inverse_of_the_plants_accelerations_is_its_torque(fmu):
    """Forward and inverse FMU of one model, side by side."""
    rng = np.random.default_rng(1)
    with Slave(fmu("kuka_kr5")) as plant, Slave(fmu("kuka_kr5_inverse")) as inverse:
        plant.initialize()
        inverse.initialize()
        for k in range(20):
            tau = rng.uniform(-20, 20, 6) * [5, 5, 2, 0.1, 0.1, 1e-4]
            assert plant.set_reals(plant.fmu.named("input"), tau) == OK
            for ending in ("q", "qd", "qdd"):
                assert (
                    inverse.set_reals(inverse.fmu.named("input", f".{ending}"), plant.reals(plant.fmu.named("output", f".{ending}"))) == OK
                )
            assert inverse.reals(inverse.fmu.named("output", ".tau")) == pytest.approx(tau, abs=1e-9)
            for slave in (plant, inverse):
                assert slave.step(k * 0.01, 0.01) == OK


@pytest.mark.parametrize(
    ("name", "sentence"),
    [
        ("four_bar_inverse", "1 motion for 1 degree of freedom: fully driven"),
    ],
)
def test_the_log_says_what_the_motions_leave_free(fmu, name, sentence):
    with Slave(fmu(name), logging=True) as slave:
        slave.initialize()
        assert ("logEvents", sentence) in [(category, text) for _, category, text in slave.messages]
