"""<limit effort velocity> and <transmission> of a URDF: actuators, what is reported, and the motion of the FMU."""

import math

import pytest

from build_fmu.cli import main
from build_fmu.errors import UserError
from build_fmu.fmu.build import build
from build_fmu.importers import urdf
from build_fmu.importers.toml_writer import model_text
from build_fmu.model.describe import describe
from build_fmu.run.session import Session
from tests.packager.import_options import import_options

# inertia of the arm about its axis: 0.02 + 2 * 0.1^2 = 0.04 kg m2
ROBOT = """<robot name="drives">
<link name="base"/><link name="tool"/><joint name="weld" type="fixed"><parent link="arm"/><child link="tool"/></joint>
<link name="arm"><inertial><origin xyz="0 0 -0.1"/><mass value="2"/><inertia ixx="0.02" iyy="0.02" izz="0.02"/></inertial></link>
<link name="slide"><inertial><mass value="0.5"/><inertia ixx="0.001" iyy="0.001" izz="0.001"/></inertial></link>
<joint name="shoulder" type="revolute"><parent link="base"/><child link="arm"/><axis xyz="0 1 0"/>
  <limit lower="-9" upper="9" effort="6" velocity="5"/></joint>
<joint name="rail" type="prismatic"><origin xyz="1 0 0"/><parent link="base"/><child link="slide"/><axis xyz="1 0 0"/>
  <limit lower="0" upper="1" effort="0" velocity="0.5"/></joint>
@
</robot>"""


def transmission(joint="shoulder", kind="transmission_interface/SimpleTransmission", actuator=""):
    return f'<transmission name="drive"><type>{kind}</type><joint name="{joint}"/><actuator name="m">{actuator}</actuator></transmission>'


def imported(tmp_path, extra="", text=ROBOT, **options):
    path = tmp_path / "drives.urdf"
    path.write_text(text.replace("@", extra), encoding="utf-8")
    return urdf.read(path, import_options(**options))


def fields(draft):
    return [tie.fields for tie in draft.actuators]


def test_limits_become_those_of_actuators_on_request(tmp_path):
    draft = imported(tmp_path)
    assert not draft.actuators
    assert "the effort and velocity limits of shoulder, rail: --limits converts them to limits of actuators" in draft.lost
    draft = imported(tmp_path, limits=True)
    assert fields(draft) == [{"joint": "shoulder", "torque_limit": 6, "speed_limit": 5}, {"joint": "rail", "speed_limit": 0.5}]
    assert not any("effort" in said for said in draft.lost)
    assert "limits that are not positive are read as no limit: rail (effort)" in draft.doubts
    free = imported(tmp_path, text=ROBOT.replace('effort="6" velocity="5"', 'effort="inf" velocity="-1"'), limits=True)
    assert [tie["joint"] for tie in fields(free)] == ["rail"]


def test_transmissions_become_rotors_with_gears(tmp_path):
    gear = "<mechanicalReduction>-50</mechanicalReduction><motorInertia>1e-4</motorInertia>"
    draft = imported(tmp_path, transmission(actuator=gear))
    assert fields(draft) == [{"joint": "shoulder", "gear_ratio": -50, "rotor_inertia": 1e-4}]
    assert fields(imported(tmp_path, transmission(actuator="<motorInertia>0.01</motorInertia>"))) == [
        {"joint": "shoulder", "rotor_inertia": 0.01}
    ]
    # PR2's files: the type is an attribute, the reduction is not in the actuator
    old = '<transmission name="t" type="pr2_mechanism_model/SimpleTransmission"><joint name="rail"/><actuator name="m"/>'
    draft = imported(tmp_path, f"{old}<mechanicalReduction>20</mechanicalReduction></transmission>", limits=True)
    assert "the reductions of rail: without a rotor inertia they have no effect on the motion" in draft.lost
    assert fields(draft)[0] == {"joint": "rail", "speed_limit": 0.5}
    assert "# URDF: gear_ratio = 20, without a rotor inertia\n[[actuator]]" in model_text(draft)
    # a reduction of 1 without a rotor says nothing
    assert not any("reduction" in said for said in imported(tmp_path, transmission()).lost)


GEAR, ROTOR = '<drake:gear_ratio value="160"/>', '<drake:rotor_inertia value="0.0001321"/>'
NAMESPACE = '<robot xmlns:drake="http://drake.mit.edu" name="drives">'


@pytest.mark.parametrize("head", ['<robot name="drives">', NAMESPACE, NAMESPACE.replace("<robot", '<robot xmlns="http://www.ros.org"')])
def test_rotors_of_drake_replace_those_of_ros(tmp_path, head):
    """In Drake the gear ratio is 1 by default; <mechanicalReduction> and <motorInertia> have no effect there."""
    text, gear = ROBOT.replace('<robot name="drives">', head), {"joint": "shoulder", "gear_ratio": 160, "rotor_inertia": 1.321e-4}
    draft = imported(tmp_path, transmission(actuator=GEAR + ROTOR + "<mechanicalReduction>1</mechanicalReduction>"), text)
    assert fields(draft) == [gear] and not any("drake:" in said or "mechanical" in said for said in draft.lost)
    draft = imported(tmp_path, transmission(actuator=GEAR + ROTOR + "<mechanicalReduction>5</mechanicalReduction>"), text)
    assert fields(draft) == [gear]
    assert "line 9: <mechanicalReduction> of 'shoulder': <drake:gear_ratio> and <drake:rotor_inertia> are used instead" in draft.lost
    assert fields(imported(tmp_path, transmission(actuator=ROTOR), text)) == [{"joint": "shoulder", "rotor_inertia": 1.321e-4}]
    draft = imported(tmp_path, transmission(actuator=GEAR), text)
    assert not fields(draft) and any("the reductions of shoulder: without a rotor inertia" in said for said in draft.lost)


def test_drake_has_no_actuator_without_effort(tmp_path):
    draft = imported(tmp_path, transmission("rail", actuator=ROTOR))
    assert not fields(draft)
    assert "<drake:rotor_inertia> of rail: for Drake joints with an effort limit of 0 have no actuator" in draft.lost


def test_unknown_content_of_transmissions_is_listed(tmp_path):
    odd = (
        '<transmission name="t" odd="1"><type>transmission_interface/SimpleTransmission</type><foo/>\n'
        '<joint name="shoulder" odd="1"><hardwareInterface>EffortJointInterface</hardwareInterface><offset>1</offset></joint>\n'
        '<actuator name="m" odd="1"><drake:rotor_inertai value="1"/><drake:gear_ratio value="2" unit="1"/></actuator>\n'
        f"{ROTOR}</transmission>"
    )
    text = ROBOT.replace('name="drives">', 'name="drives" xmlns:drake="http://drake.mit.edu" odd="1" drake:ignore="1">')
    lost = imported(tmp_path, odd, text.replace('<link name="tool"/>', '<link name="tool" odd="1"/>')).lost
    for line in (
        "1 x <foo> in <transmission>, first in line 9",
        "1 x <drake:rotor_inertia> in <transmission>, first in line 12; did you mean 'motorInertia'?",
        "1 x <offset> in <joint>, first in line 10",
        "1 x <drake:rotor_inertai> in <actuator>, first in line 11; did you mean 'drake:rotor_inertia'?",
        "line 1: 'odd' of <robot>",
        "line 1: 'drake:ignore' of <robot>",
        "line 2: 'odd' of <link>",
        "line 9: 'odd' of <transmission>",
        "line 10: 'odd' of <joint>",
        "line 11: 'odd' of <actuator>",
        "line 11: 'unit' of <drake:gear_ratio>",
    ):
        assert line in lost, (line, lost)
    assert not any("hardwareInterface" in line for line in lost)


@pytest.mark.parametrize(
    ("extra", "sentence"),
    [
        (transmission(kind="transmission_interface/DifferentialTransmission"), "only simple transmissions of one joint and one actuator"),
        (transmission(actuator='</actuator><actuator name="n">'), "only simple transmissions of one joint and one actuator"),
        (transmission("sholder"), "unknown joint 'sholder'; did you mean 'shoulder'?"),
        (transmission() * 2, "line 9: <transmission> 'drive': 'shoulder' already has a transmission"),
        (transmission("weld"), "<transmission> of weld: only revolute, continuous and prismatic joints have drives"),
        ('<transmission name="t"/>', "line 9: <transmission> 't': no <joint>"),
        (
            transmission(actuator="<mechanicalReduction>1:50</mechanicalReduction>"),
            "drives.urdf:9: <mechanicalReduction> must be a number, got '1:50'; without <motorInertia> it has no effect",
        ),
    ],
)
def test_other_transmissions_are_listed(tmp_path, extra, sentence):
    assert any(sentence in said for said in imported(tmp_path, extra).lost)


@pytest.mark.parametrize(
    ("extra", "sentence"),
    [
        (transmission(actuator="<mechanicalReduction>0</mechanicalReduction>"), "<mechanicalReduction> of 'shoulder' must not be 0"),
        (
            transmission(actuator="<mechanicalReduction>1:50</mechanicalReduction><motorInertia>1</motorInertia>"),
            "<mechanicalReduction> must be a number, got '1:50'",
        ),
        (transmission(actuator="<motorInertia>-1</motorInertia>"), "<motorInertia> of 'shoulder' must be >= 0, got -1"),
        (transmission(actuator='<drake:gear_ratio value="0"/>'), "<drake:gear_ratio> of 'shoulder' must not be 0"),
        (transmission(actuator='<drake:gear_ratio value="1:5"/>'), "'value' of <drake:gear_ratio> must be a number, got '1:5'"),
        (transmission(actuator='<drake:rotor_inertia value="-1"/>'), "<drake:rotor_inertia> of 'shoulder' must be >= 0, got -1"),
    ],
)
def test_impossible_numbers_are_refused(tmp_path, extra, sentence):
    with pytest.raises(UserError, match=r"drives\.urdf:9: ") as error:
        imported(tmp_path, extra)
    assert sentence in str(error.value)


def test_a_mimic_joint_has_no_actuator(tmp_path):
    text = ROBOT.replace("@", transmission("rail", actuator="<motorInertia>1</motorInertia>")).replace('"1" effort="0"', '"1" effort="3"')
    draft = imported(
        tmp_path, text=text.replace("</joint>\n<transmission", '<mimic joint="shoulder"/></joint>\n<transmission'), limits=True
    )
    assert [tie["joint"] for tie in fields(draft)] == ["shoulder"]
    assert "the drives of rail: mimic joints have no drive of their own" in draft.lost


@pytest.mark.usefixtures("built_library")
def test_the_fmu_obeys_the_limits(tmp_path, monkeypatch, capfd):
    """A torque of 50 N m gives 6 N m on arm and rotor, and at 5 rad/s nothing but the torque of the weight."""
    monkeypatch.chdir(tmp_path)
    gear = "<mechanicalReduction>20</mechanicalReduction><motorInertia>1e-4</motorInertia>"
    (tmp_path / "drives.urdf").write_text(ROBOT.replace("@", transmission(actuator=gear)), encoding="utf-8")
    assert main(["import", "drives.urdf", "--limits"]) == 0
    said = capfd.readouterr()
    assert "2 actuators" in said.out and "has no effect" not in said.err
    file, fmu = tmp_path / "drives.toml", tmp_path / "drives.fmu"
    build(describe(file), file, fmu)
    inertia, q = 0.04 + 20**2 * 1e-4, 0.3
    weight = 2 * 9.81 * 0.1 * math.sin(q)
    with Session(fmu) as session:
        for speed, torque in ((0, 6), (5, 0)):
            session.initialise(0, 1, None, {"shoulder.q0": q, "shoulder.qd0": speed, "shoulder.tau": 50})
            assert session.read(["shoulder.qdd"])[0] == pytest.approx((torque - weight) / inertia, rel=1e-12)
            session.instance.reset()


@pytest.mark.usefixtures("built_library")
def test_the_reflected_inertia_is_that_of_drake(tmp_path):
    """Drake adds gear_ratio^2 rotor_inertia to the inertia of the joint; its input is the torque on the joint."""
    inertial = '<inertial><mass value="1"/><origin xyz="0.5 0 0"/><inertia ixx="0" iyy="0.01" izz="0.01"/></inertial>'
    joint = '<joint name="j" type="continuous"><parent link="world"/><child link="arm"/><axis xyz="0 1 0"/></joint>'
    drive = transmission("j", actuator=GEAR + ROTOR)
    draft = imported(tmp_path, text=f'{NAMESPACE}<link name="world"/><link name="arm">{inertial}</link>{joint}{drive}</robot>')
    file, fmu = tmp_path / "drives.toml", tmp_path / "drives.fmu"
    file.write_text(model_text(draft), encoding="utf-8")
    build(describe(file), file, fmu)
    with Session(fmu) as session:
        for torque in (0, 3):
            session.initialise(0, 1, None, {"j.tau": torque})
            wanted = (0.5 * 9.81 + torque) / (0.01 + 0.5**2 + 160**2 * 1.321e-4)
            assert session.read(["j.qdd"])[0] == pytest.approx(wanted, rel=1e-12)
            session.instance.reset()
