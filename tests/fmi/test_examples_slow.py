"""Examples that need more packages: the sweep over Dask, also when a worker is lost, the notebook, and the system of FMUs."""

import importlib.util
import itertools
import json
import re
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from fmpy import simulate_fmu

from tests.command_line import command
from tests.fmi.test_examples import EXAMPLES, ROOT

pytestmark = pytest.mark.slow


def test_a_sweep_ends_in_a_table(tmp_path):
    parquet = pytest.importorskip("pyarrow.parquet")
    pytest.importorskip("dask.distributed")
    command = [
        sys.executable,
        str(EXAMPLES / "sweep.py"),
        str(ROOT / "models" / "double_pendulum.toml"),
        "--vary",
        "shoulder.q0=0:1:3",
        "--vary",
        "elbow.damping=0,1,-1",
        "--output",
        "elbow.q",
        "energy.*",
        "--stop",
        "0.5",
        "--workers",
        "2",
        "-o",
        "sweep.parquet",
    ]
    done = subprocess.run(command, cwd=tmp_path, capture_output=True, text=True, stdin=subprocess.DEVNULL, timeout=500)
    assert done.returncode == 0, done.stderr
    assert "9 of 9 runs" in done.stdout and "9 runs, 3 failed, the first: " in done.stdout
    rows = parquet.read_table(tmp_path / "sweep.parquet").to_pylist()
    assert [(row["shoulder.q0"], row["elbow.damping"]) for row in rows] == list(itertools.product([0, 0.5, 1], [0, 1, -1]))
    for row in rows:
        if row["elbow.damping"] < 0:
            assert "elbow.damping" in row["error"] and row["elbow.q end"] is None
        else:
            assert row["error"] == "" and abs(row["energy.balance end"]) < 1e-4
            # dampers take energy, and nothing else does
            assert (row["energy.work end"] < -1e-6) == (row["elbow.damping"] > 0)


SLOWED = """
import os, sys, time
sys.path.insert(0, {examples!r})
import sweep

def slow_run(fmu, point, stop, outputs, real=sweep.one_run):
    time.sleep(0.2)
    return real(fmu, point, stop, outputs)

if __name__ == "__main__":
    from pathlib import Path
    from dask.distributed import Client, LocalCluster
    sweep.one_run = slow_run
    with LocalCluster(n_workers=2, threads_per_worker=1, dashboard_address=None) as cluster, Client(cluster) as client:
        victim = [worker["pid"] for worker in client.run(lambda: {{"pid": os.getpid()}}).values()][0]
        told = []
        def tell(line):
            told.append(line)
            if len(told) == 1:
                os.kill(victim, 9)
        points = [{{"shoulder.q0": 0.1 * k}} for k in range(20)]
        rows = sweep.sweep(client, sweep.packed(Path({model!r})), points, 0.2, ["shoulder.q"], tell)
    assert [row["shoulder.q0"] for row in rows] == [point["shoulder.q0"] for point in points]
    assert all(row["error"] == "" for row in rows), rows
    print("all runs are there")
"""


def test_a_lost_worker_costs_time_and_no_run(tmp_path):
    pytest.importorskip("dask.distributed")
    program = tmp_path / "lose.py"
    program.write_text(SLOWED.format(examples=str(EXAMPLES), model=str(ROOT / "models" / "double_pendulum.toml")))
    done = subprocess.run(
        [sys.executable, str(program)], cwd=tmp_path, capture_output=True, text=True, stdin=subprocess.DEVNULL, timeout=500
    )
    assert done.returncode == 0 and "all runs are there" in done.stdout, done.stderr


def test_the_notebook_runs(tmp_path):
    nbformat, nbclient = pytest.importorskip("nbformat"), pytest.importorskip("nbclient")
    notebook = nbformat.read(EXAMPLES / "tour.ipynb", as_version=4)
    nbclient.NotebookClient(notebook, timeout=300, resources={"metadata": {"path": str(Path(ROOT))}}).execute()
    ends = notebook.cells[-1]["outputs"][0]["data"]["text/plain"]
    falls = [float(part.split("(")[-1].rstrip("}) ").split(":")[-1]) for part in ends.split(",")]
    # the stronger the damper, the less joint 2 falls
    assert falls == sorted(falls) and len(falls) == 4


def test_an_optimal_motion_arrives(tmp_path):
    pytest.importorskip("casadi")
    done = subprocess.run(
        [sys.executable, str(EXAMPLES / "mpc_casadi.py")],
        cwd=tmp_path,
        capture_output=True,
        text=True,
        stdin=subprocess.DEVNULL,
        timeout=500,
    )
    assert done.returncode == 0, done.stderr
    # adjoint derivatives, which the optimiser does not use, and another solver find what it promises
    gradient, angle, speed = (float(number) for number in re.findall(r"\d\.\de-\d\d", done.stdout))
    assert gradient < 1e-6 and angle < 1e-4 and speed < 1e-3


@pytest.mark.interop
def test_a_system_runs_alike_in_three_masters(tmp_path):
    for package in ("pythonfmu", "ecospy", "libcosimpy"):
        if importlib.util.find_spec(package) is None:
            pytest.skip(f"{package} is not installed")
    command = [sys.executable, str(EXAMPLES / "cosimulation" / "run.py"), "-o", str(tmp_path / "ein Ordner")]
    done = subprocess.run(command, cwd=tmp_path, capture_output=True, text=True, stdin=subprocess.DEVNULL, timeout=500)
    assert done.returncode == 0, done.stdout + done.stderr
    rows = {
        words[0]: [float(word) for word in words[2:4]]
        for words in map(str.split, done.stdout.splitlines())
        if words[0] in ("FMPy", "Ecos", "libcosim")
    }
    assert len(rows) == 3, done.stdout
    for difference, error in rows.values():
        # the drives' torques are held for a step and start from nothing: the arm sags, then follows
        assert difference < 1e-9 and 0.001 < error < 0.05
    assert (tmp_path / "ein Ordner" / "cosimulation.png").stat().st_size > 20_000


BOTH = """
name = "both"
gravity = [0, -9.81, 0]
solver = {rtol = 1e-10, atol = 1e-12}
LEFT
RIGHT
[[bushing]]
name = "pad"
link_a = "lower"
point_a = [0.3, 0, 0]
link_b = "right_lower"
point_b = [0.3, 0, 0]
stiffness = [2000, 2000, 2000, 0, 0, 0]
damping = [10, 10, 10, 0, 0, 0]
[[frame]]
name = "tip"
link = "lower"
position = [0.3, 0, 0]
"""


@pytest.mark.interop
def test_ports_are_connected_by_their_terminals(tmp_path, monkeypatch):
    for package in ("pythonfmu", "ecospy"):
        if importlib.util.find_spec(package) is None:
            pytest.skip(f"{package} is not installed")
    monkeypatch.syspath_prepend(str(EXAMPLES / "cosimulation"))
    ports = importlib.import_module("ports")
    monkeypatch.setattr(sys, "argv", ["ports.py", "-o", str(tmp_path)])
    assert ports.main() == 0
    fmpy, ecos = (np.array(json.loads((tmp_path / f"{master}.json").read_text())["rows"]) for master in ("fmpy", "ecospy"))
    assert np.abs(fmpy - ecos).max() < 1e-8  # up to 14 W
    # motions, forces and nothing else: position, velocity and acceleration to the pad, its force to the arm
    wires = ports.connect({name: tmp_path / f"{name}.fmu" for name in ("left", "right")} | {"pad": tmp_path / "Pad.fmu"})
    assert len(wires) == 2 * 12 and {(a[0], b[0]) for a, b in wires} == {
        ("left", "pad"),
        ("right", "pad"),
        ("pad", "left"),
        ("pad", "right"),
    }
    assert all(a[1].rpartition(".")[2] == b[1].rpartition(".")[2] for a, b in wires)
    # one model of both arms: the values held over 1 ms are the only error
    left, right = (ports.LINK.format(**ports.ARMS[arm]) for arm in ("left", "right"))
    right = right.replace('"upper"', '"right_upper"\nparent = "ground"').replace('"lower"', '"right_lower"\nparent = "right_upper"')
    (tmp_path / "both.toml").write_text(BOTH.replace("LEFT", left).replace("RIGHT", right))
    assert command("build", "--no-show", tmp_path / "both.toml", "-o", tmp_path / "both.fmu").returncode == 0
    names = ["tip.position[1]", "tip.position[2]"]
    both = simulate_fmu(str(tmp_path / "both.fmu"), stop_time=ports.STOP, output_interval=ports.STEP, output=names)
    tip = fmpy[:, [ports.WATCHED.index(("left", name)) for name in names]]
    assert np.ptp(tip, axis=0).max() > 0.1
    assert np.abs(tip - np.column_stack([both[name] for name in names])).max() < 1e-3
    # the ports' power is that of the pad but for this error
    work = ports.STEP * np.abs(fmpy[:, :2]).sum()
    added = ports.added_energy(fmpy)
    assert 0 < abs(added) < 1e-3 * work, (added, work)
