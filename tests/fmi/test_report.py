"""Error against run time: errors are those of closed forms, references say how good they are, a target error is kept."""

from __future__ import annotations

import functools
import zipfile

import numpy as np
import pytest

from build_fmu.errors import UserError
from build_fmu.report.make import Wish, make_report
from build_fmu.report.motion import Positions, positions
from build_fmu.report.pages import advice, page_lines
from build_fmu.report.reference import from_csv, from_tight_runs
from build_fmu.report.sweep import Inputs, task_for
from build_fmu.run.driver import Task, drive, staged
from tests.command_line import command
from tests.fmi.conftest import ROOT, build_fmu

PENDULUM = ROOT / "models" / "pendulum.toml"
SCENES = ROOT / "tests" / "scenes"


@pytest.fixture(scope="module")
def report():
    return make_report(PENDULUM, Wish(stop=2, steps=[0.01, 0.1], methods=["erk", "adams"], tolerances=[1e-4, 1e-7, 1e-10], repeats=1))


def test_errors_follow_the_tolerance(report):
    assert len(report.points) == 2 * 2 * 2 * 3 and all(p.good for p in report.points)
    for p in report.points:
        assert p.error < 1e3 * p.rtol
    adams = {p.rtol: p.error for p in report.points if p.method == "adams" and p.step == 0.1 and not p.changing}
    assert adams[1e-4] > 10 * adams[1e-7] > 100 * adams[1e-10] > 0


def test_errors_are_distances_to_the_closed_form(report):
    table = np.genfromtxt(SCENES / "simple_pendulum.csv", delimiter=",", names=True)
    point = next(p for p in report.points if p.method == "adams" and p.rtol == 1e-4 and p.step == 0.1 and not p.changing)
    exact = np.interp(point.outcome.times, table["t"], table["q1"])
    assert point.error == pytest.approx(np.abs(point.outcome.values[:, 0] - exact).max(), rel=1e-6)
    assert "the table simple_pendulum.csv" in report.reference.origin


def test_changing_inputs_cost_a_multistep_method_its_history_and_move_nothing(report):
    held, changed = (
        next(p for p in report.points if (p.method, p.rtol, p.step, p.changing) == ("adams", 1e-7, 0.01, c)) for c in (False, True)
    )
    assert changed.outcome.health["solver.rhs_evaluations"] > 3 * held.outcome.health["solver.rhs_evaluations"]
    assert changed.error < 1e-5


def test_the_pages_hold_every_run(report):
    lines = page_lines(report, "picture.svg")
    assert sum(line.startswith(("| erk", "| adams")) for line in lines) == len(report.points)
    first = advice(report)[0]
    assert first.startswith("for 1e-3 rad: ") and "µs per ms" in first


def test_an_own_reference_knows_how_good_it_is():
    with staged(ROOT / "models" / "double_pendulum.toml") as fmu:
        where = positions(fmu)
        task = task_for(fmu, 2, 0.1, 0.1, Inputs(), False, where.names)
        own = from_tight_runs(fmu, where, task, ["erk", "adams", "bdf"], 20)
        exact = from_csv(SCENES / "double_pendulum.csv", where)
    assert 0 < own.uncertainty < 1e-8
    assert exact.error(where, own.times, own.values, list(range(2))) < 3 * own.uncertainty


def test_a_quaternion_and_its_negative_are_the_same_turn():
    where = Positions([], [["a.quaternion[1]"]], "rad")
    turn = np.array([[np.cos(5e-4), np.sin(5e-4), 0, 0]])
    assert where.error(turn, np.array([[-1.0, 0, 0, 0]])) == pytest.approx(1e-3, rel=1e-6)


def test_a_reference_of_another_mechanism_is_refused():
    with pytest.raises(UserError, match="column 'pivot.q' is missing"):
        make_report(PENDULUM, Wish(stop=1, methods=["erk"], reference=SCENES / "double_pendulum.csv"))


@pytest.mark.parametrize(
    ("table", "tolerance", "sentence"),
    [
        ("t,q2\n0,0\n1,1\n", 1e-3, "column 'pivot.q' is missing"),
        ("t,q1\n0.333,0\n0.5001,1\n", 1e-3, "^the table r.csv has none of the times of the output rows, every 0.1 s to 1 s$"),
        ("t,q1\n0,0\n0.1,0\n", 0.5, "^--rtol must be at most 0.1, the maximum of solver.rtol, got 0.5$"),
    ],
)
def test_what_gives_no_error_is_refused_before_the_runs(tmp_path, table, tolerance, sentence):
    (tmp_path / "r.csv").write_text(table)
    with pytest.raises(UserError, match=sentence):
        make_report(PENDULUM, Wish(stop=1, steps=[0.1], methods=["erk"], tolerances=[tolerance], reference=tmp_path / "r.csv"))


def test_a_table_that_ends_early_is_named(tmp_path):
    (tmp_path / "r.csv").write_text("t,q1\n0,0\n0.1,0\n0.15,0\n0.5,0\n")
    report = make_report(PENDULUM, Wish(stop=1, steps=[0.1], methods=["erk"], tolerances=[1e-3], reference=tmp_path / "r.csv", repeats=1))
    sentence = "the table r.csv has 3 of 11 output rows, the last at 0.5 s: the errors are those of these"
    assert sentence in advice(report) and "over all joints and the output rows of the reference." in "".join(page_lines(report, ""))


def test_an_inverse_has_no_error_in_time(fmu_file):
    with pytest.raises(UserError, match="has no integrated states"):
        make_report(fmu_file("gripper_inverse"), Wish())


def test_a_build_with_report_adds_its_pages(tmp_path, monkeypatch):
    """The pages are files of the documentation, all else stays as in an FMU without report."""
    few = functools.partial(Wish, stop=0.5, steps=[0.1], methods=["erk"], tolerances=[1e-4], repeats=1)
    monkeypatch.setattr("build_fmu.fmu.report_pages.Wish", few)
    build_fmu(PENDULUM, tmp_path / "plain.fmu")
    build_fmu(PENDULUM, tmp_path / "a.fmu", "--report")
    with zipfile.ZipFile(tmp_path / "plain.fmu") as plain, zipfile.ZipFile(tmp_path / "a.fmu") as with_report:
        pages = {f"documentation/report{ending}" for ending in (".html", ".md", ".csv", ".svg")}
        assert set(with_report.namelist()) == set(plain.namelist()) | pages
        changed = [name for name in plain.namelist() if plain.read(name) != with_report.read(name)]
        assert changed == ["documentation/index.html"] and b'href="report.html"' in with_report.read(changed[0])
        assert len(with_report.read("documentation/report.csv").splitlines()) == 1 + 2  # constant and changing inputs


# --- target_error ---


def build(folder, text):
    (folder / "arm.toml").write_text(text)
    return command("build", folder / "arm.toml", "-o", folder / "arm.fmu")


def model(solver):
    text = (ROOT / "models" / "double_pendulum.toml").read_text()
    text = text.replace("../tests", str(ROOT / "tests"))
    return text.replace("rtol = 1e-8", solver).replace('double_pendulum"\n', 'arm"\n', 1)


@pytest.mark.parametrize("target", [1e-3, 1e-7])
def test_the_built_fmu_keeps_its_target_error_at_every_communication_step(tmp_path, target):
    done = build(tmp_path, model(f"target_error = {target!r}  # rad"))
    assert done.returncode == 0, done.stderr
    assert f"meets target_error = {target:g} for communication step sizes of 1 ms to 5 s" in done.stdout
    errors = []
    with staged(tmp_path / "arm.fmu") as fmu:
        where = positions(fmu)
        exact = from_csv(SCENES / "double_pendulum.csv", where)
        # its own step, shorter and longer ones up to the whole motion, and one that no choice has tried
        for step in (fmu.step, fmu.step / 5, 0.05, 0.35, 0.5, fmu.stop):
            outcome = drive(fmu, Task(step, int(fmu.stop / step * (1 + 1e-9)), outputs=where.names))
            errors.append(exact.error(where, outcome.times, outcome.values, [0, 1]))
        chosen = fmu.variables["solver.rtol"].start
    # not tighter by far than it must be
    assert target / 1e5 < max(errors) <= target and 1e-12 < chosen < 1e-2
    with zipfile.ZipFile(tmp_path / "arm.fmu") as archive:
        assert f"rtol = {chosen!r} # chosen for target_error" in archive.read("resources/model.toml").decode()


def test_a_given_tolerance_is_a_choice(tmp_path):
    done = build(tmp_path, model("target_error = 1e-9\nrtol = 1e-3"))
    assert done.returncode == 0 and "meets" not in done.stdout
    with staged(tmp_path / "arm.fmu") as fmu:
        assert fmu.variables["solver.rtol"].start == 1e-3


def test_a_target_out_of_reach_is_refused(tmp_path):
    done = build(tmp_path, model("target_error = 1e-15"))
    assert done.returncode == 1 and "no rtol down to 1e-12 meets target_error = 1e-15" in done.stderr
    assert not (tmp_path / "arm.fmu").exists()
