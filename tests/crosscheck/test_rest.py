"""Random scenes with springs and `start = "equilibrium"`: what is found is at rest."""

from __future__ import annotations

import numpy as np
import pytest

from tests.crosscheck.scene_fmu import Library, Refused
from tests.crosscheck.scene_runs import Runner, scene_of

MOVING = (".qd", ".qdd", *(f".{what}[{axis}]" for what in ("omega", "alpha") for axis in (1, 2, 3)))
SPRING = (5, 50)  # N m/rad, N/m


def resting(seed: int, index: int, library: Library) -> Runner:
    runner, rng = scene_of(seed, index, library), np.random.default_rng([seed, index])
    for link in runner.file["link"]:
        link.pop("qd", None)
        if link["joint"] in ("revolute", "prismatic") and "stiffness" not in link:
            link["stiffness"] = float(rng.uniform(*SPRING))
    runner.file["start"] = "equilibrium"
    return runner


def found(seed: int, indices, library: Library) -> int:
    """Number of scenes with a rest pose. Prescribed joints are left out: they may accelerate from rest."""
    count = 0
    for index in indices:
        runner = resting(seed, index, library)
        if any(dof.prescribed for dof in runner.scene.dofs):
            continue
        try:
            slave = runner.begin(runner.load(1e-9))
        except Refused as refused:
            assert "found no rest configuration" in str(refused), (seed, index)
            continue
        moving = [name for name in library.outputs if name.endswith(MOVING)]
        assert max(map(abs, slave.reals(moving))) < 1e-6, (seed, index)
        slave.free()
        count += 1
    return count


def test_what_is_found_is_at_rest(tmp_path):
    """Scene 157 has redundant loops and a rigid coupling; its rest pose is 2e-3 rad from a singular configuration."""
    assert found(901, range(150, 160), Library(tmp_path)) >= 3


@pytest.mark.slow
def test_what_is_found_in_many_scenes_is_at_rest(tmp_path):
    assert found(902, range(300), Library(tmp_path)) >= 60
