"""Contact shapes, grounds and forces in films and in the page: where the FMU's own outputs have them."""

import json

import numpy as np
import pytest

from build_fmu.cli import main
from build_fmu.draw.contacts import outlines, points_of, terrain
from build_fmu.draw.drawing import draw
from build_fmu.model.describe import describe
from build_fmu.run.signals import read_table
from build_fmu.show.motion import Motion
from tests.packager.test_drawing import link
from tests.packager.test_show import attribute, browse, needs_browser, needs_library

# a turning ball on a slope, a plate below it that moves, and a contact without outputs
MODEL = """
name = "slope"
[[link]]
name = "ball"
joint = "free"
drive = "free"
mass = 0.5
inertia = [0.002, 0.002, 0.002]
q = [0.2, 0.1, 0.25, 0.3, 0.2, 0.1]
qd = [0, 0, 0, 1, 2, 3]
[[link]]
name = "plate"
parent = "ground"
joint = "prismatic"
drive = "free"
mass = 1
q = -1
qd = 0.5
gamma = 0.4
alpha = 0.3
[[contact]]
name = "slope"
link_a = "ball"
shape_a = "sphere"
point_a = [0.02, 0, 0]
radius_a = 0.1
normal_b = [0.1, 0, 1]
stiffness = 1e4
damping = 1
friction = 0.3
outputs = ["force", "depth", "point"]
[[contact]]
name = "plates"
link_a = "plate"
shape_a = "box"
point_a = [0.1, 0.2, 0.3]
size_a = [0.2, 0.3, 0.4]
rpy_a = [0.1, 0.2, 0.3]
shape_b = "heightmap"
file = "hills.csv"
spacing = 0.5
point_b = [-1, -1, -3]
stiffness = 1e4
[fmu]
stop_time = 0.5
step_size = 0.01
[solver]
method = "auto"
"""


@pytest.fixture
def recorded(tmp_path):
    (tmp_path / "hills.csv").write_text("0,1,0\n1,2,1\n0,1,0\n")
    (tmp_path / "slope.toml").write_text(MODEL, encoding="utf-8")
    assert main(["simulate", str(tmp_path / "slope.toml"), "--csv", str(tmp_path / "run.csv")]) == 0
    table = {name: np.array(values) for name, values in read_table(tmp_path / "run.csv").items()}
    return tmp_path, describe(tmp_path / "slope.toml").drawing, table


@needs_library
def test_shapes_and_forces_of_a_film(recorded):
    _, drawing, table = recorded
    motion, normal = Motion(drawing, table), np.array([0.1, 0, 1]) / np.hypot(0.1, 1)
    touched = 0
    for row in range(len(table["time"])):
        slope, plates = motion.at(row)["contacts"]
        # the deepest point is between the surface of the ball and the plane: half a depth from either
        lowest = slope["a"]["origin"] - slope["a"]["radius"] * normal
        depth = table["slope.depth"][row]
        assert -normal @ lowest == pytest.approx(depth, abs=1e-9)
        force, point = (np.array([table[f"slope.{group}[{k}]"][row] for k in (1, 2, 3)]) for group in ("force", "point"))
        assert ("arrow" in slope) == (depth > 0) and "arrow" not in plates
        if depth > 0:
            touched += 1
            start, share = slope["arrow"]
            assert start == pytest.approx(point) and np.linalg.norm(np.cross(share, force)) < 1e-12 * np.linalg.norm(force)
            assert np.linalg.norm(start - lowest) <= 1.01 * depth
        along = [np.sin(0.4) * np.sin(0.3), -np.cos(0.4) * np.sin(0.3), np.cos(0.3)]  # z of the plate's frame
        moved = np.array(plates["a"]["origin"]) - np.array(drawing["contacts"][1]["a"]["origin"])
        assert moved == pytest.approx((table["plate.q"][row] + 1) * np.array(along), abs=1e-12)
    assert 0 < touched < len(table["time"])
    hills = drawing["contacts"][1]["b"]
    assert hills["heights"] == [[0, 1, 0], [1, 2, 1], [0, 1, 0]] and hills["grid"] == 0.5 and hills["link"] == "ground"


@needs_library
@needs_browser
def test_shapes_and_forces_of_the_page(recorded):
    folder, _, table = recorded
    row = int(np.argmax(table["slope.force[3]"]))
    assert main(["show", str(folder / "slope.toml"), str(folder / "run.csv"), "-o", str(folder / "page.html")]) == 0
    dom = browse(f"{(folder / 'page.html').as_uri()}#t={table['time'][row]}", folder, "--dump-dom")
    assert attribute(dom, "trouble") is None
    normal = np.array([0.1, 0, 1]) / np.hypot(0.1, 1)
    assert json.loads(attribute(dom, "floor")) == pytest.approx([*normal, 0])
    center = np.array(json.loads(attribute(dom, "shapes"))[0])
    assert 0.1 - normal @ center == pytest.approx(table["slope.depth"][row], abs=1e-6)
    (force,) = json.loads(attribute(dom, "forces"))
    assert force["value"] == pytest.approx([table[f"slope.force[{k}]"][row] for k in (1, 2, 3)], rel=1e-5, abs=1e-6)
    assert force["from"] == pytest.approx([table[f"slope.point[{k}]"][row] for k in (1, 2, 3)], abs=1e-6)


SHAPES = {
    "sphere": {"radius": 0.5},
    "capsule": {"radius": 0.5, "half_length": 1.0},
    "box": {"half_size": [0.5, 1.0, 2.0]},
    "disk": {"radius": 0.5, "tube": 0.1},
    "points": {"points": [[0, 0, 1], [0, 0, -2]]},
}
EXTENTS = {"sphere": [0.5] * 3, "capsule": [0.5, 0.5, 1.5], "box": [0.5, 1, 2], "disk": [0.5, 0.5, 0], "points": [0, 0, 2]}
TURN = [[0, 0, 1], [1, 0, 0], [0, 1, 0]]  # x to y, y to z, z to x


@pytest.mark.parametrize("kind", SHAPES)
def test_outlines_have_the_size_of_the_shape(kind):
    shape = {"kind": kind, "link": "a", "origin": [10, 20, 30], "rotation": TURN, **SHAPES[kind]}
    reach = np.abs(np.array(points_of(shape)) - [10, 20, 30]).max(axis=0)
    assert reach == pytest.approx(np.array(TURN) @ EXTENTS[kind], abs=1e-12)
    ground = {"kind": "plane", "link": "ground", "origin": [0, 0, 0], "rotation": np.eye(3).tolist()}
    contact = {"name": "c", "a": shape, "b": ground}
    assert draw({"links": [link("a")], "contacts": [contact]}, "x") != draw({"links": [link("a")]}, "x")
    assert outlines(ground) == [] and points_of(ground) == []


def test_a_moving_plane_of_two_contacts_is_drawn_once(monkeypatch):
    drawn = []
    monkeypatch.setattr("build_fmu.draw.drawing.terrain", lambda shape, *_: drawn.append(shape) or [])
    plane = {"kind": "plane", "link": "tray", "origin": [0, 0, 0], "rotation": np.eye(3).tolist()}
    ball = {"kind": "sphere", "link": "ground", "origin": [0, 0, 1], "rotation": np.eye(3).tolist(), "radius": 0.5}
    drawing = {
        "links": [link("tray", kind="prismatic") | {"joint": "tray", "q": 0.0}],
        "contacts": [{"name": name, "a": ball, "b": plane} for name in ("c1", "c2")],
    }
    draw(Motion(drawing, {"tray.q": np.array([0.25])}).at(0), "x")
    assert [shape["origin"] for shape in drawn] == [[0, 0, 0.25]]


def test_a_plane_is_drawn_where_the_mechanism_is():
    tilted = {"kind": "plane", "link": "ground", "origin": [0, 0, 1], "rotation": [[0.8, 0, 0.6], [0, 1, 0], [-0.6, 0, 0.8]]}
    lines = np.array(terrain(tilted, np.array([-1, -1, 0]), np.array([1, 1, 2])))
    assert np.allclose((lines - [0, 0, 1]) @ [0.6, 0, 0.8], 0, atol=1e-12)
    assert np.abs(lines[..., 1]).max() == pytest.approx(1)
