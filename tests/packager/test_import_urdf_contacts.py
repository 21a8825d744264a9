"""Contacts from the <collision> shapes of a URDF: places in the ground frame, parameters, start height, and what is reported."""

import math
import re
from pathlib import Path

import numpy as np
import pytest

from build_fmu.cli import main
from build_fmu.errors import UserError
from build_fmu.importers import sdf, urdf
from build_fmu.importers.rigid import pose_of, rotation_x, rotation_y, rotation_z, transform
from build_fmu.run.session import Session
from build_fmu.run.simulate import Settings, simulate
from tests.packager.import_options import import_options

ROOT = Path(__file__).parents[2]
INERTIAL = '<inertial><mass value="{}"/><inertia ixx="0.01" iyy="0.01" izz="0.01"/></inertial>'


def link(name, shape="", mass=1.0, xyz="0 0 0", rpy="0 0 0"):
    collision = f'<collision><origin xyz="{xyz}" rpy="{rpy}"/><geometry>{shape}</geometry></collision>' if shape else ""
    return f'<link name="{name}">{INERTIAL.format(mass)}{collision}</link>'


def joint(name, parent, child, xyz="0 0 0", rpy="0 0 0", axis="0 1 0", kind="continuous"):
    ends = f'<parent link="{parent}"/><child link="{child}"/>'
    return f'<joint name="{name}" type="{kind}">{ends}<origin xyz="{xyz}" rpy="{rpy}"/><axis xyz="{axis}"/></joint>'


# two legs below a trunk: hip, knee, and a foot at the end of the shank
TWO_LEGS = link("trunk", '<box size="0.4 0.2 0.1"/>', 2.0) + "".join(
    link(f"{side}_thigh", '<cylinder radius="0.02" length="0.2"/>', 0.5, "0 0 -0.1")
    + link(f"{side}_foot", '<sphere radius="0.03"/>', 0.25, "0.01 0 -0.2")
    + joint(f"{side}_hip", "trunk", f"{side}_thigh", f"{x} 0 -0.05", axis="0 1 0")
    + joint(f"{side}_knee", f"{side}_thigh", f"{side}_foot", "0 0 -0.2", axis="0 1 0")
    for side, x in (("left", 0.15), ("right", -0.15))
)


def imported(tmp_path, content, contact="ground", pose=(), floating=True):
    path = tmp_path / "dog.urdf"
    path.write_text(f'<robot name="dog">{content}</robot>', encoding="utf-8")
    return urdf.read(path, import_options(floating=floating, contact=contact, pose=list(pose)))


def poses_of(draft):
    poses = {"ground": np.eye(4)}
    for body in draft.links:
        free = body.joint == "free"
        poses[body.name] = poses[body.parent] @ pose_of(body.dh, body.joint, 0.0 if free else body.q)
        if free and body.q:
            poses[body.name] = poses[body.name] @ transform(None, body.q[:3])
    return poses


def in_ground(draft, contact, key):
    pose = poses_of(draft)[contact.fields["link_a"]]
    return pose[:3, :3] @ contact.fields[key] + pose[:3, 3]


def test_feet_touch_the_ground_in_the_start_pose(tmp_path):
    draft = imported(tmp_path, TWO_LEGS, pose=["*_hip=0.5", "*_knee=-0.9"])
    assert [contact.name for contact in draft.contacts] == ["left_foot_contact", "right_foot_contact"]
    for contact, x in zip(draft.contacts, (0.15, -0.15), strict=True):
        assert contact.fields["shape_a"] == "sphere" and contact.fields["radius_a"] == 0.03
        # rotations about y: the thigh by 0.5, the shank by 0.5 - 0.9
        knee = rotation_y(0.5) @ [0, 0, -0.2]
        place = np.array([x, 0, -0.05]) + knee + rotation_y(-0.4) @ [0.01, 0, -0.2]
        assert in_ground(draft, contact, "point_a") == pytest.approx([place[0], 0, 0.03], abs=1e-12)
        assert draft.links[0].q[2] == pytest.approx(0.03 - place[2], abs=1e-12)
    assert draft.links[0].drive == "free" and draft.solver == {}
    weight = 9.81 * (2 + 2 * 0.75)
    assert draft.contacts[0].fields["stiffness"] == pytest.approx(weight / (2 * 0.95e-3), rel=0.05)
    said = " | ".join(draft.lost + draft.doubts)
    for part in (
        "contact of 3 shapes above the feet; --contact all includes them",
        "contact between links of the robot",
        "contact of 2 x <sphere> (left_foot, right_foot) with the plane z = 0: stiffness 18000 N/m (3.5 kg on 2 points: depth 1 mm)",
        "damping 2 s/m, friction 0.8, friction_velocity 0.001 m/s are assumed",
    ):
        assert part in said, said


def test_a_flat_foot_has_four_points(tmp_path):
    flat = TWO_LEGS.replace('<sphere radius="0.03"/>', '<box size="0.1 0.3 0.006"/>')
    draft = imported(tmp_path, flat)
    assert [contact.fields["shape_a"] for contact in draft.contacts] == ["box", "box"]
    assert any("(3.5 kg on 8 points: depth 1 mm)" in doubt for doubt in draft.doubts)


def test_narrow_feet_resist_tilting(tmp_path):
    """Feet of 0.05 m below a center of mass at 0.403 m: the stiffness follows from the moment of tilted feet, not from the depth."""
    draft = imported(tmp_path, TWO_LEGS.replace('<sphere radius="0.03"/>', '<box size="0.1 0.05 0.006"/>'))
    assert draft.contacts[0].fields["stiffness"] == pytest.approx(5 * 3.5 * 9.81 * 0.403 / (8 * 0.025**2), rel=0.05)
    assert any("(3.5 kg on 8 points: 5 times what keeps the robot upright)" in doubt for doubt in draft.doubts)
    # an ankle that is a little higher, of a link above the foot, carries no weight
    ankle = '</inertial><collision><origin xyz="0.01 0 -0.347"/><geometry><box size="0.05 0.05 0.1"/></geometry></collision>'
    both = imported(tmp_path, TWO_LEGS.replace('<sphere radius="0.03"/>', '<box size="0.1 0.05 0.006"/>').replace("</inertial>", ankle, 2))
    assert len(both.contacts) == 3 and both.contacts[0].fields["stiffness"] == draft.contacts[0].fields["stiffness"]


def test_all_shapes(tmp_path):
    draft = imported(tmp_path, TWO_LEGS, contact="all")
    kinds = sorted(contact.fields["shape_a"] for contact in draft.contacts)
    assert kinds == ["box", "points", "points", "sphere", "sphere"]
    said = " | ".join(draft.lost + draft.doubts)
    assert "shapes above" not in said
    assert "<cylinder> of left_thigh, right_thigh: each is 16 points on the rims, because it stands upright" in said
    # straight legs: hip at -0.05, knee and foot 0.2 m below each other, radius 0.03
    assert draft.links[0].q[2] == pytest.approx(0.48, abs=1e-12)
    rims = next(contact for contact in draft.contacts if contact.fields["shape_a"] == "points")
    pose = poses_of(draft)[rims.fields["link_a"]]
    heights = sorted({round((pose[:3, :3] @ point + pose[:3, 3])[2], 9) for point in rims.fields["points_a"]})
    assert heights == [0.23, 0.43] and len(rims.fields["points_a"]) == 16


def test_places_of_all_kinds_of_shapes(tmp_path):
    """A body at a general pose: each shape lies where the URDF has it, also relative to the frame of the model."""
    at, turn = np.array([0.1, -0.2, 0.3]), rotation_z(0.4) @ rotation_y(-0.3) @ rotation_x(0.2)
    origin = {"xyz": "0.1 -0.2 0.3", "rpy": "0.2 -0.3 0.4"}
    shapes = {
        "sphere": '<sphere radius="0.05"/>',
        "box": '<box size="0.2 0.3 0.4"/>',
        "capsule": '<capsule radius="0.05" length="0.4"/>',
        "wheel": '<cylinder radius="0.2" length="0.1"/>',
    }
    chain = link("trunk", mass=3) + "".join(
        link(name, shape, 1.0, origin["xyz"], "1.3 -0.3 0.4" if name == "wheel" else origin["rpy"])
        + joint(f"{name}_joint", "trunk", name, "0.5 0 0", "0.1 0.2 0.3", axis="0.6 0 0.8")
        for name, shape in shapes.items()
    )
    draft = imported(tmp_path, chain, contact="all")
    lift = draft.links[0].q[2]
    carrier_turn = rotation_z(0.3) @ rotation_y(0.2) @ rotation_x(0.1)
    center = np.array([0.5, 0, lift]) + carrier_turn @ at
    of = {name: [contact for contact in draft.contacts if contact.fields["link_a"] == name] for name in shapes}
    assert in_ground(draft, of["sphere"][0], "point_a") == pytest.approx(center, abs=1e-12)
    assert in_ground(draft, of["box"][0], "point_a") == pytest.approx(center, abs=1e-12)
    roll, pitch, yaw = of["box"][0].fields["rpy_a"]
    found = poses_of(draft)["box"][:3, :3] @ rotation_z(yaw) @ rotation_y(pitch) @ rotation_x(roll)
    assert np.allclose(found, carrier_turn @ turn, atol=1e-11)
    axis = carrier_turn @ turn[:, 2]
    for key, side in (("point_a", -1), ("point_a2", 1)):
        assert in_ground(draft, of["capsule"][0], key) == pytest.approx(center + side * 0.2 * axis, abs=1e-11)
    axis = carrier_turn @ (rotation_z(0.4) @ rotation_y(-0.3) @ rotation_x(1.3))[:, 2]
    for disk, side in zip(of["wheel"], (-1, 1), strict=True):
        assert disk.fields["shape_a"] == "disk" and disk.fields["radius_a"] == 0.2
        assert in_ground(draft, disk, "point_a") == pytest.approx(center + side * 0.05 * axis, abs=1e-11)
        assert poses_of(draft)["wheel"][:3, :3] @ disk.fields["axis_a"] == pytest.approx(axis, abs=1e-11)
    assert any("<cylinder> of wheel: each is two disks" in said for said in draft.doubts)


def test_the_height_of_several_floating_bases_stays(tmp_path):
    balls = "".join(link(name, '<sphere radius="0.1"/>') + joint(f"j_{name}", "base", name, "0 0 0.5", kind="floating") for name in "ab")
    draft = imported(tmp_path, link("base") + balls, floating=False)
    assert any("starts 0.4 m above the ground plane; there are several floating bases" in doubt for doubt in draft.doubts)


def block(tmp_path, length, width, height):
    """Writes a box as a mesh, with a point in the middle of each face, which is not needed for contact."""
    import trimesh

    trimesh.creation.box((length, width, height)).subdivide().export(tmp_path / "block.stl")
    return '<mesh filename="block.stl"/>'


@pytest.mark.parametrize("tilt", [0, 0.5])
@pytest.mark.parametrize(("sides", "count"), [(4, 8), (10, 20), (16, 32), (24, None)])
def test_a_mesh_touches_with_all_corners_of_a_small_hull(tmp_path, sides, count, tilt):
    """A prism, whose corners are known; its mesh has more points on edges and faces. The gap of others is that in random directions."""
    import trimesh

    mesh = trimesh.creation.cylinder(0.1, 0.3, sections=sides)
    mesh.subdivide().export(tmp_path / "prism.obj")
    draft = imported(tmp_path, link("stone", '<mesh filename="prism.obj"/>', rpy=f"{tilt} 0 0"), "all")
    assert "contact between links of the robot" not in draft.lost
    points = np.array(draft.contacts[0].fields["points_a"])
    assert len(points) == count or count is None
    directions = np.random.default_rng(1).normal(size=(20000, 3))
    directions /= np.linalg.norm(directions, axis=1)[:, None]
    gap = max((directions @ rotation_x(tilt) @ mesh.vertices.T).max(axis=1) - (directions @ points.T).max(axis=1))
    found = re.search(r"others lie up to (\S+) mm outside", next(doubt for doubt in draft.doubts if doubt.startswith("<mesh>")))
    assert float(found[1] if found else 0) / 1000 == pytest.approx(gap, rel=0.05, abs=1e-6)


def test_a_mesh_touches_with_its_extreme_points(tmp_path):
    """A long flat foot as a mesh, tilted in its link: its corners are contact points, and the lowest ones touch the ground."""
    foot = block(tmp_path, 0.3, 0.08, 0.02)
    flat = TWO_LEGS.replace('<sphere radius="0.03"/>', foot).replace(
        'rpy="0 0 0"/><geometry><mesh', 'rpy="0.3 0 1.5707963267948966"/><geometry><mesh'
    )
    draft = imported(tmp_path, flat)
    assert [contact.fields["shape_a"] for contact in draft.contacts] == ["points", "points"]
    turn = rotation_z(math.pi / 2) @ rotation_x(0.3)
    for contact, x in zip(draft.contacts, (0.15, -0.15), strict=True):
        pose = poses_of(draft)["trunk"]
        center = pose[:3, 3] + [x + 0.01, 0, -0.45]
        found = [poses_of(draft)[contact.fields["link_a"]] @ [*point, 1] for point in contact.fields["points_a"]]
        for corner in np.ndindex(2, 2, 2):
            place = center + turn @ (np.array([0.3, 0.08, 0.02]) * (np.array(corner) - 0.5))
            assert min(np.linalg.norm(point[:3] - place) for point in found) < 1e-6, corner
        assert min(point[2] for point in found) == pytest.approx(0, abs=1e-7)
        assert len(found) <= 33
    said = " | ".join(draft.lost + draft.doubts)
    assert "contact of 2 x <mesh> (left_foot, right_foot) with the plane z = 0" in said
    assert "corners of its convex hull; it does not roll smoothly" in said and "cannot be read" not in said
    hats = "".join(link(name, '<mesh filename="hat.stl"/>') + joint(f"{name}_joint", "trunk", name) for name in ("hat", "hood"))
    said = imported(tmp_path, flat + hats).doubts
    assert "2 meshes of hat, hood cannot be read, but may be feet: check the contacts, or add [[contact]] by hand" in said


def test_without_collision_the_visual_shapes_touch(tmp_path):
    draft = imported(tmp_path, TWO_LEGS.replace("collision>", "visual>"))
    assert [contact.name for contact in draft.contacts] == ["left_foot_contact", "right_foot_contact"]
    assert "the file has no <collision>: the <visual> shapes touch the ground" in draft.doubts
    with pytest.raises(UserError, match="has no <collision> or <visual> of sphere"):
        imported(tmp_path, link("trunk") + link("arm") + joint("j", "trunk", "arm"))


def test_the_ground_is_below_a_fixed_base(tmp_path):
    """A hand at the origin whose finger hangs down does not start deep in the ground."""
    content = link("palm") + link("finger", '<sphere radius="0.01"/>', xyz="0 0 -0.1") + joint("j", "palm", "finger")
    draft = imported(tmp_path, content, floating=False)
    assert draft.contacts[0].fields["point_b"] == pytest.approx([0, 0, -0.11])
    assert any("the ground plane is at z = -0.11 m" in doubt for doubt in draft.doubts)


def limited_knees(low, high):
    free = 'type="continuous"><parent link="{0}_thigh"/>'
    legs = TWO_LEGS
    for side in ("left", "right"):
        head, tail = legs.split(free.format(side), 1)
        tail = tail.replace("</joint>", f'<limit lower="{low}" upper="{high}"/></joint>', 1)
        legs = head + free.format(side).replace("continuous", "revolute") + tail
    return legs


def test_the_feet_of_bent_legs_stay_below_the_hips(tmp_path):
    """Knees that cannot be straight: the hips turn back, so that the foot has the direction of the straight leg."""
    draft = imported(tmp_path, limited_knees(-2.0, -0.9))
    of = {link.name: link for link in draft.links}
    assert of["left_foot"].q == pytest.approx(-0.955)
    assert any("the feet stay below: left_hip = " in doubt for doubt in draft.doubts)
    for side, x in (("left", 0.15), ("right", -0.15)):
        contact = next(c for c in draft.contacts if c.fields["link_a"] == f"{side}_foot")
        assert in_ground(draft, contact, "point_a")[0] == pytest.approx(x, abs=0.02)
    turned = imported(tmp_path, limited_knees(-2.0, -0.9), pose=["*_hip=0.1"])
    assert not any("the feet stay below" in doubt for doubt in turned.doubts)
    assert {link.name: link for link in turned.links}["left_thigh"].q == 0.1


def test_a_center_of_mass_outside_the_feet_is_reported(tmp_path):
    """Feet at x = 0.15 and -0.15 m; the trunk of 2 of 3.5 kg is moved along x, the legs stay."""
    feet = TWO_LEGS.replace('<sphere radius="0.03"/>', '<box size="0.1 0.2 0.01"/>')

    def said(x):
        content = feet.replace('<inertial><mass value="2.0"/>', f'<inertial><origin xyz="{x} 0 0"/><mass value="2.0"/>')
        return [doubt for doubt in imported(tmp_path, content).doubts if "center of mass" in doubt]

    # the boxes are at 0.16 and -0.14 m and reach 0.05 m farther
    edge = 0.21 * 3.5 / 2
    # 0.4 m above the ground a tilt of 0.02 rad moves the center by 8 mm
    assert not said(0) and not said(edge - 0.012 * 3.5 / 2)
    assert "the center of mass is 0.01 m outside the feet" in said(edge + 0.01 * 3.5 / 2)[0]
    assert "m inside the edge of the feet" in said(edge - 0.005 * 3.5 / 2)[0]


def test_a_single_ball_has_no_pose_to_choose(tmp_path):
    draft = imported(tmp_path, link("ball", '<sphere radius="0.1"/>'))
    assert len(draft.contacts) == 1
    assert not any("center of mass" in doubt for doubt in draft.doubts)


def test_what_is_not_converted(tmp_path):
    base = link("base", '<box size="1 1 0.1"/>')
    arm = link("arm", '<sphere radius="0.1" colour="red"/>') + link("tool", '<mesh filename="a.stl"/>')
    content = base + arm + joint("j", "base", "arm", "0 0 0.4") + joint("k", "arm", "tool")
    draft = imported(tmp_path, content, floating=False)
    said = " | ".join(draft.lost + draft.doubts)
    for part in (
        "contact of 1 <mesh> shapes: mesh file 'a.stl' does not exist",
        "contact of 1 shapes of links that are fixed to the ground",
        "1 mesh of tool cannot be read, but may be feet",
        "the lowest contact point starts 0.3 m above the ground plane; the base is not floating",
        "'colour' of <sphere>",
    ):
        assert part in said, said
    assert [contact.name for contact in draft.contacts] == ["arm_contact"]
    without = imported(tmp_path, content, contact=None, floating=False)
    assert not without.contacts and not without.solver
    assert any("3 <collision> shapes: --contact ground converts" in line for line in without.lost)


@pytest.mark.parametrize(
    ("content", "pose", "sentence"),
    [
        (
            TWO_LEGS.replace("<sphere", '<mesh filename="a.stl"').replace("<box", '<mesh filename="a.stl"').replace("<cylinder", "<cone"),
            [],
            "--contact: 3 <mesh> shapes cannot be converted: mesh file 'a.stl' does not exist; write [[contact]] by hand",
        ),
        (
            TWO_LEGS.replace('radius="0.0', 'radius="-0.0').replace("0.4 0.2 0.1", "0 0 0"),
            [],
            "mesh; omitted: 1 <box> shapes: {file}:1: the size of <box> must be > 0, got 0; omitted: 2 <cylinder> shapes: {file}:1: ",
        ),
        (TWO_LEGS, ["left_hop=1"], "no revolute or prismatic joint is called 'left_hop'; did you mean 'left_hip'?"),
        (TWO_LEGS, ["left_hip=high"], "'left_hip=high' must be JOINT=VALUE with a number in rad or m"),
        (TWO_LEGS, ["left_hip"], "'left_hip' must be JOINT=VALUE"),
    ],
)
def test_mistakes(tmp_path, content, pose, sentence):
    with pytest.raises(UserError) as error:
        imported(tmp_path, content, pose=pose)
    assert sentence.replace("{file}", str(tmp_path / "dog.urdf")) in str(error.value) and "\n" not in str(error.value)


@pytest.mark.parametrize(
    ("old", "new", "sentence"),
    [
        ('<sphere radius="0.03"/>', '<sphere radius="0"/>', "1 <sphere> shapes: {}:1: the size of <sphere> must be > 0, got 0"),
        (
            '<sphere radius="0.03"/>',
            '<mesh filename="a.stl" scale="1 1 1 1"/>',
            "1 <mesh> shapes: {}:1: 'scale' of <mesh> must be 3 numbers",
        ),
        ('size="0.4 0.2 0.1"', 'size="0.4 0.2"', "1 <box> shapes: {}:1: 'size' of <box> must be 3 numbers, got '0.4 0.2'"),
    ],
)
def test_a_wrong_shape_is_omitted_with_its_place(tmp_path, old, new, sentence):
    whole, draft = imported(tmp_path, TWO_LEGS, contact="all"), imported(tmp_path, TWO_LEGS.replace(old, new, 1), contact="all")
    assert f"contact of {sentence.format(tmp_path / 'dog.urdf')}" in " | ".join(draft.lost)
    assert len(draft.contacts) == len(whole.contacts) - 1
    assert [link.mass for link in draft.links] == [link.mass for link in whole.links]


@pytest.mark.parametrize("gravity", [40.0, 1.62, 0.0])
def test_the_stiffness_follows_the_gravity_of_the_model(tmp_path, gravity):
    """A ball of an SDF world; without gravity as on earth."""
    body = "<inertial><mass>2</mass></inertial><collision name='c'><geometry><sphere><radius>0.1</radius></sphere></geometry></collision>"
    joint = "<joint name='j' type='revolute'><parent>b</parent><child>a</child><axis><xyz>0 1 0</xyz></axis></joint>"
    model = f"<model name='m'><link name='b'>{body}</link><link name='a'><inertial><mass>1</mass></inertial></link>{joint}</model>"
    (tmp_path / "ball.sdf").write_text(f"<sdf version='1.9'><world name='w'><gravity>0 0 -{gravity}</gravity>{model}</world></sdf>")
    draft = sdf.read(tmp_path / "ball.sdf", import_options(contact="all"))
    assert draft.contacts[0].fields["stiffness"] == pytest.approx(3 * (gravity or 9.81) / (1e-3 - 1e-4 / 2), rel=0.05)
    assert any("at 9.81 m/s2" in doubt for doubt in draft.doubts) == (gravity == 0)


@pytest.mark.parametrize(("words", "sentence"), [
    (["--contact", "all"], "--contact has no effect on 'arm.csv': it applies to URDF, MJCF and SDF files"),
    (["--loop", "a:0,0,0=b:0,0,0"], "--loop has no effect on 'arm.csv': it applies to ReDySim's files"),
])  # fmt: skip
def test_an_option_of_another_format_is_refused(tmp_path, capsys, words, sentence):
    (tmp_path / "arm.csv").write_text("name, a [m], mass [kg]\nrod, 0, 1\n")
    assert main(["import", str(tmp_path / "arm.csv"), "--dh", "modified", *words, "-o", str(tmp_path / "arm.toml")]) == 2
    assert sentence in capsys.readouterr().err and not (tmp_path / "arm.toml").exists()


def test_the_pose_is_compared_with_the_limits(tmp_path):
    limited = TWO_LEGS.replace('<axis xyz="0 1 0"/></joint>', '<axis xyz="0 1 0"/><limit lower="0.2" upper="1"/></joint>', 1)
    limited = limited.replace('type="continuous"', 'type="revolute"', 1)
    said = "outside the limits of left_hip (0.2 to 1): set it with --pose JOINT=VALUE"
    assert any(said in doubt for doubt in imported(tmp_path, limited, pose=["left_hip=0"]).doubts)
    assert not any(said in doubt for doubt in imported(tmp_path, limited, pose=["left_hip=0.5"]).doubts)


@pytest.mark.usefixtures("built_library")
def test_a_dropped_ball_rests_one_millimetre_deep(tmp_path):
    ball = link("ball", '<sphere radius="0.1"/>', 0.7)
    (tmp_path / "ball.urdf").write_text(f'<robot name="ball">{ball}</robot>', encoding="utf-8")
    assert main(["import", str(tmp_path / "ball.urdf"), "--floating", "--contact", "ground", "-o", str(tmp_path / "ball.toml")]) == 0
    assert main(["build", "--no-show", str(tmp_path / "ball.toml"), "-o", str(tmp_path / "ball.fmu")]) == 0
    with Session(tmp_path / "ball.fmu") as session:
        result = simulate(session, Settings(3, 0.01, 1e-8, ["ball[3].q0=0.3"]))
    assert result["ball_contact.depth"][0] == pytest.approx(-0.2, abs=1e-12)
    # the stiffness has two digits
    assert result["ball_contact.depth"][-1] == pytest.approx(1e-3, rel=0.05)
    assert result["ball_contact.force[3]"][-1] == pytest.approx(0.7 * 9.81, rel=1e-3)
    assert math.isclose(result["ball[3].q"][-1], 0.1 - result["ball_contact.depth"][-1], abs_tol=1e-9)


@pytest.mark.usefixtures("built_library")
def test_the_dog_of_the_tutorial_lands_and_stands(tmp_path):
    model = tmp_path / "dog.toml"
    words = ["--floating", "--contact", "ground", "--pose", "*_hip=0.7", "--pose", "*_knee=-1.4", "-o", str(model)]
    assert main(["import", str(ROOT / "examples" / "dog.urdf"), *words]) == 0
    model.write_text(model.read_text() + '\n[controller]\nlaw = "pd"\nkp = 80\nkd = 2\n')
    assert main(["build", "--no-show", str(model), "-o", str(tmp_path / "dog.fmu")]) == 0
    with Session(tmp_path / "dog.fmu") as session:
        result = simulate(session, Settings(4, 0.01, None, ["trunk[3].q0=0.5"]))
    feet = [f"{leg}_shank_contact" for leg in ("fl", "fr", "hl", "hr")]
    assert all(result[f"{foot}.depth"][0] < -0.1 and result[f"{foot}.force[3]"][-1] > 10 for foot in feet)
    assert sum(result[f"{foot}.force[3]"][-1] for foot in feet) == pytest.approx(10 * 9.81, rel=1e-2)
    assert 0.3 < result["trunk[3].q"][-1] < 0.33 and abs(result["trunk[3].qd"][-1]) < 1e-3
