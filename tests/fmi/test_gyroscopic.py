"""[[actuator]] gyroscopic: rotors on moving links, against models whose rotors are links behind rigid couplings, and closed forms."""

from __future__ import annotations

from math import hypot

import pytest

from tests.command_line import command
from tests.fmi.raw import Slave, Unpacked

HEAD = """
name = "rotors"
gravity = [1, -9.81, 2]
[fmu]
outputs = ["acceleration", "energy", "momentum"]
[solver]
method = "bdf"
rtol = 1e-10
atol = 1e-12
"""

# Joints with actuators: gear ratio, rotor inertia.
TREE = (
    """
[[link]]
name = "base"
mass = 3
inertia = [0.1, 0.2, 0.3, 0.01, 0.02, 0.03]
com = [0.1, 0.2, 0.05]
qd = 1.3
q = 0.2
[[link]]
name = "bracket"
joint = "fixed"
alpha = 0.7
a = 0.2
theta = 0.4
[[link]]
name = "upper"
alpha = 0.9
a = 0.1
gamma = 0.3
b = 0.05
mass = 1
com = [0.2, 0.01, 0.03]
inertia = [0.01, 0.03, 0.04, 0.001, 0, 0.002]
q = 0.4
qd = -0.8
[[link]]
name = "thread"
joint = "screw"
pitch = 0.02
parent = "upper"
alpha = -1.2
a = 0.3
mass = 0.7
com = [0.1, 0.02, 0.03]
inertia = [0.01, 0.02, 0.03]
q = -0.3
qd = 2.1
[[link]]
name = "tip"
parent = "upper"
alpha = 1.5707963267948966
a = 0.3
mass = 0.4
com = [0.1, 0, 0.02]
inertia = [0.003, 0.004, 0.005]
q = 0.6
qd = 1.1
""",
    {"base": (5.0, 0.01), "upper": (100.0, 2e-4), "thread": (-30.0, 1e-3), "tip": (0.5, 0.2)},
)

FLOATING = (
    TREE[0].replace('name = "base"\n', 'name = "base"\njoint = "free"\n', 1).replace("qd = 1.3\nq = 0.2\n", "SPIN\n", 1),
    {name: TREE[1][name] for name in ("upper", "thread", "tip")},
)

LINK = 'parent = "{0}"\nmass = 0.5\ncom = [0.08, 0.01, 0.02]\ninertia = [0.001, 0.002, 0.0025]\n'
LOOP = (
    '[[link]]\nname = "table"\nalpha = 1.2\nmass = 2\ninertia = [0.05, 0.05, 0.08]\ncom = [0.05, 0, 0.02]\nqd = 2\n'
    '[[link]]\nname = "left"\nalpha = -1.5707963267948966\nq = 2\nqd = 1\n'
    + LINK.format("table")
    # five-bar on the table
    + '[[link]]\nname = "left_arm"\na = 0.15\nq = -1.1046176622864654\n'
    + LINK.format("left")
    + '[[link]]\nname = "right"\nalpha = -1.5707963267948966\na = 0.2\nq = 1.2\n'
    + LINK.format("table")
    + '[[link]]\nname = "right_arm"\na = 0.15\nq = 1.0677467982637538\n'
    + LINK.format("right")
    + '[[loop]]\nname = "hand"\ntype = "revolute"\nlink_a = "left_arm"\npoint_a = [0.25, 0, 0]\nlink_b = "right_arm"\npoint_b = [0.25, 0, 0]\n',
    {"left": (50.0, 1e-4), "left_arm": (-20.0, 1e-4), "right": (3.0, 0.01)},
)


def with_actuators(links: str, rotors: dict[str, tuple[float, float]], gyroscopic: str = "gyroscopic = true") -> str:
    return links + "".join(
        f'[[actuator]]\njoint = "{name}"\ngear_ratio = {ratio}\nrotor_inertia = {inertia}\n{gyroscopic}\n'
        for name, (ratio, inertia) in rotors.items()
    )


def with_rotor_links(links: str, rotors: dict[str, tuple[float, float]]) -> str:
    """Each rotor is a link on the parent of its joint, with the joint's DH parameters."""
    tables, previous = [], None
    for table in links.split("[[link]]")[1:]:
        fields = dict(line.split(" = ", 1) for line in table.split("[[loop]]")[0].strip().splitlines() if " = " in line)
        name = fields["name"].strip('"')
        parent = fields.get("parent", f'"{previous}"' if previous else '"ground"')
        if name in rotors:
            ratio, inertia = rotors[name]
            dh = "".join(f"{key} = {fields[key]}\n" for key in ("alpha", "a", "gamma", "b") if key in fields)
            start = "".join(f"{key} = {ratio * float(fields[key])}\n" for key in ("q", "qd") if key in fields)
            tables.append(
                f'[[link]]\nname = "{name}_rotor"\nparent = {parent}\n{dh}{start}inertia = [0, 0, {inertia}]\ndrive = "free"\n'
                f'[[coupling]]\nname = "{name}_gear"\njoints = ["{name}", "{name}_rotor"]\nratios = [{ratio}, -1]\n'
            )
        previous = name
    return links + "".join(tables)


def start(slave: Slave, fmu: Unpacked, values: dict[str, float]) -> Slave:
    known = {"base.omega0[1]": 0.7, "base.omega0[2]": -1.1, "base.omega0[3]": 0.4, "base.vx.qd0": 0.3}
    return slave.initialize(start=values | {name: value for name, value in known.items() if name in fmu.variables})


@pytest.mark.parametrize(("links", "rotors"), [TREE, FLOATING, LOOP], ids=["tree", "floating", "loop"])
def test_a_rotor_equals_a_link_behind_a_rigid_gear(built, links, rotors):
    links = links.replace("SPIN", "")
    fmu, explicit = built(HEAD + with_actuators(links, rotors)), built(HEAD + with_rotor_links(links, rotors))
    torques = {name: 1.5 - k for k, name in enumerate(rotors)}
    energies = ["energy.kinetic", "energy.potential", *(f"momentum.{kind}[{i}]" for kind in ("linear", "angular") for i in (1, 2, 3))]
    names = [name for name in fmu.named("output") if name.endswith((".q", ".qd", ".qdd")) and name in explicit.variables] + energies
    given = {f"{name}.tau": value for name, value in torques.items()}
    with Slave(fmu) as slave, Slave(explicit) as other:
        if links == LOOP[0]:  # what the assembly of one model finds, for both
            with Slave(fmu) as assembled:
                start(assembled, fmu, {})
                for name in ("left", "left_arm", "right", "right_arm"):
                    given |= {f"{name}.q0": assembled.get(f"{name}.q"), f"{name}.qd0": assembled.get(f"{name}.qd")}
            given |= {f"{name}_rotor.{k}": rotors[name][0] * given[f"{name}.{k}"] for name in rotors for k in ("q0", "qd0")}
        for one, of in ((slave, fmu), (other, explicit)):
            start(one, of, {name: value for name, value in given.items() if name in of.variables})
        found, expected = slave.reals(names), other.reals(names)
        assert found == pytest.approx(expected, rel=1e-12, abs=1e-12)
        accelerations = [name for name in names if name.endswith(".qdd")]
        assert accelerations and max(abs(found[names.index(name)]) for name in accelerations) > 1
        for one in (slave, other):
            one.run(0.2, 0.02)
        assert slave.reals(names) == pytest.approx(other.reals(names), rel=1e-7, abs=1e-7)
        assert abs(slave.get("energy.balance")) < 1e-8
    plain = built(HEAD + with_actuators(links, rotors, ""))
    with Slave(plain) as slave:  # the armature alone differs
        start(slave, plain, {f"{name}.tau": value for name, value in torques.items()})
        assert max(abs(slave.get(name) - value) for name, value in zip(names, found, strict=True) if name.endswith(".qdd")) > 1e-3


WHEEL_ON_A_TABLE = """
name = "table"
gravity = [0, 0, 0]
[[link]]
name = "table"
inertia = [0, 0, 0.5]
[[link]]
name = "arm"
ALPHA
inertia = [0.02, 0.02, 0.3]
[[actuator]]
joint = "arm"
gear_ratio = 80
rotor_inertia = 1e-3
gyroscopic = true
[fmu]
outputs = ["acceleration", "momentum", "energy"]
tunable = ["arm.inertia[3]", "arm.armature"]
"""


def test_the_reaction_of_a_parallel_rotor_has_its_closed_form(built):
    """Parallel axes: (I_t + J + I_a) qdd_1 + (I_a + J N) qdd_2 = 0 and (I_a + J N) qdd_1 + (I_a + J N^2) qdd_2 = tau."""
    table, arm, rotor, ratio = 0.5, 0.3, 1e-3, 80
    with Slave(built(WHEEL_ON_A_TABLE.replace("ALPHA", ""))) as slave:
        slave.initialize(start={"arm.tau": 2.0})
        a, b, c = table + rotor + arm, arm + rotor * ratio, arm + rotor * ratio**2
        assert slave.get("table.qdd") == pytest.approx(-b * 2 / (a * c - b * b), rel=1e-13)
        assert slave.get("arm.qdd") == pytest.approx(a * 2 / (a * c - b * b), rel=1e-13)
        slave.run(1, 0.1)
        assert abs(slave.get("momentum.angular[3]")) < 1e-12


def test_tuned_inertia_keeps_the_rotor(built):
    with Slave(built(WHEEL_ON_A_TABLE.replace("ALPHA", ""))) as slave:
        slave.initialize(start={"arm.tau": 2.0, "arm.inertia[3]": 0.6, "arm.armature": 1e-3 * 80**2 + 1})
        a, b, c = 0.501 + 0.6, 0.6 + 0.08, 0.6 + 6.4 + 1
        assert slave.get("arm.qdd") == pytest.approx(a * 2 / (a * c - b * b), rel=1e-13)


def test_the_gyroscopic_torque_turns_the_arm_of_a_spinning_table(built):
    """An axis across the table's: the momentum J N qd of the rotor turns with the table, which bears its moment; tau = (I_a + J N^2) qdd."""
    text = WHEEL_ON_A_TABLE.replace("ALPHA", "alpha = 1.5707963267948966")
    with Slave(built(text)) as slave:
        slave.initialize(start={"table.qd0": 3.0, "arm.qd0": 2.0})
        assert slave.get("arm.qdd") == pytest.approx(0, abs=1e-12)
        momentum = slave.reals([f"momentum.angular[{i}]" for i in (1, 2, 3)])
        # the arm's axis is -y of the ground
        assert momentum == pytest.approx([0, -(0.3 + 1e-3 * 80) * 2, (0.5 + 0.02) * 3], abs=1e-12)


def test_the_joint_does_not_transmit_the_moment_of_the_rotor(built):
    """Gyroscopic moments: I_a qd w of the arm at its joint, and that of the rotor, J N qd w, at the table's as well."""
    text = WHEEL_ON_A_TABLE.replace("ALPHA", "alpha = 1.5707963267948966").replace('"acceleration"', '"acceleration", "reaction"')
    with Slave(built(text)) as slave:
        slave.initialize(start={"table.qd0": 3.0, "arm.qd0": 2.0})
        of_arm, of_table = (hypot(*(slave.get(f"{joint}.reaction_torque[{i}]") for i in (1, 2))) for joint in ("arm", "table"))
        assert of_arm == pytest.approx(0.3 * 2 * 3, rel=1e-12)
        assert of_table == pytest.approx((0.3 + 1e-3 * 80) * 2 * 3, rel=1e-12)


@pytest.mark.parametrize(
    ("fields", "sentence"),
    [
        ("rotor_inertia = 1e-3\nstiffness = 10", "gyroscopic is not supported with stiffness; model the rotor as a link, with a coupling"),
        ("torque_limit = 3", "rotor_inertia is required with gyroscopic"),
    ],
)
def test_what_is_not_supported_is_refused(tmp_path, fields, sentence):
    text = WHEEL_ON_A_TABLE.replace("ALPHA", "").replace("rotor_inertia = 1e-3", fields)
    (tmp_path / "model.toml").write_text(text)
    done = command("check", tmp_path / "model.toml")
    assert done.returncode != 0 and f"actuator 1: {sentence}\n" in done.stderr


def test_a_sliding_joint_is_refused(tmp_path):
    (tmp_path / "model.toml").write_text(WHEEL_ON_A_TABLE.replace("ALPHA", 'joint = "prismatic"\nmass = 1'))
    done = command("check", tmp_path / "model.toml")
    assert done.returncode != 0 and "gyroscopic requires a joint that turns; joint 'arm' slides" in done.stderr
