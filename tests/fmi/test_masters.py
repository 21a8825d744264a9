"""The examples that use what a simple master does not: saved states and derivatives of inputs."""

import re

import pytest


@pytest.fixture
def run(example, tmp_path):
    """Returns a function: name of an example -> its lines; checks that it leaves its plot."""

    def lines(name: str) -> list[str]:
        said = example(f"{name}.py", "double_pendulum")
        assert (tmp_path / "out" / f"{name}.png").stat().st_size > 10000
        return said

    return lines


def numbers(line: str) -> list[float]:
    return [float(word) for word in re.findall(r"\d[\d.]*(?:e[-+]?\d+)?", line)]


def test_rollback_chooses_its_steps(run):
    steps, off = map(numbers, run("rollback"))
    count, smallest, largest, rejected = steps
    assert 20 < count < 2000 and largest > 3 * smallest and 0 < rejected < count
    assert off[0] < 5e-3


def test_the_filter_knows_more_than_its_measurements(run):
    predictions, angles, speeds = map(numbers, run("kalman"))
    assert predictions == [2700, 9]
    assert angles[0] == pytest.approx(0.02, rel=0.1) and angles[1] < angles[0] / 2
    assert speeds[1] < speeds[0] / 5


def test_errors_fall_with_the_order_of_the_inputs(run):
    rows = [numbers(line) for line in run("smooth_inputs")[1:]]
    first, last = rows[1], rows[-1]  # (step, held, linear, quadratic): the step falls to an eighth
    for order, (before, after) in enumerate(zip(first[1:], last[1:], strict=True), start=1):
        assert after < before / 8 ** (order - 0.35)
    assert last[3] < last[2] / 10 < last[1] / 100
