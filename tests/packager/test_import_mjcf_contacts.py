"""Contacts of MJCF geoms with the ground: which pairs collide, and with which friction. References: `mj_forward` of MuJoCo 4.0.0."""

from __future__ import annotations

import tomllib

import numpy as np
import pytest

import build_fmu as rds
from build_fmu.errors import UserError
from build_fmu.importers import mjcf
from build_fmu.importers.toml_writer import model_text
from build_fmu.model.describe import describe
from tests.packager.import_options import import_options


def imported(tmp_path, plane: str, geom: str, after: str = "", body: bool = False, **options):
    """Returns the draft of a ball on a plane, and a second one that always collides; `body`: the plane is one of a fixed body."""
    path = tmp_path / "ball.xml"
    before, behind = ('<body name="arena" pos="0 1 -1"><frame pos="0 0 1">', "</frame></body>") if body else ("", "")
    path.write_text(
        f"""<mujoco><worldbody>{before}<geom name="p" type="plane" size="1 1 1" {plane}/>{behind}<body name="b" pos="0 0 0.09"><freejoint/>
        <geom name="g" size="0.1" {geom}/></body><body name="other" pos="0 1 0.1"><freejoint/><geom name="o" size="0.1" conaffinity="7"/></body></worldbody>
        {after}</mujoco>"""
    )
    return mjcf.read(path, import_options(contact="all", **options))


OVERRIDE = '<flag override="enable"/>'
# friction None: no contact
CASES = [
    ("", "", "", 1.0),
    ('friction="0.05"', "", "", 1.0),
    ('friction="0.05"', 'friction="0.02 0.3"', "", 0.05),
    ('friction="0.05" priority="1"', "", "", 0.05),
    ('condim="1"', "", "", 1.0),
    ('condim="1"', 'condim="1"', "", 0.0),
    ('condim="1" priority="2"', "", "", 0.0),
    ("", 'contype="2" conaffinity="4"', "", None),
    ('contype="2" conaffinity="4"', 'conaffinity="2"', "", 1.0),
    ("", 'contype="0" conaffinity="0"', "", None),
    ("", "", '<contact><pair geom1="p" geom2="g" friction="0.3"/></contact>', 0.3),
    ('friction="0.05"', 'friction="0.02"', '<contact><pair geom1="p" geom2="g"/></contact>', 1.0),
    ("", 'contype="0" conaffinity="0"', '<contact><pair geom1="g" geom2="p" condim="1"/></contact>', 0.0),
    ("", "", '<contact><exclude body1="b" body2="world"/></contact>', None),
    ("", "", '<contact><pair geom1="p" geom2="g" friction="0.3"/><exclude body1="world" body2="b"/></contact>', 0.3),
    ('contype="0" conaffinity="0"', "", '<contact><pair geom1="p" geom2="o"/></contact>', None),
    ("", "", f'<option o_friction="2 2 .1 .1 .1">{OVERRIDE}</option>', 2.0),
    ("", 'friction="0.3"', f'<option>{OVERRIDE}</option><contact><pair geom1="p" geom2="g" friction="0.4"/></contact>', 1.0),
    ('condim="1"', 'condim="1"', f'<option o_friction="2">{OVERRIDE}</option>', 0.0),
    ("", "", '<option o_friction="2"/>', 1.0),
]
IN_BODY = [
    ('friction="1.5"', "", "", 1.5),
    ('friction="1.5"', "", '<contact><exclude body1="world" body2="b"/></contact>', 1.5),
    ('friction="1.5"', "", '<contact><exclude body1="arena" body2="b"/></contact>', None),
]
ALL = [(*case, False) for case in CASES] + [(*case, True) for case in IN_BODY]


@pytest.mark.parametrize(("plane", "geom", "after", "friction", "body"), ALL)
def test_pairs_and_friction_are_those_of_mujoco(tmp_path, plane, geom, after, friction, body):
    draft = imported(tmp_path, plane, geom, after, body)
    assert not any("a plane other than z = 0" in line for line in draft.lost)
    found = {one.fields["link_a"]: one.fields["friction"] for one in draft.contacts}
    assert found.get("b") == friction and "other" in found


@pytest.mark.parametrize(("plane", "geom", "after", "friction", "body"), ALL)
def test_the_references_are_those_of_mujoco(tmp_path, plane, geom, after, friction, body):
    mujoco = pytest.importorskip("mujoco")
    imported(tmp_path, plane, geom, after, body)
    model = mujoco.MjModel.from_xml_path(str(tmp_path / "ball.xml"))
    data = mujoco.MjData(model)
    mujoco.mj_forward(model, data)
    own = [contact for contact in data.contact if model.geom("g").id in contact.geom]
    assert [0.0 if contact.dim == 1 else contact.friction[0] for contact in own] == ([] if friction is None else [pytest.approx(friction)])


def test_the_report_tells_what_the_file_states_from_what_is_assumed(tmp_path):
    (line,) = [line for line in imported(tmp_path, 'friction="0.05"', 'friction="0.02"').doubts if "contact of" in line]
    assert line.endswith("damping 2 s/m, friction_velocity 0.001 m/s are assumed; friction 0.05 (b), 1 (other) as in the file")
    draft = imported(tmp_path, 'condim="1"', 'condim="1"')
    smooth = next(one for one in draft.contacts if one.fields["link_a"] == "b")
    assert smooth.fields["friction"] == 0 and "friction_velocity" not in smooth.fields
    lost = imported(tmp_path, "", 'solref="0.01 1" margin="0.01" condim="6"').lost
    for what in ("solref", "margin", "resistance to torsion and rolling (condim 6)"):
        assert f"{what} of the contacts of b: another law, with the stiffness and damping below" in lost
    assert not any("solref" in line for line in imported(tmp_path, "", "").lost)
    lost = imported(tmp_path, "", 'solref="0.01 1"', f'<option o_margin="0.01">{OVERRIDE}</option>').lost
    assert any(line.startswith("margin of the contacts of b, other") for line in lost) and not any("solref" in line for line in lost)


def test_a_plane_elsewhere_is_listed_if_it_collides(tmp_path):
    def lines(plane):
        return [line for line in imported(tmp_path, plane, "", body=True).lost if "contact with a plane other than z = 0" in line]

    assert len(lines('pos="0 0 0.1"')) == 1 and not lines('pos="0 0 0.1" contype="0" conaffinity="0"')


def test_what_does_not_collide_with_the_plane_is_listed(tmp_path):
    excluded = "contact of 1 <geom> that do not collide with the plane, by contype, conaffinity or <exclude>"
    assert excluded in imported(tmp_path, "", 'contype="2" conaffinity="4"').lost
    lost = imported(tmp_path, "", "", '<contact><exclude body1="world" body2="b"/><exclude body1="b" body2="other"/></contact>').lost
    assert excluded in lost and "<contact>: 1 x <exclude>" in lost
    assert not any("<contact>" in line for line in imported(tmp_path, "", "", '<contact><pair geom1="p" geom2="g"/></contact>').lost)
    for plane in ('contype="8" conaffinity="0"', 'contype="0" conaffinity="0"'):
        with pytest.raises(UserError, match=r"that collides \(2 <geom> that do not collide with the plane, by contype"):
            imported(tmp_path, plane, "")


def test_a_contact_without_friction_is_a_valid_model(tmp_path, built_library):
    draft = imported(tmp_path, 'condim="1"', 'condim="1"')
    text = model_text(draft)
    (tmp_path / "ball.toml").write_text(text)
    assert tomllib.loads(text)["contact"][0]["friction"] == 0 and describe(tmp_path / "ball.toml").variables


def test_friction_stops_a_sliding_box_as_coulomb_says(tmp_path, built_library):
    """v(t) = v0 - mu g t with the friction of the file."""
    path = tmp_path / "box.xml"
    path.write_text(
        """<mujoco><worldbody><geom type="plane" size="9 9 1" friction="0.05"/><body name="b" pos="0 0 0.1"><freejoint name="f"/>
        <geom type="box" size="0.1 0.1 0.1" friction="0.05 0 0"/></body></worldbody></mujoco>"""
    )
    (tmp_path / "box.toml").write_text(model_text(mjcf.read(path, import_options(contact="all"))))
    model = rds.load(tmp_path / "box.toml")
    run = model.simulate(stop=1.0, step=0.5, start={"f[1].qd0": 1.0}, outputs=["f[1].qd"])
    assert np.diff(run["f[1].qd"]) == pytest.approx(2 * [-0.05 * 9.81 * 0.5], rel=0.03)
    model.close()


def test_a_keyframe_keeps_its_pose_but_the_height(tmp_path):
    """The ball of the keyframe at (0.3, 0.5, 2), turned by 90 degrees about x, is moved down to 0.1 m."""
    key = '<keyframe><key name="k" qpos="0.3 0.5 2 1 1 0 0 0 1 2.5 1 0 0 0"/></keyframe>'
    draft = imported(tmp_path, "", 'pos="0 0.4 0"', key, keyframe="k")
    assert len(draft.links) == 2  # two floating bases: none is moved
    path = tmp_path / "one.xml"
    text = (tmp_path / "ball.xml").read_text()
    start, end = text.index('<body name="other"'), text.index("</worldbody>")
    path.write_text(text[:start] + text[end:].replace(" 0 1 2.5 1 0 0 0", ""))
    (base,) = (draft := mjcf.read(path, import_options(contact="all", keyframe="k"))).links
    # the shape is 0.4 m above the origin of the turned body
    assert base.q == pytest.approx([0.3, 0.5, 0.1 - 0.4 - 0.09, 0.5**0.5, 0.5**0.5, 0, 0], abs=1e-12)
    assert "the height of 'b' in the keyframe is changed by -2.3 m: the lowest contact point touches the plane" in draft.doubts


@pytest.mark.parametrize(
    ("key", "mocap", "listed"),
    [
        ('ctrl="3"', "", "'ctrl'"),
        ('ctrl="0" act="0"', "", ""),
        ('act="0.5" ctrl="1"', "", "'ctrl', 'act'"),
        ('mpos="0 0 1"', "", ""),
        ('mpos="0 0 1" mquat="1 0 0 0"', '<body mocap="true"/>', "'mpos', 'mquat'"),
    ],
)
def test_what_a_keyframe_states_besides_the_state_is_listed(tmp_path, key, mocap, listed):
    path = tmp_path / "arm.xml"
    path.write_text(
        f"""<mujoco><worldbody><body name="a"><joint name="j"/><geom size="0.1"/></body>{mocap}</worldbody>
        <actuator><motor joint="j"/></actuator><keyframe>\n<key name="k" {key}/></keyframe></mujoco>"""
    )
    lost = [line for line in mjcf.read(path, import_options(keyframe="k")).lost if "<key>" in line]
    inputs = ": inputs start at 0" if "ctrl" in listed else ""
    assert lost == ([f"{path}:3: {listed} of <key> 'k'{inputs}"] if listed else [])
