"""The quadruped stands and trots: forces, depth, slip, and the motion of its trunk."""

from __future__ import annotations

import subprocess
import sys

import numpy as np
import pytest

from build_fmu.run.session import Session
from build_fmu.run.simulate import Settings, simulate
from tests.fmi.conftest import ROOT, build_fmu

FEET = tuple(f"{end}_{side}_foot" for end in ("front", "hind") for side in ("left", "right"))
MASS, FRICTION, VELOCITY = 2.5, 0.7, 1e-3  # kg, -, m/s


@pytest.fixture(scope="module")
def run(tmp_path_factory):
    """The first 2 s: stands until 0.5 s, then trots."""
    fmu = build_fmu(ROOT / "models" / "quadruped.toml", tmp_path_factory.mktemp("quadruped") / "quadruped.fmu")
    with Session(fmu) as session:
        return simulate(session, Settings(stop=2.0))


def at_feet(run, group):
    return np.array([run[f"{foot}.{group}"] for foot in FEET])


def test_it_stands_without_slip(run):
    still = (run.time > 0.35) & (run.time < 0.5)
    force = np.array([[run[f"{foot}.force[{k}]"] for k in (1, 2, 3)] for foot in FEET])[:, :, still]
    assert force.sum(axis=0)[2] == pytest.approx(9.81 * MASS, rel=2e-3)
    # creep velocity of the friction law for the tangential force of each foot
    share = np.hypot(force[:, 0], force[:, 1]) / (FRICTION * force[:, 2])
    slip = at_feet(run, "slip")[:, still]
    assert slip.max() < VELOCITY and np.abs(slip - VELOCITY / 4 * np.arctanh(share)).max() < 1e-6
    # each foot carries a quarter of the weight at a stiffness of 3e4 N/m above half a width of 1e-4 m
    assert at_feet(run, "depth")[:, still] == pytest.approx(9.81 * MASS / 4 / 3e4 + 0.5e-4, rel=0.1)


def test_it_trots(run):
    depth = at_feet(run, "depth")
    assert depth.max() < 2e-3
    # both diagonals are lifted in turn, by at least half of the swing height
    assert (-depth).max(axis=1).min() > 0.015
    w, x, y, z = (run[f"trunk.quaternion[{k}]"] for k in (1, 2, 3, 4))
    assert np.degrees(np.arccos(1 - 2 * (x * x + y * y))).max() < 5
    assert 0.24 < run["trunk[3].q"].min() and run["trunk[3].q"].max() < 0.26
    assert run["trunk[1].q"][-1] > 0.25 and abs(run["trunk[2].q"][-1]) < 0.02
    energy = np.abs(run["energy.work"]).max()
    assert np.abs(run["energy.balance"]).max() < 100 * 1e-4 * energy


@pytest.mark.parametrize(("what", "file"), [("model", "quadruped.toml"), ("gait", "quadruped_trot.csv")])
def test_the_files_are_those_of_the_generator(what, file):
    script = ROOT / "models" / "generate_quadruped.py"
    printed = subprocess.run([sys.executable, str(script), what], capture_output=True, text=True, check=True).stdout
    assert printed == (ROOT / "models" / file).read_text(encoding="utf-8")
