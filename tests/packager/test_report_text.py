"""What a report says and where a chosen tolerance is written, without any run."""

import math
from dataclasses import replace

import pytest

from build_fmu.driver import Outcome
from build_fmu.report.pages import Report, advice, duration
from build_fmu.report.reference import Reference
from build_fmu.report.sweep import Point, best, communication_steps
from build_fmu.report.target import with_rtol


def point(method, rtol, error, cost, changing=False, step=0.01, status="ok"):
    return Point(method, rtol, step, changing, Outcome(status), error, cost, 1.0)


POINTS = [point("erk", 1e-5, 2e-4, 3.0), point("erk", 1e-7, 5e-7, 9.0), point("adams", 1e-8, 8e-7, 7.25), point("bdf", 1e-9, 1e-10, 100.4),
          point("erk", 1e-7, 6e-7, 9.5, changing=True), point("adams", 1e-9, 1e-9, 1.0, step=0.1), point("bdf", 1e-3, math.nan, 0.1, status="error")]


def test_the_cheapest_that_is_good_enough_is_advised():
    report = Report("arm", "rad", 1.0, 0.01, "", Reference(None, None, 0.0, ""), POINTS, 1.0)
    assert advice(report) == [
        "for 1e-3 rad take erk at rtol 1e-7: 9.5 µs a ms (step 10 ms, inputs that change at each step; erk at rtol 1e-5: 3 µs a ms where they are held)",
        "for 1e-6 rad take erk at rtol 1e-7: 9.5 µs a ms (step 10 ms, inputs that change at each step; adams at rtol 1e-8: 7.2 µs a ms where they are held)",
        "for 1e-9 rad take bdf at rtol 1e-9: 100 µs a ms (step 10 ms, inputs held)"]


def test_an_accuracy_that_no_run_reached_is_said_so_and_why():
    points = [point("erk", 1e-3, 1e-3, 1.0), point("adams", 1e-3, 1e-4, 2.0), point("bdf", 1e-3, math.nan, 0.1, status="error")]
    report = Report("arm", "rad", 1.0, 0.01, "", Reference(None, None, 0.0, ""), points, 1.0)
    ended = replace(report, tightest=1e-9)
    assert advice(replace(report, tightest=1e-3))[-1] == "for 1e-9 rad no run of this sweep is good enough"
    assert advice(ended)[-1] == "for 1e-9 rad no run of this sweep is good enough; the time was up for 2 of its curves: give it more --seconds"


def test_of_equal_costs_a_method_is_named_before_auto():
    points = [point("auto", 1e-6, 1e-7, 1.0), point("erk", 1e-6, 1e-7, 1.03), point("adams", 1e-6, 1e-7, 1.3)]
    assert best(points, 1e-6, 0.01, False).method == "erk"
    assert best([points[0], points[2]], 1e-6, 0.01, False).method == "auto"


def test_a_run_that_failed_is_never_best():
    assert best(POINTS, 1.0, 0.01, False).method == "erk"
    assert best(POINTS, 1e-12, 0.01, False) is None


@pytest.mark.parametrize("stop, step, steps", [(1, 0.01, [0.001, 0.01, 0.1]), (0.2, 0.01, [0.001, 0.01]), (1e-3, 1e-2, [1e-3])])
def test_steps_around_the_usual_one(stop, step, steps):
    assert communication_steps(stop, step) == pytest.approx(steps)


@pytest.mark.parametrize("before, after", [
    ("[solver]\n  target_error = 1e-6 # rad\nmethod = 'erk'\n",
     "[solver]\n  target_error = 1e-6 # rad\n  rtol = 1e-08  # chosen for target_error\nmethod = 'erk'\n"),
    ("solver.target_error=1e-6", "solver.target_error=1e-6\nsolver.rtol = 1e-08  # chosen for target_error"),
    ("solver = {target_error = 1e-6, method = 'erk'}", "solver = {target_error = 1e-6, rtol = 1e-08, method = 'erk'}")])
def test_the_tolerance_is_written_beside_its_target(before, after):
    assert with_rtol(before, 1e-8) == after


def test_durations_read_well():
    assert [duration(t) for t in (2.0, 0.1, 0.01, 1e-4, 1e-5)] == ["2 s", "0.1 s", "10 ms", "0.1 ms", "10 µs"]
