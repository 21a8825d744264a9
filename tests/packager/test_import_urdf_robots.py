"""Real robots of the PyPI package `example-robot-data`: the FMU of the imported model moves as Pinocchio's own reader says.

Optional: skipped without `pin`, `example-robot-data` or the built library.
"""

import xml.etree.ElementTree as ET
from pathlib import Path

import numpy as np
import pytest

from build_fmu.fmu.build import build
from build_fmu.importers import urdf
from build_fmu.importers.rigid import matrix_of, pose_of
from build_fmu.importers.toml_writer import model_text
from build_fmu.model.describe import describe
from build_fmu.run.session import Session
from tests.packager.import_options import import_options

pin = pytest.importorskip("pinocchio")
ROBOTS = [
    "panda",
    "ur5_robot",
    "kinova",
    "z1",
    "xarm7",
    "allegro_left_hand",
    "baxter",
    "so101",
    "double_pendulum",
    "tiago_pro",
    "talos_reduced",
    "anymal-kinova",
    "solo12",
]


def robot_folder():
    """Returns the folder of the package's robots, or None."""
    for parent in Path(pin.__file__).resolve().parents:
        found = parent / "share" / "example-robot-data" / "robots"
        if found.is_dir():
            return found
    return None


pytestmark = [
    pytest.mark.usefixtures("built_library"),
    pytest.mark.skipif(robot_folder() is None, reason="example-robot-data is not installed"),
]


def pin_state(model, joints, q, qd):
    """Returns Pinocchio's q and v for values by joint name; a continuous joint is a point on the unit circle there."""
    q_pin, v_pin = pin.neutral(model), np.zeros(model.nv)
    for name, x, xd in zip(joints, q, qd, strict=True):
        joint = model.joints[model.getJointId(name)]
        q_pin[joint.idx_q : joint.idx_q + joint.nq] = [np.cos(x), np.sin(x)] if joint.nq == 2 else [x]
        v_pin[joint.idx_v] = xd
    return q_pin, v_pin


def order(model, joints):
    return [model.joints[model.getJointId(name)].idx_v for name in joints]


def passive(link, q, qd):
    """What damping, friction and stops of the model file make of a joint's state, by docs/model_file.md."""
    force = -link.damping * qd - link.friction * np.tanh(4 * qd / 0.01)
    width = 0.001 if link.joint == "prismatic" else 0.01
    for depth, side in ((q - link.upper, 1), (link.lower - q, -1)) if link.upper is not None else ():
        if depth > 0:
            force -= side * link.stop_stiffness * (depth - width / 2 if depth > width else depth**3 / width**2 - depth**4 / (2 * width**3))
    return force


def mimics(path, joints):
    """Returns the joint values as F y + f of the joints without <mimic>, y, and a mask of these."""
    told = {joint.get("name"): joint.find("mimic") for joint in ET.parse(path).getroot().findall("joint")}
    own = np.array([told[name] is None for name in joints])
    column = {name: np.eye(own.sum())[own[:k].sum()] for k, name in enumerate(joints) if own[k]}

    def row(name):
        if told[name] is None:
            return column[name], 0.0
        inner, at = row(told[name].get("joint"))
        multiplier = float(told[name].get("multiplier", 1))
        return multiplier * inner, multiplier * at + float(told[name].get("offset", 0))

    rows, offsets = zip(*map(row, joints), strict=True)
    return np.array(rows), np.array(offsets), own


def accelerations(model, data, state, columns, follow):
    """The accelerations in the order of `columns`; mimic joints by projection of the mass matrix onto the others."""
    q, v, tau = state
    if follow.shape[0] == follow.shape[1]:
        return pin.aba(model, data, q, v, tau)[columns]
    mass = np.triu(pin.crba(model, data, q))
    mass = (mass + np.triu(mass, 1).T)[np.ix_(columns, columns)]
    force = (tau - pin.rnea(model, data, q, v, np.zeros(model.nv)))[columns]
    return follow @ np.linalg.solve(follow.T @ mass @ follow, follow.T @ force)


def compare(path, folder, states=3):
    """Returns the largest relative error of the accelerations and the largest error of a centre of mass (m)."""
    draft = urdf.read(path, import_options(stops=50.0))
    moving = [link for link in draft.links if link.joint != "fixed"]
    names = {urdf.legal(element.get("name")): element.get("name") for element in ET.parse(path).getroot().findall("joint")}
    joints = [names.get(link.joint_name) or names[link.joint_name.removesuffix("_joint")] for link in moving]
    model = pin.buildModelFromUrdf(str(path))
    data = model.createData()
    rng = np.random.default_rng(7)
    file, fmu = folder / "robot.toml", folder / "robot.fmu"
    file.write_text(model_text(draft), encoding="utf-8")
    build(describe(file), file, fmu)
    columns, worst = order(model, joints), 0.0
    follow, offset, own = mimics(path, joints)
    with Session(fmu) as session:
        ours = [link.joint_name or link.name for link in moving]
        for _ in range(states):
            q, qd, tau = rng.uniform(-2, 2, (3, len(moving)))
            q, qd, tau = follow @ q[own] + offset, follow @ qd[own], np.where(own, tau, 0)
            q_pin, v_pin = pin_state(model, joints, q, qd)
            tau_pin = np.zeros(model.nv)
            tau_pin[columns] = tau + [passive(link, *at) for link, *at in zip(moving, q, qd, strict=True)]
            for array in (model.armature, model.damping):
                array[:] = 0
            expected = accelerations(model, data, (q_pin, v_pin, tau_pin), columns, follow)
            values = {}
            for ending, numbers, has in ((".q0", q, q == q), (".qd0", qd, q == q), (".tau", tau, own)):
                values |= {name + ending: x for name, x, given in zip(ours, numbers, has, strict=True) if given}
            session.initialise(0, 1, None, values)
            qdd = np.array(session.read([f"{name}.qdd" for name in ours]))
            worst = max(worst, float(np.abs(qdd - expected).max() / np.abs(expected).max()))
            session.instance.reset()
    # the places of the bodies, at the last of these poses
    for link, x in zip(moving, q, strict=True):
        link.q = float(x)
    file.write_text(model_text(draft), encoding="utf-8")
    pin.forwardKinematics(model, data, q_pin)
    pin.updateFramePlacements(model, data)
    drawn = {link["name"]: link for link in describe(file).drawing["links"]}
    apart = 0.0
    for element in ET.parse(path).getroot().findall("link"):
        inertial, ours = element.find("inertial"), drawn.get(urdf.legal(element.get("name")))
        if ours is None or not ours["mass"]:
            continue
        origin = inertial.find("origin")
        xyz = np.fromstring((origin.get("xyz") if origin is not None else None) or "0 0 0", sep=" ")
        place = data.oMf[model.getFrameId(element.get("name"), pin.FrameType.BODY)] * xyz
        apart = max(apart, float(np.abs(place - ours["com"]).max()))
    return worst, apart


@pytest.mark.parametrize("robot", ROBOTS)
def test_moves_as_pinocchio_says(robot, tmp_path):
    path = next(iter(sorted(robot_folder().rglob(f"{robot}.urdf"))), None)
    if path is None:
        pytest.skip(f"this release of example-robot-data has no {robot}")
    accelerations, places = compare(path, tmp_path)
    assert accelerations < 1e-9 and places < 1e-11


def random_urdf(seed, tilts):
    """A tree with axes of any direction, branches, fixed links between, and axes that are parallel but for a tilt (rad)."""
    rng = np.random.default_rng(seed)

    def numbers(values):
        return " ".join(f"{x:.17g}" for x in values)

    links, joints = ['<link name="base"/>'], []
    for i in range(14):
        root = rng.normal(size=(3, 3))
        inertia = root @ root.T * 0.02
        inertia += np.eye(3) * np.trace(inertia)
        tensor = " ".join(
            f'{key}="{inertia[r, c]:.17g}"'
            for key, r, c in (("ixx", 0, 0), ("iyy", 1, 1), ("izz", 2, 2), ("ixy", 0, 1), ("ixz", 0, 2), ("iyz", 1, 2))
        )
        links.append(
            f'<link name="link-{i}"><inertial><origin xyz="{numbers(rng.normal(size=3) * 0.2)}" rpy="{numbers(rng.normal(size=3))}"/>'
            f'<mass value="{rng.uniform(0.5, 2):.17g}"/><inertia {tensor}/></inertial></link>'
        )
        kind = rng.choice(["revolute", "continuous", "prismatic", "fixed"], p=[0.4, 0.2, 0.2, 0.2]) if i else "revolute"
        parent = "base" if i == 0 else f"link-{rng.integers(max(0, i - 3), i)}"
        # quarter turns, tiny misalignments and anything else
        rpy = rng.integers(-2, 3, 3) * np.pi / 2 if rng.random() < 0.6 else rng.normal(size=3)
        rpy = rpy + rng.choice(tilts)
        axis = np.eye(3)[rng.integers(3)] * rng.choice([-1, 1]) if rng.random() < 0.7 else rng.normal(size=3)
        limit = '<limit lower="-1" upper="1" effort="1" velocity="1"/>' if kind in ("revolute", "prismatic") else ""
        xyz = rng.normal(size=3) * rng.integers(0, 2, 3)
        joints.append(
            f'<joint name="j{i}" type="{kind}"><origin xyz="{numbers(xyz)}" rpy="{numbers(rpy)}"/><parent link="{parent}"/>'
            f'<child link="link-{i}"/><axis xyz="{numbers(axis)}"/>{limit}<dynamics damping="{rng.uniform():.3f}"/></joint>'
        )
    return f'<robot name="random">{"".join(links)}{"".join(joints)}</robot>'


@pytest.mark.parametrize("seed", range(6))
def test_random_trees_move_as_pinocchio_says(seed, tmp_path):
    path = tmp_path / "random.urdf"
    path.write_text(random_urdf(seed, [0, 0, 1e-15, 1e-2]), encoding="utf-8")
    accelerations, places = compare(path, tmp_path)
    assert accelerations < 1e-9 and places < 1e-12


def rebuilt(draft):
    """Returns a Pinocchio model of the draft's own numbers: what the import means, without the FMU."""
    model, carriers = pin.Model(), {"ground": (0, pin.SE3.Identity())}
    for link in draft.links:
        carrier, offset = carriers[link.parent]
        pose = pose_of(link.dh)
        place = offset * pin.SE3(pose[:3, :3], pose[:3, 3])
        if link.joint != "fixed":
            kind = pin.JointModelRZ() if link.joint == "revolute" else pin.JointModelPZ()
            carrier, place = model.addJoint(carrier, kind, place, link.joint_name or link.name), pin.SE3.Identity()
        carriers[link.name] = carrier, place
        if carrier:
            model.appendBodyToJoint(carrier, pin.Inertia(link.mass, np.array(link.com), matrix_of(link.inertia)), place)
    return model


@pytest.mark.parametrize("seed", range(20))
def test_nearly_parallel_axes_keep_every_digit(seed, tmp_path):
    path = tmp_path / "random.urdf"
    path.write_text(random_urdf(seed, [0, 1e-14, 1e-10, 1e-7, 1e-5, 1e-3]), encoding="utf-8")
    draft = urdf.read(path, import_options())
    moving = [link.joint_name for link in draft.links if link.joint != "fixed"]
    q, qd, tau = np.random.default_rng(seed).uniform(-2, 2, (3, len(moving)))
    accelerations = []
    for model in (pin.buildModelFromUrdf(str(path)), rebuilt(draft)):
        columns, torque = order(model, moving), np.zeros(model.nv)
        torque[columns] = tau
        for array in (model.armature, model.damping):
            array[:] = 0
        accelerations.append(pin.aba(model, model.createData(), *pin_state(model, moving, q, qd), torque)[columns])
    assert np.abs(accelerations[0] - accelerations[1]).max() < 1e-11 * np.abs(accelerations[0]).max()
    sizes = [abs(x) for link in draft.links for x in (link.dh.a, link.dh.b, link.dh.d)]
    assert max(sizes) < 100


def random_turn(rng):
    """Returns a random unit quaternion x, y, z, w."""
    quaternion = rng.normal(size=4)
    return quaternion / np.linalg.norm(quaternion)


@pytest.mark.parametrize("seed", range(4))
def test_a_floating_tree_moves_as_pinocchio_says(seed, tmp_path):
    path, rng = tmp_path / "random.urdf", np.random.default_rng(seed)
    body = (
        '<inertial><origin xyz="0.1 0.2 -0.3"/><mass value="4"/><inertia ixx="1" iyy="2" izz="2.5" ixy="0.1" ixz="0" iyz="0.2"/></inertial>'
    )
    text = random_urdf(seed, [0]).replace('<link name="base"/>', f'<link name="base">{body}</link>')
    # and a second body that slides and turns in a tilted plane
    plate = (
        f'<link name="plate">{body}</link><joint name="plane" type="planar"><origin xyz="0.2 -0.1 0.4" rpy="0.3 -0.4 0.5"/><parent link="base"/>'
        '<child link="plate"/><axis xyz="0 0 1"/></joint>'
    )
    path.write_text(text.replace("</robot>", plate + "</robot>"), encoding="utf-8")
    draft = urdf.read(path, import_options(floating=True, stops="none"))
    model = pin.buildModelFromUrdf(str(path), pin.JointModelFreeFlyer())
    data, file, fmu = model.createData(), tmp_path / "robot.toml", tmp_path / "robot.fmu"
    model.armature[:] = model.damping[:] = 0
    for link in draft.links:
        link.damping = 0.0
    file.write_text(model_text(draft), encoding="utf-8")
    build(describe(file), file, fmu)
    joints = [link.joint_name for link in draft.links if link.joint in ("revolute", "prismatic")]
    plane = [f"plane[{k}]" for k in (1, 2, 3)]
    q_pin, v_pin, tau_pin = pin.neutral(model), rng.normal(size=model.nv), rng.normal(size=model.nv)
    columns, flat = order(model, joints), model.joints[model.getJointId("plane")]
    # base: place and quaternion x, y, z, w; Pinocchio counts its speeds and forces in the base's axes
    place, quaternion, angles, (x, y, turn) = rng.normal(size=3), random_turn(rng), rng.uniform(-2, 2, len(joints)), rng.normal(size=3)
    q_pin, _ = pin_state(model, joints, angles, v_pin[columns])
    q_pin[:3], q_pin[3:7], q_pin[flat.idx_q : flat.idx_q + 4] = place, quaternion, [x, y, np.cos(turn), np.sin(turn)]
    axes = pin.XYZQUATToSE3(np.array([*place, *quaternion])).rotation
    # the slides of a planar joint are seen from its parent here, and from its child there
    tilt = np.array([[np.cos(turn), -np.sin(turn)], [np.sin(turn), np.cos(turn)]])
    k = flat.idx_v
    slide_speed, slide_force = tilt @ v_pin[k : k + 2], tilt @ tau_pin[k : k + 2]
    values = dict(zip(("base[1].q0", "base[2].q0", "base[3].q0"), place, strict=True))
    values |= {f"base.quaternion0[{i + 1}]": value for i, value in enumerate([quaternion[3], *quaternion[:3]])}
    values |= dict(zip(("base[1].qd0", "base[2].qd0", "base[3].qd0"), axes @ v_pin[:3], strict=True))
    values |= {f"base.omega0[{i + 1}]": v_pin[3 + i] for i in range(3)} | {f"base.tau[{i + 1}]": tau_pin[3 + i] for i in range(3)}
    values |= dict(zip(("base[1].tau", "base[2].tau", "base[3].tau"), axes @ tau_pin[:3], strict=True))
    for names, (q0, qd0, tau) in (
        (joints, (angles, v_pin[columns], tau_pin[columns])),
        (plane, ((x, y, turn), (*slide_speed, v_pin[k + 2]), (*slide_force, tau_pin[k + 2]))),
    ):
        for ending, numbers in ((".q0", q0), (".qd0", qd0), (".tau", tau)):
            values |= {name + ending: number for name, number in zip(names, numbers, strict=True)}
    expected = pin.aba(model, data, q_pin, v_pin, tau_pin)
    slide = tilt @ (expected[k : k + 2] + v_pin[k + 2] * np.array([-v_pin[k + 1], v_pin[k]]))
    linear = axes @ (expected[:3] + np.cross(v_pin[3:6], v_pin[:3]))
    wanted = np.array([*linear, *expected[3:6], *expected[columns], *slide, expected[k + 2]])
    with Session(fmu) as session:
        session.initialise(0, 1, None, values)
        told = session.read(
            [
                *(f"base[{i}].qdd" for i in (1, 2, 3)),
                *(f"base.alpha[{i}]" for i in (1, 2, 3)),
                *(f"{name}.qdd" for name in [*joints, *plane]),
            ]
        )
    assert np.abs(np.array(told) - wanted).max() < 1e-9 * np.abs(wanted).max()
