"""Masses by --density and --mass: volumes and inertias of solids against fine meshes and closed forms, imports without masses."""

import math

import numpy as np
import pytest

from build_fmu.importers.rigid import rotation_x, rotation_z, transform
from build_fmu.importers.solids import Solid, about, body_of, is_open, joined
from tests.command_line import command

KINEMATIC = """<robot name="arm">
  <link name="base"/>
  <link name="upper"><visual><origin xyz="0.2 0 0" rpy="0 1.5707963267948966 0"/><geometry><cylinder radius="0.03" length="0.4"/></geometry></visual></link>
  <link name="fore"><collision><geometry><box size="0.1 0.2 0.3"/></geometry></collision>
    <visual><geometry><sphere radius="9"/></geometry></visual></link>
  <link name="tool"/>
  <joint name="shoulder" type="revolute"><parent link="base"/><child link="upper"/><axis xyz="0 1 0"/>
    <limit lower="0.5" upper="1.5" effort="1" velocity="1"/></joint>
  <joint name="elbow" type="revolute"><origin xyz="0.4 0 0"/><parent link="upper"/><child link="fore"/><axis xyz="0 1 0"/>
    <limit lower="-1" upper="1" effort="1" velocity="1"/></joint>
  <joint name="end" type="fixed"><origin xyz="0 0 0.2"/><parent link="fore"/><child link="tool"/></joint>
</robot>"""
TABLE = "type,alpha [deg],a,theta [deg],d\nR,0,0,q1,0.4\nR,0,0.3,q2,0\nP,180,0.25,0,q3\n"


@pytest.fixture
def here(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "arm.urdf").write_text(KINEMATIC)
    (tmp_path / "arm.csv").write_text(TABLE)
    return tmp_path


@pytest.mark.parametrize(
    ("solid", "kind", "values"),
    [
        (Solid("box", [0.2, 0.3, 0.5]), "box", {"extents": [0.2, 0.3, 0.5]}),
        (Solid("cylinder", [0.2, 0.7]), "cylinder", {"radius": 0.2, "height": 0.7, "sections": 1024}),
        (Solid("capsule", [0.2, 0.7]), "capsule", {"radius": 0.2, "height": 0.7, "count": [512, 256]}),
        (Solid("sphere", [0.3]), "icosphere", {"radius": 0.3, "subdivisions": 6}),
    ],
    ids=lambda value: value.kind if isinstance(value, Solid) else "",
)
def test_solids_have_the_mass_properties_of_their_fine_mesh(solid, kind, values):
    trimesh = pytest.importorskip("trimesh")
    mesh = getattr(trimesh.creation, kind)(**values)
    place = transform(rotation_z(0.4) @ rotation_x(1.1), (0.1, -0.2, 0.3))
    mesh.apply_translation(-mesh.center_mass)
    mesh.apply_transform(place)
    truth = mesh.mass_properties
    solid.pose = place
    body = body_of(solid)
    assert body.mass == pytest.approx(truth["mass"], rel=5e-4)
    np.testing.assert_allclose(body.com, truth["center_mass"], atol=1e-6)
    np.testing.assert_allclose(body.inertia, truth["inertia"], rtol=1e-3, atol=1e-7)


def test_a_mesh_is_integrated_exactly(tmp_path):
    trimesh = pytest.importorskip("trimesh")
    mesh = trimesh.creation.box(extents=[0.2, 0.3, 0.5])
    mesh.apply_transform(transform(rotation_x(0.7), (1, 2, 3)))
    mesh.export(tmp_path / "box.stl")
    body = body_of(Solid("mesh", [1, -2, 1], file=str(tmp_path / "box.stl")))
    mesh.apply_transform(np.diag([1, -2, 1, 1]))
    assert body.mass == pytest.approx(0.06, rel=1e-6)
    np.testing.assert_allclose(body.com, [1, -4, 3], rtol=1e-6)
    np.testing.assert_allclose(body.inertia, mesh.moment_inertia, rtol=1e-5, atol=1e-9)
    assert not is_open(str(tmp_path / "box.stl"))


def test_an_open_mesh_counts_as_its_bounding_box(tmp_path):
    trimesh = pytest.importorskip("trimesh")
    mesh = trimesh.creation.box(extents=[1, 2, 3])
    mesh.update_faces(np.arange(len(mesh.faces)) > 0)
    mesh.export(tmp_path / "open.stl")
    body = body_of(Solid("mesh", [], file=str(tmp_path / "open.stl")))
    assert is_open(str(tmp_path / "open.stl")) and body.mass == pytest.approx(6, rel=1e-6)


def test_joined_is_the_parallel_axis_theorem():
    two = joined([body_of(Solid("box", [1, 1, 1], transform(None, (x, 0, 0)))) for x in (-0.5, 0.5)])
    one = body_of(Solid("box", [2, 1, 1]))
    np.testing.assert_allclose(two.inertia, one.inertia, rtol=1e-14)
    assert two.mass == one.mass and np.allclose(about(2.0, np.array([0, 0, 3.0])), np.diag([18, 18, 0]))


def test_density_fills_a_urdf_by_its_collision_or_visual_shapes(built_library, here):
    done = command("import", "arm.urdf", "--density", "1000")
    assert done.returncode == 0, done.stderr
    rod, box = 1000 * math.pi * 0.03**2 * 0.4, 1000 * 0.1 * 0.2 * 0.3
    assert f"check: masses and inertias of upper, fore: 1000 kg/m3 and shapes, {rod + box:.4g} kg in total" in done.stderr
    assert "check: without readable shapes and therefore without mass: tool" in done.stderr
    # stops by the masses that were filled in, and a start inside the limits
    text = (here / "arm.toml").read_text()
    assert "q = 0.55" in text and text.count("stop_stiffness") == 2
    assert command("simulate", "arm.toml", "--stop", "0.1").returncode == 0


def test_a_missing_mesh_without_a_mass_is_named(built_library, here):
    heavy = '<inertial><mass value="7"/><inertia ixx="1" iyy="1" izz="1" ixy="0" ixz="0" iyz="0"/></inertial>'
    gone = '<collision><geometry><mesh filename="gone.stl"/></geometry></collision>'
    text = KINEMATIC.replace('<link name="tool"/>', f'<link name="tool">{gone}</link>')
    for inertial, named in (("", 1), (heavy, 0)):
        (here / "arm.urdf").write_text(text.replace(gone, inertial + gone))
        done = command("import", "arm.urdf", "--mass", "5", "--force")
        assert done.returncode == 0 and done.stderr.count("omitted: mass of 1 meshes: files not found: gone.stl") == named
        assert done.stderr.count("check: without readable shapes and therefore without mass: tool") == named


def test_a_wrong_shape_without_a_mass_is_named(built_library, here):
    (here / "arm.urdf").write_text(
        KINEMATIC.replace(
            '<link name="tool"/>', '<link name="tool"><collision><geometry><sphere radius="0"/></geometry></collision></link>'
        )
    )
    done = command("import", "arm.urdf", "--mass", "5")
    assert done.returncode == 0, done.stderr
    assert "omitted: mass of 1 <sphere> shapes: arm.urdf:" in done.stderr and "the size of <sphere> must be > 0, got 0" in done.stderr
    assert "check: without readable shapes and therefore without mass: tool" in done.stderr


def test_mass_is_the_total_of_what_was_missing(built_library, here):
    done = command("import", "arm.urdf", "--mass", "5", "--json")
    assert done.returncode == 0 and "5 kg in total" in done.stderr
    assert '"mass": 5.0' in done.stdout


def test_link_lengths_give_the_mass_of_a_table(built_library, here):
    done = command("import", "arm.csv", "--dh", "modified", "--mass", "3")
    assert done.returncode == 0, done.stderr
    assert "link lengths, as rods, 3 kg in total" in done.stderr
    assert command("simulate", "arm.toml", "--stop", "0.1").returncode == 0


def test_without_masses_the_import_says_what_helps(built_library, here):
    for file in ("arm.urdf", "arm.csv"):
        done = command("import", file, "--force")
        assert "omitted: masses and inertias: the file contains none; --density or --mass fills them" in done.stderr
        done = command("show", "arm.toml")
        assert done.returncode == 0 and "the page shows its kinematics" in done.stderr


def test_options_that_contradict(here):
    assert "--density and --mass exclude each other" in command("import", "arm.urdf", "--density", "1", "--mass", "1").stderr


def test_masses_of_the_file_stay(built_library, here):
    heavy = '<inertial><mass value="7"/><inertia ixx="1" iyy="1" izz="1" ixy="0" ixz="0" iyz="0"/></inertial>'
    text = KINEMATIC.replace('<link name="fore">', f'<link name="fore">{heavy}')
    (here / "arm.urdf").write_text(text.replace('<link name="upper">', f'<link name="upper">{heavy}'))
    done = command("import", "arm.urdf", "--density", "1000")
    assert done.returncode == 0 and "--density has no effect: no moving link without a mass has a readable shape" in done.stderr
    assert (here / "arm.toml").read_text().count("mass = 7") == 2


@pytest.mark.parametrize("option", ["--density", "--mass"])
@pytest.mark.parametrize("floating", [(), ("--floating",)])
def test_a_single_link_whose_mesh_is_missing(built_library, here, option, floating):
    """Neither a shape nor a length gives its size."""
    (here / "one.urdf").write_text(
        '<robot name="one"><link name="a"><visual><geometry><mesh filename="b.stl"/></geometry></visual></link></robot>'
    )
    done = command("import", "one.urdf", option, "2", *floating)
    assert done.returncode == 1 and "Traceback" not in done.stderr
    assert ("no link has mass or inertia" if floating else "--floating makes its root link 'a' a floating base") in done.stderr
