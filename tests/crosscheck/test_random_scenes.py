"""Random scenes of everything a model file can say: the built library against a dense formulation that shares no code with it."""

from __future__ import annotations

import math
import tomllib
from collections import Counter

import pytest

from tests.crosscheck.dense_motion import Dense
from tests.crosscheck.random_scenes import draw, run
from tests.crosscheck.scene_fmu import Library

FAST = ("open", "loops", "repeat", "redundant")  # classes of random_scenes.py; the slow test takes all of them

# a door on two hinges, a pendulum for one of them, and its acceleration by hand: sum of moments about the axis
DOOR = """
name = "door"
[[link]]
name = "door"
alpha = 0.3
mass = 1
com = [0.5, 0.2, 0.1]
inertia = [0.1, 0.1, 0.1]
"""
HINGE = """
[[loop]]
name = "hinge"
type = "revolute"
link_a = "ground"
link_b = "door"
point_a = [0, -0.206864144662937, 0.6687355423879242]
axis_a = [0, -0.29552020666133955, 0.955336489125606]
point_b = [0, 0, 0.7]
"""


# a loop at the centre of a ball joint constrains nothing; the rounding errors of its two points are a lever of 1e-16 m
BALL = """
name = "ball"
gravity = [-1.7833591088057805, 8.849861410175807, -3.8387085471184865]
angle_unit = "deg"
[[link]]
name = "ball"
joint = "spherical"
alpha = 163.9681329317199
theta = -161.4368336866316
d = -0.52248952315381
mass = 0.31
com = [0.007, -0.21, 0.083]
inertia = [0.0198, 0.0131, 0.0205, -0.0028, 0.0003, -0.0002]
q = [-17.6, 139.7, -22.6]
"""
CENTRE = """
[[loop]]
name = "centre"
type = "spherical"
link_a = "ball"
link_b = "ground"
point_a = [0, 0, 0]
point_b = [0, %r, 0.5021689869736116]
"""


@pytest.fixture(scope="module")
def library(tmp_path_factory) -> Library:
    return Library(tmp_path_factory.mktemp("scenes"))


def failures(library: Library, count: int, seed: int, **options) -> list[str]:
    """One sentence for each scene that does not agree."""
    found = []
    for index in range(count):
        case = draw(seed, index, **options)
        verdict, findings = run(case, library)
        if verdict != "agree":
            found.append(f"seed {seed}, index {index}, {options}: {verdict}: {findings[0]}")
    return found


def test_the_dense_formulation_knows_the_door():
    qdd = -9.81 * math.sin(0.3) * 0.5 / (0.1 + 0.5**2 + 0.2**2)
    for text in (DOOR, DOOR + HINGE):
        dense = Dense(tomllib.loads(text))
        motion = dense.solve(dense.scene.start(), {})
        assert float(motion.qdd[0]) == pytest.approx(qdd, rel=1e-14)
        assert motion.rank == 0


@pytest.mark.parametrize("off", [0, 1e-16, -1e-16, 1e-15])
def test_a_loop_at_the_centre_of_a_ball_constrains_nothing(library, off):
    inputs, shown = {"ball.tau[1]": 0.08, "ball.tau[2]": -0.1, "ball.tau[3]": 2.8}, '[fmu]\noutputs = ["acceleration"]\n'
    accelerations = []
    for text in (BALL, BALL + CENTRE % (0.14429695189917413 + off)):
        library.load(text + shown)
        values, _ = library.start(inputs)
        accelerations.append([values[f"ball.alpha[{k}]"] for k in (1, 2, 3)])
    assert accelerations[1] == pytest.approx(accelerations[0], rel=1e-12)
    assert all(values[f"centre.lambda[{k}]"] == 0 for k in (1, 2, 3))


def test_the_dense_formulation_knows_a_nut_on_a_thread():
    nut = {
        "name": "nut",
        "joint": "screw",
        "pitch": -0.3,
        "mass": 1.7,
        "com": [0.6, 0, 0.2],
        "inertia": [0.1, 0.2, 0.25],
        "q": 0.9,
        "qd": 2,
    }
    dense = Dense({"name": "thread", "gravity": [2, -3, -9.81], "link": [nut]})
    weight = 1.7 * (0.6 * (-2 * math.sin(0.9) - 3 * math.cos(0.9)) + 0.3 * 9.81)
    qdd = (0.7 + weight) / (0.25 + 1.7 * (0.6**2 + 0.3**2))
    assert float(dense.solve(dense.scene.start(), {"nut.tau": 0.7}).qdd[0]) == pytest.approx(qdd, rel=1e-14)


def test_scenes_hold_everything():
    """A generator that forgets something would make the tests below easy."""
    words = Counter()
    for index in range(150):
        case = draw(3, index)
        words.update(case.tags)
        file = tomllib.loads(case.text)
        for table in (table for kind in ("link", "loop", "spring", "bushing", "frame") for table in file.get(kind, [])):
            words.update(f"{key} = {value}" if key in ("joint", "type", "port", "drive") else key for key, value in table.items())
    joints = ("revolute", "prismatic", "screw", "fixed", "universal", "cylindrical", "planar", "spherical", "free")
    loops = ("point", "spherical", "universal", "cylindrical", "revolute", "prismatic", "fixed")
    wanted = {f"joint = {joint}" for joint in joints} | {f"type = {loop}" for loop in loops}
    wanted |= {f"drive = {drive}" for drive in ("motion", "locked", "free")} | {"port = ground", "port = frame"}
    wanted |= {
        "armature",
        "friction",
        "static_friction",
        "lower",
        "stiffness",
        "damping",
        "rest_length",
        "rpy_a",
        "qd",
        "hold",
        "gamma",
        "directions",
    }
    wanted |= {"prescribed", "inverse", "sizes", "bearing", "coaxial", "twice", "guided", "legs", "massless", "floating"}
    assert sorted(wanted - set(words)) == []


def test_a_wrong_value_is_found(library):
    case = draw(1, 0, "open")
    assert run(case, library)[0] == "agree"
    heavier = case.text.replace("mass = ", "mass = 1", 1)
    library.load(heavier)
    load, library.load = library.load, lambda text: []  # the FMU goes on with the heavier model
    try:
        assert run(case, library)[0] != "agree"
    finally:
        library.load = load


@pytest.mark.parametrize("only", FAST)
def test_scenes_agree(library, only):
    assert failures(library, 60, 11, only=only) == []


@pytest.mark.parametrize("scale", [1e-6, 1e-5, 1e3])
def test_redundant_scenes_of_any_size_agree(library, scale):
    """Rows in m and rad together: neither a rank nor digits depend on the unit of length."""
    assert failures(library, 10, 5, only="redundant", scale=scale) == []


@pytest.mark.slow
def test_five_thousand_scenes_agree(library):
    wrong = failures(library, 5000, 14)
    assert [line for line in wrong if ": ill-posed: " not in line] == []
    assert len(wrong) <= 50
