"""ReDySim's examples, run as FMUs, against its printed results and those of an independent program."""

from __future__ import annotations

from math import inf, log10
from pathlib import Path

import numpy as np
import pytest

from build_fmu.run.session import Session
from build_fmu.run.simulate import Settings, simulate
from tests.fmi.redysim_cases import CASES, Case, Known

DOCS = Path(__file__).resolve().parents[2] / "docs" / "redysim_examples.md"
PRINTED = 12  # digits beyond which nobody printed anything


def measure(fmu_file, case: Case) -> list[tuple[Known, float, np.ndarray]]:
    """Runs the case; returns for each known result the digits that agree, and what was found."""
    tight = {"solver.rtol": 1e-11, "solver.atol": 1e-13} if not case.inverse or case.model == "space_robot" else {}
    start = [f"{name}={value}" for name, value in (tight | case.start).items()]
    inputs = [f"{name}={text}" for name, text in case.inputs.items()]
    stop = max(max(known.time for known in case.known), case.step)
    with Session(fmu_file(case.model + "_inverse" * case.inverse)) as session:
        result = simulate(session, Settings(stop, case.step, None, start, inputs))
    rows = []
    for known in case.known:
        row = int(np.argmin(np.abs(result.time - known.time)))
        assert abs(result.time[row] - known.time) < 1e-9
        found = np.array([result[name][row] for name in known.names])
        error, size = np.abs(found - known.values).max(), np.abs(known.values).max()
        rows.append((known, min(-log10(error / size) if error else inf, PRINTED), found))
    return rows


def unit_of_the_seventh_digit(value: float) -> float:
    return 10.0 ** (np.floor(np.log10(abs(value))) - 6) if value else 2e-11


@pytest.mark.parametrize("case", CASES, ids=lambda case: f"{case.example}: {case.run}".replace(" ", "_"))
def test_known_results(fmu_file, case):
    for known, digits, found in measure(fmu_file, case):
        assert digits >= known.digits, (known, found)
        if known.whole:
            units = np.array([unit_of_the_seventh_digit(value) for value in known.values])
            assert np.all(np.abs(found - known.values) <= 0.5000001 * units), (known, found, np.abs(found - known.values) / units)


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


def rows() -> list[str]:
    """The table of docs/redysim_examples.md: one row a run and quantity, the least of its times."""
    least: dict[tuple[str, str, str, str], Known] = {}
    for case in CASES:
        for known in case.known:
            key = (case.example, f"`{case.model}`, {case.run}", known.what, known.source)
            if key not in least or known.digits < least[key].digits:
                least[key] = known
    return [
        f"| {example} | {run} | {what} | {source} | {'all printed' if known.whole else known.digits} | {known.why} |"
        for (example, run, what, source), known in least.items()
    ]


def test_the_page_shows_what_is_asserted():
    text = DOCS.read_text(encoding="utf-8").partition("| example |")[2].partition("\n\n")[0]
    table = text.splitlines()[2:]
    assert table == rows(), "python -m tests.fmi.test_redysim_examples prints the table"


if __name__ == "__main__":
    print(*rows(), sep="\n")
