"""`import --hold`: gains of the controller by closed forms, and robots that stay in their start pose."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np
import pytest

from build_fmu.cli import main
from build_fmu.errors import UserError
from build_fmu.importers.read import read
from build_fmu.run.driver import Task, drive, staged
from tests.packager.import_options import import_options
from tests.packager.test_import_urdf_actuators import ROBOT

DOG = Path(__file__).parents[2] / "examples" / "dog.urdf"


def test_gains_follow_from_inertia_and_weight(tmp_path):
    (tmp_path / "drives.urdf").write_text(ROBOT.replace("@", ""))
    held = read(tmp_path / "drives.urdf", import_options(hold=True)).controller
    shoulder, rail = 2 * 9.81 * 0.1 / 0.02, 0.5 * 9.81 / 0.005  # the weights decide
    assert held["joints"] == ["shoulder", "rail"]
    assert held["kp"] == pytest.approx([shoulder, rail], rel=0.02)
    assert held["kd"] == pytest.approx([1.4 * math.sqrt(shoulder * 0.04), 1.4 * math.sqrt(rail * 0.5)], rel=0.02)
    # without weight the frequency decides
    (tmp_path / "drives.urdf").write_text(ROBOT.replace("@", "").replace('xyz="0 0 -0.1"', 'xyz="0 0 0"'))
    held = read(tmp_path / "drives.urdf", import_options(hold=True)).controller
    assert held["kp"][0] == pytest.approx(0.02 * (6 * math.pi) ** 2, rel=0.02)


@pytest.mark.parametrize("gravity", [40.0, 1.62, 0.0])
def test_the_gravity_of_the_file_decides_the_sag(tmp_path, gravity):
    body = '<inertial pos="0.25 0 0" mass="2" diaginertia="0.01 0.01 0.01"/><joint name="j" axis="0 1 0"/>'
    (tmp_path / "arm.xml").write_text(
        f'<mujoco><option gravity="0 0 -{gravity}"/><worldbody><body name="b">{body}</body></worldbody></mujoco>'
    )
    kp = read(tmp_path / "arm.xml", import_options(hold=True)).controller["kp"]
    assert kp == pytest.approx([max(2 * gravity * 0.25 / 0.02, (0.01 + 2 * 0.25**2) * (6 * math.pi) ** 2)], rel=0.03)


def run(model: Path, seconds: float, outputs: list[str]) -> np.ndarray:
    with staged(model) as fmu:
        done = drive(fmu, Task(0.01, round(100 * seconds), outputs=outputs))
    assert done.status == "ok", done.message
    return done.values


def test_a_dog_stands(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    assert main(["import", str(DOG), "--floating", "--contact", "ground", "--hold", "--pose", "*_hip=0.7", "--pose", "*_knee=-1.4"]) == 0
    with staged(tmp_path / "dog.toml") as fmu:
        joints = [name for name in fmu.names("output") if name.endswith(("_hip.q", "_knee.q"))]
    values = run(tmp_path / "dog.toml", 2, [*joints, "trunk[3].q"])
    assert len(joints) == 8
    assert np.ptp(values[:, :-1], axis=0).max() < 0.05
    assert np.ptp(values[:, -1]) < 0.01


def test_an_ankle_balances_the_robot_above_it(tmp_path):
    """A tall body of 10 kg on one flat foot, 1 m above the ankle: the ankle needs more than m g h."""
    body = '<inertial><mass value="{}"/><inertia ixx="0.1" iyy="0.1" izz="0.1"/></inertial>'
    shape = '<collision><origin xyz="0 0 -0.05"/><geometry><box size="0.3 0.3 0.02"/></geometry></collision>'
    joint = (
        '<joint name="ankle" type="continuous"><parent link="body"/><child link="foot"/><origin xyz="0 0 -1"/><axis xyz="0 1 0"/></joint>'
    )
    text = f'<robot name="tall"><link name="body">{body.format(10)}</link><link name="foot">{body.format(0.1)}{shape}</link>{joint}</robot>'
    (tmp_path / "tall.urdf").write_text(text)
    held = read(tmp_path / "tall.urdf", import_options(hold=True, floating=True, contact="ground")).controller
    above = 10 / 10.1  # m, height of the center of mass above the ankle
    assert held["kp"] == pytest.approx([10.1 * 9.81 * above / 0.02], rel=0.03)


def test_an_arm_stays_where_it_is(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "drives.urdf").write_text(ROBOT.replace("@", ""))
    assert main(["import", "drives.urdf", "--hold", "--pose", "shoulder=1.2", "--pose", "rail=0.5"]) == 0
    values = run(tmp_path / "drives.toml", 2, ["shoulder.q", "rail.q"])
    assert values[-1] == pytest.approx([1.2, 0.5], abs=0.021)


def test_a_robot_without_drives_cannot_be_held(tmp_path):
    text = ROBOT.replace("@", "").replace('type="revolute"', 'type="fixed"').replace('type="prismatic"', 'type="fixed"')
    (tmp_path / "drives.urdf").write_text(text)
    with pytest.raises(UserError, match="--hold: no joint with a drive moves a mass"):
        read(tmp_path / "drives.urdf", import_options(hold=True, floating=True))


def test_tables_of_dh_parameters_have_no_hold(tmp_path):
    (tmp_path / "arm.csv").write_text("a,alpha,d,theta\n0,0,0,0\n")
    with pytest.raises(UserError, match=r"--hold has no effect on 'arm.csv'"):
        read(tmp_path / "arm.csv", import_options(hold=True))


def test_gains_that_overflow_are_refused(tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    heavy = ROBOT.replace("@", "").replace('<inertia ixx="0.02" iyy="0.02" izz="0.02"/>', '<inertia ixx="1e307" iyy="1e307" izz="1e307"/>')
    (tmp_path / "drives.urdf").write_text(heavy)
    assert main(["import", "drives.urdf", "--hold"]) == 1
    assert "must be finite, got inf" in capsys.readouterr().err
