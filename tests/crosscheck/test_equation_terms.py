"""Output groups of the equations of motion against the dense formulation: M qdd + bias = tau + passive + J^T lambda."""

from __future__ import annotations

import numpy as np
import pytest

from tests.crosscheck import dense_contact
from tests.crosscheck.dense_loops import Rows
from tests.crosscheck.dense_motion import Dense, Forces
from tests.crosscheck.dense_scene import cross
from tests.crosscheck.random_scenes import Case, draw, state_of
from tests.crosscheck.scene_fmu import Library

GROUPS = '["acceleration", "mass_matrix", "bias", "gravity_torque", "coriolis", "passive", "reaction", "regressor", "constraint_jacobian"]'
TOLERANCE = 1e-13
# by the last part of a name
LOOSER = {"jacobian": 1e-12, "jacobian_rate": 1e-12, "reaction_force": 1e-11, "reaction_torque": 1e-11}


@pytest.fixture(scope="module")
def library(tmp_path_factory) -> Library:
    return Library(tmp_path_factory.mktemp("terms"))


def matrix(values: dict, name: str, rows: int, columns: int) -> np.ndarray:
    return np.array([[values[f"{name}[{i + 1},{j + 1}]"] for j in range(columns)] for i in range(rows)])


def vector(values: dict, name: str, rows: int) -> np.ndarray:
    return np.array([values[f"{name}[{i + 1}]"] for i in range(rows)])


def bodies(dense: Dense) -> Forces:
    """Forces of gravity and velocity products."""
    n = len(dense.scene.dofs)
    forces = Forces(dense.n.zeros(n), dense.n.zeros(n))
    dense._bodies(forces)
    return forces


def differences(case: Case, values: dict) -> dict[str, float]:
    """The largest error of each group, relative to the terms that it sums."""
    dense = case.dense()
    dense.solve(state_of(values, case.inputs, dense), {})
    n, M = len(dense.scene.dofs), dense.M
    root = np.sqrt(np.diag(M))
    found = {"mass_matrix": abs(matrix(values, "mass_matrix", n, n) - M) / np.outer(root, root)}
    all_forces, inertial = dense.forces, bodies(dense)
    dense.scene.gravity = dense.scene.gravity * 0
    coriolis = bodies(dense)
    # what cancels in velocity products
    speed = max([abs(dof.qd) for dof in dense.scene.dofs if dof.turns], default=0)
    products = np.sqrt(2 * dense.kinetic) * root * speed
    for name, expected, size in (
        ("bias", -inertial.value, inertial.size),
        ("coriolis", -coriolis.value, coriolis.size + products),
        ("gravity_torque", coriolis.value - inertial.value, inertial.size),
        ("passive", all_forces.value - inertial.value, all_forces.size),
    ):
        error = abs(vector(values, name, n) - expected)
        found[name] = np.divide(error, size, out=np.where(error > 0, np.inf, 0), where=size > 0)
    dense = case.dense()
    motion = dense.solve(state_of(values, case.inputs, dense), case.inputs)
    own = np.array(
        [dense.n.one(values.get(dof.variable("qdd"), scene_qdd)) for dof, scene_qdd in zip(dense.scene.dofs, motion.qdd, strict=True)]
    )
    found |= regressors(values, dense, own) | constraint_jacobians(values, dense)
    found |= jacobians(case, values, dense) | reactions(case, values, dense, motion.qdd)
    return {name: float(np.max(error)) for name, error in found.items()}


def with_jacobians(text: str) -> str:
    """All frames show them."""
    head, *frames = text.split("[[frame]]")
    return "[[frame]]".join([head, *(frame.replace('outputs = ["', 'outputs = ["jacobian", "jacobian_rate", "', 1) for frame in frames)])


def moved_by(state: dict, h) -> dict:
    """The state a time h later at constant velocities."""
    moved = dict(state)
    for name, value in state.items():
        if name.endswith(".q"):
            moved[name] = np.longdouble(value) + h * np.longdouble(state[name + "d"])
        elif name.endswith(".quaternion"):
            w, x, y, z = np.array(value, np.longdouble) / np.sqrt((np.array(value, np.longdouble) ** 2).sum())
            omega = np.array(state[name.replace("quaternion", "omega")], np.longdouble)
            size = np.sqrt((omega**2).sum())
            half = h * size / 2
            c, (i, j, k) = np.cos(half), (np.sin(half) * omega / size if size > 0 else omega)
            moved[name] = [
                w * c - x * i - y * j - z * k,
                w * i + x * c + y * k - z * j,
                w * j - x * k + y * c + z * i,
                w * k + x * j - y * i + z * c,
            ]
    return moved


def jacobian_of(dense: Dense, frame: dict) -> np.ndarray:
    scene = dense.scene
    link = scene.index[frame["link"]]
    path, linear, angular, _, _ = dense._jacobian(link, scene.point(link, frame.get("position", [0, 0, 0]))[0])
    J = dense.n.zeros(6, len(scene.dofs))
    J[:3, path], J[3:, path] = angular, linear
    return J


def jacobians(case: Case, values: dict, dense: Dense) -> dict:
    """The rates against differences of order 6 of the Jacobians."""
    found, scene = {}, dense.scene
    state = state_of(values, case.inputs, dense)
    speed = max([abs(float(dof.qd)) for dof in scene.dofs if dof.turns] + [1e-9])
    h = np.longdouble(1e-3) / np.longdouble(speed)
    for frame in scene.file.get("frame", []):
        J, rate = jacobian_of(dense, frame), 0
        for k, weight in ((1, 45), (2, -9), (3, 1)):
            for sign in (1, -1):
                scene.move(moved_by(state, sign * k * h))
                rate = rate + jacobian_of(dense, frame) * sign * np.longdouble(weight) / (60 * h)
        scene.move(state)
        n = J.shape[1]
        size = np.array([abs(J[:3]).max(initial=1)] * 3 + [abs(J[3:]).max(initial=1e-300)] * 3)[:, None]
        slides = max([abs(float(dof.qd * (dof.pitch if dof.turns else 1))) for dof in scene.dofs] + [0])
        fast = size * speed + slides
        found[frame["name"] + ".jacobian"] = abs(matrix(values, frame["name"] + ".jacobian", 6, n) - J) / size
        found[frame["name"] + ".jacobian_rate"] = abs(matrix(values, frame["name"] + ".jacobian_rate", 6, n) - rate) / fast
    return found


class Cut:
    """Sum of wrenches on the bodies outboard of a joint, about a point."""

    def __init__(self, links: set[int], about) -> None:
        self.links, self.about = links, about
        self.force, self.moment, self.size, self.arm = 0, 0, 0, 0

    def add(self, link: int, x, force, moment=0) -> None:
        if link in self.links:
            arm = x - self.about
            self.force, self.moment = self.force + force, self.moment + moment + cross(arm, force)
            self.size = self.size + abs(force).max()
            self.arm = self.arm + abs(force).max() * (abs(x).max() + abs(self.about).max()) + np.max(abs(moment + force * 0))


def body_accelerations(dense: Dense, i: int, qdd) -> tuple:
    """Of the center of mass: place and acceleration; of the link: omega, alpha and inertia; ground axes."""
    link = dense.scene.links[i]
    x, _, a = dense.scene.point(i, link.com)
    R, R1, R2 = [T[:3, :3] for T in link.pose]
    spin, turned = R1 @ R.T, R2 @ R.T + R1 @ R1.T
    omega = np.array([spin[2, 1], spin[0, 2], spin[1, 0]])
    alpha = np.array([turned[2, 1] - turned[1, 2], turned[0, 2] - turned[2, 0], turned[1, 0] - turned[0, 1]]) / 2
    path, linear, angular, _, _ = dense._jacobian(i, x)
    return x, a + linear @ qdd[path], omega, alpha + angular @ qdd[path], R @ link.inertia @ R.T


def regressors(values: dict, dense: Dense, qdd) -> dict:
    """Y pi against the forces that accelerate all bodies."""
    forces, n, total, size = bodies(dense), len(dense.scene.dofs), 0, 0
    M = dense.M - np.diag([dof.fields.get("armature", 0) for dof in dense.scene.dofs])
    for link in dense.scene.links:
        if not link.path:
            continue
        m, c = link.mass, link.com
        about = link.inertia + m * ((c @ c) * np.eye(3) - np.outer(c, c))
        pi = np.array([m, *(m * c), *(about[i, j] for i, j in ((0, 0), (1, 1), (2, 2), (0, 1), (0, 2), (1, 2)))])
        Y = matrix(values, f"{link.name}.regressor", n, 10)
        total, size = total + Y @ pi, size + abs(Y) @ abs(pi)
    error = abs(total - (M @ qdd - forces.value))
    return {"regressor": np.max(error / np.maximum(size + forces.size + abs(M) @ abs(qdd), 1e-290))}


def constraint_jacobians(values: dict, dense: Dense) -> dict:
    found, rows = {}, dense.rows
    for row, name in enumerate(rows.names):
        matrix_name = name.replace("lambda", "constraint_jacobian")
        if "lambda[" in name:
            J = np.array([values[f"{matrix_name[:-1]},{k + 1}]"] for k in range(rows.J.shape[1])])
            found[name] = np.max(abs(J - rows.J[row])) / (max(rows.lever[row].max(), rows.length[row]) or 1)
    return found


PAIRS = {"spherical": [], "universal": [(2, 2)], "cylindrical": [(0, 2), (1, 2)], "revolute": [(0, 2), (1, 2)]}


def loop_wrenches(scene, loop: dict):
    """Force and moment on link b per unit of each multiplier, and where the force on link a acts: the rows of docs/derivations/loops.md."""
    a, b = scene.index[loop["link_a"]], scene.index[loop["link_b"]]
    x_a, x_b = (scene.point(link, loop.get(f"point_{side}", [0, 0, 0]))[0] for link, side in ((a, "a"), (b, "b")))
    none, n = scene.numbers.zeros(3), scene.numbers
    if loop["type"] == "point":
        for direction in map(n.array, loop["directions"]):
            yield a, x_a, b, x_b, direction / n.norm(direction), none
        return
    rows = Rows.__new__(Rows)
    rows.n = n
    first, second = (rows._frame(n.array(loop.get(f"axis_{k}", [0, 0, 1])), n.array(loop.get(f"x_{k}", [1, 0, 0]))) for k in "ab")
    for k in range(2 if loop["type"] in ("prismatic", "cylindrical") else 3):
        yield a, x_b, b, x_b, scene.direction(a, first[:, k])[0], none
    for i, j in PAIRS.get(loop["type"], [(0, 2), (1, 2), (0, 1)]):
        yield a, x_a, b, x_b, none, cross(scene.direction(b, second[:, j])[0], scene.direction(a, first[:, i])[0])


def push_loops(scene, values: dict, cut: Cut) -> None:
    """Wrenches of the multipliers that the FMU shows."""
    for loop in scene.file.get("loop", []):
        for row, (a, x_a, b, x_b, force, moment) in enumerate(loop_wrenches(scene, loop), start=1):
            factor = scene.numbers.one(values[f"{loop['name']}.lambda[{row}]"])
            cut.add(a, x_a, -force * factor, -moment * factor)
            cut.add(b, x_b, force * factor, moment * factor)


def push_elements(dense: Dense, inputs: dict, cut: Cut) -> None:
    """Wrenches of springs, bushings, contacts and ports."""
    dense._push = lambda _, link, x, force, moment=None, rounding=0: cut.add(link, x, force, 0 if moment is None else moment)
    dense._springs(None)
    dense._bushings(None)
    dense_contact.add(dense, None)
    dense._ports(None, inputs)
    del dense._push


def reactions(case: Case, values: dict, dense: Dense, qdd) -> dict:
    """What accelerates all bodies outboard of a joint, less what else acts on them."""
    scene, found = dense.scene, {}
    for k, link in enumerate(scene.links):
        if link.joint not in ("revolute", "prismatic", "screw", "spherical", "free"):
            continue
        outboard = {k}
        for i, other in enumerate(scene.links):
            if other.parent in outboard:
                outboard.add(i)
        R, origin = scene.pose(k)[0][:3, :3], scene.point(k, [0, 0, 0])[0]
        needed, given = Cut(outboard, origin), Cut(outboard, origin)
        for i in outboard:
            body = scene.links[i]
            x, a, omega, alpha, inertia = body_accelerations(dense, i, qdd)
            needed.add(i, x, body.mass * (a - scene.gravity), inertia @ alpha + cross(omega, inertia @ omega))
            size = body.mass * (abs(a).max() + abs(scene.gravity).max())
            needed.size, needed.arm = needed.size + size, needed.arm + size * (abs(x).max() + abs(origin).max())
        push_elements(dense, case.inputs, given)
        push_loops(scene, values, given)
        joint = link.table.get("joint_name", link.name)
        for what, expected, size in (
            ("reaction_force", needed.force - given.force, needed.size + given.size),
            ("reaction_torque", needed.moment - given.moment, needed.arm + given.arm),
        ):
            found[f"{joint}.{what}"] = abs(vector(values, f"{joint}.{what}", 3) - R.T @ expected) / np.maximum(size, 1e-290)
    return found


@pytest.mark.parametrize("only", ["open", "loops", "repeat", "all"])
def test_terms_agree(library, only):
    """Joints of all types, rotors, prescribed motions, springs, friction, stops, couplings, bushings, contact and loops."""
    # the last one: a loop in a ground direction whose root is a slide
    for seed, index in [*((20, index) for index in range(25)), *([(21, 52)] if only == "loops" else [])]:
        case = draw(seed, index, only)
        library.load(with_jacobians(case.text) + f"\n[fmu]\noutputs = {GROUPS}\n")
        values, _ = library.start(case.inputs)
        wrong = {name: error for name, error in differences(case, values).items() if not error < LOOSER.get(name.split(".")[-1], TOLERANCE)}
        assert not wrong, (only, seed, index, wrong)
