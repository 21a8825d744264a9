"""`Model.modes`: shapes of repeated frequencies, and states at rest in small units."""

from __future__ import annotations

import numpy as np
import pytest

from build_fmu.errors import UserError
from build_fmu.library.modes import _eigen

# a body whose three translations and three rotations have one frequency each
TWIN = """
name = "twin"
[[link]]
name = "body"
joint = "free"
alpha = 0.5
theta = 0.3
gamma = 1.1
mass = 1
inertia = [0.1, 0.1, 0.1]
[[bushing]]
name = "mount"
link_a = "ground"
link_b = "body"
rpy_a = [0.4, -0.6, 0.9]
stiffness = [100, 100, 100, 5, 5, 5]
"""


def smallest_part(vectors):
    """Smallest singular value of the vectors with length 1; 0: they depend on each other."""
    return np.linalg.svd(vectors / np.linalg.norm(vectors, axis=0), compute_uv=False)[-1]


@pytest.mark.parametrize("text", [TWIN, "pppr"])
def test_shapes_of_repeated_frequencies_are_independent(model, text):
    m = model(text)
    x = m.start_at_rest()
    modes = m.modes(x)
    assert smallest_part(modes.shapes) > 0.1
    A = m.linearise(x)[0]
    q = [m.states.index(n) for n in modes.coordinates]
    v = [i for i in range(len(x)) if i not in q]
    assert A[np.ix_(q, v)] @ A[np.ix_(v, q)] @ modes.shapes == pytest.approx(-modes.shapes * modes.squares, abs=1e-11)


@pytest.mark.parametrize("symmetric", [True, False])
def test_eigenvectors_of_random_models_are_independent(symmetric):
    """60 mass matrices of any units, squares that repeat; forces with and without a potential."""
    rng = np.random.default_rng(4)
    for _ in range(60):
        n = rng.integers(2, 8)
        units = np.diag(10 ** rng.uniform(-4, 4, n)) if symmetric else np.eye(n)
        root = units @ np.linalg.cholesky(np.eye(n) + 0.3 * np.ones((n, n)))
        squares = rng.choice([-3.0, 0.0, 2.0, 50.0], n)
        turn = np.linalg.qr(rng.normal(size=(n, n)))[0] if symmetric else rng.normal(size=(n, n)) + 3 * np.eye(n)
        A = np.linalg.solve(root.T, turn @ np.diag(squares) @ np.linalg.inv(turn) @ root.T)
        values, vectors = _eigen(A, root @ root.T)
        assert np.sort(values) == pytest.approx(np.sort(squares), abs=1e-9)
        # in coordinates without units
        scaled = root.T @ vectors
        assert smallest_part(scaled) > (0.9 if symmetric else 1e-3)
        assert root.T @ A @ vectors == pytest.approx(scaled * values, abs=1e-8)


@pytest.mark.parametrize("length", [1e3, 1.0, 1e-3, 1e-6, 1e-7])
def test_holding_inputs_in_any_units(model, length):
    """An arm on a vertical slide, both with the density of water."""
    mass = 1000 * length**3
    m = model(
        f"""
name = "micro"
gravity = [0, -9.81, 0]
[[link]]
name = "slide"
joint = "prismatic"
alpha = -1.5707963267948966
mass = {mass}
[[link]]
name = "arm"
alpha = 1.5707963267948966
mass = {mass}
com = [{length}, 0, 0]
inertia = [0, 0, {0.1 * mass * length**2}]
"""
    )
    assert m.hold() == pytest.approx([2 * mass * 9.81, mass * length * 9.81], rel=1e-9, abs=0)


def test_an_equilibrium_is_at_rest_in_small_units(model):
    """Rounding of stiffness / inertia * q is 1e-4 rad/s2."""
    text = 'name = "mems"\ngravity = [0, -9.81, 0]\n[[link]]\nname = "mirror"\nmass = 1e-9\ncom = [1e-5, 0, 0]\n'
    m = model(text + "inertia = [0, 0, 1e-18]\nstiffness = 4e-5\nq = 0.1\nrest = 0.1\n")
    x = m.equilibrium()
    square = (4e-5 - 1e-9 * 9.81 * 1e-5 * np.sin(0.1)) / 1.1e-18
    assert m.modes(x).squares == pytest.approx([square], rel=1e-6)
    with pytest.raises(UserError, match="modes require a state at rest"):
        m.modes(x + [1e-7, 0])


def test_a_defective_matrix_has_a_basis_of_its_invariant_subspace():
    values, vectors = _eigen(np.array([[2.0, 1, 0], [0, 2, 0], [0, 0, 7]]), np.eye(3))
    assert values == pytest.approx([2, 2, 7])
    assert smallest_part(vectors) > 0.9
