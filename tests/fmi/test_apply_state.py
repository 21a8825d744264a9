"""A state given between two steps: `[fmu] tunable = ["state"]`."""

from __future__ import annotations

import re

import numpy as np
import pytest

from tests.command_line import command
from tests.fmi.conftest import ROOT
from tests.fmi.exchange import Exchange, Exchange3
from tests.fmi.raw import ERROR, OK, Slave
from tests.fmi.raw3 import Slave3

PRESCRIBED = """
name = "driven"

[[link]]
name = "base"
joint = "prismatic"
joint_name = "base"
drive = "motion"
mass = 1.0

[[link]]
name = "bob"
joint = "revolute"
joint_name = "bob"
parent = "base"
mass = 1.0
com = [0.5, 0, 0]
q = 0.3

[fmu]
tunable = ["state"]
"""
# Loops of equal cranks: one of their rows is redundant where they are closed, and none elsewhere.
CRANKS = """
name = "cranks"
gravity = [0, -9.81, 0]

[[link]]
name = "a"
mass = 1.0
com = [0.2, 0, 0]
inertia = [0.01, 0.03, 0.03]
q = 1.0

[[link]]
name = "rod"
a = 0.5
mass = 3.0
com = [0.7, 0, 0]
inertia = [0.1, 0.5, 0.5]
q = -1.0
PINS
[fmu]
outputs = ["mass_matrix"]
tunable = ["state"]
""".replace(
    "PINS",
    "".join(
        f"""
[[link]]
name = "{name}"
parent = "ground"
a = {place}
mass = {place}
com = [0.3, 0, 0]
inertia = [0.01, 0.05, 0.05]
q = 1.0

[[loop]]
name = "pin_{name}"
type = "revolute"
link_a = "rod"
point_a = [{place}, 0, 0]
link_b = "{name}"
point_b = [0.5, 0, 0]
"""
        for name, place in (("b", 1.0), ("c", 2.0))
    ),
)
MODELS = ["double_pendulum", "four_bar", "top", "rolling_ball", "kuka_kr5_harmonic", "series_elastic_leg", "parallel_gripper", "governor"]


def settable(model: str) -> str:
    """Returns the text of a model in models/ whose state can be set."""
    text = (ROOT / "models" / f"{model}.toml").read_text()
    lines = [line for line in text.splitlines() if not line.startswith("tunable")]
    if "[fmu]" not in lines:
        return "\n".join([*lines, "[fmu]", 'tunable = ["state"]', ""])
    at = lines.index("[fmu]") + 1
    return "\n".join([*lines[:at], 'tunable = ["state"]', *lines[at:]]) + "\n"


def output_of(scalar) -> str:
    """Returns the output whose value a parameter of the state replaces, by their descriptions."""
    name, joint = scalar.get("name"), re.search(r"joint '(.*)'(?: \((.)\))?", scalar.get("description"))
    if joint[2] is None:
        return f"{joint[1]}.{name.split('.')[1].partition('[')[0]}"
    return f"{joint[1]}.quaternion[{'wxyz'.index(joint[2]) + 1}]" if ".qd" not in name else f"{joint[1]}.omega[{'xyz'.index(joint[2]) + 1}]"


def outputs(fmu) -> dict[str, str]:
    """Returns each parameter of the state of a model without prescribed joints, and the output that it replaces."""
    scalars = [s for s in fmu.xml.iter("ScalarVariable") if s.get("name").startswith("state.") and s.get("name") != "state.apply"]
    actuators = [s.get("name") for s in scalars if s.get("name").startswith("state.actuator")]
    motors = [n for ending in (".motor_q", ".motor_qd") for n in fmu.named("output", ending)]
    assert len(actuators) == len(motors)
    return {s.get("name"): output_of(s) for s in scalars if s.get("name") not in actuators} | dict(zip(actuators, motors, strict=True))


def apply(slave: Slave, values: dict[str, float], number: int = 1) -> None:
    assert slave.set_reals(list(values), list(values.values())) == OK and slave.set("state.apply", number) == OK, slave.errors


@pytest.mark.parametrize("method", ["erk", "adams", "dirk", "bdf", "exponential", "auto"])
@pytest.mark.parametrize("model", MODELS)
def test_the_run_continues_from_the_state_given(built, instance, model, method):
    """Trees, loops, spherical joints, contact, actuators: B, elsewhere until then, takes over the state of A and moves as A."""
    fmu = built(settable(model))
    shown = outputs(fmu)
    tight = {"solver.rtol": 1e-9, "solver.atol": 1e-11, "solver.method": method}
    a, b = (instance(fmu).initialize(start=tight) for _ in range(2))
    apply(b, {name: b.get(name) + 0.1 for name in shown if name.startswith("state.qd")})
    a.run(0.03, 0.01)
    b.run(0.03, 0.01)
    balance = b.get("energy.balance")
    wanted = dict(zip(shown, a.reals(list(shown.values())), strict=True))
    apply(b, wanted, 2)
    scale = max(1.0, abs(a.get("energy.total")))
    assert b.reals(list(shown.values())) == pytest.approx(list(wanted.values()), rel=1e-12, abs=1e-12)
    assert b.get("energy.balance") == pytest.approx(balance, abs=1e-12 * scale)
    assert b.reals([*wanted]) == [*wanted.values()] and b.get("state.apply") == 2
    steps = b.get("solver.steps")
    a.run(0.08, 0.01, 0.03)
    b.run(0.08, 0.01, 0.03)
    assert b.get("solver.steps") > steps
    ends = [np.array(slave.reals(list(shown.values()))) for slave in (a, b)]
    assert np.abs(ends[0] - ends[1]).max() < 1e-6 * max(1, np.abs(ends[0]).max())
    assert b.get("energy.balance") == pytest.approx(balance, abs=1e-6 * scale)


def gap(slave: Slave) -> float:
    """Returns the distance of the ends of crank and coupler of the four-bar, by its lengths."""
    crank, rocker, coupler = np.exp(1j * np.array(slave.reals(["crank_joint.q", "joint2.q", "joint3.q"])))
    return abs(0.15 + rocker * (0.13 + 0.1 * coupler) - 0.05 * crank)


def test_a_state_is_moved_to_where_loops_are_closed(built, instance):
    fmu = built(settable("four_bar"))
    slave = instance(fmu).initialize()
    slave.run(0.02, 0.01)
    shown = outputs(fmu)
    wanted = dict(zip(shown, slave.reals(list(shown.values())), strict=True))
    wanted["state.q[1]"] += 0.05
    wanted["state.qd[2]"] += 0.3
    apply(slave, wanted)
    moved = slave.get("crank_joint.q") - wanted["state.q[1]"]
    assert 1e-4 < abs(moved) < 0.05
    assert gap(slave) < 1e-12
    assert slave.step(0.02, 0.01) == OK and gap(slave) < 1e-12


def test_impossible_states_are_refused_and_can_be_mended(built, instance):
    slave = instance(built(settable("four_bar"))).initialize()
    before = slave.get("crank_joint.q")
    assert slave.set_reals(["state.q[1]", "state.q[2]", "state.q[3]"], [0.3, 1e3, -2e4]) == OK and slave.set("state.apply", 1) == OK
    status, value = slave.try_get("crank_joint.q")
    if status == OK:  # another pose that closes the loop
        assert gap(slave) < 1e-12
    else:
        assert "state.apply: the loop constraints cannot be satisfied near state.q at 0 s" in slave.errors[-1]
    slave = instance(built(settable("top"))).initialize()
    apply(slave, {f"state.q[{k}]": 0.0 for k in range(1, 5)})
    assert slave.step(0, 0.01) == ERROR
    assert "state.apply: a quaternion of state.q is zero" in slave.errors[-1] and before == 0
    assert slave.set("state.q[2]", -2.0) == OK and slave.step(0, 0.01) == OK, slave.errors
    assert slave.set("state.q[1]", float("nan")) == ERROR


def test_each_change_of_the_number_applies_the_state_once(built, instance):
    slave = instance(built(settable("double_pendulum"))).initialize()
    assert slave.set("state.q[1]", 0.5) == OK and slave.step(0, 0.01) == OK
    assert abs(slave.get("shoulder.q")) < 0.1  # the number has not changed
    assert slave.set("state.apply", 0) == OK and abs(slave.get("shoulder.q")) < 0.1
    assert slave.set("state.apply", -7) == OK and slave.get("shoulder.q") == 0.5
    assert slave.step(0.01, 0.01) == OK
    moved = slave.get("shoulder.q")
    assert moved != 0.5 and slave.set("state.apply", -7) == OK and slave.get("shoulder.q") == moved
    # numbers and values in any order; the state is applied when it is used
    assert slave.set("state.apply", 3) == OK and slave.set("state.q[2]", -0.25) == OK and slave.get("elbow.q") == -0.25


def test_at_the_start(built, instance):
    slave = instance(built(settable("double_pendulum"))).initialize(start={"state.q[2]": 0.7, "state.qd[1]": -2.0, "state.apply": 1})
    assert slave.reals(["shoulder.q", "elbow.q", "shoulder.qd", "elbow.qd"]) == [0.0, 0.7, -2.0, 0.0]
    assert abs(slave.get("energy.balance")) < 1e-12
    assert slave.call("Reset") == OK
    assert slave.get("state.q[2]") == 0 and slave.get("state.apply") == 0
    assert slave.initialize().get("elbow.q") == 0


@pytest.mark.parametrize("method", ["erk", "adams", "dirk", "bdf", "exponential", "auto"])
@pytest.mark.parametrize("read", [True, False])
def test_saved_between_application_and_step(built, instance, method, read):
    """Saved before the state is used, and after: the continuation is the same, bit for bit."""
    slave = instance(built(settable("four_bar"))).initialize(start={"solver.method": method})
    slave.run(0.05, 0.01)
    apply(slave, {"state.q[1]": 0.4, "state.q[2]": 2.2, "state.q[3]": 2.2, "state.qd[1]": 1.0})
    if read:
        slave.get("crank_joint.q")
    content, names = slave.serialize(slave.save()), [n for n in slave.fmu.named("output") if slave.fmu.variables[n][0] == "Real"]
    slave.run(0.1, 0.01, 0.05)
    other = instance(slave.fmu).initialize(start={"solver.method": method})
    status, state = other.deserialize(content)
    assert status == OK and other.call("SetFMUstate", state) == OK
    other.run(0.1, 0.01, 0.05)
    assert slave.reals(names) == other.reals(names) and slave.get("solver.steps") == other.get("solver.steps")


def test_prescribed_joints_keep_their_motion(built, instance):
    slave = instance(built(PRESCRIBED)).initialize()
    slave.run(0.02, 0.01)
    assert slave.set("base.q", 0.1) == OK  # a jump, which would swing the bob
    apply(slave, {"state.q[1]": 5.0, "state.qd[1]": 5.0, "state.q[2]": -0.2, "state.qd[2]": 0.0})
    assert slave.reals(["bob.q", "bob.qd"]) == [-0.2, 0.0]
    assert slave.step(0.02, 1e-9) == OK and slave.get("bob.q") == pytest.approx(-0.2, abs=1e-8)
    assert slave.get("base.q") == 0.1


@pytest.mark.parametrize("model", ["double_pendulum", "four_bar", "top"])
def test_in_model_exchange(built, model):
    """Set in event mode; the states are new values for the master."""
    fmu = built(settable(model))
    shown = outputs(fmu)
    with Exchange(fmu) as tool:
        tool.begin()
        assert tool.set("state.apply", 1) == ERROR and tool.set("state.q[1]", 1.0) == ERROR
        assert tool.call("EnterEventMode") == OK
        wanted = dict(zip(shown, tool.reals(list(shown.values())), strict=True))
        if model == "top":
            wanted |= {"state.q[1]": 0.6, "state.q[2]": 0.8}
        else:
            wanted |= {name: value + 0.02 for name, value in wanted.items() if ".q[" in name}
        apply(tool, wanted)
        info = tool.event()
        assert info.new_values and not tool.event().new_values
        states = tool.get_states()
        found = tool.reals(list(shown.values()))
        assert all(np.abs(np.array(found) - state).min() < 1e-12 for state in states), "independent joints of the four-bar"
        bound = 0.1 if model == "four_bar" else 1e-12
        assert np.abs(np.array(found) - list(wanted.values())).max() < bound


def test_every_state_is_marked_as_one_that_events_change(fmu, built, built3):
    text = settable("double_pendulum")
    two, three = built(text), built3(text)

    def marked(unpacked) -> set[str]:
        return {scalar.get("name") for scalar in unpacked.xml.iter("ScalarVariable") if scalar[0].get("reinit") == "true"}

    with Exchange(two) as old, Exchange3(three) as new:
        assert old.states and marked(two) == set(old.states)
        assert {name for name, element in three.elements.items() if element.get("reinit") == "true"} == set(new.states) == set(old.states)
    assert not marked(fmu("cart"))


def test_fmi3(built3):
    """The same parameters as Float64 and Int32."""
    with Slave3(built3(settable("double_pendulum"))) as slave:
        slave.initialize()
        slave.run(0, 2, 0.01)
        assert slave.set("state.q[1]", 0.3) == OK and slave.set("state.apply", 1) == OK
        assert slave.get(["shoulder.q"]) == [0.3]
        assert slave.get(["state.apply"], "Int32") == [1]


def test_absent_unless_listed(fmu, tmp_path):
    assert not [n for n in fmu("kuka_kr5").variables if n.startswith("state.")]
    (tmp_path / "m.toml").write_text(settable("double_pendulum").replace('"state"', '"states"'))
    done = command("check", tmp_path / "m.toml")
    assert done.returncode != 0 and "did you mean 'state'" in done.stderr


@pytest.mark.parametrize("change", [0.02, -1e-4])
def test_the_nearest_state_is_found_where_constraints_are_redundant(built, instance, change):
    """In the mass metric the rest of the way to the given state has no component along the only free motion."""
    slave, joints, motion = instance(built(CRANKS)).initialize(), ["a", "rod", "b", "c"], np.array([1.0, -1.0, 1.0, 1.0])
    for k in range(4):
        given = motion + change * np.eye(4)[k]
        assert slave.set_reals([f"state.q[{i}]" for i in range(1, 5)], given) == OK
        assert slave.set("state.apply", k + 1) == OK
        q = np.array(slave.reals([f"{joint}.q" for joint in joints]))
        assert np.ptp(q * motion) < 1e-12
        M = np.array(slave.reals([f"mass_matrix[{i},{j}]" for i in range(1, 5) for j in range(1, 5)])).reshape(4, 4)
        assert abs(motion @ M @ (given - q)) < 1e-5 * abs(change) * (motion @ M @ motion)
