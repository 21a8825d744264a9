"""Conversion of SDF files: poses, joints, closed loops, defaults, losses, errors; the arm's accelerations are Drake's."""

import math
from pathlib import Path

import numpy as np
import pytest

from build_fmu.errors import UserError
from build_fmu.fmu.build import build_for_run
from build_fmu.importers import sdf
from build_fmu.importers.rigid import start_poses
from build_fmu.importers.toml_writer import model_text
from build_fmu.model.describe import describe
from build_fmu.run.session import Session
from tests.command_line import command
from tests.packager.import_options import import_options

ARM = Path(__file__).parent / "data" / "arm.sdf"
needs_library = pytest.mark.usefixtures("built_library")

BAR = "<inertial><pose>{0} 0 0 0 0 0</pose><mass>{1}</mass><inertia><ixx>0.01</ixx><iyy>{2}</iyy><izz>{2}</izz></inertia></inertial>"
# two equal cranks of 0.5 m, hanging down, and a coupler of 1 m
PARALLELOGRAM = f"""<sdf version="1.7"><model name="parallelogram">
<link name="left"><pose>0 0 0 0 1.5707963267948966 0</pose>{BAR.format(0.25, 2, 0.04)}</link>
<link name="right"><pose>1 0 0 0 1.5707963267948966 0</pose>{BAR.format(0.25, 2, 0.04)}</link>
<link name="coupler"><pose>0 0 -0.5 0 0 0</pose>{BAR.format(0.5, 3, 0.1)}</link>
<joint name="a" type="revolute"><parent>world</parent><child>left</child><axis><xyz>0 1 0</xyz></axis></joint>
<joint name="b" type="continuous"><parent>world</parent><child>right</child><axis><xyz>0 1 0</xyz></axis></joint>
<joint name="c" type="revolute"><parent>left</parent><child>coupler</child><axis><xyz>0 1 0</xyz></axis></joint>
<joint name="d" type="revolute"><pose>1 0 0 0 0 0</pose><parent>right</parent><child>coupler</child><axis><xyz>0 1 0</xyz></axis></joint>
</model></sdf>"""
DOG = """<sdf version="1.11"><model name="dog"><pose>1 2 3 0 0 1.5707963267948966</pose>
<link name="trunk"><collision name="c"><geometry><box><size>0.4 0.2 0.1</size></box></geometry></collision></link>
<link name="hip"><pose>0.2 0 0 0 0 0</pose></link><link name="foot"><pose>0.2 0 -0.3 0 0 0</pose></link><link name="tail"><pose>-0.2 0 0 0 0 0</pose></link>
<joint name="j1" type="revolute"><parent>trunk</parent><child>hip</child><axis><xyz>0 1 0</xyz>
  <limit><lower>-1e16</lower><upper>0.5</upper><effort>inf</effort><velocity>3</velocity></limit></axis></joint>
<joint name="j2" type="prismatic"><parent>hip</parent><child>foot</child><axis><xyz>0 0 1</xyz>
  <mimic joint="j1"><multiplier>0.1</multiplier><offset>0.02</offset><reference>0.3</reference></mimic></axis></joint>
<joint name="j3" type="ball"><parent>trunk</parent><child>tail</child></joint></model></sdf>"""


def imported(tmp_path, text, **options):
    path = tmp_path / "robot.sdf"
    path.write_text(text, encoding="utf-8")
    return sdf.read(path, import_options(**options))


def outputs(draft, tmp_path, values, names):
    """Returns outputs of the model's FMU at its start."""
    model, fmu = tmp_path / "model.toml", tmp_path / "model.fmu"
    model.write_text(model_text(draft), encoding="utf-8")
    build_for_run(describe(model), model, fmu)
    with Session(fmu) as session:
        session.initialise(0, 1, None, values)
        return session.read(names)


@needs_library
@pytest.mark.parametrize("limit", ["", "<effort>0</effort><velocity>0</velocity>"])
def test_limits_of_zero_width_lock_the_joint(tmp_path, limit):
    links = "".join(f'<link name="l{k}"><pose>{k} 0 0 0 0 0</pose>{BAR.format(0.5, 1, 0.1)}</link>' for k in (0, 1))
    joints = "".join(
        f'<joint name="j{k}" type="revolute"><parent>{parent}</parent><child>l{k}</child><axis><xyz>0 1 0</xyz>{inner}</axis></joint>'
        for k, parent, inner in ((0, "world", ""), (1, "l0", f"<limit><lower>0</lower><upper>0</upper>{limit}</limit>"))
    )
    draft = imported(tmp_path, f'<sdf version="1.9"><model name="m">{links}{joints}</model></sdf>')
    assert [link.drive for link in draft.links] == ["torque", "locked"]
    assert any("limits of zero width lock the joints: j1 = 0;" in line for line in draft.doubts)
    # one rigid pendulum: (0.1 + 0.5^2 + 0.1 + 1.5^2) qdd = (0.5 + 1.5) g
    np.testing.assert_allclose(outputs(draft, tmp_path, {}, ["j0.qdd"]), [2 * 9.8 / 2.7], rtol=1e-12)


def test_spaces_around_names_do_not_count(tmp_path):
    spaced = DOG.replace('name="j1"', 'name=" j1 "').replace('name="hip"', 'name=" hip"').replace("<parent>hip<", "<parent> hip <")
    assert spaced.count(" hip") == 2 and model_text(imported(tmp_path, spaced)) == model_text(imported(tmp_path, DOG))


@pytest.mark.parametrize("word", ["true", "True", " TRUE ", "1"])
def test_a_boolean_has_letters_of_any_case(tmp_path, word):
    static = f'<model name="table"><static>{word}</static><link name="top"/></model>'
    axis = f"<axis><xyz>1 0 0</xyz><use_parent_model_frame>{word}</use_parent_model_frame></axis>"
    body = f'<link name="arm"><pose degrees="{word}">0 0 1 0 0 90</pose><inertial auto="{word}"/></link>'
    joint = f'<joint name="j" type="revolute"><parent>world</parent><child>arm</child>{axis}</joint>'
    draft = imported(tmp_path, f'<sdf version="1.6"><world name="w">{static}<model name="m">{body}{joint}</model></world></sdf>', mass=1.0)
    assert any("automatic inertia of 'arm'" in line for line in draft.lost)
    (link,) = draft.links
    pose = start_poses([link])["arm"]
    np.testing.assert_allclose(pose[:3, 2], [1, 0, 0], atol=1e-15)
    turned = f'<pose degrees="{word}">0 0 1 0 0 90</pose>'
    one, other = (
        imported(tmp_path, PARALLELOGRAM.replace('name="parallelogram">', f'name="parallelogram">{text}', 1)).links
        for text in (turned, "<pose>0 0 1 0 0 1.5707963267948966</pose>")
    )
    assert [link.dh for link in one] == [link.dh for link in other]


@needs_library
def test_accelerations_of_drake(tmp_path):
    """Drake 1.51, MultibodyPlant, of the same file, with the gravity of its <world>."""
    joints = ["shoulder", "elbow_1", "elbow_2", "slide"]
    positions, velocities = [0.3, -0.4, 0.7, 0.15], [0.5, 1.1, -0.6, 0.2]
    values = {f"{joint}.q0": x for joint, x in zip(joints, positions, strict=True)}
    values |= {f"{joint}.qd0": x for joint, x in zip(joints, velocities, strict=True)}
    found = outputs(sdf.read(ARM, import_options(stops="none")), tmp_path, values, [f"{joint}.qdd" for joint in joints])
    np.testing.assert_allclose(found, [14.84159938450291, -7.296907347168234, 0.816276148928198, 0.7202824320143346], rtol=1e-12)


@needs_library
@pytest.mark.parametrize("angle", [0.3, 2.0])
def test_a_closed_parallelogram_is_a_pendulum(tmp_path, angle):
    draft = imported(tmp_path, PARALLELOGRAM, stops="none")
    assert [(loop.name, loop.fields["type"], loop.fields["link_a"], loop.fields["link_b"]) for loop in draft.loops] == [
        ("d", "revolute", "right", "coupler")
    ]
    values = {"a.q0": angle, "b.q0": angle, "c.q0": -angle}
    acceleration, gap = outputs(draft, tmp_path, values, ["a.qdd", "d.gap"])
    inertia = 2 * (0.04 + 2 * 0.25**2) + 3 * 0.5**2
    assert acceleration == pytest.approx(-9.8 * (2 * 2 * 0.25 + 3 * 0.5) * math.sin(angle) / inertia, rel=1e-12)
    assert gap < 1e-12


def test_a_model_without_a_joint_to_the_world_floats(tmp_path):
    draft = imported(tmp_path, DOG)
    assert [(link.name, link.parent, link.joint, link.joint_name) for link in draft.links] == [
        ("trunk", "ground", "free", "trunk"),
        ("hip", "trunk", "revolute", "j1"),
        ("foot", "hip", "prismatic", "j2"),
        ("tail", "trunk", "spherical", "j3"),
    ]
    assert draft.gravity == [0, 0, -9.8]
    turn = np.array([[0, -1, 0], [1, 0, 0], [0, 0, 1]])
    np.testing.assert_allclose(start_poses(draft.links)["trunk"][:3], np.column_stack([turn, [1, 2, 3]]), atol=1e-15)
    # the follower is 0.1 (q - 0.3) + 0.02
    assert draft.couplings[0].fields == {"joints": ["j2", "j1"], "ratios": [1, -0.1], "offset": pytest.approx(-0.01)}
    for sentence in ("the limit of 'j1', which has one on one side only", "the effort and velocity limits of j1"):
        assert any(sentence in line for line in draft.lost), draft.lost
    assert sum("has no <inertial>: 1 kg and 1 kg m2, the default of SDF" in line for line in draft.doubts) == 4
    assert [link.mass for link in draft.links] == [1, 1, 1, 1]


@pytest.mark.parametrize(
    ("inner", "limits", "idle"),
    [
        ("", {}, ""),
        ("<effort>-1</effort><velocity>inf</velocity>", {}, ""),
        ("<effort>5</effort><velocity>1e16</velocity>", {"torque_limit": 5}, ""),
        ("<effort>5</effort><velocity>0</velocity>", {"torque_limit": 5}, "j1 (velocity)"),
    ],
)
def test_limits_that_are_absent_or_negative_are_none(tmp_path, inner, limits, idle):
    draft = imported(tmp_path, DOG.replace("<effort>inf</effort><velocity>3</velocity>", inner), limits=True)
    assert [tie.fields for tie in draft.actuators] == ([{"joint": "j1"} | limits] if limits else [])
    assert [line.rpartition(": ")[2] for line in draft.doubts if "not positive" in line] == ([idle] if idle else [])


def test_a_density_fills_links_without_inertia(tmp_path):
    assert imported(tmp_path, DOG, density=1000).links[0].mass == pytest.approx(8)


def test_losses_and_shapes_of_the_arm():
    draft = sdf.read(ARM, import_options())
    assert draft.lost[:3] == [
        "1 x <surface> in <collision>, first in line 11",
        "1 x <plugin> in <model>, first in line 20",
        "1 x <light> in <world>, first in line 22",
    ]
    assert [(one.fields["link"], one.fields["size"], one.fields["color"]) for one in draft.shapes] == [
        ("upper", [0.1, 0.2, 0.3], [1, 0, 0])
    ]


def test_other_content_is_listed(tmp_path):
    text = PARALLELOGRAM.replace(
        "</model>",
        '<joint name="g" type="gearbox"><parent>left</parent><child>right</child></joint><include><uri>model://gripper</uri></include></model>'
        '<model name="table"><static>true</static><link name="top"/></model>',
    )
    lost = "\n".join(imported(tmp_path, text).lost)
    for sentence in ("the models table: one model is imported, 'parallelogram'", "joint 'g' of type gearbox", "1 x <include> in <model>"):
        assert sentence in lost


def test_the_pose_of_the_model_is_that_of_its_placement_frame(tmp_path):
    one, other = (
        imported(tmp_path, PARALLELOGRAM.replace('name="parallelogram">', f'name="parallelogram"{text}>', 1)).links
        for text in (' placement_frame="right"><pose>1 2 3 0 0 0</pose', "><pose>1 2 2 0 -1.5707963267948966 0</pose")
    )
    ours, wanted = start_poses(one), start_poses(other)
    assert len(ours) == 4
    for name, pose in ours.items():
        np.testing.assert_allclose(pose, wanted[name], atol=1e-12)


def test_forces_of_a_joint_that_closes_a_loop_are_listed(tmp_path):
    text = PARALLELOGRAM.replace("</axis></joint>\n</model>", "<dynamics><damping>2</damping></dynamics></axis></joint></model>")
    assert any(line.endswith("robot.sdf:8: dynamics of 'd', which closes a loop") for line in imported(tmp_path, text).lost)


@pytest.mark.parametrize(("kind", "found"), [("ball", "dynamics, limit, mimic"), ("fixed", "mimic")])
def test_what_the_axis_of_a_joint_without_one_contains_is_listed(tmp_path, kind, found):
    axis = '<axis><dynamics><damping>2</damping></dynamics><limit><upper>1</upper></limit><mimic joint="j1"/></axis>'
    text = DOG.replace('<joint name="j3" type="ball">', f'<joint name="j3" type="{kind}">{axis}')
    assert any(line.endswith(f"robot.sdf:8: {found} of 'j3': not supported for {kind} joints") for line in imported(tmp_path, text).lost)


ROTOR = "<drake:gear_ratio>160</drake:gear_ratio><drake:rotor_inertia>0.0001321</drake:rotor_inertia>"
ARM_WITH_ROTOR = f"""<sdf version="1.9" xmlns:drake="http://drake.mit.edu"><model name="m"><link name="arm">{BAR.format(0.5, 1, 0.01)}</link>
<joint name="j" type="revolute"><parent>world</parent><child>arm</child><axis><xyz>0 1 0</xyz></axis>{ROTOR}</joint></model></sdf>"""


@needs_library
def test_the_reflected_inertia_is_that_of_drake(tmp_path):
    """Drake adds gear_ratio^2 rotor_inertia to the inertia of the joint."""
    draft = imported(tmp_path, ARM_WITH_ROTOR)
    assert [tie.fields for tie in draft.actuators] == [{"joint": "j", "gear_ratio": 160, "rotor_inertia": 1.321e-4}]
    wanted = 0.5 * 9.8 / (0.01 + 0.5**2 + 160**2 * 1.321e-4)
    np.testing.assert_allclose(outputs(draft, tmp_path, {}, ["j.qdd"]), [wanted], rtol=1e-12)


def test_rotors_of_other_joints_are_listed(tmp_path):
    def lost(text):
        draft = imported(tmp_path, text)
        assert not draft.actuators
        return draft.lost

    limited = ARM_WITH_ROTOR.replace("</axis>", "<limit><effort>0</effort></limit></axis>")
    assert "<drake:rotor_inertia> of j: for Drake joints with an effort limit of 0 have no actuator" in lost(limited)
    closing = PARALLELOGRAM.replace("</axis></joint>\n</model>", f"</axis>{ROTOR}</joint></model>")
    assert any(line.endswith("robot.sdf:8: drake:gear_ratio, drake:rotor_inertia of 'd', which closes a loop") for line in lost(closing))
    universal = ARM_WITH_ROTOR.replace("revolute", "universal").replace("</joint>", "<axis2><xyz>1 0 0</xyz></axis2></joint>")
    assert any("drake:rotor_inertia of 'j': a universal joint has no drive in Drake" in line for line in lost(universal))
    fixed = ARM_WITH_ROTOR.replace(
        "</model>", f'<link name="t"/><joint name="k" type="fixed"><parent>arm</parent><child>t</child>{ROTOR}</joint></model>'
    )
    assert any("the rotors of k: only revolute, continuous and prismatic joints" in line for line in imported(tmp_path, fixed).lost)
    unknown = ARM_WITH_ROTOR.replace("drake:rotor_inertia", "drake:rotor_inertai")
    assert "1 x <drake:rotor_inertai> in <joint>, first in line 2; did you mean 'drake:rotor_inertia'?" in lost(unknown)


GEARBOX = '<joint name="g" type="gearbox"><parent>a</parent><child>b</child><gearbox_ratio>3</gearbox_ratio></joint>'
TWO_ARMS = f"""<sdf version="1.9"><model name="m"><link name="a">{BAR.format(0.5, 1, 0.1)}</link>
<link name="b"><pose>1 0 0 0 0 0</pose>{BAR.format(0.5, 1, 0.1)}</link>
<joint name="j" type="revolute"><parent>world</parent><child>a</child><axis><xyz>0 1 0</xyz></axis></joint>
@<joint name="k" type="revolute"><parent>a</parent><child>b</child><axis><xyz>0 1 0</xyz></axis></joint>
</model></sdf>"""


def test_a_gearbox_joint_carries_no_link(tmp_path):
    before, after = imported(tmp_path, TWO_ARMS.replace("@", GEARBOX)), imported(tmp_path, TWO_ARMS.replace("@", ""))
    assert before.links == after.links and not before.loops
    assert any(line.endswith("robot.sdf:4: joint 'g' of type gearbox: add a [[coupling]]") for line in before.lost)
    # alone it leaves its child free
    alone = imported(
        tmp_path, TWO_ARMS.replace("@", GEARBOX).replace('<joint name="k"', "<!--").replace("</joint>\n</model>", "--></model>")
    )
    assert {(link.name, link.parent, link.joint) for link in alone.links} == {("a", "ground", "revolute"), ("b", "ground", "free")}
    with pytest.raises(UserError, match=r"robot\.sdf:1: cyclic parent references; an SDF must have one root link"):
        imported(tmp_path, TWO_ARMS.replace("@", GEARBOX).replace("world", "b"))


@pytest.mark.parametrize(("axis", "leader"), [("", "j_1"), (' axis="axis"', "j_1"), (' axis="axis2"', "j_2")])
def test_a_mimic_of_a_universal_joint_follows_one_of_its_axes(tmp_path, axis, leader):
    """By the specification the attribute `axis` is "axis" by default, and "axis2" is for leaders with several axes."""
    mimic = (
        f'<mimic joint="j"{axis}><multiplier>2</multiplier><offset>0.1</offset><reference>0.3</reference></mimic></axis></joint>\n</model>'
    )
    text = TWO_ARMS.replace("@", "").replace("</axis></joint>\n</model>", mimic)
    draft = imported(tmp_path, text.replace('revolute"><parent>world', 'universal"><axis2><xyz>1 0 0</xyz></axis2><parent>world'))
    assert draft.couplings[0].fields == {"joints": ["k", leader], "ratios": [1, -2], "offset": pytest.approx(0.1 - 2 * 0.3)}
    # a revolute joint has one axis
    draft = imported(tmp_path, text)
    assert len(draft.couplings) == (leader == "j_1")
    assert any(line.endswith("robot.sdf:4: <mimic> of 'k': 'j' has no <axis2>") for line in draft.lost) == (leader == "j_2")


def test_names_of_the_parts_of_a_universal_joint_are_not_those_of_the_file(tmp_path):
    text = TWO_ARMS.replace("@", "").replace('revolute"><parent>world', 'universal"><axis2><xyz>1 0 0</xyz></axis2><parent>world')
    text = text.replace('"a"', '"j_cross"').replace(">a<", ">j_cross<").replace('"k"', '"j_1"')
    text = text.replace("</axis></joint>\n</model>", '<mimic joint="j"/></axis></joint>\n</model>')
    draft = imported(tmp_path, text)
    assert [(one.name, one.parent, one.joint_name) for one in draft.links] == [
        ("j_cross_2", "ground", "j_1_2"),
        ("j_cross", "j_cross_2", "j_2"),
        ("b", "j_cross", "j_1"),
    ]
    assert draft.couplings[0].fields["joints"] == ["j_1", "j_1_2"]


def test_model_as_an_end_of_a_joint_is_the_canonical_link(tmp_path):
    """The frame __model__ is attached to the canonical link (`//joint/parent` of the specification)."""
    text = TWO_ARMS.replace("@", "").replace("<parent>a", "<parent>__model__")
    parents = {link.name: link.parent for link in imported(tmp_path, text).links}
    assert parents == {"a": "ground", "b": "a"}
    with pytest.raises(UserError, match=r"robot\.sdf:\d: joint 'k': unknown link 'c'"):
        imported(tmp_path, text.replace("<model ", '<model canonical_link="c" '))


@pytest.mark.parametrize(
    ("version", "world", "gravity"),
    [("1.5", "", [0, 1, -2]), ("1.4", "", [0, 1, -2]), ("1.6", "", [0, 0, -9.8]), ("1.5", "<gravity>3 0 0</gravity>", [3, 0, 0])],
)
def test_gravity_belongs_to_physics_until_version_1_5(tmp_path, version, world, gravity):
    """`1_5.convert` of sdformat moves it to <world>."""
    model = PARALLELOGRAM.partition('<sdf version="1.7">')[2].removesuffix("</sdf>")
    physics = '<physics type="ode"><gravity>0 1 -2</gravity></physics>'
    text = f'<sdf version="{version}"><world name="w">{physics}{world}{model}</world></sdf>'
    assert imported(tmp_path, text).gravity == gravity


def test_a_joint_that_closes_a_loop_leads_no_mimic(tmp_path):
    text = PARALLELOGRAM.replace("</axis>", '<mimic joint="d"/></axis>', 1)
    assert any(line.endswith("robot.sdf:5: <mimic> of 'a': 'd' closes a loop") for line in imported(tmp_path, text).lost)


@pytest.mark.parametrize(
    ("old", "new", "sentence"),
    [
        ("sdf", "sd", "the root element must be <sdf>, got <sd>"),
        ('type="continuous"', 'type="screw"', "robot.sdf:6: joint 'b': unsupported type 'screw'; supported: revolute"),
        ("<parent>world</parent><child>left", "<parent>wold</parent><child>left", "robot.sdf:5: joint 'a': unknown link 'wold'"),
        ("<child>coupler</child>", "<child>copler</child>", "robot.sdf:7: joint 'c': unknown link 'copler'; did you mean 'coupler'?"),
        (
            "<parent>world</parent><child>left",
            "<parent>robot::base</parent><child>left",
            "robot.sdf:5: joint 'a': unknown link 'robot::base': included and nested models are not supported; copy their links",
        ),
        ("<pose>1 0 0 0 1.5", '<pose relative_to="robot::b">1 0 0 0 1.5', "frame 'robot::b': included and nested models are not supported"),
        ("<pose>1 0 0 0 1.5", '<pose relative_to="b">1 0 0 0 1.5', "cyclic references of poses: right, b, right"),
        ("<pose>1 0 0 0 0 0<", "<pose>1 0 0 0 0<", "robot.sdf:8: <pose> must be 6 numbers, got '1 0 0 0 0'"),
        ("<xyz>0 1 0</xyz>", "<xyz>0 0 0</xyz>", "robot.sdf:5: joint 'a': the axis is zero"),
        ('<link name="right">', '<link name="left">', "robot.sdf:3: duplicate name 'left'"),
        ("<parent>world</parent><child>left", "<parent>coupler</parent><child>left", "robot.sdf:2: cyclic parent references: left"),
        ('version="1.7"', 'version="2.0"', "robot.sdf:1: version '2.0' is not supported: expected 1.3 to 1.11"),
        ("<mass>2</mass>", "<mass>two</mass>", "robot.sdf:2: 'value' of <mass> must be a number, got 'two'"),
    ],
)
def test_errors_have_file_line_and_element(tmp_path, old, new, sentence):
    with pytest.raises(UserError) as error:
        imported(tmp_path, PARALLELOGRAM.replace(old, new))
    assert sentence in str(error.value) and "\n" not in str(error.value)


def test_an_unknown_name_in_a_model_with_includes_names_the_cause(tmp_path):
    text = PARALLELOGRAM.replace("</model>", '<include merge="true"><uri>model://box</uri></include></model>').replace(
        "<child>coupler", "<child>box"
    )
    with pytest.raises(
        UserError, match="unknown link 'box': included and nested models are not supported; copy their links and joints into the model"
    ):
        imported(tmp_path, text)


def test_shapes_of_drake(tmp_path):
    shapes = "".join(
        f"<visual name='{k}'><geometry>{shape}</geometry></visual>"
        for k, shape in enumerate(
            (
                "<drake:capsule><radius>0.1</radius><length>0.2</length></drake:capsule>",
                "<drake:ellipsoid><a>0.1</a><b>0.1</b><c>0.2</c></drake:ellipsoid>",
            )
        )
    )
    draft = imported(tmp_path, PARALLELOGRAM.replace("</link>", shapes + "</link>", 1))
    assert [(shape.fields["kind"], shape.fields["size"]) for shape in draft.shapes] == [("capsule", [0.1, 0.2])]
    assert any("<ellipsoid> shapes" in line for line in draft.lost)


@needs_library
def test_the_command_recognises_an_sdf_by_its_root_element(tmp_path):
    file = tmp_path / "model.xml"
    file.write_text(PARALLELOGRAM, encoding="utf-8")
    done = command("import", file, "-o", tmp_path / "p.toml")
    assert done.returncode == 0 and "3 links, 3 moving joints, 1 loop" in done.stdout
    done = command("import", file, "--floating")
    assert done.returncode == 2 and "--floating has no effect on 'model.xml': it applies to URDF files" in done.stderr
