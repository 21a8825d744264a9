"""Models without masses: one sentence, an animation of the kinematics, an inverse FMU."""

import pytest

from tests.command_line import command

pytestmark = pytest.mark.usefixtures("built_library")
TABLE = "type,alpha [deg],a,theta [deg],d\nR,0,0,q1,0.4\nR,0,0.3,q2,0\nP,180,0.25,0,q3\n"


@pytest.fixture
def arm(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "arm.csv").write_text(TABLE)
    command("import", "arm.csv", "--dh", "modified")
    return tmp_path / "arm.toml"


def test_one_sentence_for_all_joints(arm):
    done = command("check", "arm.toml")
    assert done.returncode == 1 and len(done.stderr.splitlines()) == 1
    assert "link 'link1': no link has mass or inertia; give the links masses, or the joints drive 'motion'" in done.stderr


def test_show_draws_the_kinematics(arm, tmp_path):
    done = command("show", "arm.toml", "--input", "link1.q=2*t")
    assert done.returncode == 0, done.stderr
    assert "the page shows its kinematics" in done.stderr and "no link has mass" in done.stderr
    assert "link1.q" in (tmp_path / "arm.html").read_text()
    assert command("build", "--inverse", "arm.toml").returncode == 0


def test_other_errors_stay(arm):
    arm.write_text("wheel = 3\n" + arm.read_text())
    done = command("show", "arm.toml")
    assert done.returncode == 1 and "arm.toml:1:1: unknown field 'wheel'" in done.stderr
    assert "kinematics" not in done.stderr
