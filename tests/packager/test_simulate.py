"""The run itself on a stand-in plant: times, inputs, start values, selections, records and pictures."""

import csv
from types import SimpleNamespace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from build_fmu.draw.figure import new_figure
from build_fmu.draw.plots import Panel, _draw, panels, plot
from build_fmu.errors import UserError, unknown
from build_fmu.run.simulate import (
    Settings,
    select_outputs,
    simulate,
    start_values,
    time_grid,
)
from build_fmu.run.tables import final_values, write_csv
from tests.packager.fake_session import FakeSession


def test_constant_force():
    result = simulate(FakeSession(), Settings(inputs=["joint1.tau=2"], start=["joint1.q0=1"]))
    assert len(result.time) == 11 and result.time[-1] == 1.0
    np.testing.assert_allclose(result["joint1.q"], 1 + result.time**2, rtol=1e-14)
    np.testing.assert_allclose(result["joint1.qd"], 2 * result.time, rtol=1e-14)
    np.testing.assert_array_equal(result["joint1.tau"], 2)
    np.testing.assert_array_equal(result["joint2.tau"], 0)


def test_inputs_hold_on_request_at_their_value_from_its_start():
    result = simulate(FakeSession(), Settings(inputs=["joint1.tau=t"], interpolate="none"))
    np.testing.assert_allclose(result["joint1.qd"][1:], np.cumsum(0.1 * result.time[:-1]), atol=1e-15)


def test_steps_meet_and_end_at_the_stop_time():
    session = FakeSession(stop="0.25")
    simulate(session, Settings())
    ends = [t + h for t, h in session.steps]
    assert [t for t, _ in session.steps[1:]] == pytest.approx(ends[:-1], abs=1e-15)
    assert len(ends) == 3 and ends[-1] == pytest.approx(0.25, abs=1e-15)


def test_progress_reaches_the_end():
    seen = []
    simulate(FakeSession(), Settings(), seen.append)
    assert seen == sorted(seen) and seen[-1] == 1.0


@given(st.integers(1, 3000), st.floats(1e-6, 10.0))
def test_a_whole_number_of_steps_stays_whole(count, step):
    times = time_grid(FakeSession(stop=repr(count * step)), Settings(step=step))
    assert len(times) == count + 1 and times[-1] == count * step
    assert all(b > a for a, b in zip(times, times[1:], strict=False))


@pytest.mark.parametrize(
    "settings",
    [Settings(stop=0.0), Settings(stop=-1.0), Settings(step=0.0), Settings(step=-1.0), Settings(step=float("nan")),
     Settings(stop=float("inf")), Settings(stop=1e9, step=1e-9), Settings(stop=1e300, step=1e-20)],
)  # fmt: skip
def test_impossible_times(settings):
    with pytest.raises(UserError):
        time_grid(FakeSession(), settings)


def test_default_experiment_may_be_absent():
    session = FakeSession()
    session.description.defaultExperiment = None
    assert len(time_grid(session, Settings())) == 1001


@pytest.mark.parametrize(
    ("inputs", "sentence"),
    [
        (["joint.tau=1"], "did you mean 'joint1.tau'"),
        (["joint1.q=1"], "is an output, not an input"),
        (["joint1.tau=1", "joint1.tau=2"], "duplicate"),
        (["joint1.tau"], "is not an input: write"),
        (["joint1.tau="], "is not an input: write"),
        (["joint1.tau=1/(t-t)"], "input 'joint1.tau': .* has no value at t = 0 s"),
        (["joint1.tau=(t+9)**9e9"], "input 'joint1.tau': .* has no value at t = 0 s: Numerical result out of range$"),
        (["joint1.tau=2*x"], r"^input 'joint1\.tau': '2\*x': unknown name 'x'"),
        (["joint1.tau=missing.csv"], "cannot read 'missing.csv'"),
        (["inputs.mat"], "^'inputs.mat' is not a CSV file: tables of inputs are read from CSV only$"),
        (["joint1.tau=a/b.XLSX"], "^'a/b.XLSX' is not a CSV file: tables of inputs are read from CSV only$"),
    ],
)
def test_wrong_inputs(inputs, sentence):
    with pytest.raises(UserError, match=sentence):
        simulate(FakeSession(), Settings(inputs=inputs))


@pytest.mark.parametrize(
    ("start", "sentence"),
    [
        (["joint1.q00=1"], "did you mean 'joint1.q0'"),
        (["joint1.q=1"], "is an output, not a parameter"),
        (["joint1.q0"], "write NAME=VALUE"),
        (["joint1.q0=1", "joint1.q0=2"], "duplicate"),
        (["joint1.q0=one"], "unknown name 'one'"),
        (["solver.log=maybe"], "true or false"),
        (["solver.order=1.5"], "integer"),
    ],
)
def test_wrong_start_values(start, sentence):
    with pytest.raises(UserError, match=sentence):
        simulate(FakeSession(), Settings(start=start))


def test_start_values_by_type():
    given_values = ["joint1.q0=pi/2", "solver.method=bdf", "solver.log=True", "solver.order=5"]
    values = start_values(FakeSession(), given_values)
    assert values == {"joint1.q0": np.pi / 2, "solver.method": "bdf", "solver.log": True, "solver.order": 5}


def test_an_input_cannot_be_given_in_two_ways():
    with pytest.raises(UserError, match="both a start value and an input"):
        simulate(FakeSession(), Settings(start=["joint1.tau=1"], inputs=["joint1.tau=2"]))


def test_outputs_by_name_and_star():
    session = FakeSession()
    assert "solver.says" not in select_outputs(session, [])
    assert select_outputs(session, ["joint*.q", "solver.steps"]) == ["joint1.q", "joint2.q", "solver.steps"]
    assert select_outputs(session, ["joint2.q, joint1.q"]) == ["joint2.q", "joint1.q"]
    assert select_outputs(session, ["tip.position[1]"]) == ["tip.position[1]"]
    session.variables["mass_matrix[1,2]"] = session.variables["tip.position[1]"]
    assert select_outputs(session, ["joint1.q,mass_matrix[1,2] joint2.q"]) == ["joint1.q", "mass_matrix[1,2]", "joint2.q"]
    assert select_outputs(session, ["*[1]"]) == ["tip.position[1]"]
    assert select_outputs(session, ["*1.tau"]) == ["joint1.tau"]  # inputs where no output matches
    with pytest.raises(UserError, match="did you mean 'joint1.qd'"):
        select_outputs(session, ["joint1.qdot"])
    with pytest.raises(UserError, match="no output matches"):
        select_outputs(session, ["arm*"])


def test_failure_tells_the_reason():
    with pytest.raises(UserError, match=r"from t = 0.5 s: joint1 runs away"):
        simulate(FakeSession(fails_at=0.45), Settings())


def test_csv_input_columns(tmp_path):
    file = tmp_path / "in put.csv"
    file.write_text("time,joint1.tau,joint2.tau\n0,0,5\n0.5,1,5\n0.5,3,5\n\n1,3,5\n")
    result = simulate(FakeSession(), Settings(inputs=[str(file)]))
    np.testing.assert_allclose(result["joint1.tau"], [0, 0.2, 0.4, 0.6, 0.8, 3, 3, 3, 3, 3, 3], atol=1e-14)
    np.testing.assert_array_equal(result["joint2.tau"], 5)
    only = simulate(FakeSession(), Settings(inputs=[f"joint2.tau={file}"]))
    np.testing.assert_array_equal(only["joint1.tau"], 0)


def test_csv_input_with_one_column_of_any_name(tmp_path):
    file = tmp_path / "a.csv"
    file.write_text("time,torque\n0.3,1\n0.7,2\n")
    result = simulate(FakeSession(), Settings(inputs=[f"joint1.tau={file}"]))
    assert result["joint1.tau"][0] == 1 and result["joint1.tau"][-1] == 2


def test_units_of_columns_that_are_not_used_do_not_matter(tmp_path):
    file = tmp_path / "a.csv"
    file.write_text("t,joint1.tau,joint2.tau [m]\n0,0,1\n")
    simulate(FakeSession(), Settings(inputs=[f"joint1.tau={file}"]))


@pytest.mark.parametrize(
    ("text", "sentence"),
    [
        ("", "no column 'time'"),
        ("T,joint1.tau\n0,1\n", "no column 'time' or 't'"),
        ("t;joint1.tau\n0;1.2,3\n", "'1.2.3' is not a number"),
        ("time,joint1.tau\n", "has no rows"),
        ("time,joint1.tau\n0,1\n1\n", ":3: 1 values"),
        ("time,joint1.tau\n0,x\n", ":2: column 'joint1.tau': 'x' is not a number"),
        ("time,joint1.tau\n0,1_000\n", ":2: column 'joint1.tau': '1_000' is not a number"),
        ("time,joint1.tau\n0,nan\n", "not a finite number"),
        ("time,joint1.tau\n1,0\n0,0\n", "csv:3: time decreases from 1 to 0 s"),
        ("time;joint1.tau\n0;1.234,5\n", "csv:2: column 'joint1.tau': '1.234,5' is not a number"),
        ("time,joint1.tau,joint1.tau\n0,0,0\n", "csv:1: duplicate column 'joint1.tau'"),
        ("time,joint1.taw\n0,0\n", "did you mean 'joint1.tau'"),
        ("t [s],joint1.tau [m]\n0,0\n", r"column 'joint1.tau \[m\]': the unit of 'joint1.tau' is N.m"),
        ("t [m],joint1.tau\n0,0\n", r"column 't \[m\]': the unit of 't' is s"),
    ],
)
def test_wrong_csv(tmp_path, text, sentence):
    file = tmp_path / "a.csv"
    file.write_text(text)
    with pytest.raises(UserError, match=sentence):
        simulate(FakeSession(), Settings(inputs=[str(file)]))


def test_written_csv_reads_back_exactly(tmp_path):
    result = simulate(FakeSession(), Settings(inputs=["joint1.tau=sin(t)"], outputs=["joint1.q", "joint1.qd", "solver.steps"]))
    write_csv(tmp_path / "a.csv", result)
    rows = list(csv.reader((tmp_path / "a.csv").open()))
    assert rows[0] == ["time", "joint1.q", "joint1.qd", "solver.steps"]
    numbers = np.array(rows[1:], float)
    np.testing.assert_array_equal(numbers[:, 0], result.time)
    np.testing.assert_array_equal(numbers[:, 1:], result.values)


def test_panels_use_display_units_and_leave_out_idle_torques():
    session = FakeSession()
    idle = panels(session, simulate(session, Settings()), asked=False)
    assert [(p.kind, p.unit) for p in idle] == [("q", "deg"), ("qd", "rad/s"), ("energy", "J")]
    session = FakeSession()
    driven = panels(session, simulate(session, Settings(inputs=["joint2.tau=1"])), asked=False)
    assert [p.kind for p in driven] == ["q", "qd", "tau", "energy"]
    assert [label for label, _ in driven[2].curves] == ["joint2"]
    assert driven[0].curves[1][1][-1] == pytest.approx(np.degrees(0.5))


def test_pictures_are_stable_and_in_the_asked_format(tmp_path):
    session = FakeSession()
    result = simulate(session, Settings(inputs=["joint1.tau=1"]))
    for name, start in (("a.png", b"\x89PNG"), ("a.svg", b"<?xml"), ("a.pdf", b"%PDF")):
        plot(tmp_path / name, session, result)
        assert (tmp_path / name).read_bytes().startswith(start)
    plot(tmp_path / "b.png", session, result)
    assert (tmp_path / "a.png").read_bytes() == (tmp_path / "b.png").read_bytes()
    with pytest.raises(UserError, match="must end in"):
        plot(tmp_path / "a.toml", session, result)


def test_asked_outputs_are_plotted_whatever_they_are(tmp_path):
    session = FakeSession()
    result = simulate(session, Settings(outputs=["solver.steps", "tip.position[1]"]))
    assert [p.kind for p in panels(session, result, asked=True)] == ["position", "steps"]
    plot(tmp_path / "a.png", session, result, ["solver.steps"])


@pytest.mark.parametrize("count", [12, 30])
def test_no_two_curves_look_the_same(count):
    with new_figure(4, 3) as figure:
        axes = figure.subplots()
        _draw(axes, Panel("q", "rad", [(str(k), np.zeros(2)) for k in range(count)]), np.array([0, 1]), True)
        assert len({(line.get_color(), line.get_linestyle()) for line in axes.lines}) == count


def test_values_that_overflow_still_plot(tmp_path):
    session = FakeSession()
    result = simulate(session, Settings())
    result.values[5:, 0] = np.nan
    result.values[6:, 1] = 1e300
    plot(tmp_path / "a.png", session, result)


def test_final_values_are_in_display_units():
    from rich.console import Console

    session = FakeSession()
    console = Console(width=100, record=True, file=SimpleNamespace(write=lambda _: None, flush=lambda: None))
    console.print(final_values(session, simulate(session, Settings(inputs=["joint1.tau=2"]))))
    row = next(line for line in console.export_text().splitlines() if "joint1.q " in line)
    assert "57.296" in row and "deg" in row


def test_an_unknown_column_of_a_run_is_one_sentence():
    with pytest.raises(UserError, match="unknown output 'foo'; available: joint1.q, joint1.tau, joint2.tau$"):
        simulate(FakeSession(), Settings(outputs=["joint1.q"]))["foo"]
    assert str(unknown("output", "foo", [])) == "unknown output 'foo'; none are available"


def test_an_fmu_without_inputs_says_so():
    with pytest.raises(UserError, match="unknown input 'a.tau': 'fake' has no inputs"):
        FakeSession().find("a.tau", "input", [])
