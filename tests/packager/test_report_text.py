"""What a report says and where a chosen tolerance is written, without any run."""

import math
from dataclasses import replace

import pytest

from build_fmu.report import sweep as sweeping
from build_fmu.report.advise import best, curves
from build_fmu.report.html import write_html
from build_fmu.report.machine import busy
from build_fmu.report.motion import Positions
from build_fmu.report.pages import Report, advice, duration, write_pictures
from build_fmu.report.reference import Reference
from build_fmu.report.sweep import WORTH_SHARING, Point, communication_steps
from build_fmu.report.target import with_rtol
from build_fmu.run.driver import Outcome


def point(method, rtol, error, cost, changing=False, step=0.01, status="ok"):
    return Point(method, rtol, step, changing, Outcome(status), error, cost, 1.0, taken=0.1)


def report_of(points, tolerances, uncertainty=0.0, busy=""):
    return Report("arm", "rad", 1.0, 0.01, "", Reference(None, None, uncertainty, ""), points, 1.0, tolerances=tolerances, busy=busy)


WHOLE = [
    point("erk", 1e-5, 2e-4, 3.0),
    point("erk", 1e-7, 5e-7, 9.0),
    point("erk", 1e-9, 1e-8, 30.0),
    point("adams", 1e-5, 1e-3, 5.0),
    point("adams", 1e-7, 8e-7, 7.25),
    point("adams", 1e-9, 1e-7, 12.0),
    point("bdf", 1e-5, 1e-3, 50.0),
    point("bdf", 1e-7, 1e-6, 70.0),
    point("bdf", 1e-9, 1e-10, 100.4),
    point("erk", 1e-5, 2e-4, 3.5, changing=True),
    point("erk", 1e-7, 6e-7, 9.5, changing=True),
    point("erk", 1e-9, 2e-8, 31.0, changing=True),
    point("adams", 1e-9, 1e-9, 1.0, step=0.1),
]
LADDER = (1e-5, 1e-7, 1e-9)


def test_the_cheapest_that_is_good_enough_is_advised():
    assert advice(report_of(WHOLE, LADDER)) == [
        "for 1e-3 rad: erk at rtol 1e-5, 3.5 µs per ms (step size 10 ms, changing inputs; with constant inputs erk at rtol 1e-5, 3 µs per ms)",
        "for 1e-6 rad: erk at rtol 1e-7, 9.5 µs per ms (step size 10 ms, changing inputs; with constant inputs adams at rtol 1e-7, 7.2 µs per ms)",
        "for 1e-9 rad: bdf at rtol 1e-9, 100 µs per ms (step size 10 ms, constant inputs)",
    ]


def test_curves_continue_with_the_time_that_others_leave(monkeypatch):
    """Of two curves, one needs 0.01 s a run and the other 0.9 s; its share of 4 s, a half, ends in its third run."""
    clock = [0.0]

    def measure(fmu, where, reference, task, curve, ratio, plan, budget):
        needs = 0.01 if curve.method == "erk" else 0.9
        clock[0] += min(needs, budget)
        return point(curve.method, curve.missing[0], 1e-9, 1.0, status="ok" if needs <= budget else "budget")

    monkeypatch.setattr(sweeping, "measure", measure)
    monkeypatch.setattr(sweeping, "task_for", lambda *_: None)
    monkeypatch.setattr(sweeping, "_atol_ratio", lambda _: 0.01)
    monkeypatch.setattr(sweeping.time, "monotonic", lambda: clock[0])
    plan = sweeping.Plan(1.0, [0.01], ["bdf", "erk"], LADDER, (False,), seconds=4.0)
    points = list(sweeping.sweep(None, Positions(["a.q"], [], "rad"), lambda _: None, None, plan))
    assert [(p.method, p.rtol, p.outcome.status) for p in points if p.method == "bdf"] == [("bdf", rtol, "ok") for rtol in LADDER]
    assert len(points) == 6 and clock[0] < 4


def test_curves_that_were_cut_short_carry_no_advice_and_are_counted():
    first = [replace(point(method, 1e-3, 1e-10, 1.0), taken=2.0) for method in ("erk", "adams", "bdf")]
    lines = advice(report_of(first, (1e-3, *LADDER)))
    assert lines[:3] == [
        f"for {target} rad: no recommendation, because unfinished curves could contain a cheaper run" for target in ("1e-3", "1e-6", "1e-9")
    ]
    assert lines[3].startswith("3 of 3 curves reached the time limit; all of them need about --seconds ")
    # a run, then three that take 1.6 times as long each, on each of three curves, in the part of the time that is shared
    assert float(lines[3].split()[-1]) == pytest.approx(3 * 2 * (1 + 1.6 + 1.6**2 + 1.6**3) / (1 - WORTH_SHARING), rel=0.05)


def test_a_curve_that_was_cut_where_it_is_dearer_already_spoils_no_advice():
    dear = [
        point("erk", 1e-5, 1e-4, 3.0),
        point("erk", 1e-7, 1e-7, 9.0),
        point("erk", 1e-9, 1e-9, 20.0),
        replace(point("bdf", 1e-5, 1e-2, 50.0), taken=1.0),
    ]
    assert advice(report_of(dear, LADDER))[1].startswith("for 1e-6 rad: erk at rtol 1e-7")
    cheap = [*dear[:3], replace(point("bdf", 1e-5, 1e-2, 5.0), taken=1.0)]
    assert "no recommendation" in advice(report_of(cheap, LADDER))[1]


def test_a_lucky_run_is_not_advised():
    lucky = [point("erk", 1e-5, 1e-7, 3.0), point("erk", 1e-7, 2e-6, 9.0), point("erk", 1e-9, 1e-9, 20.0)]
    assert "erk at rtol 1e-9" in advice(report_of(lucky, LADDER))[1]


def test_an_accuracy_beyond_the_reference_gets_no_advice():
    assert (
        advice(report_of(WHOLE, LADDER, uncertainty=3e-9))[2]
        == "for 1e-9 rad: no recommendation, because the uncertainty of the reference is 3e-09 rad"
    )


def test_an_accuracy_that_no_run_reached_is_said_so():
    points = [point("erk", 1e-3, 1e-3, 1.0), point("bdf", 1e-3, math.nan, 0.1, status="error")]
    assert advice(report_of(points, (1e-3,)))[-1] == "for 1e-9 rad: no run with a step size of 10 ms meets the target"


def test_a_busy_machine_is_named_next_to_the_advice():
    assert busy(0.2, 1.1) == "" and "busy machine: other programs had a load of 50.0" in busy(0.1, 51.0)
    assert advice(report_of(WHOLE, LADDER, busy="busy machine"))[-1] == "busy machine"


def test_of_equal_costs_a_method_is_named_before_auto():
    points = [point("auto", 1e-6, 1e-7, 1.0), point("erk", 1e-6, 1e-7, 1.03), point("adams", 1e-6, 1e-7, 1.3)]
    assert best(curves(points, [1e-6]), 1e-6).method == "erk"
    assert best(curves([points[0], points[2]], [1e-6]), 1e-6).method == "auto"


def test_a_run_that_failed_is_never_best():
    failed = [point("bdf", 1e-3, math.nan, 0.1, status="error"), point("erk", 1e-3, 1e-4, 1.0)]
    assert best(curves(failed, [1e-3]), 1e-3).method == "erk" and best(curves(failed, [1e-3]), 1e-12) is None


def test_the_html_page_holds_advice_picture_and_every_run(tmp_path):
    report = report_of([point("erk", 1e-5, 2e-4, 3.0), point("a<b", 1e-5, 2e-4, 3.0)], (1e-5, 1e-7))
    write_pictures([tmp_path / "a.svg"], report)
    write_html(tmp_path / "a.html", report, tmp_path / "a.svg")
    text = (tmp_path / "a.html").read_text()
    assert all(f"<li>{line}</li>" in text for line in advice(report)) and "unfinished" in text
    assert text.count("<svg") == 1 and "<?xml" not in text and "a&lt;b" in text and "<td>a<b" not in text
    assert text.count("<tr>") == 1 + len(report.points)


@pytest.mark.parametrize("stop, step, steps", [(1, 0.01, [0.001, 0.01, 0.1]), (0.2, 0.01, [0.001, 0.01]), (1e-3, 1e-2, [1e-3])])
def test_steps_around_the_usual_one(stop, step, steps):
    assert communication_steps(stop, step) == pytest.approx(steps)


@pytest.mark.parametrize(
    "before, after",
    [
        (
            "[solver]\ntarget_error = 1e-6 # rad\nmethod = 'erk'\n\n[fmu]\n",
            "[solver]\ntarget_error = 1e-6 # rad\nmethod = 'erk'\nrtol = 1e-08 # chosen for target_error\n\n[fmu]\n",
        ),
        ("solver.target_error=1e-6\nname='a'\n", "solver.target_error=1e-6\nsolver.rtol = 1e-08 # chosen for target_error\nname='a'\n"),
        ("solver = {target_error = 1e-6, method = 'erk'}\n", "solver = {target_error = 1e-6, method = 'erk', rtol = 1e-08}\n"),
    ],
)
def test_the_tolerance_is_written_beside_its_target(before, after):
    assert with_rtol(before, 1e-8) == after


def test_durations_read_well():
    assert [duration(t) for t in (2.0, 0.1, 0.01, 1e-4, 1e-5)] == ["2 s", "0.1 s", "10 ms", "0.1 ms", "10 µs"]


def test_a_report_without_a_finished_run_has_an_empty_picture(tmp_path):
    write_pictures([tmp_path / "a.png"], report_of([point("erk", 1e-4, math.nan, math.nan)], (1e-4,)))
    assert (tmp_path / "a.png").stat().st_size > 1000
