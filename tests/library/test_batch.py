"""`simulate_many`: runs of the compiled driver against single runs and closed forms."""

from __future__ import annotations

import numpy as np
import pytest

import build_fmu as rds
from build_fmu import native
from build_fmu.errors import UserError

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


def test_a_run_that_fails_leaves_the_others(cart):
    runs = cart.simulate_many(parameters={"cart.mass": [1.0, -1.0, 2.0], "cart.qd0": [1.0, 1.0, 2.0]}, outputs=["cart.q"])
    assert runs.status == ["ok", "refused", "ok"]
    assert runs["cart.q"][[0, 2], -1] == pytest.approx([1, 2]) and np.isnan(runs["cart.q"][1]).all()


def test_wrong_arguments_are_one_sentence(cart):
    for call, sentence in (
        (lambda: cart.simulate_many(np.zeros((2, 3))), r"'inputs' must have the shape \(runs, 10, 1\), got \(2, 3\)"),
        (lambda: cart.simulate_many(parameters={"cart.mas": [1.0]}), "unknown parameter 'cart.mas'; did you mean 'cart.mass'"),
        (
            lambda: cart.simulate_many(np.zeros((2, 10, 1)), {"cart.mass": [1.0, 2, 3]}),
            r"'cart.mass' must be a number or have the shape \(2,\)",
        ),
        (lambda: cart.simulate_many(parameters={"cart.mass": [np.nan]}), "must be finite"),
        (lambda: cart.simulate_many(outputs=["cart.p"]), "unknown output 'cart.p'"),
    ):
        with pytest.raises(UserError, match=sentence):
            call()
