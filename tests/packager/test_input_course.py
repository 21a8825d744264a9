"""Inputs that are functions of time: parts end at jumps, cubics stay within the bound that is reported, nothing between two points is missed."""

import math

import numpy as np
import pytest

from build_fmu.errors import UserError
from build_fmu.run.branches import Split
from build_fmu.run.expressions import compile_expression
from build_fmu.run.input_course import Course
from build_fmu.run.signals import Table
from build_fmu.run.simulate import Settings, simulate
from tests.packager.fake_session import FakeSession

TIMES = [0.1 * k for k in range(11)]


def course(text, times=TIMES, tolerance=1e-6):
    return Course({"a.tau": compile_expression(text)}, times, tolerance, "expressions", ["a.tau"])


def parts_of(found):
    return [part for parts in found.steps() for part in parts]


@pytest.mark.parametrize(
    ("text", "t", "derivatives"),
    [
        ("exp(-2*t)*3", 0.3, [3 * (-2) ** k * math.exp(-0.6) for k in range(5)]),
        ("sin(5*t)", 0.7, [math.sin(3.5), 5 * math.cos(3.5), -25 * math.sin(3.5), -125 * math.cos(3.5), 625 * math.sin(3.5)]),
        ("1/(1+t)", 1.0, [1 / 2, -1 / 4, 2 / 8, -6 / 16, 24 / 32]),
        ("sqrt(t)", 4.0, [2, 1 / 4, -1 / 32, 3 / 256, -15 / 2048]),
        ("t**3 - t**-1", 2.0, [7.5, 12.25, 11.75, 6 + 6 / 16, -24 / 32]),
        ("2**t", 1.0, [2 * math.log(2) ** k for k in range(5)]),
        ("tan(t)", math.pi / 4, [1, 2, 4, 16, 80]),
        ("(cos(t)**2 + sin(t)**2)*t", 0.4, [0.4, 1, 0, 0, 0]),
        ("abs(-t) + max(t, 1 - t) + floor(t + 0.5)", 0.75, [2.5, 2, 0, 0, 0]),
    ],
)
def test_derivatives_are_those_of_the_closed_form(text, t, derivatives):
    series = compile_expression(text).series(t, t, 4)
    found = [math.factorial(k) * (series[k][0] if k < len(series) else 0.0) for k in range(5)]
    assert found == pytest.approx(derivatives, rel=1e-13, abs=1e-13)


@pytest.mark.parametrize("text", ["sin(5*t)*exp(t)", "1/(1.2+t)**2", "t**2.5 - sqrt(1 + t)", "tan(t)/2", "cos(40*t)**3", "abs(t - 3)"])
def test_a_range_holds_all_its_points(text):
    expression = compile_expression(text)
    for low, high in ((0.1, 0.2), (0.3, 0.9)):
        try:
            bounds = expression.series(low, high, 4)
        except Split:
            continue
        for t in np.linspace(low, high, 50).tolist():
            for (least, most), (value, _) in zip(bounds, expression.series(t, t, 4), strict=False):
                assert least - 1e-12 * abs(least) <= value <= most + 1e-12 * abs(most)


@pytest.mark.parametrize(
    "text",
    ["sign(sin(2*pi*37*t))", "3 if 8*t - floor(8*t) < 0.5 else -3", "max(0, sin(20*t))", "abs(t - 0.3)*5", "exp(-((t - 0.517)/2e-3)**2)", "sin(200*t)",
     "sqrt(t)", "sqrt(abs(t - 0.55))", "t*sign(t - 0.25) if t < 0.5 or t >= 0.8 else cos(t)", "min(t, 0.5, 1 - t)", "floor(10*t)/10", "floor(-3*t**2)",
     "1 if not t <= 0.7 else 0", "2 if t == 0.35 else 1", "sin(1/(t + 0.01))", "sign(max(0, t - 0.5))", "1 if 0.2 <= t < 0.2001 else 0", "7", "t"],
)  # fmt: skip
def test_what_is_set_is_the_expression_within_the_reported_error(text):
    expression, found = compile_expression(text), course(text)
    parts = parts_of(found)
    assert parts[0].begin == 0 and parts[-1].end == TIMES[-1]
    assert all(first.end == second.begin for first, second in zip(parts, parts[1:], strict=False))
    assert set(TIMES) <= {part.begin for part in parts} | {TIMES[-1]}
    worst, bound = 0.0, found.moving[0].worst
    for part in parts:
        size = part.end - part.begin
        for s in np.linspace(0.003, 0.997, 23) * size:
            derivatives = [part.values["a.tau"], *part.slopes.get("a.tau", ())]
            worst = max(
                worst, abs(sum(d * s**k / math.factorial(k) for k, d in enumerate(derivatives)) - expression(float(part.begin + s)))
            )
    assert worst <= bound + 1e-13 and bound <= (3e-5 if "sqrt" in text else 3e-6)


def test_steps_end_at_jumps_and_nowhere_else():
    ends = [part.end for part in parts_of(course("20*sign(sin(2*pi*1000*t))", [0.0, 0.01, 0.02]))]
    assert ends == pytest.approx([0.0005 * k for k in range(1, 41)], abs=1e-14)
    ends = [part.end for part in parts_of(course("1 if t < 0.3 else 2"))]
    assert ends == TIMES[1:]  # 0.3 is a communication point but for rounding
    assert len(parts_of(course("sin(t)", tolerance=1e-4))) == 10


def test_a_smooth_signal_costs_nothing_to_look_at_in_many_steps():
    expression, looked = compile_expression("sin(t)"), []
    series = expression.series
    expression.series = lambda *arguments: looked.append(1) or series(*arguments)
    assert len(parts_of(Course({"a.tau": expression}, np.linspace(0, 1, 1001).tolist(), 1e-6, "expressions", ["a.tau"]))) == 1000
    assert len(looked) < 10


@pytest.mark.parametrize(
    ("text", "speed"),
    [
        ("sign(sin(2*pi*7.25*t))", 0.25 / 7.25),  # of 7 whole waves nothing is left
        ("1000*exp(-((t - 0.5013)/1e-3)**2)", math.sqrt(math.pi)),
        ("cos(30*t)", math.sin(30) / 30),
        ("1e4 if 0.51234 < t <= 0.51235 else 0", 0.1),
    ],
)
def test_the_plant_feels_what_happens_between_communication_points(text, speed):
    result = simulate(FakeSession(), Settings(inputs=[f"joint1.tau={text}"]))
    assert result["joint1.qd"][-1] == pytest.approx(speed, abs=1e-8)


def test_a_remark_says_how_well_inputs_were_followed():
    assert simulate(FakeSession(), Settings(inputs=["joint1.tau=3"])).remarks == []
    assert simulate(FakeSession(), Settings(inputs=["joint1.tau=t"])).remarks == [
        "inputs: approximated exactly by cubic polynomials over 10 intervals"
    ]
    (line,) = simulate(FakeSession(), Settings(inputs=["joint1.tau=sin(9*t)"])).remarks
    assert line.startswith("inputs: approximated with an error of at most ") and "N.m (input 'joint1.tau') by cubic" in line


@pytest.mark.parametrize(
    ("text", "sentence"),
    [
        ("sin(1e9*t)", "changes too fast in the step from t = 0 s"),
        ("sign(sin(1/t)) if t > 0 else 0", "changes too fast in the step from t = 0 s"),
        ("1/(t - 0.512345)", "(is unbounded near|has no value at) t = 0.51234"),
        ("1/(t - 0.5)", "has no (bound near|value at) t = 0.5"),
    ],
)
def test_inputs_that_nothing_can_follow(text, sentence):
    with pytest.raises(UserError, match=f"input 'joint1.tau'.*{sentence}"):
        simulate(FakeSession(), Settings(inputs=[f"joint1.tau={text}"]))


def test_tables_hold_unless_they_are_to_be_followed(tmp_path):
    file = tmp_path / "a.csv"
    file.write_text("time,joint1.tau\n0,0\n0.13,2\n0.13,-1\n0.77,3\n2,3\n")
    exact = 0.13 + (0.77 - 0.13) * 1 + 3 * 0.23
    result = simulate(FakeSession(), Settings(inputs=[str(file)], interpolate="all"))
    assert result["joint1.qd"][-1] == pytest.approx(exact, abs=1e-12)
    assert result.remarks == ["inputs: approximated exactly by cubic polynomials over 12 intervals"]
    held = simulate(FakeSession(), Settings(inputs=[str(file)]))
    assert held["joint1.qd"][-1] == pytest.approx(0.1 * sum(held["joint1.tau"][:-1]), abs=1e-12)
    assert held.remarks == [
        "inputs: 'joint1.tau' is constant during each step, up to 2.5 N.m off the table; `--interpolate all` interpolates"
    ]


@pytest.mark.parametrize(
    ("times", "values", "off"),
    [([0, 0.2, 0.2, 3], [1, 1, 7, 7], None), ([0, 0.25, 0.25, 3], [1, 1, 7, 7], "6"), ([0, 0.2, 0.2, 1], [0, 2, 7, 7], "1")],
)
def test_a_jump_at_a_communication_point_is_followed(times, values, off):
    remarks = Course({"a.tau": Table(times, values)}, TIMES, 1e-9, "expressions", ["a.tau"]).remarks({"a.tau": "N.m"})
    assert [f"up to {off} N.m off the table" in remark for remark in remarks] == [True] * (off is not None)


@pytest.mark.parametrize(("first", "last", "told"), [(0, 0.9, False), (0, 0.8, True), (0.05, 1, True), (7, 8, True)])
def test_a_table_that_does_not_contain_the_run_is_told(first, last, told):
    rows = Course({"a.tau": Table([first, last], [1, 2]), "b.tau": Table([first, last], [0, 1])}, TIMES, 1e-9, "all", ["a.tau", "b.tau"])
    sentence = (
        f"inputs: the table of 'a.tau' and 1 more covers {first:g} to {last:g} s of a run from 0 to 1 s; outside, the nearest row holds"
    )
    assert rows.remarks({"a.tau": "N.m", "b.tau": "N.m"})[:1] == [sentence][:told]


def test_a_motion_is_completed_by_its_derivatives():
    names = ["a.q", "a.qd", "a.qdd"]
    found = Course({"a.q": compile_expression("sin(3*t)")}, TIMES, 1e-9, "expressions", names)
    now = found.at(0.4)
    assert list(now) == names
    assert list(now.values()) == pytest.approx([math.sin(1.2), 3 * math.cos(1.2), -9 * math.sin(1.2)], rel=1e-13)
    for part in parts_of(found):
        assert set(part.slopes) == {"a.qdd"}
        assert part.slopes["a.qdd"][0] == pytest.approx(-27 * math.cos(3 * part.begin), rel=1e-3, abs=1e-2)
    rate_only = Course({"a.qd": Table([0, 1, 3], [0, 2, 2])}, TIMES, 1e-9, "all", names)
    assert rate_only.at(0.5) == {"a.qd": 1.0, "a.qdd": 2.0}


def test_a_held_motion_consists_of_its_derivatives_at_each_step_too():
    names = ["a.q", "a.qd", "a.qdd"]
    for part in parts_of(Course({"a.q": compile_expression("sin(3*t)")}, TIMES, 1e-9, "none", names)):
        t = 3 * part.begin
        assert not part.slopes
        assert [part.values[name] for name in names] == pytest.approx([math.sin(t), 3 * math.cos(t), -9 * math.sin(t)], abs=1e-13)
    table = {"a.q": Table([0, 1], [0, 2])}
    assert Course(table, TIMES, 1e-9, "expressions", names).at(0.5) == Course(table, TIMES, 1e-9, "none", names).at(0.5) == {"a.q": 1.0}


@pytest.mark.parametrize("mode", ["none", "expressions", "all"])
def test_given_parts_of_a_motion_are_kept(mode):
    signals = {"a.q": compile_expression("t**3"), "a.qd": Table([0, 1], [0, 7])}
    found = Course(signals, TIMES, 1e-9, mode, ["a.q", "a.qd", "a.qdd"])
    assert found.at(0.5) == pytest.approx({"a.q": 0.125, "a.qd": 3.5, "a.qdd": 7.0 if mode == "all" else 3.0})
    held = Course(signals | {"a.qdd": Table([0, 1], [0, 4])}, TIMES, 1e-9, mode, ["a.q", "a.qd", "a.qdd"])
    assert held.at(0.5) == pytest.approx({"a.q": 0.125, "a.qd": 3.5, "a.qdd": 2.0})
    assert {name for part in parts_of(held) for name in part.slopes} == ({"a.qdd"} if mode == "all" else set())
