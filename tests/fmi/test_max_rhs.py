"""`solver.max_rhs`: no communication step takes more right-hand sides; where the tolerance is loosened for it, the FMU says so."""

from __future__ import annotations

import tomllib
from pathlib import Path

import pytest

from build_fmu.model.describe import describe
from build_fmu.report.sweep import METHODS, offered_methods
from build_fmu.run.driver import stage_model
from tests.command_line import command
from tests.crosscheck.random_scenes import draw, toml
from tests.crosscheck.scene_fmu import Library, Refused
from tests.fmi.raw import ERROR, OK, Slave
from tests.fmi.raw3 import Slave3
from tests.fmi.test_intermediate_update import Recorder, updated

FEW = {"solver.rtol": 1e-10, "solver.atol": 1e-12, "solver.max_rhs": 14}


def test_a_log_line_and_the_error_estimate_say_that_the_tolerance_was_loosened(fmu):
    with Slave(fmu("gripper"), logging=True) as slave:
        slave.initialize(start=FEW)
        slave.run(0.1, 0.01)
        assert slave.call("Terminate") == OK
        texts = [text for _, _, text in slave.messages]
    lines = sum("solver.max_rhs loosened the tolerance: error estimate" in text for text in texts)
    assert lines > 5
    assert any(f"solver.max_rhs loosened the tolerance in {lines} communication steps" in text for text in texts)


SAMPLED = """name = "sampled"
[[link]]
name = "rod"
mass = 1
com = [1, 0, 0]
alpha = 1.5707963267948966
[controller]
law = "pd"
kp = 20
kd = 2
sample_time = 0.1
[solver]
rtol = 1e-6
max_rhs = 8
[fmu]
outputs = ["solver"]
"""


def test_a_communication_step_with_samples_is_judged_as_a_whole(built):
    fmu, estimates = built(SAMPLED), []
    with Slave(fmu) as slave:
        slave.initialize()
        for k in range(10):
            assert slave.step(0.1 * k, 0.1) == OK
            estimates.append(slave.get("solver.error_estimate"))
    with Slave(fmu, logging=True) as slave:
        slave.initialize()
        assert slave.step(0, 1) == OK
        assert slave.get("solver.error_estimate") == max(estimates) > 1
        assert slave.call("Terminate") == OK
        assert any("loosened the tolerance in 1 communication step" in text for _, _, text in slave.messages)


def test_simulate_shows_the_warning():
    short = ("--stop", "1", "--step", "0.1", "--start", "solver.rtol=1e-9")
    run = command("simulate", "models/double_pendulum.toml", *short, "solver.max_rhs=8")
    assert run.returncode == 0
    assert "solver.max_rhs loosened the tolerance in 10 communication steps" in run.stderr
    assert not command("simulate", "models/double_pendulum.toml", *short).stderr


def test_the_run_continues_bit_for_bit_from_a_saved_state(fmu):
    with Slave(fmu("gripper")) as slave:
        slave.initialize(start=FEW)
        slave.run(0.05, 0.01)
        state = slave.save()
        ends = []
        for _ in range(2):
            assert slave.call("SetFMUstate", state) == OK
            slave.run(0.1, 0.01, start=0.05)
            ends.append(slave.reals([name for name in slave.fmu.variables if name.endswith((".q", ".qd"))]))
        assert ends[0] == ends[1]


def test_after_an_early_return_the_run_is_that_of_the_saved_state(fmu3):
    fmu, start = fmu3("double_pendulum"), {"solver.method": "erk", "solver.rtol": 1e-10, "solver.atol": 1e-12, "solver.max_rhs": 40.0}
    with updated(fmu, Recorder(leave=2), early=True) as slave, Slave3(fmu) as restored:
        _, flags, time = slave.initialize(start).do_step(0, 0.5)
        assert flags[2] and time < 0.5
        status, state = restored.deserialize(slave.serialize(slave.save()))
        assert status == OK and restored.call("SetFMUState", state) == OK
        for one in (slave, restored):
            assert one.do_step(time, 0.5 - time)[0] == OK, one.errors
        assert slave.everything() == restored.everything()


@pytest.mark.parametrize(
    ("start", "sentence"),
    [
        ({"solver.max_rhs": 5.0}, "solver.max_rhs must be 0 or at least 8"),
        ({"solver.max_rhs": 20.0, "solver.method": "bdf"}, "solver.max_rhs requires the method 'auto' or 'erk', got 'bdf'"),
    ],
)
def test_impossible_settings_are_refused_with_a_sentence(fmu, start, sentence):
    with Slave(fmu("cart")) as slave:
        assert slave.setup() == OK
        assert slave.call("EnterInitializationMode") == OK
        assert all(slave.set(name, value) == OK for name, value in start.items())
        assert slave.call("ExitInitializationMode") == ERROR
        assert sentence in slave.errors[-1]


def test_a_stiff_model_fails_with_the_reason(fmu):
    with Slave(fmu("gripper_pd")) as slave:
        slave.initialize(start={"solver.max_rhs": 8.0})
        k = 0
        while slave.step(k * 0.01, 0.01) == OK and k < 100:
            k += 1
        assert "solver.max_rhs" in slave.errors[-1]


def test_other_methods_are_measured_without_it(tmp_path):
    model = tmp_path / "bounded.toml"
    model.write_text(Path("models/double_pendulum.toml").read_text().replace("[solver]", "[solver]\nmax_rhs = 8"))
    fmu = stage_model(model, tmp_path, describe(model))
    assert offered_methods(fmu) == list(METHODS)


def most_in_a_step(library: Library, max_rhs: float, size: float) -> int:
    with Slave(library) as slave:
        slave.initialize(start={"solver.max_rhs": max_rhs})
        most, count = 0, 0
        for k in range(20):
            if slave.step(k * size, size) != OK:
                assert "max_rhs" in slave.errors[-1] or "cannot be satisfied" in slave.errors[-1], slave.errors
                break
            before, count = count, slave.get("solver.rhs_evaluations")
            most = max(most, count - before)
    return most


def test_random_scenes_stay_within_it(tmp_path):
    library, taken = Library(tmp_path), 0
    for index in range(60):
        file = tomllib.loads(draw(4711, index).text)
        file["fmu"] = {"outputs": ["solver"]}
        try:
            library.load(toml(file))
            for max_rhs in (8.0, 13.0, 30.0):
                assert most_in_a_step(library, max_rhs, 0.003) <= max_rhs, (index, max_rhs)
        except Refused:
            continue
        taken += 1
    assert taken > 40
