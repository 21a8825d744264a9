"""Sensors of frames: accelerations, inertial sensors and wrist sensors, against closed forms and differences."""

from __future__ import annotations

import math

import numpy as np
import pytest

from tests.crosscheck.scene_fmu import Library, Refused
from tests.fmi.raw import OK, Slave

G = 9.81


@pytest.fixture(scope="module")
def library(fmu_file, tmp_path_factory) -> Library:
    fmu_file("pendulum")  # skips where nothing is built
    return Library(tmp_path_factory.mktemp("sensors"))


def started(library: Library, text: str, **inputs: float) -> dict[str, float]:
    library.load(text)
    return library.start({name.replace("__", "."): value for name, value in inputs.items()})[0]


def vector(values: dict, name: str) -> np.ndarray:
    return np.array([values[f"{name}[{k}]"] for k in (1, 2, 3)])


def turn(axis: int, angle: float) -> np.ndarray:
    R, i, j = np.eye(3), (axis + 1) % 3, (axis + 2) % 3
    R[i, i] = R[j, j] = math.cos(angle)
    R[j, i], R[i, j] = math.sin(angle), -math.sin(angle)
    return R


def test_a_falling_body_feels_no_acceleration_but_its_spin(library):
    values = started(
        library,
        """
name = "stone"
link = [{name = "stone", joint = "free", mass = 2, inertia = [0.2, 0.2, 0.2], q = [1, 2, 3, 0.4, -0.7, 0.2], qd = [1, 0, 2, 0, 0, 3]}]
frame = [
  {name = "middle", link = "stone", outputs = ["acceleration", "imu"]},
  {name = "side", link = "stone", position = [0.5, 0, 0.2], outputs = ["imu"]},
]
""",
    )
    assert vector(values, "middle.proper_acceleration") == pytest.approx([0, 0, 0], abs=1e-14)
    assert vector(values, "middle.acceleration") == pytest.approx([0, 0, -G], abs=1e-14)
    assert vector(values, "side.proper_acceleration") == pytest.approx([-9 * 0.5, 0, 0], abs=1e-13)
    assert vector(values, "side.angular_rate") == pytest.approx([0, 0, 3], abs=1e-14)


def test_a_spinning_arm(library):
    """A prescribed rotation: centripetal and tangential acceleration, and what carries a mass at its end."""
    q, w, alpha, r, c, m, J = 0.4, 3.0, 5.0, 0.8, 0.3, 1.5, 0.02
    values = started(
        library,
        f"""
name = "arm"
[[link]]
name = "arm"
drive = "motion"
q = {q}
mass = 1
[[link]]
name = "flange"
joint = "fixed"
a = {r}
mass = {m}
com = [{c}, 0, 0]
inertia = [0.01, {J}, {J}]
[[frame]]
name = "tip"
link = "flange"
rpy = [0, 0, 0.6]
outputs = ["acceleration", "imu", "wrench"]
""",
        arm__qd=w,
        arm__qdd=alpha,
    )
    at = turn(2, q)
    a = at @ [-w * w * r, alpha * r, 0]
    assert vector(values, "tip.acceleration") == pytest.approx(a, rel=1e-14)
    assert vector(values, "tip.angular_acceleration") == pytest.approx([0, 0, alpha], rel=1e-14)
    own = (at @ turn(2, 0.6)).T
    assert vector(values, "tip.proper_acceleration") == pytest.approx(own @ (a + [0, 0, G]), rel=1e-14)
    assert vector(values, "tip.angular_rate") == pytest.approx([0, 0, w], rel=1e-14)
    load = m * (np.array([0, 0, -G]) - at @ [-w * w * (r + c), alpha * (r + c), 0])
    moment = np.cross(at @ [c, 0, 0], load) - [0, 0, J * alpha]
    assert vector(values, "tip.sensed_force") == pytest.approx(own @ load, rel=1e-13)
    assert vector(values, "tip.sensed_torque") == pytest.approx(own @ moment, rel=1e-13)


def test_a_swinging_pendulum(library):
    """m l qdd = -m g sin q at its mass, which feels the tension of its rod alone."""
    q, w, length = 0.7, 1.3, 0.6
    values = started(
        library,
        f"""
name = "pendulum"
[[link]]
name = "rod"
alpha = {math.pi / 2}
theta = {-math.pi / 2}
q = {q}
qd = {w}
mass = 2
com = [{length}, 0, 0]
[[frame]]
name = "bob"
link = "rod"
position = [{length}, 0, 0]
outputs = ["imu"]
""",
    )
    felt = [-w * w * length - G * math.cos(q), 0, 0]
    assert vector(values, "bob.proper_acceleration") == pytest.approx(felt, rel=1e-14, abs=1e-14)


# a pole that stands on a plate and slides in a rail; what hangs at its arm, what pulls at it and pushes it is outboard of the plate
TOWER = f"""
name = "tower"
gravity = [0.5, -1, -9.81]
[[link]]
name = "plate"
joint = "fixed"
theta = 0.3
alpha = 0.2
d = 0.1
mass = 3
com = [0.1, 0.2, 0.05]
[[link]]
name = "pole"
mass = 1
com = [0.1, 0, 0.5]
inertia = [0.1, 0.2, 0.3, 0.01, 0.02, -0.03]
q = 0.3
qd = 1.2
[[link]]
name = "arm"
joint = "prismatic"
alpha = 1.1
a = 0.3
mass = 0.7
com = [0, 0.1, 0.2]
q = 0.4
qd = -0.5
[[link]]
name = "hook"
joint = "fixed"
parent = "arm"
a = 0.1
mass = 0.2
[[link]]
name = "side"
parent = "ground"
alpha = 0.4
mass = 1
com = [0.3, 0, 0]
inertia = [0.1, 0.1, 0.1]
[[spring]]
name = "rope"
link_a = "ground"
link_b = "hook"
point_a = [1, 1, 2]
stiffness = 30
damping = 2
rest_length = 0.5
[[spring]]
name = "inner"
link_a = "plate"
link_b = "arm"
stiffness = 50
[[frame]]
name = "foot"
link = "plate"
position = [0.2, -0.1, 0.3]
rpy = [0.5, -0.4, 0.9]
outputs = ["wrench", "pose", "rotation"]
[[frame]]
name = "push"
link = "hook"
port = "ground"
position = [0.1, 0, 0]
outputs = ["pose"]
{
    "".join(
        f'[[frame]]{chr(10)}name = "at_{link}"{chr(10)}link = "{link}"{chr(10)}position = {com}{chr(10)}'
        f'outputs = ["pose", "rotation", "velocity", "acceleration"]{chr(10)}'
        for link, com in (("plate", [0.1, 0.2, 0.05]), ("pole", [0.1, 0, 0.5]), ("arm", [0, 0.1, 0.2]), ("hook", [0, 0, 0]))
    )
}
"""
TOWER_LINKS = {
    "plate": (3, None),
    "pole": (1, [[0.1, 0.01, 0.02], [0.01, 0.2, -0.03], [0.02, -0.03, 0.3]]),
    "arm": (0.7, None),
    "hook": (0.2, None),
}


def matrix(values: dict, name: str) -> np.ndarray:
    return np.array([[values[f"{name}[{i},{j}]"] for j in (1, 2, 3)] for i in (1, 2, 3)])


def test_a_sensor_at_the_base_carries_weight_inertia_and_outer_forces(library):
    """Newton and Euler for all that stands on the plate; forces between its parts cancel."""
    force, torque = np.array([3.0, -2.0, 5.0]), np.array([0.4, 0.7, -0.2])
    push = {f"push__{what}[{k + 1}]": x for what, v in (("force", force), ("torque", torque)) for k, x in enumerate(v)}
    values = started(library, TOWER, pole__tau=2.0, arm__tau=-3.0, side__tau=9.0, **push)
    gravity, about = np.array([0.5, -1, -G]), vector(values, "foot.position")
    load, moment = force.copy(), torque + np.cross(vector(values, "push.position") - about, force)
    for link, (mass, inertia) in TOWER_LINKS.items():
        part = mass * (gravity - vector(values, f"at_{link}.acceleration"))
        load += part
        moment += np.cross(vector(values, f"at_{link}.position") - about, part)
        if inertia:
            R, w = matrix(values, f"at_{link}.rotation"), vector(values, f"at_{link}.angular_velocity")
            I = R @ inertia @ R.T
            moment -= I @ vector(values, f"at_{link}.angular_acceleration") + np.cross(w, I @ w)
    hook = vector(values, "at_hook.position")
    line = hook - [1, 1, 2]
    length = np.linalg.norm(line)
    pull = -line / length * (30 * (length - 0.5) + 2 * line @ vector(values, "at_hook.velocity") / length)
    load += pull
    moment += np.cross(hook - about, pull)
    own = matrix(values, "foot.rotation").T
    assert vector(values, "foot.sensed_force") == pytest.approx(own @ load, rel=1e-13)
    assert vector(values, "foot.sensed_torque") == pytest.approx(own @ moment, rel=1e-13)


def test_accelerations_are_the_rates_of_velocities(library):
    library.load(TOWER)
    links, size = list(TOWER_LINKS), 1e-3
    with Slave(library) as slave:
        slave.initialize(start={"solver.rtol": 1e-13, "solver.atol": 1e-14, "pole.tau": 2.0})
        names = lambda what: [f"at_{link}.{what}[{k}]" for link in links for k in (1, 2, 3)]
        speeds, rates = [], []
        for k in range(5):
            speeds.append(slave.reals(names("velocity") + names("angular_velocity")))
            rates.append(slave.reals(names("acceleration") + names("angular_acceleration")))
            assert slave.step(k * size, size) == OK
        far, near, _, near_, far_ = np.array(speeds)
        expected = (8 * (near_ - near) - (far_ - far)) / (12 * size)
        assert np.max(np.abs(np.array(rates[2]) - expected)) < 1e-8 * np.max(np.abs(expected))


def test_reading_energies_does_not_change_what_sensors_show(library):
    library.load(TOWER)
    with Slave(library) as slave:
        slave.initialize()
        slave.run(0.02, 0.01)
        names = [f"foot.{what}[{k}]" for what in ("sensed_force", "sensed_torque") for k in (1, 2, 3)] + [
            f"at_arm.acceleration[{k}]" for k in (1, 2, 3)
        ]
        before = slave.reals(names)
        slave.reals(["energy.kinetic", "energy.potential"])
        assert slave.reals(names) == before


def test_a_loop_that_closes_outboard_of_the_sensor_counts_with_its_multipliers(library):
    """A bar on two walls that are fixed to the ground: each carries its own weight and a share of the bar's."""
    wall = lambda name, x: f'[[link]]\nname = "{name}"\nparent = "ground"\njoint = "fixed"\na = {x}\nmass = 2\n'
    sensor = lambda name: f'[[frame]]\nname = "at_{name}"\nlink = "{name}"\noutputs = ["wrench"]\n'
    values = started(
        library,
        'name = "bridge"\n' + wall("left", 0) + f'[[link]]\nname = "bar"\nalpha = {math.pi / 2}\nmass = 5\ncom = [0.4, 0, 0]\n'
        "inertia = [0.1, 0.1, 0.1]\n" + wall("right", 2) + '[[loop]]\nname = "end"\ntype = "point"\nlink_a = "right"\nlink_b = "bar"\n'
        "point_b = [2, 0, 0]\ndirections = [[0, 0, 1]]\n" + sensor("left") + sensor("right"),
    )
    assert vector(values, "at_left.sensed_force") == pytest.approx([0, 0, -(2 + 5 * 0.8) * G], rel=1e-13)
    assert vector(values, "at_right.sensed_force") == pytest.approx([0, 0, -(2 + 5 * 0.2) * G], rel=1e-13)


def test_a_contact_outboard_of_the_sensor_counts(library):
    """A scale: a ball that rests on a table pushes on it, not on the ground."""
    values = started(
        library,
        """
name = "scale"
[[link]]
name = "table"
parent = "ground"
joint = "fixed"
d = 1
mass = 2
[[link]]
name = "ball"
parent = "ground"
joint = "free"
mass = 0.3
inertia = [0.001, 0.001, 0.001]
q = [0.2, 0, 1.099, 0, 0, 0]
[[contact]]
name = "touch"
link_a = "ball"
link_b = "table"
shape_a = "sphere"
radius_a = 0.1
shape_b = "plane"
stiffness = 1e4
width = 1e-4
outputs = ["force"]
[[frame]]
name = "cell"
link = "table"
outputs = ["wrench"]
""",
    )
    pressed = 1e4 * (1e-3 - 1e-4 / 2)
    assert values["touch.force[3]"] == pytest.approx(pressed, rel=1e-9)
    assert vector(values, "cell.sensed_force") == pytest.approx([0, 0, -2 * G - pressed], rel=1e-9)
    assert vector(values, "cell.sensed_torque") == pytest.approx([0, 0.2 * pressed, 0], rel=1e-9, abs=1e-12)


@pytest.mark.parametrize("joint", ["revolute", "universal"])
def test_a_wrist_sensor_needs_a_fixed_link(library, joint):
    with pytest.raises(Refused) as refused:
        library.load(
            f'name = "arm"\n[[link]]\nname = "arm"\njoint = "{joint}"\nmass = 1\ncom = [1, 1, 0]\ninertia = [1, 1, 1]\n'
            '[[frame]]\nname = "f"\nlink = "arm"\noutputs = ["wrench"]\n'
        )
    assert "model.toml:11:11: frame 'f': outputs contains 'wrench', which requires a link with joint 'fixed'" in str(refused.value)


def test_sensors_exist_on_request_only(library):
    library.load('name = "arm"\nlink = [{name = "arm", mass = 1, com = [1, 0, 0]}]\nframe = [{name = "f", link = "arm"}]\n')
    assert [name for name in library.variables if name.startswith("f.")] == [f"f.position[{k}]" for k in (1, 2, 3)] + [
        f"f.quaternion[{k}]" for k in (1, 2, 3, 4)
    ]
