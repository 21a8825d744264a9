"""ReDySim's examples, run as FMUs, against its printed results and those of an independent program."""

from __future__ import annotations

import re
import tomllib
from pathlib import Path

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from bench.redysim_examples import BLOCK, PAGE, chosen, measure, page_block, rows
from build_fmu.run.session import Session
from build_fmu.run.simulate import Settings, simulate
from tests.fmi.redysim_dense_cases import ALL

MODELS = Path(__file__).resolve().parents[2] / "models"


def unit_of_the_seventh_digit(value: float) -> float:
    return 10.0 ** (np.floor(np.log10(abs(value))) - 6) if value else 2e-11


@pytest.mark.parametrize("case", ALL, ids=lambda case: f"{case.example}: {case.run}".replace(" ", "_"))
def test_known_results(fmu_file, case):
    for found in measure(fmu_file, case):
        known = found.known
        assert found.digits >= known.digits, found
        if known.whole:
            units = np.array([unit_of_the_seventh_digit(value) for value in known.values])
            assert np.all(found.errors <= 0.5000001 * units), (found, found.errors / units)


def test_the_hexapod_walks_at_its_own_tolerance(fmu_file):
    """1.5258 m in 2 s: within 1e-5 m of ReDySim's printed rows and 1e-7 m of a run at a tight tolerance."""
    runs = []
    for start in ([], ["solver.rtol=1e-11", "solver.atol=1e-13"]):
        with Session(fmu_file("redysim_hexapod")) as session:
            runs.append(simulate(session, Settings(2, 0.01, None, start, [])))
    own, tight = (np.array([run[f"base[{i}].q"] for i in (1, 2, 3)]) for run in runs)
    assert np.abs(own - tight).max() < 1e-7
    printed = {50: (0.1897532, 0.5495632), 100: (0.5678278, 0.5495941), 150: (0.9468271, 0.5495924), 200: (1.325768, 0.5495919)}
    for row, place in printed.items():
        assert np.abs(own[:2, row] - place).max() < 1e-5
    assert own[0, -1] - own[0, 0] == pytest.approx(1.5258, abs=1e-4)
    # the steps of the gait lift the energy out of the drives and put it into the ground
    assert runs[0]["energy.contact"][-1] < -17 and np.abs(runs[0]["energy.balance"]).max() < 1e-6


def test_a_sign_explains_the_sideways_error_of_the_biped():
    """E13: the hip sways by y(t) at the height z, joint 2 is a = atan(y/z). ReDySim's a" has y" with the opposite sign and a' for a'^2."""
    height, duration, sway = 0.92, 0.5, 0.06
    w = np.sqrt(9.81 / height)
    rate = sway * w * np.tanh(w * duration / 2)

    def gait(t):
        y = sway - sway * np.cosh(w * t) + rate / w * np.sinh(w * t)
        dy, ddy = rate * np.cosh(w * t) - sway * w * np.sinh(w * t), w * w * (y - sway)
        a = np.arctan2(y, height)
        da, across = dy * np.cos(a) ** 2 / height, ddy * np.cos(a) ** 2 / height
        return a, across - 2 * np.tan(a) * da * da, -across - 2 * np.tan(a) * da

    def error(t, e):
        _, right, theirs = gait(t)
        return [e[1], theirs - right - 40 * e[1] - 225 * e[0]]

    published = {0.02: 0.002942246, 0.26: 0.02085610, 0.28: 0.02073863, 0.5: 0.004882104}
    run = solve_ivp(error, (0, duration), [0, 0], t_eval=list(published), rtol=1e-9, atol=1e-12)
    positions = [gait(t)[0] for t in published]
    assert np.abs(np.array(positions) + run.y[0] - list(published.values())).max() < 2e-5
    assert np.abs(run.y[0]).max() > 3e-3


def lines_of_the_page() -> list[str]:
    block = BLOCK.search(PAGE.read_text(encoding="utf-8"))[0]
    return [line for line in block.splitlines() if line.startswith("| ")][2:]


def about(line: str) -> list:
    """The cells of a row; figures of the FMU and differences to the digits that machines share."""
    cells = [cell.strip() for cell in line.strip("|").split("|")]
    cells[6] = pytest.approx(float(cells[6]), rel=1e-6, abs=1e-9)
    cells[7] = cells[7] if cells[7] == "none" else pytest.approx(float(cells[7]), rel=0.6)
    return cells


@pytest.mark.parametrize("example", ["E2", "E4", "E5", "E8", "E13", "E21"])
def test_the_page_shows_a_fresh_run(fmu_file, example):
    fresh = [line for case in chosen([example]) for line in rows(case, measure(fmu_file, case))]
    shown = [line for line in lines_of_the_page() if re.match(rf"\| {example}\b", line)]
    assert fresh and [about(line) for line in shown] == [about(line) for line in fresh], "python bench/redysim_examples.py --docs"


def test_the_page_has_a_row_for_every_known_quantity_and_its_commands():
    shown = [tuple(line.strip("| ").split(" | ")[k].split(", `")[0] for k in (0, 2, 4)) for line in lines_of_the_page()]
    known = {(case.example, known.what.partition(" at ")[0], known.source) for case in ALL for known in case.known}
    assert set(shown) == known
    commands = BLOCK.search(PAGE.read_text(encoding="utf-8"))[0].partition("```sh")[2]
    assert commands.partition("```")[0] == page_block([]).partition("```sh")[2].partition("```")[0]


def test_models_of_redysim_are_on_the_page():
    """Every model whose data are ReDySim's is run here, or named among the differences."""
    text = PAGE.read_text(encoding="utf-8")
    theirs = [path.stem for path in MODELS.glob("*.toml") if "ReDySim (Shah" in path.read_text(encoding="utf-8")]
    assert len(theirs) > 20 and not [name for name in theirs if f"`{name}`" not in text and f"`{name}.toml`" not in text]
    assert all(tomllib.loads((MODELS / f"{case.model}.toml").read_text(encoding="utf-8"))["name"] == case.model for case in ALL)
