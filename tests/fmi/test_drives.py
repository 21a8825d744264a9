"""Drives in any mix, frames and ports, as a master sees them."""

from __future__ import annotations

import math

import numpy as np
import pytest

from build_fmu.report.sweep import METHODS
from tests.fmi.conftest import ROOT
from tests.fmi.raw import ERROR, OK, Slave, Unpacked

# One joint of each drive in one chain, and a frame of each port.
MIXED = """
name = "mixed"
gravity = [1, -9, 3]

[[link]]
name = "cart"
joint = "prismatic"
joint_name = "rail"
drive = "motion"
alpha = 1.5707963267948966
mass = 2
com = [0.1, 0.2, 0]
damping = 0.4
q = 0.1
qd = 0.2

[[link]]
name = "pole"
joint_name = "hinge"
alpha = -1.5707963267948966
a = 0.1
mass = 0.5
com = [0.4, 0, 0.1]
inertia = [0.02, 0.03, 0.02, 0.001, 0.002, -0.003]
armature = 0.01
damping = 0.05
q = 0.3
qd = -1

[[link]]
name = "arm"
joint_name = "elbow"
drive = "locked"
alpha = 0.7
a = 0.8
mass = 0.3
com = [0.1, 0.1, 0]
inertia = [0.01, 0.01, 0.01]
stiffness = 2
q = 0.5

[[link]]
name = "hand"
joint_name = "wrist"
drive = "free"
alpha = 1.2
a = 0.3
d = 0.1
mass = 0.2
com = [0.1, 0, 0]
inertia = [0.002, 0.003, 0.004]
stiffness = 1
q = -0.4
qd = 0.3

[[link]]
name = "tool"
joint = "fixed"
theta = 0.3
a = 0.2
mass = 0.1

[[frame]]
name = "tip"
link = "tool"
position = [0.1, -0.05, 0.02]
rpy = [0.3, -0.5, 0.9]
outputs = ["pose", "rotation", "velocity"]
port = "frame"

[[frame]]
name = "mount"
link = "pole"
position = [0.2, 0, 0]
outputs = ["velocity"]
port = "ground"

[solver]
rtol = 1e-10
atol = 1e-12

[fmu]
tunable = ["hand.mass", "elbow.stiffness", "rail.damping", "hinge.armature", "gravity[2]"]
"""

STATE = [
    "hinge.q",
    "hinge.qd",
    "hinge.qdd",
    "elbow.tau",
    "wrist.q",
    "wrist.qd",
    "rail.tau",
    "energy.work",
    "energy.balance",
    "tip.position[1]",
    "tip.velocity[2]",
]


@pytest.fixture(scope="module")
def mixed(built) -> Unpacked:
    return built(MIXED)


def push(slave: Slave, k: int) -> None:
    """Torques and port forces of step k."""
    assert slave.set("hinge.tau", math.sin(0.3 * k)) == OK
    for frame, size in (("tip", 0.5), ("mount", 2.0)):
        for i in range(3):
            assert slave.set(f"{frame}.force[{i + 1}]", size * math.sin(0.1 * k + i)) == OK
            assert slave.set(f"{frame}.torque[{i + 1}]", 0.3 * size * math.cos(0.2 * k - i)) == OK


def move(slave: Slave, time: float) -> None:
    """Samples a smooth motion of the rail."""
    motion = 0.1 + 0.2 * time + 0.1 * math.sin(3 * time) - 0.3 * time, -0.1 + 0.3 * math.cos(3 * time), -0.9 * math.sin(3 * time)
    assert slave.set_reals(["rail.q", "rail.qd", "rail.qdd"], motion) == OK


def test_each_drive_has_its_own_variables(mixed):
    assert mixed.named("input")[:4] == ["hinge.tau", "rail.q", "rail.qd", "rail.qdd"]
    outputs = mixed.named("output")
    assert [name for name in outputs if name.endswith((".q", ".qd", ".qdd", ".tau"))] == [
        "hinge.q",
        "elbow.q",
        "wrist.q",
        "hinge.qd",
        "wrist.qd",
        "hinge.qdd",
        "wrist.qdd",
        "rail.tau",
        "elbow.tau",
    ]
    assert [name for name in mixed.named("parameter") if name.endswith(("q0", "qd0"))] == [
        "hinge.q0",
        "elbow.q0",
        "wrist.q0",
        "hinge.qd0",
        "wrist.qd0",
    ]


def test_descriptions_say_what_each_drive_does(mixed):
    texts = {scalar.get("name"): scalar.get("description") for scalar in mixed.xml.iter("ScalarVariable")}
    assert texts["hinge.tau"] == "Drive torque of joint 'hinge'"
    assert texts["rail.tau"] == "Drive force of joint 'rail' for the prescribed motion"
    assert texts["elbow.tau"] == "Holding torque of joint 'elbow' (locked)"


def test_fmpy_finds_no_problem(mixed, fmu_file):
    from fmpy.validation import validate_fmu

    assert validate_fmu(str(mixed.folder.parent / "model.fmu")) == []


def test_the_motion_starts_where_the_model_says(mixed):
    with Slave(mixed) as slave:
        assert slave.reals(["rail.q", "rail.qd", "rail.qdd"]) == [0.1, 0.2, 0]


def test_values_read_back_as_set(mixed):
    with Slave(mixed) as slave:
        slave.initialize()
        names = ["rail.q", "rail.qd", "rail.qdd", "tip.force[2]", "mount.torque[3]"]
        assert slave.set_reals(names, [1, 2, 3, 4, 5]) == OK
        assert slave.reals(names) == [1, 2, 3, 4, 5]


@pytest.mark.parametrize("method", METHODS)
def test_work_of_prescribed_motion_and_ports_balances_the_energy(mixed, method):
    with Slave(mixed) as slave:
        slave.initialize(start={"solver.method": method})
        q, qd = 0.1, 0.2
        for k in range(200):
            # each motion goes on from the one before: nothing jumps
            qdd = 2 * math.sin(0.2 * k)
            assert slave.set_reals(["rail.q", "rail.qd", "rail.qdd"], [q, qd, qdd]) == OK
            q, qd = q + 0.01 * qd + 0.5e-4 * qdd, qd + 0.01 * qdd
            push(slave, k)
            assert slave.step(k * 0.01, 0.01) == OK, slave.errors
        assert abs(slave.get("energy.work")) > 0.1
        assert abs(slave.get("energy.balance")) < 1e-7


@pytest.mark.parametrize("method", METHODS)
def test_a_sampled_motion_balances_the_energy(mixed, method):
    with Slave(mixed) as slave:
        assert slave.setup() == OK
        assert slave.call("EnterInitializationMode") == OK
        assert slave.set("solver.method", method) == OK
        move(slave, 0)
        assert slave.call("ExitInitializationMode") == OK
        for k in range(200):
            if k > 0:
                move(slave, 0.01 * k)
            push(slave, k)
            assert slave.step(k * 0.01, 0.01) == OK, slave.errors
        assert abs(slave.get("energy.balance")) < 1e-7


def test_a_jump_of_the_velocity_is_that_of_a_very_fast_drive(mixed):
    states = {}
    for duration in (0, 1e-7):
        with Slave(mixed) as slave:
            slave.initialize()
            if duration:
                assert slave.set_reals(["rail.q", "rail.qd", "rail.qdd"], [0.1, 0.2, 1.5 / duration]) == OK
                assert slave.step(0, duration) == OK, slave.errors
            else:
                assert slave.set_reals(["rail.q", "rail.qd"], [0.1, 1.7]) == OK
            states[duration] = slave.reals(["hinge.qd", "wrist.qd", "energy.work", "energy.kinetic"])
    assert states[0] == pytest.approx(states[1e-7], abs=1e-5)
    assert abs(states[0][0] + 1) > 0.1


def test_a_locked_joint_stays_where_it_starts(mixed):
    with Slave(mixed) as slave:
        slave.initialize(start={"elbow.q0": 0.6})
        for k in range(50):
            push(slave, k)
            assert slave.step(k * 0.01, 0.01) == OK
            assert slave.get("elbow.q") == 0.6
        assert abs(slave.get("elbow.tau")) > 0.01


def test_a_motion_begins_with_the_experiment(mixed):
    """Not at time 0: the rail moves at 0.2 m/s from where the model says."""
    found = []
    for start in (0.0, 5.0):
        with Slave(mixed) as slave:
            assert slave.set("rail.qd", 0.4) == OK
            assert slave.setup(start=start) == OK
            assert slave.call("EnterInitializationMode") == OK
            assert slave.call("ExitInitializationMode") == OK
            assert slave.step(start, 0.5) == OK
            found.append(slave.reals(STATE))
    assert found[0] == pytest.approx(found[1], abs=1e-9)


def test_a_reset_begins_anew(mixed):
    ends = []
    with Slave(mixed) as slave:
        for _ in range(2):
            slave.initialize(start={"elbow.q0": 0.7})
            move(slave, 0.1)
            slave.run(0.1, 0.01)
            ends.append(slave.reals(STATE + ["elbow.q", "rail.q", "rail.qd"]))
            assert slave.call("Reset") == OK
            assert slave.reals(["rail.q", "rail.qd", "elbow.q0"]) == [0.1, 0.2, 0.5]
    assert ends[0] == ends[1]


def test_a_jump_that_loops_cannot_follow_leaves_the_state(built):
    text = (ROOT / "models" / "four_bar.toml").read_text()
    head, tail = text.split('joint_name = "joint2"\ndrive = "free"')
    watched = ["crank_joint.q", "crank_joint.qd", "energy.work"]
    for method in ("erk", "bdf"):
        with Slave(built(f'{head}joint_name = "joint2"\ndrive = "motion"{tail}')) as slave:
            slave.initialize(start={"solver.method": method})
            assert slave.step(0, 0.01) == OK, slave.errors
            before = slave.reals(watched)
            assert slave.set("joint2.q", 0.5) == OK
            assert slave.step(0.01, 0.01) == ERROR and "the state is the one at 0.01 s" in slave.errors[0]
            assert slave.reals(watched) == before


def test_between_settings_a_motion_goes_on(mixed):
    """A frame's velocity shows the rail's."""
    ends = []
    for cuts in (1, 10):
        with Slave(mixed) as slave:
            slave.initialize()
            assert slave.set_reals(["rail.q", "rail.qd", "rail.qdd"], [0.1, 0.5, -2]) == OK
            for k in range(cuts):
                assert slave.step(k * 0.2 / cuts, 0.2 / cuts) == OK
            ends.append(slave.reals(STATE))
    assert ends[0] == pytest.approx(ends[1], abs=1e-7)


PARTS = ["rail.q", "rail.qd", "rail.qdd"]


def master_of_one_part(slave: Slave, habit: str, part: str, values: list[float]) -> list[float]:
    """Sets one part of the rail's motion before each step, as masters of different habits do; values between them, and at the end."""
    known, found = dict(zip(PARTS, slave.reals(PARTS), strict=True)), []
    slave.initialize()
    for k, value in enumerate(values):
        changed = known[part] != value
        known[part] = value
        if habit == "all at once":
            assert slave.set_reals(PARTS, [known[name] for name in PARTS]) == OK
        elif habit == "all, last first":
            assert slave.set_reals(PARTS[::-1], [known[name] for name in PARTS[::-1]]) == OK
        elif habit == "one by one":
            assert all(slave.set(name, known[name]) == OK for name in PARTS)
        elif habit == "twice":
            assert slave.set(part, value) == OK and slave.set(part, value) == OK
        elif habit == "what is connected" or changed:
            assert slave.set(part, value) == OK
        if habit == "twice":  # also after outputs were read
            slave.reals(STATE)
            assert slave.set(part, value) == OK
        assert slave.step(0.01 * k, 0.01) == OK, slave.errors
        found += slave.reals(STATE)
    return found


# steady, changing at each step, by fits and starts; q, qd and qdd
COURSES = {"steady": lambda k: 0.5, "changing": lambda k: 0.2 + 0.01 * k, "in parts": lambda k: 0.3 + 0.1 * (k // 20 % 2)}


@pytest.mark.parametrize("method", METHODS)
@pytest.mark.parametrize("course", COURSES)
@pytest.mark.parametrize("part", PARTS)
def test_a_motion_wired_in_part_is_the_same_in_every_master(mixed, part, course, method):
    values = [COURSES[course](k) for k in range(50)]
    found = {}
    for habit in ("what changed", "what is connected", "all at once", "all, last first", "one by one", "twice"):
        with Slave(mixed) as slave:
            assert slave.set("solver.method", method) == OK
            found[habit] = master_of_one_part(slave, habit, part, values)
    for habit, run in found.items():
        assert run == found["what changed"], habit


def test_a_part_of_a_motion_leaves_what_the_others_have_reached(built):
    """One slide on the ground: its frame shows where it is."""
    slide = built(
        'name = "slide"\n[[link]]\nname = "cart"\njoint = "prismatic"\njoint_name = "rail"\n'
        'drive = "motion"\nmass = 1\nq = 0.1\nqd = 0.2\n'
        '[[frame]]\nname = "tip"\nlink = "cart"\noutputs = ["pose", "velocity"]\n'
    )
    where = ["tip.position[3]", "tip.velocity[3]"]
    with Slave(slide, logging=True) as slave:
        slave.initialize()
        time = 0.0
        for name, value, q, qd in (
            ("rail.qd", 0.5, 0.6, 0.5),  # q goes on from 0.1
            ("rail.qd", 0.5, 1.1, 0.5),  # as last set
            ("rail.q", 0.1, 1.6, 0.5),  # as last set, though 1.1 has been reached
            ("rail.qdd", 2.0, 3.1, 2.5),
            ("rail.q", 1.0, 4.5, 4.5),  # its rate stays
            ("rail.qdd", -1.0, 8.5, 3.5),
        ):
            assert slave.set(name, value) == OK
            assert slave.step(time, 1.0) == OK
            time += 1
            assert slave.reals(where) == pytest.approx([q, qd], abs=1e-14), name
        # a rate that was set to something else in between is a new motion
        assert slave.set("rail.q", 1.0) == OK
        assert slave.reals(where) == pytest.approx([8.5, 3.5], abs=1e-14)
        assert slave.set("rail.q", 2.0) == OK and slave.set("rail.q", 1.0) == OK
        assert slave.reals(where) == pytest.approx([1.0, 3.5], abs=1e-14)


def warnings(slave: Slave) -> list[str]:
    return [text for _, category, text in slave.messages if category == "logStatusWarning"]


def test_parts_of_a_motion_that_were_never_set_are_named_once(mixed):
    with Slave(mixed, logging=True) as slave:
        for unset in ({"rail.q", "rail.qd", "rail.qdd"}, {"rail.q"}, set()):
            slave.messages.clear()
            slave.initialize(start={name: slave.get(name) for name in sorted({*PARTS} - unset)})
            state = slave.save()
            assert warnings(slave) == []
            slave.run(0.05, 0.01)
            told = warnings(slave)
            assert len(told) == (1 if unset else 0)
            assert {name for name in PARTS if f"{name}," in f"{told}".replace(";", ",")} == unset
            # a saved state holds what was set: another instance tells as well
            with Slave(mixed, logging=True) as other:
                status, here = other.deserialize(slave.serialize(state))
                assert status == OK and other.call("SetFMUstate", here) == OK
                assert other.step(0, 0.01) == OK
                assert warnings(other) == told
            assert slave.call("Reset") == OK


def test_derivatives_of_inputs_set_the_motion_too(mixed):
    import ctypes as c

    with Slave(mixed, logging=True) as slave:
        slave.initialize(start={"rail.q": 0.2})
        reference = slave.fmu.variables["rail.q"][1]
        assert (
            slave.call(
                "SetRealInputDerivatives",
                (c.c_uint * 2)(reference, reference),
                c.c_size_t(2),
                (c.c_int * 2)(1, 2),
                (c.c_double * 2)(0.2, 0.1),
            )
            == OK
        )
        slave.run(0.05, 0.01)
        assert warnings(slave) == []


@pytest.mark.parametrize("method", METHODS)
@pytest.mark.parametrize("set_before", [False, True])
def test_a_restored_run_is_the_run(mixed, method, set_before):
    with Slave(mixed) as slave, Slave(mixed) as other:
        for one in (slave, other):
            one.initialize(start={"solver.method": method})
        for k in range(10):
            move(slave, 0.01 * k)
            push(slave, k)
            assert slave.step(k * 0.01, 0.01) == OK
        if set_before:
            move(slave, 0.1)
            push(slave, 10)
        state = slave.save()
        content = slave.serialize(state)
        ends = []
        for one in (slave, other, slave):
            if one is other:
                status, state_of_one = other.deserialize(content)
                assert status == OK
            else:
                state_of_one = state
            assert one.call("SetFMUstate", state_of_one) == OK, one.errors
            values = [one.reals(STATE)]
            for k in range(10, 20):
                if k > 10 or not set_before:
                    move(one, 0.01 * k)
                    push(one, k)
                values.append(one.reals(STATE))
                assert one.step(k * 0.01, 0.01) == OK
            ends.append(values + [one.reals(STATE)])
        assert ends[0] == ends[1] == ends[2]


def expect_independence(slave: Slave, declared: dict[str, set[str]], knowns: dict[str, float]) -> None:
    """No output may change with a known that its row does not name."""
    outputs = [name for name in declared if not name.startswith("solver.")]
    before = dict(zip(outputs, slave.reals(outputs), strict=True))
    for known, value in knowns.items():
        assert slave.set(known, value + 0.001) == OK, slave.errors
        for output, now in zip(outputs, slave.reals(outputs), strict=True):
            assert known in declared[output] or now == before[output], f"{output} depends on {known}"
        assert slave.set(known, value) == OK


def test_declared_independence_is_true(mixed):
    with Slave(mixed) as slave:
        assert slave.setup() == OK
        assert slave.call("EnterInitializationMode") == OK
        # nothing at rest or unloaded that would hide a dependence
        inputs = {name: slave.get(name) + 0.01 for name in mixed.named("input")}
        parameters = {name: slave.get(name) + 0.01 for name in mixed.named("parameter") if not name.startswith("solver.")}
        for name, value in {**inputs, **parameters}.items():
            assert slave.set(name, value) == OK, slave.errors
        expect_independence(slave, mixed.dependencies("InitialUnknowns"), {**inputs, **parameters})
        assert slave.call("ExitInitializationMode") == OK
        expect_independence(slave, mixed.dependencies("Outputs"), inputs)


# --- frames ---


def turn(axis: int, angle: float) -> np.ndarray:
    a, b = [(1, 2), (2, 0), (0, 1)][axis]
    matrix = np.eye(4)
    matrix[a, a] = matrix[b, b] = math.cos(angle)
    matrix[b, a] = math.sin(angle)
    matrix[a, b] = -matrix[b, a]
    return matrix


def shift(x: float, y: float, z: float) -> np.ndarray:
    matrix = np.eye(4)
    matrix[:3, 3] = x, y, z
    return matrix


def dh(alpha: float = 0, a: float = 0, theta: float = 0, d: float = 0) -> np.ndarray:
    return turn(0, alpha) @ shift(a, 0, 0) @ turn(2, theta) @ shift(0, 0, d)


def tip(q: np.ndarray) -> np.ndarray:
    """The pose of the frame `tip`, by the product of homogeneous matrices."""
    chain = dh(math.pi / 2, d=q[0]) @ dh(-math.pi / 2, 0.1, q[1]) @ dh(0.7, 0.8, q[2]) @ dh(1.2, 0.3, q[3], 0.1) @ dh(0, 0.2, 0.3)
    return chain @ shift(0.1, -0.05, 0.02) @ turn(2, 0.9) @ turn(1, -0.5) @ turn(0, 0.3)


def test_a_frame_is_where_its_links_take_it(mixed):
    with Slave(mixed) as slave:
        slave.initialize()
        for k in range(30):
            move(slave, 0.01 * k)
            assert slave.step(0.01 * k, 0.01) == OK
        move(slave, 0.3)
        q = np.array([slave.get(f"{joint}.q") for joint in ("rail", "hinge", "elbow", "wrist")])
        qd = np.array([slave.get("rail.qd"), slave.get("hinge.qd"), 0, slave.get("wrist.qd")])
        pose = tip(q)
        assert [slave.get(f"tip.position[{i}]") for i in (1, 2, 3)] == pytest.approx(pose[:3, 3], abs=1e-14)
        rotation = np.array([[slave.get(f"tip.rotation[{i},{j}]") for j in (1, 2, 3)] for i in (1, 2, 3)])
        assert np.abs(rotation - pose[:3, :3]).max() < 1e-14
        w, x, y, z = (slave.get(f"tip.quaternion[{i}]") for i in (1, 2, 3, 4))
        assert w >= 0 and w * w + x * x + y * y + z * z == pytest.approx(1, abs=1e-14)
        cross = np.array([[0, -z, y], [z, 0, -x], [-y, x, 0]])
        assert np.abs(np.eye(3) + 2 * w * cross + 2 * cross @ cross - rotation).max() < 1e-14
        # velocities by central differences
        h = 1e-6
        rate = (tip(q + h * qd) - tip(q - h * qd)) / (2 * h)
        assert [slave.get(f"tip.velocity[{i}]") for i in (1, 2, 3)] == pytest.approx(rate[:3, 3], abs=1e-8)
        omega = rate[:3, :3] @ rotation.T
        assert [slave.get(f"tip.angular_velocity[{i}]") for i in (1, 2, 3)] == pytest.approx(
            [omega[2, 1], omega[0, 2], omega[1, 0]], abs=1e-8
        )


def test_a_force_at_a_frame_acts_by_its_lever(mixed):
    """Virtual work: a wrench at the tip is J^T times it at the joints, J by differences of poses."""
    with Slave(mixed) as slave:
        slave.initialize()
        q = np.array([slave.get(f"{joint}.q") for joint in ("rail", "hinge", "elbow", "wrist")])
        rotation = tip(q)[:3, :3]
        h, jacobian = 1e-6, []
        for unit in np.eye(4):
            rate = (tip(q + h * unit) - tip(q - h * unit)) / (2 * h)
            omega = rate[:3, :3] @ rotation.T
            jacobian.append(np.concatenate([rate[:3, 3], [omega[2, 1], omega[0, 2], omega[1, 0]]]))
        force, torque = np.array([1.0, -2, 0.5]), np.array([0.3, 0.2, -0.4])
        lever = np.array(jacobian) @ np.concatenate([rotation @ force, rotation @ torque])
        outputs = ["rail.tau", "elbow.tau", "hinge.qdd", "wrist.qdd"]
        free = np.array(slave.reals(outputs))
        assert slave.set("hinge.tau", 1) == OK
        response = np.array(slave.reals(outputs)) - free
        assert slave.set("hinge.tau", 0) == OK
        for i in range(3):
            assert slave.set(f"tip.force[{i + 1}]", force[i]) == OK
            assert slave.set(f"tip.torque[{i + 1}]", torque[i]) == OK
        pushed = np.array(slave.reals(outputs)) - free
        # reciprocity: the hinge's unit torque moves the tip as the tip's wrench moves the hinge
        assert pushed[2] == pytest.approx(lever[1] * response[2] + lever[3] * response[3], abs=1e-6)
