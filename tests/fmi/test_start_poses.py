"""`describe` starts where the FMU starts: the same pose, the same corrections in the same words."""

from __future__ import annotations

import subprocess

import numpy as np
import pytest

from build_fmu.model.describe import describe
from build_fmu.native import describe_program
from tests.fmi.conftest import build_fmu
from tests.fmi.mixed_scenes import Scene
from tests.fmi.raw import Slave, Unpacked

# closed to rounding at its quaternion, far from closed at the identity
BALL_IN_LOOP = """
name = "ball"
[[link]]
name = "a"
joint = "spherical"
mass = 1
com = [0.5, 0, 0]
inertia = [0.1, 0.1, 0.1]
q = [0.9233805168766387, 0.10259783520851541, 0.20519567041703082, 0.3077935056255462]
hold = true
[[loop]]
name = "tip"
type = "fixed"
link_a = "ground"
link_b = "a"
point_a = [0.7263157894736842, 0.6105263157894737, -0.31578947368421056]
axis_a = [0.4421052631578947, -0.06315789473684214, 0.8947368421052632]
x_a = [0.7263157894736842, 0.6105263157894737, -0.31578947368421056]
point_b = [1, 0, 0]
"""


@pytest.fixture(scope="module", autouse=True)
def built(fmu_file):
    fmu_file("pendulum")  # skips where nothing is built


def written(folder, text: str):
    (folder / "model.toml").write_text(text)
    return folder / "model.toml"


def test_a_ball_that_a_loop_holds_is_where_its_quaternion_says(tmp_path):
    found = describe(written(tmp_path, BALL_IN_LOOP))
    assert found.warnings == []
    assert found.drawing["links"][0]["rotation"][0] == pytest.approx(
        [0.7263157894736842, -0.5263157894736842, 0.4421052631578947], abs=1e-15
    )


@pytest.mark.parametrize("seed", range(40))
def test_scenes_that_are_closed_are_drawn_as_they_are(tmp_path, seed):
    scene = Scene(seed, velocities=False)
    found = describe(written(tmp_path, scene.toml()))
    assert found.warnings == []
    for link, pose in zip(scene.links, scene.poses, strict=True):
        drawn = next(entry for entry in found.drawing["links"] if entry["name"] == link["name"])
        assert np.abs(np.array(drawn["origin"]) - pose.p).max() < 1e-12
        assert np.abs(np.array(drawn["rotation"]) - pose.R).max() < 1e-12


@pytest.mark.parametrize("seed", [1, 2, 4, 6])
def test_open_scenes_are_corrected_as_the_fmu_corrects_them(tmp_path, seed):
    model = written(tmp_path, Scene(seed, open_by=0.05).toml())
    found = describe(model)
    assert len(found.warnings) == 2, "configuration and velocities"
    with Slave(Unpacked(build_fmu(model, tmp_path / "model.fmu"), tmp_path / "unpacked"), logging=True) as slave:
        slave.initialize()
        said = [text for _, category, text in slave.messages if category == "logStatusWarning"]
        assert len(said) >= 2
        for text, warning in zip(said, found.warnings, strict=False):
            assert warning.endswith(text)
        drawn = {link["joint"]: link["q"] for link in found.drawing["links"]}
        for output in slave.fmu.named("output", ".q"):
            if output[:-2] in drawn:
                assert slave.get(output) == drawn[output[:-2]]
        for ball in found.drawing["balls"]:
            assert slave.reals([f"{ball['name']}.quaternion[{k}]" for k in range(1, 5)]) == pytest.approx(ball["quaternion"], abs=1e-15)
        assert max(slave.reals(slave.fmu.named("output", ".gap"))) < 1e-13


@pytest.mark.parametrize("open_by", [0.0, 0.1])
@pytest.mark.parametrize("seed", [0, 7])
def test_ten_loops_that_share_joints_are_assembled(tmp_path, seed, open_by):
    scene = Scene(seed, loops=10, open_by=open_by).toml()
    # without the entries of matrices, 13 000 variables
    model = written(tmp_path, scene.replace('"mass_matrix", ', "").replace(', "constraint_jacobian"', ""))
    done = subprocess.run([describe_program(), model], capture_output=True, text=True, check=False, timeout=100)
    assert done.returncode == 0, done.stderr
    assert ("initial configuration" in done.stderr) == (open_by > 0)
