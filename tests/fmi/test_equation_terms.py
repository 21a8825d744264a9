"""Output groups of the equations of motion in built FMUs: Pinocchio's KR5, a closed loop solved in maximal coordinates, refusals."""

from __future__ import annotations

import math
import tomllib

import numpy as np
import pytest

from tests.crosscheck.scene_fmu import Library, Refused
from tests.fmi.conftest import ROOT
from tests.fmi.raw import OK, Slave
from tests.fmi.test_directional_truth import JOINTS, QD, TAU, Q, robot

__all__ = ["robot"]  # a fixture

GROUPS = '"acceleration", "mass_matrix", "bias", "gravity_torque", "coriolis", "passive", "reaction", "regressor"'


@pytest.fixture(scope="module")
def library(fmu_file, tmp_path_factory) -> Library:
    fmu_file("pendulum")  # skips where nothing is built
    return Library(tmp_path_factory.mktemp("terms"))


def array(values: dict, name: str, *shape: int) -> np.ndarray:
    return np.array([values[f"{name}[{','.join(str(i + 1) for i in index)}]"] for index in np.ndindex(*shape)]).reshape(shape)


def kr5(library: Library) -> dict[str, float]:
    text = (ROOT / "models" / "kuka_kr5.toml").read_text()
    frame = '\n[[frame]]\nname = "flange"\nlink = "link6"\nposition = [0.1, -0.2, 0.3]\noutputs = ["jacobian", "jacobian_rate", "inverse_inertia"]\n'
    assert "[fmu]" in text
    head, settings = text.split("[fmu]")
    settings = "\n".join(line for line in settings.splitlines() if not line.startswith("outputs"))
    library.load(head + frame + f"[fmu]\noutputs = [{GROUPS}]\n" + settings)
    with Slave(library) as slave:
        assert slave.setup() == OK and slave.call("EnterInitializationMode") == OK
        for k, joint in enumerate(JOINTS):
            for ending, value in ((".q0", Q[k]), (".qd0", QD[k]), (".tau", TAU[k])):
                assert slave.set(joint + ending, value) == OK
        assert slave.call("ExitInitializationMode") == OK
        return dict(zip(library.outputs, slave.reals(library.outputs), strict=True))


def close(found: np.ndarray, expected: np.ndarray) -> bool:
    return np.abs(found - expected).max() < 1e-12 * np.abs(expected).max()


def test_terms_of_the_kr5_are_those_of_pinocchio(library, robot):
    pin, model, data, damping = robot
    values = kr5(library)
    q, qd = np.array(Q), np.array(QD)
    qdd = np.array([values[f"{joint}.qdd"] for joint in JOINTS])
    M = np.triu(pin.crba(model, data, q))
    assert close(array(values, "mass_matrix", 6, 6), M + np.triu(M, 1).T)
    assert close(array(values, "bias", 6), pin.rnea(model, data, q, qd, 0 * q))
    assert close(array(values, "gravity_torque", 6), pin.computeGeneralizedGravity(model, data, q))
    assert close(array(values, "coriolis", 6), pin.computeCoriolisMatrix(model, data, q, qd) @ qd)
    assert not damping.any() and not array(values, "passive", 6).any()
    place = model.addFrame(pin.Frame("flange", 6, 0, pin.SE3(np.eye(3), np.array([0.1, -0.2, 0.3])), pin.FrameType.OP_FRAME))
    data = model.createData()
    pin.computeJointJacobiansTimeVariation(model, data, q, qd)
    pin.updateFramePlacements(model, data)
    angular_first = [3, 4, 5, 0, 1, 2]
    axes = pin.ReferenceFrame.LOCAL_WORLD_ALIGNED
    assert close(array(values, "flange.jacobian", 6, 6), pin.getFrameJacobian(model, data, place, axes)[angular_first])
    assert close(array(values, "flange.jacobian_rate", 6, 6), pin.getFrameJacobianTimeVariation(model, data, place, axes)[angular_first])
    J = array(values, "flange.jacobian", 6, 6)
    inverse = array(values, "flange.inverse_inertia", 6, 6)
    assert close(inverse, J @ np.linalg.solve(array(values, "mass_matrix", 6, 6), J.T))
    assert np.array_equal(inverse, inverse.T)
    regressor = pin.computeJointTorqueRegressor(model, data, q, qd, qdd)
    own_order = [0, 1, 2, 3, 4, 6, 9, 5, 7, 8]  # Pinocchio: xx, xy, yy, xz, yz, zz
    for k in range(6):
        found = array(values, f"link{k + 1}.regressor", 6, 10)
        assert np.abs(found - regressor[:, 10 * k : 10 * k + 10][:, own_order]).max() < 1e-12 * np.abs(regressor).max()


PUSHED = """
name = "pushed"
link = [
  {name = "base", joint = "free", mass = 3, inertia = [0.3, 0.4, 0.5], q = [0.1, 0.2, 0.3, 0.3, 0.2, -0.4], qd = [0.1, 0, 0.2, 0.3, -0.2, 0.1]},
  {name = "upper", parent = "base", drive = "motion", mass = 1, com = [0.3, 0, 0.1], inertia = [0.1, 0.2, 0.3], a = 0.5, alpha = 1, q = 0.2, qd = 0.3},
  {name = "lower", parent = "upper", mass = 2, com = [0.2, 0.1, 0], inertia = [0.1, 0.1, 0.1], a = 0.4, alpha = -0.5, q = 0.7, armature = 0.2},
]
[[frame]]
name = "tip"
link = "lower"
position = [0.1, 0.2, 0.3]
port = "ground"
outputs = ["acceleration", "inverse_inertia"]
"""


def test_the_inverse_inertia_is_what_a_wrench_at_the_frame_accelerates(library):
    """The recursion answers a wrench linearly; a prescribed joint keeps its motion."""
    library.load(PUSHED)
    names = [f"tip.{kind}[{k}]" for kind in ("angular_acceleration", "acceleration") for k in (1, 2, 3)]
    wrench = [f"tip.{kind}[{k}]" for kind in ("torque", "force") for k in (1, 2, 3)]

    def at(values: dict[str, float]) -> tuple[np.ndarray, np.ndarray]:
        with Slave(library) as slave:
            assert slave.setup() == OK and slave.call("EnterInitializationMode") == OK
            assert all(slave.set(name, value) == OK for name, value in values.items())
            assert slave.call("ExitInitializationMode") == OK
            outputs = dict(zip(library.outputs, slave.reals(library.outputs), strict=True))
            return np.array([outputs[name] for name in names]), array(outputs, "tip.inverse_inertia", 6, 6)

    free, inverse = at({})
    for k, name in enumerate(wrench):
        assert np.abs(at({name: 10})[0] - free - 10 * inverse[:, k]).max() < 1e-12 * np.abs(free).max()


ON_CONSTRAINT = """
name = "rope"
link = [
  {name = "drum", joint = "revolute", mass = 1, inertia = [0.1, 0.1, 0.1]},
  {name = "weight", joint = "prismatic", parent = "ground", mass = 2},
]
frame = [{name = "hook", link = "weight", outputs = ["inverse_inertia"]}]
"""
COUPLING = '[[coupling]]\nname = "winding"\njoints = ["drum", "weight"]\nratios = [0.2, 1]\n'


def test_the_inverse_inertia_does_not_ignore_constraints(library):
    """Through the rope the drum moves with the weight: M of the tree alone would give 1/2 per kg."""
    four_bar = (ROOT / "models" / "four_bar.toml").read_text()
    link = tomllib.loads(four_bar)["link"][-1]["name"]
    looped = f'{four_bar}\n[[frame]]\nname = "hook"\nlink = "{link}"\noutputs = ["inverse_inertia"]\n'
    for text in (looped, ON_CONSTRAINT + COUPLING):
        with pytest.raises(Refused, match=r"frame 'hook': outputs contains 'inverse_inertia', which does not support loops and rigid"):
            library.load(text)
    library.load(ON_CONSTRAINT + COUPLING + "stiffness = 100\n")  # a force, not a constraint
    library.load(ON_CONSTRAINT)


def test_bad_requests_are_one_sentence(library):
    arm = '[[link]]\nname = "arm"\nmass = 1\ncom = [1, 0, 0]\n'
    with pytest.raises(Refused, match=r"fmu: outputs must be .*'constraint_jacobian', got 'mass_matrx'; did you mean 'mass_matrix'\?$"):
        library.load('name = "a"\n' + arm + '[fmu]\noutputs = ["mass_matrx"]\n')
    with pytest.raises(Refused, match=r"fmu: outputs must be .*got 'jacobian'"):
        library.load('name = "a"\n' + arm + '[fmu]\noutputs = ["jacobian"]\n')
    with pytest.raises(Refused, match=r"frame 'tip': outputs must be .*'inverse_inertia' or 'power', got 'jacobi'; did you mean"):
        library.load('name = "a"\n' + arm + '[[frame]]\nname = "tip"\nlink = "arm"\noutputs = ["jacobi"]\n')


def test_nothing_exists_unless_requested(library):
    library.load((ROOT / "models" / "kuka_kr5.toml").read_text())
    names = " ".join(library.variables)
    assert not [
        word
        for word in ("mass_matrix", "bias", "coriolis", "passive", "regressor", "reaction", "jacobian", "inverse_inertia")
        if word in names
    ]


# a planar four-bar whose cut joint is a hinge: three of its five rows are redundant
LENGTHS, MASSES, SPEED = (0.5, 1.2, 0.9), (1.0, 2.0, 1.5), 0.7
GROUND = 1.1


def four_bar() -> tuple[str, list[float]]:
    """The model file, tilted out of the vertical plane by gravity, and the absolute angles of its three bars."""
    crank = 0.9
    pin = np.array([LENGTHS[0] * math.cos(crank), LENGTHS[0] * math.sin(crank)])
    line = np.array([GROUND, 0]) - pin
    span, base = math.hypot(*line), math.atan2(line[1], line[0])
    inner = math.acos((span**2 + LENGTHS[1] ** 2 - LENGTHS[2] ** 2) / (2 * span * LENGTHS[1]))
    coupler = base + inner
    end = pin + LENGTHS[1] * np.array([math.cos(coupler), math.sin(coupler)])
    rocker = math.atan2(end[1], end[0] - GROUND)
    angles = [crank, coupler, rocker]
    links = [("crank", "ground", 0, crank), ("coupler", "crank", LENGTHS[0], coupler - crank), ("rocker", "ground", GROUND, rocker)]
    text = 'name = "four_bar"\ngravity = [1, -9, 3]\n'
    for (name, parent, a, q), m, length in zip(links, MASSES, LENGTHS, strict=True):
        text += f'[[link]]\nname = "{name}"\nparent = "{parent}"\na = {a}\nq = {q!r}\nmass = {m}\ncom = [{length / 2}, 0, 0.1]\ninertia = [0.02, 0.03, 0.04]\n'
    text += f'[[loop]]\nname = "pin"\ntype = "revolute"\nlink_a = "coupler"\nlink_b = "rocker"\npoint_a = [{LENGTHS[1]}, 0, 0]\npoint_b = [{LENGTHS[2]}, 0, 0]\n'
    return text + f"[fmu]\noutputs = [{GROUPS}]\n", angles


def hinge(a: int, x_a, b: int, x_b) -> np.ndarray:
    """Rows of a hinge about z between bodies (-1: ground) with centers of mass at x: velocities (v, omega) per body."""
    rows = np.zeros((5, 18))
    cross = lambda r: np.array([[0, -r[2], r[1]], [r[2], 0, -r[0]], [-r[1], r[0], 0]])
    for body, arm, sign in ((a, x_a, -1), (b, x_b, 1)):
        if body >= 0:
            rows[:3, 6 * body : 6 * body + 3] = sign * np.eye(3)
            rows[:3, 6 * body + 3 : 6 * body + 6] = -sign * cross(arm)
            rows[3:, 6 * body + 3 : 6 * body + 5] = sign * np.eye(2)
    return rows


def test_reactions_of_a_redundant_loop_are_those_in_maximal_coordinates(library):
    """At rest: M a = g + C^T lambda, C a = 0; least norm over the multipliers of the cut hinge."""
    text, angles = four_bar()
    library.load(text)
    tau = 2.5
    values, _ = library.start({"crank.tau": tau})
    along = [np.array([math.cos(angle), math.sin(angle), 0]) for angle in angles]
    starts = [np.zeros(3), LENGTHS[0] * along[0], np.array([GROUND, 0, 0])]
    centers = [start + length / 2 * u + np.array([0, 0, 0.1]) for start, length, u in zip(starts, LENGTHS, along, strict=True)]
    end = starts[1] + LENGTHS[1] * along[1]
    M, force = np.zeros((18, 18)), np.zeros(18)
    for k, (m, u) in enumerate(zip(MASSES, along, strict=True)):
        R = np.array([u, np.cross([0, 0, 1], u), [0, 0, 1]]).T
        M[6 * k : 6 * k + 3, 6 * k : 6 * k + 3] = m * np.eye(3)
        M[6 * k + 3 : 6 * k + 6, 6 * k + 3 : 6 * k + 6] = R @ np.diag([0.02, 0.03, 0.04]) @ R.T
        force[6 * k : 6 * k + 3] = m * np.array([1, -9, 3])
    force[5] = tau
    tree = [
        hinge(-1, None, 0, starts[0] - centers[0]),
        hinge(0, starts[1] - centers[0], 1, starts[1] - centers[1]),
        hinge(-1, None, 2, starts[2] - centers[2]),
    ]
    # rows of the cut along the axes of the coupler
    axes = np.array([along[1], np.cross([0, 0, 1], along[1]), [0, 0, 1]])
    cut = hinge(1, end - centers[1], 2, end - centers[2])
    cut[:3], cut[3:] = axes @ cut[:3], axes[:2, :2] @ cut[3:]
    # moments of rotation rows: v x u with v = z
    C = np.vstack([*tree, cut])
    inverse = np.linalg.inv(M)
    multipliers = np.linalg.lstsq(C @ inverse @ C.T, -C @ inverse @ force, rcond=1e-12)[0]
    # of all solutions the one with the least norm of the last five
    null = np.linalg.svd(C.T)[2][np.linalg.matrix_rank(C.T, 1e-10) :].T
    multipliers -= null @ np.linalg.lstsq(null[15:], multipliers[15:], rcond=1e-12)[0]
    acceleration = inverse @ (force + C.T @ multipliers)
    for k, name in enumerate(("crank", "coupler", "rocker")):
        R = np.array([along[k], np.cross([0, 0, 1], along[k]), [0, 0, 1]])
        on_link = multipliers[5 * k : 5 * k + 5]
        torque = np.array([*on_link[3:], tau if k == 0 else 0])
        assert array(values, f"{name}.reaction_force", 3) == pytest.approx(R @ on_link[:3], abs=1e-11 * 30)
        assert array(values, f"{name}.reaction_torque", 3) == pytest.approx(R @ torque, abs=1e-11 * 30)
    assert values["crank.qdd"] == pytest.approx(acceleration[5], rel=1e-11)


@pytest.mark.parametrize(
    ("joint", "q", "turned"),
    [
        ("universal", [0.3, -0.7], ["z", "zy"]),
        ("cylindrical", [0.3, 0.2], ["z", "z"]),
        ("planar", [0.1, 0.2, 0.5], ["", "", "z"]),
    ],
)
def test_reactions_of_joints_with_several_dof_are_in_the_axes_of_the_link_as_far_as_it_has_turned(library, joint, q, turned):
    """At rest each joint bears the weight: -m g and its moment about the origin behind that DOF."""
    mass, com, gravity = 2.0, np.array([0.1, 0.2, 0.3]), np.array([1.0, -9.0, 3.0])
    library.load(
        f'name = "bearing"\ngravity = {gravity.tolist()}\n[[link]]\nname = "u"\njoint = "{joint}"\ndrive = "locked"\nq = {q}\nmass = {mass}\n'
        f'com = {com.tolist()}\ninertia = [0.1, 0.2, 0.25]\n[[frame]]\nname = "f"\nlink = "u"\noutputs = ["pose", "rotation"]\n'
        '[fmu]\noutputs = ["reaction"]\n'
    )
    values, _ = library.start({})
    R_link, p_link = array(values, "f.rotation", 3, 3), array(values, "f.position", 3)
    R, origin, angles = np.eye(3), np.zeros(3), iter(q if joint != "planar" else q[2:])
    for k, about in enumerate(turned):
        if joint == "planar" and k < 2:
            origin[k] = q[k]
        elif joint == "cylindrical" and k == 1:
            origin[2] = q[1]
        else:
            c, s = math.cos(angle := next(angles)), math.sin(angle)
            R = R @ np.array({"z": [[c, -s, 0], [s, c, 0], [0, 0, 1]], "y": [[c, 0, s], [0, 1, 0], [-s, 0, c]]}[about[-1]])
        force, arm = -mass * gravity, R_link @ com + p_link - origin
        assert array(values, f"u[{k + 1}].reaction_force", 3) == pytest.approx(R.T @ force, abs=1e-12)
        assert array(values, f"u[{k + 1}].reaction_torque", 3) == pytest.approx(R.T @ np.cross(arm, force), abs=1e-12)
    assert R == pytest.approx(R_link, abs=1e-14)


def test_reactions_of_a_free_joint_are_in_the_axes_of_its_frame_and_of_its_link(library):
    library.load(
        'name = "float"\ngravity = [0, 0, -9]\n[[link]]\nname = "b"\njoint = "free"\nq = [1, 2, 3, 0.5, 0.5, 0.5, 0.5]\nmass = 2\n'
        'inertia = [0.1, 0.2, 0.25]\n[fmu]\noutputs = ["reaction"]\n'
    )
    values, _ = library.start({"b[1].tau": 2.0, "b[2].tau": -3.0, "b[3].tau": 5.0})
    for k in (1, 2, 3):
        assert array(values, f"b[{k}].reaction_force", 3) == pytest.approx([2, -3, 5], abs=1e-12)
    # the link: x along y, y along z, z along x of the joint's frame
    assert array(values, "b.reaction_force", 3) == pytest.approx([-3, 5, 2], abs=1e-12)
