"""`simulate_many`: runs of the compiled driver against single runs and closed forms."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

import build_fmu as rds
from build_fmu import native
from build_fmu.errors import UserError

ROOT = Path(__file__).parents[2]
CART = "name = 'cart'\ngravity = [0, 0, 0]\n[[link]]\nname = 'cart'\njoint = 'prismatic'\nmass = 2\n[fmu]\nstep_size = 0.1\n"


@pytest.fixture
def cart(tmp_path):
    try:
        native.library(), native.driver_program()
    except UserError as error:
        pytest.skip(str(error))
    (tmp_path / "cart.toml").write_text(CART)
    with rds.load(tmp_path / "cart.toml", tunable=["cart.mass"]) as model:
        yield model


def test_runs_have_their_own_inputs_and_parameters(cart):
    force, mass = np.arange(1.0, 6), np.array([2.0, 1, 4, 2, 3])
    held = np.repeat(force, 10).reshape(5, 10, 1)
    held[:, 5:] *= -1
    for workers in (1, 2, 7):
        runs = cart.simulate_many(held, {"cart.mass": mass, "cart.q0": 3.0}, workers, outputs=["cart.q", "cart.qd"], every=5)
        assert runs.status == ["ok"] * 5 and runs.time == pytest.approx([0, 0.5, 1])
        a = force / mass
        assert runs["cart.q"] == pytest.approx(3 + np.column_stack([0 * a, a / 8, a / 4]), abs=1e-7)
        assert runs["cart.qd"] == pytest.approx(np.column_stack([0 * a, a / 2, 0 * a]), abs=1e-7)


def test_a_time_limit_beyond_that_of_the_operating_system(cart, monkeypatch):
    monkeypatch.setattr("build_fmu.library.batch.BUDGET", 1e9)
    assert cart.simulate_many(parameters={"cart.q0": [1.0]}, outputs=["cart.q"])["cart.q"] == pytest.approx(1)


def test_a_run_that_fails_leaves_the_others(cart):
    runs = cart.simulate_many(parameters={"cart.mass": [1.0, -1.0, 2.0], "cart.qd0": [1.0, 1.0, 2.0]}, outputs=["cart.q"])
    assert runs.status == ["ok", "refused", "ok"]
    assert runs["cart.q"][[0, 2], -1] == pytest.approx([1, 2]) and np.isnan(runs["cart.q"][1]).all()


def test_strings_hold_for_all_runs(cart):
    given = {"cart.qd0": [1.0, 2.0], "solver.method": "bdf"}
    for runs in (
        cart.simulate_many(parameters=given, outputs=["cart.q"]),
        cart.simulate_many(parameters=given, outputs=["cart.q"], client=Here()),
    ):
        assert runs.status == ["ok", "ok"] and runs["cart.q"][:, -1] == pytest.approx([1, 2])
    cart.parameters = {"solver.method": "rk"}
    assert cart.simulate_many(parameters={"cart.qd0": [1.0, 2.0]}).status == ["refused", "refused"]


def test_wrong_arguments_are_one_sentence(cart):
    for call, sentence in (
        (lambda: cart.simulate_many(np.zeros((2, 3))), r"'inputs' must have the shape \(runs, 10, 1\), got \(2, 3\)"),
        (lambda: cart.simulate_many(parameters={"cart.mas": [1.0]}), "unknown parameter 'cart.mas'; did you mean 'cart.mass'"),
        (
            lambda: cart.simulate_many(np.zeros((2, 10, 1)), {"cart.mass": [1.0, 2, 3]}),
            r"'cart.mass' must be a number or have the shape \(2,\)",
        ),
        (lambda: cart.simulate_many(parameters={"cart.mass": [np.nan]}), "must be finite"),
        (lambda: cart.simulate_many(parameters={"cart.mass": "heavy"}), "'cart.mass' of a batch must be a number or one number per run"),
        (lambda: cart.simulate_many(parameters={"solver.method": ["bdf", "erk"]}), "'solver.method' of a batch must be one line of text"),
        (lambda: cart.simulate_many(parameters={"solver.method": ""}), "'solver.method' of a batch must be one line of text"),
        (lambda: cart.simulate_many(outputs=["cart.p"]), "unknown output 'cart.p'"),
        (lambda: cart.simulate_many(outputs=["cart.q"])["cart.p"], "unknown output 'cart.p'"),
        *((lambda n=n: cart.simulate_many(workers=n), f"'workers' must be an integer of at least 1, got {n}$") for n in (0, -1, 1.5)),
        *((lambda n=n: cart.simulate_many(every=n), f"'every' must be an integer of at least 0, got {n}$") for n in (-1, 1.5)),
        (lambda: cart.simulate_many(stop=-1), "the stop time must be a positive time in s, got -1"),
    ):
        with pytest.raises(UserError, match=sentence):
            call()


LOST = """
import os, time
import numpy as np
import build_fmu as rds
from build_fmu.library import batch
from dask.distributed import Client, LocalCluster


def slow_part(*arguments, real=batch._remote_part):
    # the first worker that gets a part ends while it runs
    try:
        os.close(os.open("lost", os.O_CREAT | os.O_EXCL))
    except FileExistsError:
        time.sleep(0.1)
        return real(*arguments)
    os.kill(os.getpid(), 9)


if __name__ == "__main__":
    batch._remote_part = slow_part
    mass, force = np.linspace(1, 3, 30), np.linspace(1, 2, 30)
    held = np.repeat(force, 10).reshape(30, 10, 1)
    with rds.load("cart.toml", tunable=["cart.mass"]) as model:
        local = model.simulate_many(held, {"cart.mass": mass}, outputs=["cart.q"], every=5)
        with LocalCluster(n_workers=2, threads_per_worker=1, dashboard_address=None) as cluster, Client(cluster) as client:
            runs = model.simulate_many(held, {"cart.mass": mass}, outputs=["cart.q"], every=5, client=client)
    assert os.path.exists("lost") and runs.status == ["ok"] * 30, runs.status
    assert (runs.values == local.values).all() and (runs.time == local.time).all()
    assert abs(runs["cart.q"][:, -1] - force / mass / 2).max() < 1e-7
    print("all runs are there")
"""


@pytest.mark.slow
def test_a_lost_worker_of_a_cluster_costs_no_run(cart, tmp_path):
    pytest.importorskip("dask.distributed")
    (tmp_path / "lose.py").write_text(LOST)
    environment = {**os.environ, "PYTHONPATH": str(ROOT)}
    program = [sys.executable, str(tmp_path / "lose.py")]
    done = subprocess.run(program, cwd=tmp_path, env=environment, capture_output=True, text=True, stdin=subprocess.DEVNULL, timeout=300)
    assert done.returncode == 0 and "all runs are there" in done.stdout, done.stderr


class Here:
    """A cluster of one worker in this process."""

    def scatter(self, data, **_):
        return data

    def nthreads(self):
        return {"here": 1}

    def submit(self, function, *arguments, **_):
        return function(*arguments)

    def gather(self, results):
        return results


def test_a_cluster_gives_what_local_workers_give(cart):
    mass = np.array([2.0, 1, -1, 2, 3])
    options = {"parameters": {"cart.mass": mass, "cart.qd0": 1.0}, "outputs": ["cart.q"], "every": 5}
    local, remote = cart.simulate_many(**options), cart.simulate_many(**options, client=Here())
    assert remote.status == local.status == ["ok", "ok", "refused", "ok", "ok"]
    np.testing.assert_array_equal(remote.values, local.values)
