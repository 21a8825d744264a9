"""The programs of examples/ as a reader runs them, and the one that the README shows."""

import re
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[2]
EXAMPLES = ROOT / "examples"


def test_free_fall_keeps_the_energy(example):
    lines = example("free_fall.py", "kuka_kr5")
    assert len(lines) == 11 and lines[0].startswith("0.0 s   joint2  0.5000 rad") and lines[-1].startswith("1.0 s")
    assert max(abs(float(line.split()[-2])) for line in lines) < 1e-6


def test_hold_pose_holds_the_pose(example):
    last = [float(word) for word in example("hold_pose.py", "kuka_kr5")[-1].split()[2:]]
    # a PD controller gives way under the arm's weight a little
    assert last == pytest.approx([0, 0.5, -1, 0, 0.5, 0], abs=0.02)


def test_gravity_compensation_needs_no_stiff_controller(example):
    rows = {
        line[:22].strip(): [abs(float(word)) for word in line[24:].split()] for line in example("gravity_compensation.py", "kuka_kr5")[-2:]
    }
    # PD alone sags under the weight, by 49.9 N m / 800 N m/rad and more; with compensation nothing is left but the decay
    assert rows["PD alone"][1] > 0.05 and max(rows["with compensation"]) < 0.005


def test_regulator_holds_the_pendulum_upright(example):
    *rows, values = example("lqr.py")
    errors = [float(row.split()[-1]) for row in rows]
    assert errors[0] == 0.3 and errors[-1] < 5e-4
    unstable, stable = (float(part.split()[-1]) for part in values.split(", "))
    assert stable < 1 < unstable


def test_filter_improves_the_measurement(example):
    angles, velocities = ([float(x) for x in re.findall(r"\d\.\d+", line)] for line in example("ukf.py"))
    assert angles[1] < angles[0] / 3 and velocities[0] < 0.1


def test_payload_lies_within_its_standard_errors(example):
    for line in example("payload.py"):
        value, error, true = (float(x) for x in re.findall(r"-?\d+\.\d+", line))
        assert 0 < error < 0.001 and abs(value - true) < 3 * error + 1e-4


def test_rates_of_outputs_couple_two_arms(example):
    *fixed, controlled = ([float(x) for x in re.findall(r"\d+(?:\.\d+)?(?:e-\d+)?(?= m\b)", line)] for line in example("coupled_arms.py"))
    held, with_rates, repeated = (list(column) for column in zip(*fixed, strict=True))
    assert len(held) == 4
    assert all(b < 0.01 * a for a, b in zip(held, with_rates, strict=True))
    # from 1 to 8 ms: orders 1, 2 and 3
    for errors, order in ((held, 1), (with_rates, 1.8), (repeated, 2.8)):
        assert errors[3] / errors[0] > 8**order
    assert controlled[-1] < repeated[3]


@pytest.mark.parametrize("program", ["lqr", "ukf", "payload"])
def test_examples_of_control_stay_short(program):
    assert len((EXAMPLES / f"{program}.py").read_text(encoding="utf-8").splitlines()) < 40


def test_the_readme_shows_the_example():
    shown = re.findall(r"```python\n(.*?)```", (ROOT / "README.md").read_text(encoding="utf-8"), re.DOTALL)
    program = (EXAMPLES / "free_fall.py").read_text(encoding="utf-8")
    assert len(shown) == 1 and program.endswith(shown[0])
