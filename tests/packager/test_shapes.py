"""[[shape]]: what the reader refuses, the triangles, the pictures and pages, and the import of <visual>."""

import json
import logging
import math
import re

import numpy as np
import pytest

from build_fmu.cli import main
from build_fmu.draw.drawing import draw
from build_fmu.draw.meshes import coarse as coarse_mesh
from build_fmu.draw.meshes import drawn_mesh
from build_fmu.draw.shapes import _solids, with_solids
from build_fmu.errors import UserError
from build_fmu.importers import urdf
from build_fmu.importers.rigid import pose_of, rotation_x, rotation_y, rotation_z
from build_fmu.model.describe import describe
from tests.command_line import command
from tests.packager.import_options import import_options
from tests.packager.test_show import attribute, browse, needs_browser

pytestmark = pytest.mark.usefixtures("built_library")
ARM = """
name = "arm"
gravity = [0, 0, -9.81]
angle_unit = "deg"
[[link]]
name = "upper"
alpha = 90
mass = 1
com = [0.2, 0, 0]
inertia = [0.1, 0.1, 0.1]
[[link]]
name = "lower"
a = 0.4
mass = 1
com = [0.2, 0, 0]
inertia = [0.1, 0.1, 0.1]
q = 30
"""
SHAPES = """
[[shape]]
kind = "cylinder"
size = [0.1, 0.05]
[[shape]]
link = "lower"
kind = "box"
size = [0.4, 0.08, 0.06]
position = [0.2, 0, 0]
rpy = [90, 0, 0]
color = [1, 0.5, 0]
"""
TETRAHEDRON = [
    ((0, 0, 0), (0, 1, 0), (1, 0, 0)),
    ((0, 0, 0), (1, 0, 0), (0, 0, 1)),
    ((0, 0, 0), (0, 0, 1), (0, 1, 0)),
    ((1, 0, 0), (0, 1, 0), (0, 0, 1)),
]


def stl(triangles=TETRAHEDRON):
    faces = (
        "facet normal 0 0 0\nouter loop\n" + "".join(f"vertex {x} {y} {z}\n" for x, y, z in t) + "endloop\nendfacet\n" for t in triangles
    )
    return f"solid part\n{''.join(faces)}endsolid part\n"


def model(tmp_path, shapes=SHAPES):
    path = tmp_path / "arm.toml"
    path.write_text(ARM + shapes, encoding="utf-8")
    return path


def volume(points, triangles):
    a, b, c = (points[triangles[:, k]] for k in range(3))
    return float(np.einsum("ij,ij->i", a, np.cross(b, c)).sum() / 6)


@pytest.mark.parametrize(
    ("old", "new", "sentence"),
    [
        ('link = "lower"', 'link = "lowr"', "12: shape 2: link 'lowr'"),
        ('kind = "box"', 'kind = "bx"', "13: shape 2: kind must be"),
        ('kind = "box"\n', "", "shape 2: kind is required"),
        ("size = [0.4, 0.08, 0.06]", "size = [0.4, 0, 0.06]", "shape 2: size must be > 0"),
        ("size = [0.4, 0.08, 0.06]", "size = [0.4, 0.06]", "shape 2: size must be a number or a list of 3"),
        ("size = [0.4, 0.08, 0.06]\n", "", "shape 2: size is required"),
        ("[1, 0.5, 0]", "[1, 0.5]", "shape 2: color must be red, green, blue"),
        ("[1, 0.5, 0]", "[255, 0.5, 0]", "shape 2: color must be red, green, blue"),
        ('kind = "box"', 'kind = "mesh"', "shape 2: file is required for a mesh"),
        ('kind = "box"', 'kind = "box"\nfile = "a.stl"', "shape 2: file applies to kind 'mesh' only"),
        ('kind = "box"', 'kind = "box"\nmass = 1', "shape 2: unknown field 'mass'"),
    ],
)
def test_mistakes_are_told_with_their_place(tmp_path, old, new, sentence):
    assert old in SHAPES
    with pytest.raises(UserError) as error:
        describe(model(tmp_path, SHAPES.replace(old, new, 1)))
    assert sentence.partition(": ")[2] in str(error.value) and "arm.toml:" in str(error.value)


def test_the_dynamics_ignore_shapes(tmp_path):
    found = []
    for shapes in ("", SHAPES):
        done = command("simulate", model(tmp_path, shapes), "--csv", tmp_path / "run.csv", "--stop", "0.2")
        assert done.returncode == 0, done.stderr
        found.append((tmp_path / "run.csv").read_text())
    assert found[0] == found[1]


@pytest.mark.parametrize(
    ("shape", "expected"),
    [
        ({"kind": "box", "size": [0.1, 0.2, 0.3]}, 0.006),
        ({"kind": "cylinder", "size": [0.1, 0.5]}, 10 * math.sin(math.pi / 10) * 0.1**2 * 0.5),
        ({"kind": "sphere", "size": [0.1]}, 4 / 3 * math.pi * 0.1**3),
        ({"kind": "capsule", "size": [0.1, 0.5]}, 4 / 3 * math.pi * 0.1**3 + math.pi * 0.1**2 * 0.5),
    ],
)
def test_solids_are_closed_and_face_outwards(tmp_path, shape, expected):
    described = describe(model(tmp_path))
    (solid,) = _solids(described, {**shape, "link": -1, "origin": [0, 0, 0], "rotation": np.eye(3).tolist()}, 100)
    assert volume(solid.points, solid.triangles) == pytest.approx(expected, rel=1e-12 if shape["kind"] in ("box", "cylinder") else 0.05)
    edges = np.sort(np.concatenate([solid.triangles[:, [0, 1]], solid.triangles[:, [1, 2]], solid.triangles[:, [2, 0]]]), axis=1)
    # points of equal place are one
    _, place = np.unique(solid.points.round(12), axis=0, return_inverse=True)
    counts = np.unique(np.sort(place.ravel()[edges], axis=1), axis=0, return_counts=True)[1]
    assert np.all(counts == 2)


def test_a_mesh_has_its_scale_and_mirror(tmp_path):
    (tmp_path / "part.stl").write_text(stl())
    text = '[[shape]]\nlink = "upper"\nkind = "mesh"\nfile = "part.stl"\nsize = [{}, 0.2, 0.3]\n'
    for scale in (0.1, -0.1):
        shown, warnings = with_solids(describe(model(tmp_path, text.format(scale))))
        (solid,) = shown.drawing["solids"]
        assert not warnings and solid.link == 0
        assert volume(solid.points, solid.triangles) == pytest.approx(0.006 / 6, rel=1e-6)
        assert (solid.points[:, 0].min() if scale < 0 else solid.points[:, 0].max()) == pytest.approx(scale)


def test_a_fine_mesh_is_made_coarse():
    turns, tilts = np.meshgrid(np.linspace(0, 2 * np.pi, 201), np.linspace(0, np.pi, 101))
    points = np.stack([np.sin(tilts) * np.cos(turns), np.sin(tilts) * np.sin(turns), np.cos(tilts)], -1).reshape(-1, 3)
    i, j = (part.ravel() for part in np.meshgrid(np.arange(100), np.arange(200), indexing="ij"))
    at = i * 201 + j
    triangles = np.concatenate([np.stack([at, at + 201, at + 1], 1), np.stack([at + 1, at + 201, at + 202], 1)])
    for most in (2000, 300):
        coarse, kept, _ = coarse_mesh(points, triangles, most)
        assert most / 3 < len(kept) <= most
        assert volume(coarse, kept) == pytest.approx(4 / 3 * math.pi, rel=0.15)


def test_materials_and_textures_give_colors(tmp_path):
    """Of an OBJ with two materials and a part without area, and of one with a texture of two halves; a shape's own color wins."""
    from PIL import Image

    squares = "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nv 2 0 0\nv 2 1 0\n"
    (tmp_path / "paint.mtl").write_text("newmtl red\nKd 1 0 0\nnewmtl blue\nKd 0 0 1\nnewmtl line\nKd 1 1 1\n")
    (tmp_path / "plain.obj").write_text(
        f"mtllib paint.mtl\n{squares}usemtl red\nf 1 2 3\nf 1 3 4\nusemtl blue\nf 2 5 6\nf 2 6 3\n"
        "usemtl line\nv 0 0 0.5\nv 1 0 0.5\nv 0.5 0 0.5\nf 7 8 9\n"
    )
    parts = drawn_mesh(str(tmp_path / "plain.obj"), 100)
    assert {colour: points[:, 0].max() for points, _, colour in parts} == {"#ff0000": 1, "#0000ff": 2}
    (tmp_path / "skin.mtl").write_text("newmtl skin\nKd 1 1 1\nmap_Kd skin.png\n")
    picture = Image.new("RGB", (8, 8), (0, 200, 0))
    picture.paste((200, 100, 0), (4, 0, 8, 8))
    picture.save(tmp_path / "skin.png")
    skin = "vt 0.1 0.5\nvt 0.9 0.5\n"
    faces = "usemtl skin\nf 1/1 2/1 3/1\nf 1/1 3/1 4/1\nf 2/2 5/2 6/2\nf 2/2 6/2 3/2\n"
    (tmp_path / "skin.obj").write_text(f"mtllib skin.mtl\n{squares}{skin}{faces}")
    parts = drawn_mesh(str(tmp_path / "skin.obj"), 100)
    assert {colour: points[:, 0].max() for points, _, colour in parts} == {"#00c800": 1, "#c86400": 2}
    text = '[[shape]]\nlink = "upper"\nkind = "mesh"\nfile = "skin.obj"\ncolor = [0, 0, 1]\n'
    shown, _ = with_solids(describe(model(tmp_path, text)))
    assert {solid.colour for solid in shown.drawing["solids"]} == {"#0000ff"}


def textured(path, picture, place):
    """Writes a COLLADA box whose `place`, diffuse or emission, is a picture."""
    trimesh, _ = pytest.importorskip("trimesh"), pytest.importorskip("collada")
    box = trimesh.creation.box()
    box.visual = trimesh.visual.TextureVisuals(uv=np.full((8, 2), 0.5), material=trimesh.visual.material.PBRMaterial())
    text = box.export(file_type="dae").decode()
    shown = '<surface type="2D"><init_from>p</init_from></surface>', "<sampler2D><source>s</source></sampler2D>"
    parameters = "".join(f'<newparam sid="{sid}">{inner}</newparam>' for sid, inner in zip("sm", shown, strict=True))
    images = f'<library_images><image id="p"><init_from>{picture}</init_from></image></library_images>'
    text = text.replace("<library_effects>", f"{images}<library_effects>").replace("<profile_COMMON>", f"<profile_COMMON>{parameters}")
    colour = re.search(r"<diffuse>.*?</diffuse>", text, re.DOTALL)[0]
    texture = f'<{place}><texture texture="m" texcoord="T"/></{place}>'
    path.write_text(text.replace("<phong>", f"<phong>{texture}") if place == "emission" else text.replace(colour, texture))


def test_a_missing_texture_is_no_traceback(tmp_path, monkeypatch):
    for name in (None, "trimesh"):
        monkeypatch.setattr(logging.getLogger(name), "handlers", [])  # those of pytest
    textured(tmp_path / "box.dae", "gone.png", "emission")
    done = command("show", model(tmp_path, '[[shape]]\nkind = "mesh"\nfile = "box.dae"\n'), "-o", tmp_path / "page.html", "--stop", "0.1")
    assert (done.returncode, done.stderr) == (0, "")


def test_a_texture_beside_the_folder_of_the_mesh_gives_the_color(tmp_path):
    from PIL import Image

    for folder in ("meshes", "textures"):
        (tmp_path / folder).mkdir()
    Image.new("RGB", (2, 2), (0, 200, 0)).save(tmp_path / "textures" / "skin.png")
    textured(tmp_path / "meshes" / "box.dae", "../textures/skin.png", "diffuse")
    assert [colour for *_, colour in drawn_mesh(str(tmp_path / "meshes" / "box.dae"), 100)] == ["#00c800"]


def test_large_meshes_get_more_triangles(tmp_path):
    """Of 8000 triangles for all meshes, and a changed file is read again."""
    trimesh = pytest.importorskip("trimesh")
    trimesh.creation.icosphere(subdivisions=5, radius=1.0).export(tmp_path / "ball.stl")
    text = "".join(f'[[shape]]\nkind = "mesh"\nfile = "ball.stl"\nsize = [{s}, {s}, {s}]\n' for s in [1.0] + 40 * [0.1])
    big, *small = [len(solid.triangles) for solid in with_solids(describe(model(tmp_path, text)))[0].drawing["solids"]]
    assert big > 800 and max(small) < 200 and big + sum(small) <= 8000
    (tmp_path / "ball.stl").write_bytes(trimesh.creation.box().export(file_type="stl"))
    assert len(with_solids(describe(model(tmp_path, text)))[0].drawing["solids"][0].triangles) == 12


def test_a_missing_or_damaged_mesh_is_one_warning(tmp_path):
    (tmp_path / "bad.stl").write_text("no mesh")
    text = "".join(f'[[shape]]\nkind = "mesh"\nfile = "{file}.stl"\n' for file in ("gone", "bad", "gone"))
    done = command("show", model(tmp_path, SHAPES + text), "-o", tmp_path / "page.html")
    assert done.returncode == 0 and len(done.stderr.splitlines()) == 1
    assert "gone.stl' does not exist; not drawn (2 more)" in done.stderr
    only = describe(model(tmp_path, '[[shape]]\nkind = "mesh"\nfile = "bad.stl"\n'))
    assert "bad.stl'" in with_solids(only)[1][0]


def test_the_meshes_of_an_fmu_are_beside_it_or_in_the_current_folder(tmp_path, monkeypatch, capsys):
    """`show arm.fmu` draws the same solids as `show arm.toml`, although the FMU does not contain the mesh."""
    (tmp_path / "meshes").mkdir()
    (tmp_path / "meshes" / "part.stl").write_text(stl())
    (tmp_path / "arm.toml").write_text(ARM + '[[shape]]\nlink = "lower"\nkind = "mesh"\nfile = "meshes/part.stl"\n')
    (tmp_path / "elsewhere").mkdir()
    monkeypatch.chdir(tmp_path)
    for target in ("arm.fmu", "elsewhere/arm.fmu"):
        assert main(["build", "--no-show", "arm.toml", "-o", target]) == 0
        assert main(["show", target, "-o", "page.html", "--stop", "0.1"]) == 0
        assert '"solids":[{"link":1' in (tmp_path / "page.html").read_text()
        assert "not drawn" not in capsys.readouterr().err


def test_stills_and_films_draw_them(tmp_path):
    shown, _ = with_solids(describe(model(tmp_path)))
    bare = describe(model(tmp_path, ""))
    assert draw(shown.drawing, "arm") == draw(shown.drawing, "arm") != draw(bare.drawing, "arm")
    done = command("show", model(tmp_path), "--gif", tmp_path / "arm.gif", "--stop", "0.1")
    assert done.returncode == 0, done.stderr
    done = command("build", model(tmp_path), "-o", tmp_path / "arm.fmu")
    assert done.returncode == 0, done.stderr


@needs_browser
def test_the_browser_moves_them_with_their_links(tmp_path):
    done = command("show", model(tmp_path), "-o", tmp_path / "page.html", "--stop", "0.1")
    assert done.returncode == 0, done.stderr
    dom = browse(f"{(tmp_path / 'page.html').as_uri()}#t=0", tmp_path, "--dump-dom")
    ground, corner = json.loads(attribute(dom, "solids"))
    assert ground[2] == pytest.approx(-0.025, abs=1e-6)
    # the first corner of the box: (-0.2, -0.04, -0.03) turned by 90 deg about x, then moved by 0.2 along the lower link
    start = rotation_x(math.pi / 2) @ (
        [0.4, 0, 0] + rotation_z(math.pi / 6) @ ([0.2, 0, 0] + rotation_x(math.pi / 2) @ [-0.2, -0.04, -0.03])
    )
    assert corner == pytest.approx(start, abs=1e-6)


ROBOT = """<robot name="r"><material name="blue"><color rgba="0 0 1 1"/></material>
<link name="base"><visual><geometry><cylinder radius="0.1" length="0.2"/></geometry><material name="blue"/></visual></link>
<link name="arm"><inertial><mass value="1"/><inertia ixx="1" iyy="1" izz="1"/></inertial>
  <visual><origin xyz="0.1 0.2 0.3" rpy="0.1 0.2 0.3"/><geometry><box size="1 2 3"/></geometry><material name=""><color rgba="1 0 0 0.5"/></material></visual>
  <visual><geometry><mesh filename="package://robot/meshes/part.stl" scale="0.001 0.001 0.001"/></geometry></visual>
  <visual><geometry><mesh filename="package://robot/meshes/gone.stl"/></geometry></visual>
  <visual><geometry><cone/></geometry></visual></link>
<joint name="j" type="revolute"><origin xyz="0 0 1" rpy="0.4 0 0"/><parent link="base"/><child link="arm"/><axis xyz="0 1 0"/><limit lower="-1" upper="1"/></joint>
</robot>"""


@pytest.fixture
def robot(tmp_path):
    for folder in ("urdf", "meshes"):
        (tmp_path / "robot" / folder).mkdir(parents=True)
    (tmp_path / "robot" / "meshes" / "part.stl").write_text(stl())
    path = tmp_path / "robot" / "urdf" / "r.urdf"
    path.write_text(ROBOT, encoding="utf-8")
    return path


def test_visuals_become_shapes(robot):
    draft = urdf.read(robot, import_options())
    base, box, mesh = (tie.fields for tie in draft.shapes)
    assert base == {"link": "ground", "kind": "cylinder", "size": [0.1, 0.2], "color": [0, 0, 1]}
    assert box["color"] == [1, 0, 0, 0.5] and mesh["size"] == [0.001] * 3 and mesh["file"].endswith("meshes/part.stl")
    assert "<visual>: 1 <cone> shapes" in draft.lost
    assert "1 <visual> meshes: files not found: package://robot/meshes/gone.stl" in draft.lost
    # where the URDF has it
    pose = pose_of(draft.links[0].dh, "revolute", draft.links[0].q)
    roll, pitch, yaw = box["rpy"]
    turn = pose[:3, :3] @ rotation_z(yaw) @ rotation_y(pitch) @ rotation_x(roll)
    assert pose[:3, :3] @ box["position"] + pose[:3, 3] == pytest.approx(np.array([0, 0, 1]) + rotation_x(0.4) @ [0.1, 0.2, 0.3], abs=1e-12)
    assert turn == pytest.approx(rotation_x(0.4) @ rotation_z(0.3) @ rotation_y(0.2) @ rotation_x(0.1), abs=1e-12)
    assert not urdf.read(robot, import_options(shapes=False)).shapes


@pytest.mark.parametrize(
    ("old", "new", "sentence"),
    [
        (
            'radius="0.1" length="0.2"',
            'radius="0" length="0.2"',
            "<visual>: 1 <cylinder> shapes: {}:2: the size of <cylinder> must be > 0, got 0",
        ),
        ("0.001 0.001 0.001", "1 1 1 1", "<visual>: 1 <mesh> shapes: {}:5: 'scale' of <mesh> must be 3 numbers, got '1 1 1 1'"),
    ],
)
def test_a_wrong_visual_is_omitted_with_its_place(robot, old, new, sentence):
    robot.write_text(ROBOT.replace(old, new), encoding="utf-8")
    draft = urdf.read(robot, import_options())
    assert sentence.format(robot) in draft.lost and len(draft.shapes) == 2 and draft.links[0].mass == 1


def test_mesh_files_are_relative_to_the_model_file(robot, tmp_path, monkeypatch):
    (tmp_path / "models").mkdir()
    monkeypatch.chdir(tmp_path)
    done = command("import", robot, "-o", "models/r.toml")
    assert done.returncode == 0, done.stderr
    assert 'file = "../robot/meshes/part.stl"' in (tmp_path / "models" / "r.toml").read_text()
    monkeypatch.chdir(robot.parent)
    assert not with_solids(describe(tmp_path / "models" / "r.toml"))[1]
