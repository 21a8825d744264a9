"""IFToMM multibody benchmarks A01 to A05, a slider-crank and a Stewart platform, against closed forms, equations derived by hand and published values."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

from bench import benchmark_references as references
from build_fmu import load
from build_fmu.run.session import Session
from build_fmu.run.simulate import Settings, simulate

ROOT = Path(__file__).resolve().parents[2]
TIGHT = ["solver.rtol=1e-11", "solver.atol=1e-13"]
# all angles of the squeezer after 0.03 s, problem Andrews of the Test Set for IVP Solvers
ANGLES = {
    "beta": 15.81077119629904,
    "Theta": -15.75637105984298,
    "gamma": 0.04082224013073101,
    "Phi": -0.5347301163226948,
    "delta": 0.5244099658805304,
    "Omega": 0.5347301163226948,
    "epsilon": 1.048080741042263,
}
RUNS = {
    "pendulum": ("pivot.q", 10, references.pendulum, 5e-8),
    "iftomm_four_bars": ("rod0.q", 10, references.four_bars(40), 2e-6),
    "iftomm_bricard": ("joint1.q", 10, references.bricard, 2e-8),
    "iftomm_governor": ("lift.q", 10, references.governor, 3e-8),
    "slider_crank": ("crank_joint.q", 3, references.slider_crank, 1e-7),
}


@pytest.mark.parametrize("name", RUNS)
def test_motion(fmu_file, name):
    """At the tolerance of the model file."""
    variable, stop, reference, bound = RUNS[name]
    with Session(fmu_file(name)) as session:
        run = simulate(session, Settings(stop, 0.01, outputs=[variable]))
    error = np.abs(run[variable] - reference(run.time))
    assert np.isfinite(error).sum() >= 10 and np.nanmax(error) < bound


def test_squeezer(fmu_file):
    with Session(fmu_file("iftomm_squeezer")) as session:
        run = simulate(session, Settings(0.03, 0.0003, start=TIGHT, inputs=["beta.tau=0.033"]))
    assert run["beta.q"][-1] == pytest.approx(references.SQUEEZER[0.03], abs=1e-8)
    assert [run[f"{name}.q"][-1] for name in ANGLES] == pytest.approx(list(ANGLES.values()), abs=1e-8)
    assert np.abs(run["energy.balance"]).max() < 1e-9


def test_the_bars_never_part(fmu_file):
    """A configuration in which forty more degrees of freedom appear is passed seven times."""
    with Session(fmu_file("iftomm_four_bars")) as session:
        run = simulate(session, Settings(10, 0.01, outputs=["rod*.q", "pin*.gap", "energy.balance"]))
    angles = np.array([run[f"rod{k}.q"] for k in range(41)])
    assert np.abs(angles - angles[0]).max() < 1e-9
    assert max(run[f"pin{k}.gap"].max() for k in range(1, 41)) < 1e-10 and np.abs(run["energy.balance"]).max() < 1e-4
    flat = np.abs(np.diff(np.sign(np.sin(angles[0])))) > 0
    assert flat.sum() >= 5


@pytest.mark.parametrize(("name", "arguments"), [("iftomm_four_bars", ["40"]), ("stewart_platform", [])])
def test_the_generator_writes_the_model(name, arguments):
    command = [sys.executable, ROOT / "models" / f"generate_{name}.py", *arguments]
    written = subprocess.run(command, capture_output=True, text=True, check=True)
    assert written.stdout == (ROOT / "models" / f"{name}.toml").read_text(encoding="utf-8")


def test_forces_of_the_stewart_platform():
    """Piston motions in, forces out; the platform and the passive joints follow by the loops."""
    rows = np.array([references.stewart_forces(references.stewart_motion(t)) for t in np.linspace(0, 1, 41)])
    length, rate, acceleration, force = rows.transpose(1, 0, 2)
    found = load(ROOT / "models" / "stewart_platform.toml").inverse(length, rate, acceleration)
    assert np.ptp(force) > 80 and np.ptp(length) > 0.1
    assert np.abs(found - force).max() < 1e-11
