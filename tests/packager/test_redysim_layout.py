"""`simulate --redysim-layout`: files in ReDySim's columns, held against other outputs of the same run and against laws."""

import csv
from math import cos, pi, sin

import numpy as np
import pytest

from build_fmu.run.redysim_layout import energy_errors
from build_fmu.run.simulate import Result
from tests.packager.test_real_fmu import ROOT, pytestmark, run  # noqa: F401  skips where nothing is built

MODELS = ROOT / "models"


def written(folder, *arguments):
    done = run("simulate", *arguments, "--redysim-layout", "run", "--csv", "run.csv", cwd=folder)
    assert done.returncode == 0, done.stderr
    rows = list(csv.reader((folder / "run.csv").open()))
    table = dict(zip(rows[0], np.array(rows[1:], float).T, strict=True))
    return {path.name: np.loadtxt(path, ndmin=2) for path in (folder / "run").iterdir()}, table


def near(found, expected):
    return np.allclose(found, expected, rtol=1e-6, atol=1e-12)


def test_forward_dynamics_of_a_tree(tmp_path):
    files, table = written(
        tmp_path, MODELS / "gripper_redysim.toml", "--stop", 0.5, "--step", 0.05, "--input", "joint3.tau=0.01*t", "--interpolate", "none"
    )
    assert sorted(files) == ["envar.dat", "statevar.dat", "timevar.dat", "tor.dat"]
    assert near(files["timevar.dat"][:, 0], np.arange(11) * 0.05)
    assert near(files["statevar.dat"][:, :8].T, [table[f"joint{i}.{key}"] for key in ("q", "qd") for i in range(1, 5)])
    assert near(files["tor.dat"], np.outer(0.01 * table["time"], [0, 0, 1, 0]))
    # the actuator's energy by its own integral (trapezoidal over held torques)
    moved = np.diff(table["joint3.q"])
    assert near(files["statevar.dat"][1:, 8], -np.cumsum(0.01 * table["time"][:-1] * moved))
    potential, kinetic, actuator, total = files["envar.dat"].T
    assert near(actuator, files["statevar.dat"][:, 8]) and np.ptp(total) < 1e-6 * np.ptp(kinetic)
    assert near(potential, table["energy.potential"])


def test_rows_are_seven_digits_in_plain_columns(tmp_path):
    written(tmp_path, MODELS / "pendulum.toml", "--stop", 0.1, "--step", 0.1)
    line = (tmp_path / "run" / "statevar.dat").read_text().splitlines()[0]
    assert [len(word.lstrip("-")) for word in line.split()] == [12, 12, 12]


def test_layout_does_not_depend_on_recorded_outputs(tmp_path):
    files, table = written(tmp_path, MODELS / "planar_2r.toml", "--stop", 0.2, "--step", 0.1, "--output", "joint2.qdd")
    assert list(table) == ["time", "joint2.qdd"] and files["statevar.dat"].shape == (3, 5)


def test_inverse_dynamics_of_a_closed_loop(tmp_path):
    assert run("build", "--inverse", MODELS / "four_bar.toml", cwd=tmp_path).returncode == 0
    files, table = written(
        tmp_path, "four_bar_inverse.fmu", "--stop", 4 / 3, "--step", 0.01, "--input", "crank_joint.q=1.5*pi*t", "crank_joint.qd=1.5*pi"
    )
    assert np.ptp(files["envar.dat"][:, 3]) < 1e-6
    q1, q2, q3, qd1 = files["statevar.dat"].T[:4]
    assert near(q1, 1.5 * pi * files["timevar.dat"][:, 0]) and near(qd1, np.full(len(q1), 1.5 * pi))
    # the loop closes: crank tip = coupler tip
    assert np.allclose(0.05 * np.cos(q1), 0.15 + 0.13 * np.cos(q2) + 0.1 * np.cos(q2 + q3), atol=1e-6)
    # figures of an independent program: one torque, two multipliers in ReDySim's sign, and the torque's range
    assert np.allclose(files["tor.dat"][0], [2.65597881, 3.92666554, 45.76207624], rtol=1e-6)
    assert files["tor.dat"][:, 0].min() == pytest.approx(-2.588, abs=1e-3) and files["tor.dat"][:, 0].max() == pytest.approx(
        2.999, abs=1e-3
    )
    assert files["statevar.dat"].shape[1] == 9 and near(files["statevar.dat"][:, 7], table["joint2.qdd"])


def test_floating_base(tmp_path):
    arguments = (
        "--stop",
        2,
        "--step",
        0.1,
        "--start",
        "base.omega0[1]=0.3",
        "base.omega0[2]=-0.2",
        "base.omega0[3]=0.1",
        "base[1].qd0=0.05",
    )
    files, _ = written(tmp_path, MODELS / "space_robot.toml", *arguments)
    assert files["statevar.dat"].shape[1] == 19 and files["base.dat"].shape[1] == 13
    assert near(files["base.dat"][:, 1:7], files["statevar.dat"][:, :6])
    # rates of the angles are the derivative of the angles
    angles, rates, h = files["base.dat"][:, 4:7], files["base.dat"][:, 10:13], 0.1
    middle = (angles[:-4] - 8 * angles[1:-3] + 8 * angles[3:-1] - angles[4:]) / (12 * h)
    assert np.abs(middle - rates[2:-2]).max() < 1e-5
    # angular velocity at the start in base axes, by ReDySim's matrix
    phi, theta, psi = angles[0]
    matrix = [[-sin(psi) * cos(theta), cos(psi), 0], [sin(theta), 0, 1], [cos(psi) * cos(theta), sin(psi), 0]]
    assert np.allclose(np.array(matrix) @ rates[0], [0.3, -0.2, 0.1])
    assert np.ptp(files["mtvar.dat"], axis=0).max() < 1e-5
    assert np.ptp(files["envar.dat"][:, 3]) < 1e-5


def test_planar_floating_base(tmp_path):
    files, table = written(tmp_path, MODELS / "space_five_bar.toml", "--stop", 1, "--step", 0.1, "--input", "joint1.tau=1")
    state = files["statevar.dat"]
    assert state.shape[1] == 21 and not state[:, [2, 4, 5]].any()
    assert near(state[:, [0, 1, 3]].T, [table[f"base[{i}].q"] for i in (1, 2, 3)]) and near(state[:, 6], table["joint1.q"])
    assert np.ptp(files["envar.dat"][:, 3]) < 1e-6


def test_a_walking_robot_has_a_ground(tmp_path):
    """The start of the quadruped's first step."""
    done = run("simulate", MODELS / "redysim_quadruped.toml", "--stop", 0.1, "--redysim-layout", "run", "--csv", "run.csv", cwd=tmp_path)
    assert done.returncode == 0, done.stderr
    files = {path.name: np.loadtxt(path, ndmin=2) for path in (tmp_path / "run").iterdir()}
    potential, kinetic, actuator, total, ground = files["envar.dat"].T
    assert near(total, potential + kinetic + actuator + ground) and np.ptp(total) < 1e-4
    state = files["statevar.dat"]
    # base 6, joints 12, their rates, ground and actuator energy
    assert state.shape[1] == 38 and near(state[:, 36], ground) and near(state[:, 37], actuator)
    assert ground[0] == actuator[0] == 0 and np.abs(ground).max() > 0.1
    assert "energy error: accumulated" in done.stdout


def test_errors_of_the_total_energy_are_those_of_redysim():
    """Total 10, 10.1, 9.8 J: deviations 0, 0.1 and -0.2 J."""
    names = ["energy.potential", "energy.kinetic", "energy.work", "energy.contact"]
    values = np.array([[7, 3, 0, 0], [6, 4, -0.1, -0.3], [5, 5, 0.2, -0.1]], float)
    result = Result(np.arange(3.0), names, values)
    assert energy_errors(result) == "energy error: accumulated -1 %, maximum 2 % of the initial total energy"
    assert energy_errors(result.only(names[:3])) == ""
    # an initial total energy of -10 J
    result = Result(np.arange(3.0), names, values - [20, 0, 0, 0])
    assert energy_errors(result) == "energy error: accumulated -1 %, maximum 2 % of the initial total energy"


def test_a_spherical_joint_has_no_layout(tmp_path):
    done = run("simulate", MODELS / "top.toml", "--redysim-layout", "run", cwd=tmp_path)
    assert (done.returncode, done.stdout) == (1, "") and "ReDySim does not support the spherical joint" in done.stderr
    assert not (tmp_path / "run").exists()
