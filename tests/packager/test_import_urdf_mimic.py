"""<mimic> of URDF joints: couplings, start pose, names, what is reported, and a hand that one torque opens and closes."""

import math

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from build_fmu.cli import main
from build_fmu.errors import UserError
from build_fmu.importers import urdf
from build_fmu.importers.toml_writer import model_text
from build_fmu.model.describe import describe
from build_fmu.run.session import Session
from build_fmu.run.simulate import Settings, simulate
from tests.packager.import_options import import_options

INERTIAL = '<inertial><origin xyz="{}"/><mass value="{}"/><inertia ixx="{}" iyy="{}" izz="{}"/></inertial>'


def joint(name, parent, child, xyz="0 0 0.1", mimic="", kind="revolute", axis="0 1 0"):
    ends = f'<origin xyz="{xyz}"/><parent link="{parent}"/><child link="{child}"/><axis xyz="{axis}"/>'
    return f'<joint name="{name}" type="{kind}">{ends}<limit lower="-2" upper="2"/>{mimic and f"<mimic {mimic}/>"}</joint>'


def chain(*joints):
    """A robot of links l0, l1, ... in series with joints j1, j2, ...: (type, attributes of <mimic>) for each."""
    links = "".join(f'<link name="l{k}">{INERTIAL.format("0 0 0.05", 1, 0.01, 0.01, 0.01)}</link>\n' for k in range(len(joints) + 1))
    return links + "\n".join(joint(f"j{k}", f"l{k - 1}", f"l{k}", mimic=mimic, kind=kind) for k, (kind, mimic) in enumerate(joints, 1))


def imported(tmp_path, content, pose=(), stops=None):
    path = tmp_path / "hand.urdf"
    path.write_text(f'<robot name="hand">\n{content}\n</robot>', encoding="utf-8")
    return urdf.read(path, import_options(stops=stops, pose=list(pose)))


def couplings(draft):
    return [(tie.name, tie.fields) for tie in draft.couplings]


def test_a_mimic_becomes_a_coupling(tmp_path):
    content = chain(("revolute", ""), ("revolute", 'joint="j1" multiplier="-0.5" offset="0.2"'), ("prismatic", 'joint="j1"'))
    draft = imported(tmp_path, content, pose=["j1=0.6"])
    assert couplings(draft) == [
        ("j2_mimic", {"joints": ["j2", "j1"], "ratios": [1, 0.5], "offset": 0.2}),
        ("j3_mimic", {"joints": ["j3", "j1"], "ratios": [1, -1]}),
    ]
    assert [(link.joint_name, link.drive, link.q) for link in draft.links] == [
        ("j1", "torque", 0.6),
        ("j2", "free", pytest.approx(-0.1)),
        ("j3", "free", 0.6),
    ]
    assert not any("mimic" in sentence or "--pose" in sentence for sentence in draft.lost + draft.doubts)
    assert '[[coupling]]\nname = "j2_mimic"\njoints = ["j2", "j1"]\nratios = [1, 0.5]\noffset = 0.2\n' in model_text(draft)


def test_limits_of_zero_width(tmp_path, built_library):
    """They lock a leader, and with it the joint that follows; they do not lock the joint that follows."""
    content = chain(("revolute", ""), ("revolute", 'joint="j1" offset="0.2"'))
    parts = content.split('lower="-2" upper="2"')
    leader, follower = (
        imported(tmp_path, x)
        for x in (
            f'{parts[0]}lower="1" upper="1"{parts[1]}lower="-2" upper="2"{parts[2]}',
            f'{parts[0]}lower="-2" upper="2"{parts[1]}lower="0" upper="0"{parts[2]}',
        )
    )
    assert [(link.drive, link.q) for link in leader.links] == [("locked", 1), ("free", 1.2)]
    assert [(link.drive, link.q, link.upper) for link in follower.links] == [("torque", 0, 2), ("free", 0.2, None)]
    assert "the limits of j2: zero width, but the joints follow a <mimic>" in follower.lost
    for draft in (leader, follower):
        (tmp_path / "hand.toml").write_text(model_text(draft), encoding="utf-8")
        assert len(draft.couplings) == 1 and not describe(tmp_path / "hand.toml").warnings


def test_a_mimic_of_a_mimic_starts_after_its_leader(tmp_path):
    """The followers stand before their leaders in the file."""
    content = chain(("revolute", 'joint="j2" multiplier="2"'), ("revolute", 'joint="j3" offset="0.1"'), ("continuous", ""))
    draft = imported(tmp_path, content, pose=["j3=0.3"])
    assert [link.q for link in draft.links] == pytest.approx([0.8, 0.4, 0.3])
    assert [fields["joints"] for _, fields in couplings(draft)] == [["j2", "j3"], ["j1", "j2"]]


def test_names_in_the_model_are_used(tmp_path):
    """Joints that must change their names, and a joint that has the name of the coupling."""
    content = chain(("revolute", ""), ("revolute", 'joint="l1"'), ("revolute", "")).replace('"j1"', '"l1"').replace('"j2"', '"my finger"')
    draft = imported(tmp_path, content.replace('"j3"', '"my_finger_mimic"'))
    assert couplings(draft) == [("my_finger_mimic_2", {"joints": ["my_finger", "l1"], "ratios": [1, -1]})]


def test_a_multiplier_of_zero_locks_the_joint(tmp_path):
    draft = imported(tmp_path, chain(("revolute", ""), ("revolute", 'joint="j1" multiplier="0" offset="0.2"'), ("revolute", 'joint="j2"')))
    assert [(link.drive, link.q) for link in draft.links] == [("torque", 0), ("locked", 0.2), ("free", 0.2)]
    assert [fields["joints"] for _, fields in couplings(draft)] == [["j3", "j2"]]


@pytest.mark.parametrize(
    ("joints", "sentence", "left"),
    [
        ([("revolute", ""), ("revolute", 'joint="j11"')], "<mimic> of 'j2': unknown joint 'j11'; did you mean 'j1'?", []),
        ([("fixed", ""), ("revolute", 'joint="j1"')], "<mimic> of 'j2': 'j1' is not a revolute, continuous or prismatic joint", []),
        ([("revolute", ""), ("planar", 'joint="j1"')], "<mimic> of 'j2': 'j2' is not a revolute, continuous or prismatic joint", []),
        ([("revolute", 'joint="j1"')], "<mimic> of j1: cyclic references", []),
        (
            [("revolute", 'joint="j2"'), ("revolute", 'joint="j1"'), ("revolute", 'joint="j2"')],
            "<mimic> of j1, j2: cyclic references",
            [["j3", "j2"]],
        ),
        (
            [("revolute", ""), ("revolute", 'joint="j1" multiplyer="2"')],
            "'multiplyer' of <mimic>; did you mean 'multiplier'?",
            [["j2", "j1"]],
        ),
    ],
)
def test_what_is_not_converted_is_listed_once(tmp_path, joints, sentence, left):
    draft = imported(tmp_path, chain(*joints))
    assert [fields["joints"] for _, fields in couplings(draft)] == left
    about = [said for said in draft.lost if "<mimic>" in said]
    assert len(about) == 1 and sentence in about[0]
    followers = [names[0] for names in left]
    assert all((link.drive == "free") == (link.joint_name in followers) for link in draft.links)


@pytest.mark.parametrize(
    ("mimic", "sentence"),
    [
        ('multiplier="2"', "hand.urdf:6: <mimic> has no attribute 'joint'"),
        ('joint="j1" multiplier="two"', "hand.urdf:6: 'multiplier' of <mimic> must be a number, got 'two'"),
        ('joint="j1" offset="nan"', "hand.urdf:6: 'offset' of <mimic> must be a finite number, got 'nan'"),
    ],
)
def test_mistakes(tmp_path, mimic, sentence):
    with pytest.raises(UserError) as error:
        imported(tmp_path, chain(("revolute", ""), ("revolute", mimic)))
    assert sentence in str(error.value)


def test_a_start_position_that_the_mimic_changes_is_told(tmp_path):
    content = chain(("revolute", ""), ("revolute", 'joint="j1" offset="0.25"'))
    draft = imported(tmp_path, content, pose=["j*=0.5"])
    assert draft.links[1].q == 0.75
    assert "--pose: 'j2' starts at 0.75, not 0.5, because it follows 'j1'" in draft.doubts
    assert not any("--pose: 'j2'" in doubt for doubt in imported(tmp_path, content, pose=["j1=0.5", "j2=0.75"]).doubts)
    # the limits are compared with the position after the mimic
    assert any("outside the limits of j2" in doubt for doubt in imported(tmp_path, content, pose=["j1=1.9"]).doubts)


# A hand that points down: two fingers, each of a knuckle, a bar beside it, and a tip on the knuckle that stays upright.
# Name: parent, joint, COM, mass, inertia. The right finger is the mirror image of the left one.
FINGER = {
    "knuckle": ("palm", (0.03, 0, -0.05), (0, 0, -0.025), 0.06, 2e-5),
    "bar": ("palm", (0.015, 0, -0.06), (0, 0, -0.03), 0.04, 1e-5),
    "tip": ("knuckle", (0.01, 0, -0.05), (0.005, 0, -0.02), 0.03, 8e-6),
}
FOLLOWERS = {"right_knuckle": -1, "left_bar": 1, "right_bar": -1, "left_tip": -1, "right_tip": 1}
DAMPING = 0.01


def hand():
    links, joints = ['<link name="palm"/>'], []
    for side, sign in (("left", 1), ("right", -1)):
        for part, (parent, at, com, mass, inertia) in FINGER.items():
            name, carrier = f"{side}_{part}", parent if parent == "palm" else f"{side}_{parent}"
            place, middle = (f"{sign * x} {y} {z}" for x, y, z in (at, com))
            mimic = f'joint="left_knuckle_joint" multiplier="{FOLLOWERS[name]}"' if name in FOLLOWERS else ""
            links.append(f'<link name="{name}">{INERTIAL.format(middle, mass, inertia, inertia, inertia)}</link>')
            joints.append(joint(f"{name}_joint", carrier, name, place, mimic))
    text = "\n".join(links + joints)
    return text.replace("<limit", f'<dynamics damping="{DAMPING}"/><limit', 1)


def angle_of_the_hand(times, start, torque):
    """One coordinate: the knuckles and bars turn by q, the tips move as their joints do."""
    (_, _, (_, _, zk), mk, ik), (_, _, (_, _, zb), mb, ib), (_, (xt, _, zt), _, mt, _) = FINGER.values()
    inertia = 2 * (ik + mk * zk**2 + ib + mb * zb**2 + mt * (xt**2 + zt**2))

    def slope(t, y):
        q, qd = y
        # height of a point (x, z) that turns by q: z cos q - x sin q
        weight = 2 * 9.81 * ((mk * zk + mb * zb + mt * zt) * math.sin(q) + mt * xt * math.cos(q))
        return [qd, (torque(t) + weight - DAMPING * qd) / inertia]

    return solve_ivp(slope, (0, times[-1]), [start, 0], t_eval=times, rtol=1e-12, atol=1e-14, method="DOP853").y[0]


@pytest.mark.usefixtures("built_library")
def test_one_torque_opens_and_closes_a_hand(tmp_path, capsys):
    (tmp_path / "hand.urdf").write_text(f'<robot name="hand">{hand()}</robot>', encoding="utf-8")
    assert main(["import", str(tmp_path / "hand.urdf"), "--pose", "left_knuckle_joint=0.3", "-o", str(tmp_path / "hand.toml")]) == 0
    assert "6 links, 6 moving joints, 0 loops, 5 couplings, 0.26 kg" in capsys.readouterr().out
    assert main(["build", "--no-show", str(tmp_path / "hand.toml"), "-o", str(tmp_path / "hand.fmu")]) == 0
    with Session(tmp_path / "hand.fmu") as session:
        assert [name for name in session.names("input") if name.endswith(".tau")] == ["left_knuckle_joint.tau"]
        result = simulate(session, Settings(3, 0.05, 1e-11, inputs=["left_knuckle_joint.tau=0.05*sin(3*t)"]))
    angle = result["left_knuckle_joint.q"]
    assert angle.max() > 0.5 and angle.min() < -0.5, "it opens and closes"
    assert np.abs(angle - angle_of_the_hand(result.time, 0.3, lambda t: 0.05 * math.sin(3 * t))).max() < 1e-8
    for follower, sign in FOLLOWERS.items():
        assert np.abs(result[f"{follower}_joint.q"] - sign * angle).max() < 1e-9
