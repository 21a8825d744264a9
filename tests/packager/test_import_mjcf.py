"""Conversion of MJCF files: chains of joints, classes, includes, constraints, actuators, keyframes, contacts, losses, errors."""

import math

import numpy as np
import pytest

from build_fmu.errors import UserError
from build_fmu.importers import mjcf
from build_fmu.importers.mjcf_file import of_quaternion, quaternion_of, towards, turn
from build_fmu.importers.rigid import inverse, rotation_z, start_poses
from build_fmu.importers.toml_writer import model_text
from build_fmu.model.describe import describe
from tests.command_line import command
from tests.packager.import_options import import_options

BAR = """<mujoco model="bar test"><option timestep="0.005"/>
<worldbody><geom name="floor" type="plane" size="1 1 1"/>
<body name="crank" pos="0 0 1"><joint name="c" axis="0 1 0" range="-90 90"/><geom type="capsule" fromto="0 0 0 0.3 0 0" size="0.02"/>
  <body name="rod" pos="0.3 0 0"><joint name="r" axis="0 1 0" ref="20" range="-1 170"/><geom type="capsule" fromto="0 0 0 0.5 0 0" size="0.02"/>
    <site name="end" pos="0.5 0 0"/></body></body>
<body name="rocker" pos="0.9 0 1"><joint name="o" axis="0 1 0"/><geom name="tip" type="sphere" size="0.05" rgba="1 0 0 0.5"/><site name="grip" pos="-0.1 0 0"/></body>
</worldbody>EXTRA</mujoco>"""


def imported(tmp_path, text, **options):
    path = tmp_path / "robot.xml"
    path.write_text(text)
    return mjcf.read(path, import_options(**options))


def link(draft, joint):
    return next(one for one in draft.links if joint in (one.joint_name, one.name))


def test_a_body_with_several_joints_is_a_chain(tmp_path):
    draft = imported(
        tmp_path,
        '<mujoco><worldbody><body name="b"><joint name="x" type="slide" axis="1 0 0"/><joint name="y" type="slide" axis="0 1 0"/>'
        '<joint axis="0 0 1"/><geom size="0.1"/></body></worldbody></mujoco>',
    )
    assert [(one.name, one.parent, one.joint, one.joint_name) for one in draft.links] == [
        ("b_x", "ground", "prismatic", "x"),
        ("b_y", "b_x", "prismatic", "y"),
        ("b", "b_y", "revolute", "b_joint3"),
    ]
    assert [one.mass for one in draft.links] == [0, 0, pytest.approx(1000 * 4 / 3 * math.pi * 1e-3)]


@pytest.mark.parametrize(
    ("inside", "mass", "com", "inertia"),
    [
        ('<geom size="0.1" density="1500" pos="0.3 0 0"/>', 2 * math.pi, [0.3, 0, 0], 0.008 * math.pi),
        ("", 2, [0.5, 0, 0], 0.1),
        ('<geom size="0.1" mass="0"/><geom size="0.1" group="3"/>', 2, [0.5, 0, 0], 0.1),
    ],
    ids=["geom", "none", "massless"],
)
def test_a_body_without_mass_by_its_geoms_keeps_its_inertial(tmp_path, inside, mass, com, inertia):
    # body_mass, body_ipos and body_inertia of MuJoCo 4.0.0 for these files
    text = f"""<mujoco><compiler inertiafromgeom="true" inertiagrouprange="0 2"/><worldbody><body name="a"><joint axis="0 0 1"/>
      <inertial pos="0.5 0 0" mass="2" diaginertia="0.1 0.1 0.1"/>{inside}</body></worldbody></mujoco>"""
    (one,) = imported(tmp_path, text).links
    assert one.mass == pytest.approx(mass)
    np.testing.assert_allclose(one.com, com, atol=1e-15)
    np.testing.assert_allclose(one.inertia, [inertia] * 3 + [0] * 3, atol=1e-15)


def test_exactmeshinertia_is_the_default_of_meshes(tmp_path):
    trimesh = pytest.importorskip("trimesh")
    parts = [trimesh.creation.box(extents=size) for size in ([0.4, 0.1, 0.1], [0.1, 0.1, 0.5])]
    parts[1].apply_translation([0.15, 0, 0.3])
    trimesh.util.concatenate(parts).export(tmp_path / "hook.stl")

    def mass(setting, attribute):
        text = f"""<mujoco><compiler {setting}/><asset><mesh file="hook.stl" {attribute}/></asset><worldbody><body><joint/>
          <geom type="mesh" mesh="hook"/></body></worldbody></mujoco>"""
        return imported(tmp_path, text).links[0].mass

    exact = 1000 * (0.4 * 0.1 * 0.1 + 0.1 * 0.1 * 0.5)
    assert mass('exactmeshinertia="true"', "") == mass("", 'inertia="exact"') == pytest.approx(exact)
    assert mass('exactmeshinertia="true"', 'inertia="legacy"') == mass("", "") > 1.01 * exact


def test_a_mesh_is_shifted_and_turned_to_its_reference_before_it_is_scaled(tmp_path):
    """A tetrahedron: the mean of its corners is its center of mass, also after a linear map."""
    corners, edges, at = np.array([[0, 0, 0], [1, 0, 0], [0, 2, 0], [0.3, 0.4, 3]]), np.array([0.1, 0.2, 0.3]), np.array([0.5, 0.2, 0.1])
    lines = [*("v " + " ".join(map(str, corner)) for corner in corners.tolist()), "f 1 3 2", "f 1 2 4", "f 1 4 3", "f 2 3 4"]
    (tmp_path / "c.obj").write_text("\n".join(lines))
    for quaternion, drawn in ([1, 0, 0, 0], True), ([1, 0, 0, 1], True), ([0.8, 0.1, 0.5, 0.2], False):
        reference = f'refpos="0.5 0.2 0.1" refquat="{" ".join(map(str, quaternion))}"'
        draft = imported(
            tmp_path,
            f"""<mujoco><asset><mesh file="c.obj" scale="0.1 0.2 0.3" {reference}/></asset><worldbody><body><joint/><geom type="mesh" mesh="c"/></body>
              </worldbody></mujoco>""",
        )
        placed = (corners - at) @ of_quaternion(quaternion) * edges
        np.testing.assert_allclose(draft.links[0].com, placed.mean(axis=0), atol=1e-12)
        assert draft.links[0].mass == pytest.approx(1000 * 0.006)
        assert any("'refquat' and an unequal 'scale'" in line for line in draft.lost) != drawn
        for shape in (one.fields for one in draft.shapes):
            turn = rotation_z(shape.get("rpy", [0, 0, 0])[2])
            shown = corners * shape["size"] @ turn.T + shape["position"]
            np.testing.assert_allclose(shown, placed, atol=1e-12)
        assert len(draft.shapes) == drawn


@pytest.mark.parametrize("file", ["C:/parts/hook.stl", "parts\\hook.stl", "hook.stl"])
def test_strippath_drops_the_folder_of_a_mesh(tmp_path, file):
    trimesh = pytest.importorskip("trimesh")
    (tmp_path / "meshes").mkdir()
    trimesh.creation.box().export(tmp_path / "meshes" / "hook.stl")
    text = f"""<mujoco><compiler strippath="true" meshdir="meshes"/><asset><mesh file="{file}"/></asset><worldbody><body><joint/>
      <geom type="mesh" mesh="hook"/></body></worldbody></mujoco>"""
    draft = imported(tmp_path, text)
    assert draft.links[0].mass == pytest.approx(1000) and not any("<mesh>" in line for line in draft.lost)


@pytest.mark.parametrize(
    ("given", "reason"),
    [
        ('vertex="0 0 0 1 0 0 0 1 0 0 0 1"', "1 x <mesh> given by 'vertex', not by a file ('m')"),
        ('builtin="sphere" params="2"', "1 x <mesh> given by 'builtin', not by a file ('m')"),
        ('file="gone.stl"', "1 x <mesh> without a file that exists ('gone.stl')"),
    ],
)
def test_a_mesh_that_cannot_be_read_is_listed_with_its_reason(tmp_path, given, reason):
    text = f"""<mujoco><asset><mesh name="m" {given}/></asset><worldbody><body><joint/><geom size="0.1"/><geom type="mesh" mesh="m"/></body></worldbody>
      </mujoco>"""
    assert [line for line in imported(tmp_path, text).lost if "mesh" in line] == [
        "mass of 1 <geom> of body1: the <mesh> is not read; add mass, com and inertia to the model file",
        reason,
    ]


@pytest.mark.parametrize(
    ("inertial", "mass", "words"),
    [
        ("", 'mass="2"', ["mass of 2 <geom> of body1 (2 kg given)"]),
        ("", 'density="0"', ["mass of 1 <geom> of body1"]),
        ('<inertial pos="0 0 0" mass="1" diaginertia="1 1 1"/>', "", []),
    ],
)
def test_missing_masses_of_meshes_are_listed(tmp_path, inertial, mass, words):
    text = f"""<mujoco><asset><mesh name="m" file="gone.stl"/></asset><worldbody><body><joint/>{inertial}<geom size="0.1"/>
      <geom type="mesh" mesh="m" {mass}/><geom type="mesh" mesh="m"/></body></worldbody></mujoco>"""
    assert [line.partition(":")[0] for line in imported(tmp_path, text).lost if line.startswith("mass")] == words


def test_boundmass_is_where_mujoco_places_it(tmp_path):
    # MuJoCo 4.0.0: body_ipos is (0.4, 0.1, 0.2), the body's pos without that of its <frame>, in the frame of the body
    text = """<mujoco><compiler boundmass="0.5" boundinertia="0.01"/><worldbody><frame pos="0 0 7"><body name="a" pos="0.4 0.1 0.2" euler="0 0 90">
      <joint axis="0 0 1"/><body name="b"><joint axis="0 0 1"/><geom size="0.1"/></body></body></frame></worldbody></mujoco>"""
    one, other = imported(tmp_path, text).links
    assert one.mass == 0.5 and one.inertia == pytest.approx([0.01] * 3 + [0] * 3) and other.mass == pytest.approx(4 * math.pi / 3)
    pose = start_poses([one])[one.name]
    np.testing.assert_allclose((pose @ [*one.com, 1])[:3], np.array([0.4, 0.1, 7.2]) + [-0.1, 0.4, 0.2], atol=1e-12)


@pytest.mark.parametrize(
    ("bodies", "names"),
    [
        # an unnamed body before one with the name that it would get
        (
            '<body><joint name="p"/><geom size="0.1"/></body><body name="body1"><joint name="q"/><geom size="0.2"/></body>',
            [("body2", "p", 1), ("body1", "q", 8)],
        ),
        # an unnamed joint has the name of its body, unless another joint has it
        (
            '<body name="a"><joint/><geom size="0.1"/><body name="b"><joint name="a"/><geom size="0.2"/></body></body>',
            [("a", "a_joint1", 1), ("b", "a_joint", 8)],
        ),
        # the links of a chain have generated names
        (
            '<body name="a_x"><joint name="p"/><geom size="0.1"/></body>'
            '<body name="a"><joint name="x" type="slide"/><joint name="y"/><geom size="0.2"/></body>',
            [("a_x", "p", 1), ("a_x_2", "x", 0), ("a", "y", 8)],
        ),
        # the generated name of a joint leaves those of the file to their joints
        (
            '<body name="a"><joint name="b"/><geom size="0.1"/></body><body name="b"><joint name="b_joint"/><geom size="0.2"/></body>',
            [("a", "b_2", 1), ("b", "b_joint", 8)],
        ),
    ],
    ids=["body", "joint", "chain", "renamed"],
)
def test_generated_names_avoid_those_of_the_file(tmp_path, built_library, bodies, names):
    draft = imported(tmp_path, f"<mujoco><worldbody>{bodies}</worldbody></mujoco>")
    sphere = 1000 * 4 / 3 * math.pi * 0.1**3
    assert [(one.name, one.joint_name) for one in draft.links] == [(link, joint) for link, joint, _ in names]
    assert [one.mass / sphere for one in draft.links] == pytest.approx([mass for *_, mass in names])
    model = tmp_path / "model.toml"
    model.write_text(model_text(draft), encoding="utf-8")
    describe(model)


def test_generated_names_of_sites_avoid_those_of_the_file(tmp_path):
    text = '<site pos="1 0 0"/><site name="site0" pos="2 0 0"/><site pos="3 0 0"/>'
    draft = imported(tmp_path, BAR.replace('<site name="end"', f'{text}<site name="end"').replace("EXTRA", ""), frames=True)
    given = [(tie.name, tie.fields["position"][0]) for tie in draft.frames if tie.name.startswith("site")]
    assert given == [("site1", 1), ("site0", 2), ("site2", 3)]


def test_ranges_refs_and_settings(tmp_path):
    draft = imported(tmp_path, BAR.replace("EXTRA", ""), stops=100.0)
    assert draft.name == "bar_test" and draft.fmu == {"step_size": 0.005}
    crank, rod = link(draft, "c"), link(draft, "r")
    np.testing.assert_allclose([crank.lower, crank.upper, rod.q], np.radians([-90, 90, 20]))
    assert (crank.q, crank.drive) == (0, "torque")
    assert any("no actuators: hinge, slide and ball joints have torque inputs" in line for line in draft.doubts)
    assert any("contact of 3 <geom>" in line for line in draft.lost)
    assert [one.fields["kind"] for one in draft.shapes] == ["capsule", "capsule", "sphere"]
    assert draft.shapes[-1].fields["color"] == [1, 0, 0, 0.5]


@pytest.mark.parametrize(
    ("equality", "kind"),
    [
        ('<connect name="pin" body1="rod" body2="rocker" anchor="0.5 0 0.1"/>', "spherical"),
        ('<weld name="pin" body1="rod" body2="rocker"/>', "fixed"),
    ],
)
def test_loops_hold_in_the_configuration_of_qpos0(tmp_path, equality, kind):
    draft = imported(tmp_path, BAR.replace("EXTRA", f"<equality>{equality}</equality>"))
    (loop,) = draft.loops
    poses = start_poses(draft.links)
    a, b = (poses[loop.fields[f"link_{side}"]] @ [*loop.fields[f"point_{side}"], 1] for side in "ab")
    assert (loop.name, loop.fields["type"]) == ("pin", kind)
    np.testing.assert_allclose(a, b, atol=1e-12)
    # the closed form: qpos0 is the configuration of the file
    np.testing.assert_allclose(a[:3], [0.3, 0, 1] if kind == "fixed" else [0.8, 0, 1.1], atol=1e-12)
    assert any("equality constraints are rigid here" in line for line in draft.doubts)


def test_a_weld_with_a_pose_and_a_connection_of_sites(tmp_path):
    text = '<equality><weld body1="rod" body2="rocker" relpose="0.1 0.2 0.3 0 1 0 0"/><connect site1="end" site2="grip"/></equality>'
    draft = imported(tmp_path, BAR.replace("EXTRA", text))
    weld, pin = draft.loops
    poses = start_poses(draft.links)
    np.testing.assert_allclose((poses["rod"] @ [*weld.fields["point_a"], 1])[:3], [0.4, 0.2, 1.3], atol=1e-12)
    np.testing.assert_allclose(poses["rod"][:3, :3] @ weld.fields["axis_a"], [0, 0, -1], atol=1e-12)
    np.testing.assert_allclose((poses["rocker"] @ [*pin.fields["point_b"], 1])[:3], [0.8, 0, 1], atol=1e-12)
    np.testing.assert_allclose((poses["rod"] @ [*pin.fields["point_a"], 1])[:3], [0.8, 0, 1], atol=1e-12)


def test_a_weld_with_a_pose_and_an_anchor(tmp_path):
    # eq_data of MuJoCo 4.0.0: the place (0.1, 0.2, 0.3) on the rod, at (0.3, 0, 1), is at (0.4, 0.5, 0.6) on the rocker, at (0.9, 0, 1)
    text = '<equality><weld body1="rod" body2="rocker" relpose="0.1 0.2 0.3 0 1 0 0" anchor="0.4 0.5 0.6"/></equality>'
    draft = imported(tmp_path, BAR.replace("EXTRA", text))
    (weld,) = draft.loops
    poses = start_poses(draft.links)
    for side, link_of_side, place, z in (("a", "rod", [0.4, 0.2, 1.3], -1), ("b", "rocker", [1.3, 0.5, 1.6], 1)):
        np.testing.assert_allclose((poses[link_of_side] @ [*weld.fields[f"point_{side}"], 1])[:3], place, atol=1e-12)
        np.testing.assert_allclose(poses[link_of_side][:3, :3] @ weld.fields[f"axis_{side}"], [0, 0, z], atol=1e-12)


def test_a_linear_joint_constraint_is_a_coupling(tmp_path):
    # r - ref = 0.1 + 2 c, in rad
    text = '<equality><joint name="g" joint1="r" joint2="c" polycoef="0.1 2 0 0 0"/><joint joint1="o" polycoef="0.3 0 0 0 0"/></equality>'
    draft = imported(tmp_path, BAR.replace("EXTRA", text))
    (coupling,) = draft.couplings
    assert (coupling.name, coupling.fields["joints"], coupling.fields["ratios"]) == ("g", ["r", "c"], [1, -2])
    assert coupling.fields["offset"] == pytest.approx(0.1 + math.radians(20))
    assert link(draft, "r").drive == "free" and (link(draft, "o").drive, link(draft, "o").q) == ("locked", 0.3)


def test_a_constraint_of_tendons_is_a_coupling(tmp_path):
    # 2 c - (r - ref) = 0.3 + 4 (o - r + ref), in rad and from qpos0
    text = """<tendon><fixed name="one"><joint joint="c" coef="2"/><joint joint="r" coef="-1"/></fixed><fixed name="two"><joint joint="o" coef="1"/>
      <joint joint="r" coef="-1"/></fixed></tendon><equality><tendon tendon1="one" tendon2="two" polycoef="0.3 4"/></equality>"""
    (coupling,) = imported(tmp_path, BAR.replace("EXTRA", text)).couplings
    assert (coupling.fields["joints"], coupling.fields["ratios"]) == (["c", "r", "o"], [2, 3, -4])
    assert coupling.fields["offset"] == pytest.approx(0.3 + 3 * math.radians(20))


def test_a_constraint_does_not_free_a_joint_that_another_one_locks(tmp_path):
    text = '<equality><joint joint1="r"/><joint joint1="r" joint2="c"/><joint joint1="c"/><joint joint1="c" joint2="r"/></equality>'
    draft = imported(tmp_path, BAR.replace("EXTRA", text))
    assert [link(draft, name).drive for name in "rc"] == ["locked", "locked"]
    assert "1 x <joint> in <equality> of joints that others lock" in draft.lost


def test_actuators_add_their_rotors_by_the_square_of_the_gear(tmp_path):
    text = """<default><motor damping="0.5"/></default><actuator><motor joint="c" gear="3" armature="0.2"/><position joint="c" gear="2" damping="1 2"/>
      <motor site="end"/></actuator>"""
    draft = imported(tmp_path, BAR.replace("EXTRA", text))
    assert link(draft, "c").armature == pytest.approx(9 * 0.2) and link(draft, "c").damping == pytest.approx(9 * 0.5 + 4)
    assert "1 x nonlinear damping of <position>" in draft.lost


def test_a_shorter_list_replaces_the_first_entries_of_that_of_its_class(tmp_path):
    text = """<mujoco><default><geom type="cylinder" size="1 4"/><tendon springlength="1 2" stiffness="3"/></default><worldbody><body><joint name="p"/>
      <joint name="q"/><geom size="2" density="1"/></body></worldbody><tendon><fixed springlength="5"><joint joint="p" coef="1"/>
      <joint joint="q" coef="1"/></fixed></tendon></mujoco>"""
    draft = imported(tmp_path, text)
    assert draft.links[-1].mass == pytest.approx(math.pi * 2**2 * 8)
    assert draft.couplings[0].fields["offset"] == 5 and "backlash" not in draft.couplings[0].fields


def test_a_flag_counts_whatever_options_follow(tmp_path):
    text = '<option><flag gravity="disable"/></option><option gravity="0 0 -3"/>'
    assert imported(tmp_path, BAR.replace("EXTRA", text)).gravity == [0, 0, 0]


def test_tendon_springs_are_elastic_couplings(tmp_path):
    text = """<tendon><fixed name="t" stiffness="5" damping="0.2" springlength="0.1 0.5"><joint joint="c" coef="2"/><joint joint="r" coef="-1"/></fixed>
      <spatial><site site="end"/></spatial></tendon>"""
    draft = imported(tmp_path, BAR.replace("EXTRA", text))
    (tendon,) = draft.couplings
    expected = {"joints": ["c", "r"], "ratios": [2, -1], "offset": 0.3, "stiffness": 5, "damping": 0.2, "backlash": 0.4}
    assert tendon.fields == expected
    assert "1 x <spatial> tendons" in draft.lost
    assert any("range of lengths at rest" in line for line in draft.lost)


def test_a_tendon_without_a_length_rests_where_the_springs_of_its_joints_do(tmp_path):
    text = '<tendon><fixed stiffness="5"><joint joint="c" coef="2"/><joint joint="r" coef="-1"/></fixed></tendon>'
    draft = imported(tmp_path, BAR.replace('ref="20"', 'ref="20" springref="30"').replace("EXTRA", text))
    assert draft.couplings[0].fields["offset"] == pytest.approx(-math.radians(30))


@pytest.mark.parametrize(
    ("lengths", "offset", "backlash"), [("-0.5", -0.5, 0), ("-1 -1", 0, 0), ("-1 0.5", -0.25, 1.5), ("-0.5 0.5", 0, 1)]
)
def test_lengths_of_tendons_may_be_negative(tmp_path, lengths, offset, backlash):
    """Except -1: they are sums of joint positions."""
    tendon = f'<fixed stiffness="5" springlength="{lengths}"><joint joint="c" coef="2"/><joint joint="r" coef="-1"/></fixed>'
    draft = imported(tmp_path, BAR.replace("EXTRA", f"<tendon>{tendon}</tendon>"))
    fields = draft.couplings[0].fields
    assert fields.get("offset", 0) == pytest.approx(offset) and fields.get("backlash", 0) == pytest.approx(backlash)


def test_frames_move_the_joints_and_the_inertia_inside_them(tmp_path):
    joints = '<joint name="a" axis="AXIS" pos="POINT" ref="10"/><joint name="b" type="slide" axis="0 0 1" pos="END"/>'
    body = '<mujoco><worldbody><body name="x" pos="1 2 3">PARTS</body></worldbody></mujoco>'
    inertial = '<inertial pos="POINT" mass="2" diaginertia="DIAGONAL"/>'
    turned = joints.replace("AXIS", "0.6 0.8 0").replace("POINT", "0.1 0.2 0.3") + inertial.replace("DIAGONAL", "1 2 2.5")
    framed = '<frame pos="1 0 0"><frame euler="0 0 90">' + turned.replace("POINT", "0.3 0 0.4").replace("END", "0 0 0") + "</frame></frame>"
    plain = joints.replace("AXIS", "-0.8 0.6 0").replace("POINT", "0.8 0.1 0.3") + inertial.replace("DIAGONAL", "2 1 2.5")
    one, other = (
        imported(tmp_path, body.replace("PARTS", parts)) for parts in (framed, plain.replace("POINT", "1 0.3 0.4").replace("END", "1 0 0"))
    )
    for ours, wanted in zip(one.links, other.links, strict=True):
        np.testing.assert_allclose(start_poses(one.links)[ours.name], start_poses(other.links)[wanted.name], atol=1e-12)
        np.testing.assert_allclose(ours.com, wanted.com, atol=1e-12)
        np.testing.assert_allclose(ours.inertia, wanted.inertia, atol=1e-12)
        assert (ours.joint, ours.joint_name, ours.mass) == (wanted.joint, wanted.joint_name, wanted.mass)


@pytest.mark.parametrize("axis", ["0 1 0", "0 0 1", "0.6 0 0.8"])
def test_the_frame_of_a_body_is_not_that_of_its_joint(tmp_path, axis):
    text = f"""<mujoco><worldbody><body name="x" pos="0 0 1" euler="10 20 30"><joint axis="{axis}" pos="0.1 0 0.2"/><geom size="0.1"/>
      <site name="middle"/></body></worldbody></mujoco>"""
    draft = imported(tmp_path, text, frames=True)
    body, site = draft.frames
    assert (body.name, site.name) == ("x_frame", "middle")
    for key in ("position", "rpy"):
        assert body.fields[key] == pytest.approx(site.fields[key], abs=1e-14)


def test_defaults_of_several_sections_and_of_all_kinds_of_constraints_count(tmp_path):
    text = """<default><joint damping="3"/><equality active="false"/><tendon stiffness="5"/><geom euler="0 90 0"/></default><default>
      <joint armature="2"/></default><equality><joint joint1="r" joint2="c"/></equality><tendon><fixed><joint joint="c" coef="2"/><joint joint="r"
      coef="-1"/></fixed></tendon>"""
    text = BAR.replace("EXTRA", text).replace(
        "</worldbody>", '<body><joint name="p"/><geom type="box" size="1 2 3" quat="1 0 0 0"/></body></worldbody>'
    )
    draft = imported(tmp_path, text)
    assert (link(draft, "c").damping, link(draft, "c").armature) == (3, 2)
    assert [one.fields.get("stiffness") for one in draft.couplings] == [5]
    assert "1 x inactive equality constraints" in draft.lost
    # any orientation of an element replaces that of its class
    np.testing.assert_allclose(np.diff(np.sort(link(draft, "p").inertia[:3])), np.array([5, 3]) * 8000 * 6 * 4 / 12)
    assert "rpy" not in draft.shapes[-1].fields


def test_a_constrained_joint_with_an_actuator_keeps_its_input(tmp_path):
    text = '<equality><joint joint1="r" joint2="c"/></equality><actuator><motor joint="r"/></actuator>'
    draft = imported(tmp_path, BAR.replace("EXTRA", text))
    assert [link(draft, name).drive for name in "cro"] == ["free", "torque", "free"]


def test_limits_add_up_and_are_symmetric(tmp_path):
    motors = '<motor joint="c" gear="-2" ctrlrange="-1 3"/><motor joint="c" ctrlrange="0 1"/><motor joint="r"/><motor joint="r" ctrlrange="0 1"/>'
    draft = imported(tmp_path, BAR.replace("EXTRA", f"<actuator>{motors}</actuator>"), limits=True)
    # -2 [-1, 3] + [0, 1] = [-6, 3]; one unlimited motor leaves the sum unlimited
    assert [one.fields for one in draft.actuators] == [{"joint": "c", "torque_limit": 6.0}]
    assert "the smaller bounds of the actuators of c: a torque limit acts in both directions" in draft.lost


def test_actuators_decide_which_joints_have_inputs(tmp_path):
    text = """<default><motor ctrlrange="-2 1"/></default><actuator><motor joint="c" gear="50"/><position joint="r" kp="7"/><motor site="end"/></actuator>"""
    draft = imported(tmp_path, BAR.replace("EXTRA", text), limits=True)
    assert [link(draft, name).drive for name in "cro"] == ["torque", "torque", "free"]
    assert [one.fields for one in draft.actuators] == [{"joint": "c", "torque_limit": 100.0}]
    lost = " | ".join(draft.lost)
    assert "the laws of the actuators of r (<position>)" in lost and "1 x <motor> on a site" in lost
    assert "the ranges of the actuators of c: --limits" in " | ".join(imported(tmp_path, BAR.replace("EXTRA", text)).lost)


def test_a_keyframe_is_a_start_state(tmp_path):
    text = """<mujoco><worldbody><body name="t" pos="0 0 1" euler="0 0 90"><freejoint name="base"/><geom size="0.1"/>
      <body name="a"><joint name="h" range="-5 5"/><geom size="0.1" pos="1 0 0"/></body></body></worldbody>
      <keyframe><key name="home" qpos="3 4 6 1 0 0 0 0.05" qvel="1 2 3 4 5 6 7"/></keyframe></mujoco>"""
    draft = imported(tmp_path, text, keyframe="home")
    base = link(draft, "base")
    # in axes that are turned by 90 degrees about z, from (0, 0, 1)
    np.testing.assert_allclose(base.q, [4, -3, 5, math.sqrt(0.5), 0, 0, -math.sqrt(0.5)], atol=1e-12)
    np.testing.assert_allclose(base.qd, [2, -1, 3, 4, 5, 6], atol=1e-12)
    assert link(draft, "h").q == 0.05 and link(draft, "h").qd == 7
    assert "--keyframe selects one of: home" in " | ".join(imported(tmp_path, text).doubts)
    with pytest.raises(UserError, match="unknown keyframe 'hom'; did you mean 'home'"):
        imported(tmp_path, text, keyframe="hom")


def test_geoms_become_contacts(tmp_path):
    draft = imported(tmp_path, BAR.replace("EXTRA", ""), contact="all")
    assert [one.fields["shape_a"] for one in draft.contacts] == ["capsule", "capsule", "sphere"]
    assert draft.contacts[2].fields["radius_a"] == 0.05
    with pytest.raises(UserError, match="has no <geom> of sphere, capsule, cylinder, box, mesh that collides"):
        imported(tmp_path, BAR.replace("EXTRA", "").replace("<geom", '<geom contype="0" conaffinity="0"'), contact="all")


def test_includes_and_nested_classes(tmp_path):
    (tmp_path / "arm.xml").write_text(
        '<mujocoinclude><body name="a"><joint class="soft" name="j"/><geom size="0.1"/></body></mujocoinclude>'
    )
    text = """<mujoco><default><joint damping="1" armature="2"/><default class="stiff"><joint damping="3"/><default class="soft"><joint stiffness="4"/>
      </default></default></default><worldbody><include file="arm.xml"/></worldbody></mujoco>"""
    (one,) = imported(tmp_path, text).links
    assert (one.damping, one.armature, one.stiffness) == (3, 2, 4)
    (tmp_path / "arm.xml").write_text('<mujocoinclude><body name="a">\n<joint axis="0 0 0"/></body></mujocoinclude>')
    with pytest.raises(UserError, match=r"arm\.xml:2: joint 'a': the axis is zero"):
        imported(tmp_path, text)


def test_the_top_class_applies_to_all_elements_whatever_its_name(tmp_path):
    text = """<mujoco><default class="robot"><joint damping="2"/><default class="soft"><joint stiffness="4"/></default></default>
<worldbody><body><joint name="a"/><geom size="0.1"/><body><joint name="b" class="soft"/><geom size="0.1"/></body></body></worldbody></mujoco>"""
    draft = imported(tmp_path, text)
    assert [(one.damping, one.stiffness) for one in draft.links] == [(2, 0), (2, 4)]


def test_a_nested_include_is_searched_in_the_folder_of_the_main_file_first(tmp_path):
    # as in MuJoCo 4.0.0: the folder of the main file, then that of the including one
    (tmp_path / "parts").mkdir()
    (tmp_path / "parts" / "arm.xml").write_text('<mujocoinclude><include file="hand.xml"/></mujocoinclude>')
    text = '<mujoco><worldbody><include file="parts/arm.xml"/></worldbody></mujoco>'
    for folder, damping in (("parts", 1), (".", 5)):
        body = f'<body><joint damping="{damping}"/><geom size="0.1"/></body>'
        (tmp_path / folder / "hand.xml").write_text(f"<mujocoinclude>{body}</mujocoinclude>")
        assert imported(tmp_path, text).links[0].damping == damping


@pytest.mark.parametrize(
    ("old", "new", "sentence"),
    [
        ('range="-90 90"', 'rnge="-90 90"', "1 x 'rnge' of <joint>, first in "),
        ("EXTRA", "<sensor><gyro/><gyro/></sensor>", "<sensor>: 2 x <gyro>"),
        ("EXTRA", "<sensors/>", "unknown <sensors>; did you mean 'sensor'?"),
        ('timestep="0.005"', 'viscosity="1"', "'viscosity' of <option>: forces of a medium"),
        ('<joint name="o"', '<camera/><joint name="o" type="ball" stiffness="3"', "1 x stiffness of ball and free joints"),
        ('<joint name="o"', '<camera/><joint name="o"', "1 x <camera>"),
        ('name="rocker"', 'name="rocker" gravcomp="1"', "1 x 'gravcomp' of <body>"),
        ('range="-90 90"', 'range="2 1"', "1 x reversed 'range' of <joint>"),
        ("EXTRA", '<equality><joint joint1="c" joint2="r" polycoef="0 1 2 0 0"/></equality>', "1 x nonlinear <joint> in <equality>"),
        ("EXTRA", '<equality><connect active="false" body1="rod" anchor="0 0 0"/></equality>', "1 x inactive equality constraints"),
        ('axis="0 1 0" range', 'axis="0 1 0" springdamper="1 1" range', "1 x 'springdamper' of <joint>"),
        ('<joint name="o"', '<joint name="o" type="ball" springdamper="0.1 1"', "1 x 'springdamper' of <joint>"),
        ('<joint name="o"', '<joint name="o" type="ball" actuatorfrcrange="-1 1"', "1 x 'actuatorfrcrange' of <joint>"),
        ("EXTRA", '<option><flag passive="disable"/></option>', "<flag> disables spring, damper: the model has these forces"),
        ("EXTRA", '<option><flag spring="disable" limit="disable"/></option>', "<flag> disables limit, spring: the model has these forces"),
        ("EXTRA", '<equality><weld body1="rod" torquescale="0"/></equality>', '1 x torquescale="0" of <weld>, which is rigid here'),
        ("EXTRA", '<equality><tendon tendon1="s"/></equality><tendon><spatial name="s"/></tendon>', "1 x nonlinear <tendon> in <equality>"),
        ("EXTRA", '<option gravty="0 0 1"/>', "1 x 'gravty' of <option>"),
        ("EXTRA", '<equality><joint joint1="c" actve="false"/></equality>', "1 x 'actve' of <joint>"),
        ("EXTRA", '<actuator><motor joint="c" gaer="2"/></actuator>', "1 x 'gaer' of <motor>"),
        ("EXTRA", '<tendon><fixed><joint joint="c" coef="1" cof="1"/></fixed></tendon>', "did you mean 'coef'?"),
        ("EXTRA", '<default><geom densty="2"/></default>', "1 x 'densty' of <geom>"),
        ("EXTRA", '<tendon><fixed stiffness="1 2"><joint joint="c" coef="1"/></fixed></tendon>', "1 x nonlinear stiffness of tendons"),
        ('type="sphere" size="0.05"', 'type="sphere" mesh="m"', "1 x <geom> of type sphere that is fitted to a mesh"),
    ],
)
def test_losses_are_listed(tmp_path, old, new, sentence):
    assert old in BAR
    assert sentence in " | ".join(imported(tmp_path, BAR.replace(old, new, 1).replace("EXTRA", "")).lost)


def test_negative_damping_is_listed_and_other_negative_forces_are_refused(tmp_path):
    text = '<mujoco><worldbody><body>\n<joint name="j" KEY="-0.013 2" armature="1"/><geom size="0.1"/></body></worldbody></mujoco>'
    draft = imported(tmp_path, text.replace("KEY", "damping"))
    assert draft.links[0].damping == 0 and "1 x nonlinear damping of joints" in draft.lost
    assert f"{tmp_path / 'robot.xml'}:2: 'damping' of joint 'j' is -0.013; negative damping adds energy, and 0 is used" in draft.doubts
    for key in ("frictionloss", "stiffness"):
        with pytest.raises(UserError, match=rf"robot\.xml:2: '{key}' of joint 'j' must be >= 0, got -0\.013"):
            imported(tmp_path, text.replace("KEY", key))


@pytest.mark.parametrize(
    ("old", "new", "sentence"),
    [
        ('<body name="rocker"', '<replicate/><body name="rocker"', "<replicate> is not supported: save the expanded model"),
        ('name="rocker"', 'name="rod"', r"robot\.xml:6: duplicate body 'rod'"),
        ('<joint name="o"', '<inertial mass="1"/><joint name="o"', r"robot\.xml:6: <inertial> requires 'pos'"),
        (
            '<joint name="o"',
            '<inertial mass="1" pos="0 0 0" quat="1 1 0 0" fullinertia="1 1 1 0 0 0"/><joint name="o"',
            r"robot\.xml:6: <inertial> has 'fullinertia', which excludes 'quat'",
        ),
        (
            "<body",
            "<body>" * 260 + "</body>" * 260 + "<body",
            r"robot\.xml:\d+:\d+: elements nested in more than 255 others are not supported",
        ),
        ('size="0.05"', 'size="0"', "'size' of a <geom> of type sphere must be 1 number"),
        ('axis="0 1 0" range', 'axis="0 1" range', "'axis' of <joint> must be 3 numbers, got '0 1'"),
        ('name="c"', 'name="c" class="x"', "unknown default class 'x'"),
        ('name="c"', 'name="c" type="hing"', r"unknown joint type 'hing'; did you mean 'hinge'\?$"),
        ('name="c"', 'name="c" type="x"', "unknown joint type 'x'; supported: hinge, slide, ball, free$"),
        ("EXTRA", '<equality><connect body1="rocke" anchor="0 0 0"/></equality>', "unknown body 'rocke'; did you mean 'rocker'"),
        ("EXTRA", '<equality><tendon tendon1="x"/></equality><tendon><fixed name="y"/></tendon>', "unknown tendon 'x'"),
        ("EXTRA", '<equality><tendon tendon1="y"/></equality><tendon><fixed name="y"/></tendon>', "constrains no joint"),
        ("EXTRA", '<tendon><fixed><joint joint="cc" coef="1"/></fixed></tendon>', "unknown joint 'cc'"),
        ("EXTRA", '<actuator><motor joint="cc"/></actuator>', r"robot\.xml:7: unknown joint 'cc'"),
        ("<option", '<compiler coordinate="global"/><option', "global coordinates are not supported"),
        ('0.3 0 0" size="0.02"', '0.3 0 0" size=""', "'size' of a <geom> of type capsule must be 2 numbers > 0"),
        ('size="0.05"', 'size="0.05" group="a"', "'group' of <geom> must be a number, got 'a'"),
        ('size="0.05"', 'size="0.05" quat="0 0 0 0"', "<geom> has a direction of length 0"),
        ('axis="0 1 0" range', 'axis="0 1 nan" range', "'axis' of <joint> must be 3 finite numbers, got '0 1 nan'"),
        ("<option", '<compiler settotalmass="x"/><option', "'settotalmass' of <compiler> must be a number"),
        (
            "<option",
            '<compiler eulerseq="xy"/><default><geom euler="1 2 3"/></default><option',
            "must be three of x, y, z, X, Y, Z, got 'xy'",
        ),
        ("EXTRA", '<include file="no.xml"/>', "included file 'no.xml' does not exist"),
        # MuJoCo 4.0.0 refuses these: invalid keyword, or an invalid range
        (
            "<option",
            '<compiler angle="radians"/><option',
            r"robot\.xml:1: 'angle' of <compiler> must be radian or degree, got 'radians'; did you mean 'radian'\?$",
        ),
        ('name="c"', 'name="c" limited="True"', r"robot\.xml:3: 'limited' of <joint> must be true or false or auto, got 'True'"),
        ("<option", '<compiler autolimits="False"/><option', "'autolimits' of <compiler> must be true or false, got 'False'"),
        ("<option", '<compiler inertiafromgeom="True"/><option', "'inertiafromgeom' of <compiler> must be true or false or auto"),
        ("EXTRA", '<default><motor ctrllimited="1"/></default>', "'ctrllimited' of <motor> must be true or false or auto, got '1'"),
        ("EXTRA", '<option><flag gravity="off"/></option>', "'gravity' of <flag> must be enable or disable, got 'off'"),
        ('range="-90 90"', 'range="2 1" limited="true"', "'range' of <joint> must be two increasing numbers, got '2 1'"),
        ("EXTRA", '<actuator><motor joint="c" ctrllimited="true"/></actuator>', "'ctrlrange' of <motor> must be two increasing numbers"),
        ("<option", '<compiler autolimits="false"/><option', "<joint> has 'range' without 'limited'"),
    ],
)
def test_errors_have_file_and_line(tmp_path, old, new, sentence):
    with pytest.raises(UserError, match=sentence):
        imported(tmp_path, BAR.replace(old, new, 1).replace("EXTRA", ""))


def test_rotations():
    rng = np.random.default_rng(1)
    for _ in range(20):
        q = rng.normal(size=4)
        r = of_quaternion(list(q))
        back = np.array(quaternion_of(r))
        np.testing.assert_allclose(back, math.copysign(1, q[0]) * q / np.linalg.norm(q), atol=1e-12)
        axis, angle = q[1:] / np.linalg.norm(q[1:]), rng.normal()
        np.testing.assert_allclose(turn(axis, angle), of_quaternion([math.cos(angle / 2), *(math.sin(angle / 2) * axis)]), atol=1e-14)
        np.testing.assert_allclose(towards(axis) @ [0, 0, 1], axis, atol=1e-14)
        np.testing.assert_allclose(inverse(start_poses([])["ground"]), np.eye(4))


def test_the_command_line_knows_both_kinds_of_xml(built_library, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "bar.xml").write_text("<?xml version='1.0'?><!-- <robot> -->\n" + BAR.replace("EXTRA", ""))
    done = command("import", "bar.xml", "--pose", "c=0.3")
    assert done.returncode == 0, done.stderr
    assert "q = 0.3" in (tmp_path / "bar.toml").read_text()
    assert command("simulate", "bar.toml", "--stop", "0.01").returncode == 0
    (tmp_path / "part.xml").write_text("<mujocoinclude/>")
    assert "part.xml: <mujocoinclude> is a fragment: import the <mujoco> file that includes it" in command("import", "part.xml").stderr
    done = command("import", "bar.xml", "--floating", "--force")
    assert "--floating has no effect on 'bar.xml': it applies to URDF files" in done.stderr
