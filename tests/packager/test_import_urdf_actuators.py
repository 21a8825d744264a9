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
    assert "the reductions of rail: without <motorInertia> they have no effect on the motion" in draft.lost
    assert fields(draft)[0] == {"joint": "rail", "speed_limit": 0.5}
    assert "# URDF: gear_ratio = 20, without a rotor inertia\n[[actuator]]" in model_text(draft)
    # a reduction of 1 without a rotor says nothing
    assert not any("reduction" in said for said in imported(tmp_path, transmission()).lost)


@pytest.mark.parametrize(
    ("extra", "sentence"),
    [
        (transmission(kind="transmission_interface/DifferentialTransmission"), "only simple transmissions of one joint and one actuator"),
        (transmission(actuator='</actuator><actuator name="n">'), "only simple transmissions of one joint and one actuator"),
        (transmission("sholder"), "unknown joint 'sholder'; did you mean 'shoulder'?"),
        (transmission() * 2, "line 9: <transmission> 'drive': 'shoulder' already has a transmission"),
        (transmission("weld"), "<transmission> of weld: only revolute, continuous and prismatic joints have drives"),
        ('<transmission name="t"/>', "line 9: <transmission> 't': no <joint>"),
    ],
)
def test_other_transmissions_are_listed(tmp_path, extra, sentence):
    assert any(sentence in said for said in imported(tmp_path, extra).lost)


@pytest.mark.parametrize(
    ("extra", "sentence"),
    [
        (transmission(actuator="<mechanicalReduction>0</mechanicalReduction>"), "<mechanicalReduction> of 'shoulder' must not be 0"),
        (transmission(actuator="<mechanicalReduction>1:50</mechanicalReduction>"), "<mechanicalReduction> must be a number, got '1:50'"),
        (transmission(actuator="<motorInertia>-1</motorInertia>"), "<motorInertia> of 'shoulder' must be >= 0, got -1"),
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
