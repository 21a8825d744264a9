"""`build-fmu stress` on the compiled library: cases finish, fail or run out of time as they should."""

from __future__ import annotations

import csv
import os
import subprocess
import sys
import tomllib
from dataclasses import replace

import pytest

from build_fmu.stress.cases import Case, catalogue
from build_fmu.stress.pool import work_of
from build_fmu.stress.run import run_case
from tests.fmi.conftest import ROOT


def cases(name: str) -> dict[str, Case]:
    model = tomllib.loads((ROOT / "models" / f"{name}.toml").read_text())
    return {f"{case.group}, {case.label}": case for case in catalogue(model, 1.0, 0.01)}


def test_a_closed_loop_far_from_the_origin_stays_closed(fmu_file):
    verdict = run_case("four_bar", cases("four_bar")["far away, 1e+03 m"], 30, None)
    assert verdict.kind == "finished" and verdict.gap < 1e-9 and verdict.balance < 1e-6
    assert verdict.error < 1e-4 and verdict.steps > 10


# the parallelogram starts flat, where its branches meet, and passes flat positions
@pytest.mark.parametrize("case", ["near-massless links, x 1e-06", "far away, 1e+09 m", "fast, first joint", "fast, last joint"])
def test_extremes_of_a_loop_that_starts_in_a_singular_pose(fmu_file, case):
    verdict = run_case("parallelogram", cases("parallelogram")[case], 30, None)
    assert verdict.kind == "finished" and verdict.balance < 1e-6 and verdict.gap < 1e-12


@pytest.mark.parametrize("method", ["erk", "adams", "dirk", "bdf", "exponential", "auto"])
def test_a_link_of_next_to_no_mass_leaves_its_loop_closed(fmu_file, method):
    # near flat positions one row fades while the other is a billion times as stiff
    verdict = run_case("parallelogram", cases("parallelogram")["near-massless links, x 1e-09"], 30, method)
    assert verdict.kind == "finished" and verdict.balance < 1e-7 and verdict.gap < 1e-12


def test_a_motion_below_the_absolute_tolerance_is_judged_with_a_finer_one(fmu_file):
    case = cases("pendulum")["stiff springs, 1e+08"]
    coarse = replace(case, model={**case.model, "solver": {**case.model["solver"], "atol": 1e-9}})
    verdict = run_case("pendulum", coarse, 30, None)
    assert verdict.kind == "finished" and verdict.balance > 1e-5 and "with an absolute tolerance of 1e-09" in verdict.message


def test_torques_switch_at_1_khz(fmu_file):
    case = cases("kuka_kr5")["switching torques, 1 kHz"]
    assert set(case.torques) == {f"joint{i}" for i in range(1, 7)}
    verdict = run_case("kuka_kr5", case, 30, "erk")
    still = run_case("kuka_kr5", replace(case, torques={}), 30, "erk")
    assert verdict.kind == still.kind == "finished" and verdict.error < 1e-5
    assert verdict.balance != still.balance


def test_what_the_reader_refuses_is_told(fmu_file):
    case = cases("pendulum")["tolerance, rtol 1e-03"]
    case.model["link"][0]["mass"] = -1
    verdict = run_case("pendulum", case, 30, None)
    assert verdict.kind == "refused" and "mass must be >= 0" in verdict.message and "/tmp" not in verdict.message


def test_time_is_up(fmu_file):
    case = replace(cases("pendulum")["tolerance, rtol 1e-03"], stop=1e5, step=1e-5)
    verdict = run_case("pendulum", case, 0.2, "erk")
    assert verdict.kind == "slow" and 0 < verdict.reached < 1e5


LANDING = """
name = "landing"
[[link]]
name = "ball"
joint = "free"
drive = "free"
mass = 1
inertia = [0.004, 0.004, 0.004]
q = [0, 0, 0.15, 0, 0, 0]
[[contact]]
name = "hills"
link_a = "ball"
shape_a = "sphere"
radius_a = 0.1
shape_b = "heightmap"
file = "hills.csv"
spacing = 0.2
point_b = [-0.2, -0.2, 0]
stiffness = 1e4
[fmu]
stop_time = 0.3
step_size = 0.01
"""


def test_a_model_with_a_table_beside_it_lands_on_a_hundred_contacts(fmu_file, tmp_path):
    (tmp_path / "hills.csv").write_text("0, 0, 0\n0, 0.01, 0\n0, 0, 0.02\n")
    (tmp_path / "landing.toml").write_text(LANDING)
    ((name, case),) = work_of([tmp_path / "landing.toml"], ["many"])
    assert len(case.model["contact"]) == 100
    verdict = run_case(name, case, 30, None)
    assert verdict.kind == "finished" and verdict.balance < 1e-4 and verdict.error < 1e-5


def test_the_command_leaves_a_page(fmu_file, tmp_path):
    models = [str(ROOT / "models" / f"{name}.toml") for name in ("pendulum", "top")]
    command = [sys.executable, "-m", "build_fmu", "stress", *models, "--only", "singular", "near", "-o", str(tmp_path)]
    done = subprocess.run(command, cwd=tmp_path, capture_output=True, text=True, env={**os.environ, "PYTHONPATH": str(ROOT)})
    assert done.returncode == 0, done.stdout + done.stderr
    assert sorted(p.name for p in tmp_path.iterdir()) == ["stress.csv", "stress.html", "stress.md", "stress.png", "stress.svg"]
    rows = list(csv.DictReader((tmp_path / "stress.csv").open()))
    assert {row["group"] for row in rows} == {"singular start", "near-massless links"} and len(rows) == 8
    assert all(row["verdict"] == "finished" for row in rows)
