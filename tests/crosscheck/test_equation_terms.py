"""Output groups of the equations of motion against the dense formulation: M qdd + bias = tau + passive + J^T lambda."""

from __future__ import annotations

import numpy as np
import pytest

from tests.crosscheck.dense_motion import Dense, Forces
from tests.crosscheck.random_scenes import Case, draw, state_of
from tests.crosscheck.scene_fmu import Library

GROUPS = '["acceleration", "mass_matrix", "bias", "gravity_torque", "coriolis", "passive"]'
TOLERANCE = 1e-13


@pytest.fixture(scope="module")
def library(tmp_path_factory) -> Library:
    return Library(tmp_path_factory.mktemp("terms"))


def matrix(values: dict, name: str, rows: int, columns: int) -> np.ndarray:
    return np.array([[values[f"{name}[{i + 1},{j + 1}]"] for j in range(columns)] for i in range(rows)])


def vector(values: dict, name: str, rows: int) -> np.ndarray:
    return np.array([values[f"{name}[{i + 1}]"] for i in range(rows)])


def bodies(dense: Dense) -> Forces:
    """Forces of gravity and velocity products."""
    n = len(dense.scene.dofs)
    forces = Forces(dense.n.zeros(n), dense.n.zeros(n))
    dense._bodies(forces)
    return forces


def differences(case: Case, values: dict) -> dict[str, float]:
    """The largest error of each group, relative to the terms that it sums."""
    dense = case.dense()
    dense.solve(state_of(values, case.inputs, dense), {})
    n, M = len(dense.scene.dofs), dense.M
    root = np.sqrt(np.diag(M))
    found = {"mass_matrix": abs(matrix(values, "mass_matrix", n, n) - M) / np.outer(root, root)}
    all_forces, inertial = dense.forces, bodies(dense)
    dense.scene.gravity = dense.scene.gravity * 0
    coriolis = bodies(dense)
    # what cancels in velocity products
    speed = max([abs(dof.qd) for dof in dense.scene.dofs if dof.turns], default=0)
    products = np.sqrt(2 * dense.kinetic) * root * speed
    for name, expected, size in (
        ("bias", -inertial.value, inertial.size),
        ("coriolis", -coriolis.value, coriolis.size + products),
        ("gravity_torque", coriolis.value - inertial.value, inertial.size),
        ("passive", all_forces.value - inertial.value, all_forces.size),
    ):
        error = abs(vector(values, name, n) - expected)
        found[name] = np.divide(error, size, out=np.where(error > 0, np.inf, 0), where=size > 0)
    return {name: float(error.max()) for name, error in found.items()}


@pytest.mark.parametrize("only", ["open", "loops", "repeat", "all"])
def test_terms_agree(library, only):
    """Joints of all types, rotors, prescribed motions, springs, friction, stops, couplings, bushings, contact and loops."""
    for index in range(25):
        case = draw(20, index, only)
        library.load(case.text + f"\n[fmu]\noutputs = {GROUPS}\n")
        values, _ = library.start(case.inputs)
        worst = differences(case, values)
        assert max(worst.values()) < TOLERANCE, (only, index, worst)
