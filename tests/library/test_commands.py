"""`build-fmu linearise`, `modes` and `equilibrium`."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest

from build_fmu import native
from build_fmu.cli import main
from build_fmu.cli.linearise import _without_rounding
from build_fmu.errors import UserError

ROOT = Path(__file__).parents[2]
# a point mass on a massless rod of 0.5 m
PENDULUM = "name = 'p'\ngravity = [9.81, 0, 0]\n[[link]]\nname = 'rod'\nmass = 2\ncom = [0.5, 0, 0]\nq = 0.3\n"


@pytest.fixture
def run(tmp_path, capsys):
    """Returns a function: command and options -> exit code, output, errors for the pendulum."""
    try:
        native.library()
    except UserError as error:
        pytest.skip(str(error))
    file = tmp_path / "p.toml"
    file.write_text(PENDULUM)

    def command(name: str, *options: str, model: Path = file):
        code = main([name, str(model), *options])
        return code, *capsys.readouterr()

    return command


def test_linearise_prints_the_matrices(run):
    code, out, _ = run("linearise", "--json", "--at", "held")
    facts = json.loads(out)
    g, inertia = 9.81 / 0.5, 2 * 0.25
    assert (code, facts["states"], facts["inputs"]) == (0, ["rod.q", "rod.qd"], ["rod.tau"])
    assert facts["u"] == pytest.approx([2 * 9.81 * 0.5 * np.sin(0.3)])
    assert np.array(facts["A"]) == pytest.approx(np.array([[0, 1], [-g * np.cos(0.3), 0]]))
    assert np.array(facts["B"]) == pytest.approx(np.array([[0], [1 / inertia]]))
    h, w = 0.1, np.sqrt(g)
    step = json.loads(run("linearise", "--json", "--start", "rod.q0=0", "--step", str(h))[1])
    rotation = [[np.cos(w * h), np.sin(w * h) / w], [-w * np.sin(w * h), np.cos(w * h)]]
    assert np.array(step["A"]) == pytest.approx(np.array(rotation), abs=1e-9)
    out = run("linearise")[1]
    assert all(
        text in out for text in ("[N.m]", "rod.qd' [rad/s2]", "largest velocity or acceleration at this state: rod.qd' [rad/s2] 5.8e+00")
    )


@pytest.mark.parametrize("micrometres", [1, 1e6])
def test_rounding_is_printed_as_zero_in_any_units(micrometres):
    scale = np.array([1, micrometres])
    shown = _without_rounding(np.array([[3, 1e-17], [0.2, -5]]) * scale[:, None] / scale)
    assert ((shown == 0) == [[False, True], [False, False]]).all()


def test_modes_are_those_of_the_pendulum(run):
    facts = json.loads(run("modes", "--json")[1])
    assert facts["frequencies"] == pytest.approx([np.sqrt(9.81 / 0.5) / (2 * np.pi)], rel=1e-12)
    assert "0.704968 Hz" in run("modes")[1]
    above = run("modes", "--at", "held", "--start", "rod.q0=pi")
    assert "unstable 0.226 s" in above[1]
    assert run("modes", "--at", "start")[::2] == (
        1,
        "modes require a state at rest, but 'rod.qdd' is -5.8: use an equilibrium or holding inputs\n",
    )


def test_modes_below_the_rounding_of_the_highest_one_are_announced(run, tmp_path):
    """1 rad/s beside 1e8 rad/s: 1e-14 of the largest square is 1 (rad/s)2."""
    links = [f'[[link]]\nname = "{name}"\njoint = "prismatic"\nmass = 1\nstiffness = {k}\n' for name, k in (("a", 0.1), ("b", 1e16))]
    (tmp_path / "graded.toml").write_text('name = "graded"\ngravity = [0, 0, 0]\n' + "".join(links))
    code, out, errors = run("modes", model=tmp_path / "graded.toml")
    assert code == 0 and " 0 Hz" in out
    assert errors.startswith("modes below 2.25 Hz are shown as 0 Hz (1 of 2): ")
    facts = json.loads(run("modes", "--json", model=tmp_path / "graded.toml")[1])
    # the masses in a row: the last one moves the sum of both on the stiff spring
    assert facts["resolution"] == pytest.approx(1e-7 * np.sqrt(2e16) / (2 * np.pi), rel=1e-6)
    assert facts["frequencies"][1] == pytest.approx(np.sqrt(2e16) / (2 * np.pi), rel=1e-6)
    assert run("modes")[2] == ""
    # without stiffness no frequency hides another one
    (tmp_path / "free.toml").write_text(PENDULUM.replace("9.81", "0"))
    assert run("modes", model=tmp_path / "free.toml")[2] == ""


def test_equilibrium_is_found_or_refused(run):
    facts = json.loads(run("equilibrium", "--json", "--input", "rod.tau=2")[1])
    assert facts["positions"]["rod.q"] == pytest.approx(np.arcsin(2 / 9.81), abs=1e-9) and facts["largest_rate"] < 1e-6
    # more than the weight can balance
    code, out, errors = run("equilibrium", "--input", "rod.tau=20")
    assert (code, out, errors.count("\n")) == (1, "", 1) and "found no rest configuration" in errors


def test_equilibrium_under_a_sampled_controller_has_no_rates(run, tmp_path):
    sampled = tmp_path / "sampled.toml"
    sampled.write_text(PENDULUM + "[controller]\nlaw = 'pd'\nkp = 20\nkd = 1\ninput = true\nsample_time = 0.01\n")
    facts = json.loads(run("equilibrium", "--json", "--input", "rod.tau_added=2", model=sampled)[1])
    q = facts["positions"]["rod.q"]
    assert 20 * (q - 0.3) + 9.81 * np.sin(q) == pytest.approx(2, abs=1e-7) and "largest_rate" not in facts
    assert run("modes", model=sampled)[::2] == (
        1,
        "the controller is sampled every 0.01 s, so x' does not follow from x and u alone: remove sample_time, or use the method step of the Python library\n",
    )


def test_equilibrium_of_contact_and_loops(run):
    for name in ("quadruped", "four_bar"):
        facts = json.loads(run("equilibrium", "--json", model=ROOT / "models" / f"{name}.toml")[1])
        assert facts["largest_rate"] < 1e-6


def test_a_held_pose_of_loops_has_no_velocity(run):
    """Some independent coordinates of the platform are no joint's."""
    options = ("--json", "--at", "held", "--start", "platform[1].qd0=0.1")
    facts = json.loads(run("linearise", *options, model=ROOT / "models" / "stewart_platform.toml")[1])
    assert facts["largest_rate"] < 1e-6
    assert [value for name, value in zip(facts["states"], facts["x"], strict=True) if ".qd" in name] == [0] * 6


def test_wrong_inputs_are_one_sentence(run):
    assert run("linearise", "--input", "rod.ta=2")[::2] == (1, "unknown input 'rod.ta'; did you mean 'rod.tau'?\n")


# a pendulum on an inclined joint whose position is prescribed: unstable at these positions
TILTED = """name = "tilted"
[[link]]
name = "p"
drive = "motion"
alpha = 1.5707963267948966
mass = 1
inertia = [1, 1, 1]
q = 1.0
[[link]]
name = "s"
mass = 1
com = [1, 0, 0]
q = -0.5
"""


def test_a_model_without_states_has_empty_matrices(run, tmp_path):
    model = tmp_path / "moved.toml"
    model.write_text(TILTED.replace('name = "s"', 'name = "s"\ndrive = "locked"'))
    for options in ((), ("--step", "0.1")):
        facts = json.loads(run("linearise", "--json", *options, model=model)[1])
        assert (facts["A"], facts["B"]) == ([], [])


def test_prescribed_joints_keep_their_start(run, tmp_path):
    model = tmp_path / "tilted.toml"
    model.write_text(TILTED)
    for options in ((), ("--at", "held"), ("--input", "p.q=1")):
        code, out, _ = run("linearise", "--json", *options, model=model)
        facts = json.loads(out)
        assert code == 0 and np.allclose(facts["A"], [[0, 1], [9.81 * np.sin(0.5), 0]])
        assert facts["u"][1:] == [1, 0, 0] and np.isclose(facts["u"][0], 9.81 * np.cos(0.5) if "held" in options else 0)
    code, out, _ = run("equilibrium", "--json", model=model)
    assert code == 0 and np.isclose(json.loads(out)["positions"]["s.q"], -np.pi / 2 - 1)
    model.write_text(TILTED.replace("q = 1.0", "q = 1.0\nqd = 8"))
    code, _, errors = run("equilibrium", model=model)
    assert code == 1 and "prescribed motions that start at rest" in errors
