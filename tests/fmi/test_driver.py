"""The compiled master: it does what FMPy does, and every way an FMU can fail has a name."""

from __future__ import annotations

import subprocess
from pathlib import Path

import numpy as np
import pytest

from build_fmu.errors import UserError
from build_fmu.model.describe import Variable
from build_fmu.run import driver
from build_fmu.run.driver import Staged, Task, drive, staged
from tests.fmi.raw import OK, Slave


@pytest.fixture(scope="module")
def faulty(tmp_path_factory):
    """Returns a function: name of a fault -> an FMU that has it."""
    import fmpy

    headers = Path(fmpy.__file__).parent / "c-code"
    library = tmp_path_factory.mktemp("faulty") / "faulty.so"
    source = Path(__file__).with_name("faulty_fmu.c")
    subprocess.run(["cc", "-shared", "-fPIC", f"-I{headers}", str(source), "-o", str(library), "-lm"], check=True)
    variables = {name: Variable(name, i, "Real", "output", "continuous") for i, name in enumerate("abc")}
    return lambda fault: Staged(fault, library, "file:///", fault, variables, 1.0, 0.1)


def test_it_steps_as_fmpy_does(fmu, fmu_file):
    torque = [[0.5], [-0.25], [0.125]]
    with staged(fmu_file("pendulum")) as staged_fmu:
        names = ["pivot.q", "pivot.qd", "energy.balance"]
        outcome = drive(
            staged_fmu, Task(0.01, 60, 2, {"pivot.q0": 0.3, "solver.method": "adams"}, names, ["pivot.tau"], torque, hold=5, repeats=2)
        )
    assert (outcome.status, outcome.method, len(outcome.times)) == ("ok", "adams", 31)
    with Slave(fmu("pendulum")) as slave:
        slave.initialize(start={"pivot.q0": 0.3, "solver.method": "adams"})
        for k in range(60):
            assert slave.set("pivot.tau", torque[k // 5 % 3][0]) == OK
            assert slave.step(k * 0.01, (k + 1) * 0.01 - k * 0.01) == OK
        assert list(outcome.values[-1]) == [slave.get(name) for name in names]
        assert outcome.health["solver.rhs_evaluations"] == slave.get("solver.rhs_evaluations") > 60


def test_no_fault_is_no_fault(faulty):
    outcome = drive(faulty("none"), Task(0.1, 10, outputs="abc"))
    assert outcome.status == "ok" and outcome.reached == 1
    assert np.array_equal(outcome.values, np.tile([0, 1, 2], (11, 1)))


@pytest.mark.parametrize(
    "fault, status, reached, words",
    [
        ("nan", "not finite", 0.3, "'a' is not finite at t = 0.3 s"),
        ("error", "error", 0.2, "joint 'elbow' is stuck"),
        ("discard", "other status", 0.2, ""),
        ("crash", "crash", 0, "signal 11"),
        ("refuse", "refused", 0, ""),
    ],
)
def test_faults_are_named(faulty, fault, status, reached, words):
    outcome = drive(faulty(fault), Task(0.1, 10, outputs="abc"))
    assert outcome.status == status and words in outcome.message
    assert outcome.reached == pytest.approx(reached)
    if fault == "error":
        assert outcome.after == "reset refused"


def test_a_call_that_never_returns_ends(faulty, monkeypatch):
    monkeypatch.setattr(driver, "PATIENCE", 0.2)
    outcome = drive(faulty("hang"), Task(0.1, 10, outputs="abc", budget=0.2))
    assert outcome.status == "hang" and "t = 0.2 s" in outcome.message


def test_a_library_that_is_none(faulty, tmp_path):
    fmu = faulty("none")
    (tmp_path / "text.so").write_text("no library")
    other = Staged(fmu.name, tmp_path / "text.so", fmu.resources, fmu.guid, fmu.variables, 1, 0.1)
    assert drive(other, Task(0.1, 1)).status == "not loaded"


def test_time_is_bounded(fmu_file):
    with staged(fmu_file("pendulum")) as fmu:
        outcome = drive(fmu, Task(1e-6, 10**9, 10**9, outputs=["pivot.q"], budget=0.1))
    assert outcome.status == "budget" and 0 < outcome.reached < 1000
    assert outcome.times[-1] == outcome.reached


def test_what_is_no_fmu_gets_a_sentence(tmp_path):
    (tmp_path / "a.fmu").write_text("text")
    with pytest.raises(UserError, match="not a readable FMU"), staged(tmp_path / "a.fmu"):
        pass
