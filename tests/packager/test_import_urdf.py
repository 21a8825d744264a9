"""Conversion of URDF files to modified DH; omissions are listed; errors are reported with file and line."""

import math
import re

import numpy as np
import pytest

from build_fmu.cli import main
from build_fmu.errors import UserError
from build_fmu.importers import urdf
from build_fmu.importers.draft import RESERVED, DhFrame
from build_fmu.importers.layout import settle
from build_fmu.importers.rigid import pose_of, position_and_angles, rotation_x, rotation_y, rotation_z, transform
from build_fmu.importers.toml_writer import model_text
from build_fmu.native import SOURCE_TREE
from tests.packager.import_options import import_options

ARM = """<?xml version="1.0" encoding="UTF-8"?>
<robot name="two link-arm">
  <link name="base"><inertial><mass value="3"/><inertia ixx="1" iyy="1" izz="1" ixy="0" ixz="0" iyz="0"/></inertial></link>
  <link name="upper arm">
    <inertial><origin xyz="0.1 0 0.2" rpy="0 0 0"/><mass value="2"/><inertia ixx="0.1" iyy="0.2" izz="0.25" ixy="0.01" ixz="0" iyz="0"/></inertial>
    <visual><geometry><box size="1 1 1"/></geometry></visual>
  </link>
  <link name="time"><inertial><mass value="1"/><inertia ixx="0.1" iyy="0.1" izz="0.1" ixy="0" ixz="0" iyz="0"/></inertial></link>
  <link name="tool"/>
  <joint name="shoulder" type="revolute">
    <origin xyz="0 0 0.3"/><parent link="base"/><child link="upper arm"/><axis xyz="0 1 0"/>
    <limit lower="0.5" upper="1" effort="1" velocity="1"/><dynamics damping="0.7" friction="0.2"/>
  </joint>
  <joint name="upper_arm" type="continuous">
    <origin xyz="0.5 0 0" rpy="0 1.5708 0"/><parent link="upper arm"/><child link="time"/><axis xyz="0 2 0"/><mimic joint="shoulder"/>
  </joint>
  <joint name="end" type="fixed"><origin xyz="0 0 0.1"/><parent link="time"/><child link="tool"/></joint>
  <transmission name="t"/>
</robot>
"""


def imported(tmp_path, text, **options):
    path = tmp_path / "arm.urdf"
    path.write_text(text, encoding="utf-8")
    return urdf.read(path, import_options(**options))


@pytest.mark.parametrize("name", RESERVED)
def test_names_that_model_files_reserve_are_changed(tmp_path, name):
    names = [link.name for link in imported(tmp_path, ARM.replace('"time"', f'"{name}"')).links]
    assert f"{name}_2" in names and name not in names


def test_the_names_that_model_files_reserve_are_all_known():
    text = (SOURCE_TREE / "docs" / "model_file.md").read_text(encoding="utf-8")
    assert set(re.findall(r"`(\w+)`", re.search(r"(.*) are reserved\.", text)[1])) == set(RESERVED)


def test_an_unknown_attribute_is_told_once(tmp_path):
    text = (
        ARM.replace("<axis ", '<dynamics D="1" mu="2"/><axis ', 2).replace('damping="0.7" ', "").replace('<dynamics friction="0.2"/>', "")
    )
    lost = imported(tmp_path, text).lost
    assert [line for line in lost if "<dynamics>" in line] == [
        "2 x 'D' of <dynamics>, first in line 11",
        "2 x 'mu' of <dynamics>, first in line 11",
    ]


def test_spaces_around_names_do_not_count(tmp_path):
    spaced = re.sub(r'\b(name|link|joint|type)="([^"]*)"', r'\1=" \2\t"', ARM)
    assert '<mimic joint=" shoulder\t"' in spaced
    assert model_text(imported(tmp_path, spaced, limits=True)) == model_text(imported(tmp_path, ARM, limits=True))


def test_the_model_file_is_called_as_its_source_is(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "my-arm v2.urdf").write_text(ARM, encoding="utf-8")
    assert main(["import", "my-arm v2.urdf", "--stops", "1e4"]) == 0
    assert 'name = "two_link_arm"' in (tmp_path / "my-arm v2.toml").read_text()
    assert main(["import", "my-arm v2.urdf", "--name", "crane"]) == 0
    assert 'name = "crane"' in (tmp_path / "crane.toml").read_text()


def test_names_frames_and_losses(tmp_path):
    draft = imported(tmp_path, ARM)
    assert draft.name == "two_link_arm"
    assert [(link.name, link.joint_name, link.joint) for link in draft.links] == [
        ("upper_arm", "shoulder", "revolute"),
        ("time_2", "upper_arm_joint", "revolute"),
        ("tool", "", "fixed"),
    ]
    said = " | ".join(draft.lost + draft.doubts)
    for part in (
        "the mass of 'base', 3 kg",
        "stops at the limits of shoulder",
        "line 18: <transmission> 't': no <joint>",
        "start positions inside the limits are chosen: shoulder = 0.525; --pose",
        "'upper arm' is renamed to 'upper_arm'",
        "'time' is renamed to 'time_2'",
        "1 angles are within",
    ):
        assert part in said
    assert [(tie.name, tie.fields["joints"]) for tie in draft.couplings] == [("upper_arm_joint_mimic", ["upper_arm_joint", "shoulder"])]
    first, second, _ = draft.links
    assert (first.damping, first.friction, first.lower, first.mass) == (0.7, 0.2, 0.5, 2)
    assert "friction = 0.2" in model_text(draft) and "stop" not in model_text(imported(tmp_path, ARM, stops="none")).split("name =", 1)[1]
    # both axes along y: the frames lie in one plane, so nothing but a and theta is left in the second joint
    assert (second.dh.gamma, second.dh.b, second.dh.alpha) == (0, 0, 0) and abs(second.dh.a) == pytest.approx(0.5)
    assert "URDF frame of 'upper arm' in this frame" in model_text(draft)


@pytest.mark.parametrize(
    ("old", "new", "sentence"),
    [
        ("<dynamics", "<dynamic", "1 x <dynamic> in <joint>, first in line 12; did you mean 'dynamics'?"),
        ('damping="0.7"', 'dampng="0.7"', "line 12: 'dampng' of <dynamics>; did you mean 'damping'?"),
        ("<transmission", '<loop_joint name="l"/><transmission', "1 x <loop_joint> in <robot>, first in line 18"),
        ('<mass value="2"/>', '<mass value="2"/><mass value="9"/>', "line 5: duplicate <mass> in <inertial>: the first one is used"),
        ('<mass value="2"/>', "", "line 5: <inertial> of 'upper arm' has no <mass>; set to 0"),
        ('ixx="0.1" iyy="0.2"', 'iyy="0.2"', "line 5: <inertia> of 'upper arm' has no ixx"),
        ('lower="0.5" upper="1"', 'lower="1" upper="0.5"', "arm.urdf:12: the limits of 'shoulder', 1 to 0.5, are reversed and omitted"),
        ('lower="0.5" upper="1"', 'lower="-90" upper="90"', "arm.urdf:12: the limits of 'shoulder', -90 to 90, look like degrees"),
        ('rpy="0 1.5708 0"', 'rpy="0 90 0"', "arm.urdf:15: rpy = '0 90 0' looks like degrees"),
        ('effort="1"', 'effort="0"', "the effort and velocity limits of shoulder"),
        ('type="revolute"', 'type="floating"', "<limit> of 'shoulder': not supported for floating joints"),
    ],
)
def test_nothing_is_dropped_in_silence(tmp_path, old, new, sentence):
    assert old in ARM
    draft = imported(tmp_path, ARM.replace(old, new, 1))
    assert any(sentence in said for said in draft.lost + draft.doubts), draft.lost + draft.doubts


def test_the_world_is_the_ground_and_a_base_can_float(tmp_path):
    draft = imported(
        tmp_path, ARM.replace("</robot>", '<joint name="weld" type="fixed"><parent link="world"/><child link="base"/></joint></robot>')
    )
    assert [(link.name, link.parent, link.joint) for link in draft.links][:2] == [
        ("base", "ground", "fixed"),
        ("upper_arm", "base", "revolute"),
    ]
    draft = imported(tmp_path, ARM, floating=True)
    assert [(link.name, link.parent, link.joint, link.mass) for link in draft.links][:2] == [
        ("base", "ground", "free", 3),
        ("upper_arm", "base", "revolute", 2),
    ]
    assert not any("--floating" in said for said in draft.lost) and any("--floating" in said for said in imported(tmp_path, ARM).lost)
    with pytest.raises(UserError, match="--floating makes its root link 'box' a floating base"):
        imported(tmp_path, '<robot name="r"><link name="box"/></robot>')


def test_angles_of_a_frame_next_to_the_singular_pitch():
    """1.5708 for a right angle leaves frames there; an arcsine loses half of their digits."""
    for away in (0, 1e-16, 1e-12, 1e-8, 2e-6, 0.3):
        for sign in (1, -1):
            own = transform(rotation_z(0.7) @ rotation_y(sign * (math.pi / 2 - away)) @ rotation_x(-1.1), (1, 2, 3))
            position, (roll, pitch, yaw) = position_and_angles(own)
            assert position == [1, 2, 3]
            assert np.abs(rotation_z(yaw) @ rotation_y(pitch) @ rotation_x(roll) - own[:3, :3]).max() < 3e-13


def test_frames(tmp_path):
    """The URDF's frames, given as [[frame]], lie where the URDF has them."""
    draft = imported(tmp_path, ARM, frames=True)
    assert [(frame.name, frame.fields["link"]) for frame in draft.frames] == [("upper_arm_frame", "upper_arm"), ("time_2_frame", "time_2")]
    poses = {"ground": np.eye(4)}
    for link in draft.links:
        poses[link.name] = poses[link.parent] @ pose_of(link.dh)
    roll, pitch, yaw = draft.frames[1].fields["rpy"]
    found = poses["time_2"] @ transform(rotation_z(yaw) @ rotation_y(pitch) @ rotation_x(roll), draft.frames[1].fields["position"])
    assert np.allclose(found, transform(rotation_y(1.5708), (0.5, 0, 0.3)), atol=1e-12)
    assert '[[frame]]\nname = "upper_arm_frame"\nlink = "upper_arm"\n' in model_text(draft)


def test_limits_become_stops_by_the_masses(tmp_path):
    """Two bodies on the first joint: 20 Hz with their inertia about its axis."""
    draft = imported(
        tmp_path, ARM.replace('axis xyz="0 2 0"', 'axis xyz="0 1 0"').replace('rpy="0 1.5708 0"', "").replace('lower="0.5"', 'lower="-1"')
    )
    inertia = (0.2 + 2 * (0.1**2 + 0.2**2)) + (0.1 + 1 * 0.5**2)
    assert draft.links[0].stop_stiffness == float(f"{inertia * (2 * math.pi * 20) ** 2:.2g}") and draft.links[0].stop_damping == 1
    assert any("stops at the limits of shoulder: the stiffness gives" in doubt for doubt in draft.doubts)
    rail = imported(tmp_path, ARM.replace('type="revolute"', 'type="prismatic"')).links[0]
    assert rail.stop_stiffness == float(f"{3 * (2 * math.pi * 20) ** 2:.2g}") and rail.stop_damping == 2
    none = imported(tmp_path, ARM, stops="none")
    assert none.links[0].lower is None and "the limits of shoulder: omitted with --stops none" in none.lost


@pytest.mark.parametrize(
    ("limit", "pose", "q", "drive", "said"),
    [
        ('lower="0.5" upper="0.5" effort="1" velocity="1"', [], 0.5, "locked", "limits of zero width lock the joints: shoulder = 0.5"),
        ('lower="0" upper="0" effort="1" velocity="1"', [], 0, "locked", "limits of zero width lock the joints: shoulder = 0"),
        ('lower="0.5" upper="0.5"', ["shoulder=0.1"], 0.1, "locked", "outside the limits of shoulder (0.5 to 0.5)"),
        # without limits, as in Drake; exporters of CAD programs write zeros
        ('effort="1" velocity="1"', [], 0, "torque", ""),
        ('lower="0" upper="0" effort="0" velocity="0"', [], 0, "torque", "read as placeholders: 'shoulder' has no limits"),
    ],
    ids=["locked", "locked at 0", "pose", "no limits", "placeholders"],
)
def test_limits_of_zero_width_lock_the_joint(tmp_path, limit, pose, q, drive, said):
    text = ARM.replace('<mimic joint="shoulder"/>', "").replace(
        '<transmission name="t"/>', '<transmission name="t"><joint name="shoulder"/></transmission>'
    )
    for stops in (None, 100.0, "none"):
        draft = imported(
            tmp_path, text.replace('lower="0.5" upper="1" effort="1" velocity="1"', limit), pose=pose, stops=stops, limits=True
        )
        one = next(link for link in draft.links if link.joint_name == "shoulder")
        assert (one.q, one.drive, one.lower, one.upper) == (q, drive, None, None)
        assert said in " ".join(draft.doubts) and not any("--stops none" in line for line in draft.lost)
        assert [tie.fields["joint"] for tie in draft.actuators] == (["shoulder"] if drive == "torque" and 'effort="1"' in limit else [])
        assert any("<transmission> of shoulder" in line for line in draft.lost) == (drive == "locked")


def test_starts_inside_the_limits(tmp_path):
    """The nearest limit, 5 % of the range inside; --pose is obeyed, and reported where it is outside."""
    assert imported(tmp_path, ARM).links[0].q == 0.525
    assert imported(tmp_path, ARM.replace('lower="0.5" upper="1"', 'lower="-3.0718" upper="-0.0698"')).links[0].q == -0.22
    posed = imported(tmp_path, ARM, pose=["shoulder=0.2"])
    assert posed.links[0].q == 0.2
    assert any("the start position is outside the limits of shoulder (0.5 to 1)" in doubt for doubt in posed.doubts)
    assert not any("chosen" in doubt for doubt in posed.doubts)


def test_limits_become_stops_on_request(tmp_path):
    draft = imported(tmp_path, ARM, stops=800.0)
    assert not any("the limits of" in sentence for sentence in draft.lost)
    first, second, _ = draft.links
    assert (first.lower, first.upper, first.stop_stiffness) == (0.5, 1, 800)
    assert (second.lower, second.upper) == (None, None), "a continuous joint has none"
    assert "lower = 0.5\nupper = 1\nstop_stiffness = 800\n" in model_text(draft)


def test_snap(tmp_path):
    draft = imported(tmp_path, ARM, snap=True)
    assert not any("angles are within" in doubt for doubt in draft.doubts)
    assert any(link.dh.theta in (math.pi / 2, -math.pi / 2) for link in draft.links)


def test_textbook_dh_comes_back(tmp_path):
    """A URDF made from modified DH keeps its parameters: no gamma, no b, the same four numbers."""
    rows = [(0, 0, 0, 0.3), (-math.pi / 2, 0, 0, 0), (math.pi / 2, 0, 0, 0.3), (math.pi / 2, 0.08, 0, 0), (0, 0.4, 0, 0.1)]
    links, joints = ['<link name="l0"/>'], []
    for i, (alpha, a, _, d) in enumerate(rows, start=1):
        links.append(
            f'<link name="l{i}"><inertial><mass value="1"/><inertia ixx="1" iyy="1" izz="1" ixy="0" ixz="0" iyz="0"/></inertial></link>'
        )
        xyz = (a, -d * round(math.sin(alpha)), d * round(math.cos(alpha)))
        joints.append(
            f'<joint name="j{i}" type="continuous"><origin xyz="{xyz[0]} {xyz[1]} {xyz[2]}" rpy="{alpha!r} 0 0"/>'
            f'<parent link="l{i - 1}"/><child link="l{i}"/><axis xyz="0 0 1"/></joint>'
        )
    draft = imported(tmp_path, f'<robot name="r">{"".join(links)}{"".join(joints)}</robot>')
    assert [link.dh for link in draft.links] == [DhFrame(alpha=alpha, a=a, theta=theta, d=d) for alpha, a, theta, d in rows]
    assert all(not link.notes for link in draft.links)


def test_settle_inverts_pose_of():
    rng = np.random.default_rng(1)
    for _ in range(300):
        quarter = rng.integers(-2, 3, 3) * np.pi / 2
        angles = quarter if rng.random() < 0.5 else rng.uniform(-3, 3, 3)
        pose = transform(rotation_z(angles[0]) @ rotation_y(angles[1]) @ rotation_x(angles[2]), rng.normal(size=3) * rng.integers(0, 2, 3))
        dh = settle(pose)
        if abs(dh.d) < 100:
            assert np.abs(pose_of(dh) - pose).max() < 1e-13
        assert abs(dh.gamma) <= np.pi / 2 + 1e-9


@pytest.mark.parametrize(
    ("old", "new", "sentence"),
    [
        (
            'type="revolute"',
            'type="ball"',
            "arm.urdf:10: joint 'shoulder': unknown type 'ball'; supported: revolute, continuous, prismatic, fixed, floating, planar",
        ),
        ('<mass value="2"/>', '<mass value="-2"/>', "arm.urdf:5: 'value' of <mass> must be >= 0, got -2"),
        ('damping="0.7"', 'damping="-0.7"', "arm.urdf:12: 'damping' of <dynamics> must be >= 0, got -0.7"),
        ('type="revolute"', 'type="revolut"', "did you mean 'revolute'?"),
        ('<joint name="shoulder"', '<joint name=""', "arm.urdf:10: 'name' of <joint> is empty"),
        ('<link name="base"', '<link name=" "', "'name' of <link> is empty"),
        ('<parent link="base"/>', '<parent link="bas"/>', "arm.urdf:11: joint 'shoulder': unknown link 'bas'; did you mean 'base'?"),
        ('<axis xyz="0 1 0"/>', '<axis xyz="0 0 0"/>', "the axis is zero"),
        ('<axis xyz="0 1 0"/>', '<axis xyz="0 1"/>', "arm.urdf:11: 'xyz' of <axis> must be 3 numbers, got '0 1'"),
        ('<mass value="2"/>', '<mass value="heavy"/>', "arm.urdf:5: 'value' of <mass> must be a number, got 'heavy'"),
        ('<mass value="2"/>', "<mass/>", "arm.urdf:5: 'value' of <mass> must be a number"),
        ("</robot>", "", "invalid XML"),
        ("<robot", "<!DOCTYPE r [<!ENTITY a 'b'>]><robot", "XML entities are not supported"),
        ('<child link="tool"/>', '<child link="time"/>', "is the child of two joints"),
        ('<child link="tool"/>', "", "joint 'end' has no <child>"),
        (
            '<link name="tool"/>',
            '<link name="tool"/><link name="alone"/>',
            "arm.urdf:9: links without a parent: base, alone; a URDF must have one root link",
        ),
        ('<link name="tool"/>', '<link name="time"/>', "duplicate link 'time'"),
        ('<parent link="base"/>', '<parent link="time"/>', "have no path to the root link 'base'"),
    ],
)
def test_mistakes(tmp_path, old, new, sentence):
    assert old in ARM
    with pytest.raises(UserError) as error:
        imported(tmp_path, ARM.replace(old, new, 1))
    assert sentence in str(error.value) and "arm.urdf" in str(error.value) and "\n" not in str(error.value)


def test_a_prefix_without_a_namespace_is_accepted(tmp_path):
    text = ARM.replace("</robot>", "<gazebo><sensor:camera/></gazebo><?plain words?><!-- no element --></robot>")
    assert "1 x <gazebo>" in imported(tmp_path, text).lost


@pytest.mark.parametrize(
    "start", ['<?xml version="0.0" ?><robot', '<?xml version="1.1" ?><robot', "<!-- run with: gz sim --verbose arm -->\n<robot"]
)
def test_a_declaration_or_comment_that_only_strict_readers_refuse_is_accepted(tmp_path, start):
    strict, lenient = imported(tmp_path, ARM), imported(tmp_path, start + ARM[ARM.index("<robot") + 6 :])
    assert lenient.links == strict.links


def test_a_deep_chain(tmp_path):
    inertial = '<inertial><mass value="1"/><inertia ixx="1" iyy="1" izz="1" ixy="0" ixz="0" iyz="0"/></inertial>'
    links = "".join(f'<link name="l{i}">{inertial}</link>' for i in range(3000))
    joints = "".join(
        f'<joint name="j{i}" type="continuous"><parent link="l{i}"/><child link="l{i + 1}"/><origin xyz="1 0 0"/></joint>'
        for i in range(2999)
    )
    assert len(imported(tmp_path, f'<robot name="chain">{links}{joints}</robot>').links) == 2999
