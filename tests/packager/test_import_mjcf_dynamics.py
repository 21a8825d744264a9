"""Accelerations of imported MJCF files at random states, without contacts, limits and dry friction, and keyframes against MuJoCo.

Optional: skipped without `mujoco` or the built library.
"""

import numpy as np
import pytest

from build_fmu.errors import UserError
from build_fmu.fmu.build import build
from build_fmu.importers import mjcf
from build_fmu.importers.mjcf_file import of_quaternion
from build_fmu.importers.rigid import pose_of, rotation_x, rotation_y, rotation_z
from build_fmu.importers.toml_writer import model_text
from build_fmu.model.describe import describe
from build_fmu.run.session import Session
from tests.packager.import_options import import_options

mujoco = pytest.importorskip("mujoco")
pytestmark = pytest.mark.usefixtures("built_library")


@pytest.fixture(autouse=True)
def own_folder(tmp_path, monkeypatch):
    """MuJoCo writes its warnings to a file in the current folder."""
    monkeypatch.chdir(tmp_path)


GEOMS = """<mujoco model="geoms"><option gravity="0.5 1 -9"/>
<worldbody><geom type="plane" size="1 1 1"/><body name="a" pos="0.1 0.2 0.3" euler="20 30 40">
  <joint name="j1" axis="1 2 3" pos="0.1 -0.05 0.2" damping="0.7" armature="0.02"/>
  <geom type="box" size="0.1 0.2 0.05" pos="0.1 0 0.2" quat="0.9 0.1 0.2 0.3"/><geom type="sphere" size="0.1" pos="0 0.3 0" mass="2"/>
  <geom type="capsule" fromto="0 0 0 0.1 0.2 0.5" size="0.04" density="700"/>
  <body name="b" pos="0.1 0.2 0.5" xyaxes="0 1 0.2 1 0 0.1">
    <joint name="j2" type="slide" axis="0 1 1" stiffness="30" springref="0.1"/>
    <joint name="j3" axis="0 1 0" pos="0.05 0 0"/><joint name="j4" axis="1 0 0.4" pos="0.05 0.1 0"/>
    <geom type="cylinder" size="0.07 0.2" axisangle="1 1 0 50"/><geom type="ellipsoid" size="0.1 0.2 0.3" zaxis="1 1 1" pos="0 0.1 0.1"/>
    <geom type="box" fromto="0 0 0 0.3 0 0.1" size="0.05"/>
    <body name="c" pos="0.2 0.1 0"><joint name="j5" axis="0 0 1"/>
      <inertial pos="0.1 0.05 0" mass="0.7" quat="0.8 0.1 0.3 0.2" diaginertia="0.02 0.03 0.04"/></body>
    <body name="d" pos="0 0.1 -0.2"><joint name="j6" axis="0 1 0"/>
      <inertial pos="0 0.05 0.02" mass="0.4" fullinertia="0.02 0.03 0.04 0.001 -0.002 0.003"/></body>
  </body></body></worldbody></mujoco>"""
FLOATING = """<mujoco><compiler angle="radian" eulerseq="ZYX" autolimits="false"/>
<default><geom density="500"/><joint damping="0.3" axis="0 1 0"/><default class="leg"><joint armature="0.01" axis="1 0 0"/>
  <geom type="capsule" size="0.03 0.1"/><default class="foot"><geom size="0.05 0.02" type="cylinder"/></default></default></default>
<worldbody><body name="trunk" pos="0.3 0.2 1" euler="0.3 0.2 0.1"><freejoint name="base"/><geom type="box" size="0.3 0.2 0.1"/>
  <frame pos="0.2 0.1 0" euler="0.1 0.2 0.3"><body name="left" childclass="leg" pos="0 0.1 0"><joint name="lh" ref="0.4"/><joint name="lk" pos="0 0 -0.1"
      class="main"/><geom pos="0 0 -0.1"/><body name="lf" pos="0 0 -0.3"><joint name="la" type="ball" pos="0 0.01 0.02" damping="0"/>
      <geom class="foot" pos="0.1 0 0"/></body></body></frame>
  <body name="rest" pos="0 0 0.2"><geom size="0.1"/></body></body></worldbody></mujoco>"""
SETTINGS = """<mujoco><compiler inertiafromgeom="true" settotalmass="5" boundmass="0.5" boundinertia="0.01" inertiagrouprange="0 2"/>
<worldbody><body><joint name="x" type="slide" axis="1 0 0" ref="0.3" stiffness="10"/><inertial pos="1 1 1" mass="77" diaginertia="9 9 9"/>
  <geom size="0.01" pos="0.1 0 0"/><geom size="0.5" group="3"/>
  <body pos="0 0 -0.4"><joint name="y" axis="0 1 0" ref="30" springref="10" stiffness="2" armature="0.1"/><geom type="box" size="0.1 0.05 0.02" pos="0 0 -0.2"/></body></body></worldbody></mujoco>"""

BOUNDS = """<mujoco><compiler inertiafromgeom="true" boundmass="0.5" boundinertia="0.01" inertiagrouprange="0 2"/>
<worldbody><frame pos="0 0 3"><body pos="0.4 0.1 0.2" euler="0 0 90"><joint name="x" axis="0 1 0" pos="0.1 0 0.2"/><geom size="0.5" group="3"/>
  <body pos="1 0 0.1"><joint name="y" axis="0 1 0"/><inertial pos="0.5 0 0" mass="2" diaginertia="0.1 0.1 0.1"/><geom size="0.1" mass="0"/>
    <body pos="1 0 0"><joint name="z" axis="1 1 0"/><geom size="0.1" pos="0.5 0 0"/></body></body></body></frame></worldbody></mujoco>"""

# rotors, lists over longer ones of a class, gravity that a flag switches off
ACTUATED = """<mujoco><option><flag gravity="disable"/></option><option gravity="0 0 -3"/>
<default><motor armature="0.3" damping="0.2"/><geom type="cylinder" size="0.1 0.4"/></default>
<worldbody><body name="a"><joint name="j1" axis="0 1 0" armature="0.1"/><geom size="0.2" pos="0.3 0 0"/>
  <body name="b" pos="0.5 0 0"><joint name="j2" axis="1 0 0"/><geom pos="0 0.2 0"/></body></body></worldbody>
<actuator><motor joint="j1" gear="3 1 1"/><position joint="j2" gear="2" armature="0.5"/><motor joint="j2" damping="0.7"/></actuator></mujoco>"""


def quaternion_product(a, b):
    product = np.empty(4)
    mujoco.mju_mulQuat(product, np.array(a, float), np.array(b, float))
    return product


def random_state(model, rng):
    """Returns positions, velocities and forces of MuJoCo, and start values and inputs of the FMU."""
    data = mujoco.MjData(model)
    qpos, qvel = data.qpos.copy(), rng.normal(size=model.nv)
    force, values = np.zeros(model.nv), {}
    for k in range(model.njnt):
        name, kind, at, v = model.joint(k).name, model.jnt_type[k], model.jnt_qposadr[k], model.jnt_dofadr[k]
        turn = rng.normal(size=4)
        turn /= np.linalg.norm(turn)
        whole = {f"{name}.quaternion0[{i + 1}]": x for i, x in enumerate(turn)}
        if kind == mujoco.mjtJoint.mjJNT_FREE:
            first = qpos[at + 3 : at + 7].copy()
            r, shift = of_quaternion(list(first)), rng.normal(size=3)
            qpos[at : at + 3] += r @ shift
            qpos[at + 3 : at + 7] = quaternion_product(first, turn)
            values |= whole | {f"{name}.omega0[{i + 1}]": qvel[v + 3 + i] for i in range(3)}
            for i in range(3):
                values |= {f"{name}[{i + 1}].q0": shift[i], f"{name}[{i + 1}].qd0": (r.T @ qvel[v : v + 3])[i]}
        elif kind == mujoco.mjtJoint.mjJNT_BALL:
            qpos[at : at + 4] = turn
            values |= whole | {f"{name}.omega0[{i + 1}]": qvel[v + i] for i in range(3)}
        else:
            qpos[at], force[v] = rng.normal(), rng.normal()
            values |= {f"{name}.q0": qpos[at], f"{name}.qd0": qvel[v], f"{name}.tau": force[v]}
    return qpos, qvel, force, values


def ours(model, session):
    """Returns the accelerations of the FMU in the order of MuJoCo."""
    result, start = np.empty(model.nv), mujoco.MjData(model)
    for k in range(model.njnt):
        name, kind, at, v = model.joint(k).name, model.jnt_type[k], model.jnt_qposadr[k], model.jnt_dofadr[k]
        if kind == mujoco.mjtJoint.mjJNT_FREE:
            r = of_quaternion(list(start.qpos[at + 3 : at + 7]))
            result[v : v + 3] = r @ session.read([f"{name}[{i}].qdd" for i in (1, 2, 3)])
            result[v + 3 : v + 6] = session.read([f"{name}.alpha[{i}]" for i in (1, 2, 3)])
        elif kind == mujoco.mjtJoint.mjJNT_BALL:
            result[v : v + 3] = session.read([f"{name}.alpha[{i}]" for i in (1, 2, 3)])
        else:
            result[v] = session.read([f"{name}.qdd"])[0]
    return result


def worst_error(path, folder, states=3):
    """Returns the largest relative error of the accelerations."""
    model = mujoco.MjModel.from_xml_path(str(path))
    flags = mujoco.mjtDisableBit
    off = ("mjDSBL_CONTACT", "mjDSBL_LIMIT", "mjDSBL_FRICTIONLOSS", "mjDSBL_EQUALITY", "mjDSBL_ACTUATION")
    for name in off:
        model.opt.disableflags |= getattr(flags, name)
    model.opt.viscosity = model.opt.density = 0
    model.tendon_stiffness[:] = model.tendon_damping[:] = 0
    # friction and the forces of ball and free joints are listed as omitted
    draft = mjcf.read(path, import_options(stops="none", shapes=False))
    for k in range(model.njnt):
        count = {int(mujoco.mjtJoint.mjJNT_FREE): 6, int(mujoco.mjtJoint.mjJNT_BALL): 3}.get(int(model.jnt_type[k]), 0)
        v = model.jnt_dofadr[k]
        if count:
            model.dof_damping[v : v + count] = model.dof_armature[v : v + count] = 0
    for link in draft.links:
        link.friction, link.drive = 0.0, "torque" if link.joint in ("revolute", "prismatic") else "free"
    draft.actuators, draft.loops, draft.couplings = [], [], []
    file, fmu = folder / "robot.toml", folder / "robot.fmu"
    file.write_text(model_text(draft), encoding="utf-8")
    build(describe(file), file, fmu, show=False)
    rng, worst = np.random.default_rng(3), 0.0
    for _ in range(states):
        data = mujoco.MjData(model)
        data.qpos[:], data.qvel[:], data.qfrc_applied[:], values = random_state(model, rng)
        mujoco.mj_forward(model, data)
        with Session(fmu) as session:
            session.initialise(0.0, 1.0, None, values)
            found = ours(model, session)
        worst = max(worst, float(np.abs(found - data.qacc).max() / np.abs(data.qacc).max()))
    return worst


@pytest.mark.parametrize(
    "placed",
    [
        'scale="1 2 1" refpos="0.1 0 0"',
        'scale="0.5 2 0.8" refpos="0.1 0.2 0.3" refquat="0.8 0.1 0.5 0.2"',
        'scale="0.5 2 -0.8" refpos="0.1 0.2 0.3" refquat="1 0 1 0"',
    ],
)
def test_a_mesh_that_is_not_convex_has_the_mass_of_mujoco(tmp_path, placed):
    trimesh = pytest.importorskip("trimesh")
    parts = [trimesh.creation.box(extents=size) for size in ([0.4, 0.1, 0.1], [0.1, 0.1, 0.5])]
    parts[1].apply_translation([0.15, 0, 0.3])
    trimesh.util.concatenate(parts).export(tmp_path / "hook.stl")
    geom = '<geom type="mesh" mesh="hook" euler="10 20 30" pos="0.1 0 0"/>'
    text = f"""<mujoco><asset><mesh file="hook.stl" {placed}/></asset>
      <worldbody><body name="a"><joint name="j" axis="0 1 0"/>{geom}</body></worldbody></mujoco>"""
    (tmp_path / "robot.xml").write_text(text)
    # MuJoCo keeps vertices in single precision
    assert worst_error(tmp_path / "robot.xml", tmp_path) < 1e-6


@pytest.mark.parametrize("text", [GEOMS, FLOATING, SETTINGS, BOUNDS, ACTUATED], ids=["geoms", "floating", "settings", "bounds", "actuated"])
def test_accelerations_are_those_of_mujoco(tmp_path, text):
    path = tmp_path / "robot.xml"
    path.write_text(text)
    assert worst_error(path, tmp_path) < 1e-9


PARTS = {
    "box": '<geom type="box" size="0.3 0.1 0.2" pos="0.2 0 0.1" euler="10 20 30"/><geom size="0.1" mass="0"/>',
    "geoms": '<geom type="box" size="0.1 0.2 0.3" pos="0.2 0 0"/><geom type="capsule" size="0.1" fromto="0 0 0 0.3 0.2 0.5"/>',
    "symmetric": '<geom type="cylinder" size="0.01 0.04" pos="-0.001 0 0"/><geom type="cylinder" size="0.004 0.015" zaxis="1 0 0" pos="0.014 0 0"/>',
    "inertial": '<inertial pos="0.1 0.2 0.3" mass="2" quat="1 2 3 4" diaginertia="1 2 2.5"/>',
    "full": '<inertial pos="0.1 0.2 0.3" mass="2" fullinertia="1 2 2.5 0.1 0.2 0.3"/>',
    "mesh": '<geom type="mesh" mesh="hook" euler="10 20 30" pos="0.1 0 0"/>',
    "child": '<geom type="box" size="0.3 0.1 0.2" pos="0.2 0 0.1" euler="10 20 30"/><body/>',
}


@pytest.mark.parametrize(("compiler", "align"), [("", 'align="true"'), ('alignfree="true"', ""), ('alignfree="true"', 'align="false"')])
@pytest.mark.parametrize("parts", PARTS)
def test_a_keyframe_of_an_aligned_free_joint_moves_the_body_as_in_mujoco(tmp_path, parts, compiler, align):
    if parts == "mesh":
        trimesh = pytest.importorskip("trimesh")
        trimesh.creation.box(extents=[0.4, 0.1, 0.2]).apply_translation([0.15, 0, 0.3]).export(tmp_path / "hook.stl")
    asset = '<asset><mesh file="hook.stl" refquat="1 2 0 1"/></asset>' if parts == "mesh" else ""
    (tmp_path / "robot.xml").write_text(
        f"""<mujoco><compiler {compiler}/>{asset}<worldbody><body name="b" pos="1 2 3" euler="10 20 30"><freejoint name="j" {align}/>{PARTS[parts]}
        <site name="s" pos="0.3 -0.2 0.5" euler="40 50 60"/></body><body name="w"><joint name="h"/><geom size="0.1"/></body></worldbody>
        <equality><weld body1="w" body2="b" relpose="0.1 0.2 0.3 1 2 0 0" anchor="0.4 0.5 0.6"/></equality>
        <keyframe><key name="k" qpos="0.3 0.5 0.7 0.8 0.1 0.2 0.5 0" qvel="1 2 3 4 5 6 0"/></keyframe></mujoco>"""
    )
    model = mujoco.MjModel.from_xml_path(str(tmp_path / "robot.xml"))
    data = mujoco.MjData(model)
    mujoco.mj_resetDataKeyframe(model, data, 0)
    mujoco.mj_forward(model, data)
    draft = mjcf.read(tmp_path / "robot.xml", import_options(frames=True, keyframe="k"))
    base, frame = draft.links[0], next(tie.fields for tie in draft.frames if tie.name == "s")
    turn, shift = of_quaternion(base.q[3:]), np.array(base.q[:3])
    home, place = pose_of(base.dh), np.array(frame["position"])
    tolerance = 1e-6 if parts == "mesh" else 1e-12
    np.testing.assert_allclose(home[:3, :3] @ (shift + turn @ place) + home[:3, 3], data.site("s").xpos, atol=tolerance)
    roll, pitch, yaw = frame["rpy"]
    own = home[:3, :3] @ turn @ rotation_z(yaw) @ rotation_y(pitch) @ rotation_x(roll)
    np.testing.assert_allclose(own, data.site("s").xmat.reshape(3, 3), atol=tolerance)
    twist = np.empty(6)
    mujoco.mj_objectVelocity(model, data, mujoco.mjtObj.mjOBJ_SITE, 0, twist, 0)
    omega = np.array(base.qd[3:])
    np.testing.assert_allclose(home[:3, :3] @ turn @ omega, twist[:3], atol=10 * tolerance)
    np.testing.assert_allclose(home[:3, :3] @ (base.qd[:3] + turn @ np.cross(omega, place)), twist[3:], atol=10 * tolerance)
    # the anchor of the weld is fixed in the frame of MuJoCo's body
    point = home[:3, :3] @ (shift + turn @ draft.loops[0].fields["point_b"]) + home[:3, 3]
    np.testing.assert_allclose(point, data.body("b").xpos + data.body("b").xmat.reshape(3, 3) @ [0.4, 0.5, 0.6], atol=tolerance)


@pytest.mark.parametrize(
    "inside", ['<geom type="mesh" mesh="cube"/>', '<geom type="box" size="1 2 3"/><body><geom size="0.1" pos="1 0 0"/></body>']
)
def test_an_aligned_free_joint_whose_frame_is_not_known_is_refused_where_it_counts(tmp_path, inside):
    trimesh = pytest.importorskip("trimesh")
    trimesh.creation.box().export(tmp_path / "cube.stl")
    path = tmp_path / "robot.xml"
    path.write_text(
        f"""<mujoco><compiler alignfree="true" fusestatic="true"/><asset><mesh file="cube.stl"/></asset><worldbody><body name="b"><freejoint/>{inside}
        </body></worldbody><keyframe><key name="k" qpos="0 0 1 1 0 0 0"/></keyframe></mujoco>"""
    )
    assert mjcf.read(path, import_options()).links[0].joint == "free"
    with pytest.raises(
        UserError, match=r"'.*robot\.xml': body 'b': an aligned free joint is not supported with fusestatic, or with a mesh"
    ):
        mjcf.read(path, import_options(keyframe="k"))
