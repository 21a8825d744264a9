"""start = "equilibrium": the rest configuration near the start positions, against closed forms and laws of rest."""

from __future__ import annotations

import ctypes as c
import math

import numpy as np
import pytest

from tests.fmi.conftest import ROOT
from tests.fmi.raw import OK, Slave

G = 9.81

BOX = """
name = "box"
start = "equilibrium"
[[link]]
name = "box"
joint = "free"
mass = 2
inertia = [0.01, 0.02, 0.03]
com = [0.01, -0.02, 0]
q = [0, 0, {height}, 0.1, -0.2, 0.3]
drive = "free"
[[contact]]
name = "floor"
link_a = "box"
shape_a = "box"
size_a = [0.4, 0.3, 0.2]
stiffness = 1e5
damping = 0.5
friction = 0.6
outputs = ["force", "depth", "torque"]
[solver]
method = "auto"
"""

ROD = """
name = "rod"
start = "equilibrium"
[[link]]
name = "rod"
joint = "{joint}"
{fields}
mass = 1.5
com = {com}
inertia = [0.02, 0.03, 0.04]
[fmu]
tunable = ["rod.mass"]
"""
ROD_Z = "alpha = 1.5707963267948966\nq = {q}\nstiffness = 10\nrest = 0"


@pytest.fixture
def make(built, instance):
    """Returns a function: text of a model -> an instance in initialization mode."""

    def entered(text: str) -> Slave:
        one = instance(built(text))
        assert one.setup() == OK and one.call("EnterInitializationMode") == OK
        return one

    return entered


def begin(one: Slave) -> Slave:
    assert one.call("ExitInitializationMode") == OK, one.errors
    return one


def test_a_box_falls_on_its_four_corners(make):
    """From 0.5 m and tilted. All corners carry the weight: sum k h(x) = m g; the moment about the middle is that of the com."""
    one = begin(make(BOX.format(height=0.5)))
    force = np.array([one.get(f"floor.force[{k}]") for k in (1, 2, 3)])
    assert force == pytest.approx([0, 0, 2 * G], abs=1e-9)
    assert [one.get(f"box[{k}].qdd") for k in (1, 2, 3)] == pytest.approx([0] * 3, abs=1e-8)
    start = one.get("box[3].q")
    assert one.step(0, 100) == OK
    assert one.get("box[3].q") == pytest.approx(start, abs=1e-9)
    assert abs(one.get("energy.balance")) < 1e-9


@pytest.mark.parametrize("degrees", [0, 60, 100, 179])
def test_a_pendulum_hangs(make, degrees):
    """Also from above the horizontal, where Newton's method would find the upper rest position."""
    begun = begin(
        make(ROD.format(joint="revolute", fields=ROD_Z.format(q=math.radians(degrees) - math.pi / 2).replace("10", "0"), com=[0.3, 0, 0]))
    )
    assert begun.get("rod.q") == pytest.approx(-math.pi / 2, abs=1e-10)


def test_the_start_torque_counts_and_so_do_parameters(make):
    """k q + m g c cos(q) = tau."""
    one = make(ROD.format(joint="revolute", fields=ROD_Z.format(q=0.3), com=[0.3, 0, 0]))
    for mass, torque in ((1.5, 0), (1.5, 7), (0.4, 7)):
        one.set("rod.mass", mass)
        one.set("rod.tau", torque)
        q = one.get("rod.q")
        assert 10 * q + mass * G * 0.3 * math.cos(q) == pytest.approx(torque, abs=1e-9)
    begin(one)
    assert one.get("rod.q") == q


def test_a_spherical_pendulum_hangs(make):
    one = begin(
        make(
            ROD.format(joint="spherical", fields="q = [0.5, 0.5, 0.5, -0.5]", com=[0.1, 0.2, 0.3])
            + '[[frame]]\nname = "at"\nlink = "rod"\nposition = [0.1, 0.2, 0.3]\noutputs = ["pose"]\n'
        )
    )
    length = math.sqrt(0.14)
    assert [one.get(f"at.position[{k}]") for k in (1, 2, 3)] == pytest.approx([0, 0, -length], abs=1e-9)


@pytest.mark.parametrize("model", ["four_bar", "gripper", "three_rrr", "parallelogram", "governor"])
def test_closed_loops_rest(make, model):
    text = (ROOT / "models" / f"{model}.toml").read_text().replace("\n[[link]]", '\nstart = "equilibrium"\n[[link]]', 1)
    text = "\n".join(line for line in text.splitlines() if not line.startswith(("qd =", "qd=")))
    one = begin(make(text))
    names = [name for name in one.fmu.named("output", ".q")]
    before = one.reals(names)
    assert one.step(0, 0.5) == OK
    assert one.reals(names) == pytest.approx(before, abs=1e-7)


def test_derivatives_of_the_start_are_refused(make):
    one = make(ROD.format(joint="revolute", fields=ROD_Z.format(q=0.3), com=[0.3, 0, 0]))
    reference = {name: one.fmu.variables[name][1] for name in ("rod.q", "rod.tau")}
    result = c.c_double()
    arguments = (
        c.byref(c.c_uint(reference["rod.q"])),
        c.c_size_t(1),
        c.byref(c.c_uint(reference["rod.tau"])),
        c.c_size_t(1),
        c.byref(c.c_double(1)),
        c.byref(result),
    )
    assert one.call("GetDirectionalDerivative", *arguments) != OK
    begin(one)
    assert one.call("GetDirectionalDerivative", *arguments) == OK


@pytest.mark.parametrize(
    ("fields", "sentence"),
    [
        ('joint = "prismatic"', "found no rest configuration near the start positions; joint 'rod' still accelerates by -9.81 m/s^2"),
        ('joint = "revolute"\ncom = [1, 0, 0]\nqd = 1', "needs joints that start at rest; joint 'rod' starts with a velocity"),
        ('joint = "revolute"\nqd = 1\ndrive = "motion"', "needs prescribed motions that start at rest"),
    ],
)
def test_what_cannot_rest_is_refused(make, fields, sentence):
    one = make('name = "rod"\nstart = "equilibrium"\n[[link]]\nname = "rod"\nmass = 1\n' + fields + "\n")
    assert one.call("ExitInitializationMode") != OK
    assert any(sentence in text for text in one.errors), one.errors


@pytest.mark.parametrize("gravity", [[0, -G, 0], [0, 0, 0], [G, 0, 0], [-G, 0, 0]])
def test_a_parallelogram_rests_from_its_singular_configuration(make, gravity):
    """All links lie on the x axis: it hangs down, or each pose is at rest, or only this one near the start is."""
    text = (ROOT / "models/parallelogram.toml").read_text().replace("qd = 2\n", "").replace("qd = -2\n", "")
    slave = make('start = "equilibrium"\n' + text.replace("gravity = [0, -9.81, 0]", f"gravity = {gravity}"))
    assert slave.call("ExitInitializationMode") == OK, slave.errors
    crank = -math.pi / 2 if gravity[1] else 0
    before = slave.reals(["crank_joint.q", "rocker_joint.q", "coupler_joint.q"])
    assert before == pytest.approx([crank, crank, -crank], abs=1e-8)
    assert slave.step(0, 1.0) == OK and slave.get("closure.gap") < 1e-12
    assert slave.reals(["crank_joint.q", "rocker_joint.q", "coupler_joint.q"]) == pytest.approx(before, abs=1e-8)


@pytest.mark.parametrize("start", [(0, -0.5), (0.3, -0.2), (-0.4, 0.3)])
def test_rods_rest_on_a_stiff_spring(make, start):
    """The spring constrains the tip to a circle, along which the rods move far; forces in closed form balance."""
    text = (ROOT / "models/stiff_strut.toml").read_text()
    slave = make('start = "equilibrium"\n' + text)
    for name, value in zip(("shoulder.q0", "elbow.q0"), start, strict=True):
        slave.set(name, value)
    begin(slave)
    shoulder, elbow = slave.reals(["shoulder.q", "elbow.q"])
    angle = shoulder + elbow
    tip = np.array([math.cos(shoulder) + math.cos(angle), math.sin(shoulder) + math.sin(angle)])
    strut = tip - [1.2, -0.8]
    force = 1e7 * (0.749590630595878 / np.linalg.norm(strut) - 1) * strut
    of_elbow = math.cos(angle) * force[1] - math.sin(angle) * force[0] - G / 2 * math.cos(angle)
    of_shoulder = math.cos(shoulder) * force[1] - math.sin(shoulder) * force[0] - 1.5 * G * math.cos(shoulder)
    assert [of_elbow, of_shoulder] == pytest.approx([0, 0], abs=1e-7)


# a slider on a spring with a pendulum; the scale of the slider follows from its start
SLIDER = """name = "slider"
start = "equilibrium"
link = [
  {name = "s", joint = "prismatic", mass = 1, inertia = [0.01, 0.01, 0.01], stiffness = 100, q = 0.05},
  {name = "p", parent = "s", alpha = 1.5707963267948966, mass = 1, com = [0.5, 0, 0], inertia = [0.01, 0.01, 0.01], stiffness = 5, q = 0.3},
]
"""


def test_reset_forgets_the_scales_of_the_run_before(built):
    starts = []
    with Slave(built(SLIDER)) as slave:
        for q0 in (0.05, 1e-6, 0.05, 0.9, 0.05):
            slave.initialize(start={"s.q0": q0})
            starts.append(slave.reals(["s.q", "p.q"]))
            assert slave.step(0, 0.1) == OK and slave.call("Reset") == OK
    assert starts[0] == starts[2] == starts[4]


HANGING = """name = "hanging"
start = "equilibrium"
link = [
  {name = "pendulum", parent = "ground", alpha = 1.5707963267948966, theta = -1.5707963267948966, mass = 1, com = [1, 0, 0], q = 2.5},
  {name = "light", %s},
]
"""
LIGHT = {
    "a flap with a placeholder for its inertia": 'parent = "pendulum", a = 0.5, inertia = [1e-9, 1e-9, 1e-9], q = 0.5, stiffness = 10',
    "a stiff transmission beside it": 'parent = "ground", mass = 0.01, inertia = [1e-5, 1e-5, 1e-5], q = 0.3, stiffness = 1e7',
    "a stiff joint in the chain": 'parent = "pendulum", a = 0.5, mass = 0.01, inertia = [1e-5, 1e-5, 1e-5], q = 0.3, stiffness = 1e7',
}


@pytest.mark.parametrize("light", LIGHT)
def test_high_accelerations_of_stiff_or_light_joints_do_not_hide_others(make, light):
    slave = begin(make(HANGING % LIGHT[light]))
    assert slave.reals(["pendulum.q", "light.q"]) == pytest.approx([0, 0], abs=1e-8)
    slave.run(0.2, 0.1)
    assert slave.get("pendulum.q") == pytest.approx(0, abs=1e-8)


@pytest.mark.parametrize("size", [1e-3, 1, 1000])
def test_a_slider_sinks_by_several_times_its_size(make, size):
    fields = f'name = "mass", joint = "prismatic", mass = 2, com = [{size}, 0, 0], stiffness = {2 * G / (5 * size)}'
    slave = begin(make(f'name = "sag"\nstart = "equilibrium"\nlink = [{{{fields}}}]\n'))
    assert slave.get("mass.q") == pytest.approx(-5 * size, rel=1e-9)


# a heavy turret that is softly held, beside a stiff slider that starts off its rest position
SLOW = """name = "slow"
start = "equilibrium"
link = [
  {name = "stiff", joint = "prismatic", mass = 1, stiffness = 100, q = 0.1},
  {name = "turret", parent = "ground", inertia = [1e4, 1e4, 1e4], stiffness = 0.1, q = 1},
]
"""
CART = 'name = "cart", parent = "ground", joint = "prismatic", alpha = 1.5707963267948966, mass = 1'
# forces of very different sizes: rounding errors of one are large for another
TREE = """name = "tree"
start = "equilibrium"
link = [
  {name = "l0", joint = "prismatic", mass = 0.06963541444978646, stiffness = 19482.010159542053},
  {name = "l1", parent = "l0", joint = "prismatic", mass = 0.03384073651222049, stiffness = 0.5415821697161556, rest = 0.1},
  {name = "l2", parent = "l0", joint = "prismatic", mass = 0.02166262840179719, stiffness = 27913.354456814217, rest = 0.2},
]
"""


def test_a_slow_joint_rests_at_its_equilibrium(make):
    assert begin(make(SLOW)).get("turret.q") == pytest.approx(0, abs=1e-8)


def test_rounding_errors_do_not_hide_the_equilibrium(make):
    masses, stiffness = (
        (0.06963541444978646, 0.03384073651222049, 0.02166262840179719),
        (19482.010159542053, 0.5415821697161556, 27913.354456814217),
    )
    expected = [-G * sum(masses) / stiffness[0], 0.1 - G * masses[1] / stiffness[1], 0.2 - G * masses[2] / stiffness[2]]
    assert begin(make(TREE)).reals(["l0.q", "l1.q", "l2.q"]) == pytest.approx(expected, rel=1e-9)


@pytest.mark.parametrize("force", [1e-3, 1e-6, 1e-9])
def test_a_free_joint_under_a_small_force_has_no_rest(make, force):
    cart = SLOW.replace('name = "turret", parent = "ground", inertia = [1e4, 1e4, 1e4], stiffness = 0.1, q = 1', CART)
    slave = make(cart)
    assert slave.set("cart.tau", force) == OK and slave.call("ExitInitializationMode") != OK
    assert any("no rest configuration near the start positions; joint 'cart'" in text for text in slave.errors), slave.errors
