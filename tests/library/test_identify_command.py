"""`build-fmu identify`: files in, files out, errors in one sentence."""

from __future__ import annotations

import json
import re
import shutil

import numpy as np
import pytest

import build_fmu as rds
from build_fmu import native
from build_fmu.cli import main
from build_fmu.errors import UserError

ARM = """
name = "arm"
gravity = [9.81, 0, 0]

[[link]]
name = "upper"  # a comment
mass = 2
com = [0.5, 0.1, 0]
inertia = [0.1, 0.1, 0.2]
lower = -2
upper = 2
stop_stiffness = 1e4

[[link]]
name = "wrist"
joint = "universal"
a = 1
mass = 1.5
com = [0.4, 0, 0.1]
inertia = [0.1, 0.1, 0.15]
damping = [0.2, 0.1]

[[actuator]]
joint = "upper"
gear_ratio = 50
rotor_inertia = 4e-5
"""
TRUTH = ARM.replace("mass = 1.5", "mass = 1.8").replace("[0.2, 0.1]", "[0.3, 0.1]").replace("4e-5", "6e-5")


@pytest.fixture(scope="module")
def files(tmp_path_factory):
    """A folder with the model file and a run of the arm with the true parameters."""
    try:
        native.library()
    except UserError as error:
        pytest.skip(str(error))
    folder = tmp_path_factory.mktemp("arm")
    (folder / "arm.toml").write_text(ARM)
    (folder / "truth.toml").write_text(TRUTH)
    t, w = np.arange(0, 10, 0.02)[:, None], np.array([0.7, 1.1, 1.7])
    q, qd = np.sin(w * t) + np.sin(2 * w * t), w * (np.cos(w * t) + 2 * np.cos(2 * w * t))
    qdd = -(w**2) * (np.sin(w * t) + 4 * np.sin(2 * w * t))
    with rds.load(folder / "truth.toml") as truth:
        tau = truth.inverse(q, qd, qdd) + 1e-3 * np.random.default_rng(1).normal(size=q.shape)
    joints = ["upper", "wrist[1]", "wrist[2]"]
    head = ["t", *(f"{joint}.{letter}" for letter in ("q", "qd", "qdd", "tau") for joint in joints)]
    np.savetxt(folder / "run.csv", np.column_stack([t, q, qd, qdd, tau]), delimiter=",", header=",".join(head), comments="")
    return folder


@pytest.fixture
def arm(files, tmp_path, monkeypatch):
    """A folder of the test with these files."""
    for name in ("arm.toml", "run.csv"):
        shutil.copy(files / name, tmp_path)
    monkeypatch.chdir(tmp_path)
    return tmp_path


def run(capsys, *arguments):
    code = main(["identify", *map(str, arguments)])
    return code, *capsys.readouterr()


def test_a_run_gives_a_file_that_reproduces_it(arm, capsys):
    code, out, errors = run(capsys, "arm.toml", "run.csv", "--json")
    facts = json.loads(out)
    assert (code, errors, facts["model"]) == (0, "", "arm_identified.toml")
    assert all(facts["residual"][name] == pytest.approx(1e-3, rel=0.1) for name in facts["noise"])
    assert facts["residual_before"]["upper.tau"] > 0.1
    text = (arm / "arm_identified.toml").read_text()
    assert text.startswith("# Parameters identified by build-fmu identify from run.csv\n") and 'name = "upper"  # a comment' in text
    with rds.load(arm / "arm_identified.toml") as model:
        values = model.plant().values
    assert values["wrist[1].damping"] == pytest.approx(0.3, abs=1e-3) and values["wrist[2].damping"] == pytest.approx(0.1, abs=1e-3)
    code, out, _ = run(capsys, "arm.toml", "run.csv")
    assert code == 1
    code, out, _ = run(capsys, "arm.toml", "run.csv", "--force")
    assert code == 0 and all(text in out for text in ("wrist[2].damping", "wrist[2].tau [N.m]", "base parameters, condition number"))


def test_chosen_parameters_alone_change(arm, capsys):
    assert run(capsys, "arm.toml", "run.csv", "--parameters", "wrist", "*.damping", "-o", "some.toml", "-q")[:2] == (0, "")
    text = (arm / "some.toml").read_text()
    assert "com = [0.5, 0.1, 0]" in text and "rotor_inertia = 4e-5" in text
    # armature of the rotor, by its gear
    assert run(capsys, "arm.toml", "run.csv", "--parameters", "wrist", "upper.armature", "*.damping", "-o", "rotor.toml", "-q")[0] == 0
    line = next(line for line in (arm / "rotor.toml").read_text().splitlines() if line.startswith("rotor_inertia"))
    assert float(line.partition("=")[2]) == pytest.approx(6e-5, rel=0.02)


def measured_with(arm, load: str) -> None:
    """Writes loaded.csv: the motion, and the torques of the model with a load, with noise."""
    (arm / "loaded.toml").write_text(ARM.replace("[[actuator]]", load + "[[actuator]]"))
    motion = np.genfromtxt(arm / "run.csv", delimiter=",", skip_header=1)[::5]
    with rds.load(arm / "loaded.toml") as loaded:
        tau = loaded.inverse(motion[:, 1:4], motion[:, 4:7], motion[:, 7:10])
    motion[:, 10:] = tau + 1e-3 * np.random.default_rng(2).normal(size=tau.shape)
    head = (arm / "run.csv").read_text().partition("\n")[0]
    np.savetxt(arm / "loaded.csv", motion, delimiter=",", header=head, comments="")


def test_payload_is_the_body_that_was_added(arm, capsys):
    measured_with(arm, '[[link]]\nname = "load"\njoint = "fixed"\nmass = 0.7\ncom = [0.2, 0.05, -0.1]\ninertia = [0.01, 0.02, 0.015]\n')
    code, out, _ = run(capsys, "arm.toml", "loaded.csv", "--payload", "wrist", "--json")
    found = json.loads(out)["payload"]
    expected = [0.7, 0.2, 0.05, -0.1, 0.01, 0.02, 0.015, 0, 0, 0]
    assert code == 0 and len(found) == 10
    for (value, error), true in zip(found.values(), expected, strict=True):
        assert abs(value - true) <= 4 * error and error < 0.02


def test_a_mass_within_its_error_is_no_payload(arm, capsys):
    measured_with(arm, "")
    code, _, errors = run(capsys, "arm.toml", "loaded.csv", "--payload", "wrist")
    assert code == 1 and re.fullmatch(r"link 'wrist' has no payload: its mass would be \S+ \+- \S+ kg\n", errors)
    assert not (arm / "arm_identified.toml").exists()


def test_a_designed_motion_is_a_table_of_the_model(arm, capsys):
    options = ["--design", "--range", "wrist[*]=-1:1", "--speed", "*=1.5", "--parameters", "wrist", "--duration", "5"]
    code, out, errors = run(capsys, "arm.toml", *options)
    assert (code, errors) == (0, "") and "arm_motion.csv  1001 rows, 5 s, condition number" in out
    table = np.genfromtxt(arm / "arm_motion.csv", delimiter=",", names=True)
    assert table["time"][-1] == pytest.approx(5) and abs(table["upperq"]).max() <= 2 and abs(table["wrist2qd"]).max() <= 1.5
    assert run(capsys, "arm.toml", "arm_motion.csv", "--parameters", "wrist")[0] == 0


@pytest.mark.parametrize(
    ("arguments", "sentence"),
    [
        (["--design"], "joint 'wrist[1]' has no stops on both sides: give its range, for example --range 'wrist[1]=-1:1' or '*=-1:1'"),
        (["--design", "--range", "x=-1:1"], "unknown joint 'x'; available: upper, wrist[1], wrist[2]"),
        (["run.csv", "--payload", "wris"], "unknown link 'wris'; did you mean 'wrist'?"),
        (["run.csv", "wrong.csv"], "'wrong.csv' repeats column 'upper.q' of another file"),
        (["wrong.csv"], "'wrong.csv' has no column 'upper.tau'; did you mean 'upper.tua'?"),
    ],
)
def test_wrong_use_is_one_sentence(arm, capsys, arguments, sentence):
    text = (arm / "run.csv").read_text()
    (arm / "wrong.csv").write_text(text.replace("upper.tau", "upper.tua"))
    assert run(capsys, "arm.toml", *arguments) == (1, "", sentence + "\n")
    assert not list(arm.glob("arm_*"))


def test_standard_output_takes_both_files(arm, capfd):
    assert run(capfd, "arm.toml", "run.csv", "-o", "-", "-q")[1].startswith("# Parameters identified by build-fmu identify from run.csv\n")
    out = run(capfd, "arm.toml", "--design", "--range", "*=-1:1", "--parameters", "wrist[1].damping", "-o", "-", "-q")[1]
    assert out.startswith("time,upper.q,wrist[1].q,") and not list(arm.glob("arm_*"))


def test_torques_in_a_file_of_their_own(arm, capsys):
    table = np.genfromtxt(arm / "run.csv", delimiter=",", skip_header=1)
    head = (arm / "run.csv").read_text().partition("\n")[0].split(",")
    for name, part in (("motion.csv", slice(0, 10)), ("torque.csv", [0, 10, 11, 12])):
        names = head[part] if isinstance(part, slice) else [head[k] for k in part]
        np.savetxt(arm / name, table[:, part], delimiter=",", header=",".join(names), comments="")
    assert run(capsys, "arm.toml", "motion.csv", "torque.csv", "--parameters", "wrist", "-q")[0] == 0
    np.savetxt(arm / "late.csv", table[1:, [0, 10, 11, 12]], delimiter=",", header=",".join(head[k] for k in [0, 10, 11, 12]), comments="")
    assert run(capsys, "arm.toml", "motion.csv", "late.csv", "--force")[2] == "the times of 'late.csv' differ from those of 'motion.csv'\n"
