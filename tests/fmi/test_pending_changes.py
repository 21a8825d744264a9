"""Parameters, jumps of prescribed motion and a given state, set at one communication point: neither their order nor what is read or saved between them matters."""

from __future__ import annotations

import pytest

from tests.fmi.exchange import Exchange
from tests.fmi.raw import ERROR, OK

DRIVEN = """
name = "driven"

[[link]]
name = "m"
mass = 1
com = [0.3, 0, 0]
alpha = 1.5707963267948966
drive = "motion"

[[link]]
name = "b"
a = 0.6
mass = 1
com = [0.3, 0, 0]
q = 0.4

[[link]]
name = "c"
a = 0.5
mass = 1
com = [0.2, 0, 0]
q = 0.3

[solver]
rtol = 1e-10

[fmu]
tunable = ["b.com[1]", "c.mass", "state"]
"""
POINT = """
name = "point"

[[link]]
name = "a"
mass = 1.0
inertia = [1, 1, 1]

[[link]]
name = "b"
joint = "spherical"
a = 0.5
mass = 1.0
com = [0, 0, 0.3]
inertia = [0.1, 0.1, 0.1]

[fmu]
tunable = ["b.mass", "b.inertia[1]", "b.inertia[2]", "b.inertia[3]"]
"""
LOOP = """
name = "loop"

[[link]]
name = "crank"
mass = 1
com = [0.2, 0, 0]
q = 0.9

[[link]]
name = "rod"
a = 0.5
mass = 1
com = [0.5, 0, 0]
q = -1.2

[[link]]
name = "rocker"
parent = "ground"
a = 1.0
mass = 1
com = [0.3, 0, 0]
q = 0.8

[[loop]]
name = "pin"
type = "revolute"
link_a = "rod"
point_a = [1.0, 0, 0]
link_b = "rocker"
point_b = [0.6, 0, 0]

[[frame]]
name = "tip"
link = "rod"
outputs = ["acceleration"]

[fmu]
tunable = ["state", "rod.mass"]
"""
SHOWN = ["b.q", "b.qd", "c.q", "c.qd", "energy.balance"]
CHANGES = {
    "t": lambda slave: slave.set_reals(["b.com[1]", "c.mass"], [0.1, 3.0]) == OK,
    "j": lambda slave: slave.set_reals(["m.q", "m.qd"], [0.2, 2.0]) == OK,
    "a": lambda slave: (
        slave.set_reals([f"state.{kind}[{k}]" for kind in ("q", "qd") for k in (1, 2, 3)], [0, 0.5, 0.6, 0, 1, 2]) == OK
        and slave.set("state.apply", 1) == OK
    ),
    "r": lambda slave: slave.reals(SHOWN),
    "s": lambda slave: slave.save(),
}


def after(slave, changes: str) -> tuple[list[float], list[float]]:
    """Returns what is shown after the changes, and after a step of 1 ns."""
    slave.initialize()
    slave.run(0.1, 0.1)
    for change in changes:
        assert CHANGES[change](slave)
    shown = slave.reals(SHOWN)
    assert slave.step(0.1, 1e-9) == OK
    return shown, slave.reals(SHOWN)


@pytest.mark.parametrize(
    ("changes", "same_as"),
    [
        ("jt", "tj"),
        ("trj", "tj"),
        ("tsj", "tj"),
        ("jrt", "tj"),
        ("jst", "tj"),
        ("ja", "aj"),
        ("arj", "aj"),
        ("asj", "aj"),
        ("jsa", "aj"),
        ("atsj", "taj"),
    ],
)
def test_order_reading_and_saving_do_not_matter(built, instance, changes, same_as):
    shown, stepped = after(instance(built(DRIVEN)), changes)
    expected, _ = after(instance(built(DRIVEN)), same_as)
    assert shown == pytest.approx(expected, abs=1e-12)
    assert shown == pytest.approx(stepped, abs=1e-6), "a nanosecond changes nothing"
    assert abs(shown[-1]) < 1e-6, "neither a jump nor tuning is an energy error"


@pytest.mark.parametrize("between", ["", "r", "s"])
def test_a_given_state_is_projected_with_the_masses_tuned_after_it(built, instance, between):
    """The given state violates the loop; the nearest one depends on the masses."""

    def poses(*changes: str) -> list[float]:
        slave = instance(built(LOOP)).initialize()
        slave.run(0.01, 0.01)
        given = [value + 0.1 for value in slave.reals(["crank.q", "rod.q", "rocker.q"])]
        does = {
            "a": lambda: slave.set_reals([f"state.q[{k}]" for k in (1, 2, 3)], given) == OK and slave.set("state.apply", 1) == OK,
            "t": lambda: slave.set("rod.mass", 20.0) == OK,
            "r": lambda: slave.get("rod.q"),
            "s": slave.save,
        }
        for change in changes:
            assert does[change]()
        shown = slave.reals(["crank.q", "rod.q", "rocker.q"])
        slave.run(0.11, 0.1, start=0.01)
        return shown + slave.reals(["crank.q", "rod.q", "rocker.q", "energy.balance"])

    assert poses("a", *between, "t") == pytest.approx(poses("t", "a"), abs=1e-9)
    assert poses("a") != pytest.approx(poses("t", "a"), abs=1e-3)


def test_the_answer_to_a_jump_does_not_depend_on_torques_to_the_last_bit(built, instance):
    def answer(torque: float) -> list[float]:
        slave = instance(built(DRIVEN)).initialize()
        slave.run(0.1, 0.1)
        assert slave.set_reals(["b.tau", "c.tau"], [torque, -torque]) == OK and CHANGES["j"](slave)
        return slave.reals(["b.q", "b.qd", "c.q", "c.qd"])

    assert answer(0.0) == answer(123.4)


def test_values_do_not_depend_on_earlier_reads_to_the_last_bit(built, instance):
    frames = "".join(f"[[frame]]\nname = '{n}'\nlink = '{n[1]}'\noutputs = ['pose', 'velocity', 'acceleration']\n" for n in ("fb", "fc"))
    contact = (
        "[[contact]]\nname = 'floor'\nlink_a = 'c'\nshape_a = 'sphere'\nradius_a = 1.0\nstiffness = 10\noutputs = ['force', 'point']\n"
    )
    fmu = built(DRIVEN.replace("[fmu]", f"{frames}{contact}[fmu]\noutputs = ['energy', 'momentum']"))
    slave = instance(fmu).initialize()
    names = [name for name in fmu.named("output") if not name.startswith("energy")]
    for k in range(300):
        assert slave.step(0.1 * k, 0.1) == OK
        first = slave.reals(names)
        slave.reals(["energy.kinetic", "energy.potential", "momentum.angular[1]"])
        assert slave.reals(names) == first
        assert slave.reals(names[::-1]) == first[::-1]


@pytest.mark.parametrize("saves", [False, True])
def test_a_joint_tuned_to_have_no_inertia_is_refused_saved_or_not(built, instance, saves):
    slave = instance(built(POINT)).initialize()
    slave.run(0.01, 0.01)
    assert slave.set_reals(["b.inertia[1]", "b.inertia[2]", "b.inertia[3]", "b.mass"], [0.0] * 4) == OK
    if saves:
        other = instance(slave.fmu).initialize()
        status, state = other.deserialize(slave.serialize(slave.save()))
        assert status == OK and other.call("SetFMUstate", state) == OK
        slave = other
    for _ in range(2):
        assert slave.try_get("a.qdd")[0] == ERROR and "mass matrix is singular" in slave.errors[-1]
        assert slave.step(0.01, 0.01) == ERROR
    assert slave.set("b.inertia[1]", 0.1) == slave.set("b.inertia[2]", 0.1) == slave.set("b.inertia[3]", 0.1) == OK
    assert slave.step(0.01, 0.01) == OK, slave.errors


def test_a_refused_end_of_initialization_changes_nothing(built, instance):
    slave = instance(built(LOOP))
    assert slave.setup() == OK and slave.call("EnterInitializationMode") == OK
    names = ["tip.acceleration[1]", "crank.qdd", "pin.lambda[1]", "crank.q"]
    before = slave.reals(names)
    assert slave.set_reals(["state.q[1]", "state.q[2]", "state.q[3]"], [0.0, 0.0, 3.0]) == OK and slave.set("state.apply", 1) == OK
    assert slave.call("ExitInitializationMode") == ERROR and "cannot be satisfied" in slave.errors[-1]
    assert slave.reals(names) == before
    assert slave.set("crank.q0", 0.91) == OK, "still in initialization"
    assert slave.set_reals(["state.q[1]", "state.q[2]", "state.q[3]"], [0.9, -1.2, 0.8]) == OK
    assert slave.call("ExitInitializationMode") == OK, slave.errors


def test_reading_between_two_changes_does_not_change_the_energy_balance(built):
    cart = """name = "cart"\ngravity = [0, -9.81, 0]
link = [
  {name = "cart", joint = "prismatic", drive = "motion", mass = 1, alpha = 1.57, qd = 0.3},
  {name = "pole", mass = 1, com = [0.4, 0, 0], inertia = [0, 0.1, 0.1], alpha = -1.57, q = 0.5},
]
fmu = {outputs = ["energy"], tunable = ["pole.mass"]}
"""
    balances = []
    for reads in (False, True):
        with Exchange(built(cart)) as tool:
            tool.begin()
            assert tool.call("EnterEventMode") == OK and tool.set("pole.mass", 1.5) == OK
            if reads:
                tool.get("energy.kinetic")
            assert tool.set("cart.qd", 2.0) == OK
            tool.event()
            balances.append(tool.get("energy.balance"))
    assert balances[0] == balances[1]
