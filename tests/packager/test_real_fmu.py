"""From a model file to a plot with the compiled library, by the command line. Skipped where nothing is built."""

import csv
import os
import subprocess
import sys
import zipfile
from pathlib import Path

import pytest

from build_fmu import native
from build_fmu.errors import UserError

ROOT = Path(__file__).parents[2]
PENDULUM = ROOT / "models" / "pendulum.toml"


def built() -> bool:
    try:
        return bool(native.describe_program() and native.library())
    except UserError:
        return False


pytestmark = pytest.mark.skipif(not built(), reason="the library is not built: run `make build`")


def run(*arguments, cwd):
    command = [sys.executable, "-m", "build_fmu", *map(str, arguments)]
    environment = {**os.environ, "PYTHONPATH": str(ROOT)}
    return subprocess.run(command, cwd=cwd, env=environment, capture_output=True, text=True, stdin=subprocess.DEVNULL, check=False)


@pytest.fixture
def folder(tmp_path):
    path = tmp_path / "ü %20 space"
    path.mkdir()
    return path


def test_the_whole_way(folder):
    assert run("build", PENDULUM, cwd=folder).returncode == 0
    (folder / "a.csv").write_text("time,rod.q\n0,0\n")  # an older record, which may go
    done = run("simulate", "pendulum.fmu", "--stop", 0.5, "--csv", "a.csv", "--plot", "a.png", cwd=folder)
    assert (done.returncode, done.stderr) == (0, "")
    rows = list(csv.reader((folder / "a.csv").open()))
    assert rows[0][0] == "time" and float(rows[-1][0]) == 0.5
    assert sorted(p.name for p in folder.iterdir()) == ["a.csv", "a.png", "pendulum.fmu"]


@pytest.mark.parametrize("model", sorted((ROOT / "models").glob("*.toml")), ids=lambda path: path.stem)
def test_every_model_is_valid_and_byte_stable(model, folder):
    from fmpy.validation import validate_fmu

    for name in ("a.fmu", "b.fmu"):
        done = run("build", model, "-o", name, cwd=folder)
        assert done.returncode == 0, done.stderr
    assert (folder / "a.fmu").read_bytes() == (folder / "b.fmu").read_bytes()
    assert validate_fmu(str(folder / "a.fmu")) == []


def test_a_model_runs_without_leaving_anything(folder):
    done = run("simulate", PENDULUM, "--stop", 0.1, cwd=folder)
    assert done.returncode == 0 and "energy.total" in done.stdout
    assert list(folder.iterdir()) == []


def test_the_functions_of_fmpy_accept_the_fmu(folder):
    from fmpy import simulate_fmu

    assert run("build", PENDULUM, cwd=folder).returncode == 0
    result = simulate_fmu(str(folder / "pendulum.fmu"), stop_time=0.2)
    assert result["time"][-1] == pytest.approx(0.2)


def test_a_wrong_name_gets_a_suggestion(folder):
    run("build", PENDULUM, cwd=folder)
    with zipfile.ZipFile(folder / "pendulum.fmu") as file:
        assert b".tau" in file.read("modelDescription.xml")
    done = run("simulate", "pendulum.fmu", "--start", "solver.rtool=1e-9", cwd=folder)
    assert done.returncode == 1 and "did you mean 'solver.rtol'" in done.stderr


def test_a_refused_value_gives_the_fmus_own_sentence(folder):
    done = run("simulate", PENDULUM, "--start", "solver.rtol=-1", cwd=folder)
    assert done.returncode == 1 and "Traceback" not in done.stderr
    assert "solver.rtol" in done.stderr and len(done.stderr.strip().splitlines()) == 1
