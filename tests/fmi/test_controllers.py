"""Trajectories and control laws inside the FMU, as a master sees them."""

from __future__ import annotations

import zipfile
from math import exp, pi
from pathlib import Path

import numpy as np
import pytest

from build_fmu.run.session import Session
from build_fmu.run.simulate import Settings, simulate
from tests.command_line import command
from tests.fmi.conftest import ROOT, build_fmu
from tests.fmi.raw import OK, Slave, Unpacked
from tests.fmi.redysim_cases import KUKA, LEG, LEG_JOINTS
from tests.fmi.test_drives import expect_independence

METHODS = ("erk", "adams", "bdf")

# A chain of which each joint does something else.
MIXED = """
name = "mixed"
gravity = [1, -9, 3]
link = [
  {name = "rail", joint = "prismatic", drive = "motion", mass = 1, alpha = 1.57},
  {name = "arm", mass = 1, com = [0.3, 0, 0], inertia = [0.1, 0.2, 0.3], alpha = -1.57, q = 0.2},
  {name = "wrist", drive = "free", mass = 0.5, com = [0.2, 0, 0], inertia = [0.01, 0.02, 0.03], a = 0.6, alpha = 0.4},
  {name = "hand", mass = 0.2, com = [0.1, 0, 0], inertia = [0.01, 0.01, 0.01], a = 0.4},
]
trajectory = [
  {joint = "rail", type = "table", file = "rail.csv"},
  {joint = "arm", type = "quintic", to = 1, start = 0.1, duration = 0.4},
]
[controller]
law = "LAW"
joints = ["arm", "hand"]
kp = [30, 5]
kd = 2
target = 0.5
input = true
[solver]
rtol = 1e-9
[fmu]
outputs = ["acceleration", "energy", "solver", "reference"]
tunable = ["arm.kp", "arm.kd", "hand.target"]
"""
RAIL = "time,rail.q,other\n0,0.1,7\n0.2,0.3,7\n0.35,0.2,7\n0.6,0.4,7\n"


@pytest.fixture(scope="module")
def mixed(built):
    return lambda law="pd": built(MIXED.replace("LAW", law), rail=RAIL)


def known_run(fmu: Path, stop: float, step: float, start: tuple[str, ...] = ()):
    with Session(fmu) as session:
        return simulate(session, Settings(stop, step, None, list(start), []))


def test_a_record_does_not_replace_the_table_of_a_trajectory(tmp_path):
    model, table = tmp_path / "mixed.toml", tmp_path / "rail.csv"
    model.write_text(MIXED.replace("LAW", "pd"), encoding="utf-8")
    table.write_text(RAIL)
    done = command("simulate", model, "--csv", table, "--stop", "0.01")
    assert done.returncode == 1 and f"'{table}' is an input of this run" in done.stderr
    assert table.read_text() == RAIL


def test_each_joint_shows_what_it_does(mixed):
    fmu = mixed()
    assert fmu.named("input") == ["arm.tau_added", "hand.tau_added"]
    outputs = fmu.named("output")
    assert [name for name in outputs if name.startswith("rail.")] == ["rail.q", "rail.qd", "rail.qdd", "rail.tau"]
    assert [name for name in outputs if name.startswith("hand.")] == [
        "hand.q",
        "hand.qd",
        "hand.qdd",
        "hand.tau",
        "hand.q_ref",
        "hand.qd_ref",
    ]
    assert [name for name in outputs if name.startswith("wrist.")] == ["wrist.q", "wrist.qd", "wrist.qdd"]
    assert [name for name in fmu.named("parameter") if name.endswith((".kp", ".kd", ".target"))] == ["arm.kp", "arm.kd", "hand.target"]


def test_without_a_request_there_is_no_input_and_no_reference(fmu):
    assert fmu("kuka_kr5_computed_torque").named("input") == []
    assert not [name for name in fmu("kuka_kr5").named("output") if "_ref" in name or name.endswith(".tau")]


def test_the_stiff_gripper_of_redysim(fmu_file):
    result = known_run(fmu_file("gripper_pd"), 1.5, 0.05)
    known = (1.027635516, 1.400728587, 1.397885601, 2.096846379)
    assert [result[f"joint{i}.q"][-1] for i in (1, 2, 3, 4)] == pytest.approx(known, abs=1e-8)
    assert result["energy.work"][-1] == pytest.approx(0.604917816, abs=1e-8)
    assert np.abs(result["energy.balance"]).max() < 1e-7
    assert result["solver.rhs_evaluations"][-1] < 3000


@pytest.mark.parametrize("method", ("erk", "adams", "dirk", "bdf", "exponential", "auto"))
@pytest.mark.parametrize("law", ("computed_torque", "feed_forward"))
def test_work_is_exact_where_the_motion_is_smoother_than_the_torque(built, law, method):
    """A gantry that follows polynomials: one step may span a tenth of the run, in which the power has many turns."""
    moves = "".join(
        f"[[trajectory]]\njoint = 'joint{i + 1}'\ntype = 'quintic'\nto = {to}\nduration = 1\n" for i, to in enumerate((0.15, 0.1, 0.2, 90))
    )
    fmu = built((ROOT / "models/pppr.toml").read_text() + f"\n{moves}[controller]\nlaw = '{law}'\nkp = 49\nkd = 14\n")
    for rtol in (1e-6, 1e-8):
        for step in (0.1, 0.01):
            with Slave(fmu) as slave:
                slave.initialize(start={"solver.method": method, "solver.rtol": rtol, "solver.atol": 1e-2 * rtol})
                balances, works = [], []
                for k in range(round(1.1 / step)):
                    assert slave.step(k * step, step) == OK, slave.errors
                    balances.append(abs(slave.get("energy.balance")))
                    works.append(abs(slave.get("energy.work")))
                assert max(works) > 0.1
                assert max(balances) < 5 * rtol, (rtol, step)


# The slide comes to rest, so steps grow far beyond the motion of the lift, which needs no states.
HOIST = """
name = "hoist"
[[link]]
name = "lift"
joint = "prismatic"
drive = "motion"
mass = 1
[[link]]
name = "slide"
parent = "ground"
joint = "prismatic"
gamma = 1.5707963267948966
alpha = 1.5707963267948966
mass = 0.2
[[trajectory]]
joint = "slide"
type = "quintic"
to = 0.01
duration = 0.3
[[trajectory]]
joint = "lift"
type = "quintic"
to = 0.2
start = 0.5
duration = 0.5
[controller]
law = "pd"
kp = 5000
kd = 50
[fmu]
outputs = ["energy"]
"""


@pytest.mark.parametrize("method", ("adams", "bdf"))
def test_work_of_a_motion_within_a_long_step(built, method):
    """All of the work lifts 1 kg by 0.2 m; a step may end far behind the breakpoint at which the motion ends."""
    fmu = built(HOIST)
    for rtol in (1e-6, 1e-8):
        for step in (0.1, 0.01):
            with Slave(fmu) as slave:
                slave.initialize(start={"solver.method": method, "solver.rtol": rtol, "solver.atol": rtol})
                for k in range(round(1.5 / step)):
                    assert slave.step(k * step, step) == OK, slave.errors
                    assert abs(slave.get("energy.balance")) < 100 * rtol, (rtol, step, k)
                assert slave.get("energy.work") == pytest.approx(0.2 * 9.81, abs=100 * rtol)


@pytest.mark.parametrize(
    ("model", "law", "stop", "known", "work"),
    [
        ("rp_robot", "kp = 49\nkd = 14\ntarget = [90, 0.3]", 3, (1.586609775, 0.301562316), 2.1952186),
        ("pppr", "kp = 49\nkd = 14\ntarget = [0.1, 0.1, 0.1, 90]", 1, (0.103684976, 0.100005537, 0.101609512, 1.523308958), None),
    ],
)
def test_set_point_pd_of_redysim(built, model, law, stop, known, work):
    text = (ROOT / f"models/{model}.toml").read_text() + f"\n[controller]\nlaw = 'pd'\n{law}\n"
    fmu = built(text)
    with Slave(fmu) as slave:
        slave.initialize(start={"solver.method": "bdf", "solver.rtol": 1e-10, "solver.atol": 1e-12})
        slave.run(stop, 0.1)
        assert slave.reals([f"joint{i + 1}.q" for i in range(len(known))]) == pytest.approx(known, abs=2e-9)
        if work:
            assert slave.get("energy.work") == pytest.approx(work, abs=1e-7)


def test_pd_in_closed_loops(built):
    """ReDySim's leg: seven links and three loops, driven at the crank."""
    text = (
        ROOT / "models/leg.toml"
    ).read_text() + f"\n[controller]\nlaw = 'pd'\njoints = ['crank_joint']\nkp = 49\nkd = 14\ntarget = {-2 * pi}\n"
    with Slave(built(text)) as slave:
        slave.initialize(start={"solver.method": "bdf"})
        slave.run(0.2, 0.01)
        # the known pose was typed with few digits
        assert slave.reals(list(LEG_JOINTS)) == pytest.approx(LEG, abs=5e-4)
        assert abs(slave.get("energy.balance")) < 1e-6
        assert slave.get("crank_joint.tau") == pytest.approx(
            49 * (-2 * pi - slave.get("crank_joint.q")) - 14 * slave.get("crank_joint.qd"), abs=1e-9
        )


def test_gravity_compensation_holds_a_five_bar(built):
    """At its start pose and at rest, which without control it leaves at once."""
    text = (ROOT / "models/five_bar.toml").read_text()
    free = built(text)
    names = [name for name in free.named("output") if name.endswith(".q")]
    joints = [name.removesuffix(".tau") for name in free.named("input")]
    with Slave(free) as slave:
        slave.initialize()
        pose = slave.reals(names)
        slave.run(0.5, 0.05)
        assert np.abs(np.subtract(slave.reals(names), pose)).max() > 0.1
    targets = [pose[names.index(f"{joint}.q")] for joint in joints]
    law = f"\n[controller]\nlaw = 'gravity_compensation'\njoints = {joints}\nkp = 10\nkd = 2\ntarget = {targets}\n"
    with Slave(built(text + law)) as slave:
        slave.initialize(start={"solver.rtol": 1e-9})
        rest = {name: slave.get(name) for name in names}
        slave.run(1, 0.05)
        assert slave.reals(names) == pytest.approx(list(rest.values()), abs=1e-7)


def test_computed_torque_keeps_its_error_dynamics(fmu_file):
    result = known_run(fmu_file("kuka_kr5_computed_torque"), 1.5, 0.05)
    start = -3 * pi / 180
    for i in range(1, 7):
        error = result[f"joint{i}.q_ref"] - result[f"joint{i}.q"]
        assert error == pytest.approx([start * (1 + 7 * t) * exp(-7 * t) for t in result.time], abs=1e-6)
    assert np.abs(result["energy.balance"]).max() < 1e-4


def test_computed_torque_in_closed_loops_too(built):
    text = (ROOT / "models/five_bar.toml").read_text()
    joints = [name.removesuffix(".tau") for name in built(text).named("input")]
    law = f"\n[controller]\nlaw = 'computed_torque'\njoints = {joints}\nkp = 49\nkd = 14\ntarget = TARGET\n"
    with Slave(built(text)) as slave:
        slave.initialize()
        start = slave.reals([f"{joint}.q" for joint in joints])
    with Slave(built(text + law.replace("TARGET", str([start[0] + 0.1, start[1] - 0.05])))) as slave:
        slave.initialize(start={"solver.rtol": 1e-9, "solver.atol": 1e-11})
        for k in range(1, 21):
            assert slave.step((k - 1) * 0.02, 0.02) == OK, slave.errors
            t = k * 0.02
            decay = (1 + 7 * t) * exp(-7 * t)
            found = slave.reals([f"{joint}.q" for joint in joints])
            assert found == pytest.approx([start[0] + 0.1 * (1 - decay), start[1] - 0.05 * (1 - decay)], abs=1e-7)
            assert (
                slave.get(
                    "loop.gap"
                    if "loop.gap" in slave.fmu.named("output")
                    else next(name for name in slave.fmu.named("output") if name.endswith(".gap"))
                )
                < 1e-10
            )


def test_the_inverse_of_a_controlled_model_gives_redysims_torques(built):
    """The trajectories move the joints, the controller is gone, and nothing is to be fed in."""
    fmu = built((ROOT / "models/kuka_kr5_computed_torque.toml").read_text(), "--inverse")
    assert fmu.named("input") == []
    with Slave(fmu) as slave:
        slave.initialize()
        found = {0: slave.reals([f"joint{i}.tau" for i in range(1, 7)])}
        for k in range(4):
            assert slave.step(0.25 * k, 0.25) == OK
            found[0.25 * (k + 1)] = slave.reals([f"joint{i}.tau" for i in range(1, 7)])
    for time, known in KUKA.items():
        # all printed digits: seven, or 5e-12 where nearly nothing is printed
        for value, printed in zip(found[time], known, strict=True):
            assert abs(value - printed) <= max(abs(printed) * 1e-6, 2e-11), time


@pytest.mark.parametrize(("model", "stop"), [("space_dual_arm", 30), ("space_arm", 20)])
def test_what_the_arms_of_a_satellite_do_leaves_its_momenta(fmu_file, model, stop):
    result = known_run(fmu_file(model), stop + 3, 0.5, ("solver.rtol=1e-9",))
    assert max(np.abs(result[f"momentum.{kind}[{i}]"]).max() for kind in ("linear", "angular") for i in (1, 2, 3)) < 2e-7
    assert np.abs(result["energy.balance"]).max() < 4e-8
    rates = [name for name in result.names if "joint" in name and name.endswith(".qd")]
    assert rates and max(np.abs(result[name]).max() for name in rates) > 0.05
    assert max(abs(result[name][-1]) for name in rates) < 0.1


def test_a_satellite_under_pd_control_prints_redysims_digits(built):
    text = (
        (ROOT / "models/space_robot.toml").read_text().partition("tunable")[0].replace('joint = "free"', 'joint = "free"\ndrive = "free"')
    )
    for i in (1, 2, 3):
        text += f"\n[[trajectory]]\njoint = 'joint{i}'\ntype = 'cycloid'\nto = {-pi / 2}\nduration = 30\n"
    text += "\n[controller]\nlaw = 'pd'\nkp = 49\nkd = 14\n"
    with Slave(built(text)) as slave:
        slave.initialize(start={"solver.rtol": 1e-11, "solver.atol": 1e-13})
        for k in range(30):
            assert slave.step(k, 1) == OK
            if k == 14:
                assert slave.reals(["base[1].q", "base[2].q", "base.angle[1]"]) == pytest.approx(
                    (0.01676489, 0.03345196, 0.6370263), abs=5.1e-8
                )
        found = slave.reals(["base[1].q", "base[2].q", "base.angle[1]", "joint1.q", "joint2.q", "joint3.q"])
        assert found[:2] == pytest.approx((0.07182897, 0.03810805), abs=5.1e-9)
        assert found[2:] == pytest.approx((1.038754, -1.571413, -1.571296, -1.570901), abs=5.1e-7)


@pytest.mark.parametrize("law", ["pd", "gravity_compensation", "computed_torque"])
def test_energy_is_balanced_with_the_controllers_work(mixed, law):
    with Slave(mixed(law)) as slave:
        slave.initialize(start={"solver.max_step": 0.005})
        assert slave.set("hand.tau_added", 0.3) == OK
        slave.run(0.8, 0.02)
        assert abs(slave.get("energy.balance")) < 1e-6
        assert abs(slave.get("energy.work")) > 1e-2


PRESSED = """
name = "pressed"
link = [{name = "ball", joint = "prismatic", mass = 1, q = 0.2, qd = -1.5}]
contact = [{name = "floor", link_a = "ball", shape_a = "sphere", radius_a = 0.1, stiffness = 1e5, damping = 0.5}]
controller = {law = "computed_torque", kp = 0, kd = 0}
fmu = {outputs = ["energy"]}
"""


@pytest.mark.parametrize("method", [*METHODS, "dirk", "auto"])
def test_the_work_of_computed_torque_converges_although_the_motion_is_uniform(built, method):
    """The law cancels the force of the contact, so no error of the motion shows its onset."""
    for rtol in (1e-6, 1e-8, 1e-10):
        with Slave(built(PRESSED)) as slave:
            slave.initialize(start={"solver.method": method, "solver.rtol": rtol})
            slave.run(0.1, 0.1)
            assert slave.get("ball.q") == pytest.approx(0.05, abs=1e-9)
            assert slave.get("energy.work") > 80 and abs(slave.get("energy.balance")) < 100 * rtol, rtol


WHIRL = """
name = "whirl"
link = [{name = "rod", mass = 1, com = [1, 0, 0], alpha = 1.5707963267948966, qd = 6}]
controller = {law = "gravity_compensation", kp = 0, kd = 0}
fmu = {outputs = ["energy"]}
"""


@pytest.mark.parametrize("method", [*METHODS, "dirk", "auto"])
@pytest.mark.parametrize("step", [0.05, 1])
def test_the_work_of_gravity_compensation_converges_although_the_motion_is_uniform(built, method, step):
    with Slave(built(WHIRL)) as slave:
        slave.initialize(start={"solver.method": method, "solver.rtol": 1e-9})
        slave.run(1, step)
        assert slave.get("rod.q") == pytest.approx(6, abs=1e-8)
        assert slave.get("energy.work") == pytest.approx(9.81 * np.sin(6), abs=1e-6)


def test_an_added_torque_adds(mixed):
    with Slave(mixed()) as slave:
        slave.initialize()
        before = slave.get("arm.tau")
        assert before == pytest.approx(
            30 * (slave.get("arm.q_ref") - slave.get("arm.q")) + 2 * (slave.get("arm.qd_ref") - slave.get("arm.qd"))
        )
        assert slave.set("arm.tau_added", 1.5) == OK
        assert slave.get("arm.tau") == pytest.approx(before + 1.5, abs=1e-14)


def test_gains_and_targets_act_when_they_are_set(mixed):
    with Slave(mixed()) as slave:
        slave.initialize()
        slave.run(0.3, 0.05)
        assert slave.set_reals(["arm.kp", "arm.kd", "hand.target"], [0, 0, 0.7]) == OK
        assert slave.get("arm.tau") == 0
        assert slave.get("hand.q_ref") == 0.7
        assert slave.step(0.3, 0.05) == OK
        assert slave.get("arm.tau") == 0
        assert slave.get("hand.tau") == pytest.approx(5 * (0.7 - slave.get("hand.q")) - 2 * slave.get("hand.qd"), abs=1e-12)
        assert slave.set("arm.kp", -1) != OK


@pytest.mark.parametrize("method", METHODS)
def test_a_restored_run_is_the_run(mixed, method):
    """Saved before and after the ends of trajectories, restored in the same instance and in another."""
    fmu = mixed("computed_torque")
    names = ["arm.q", "arm.qd", "hand.q", "wrist.q", "rail.q", "rail.tau", "arm.tau", "energy.work"]
    with Slave(fmu) as slave, Slave(fmu) as other:
        for one in (slave, other):
            one.initialize(start={"solver.method": method})
        saved, values = {}, {}
        for k in range(40):
            if k in (5, 10, 24, 25, 33):
                saved[k] = slave.serialize(slave.save())
            assert slave.step(0.02 * k, 0.02) == OK
            values[k] = slave.reals(names)
        for first, content in saved.items():
            for one in (slave, other):
                status, state = one.deserialize(content)
                assert status == OK and one.call("SetFMUstate", state) == OK
                for k in range(first, 40):
                    assert one.step(0.02 * k, 0.02) == OK
                    assert one.reals(names) == values[k], k


@pytest.mark.parametrize("law", ["pd", "gravity_compensation", "computed_torque"])
def test_declared_independence_is_true(mixed, law):
    fmu = mixed(law)
    with Slave(fmu) as slave:
        assert slave.setup() == OK
        assert slave.call("EnterInitializationMode") == OK
        knowns = {name: slave.get(name) + 0.01 for name in fmu.named("input") + fmu.named("parameter") if not name.startswith("solver.")}
        for name, value in knowns.items():
            assert slave.set(name, value) == OK, slave.errors
        expect_independence(slave, fmu.dependencies("InitialUnknowns"), knowns)
        assert slave.call("ExitInitializationMode") == OK
        expect_independence(slave, fmu.dependencies("Outputs"), {name: knowns[name] for name in fmu.named("input")})


def test_a_run_may_start_at_any_time(mixed):
    """In the middle of a trajectory the guided joint is where it says."""
    with Slave(mixed()) as slave:
        assert slave.setup(start=0.35) == OK
        assert slave.call("EnterInitializationMode") == OK
        assert slave.get("rail.q") == pytest.approx(0.2, abs=1e-15)
        assert slave.call("ExitInitializationMode") == OK
        assert slave.step(0.35, 0.25) == OK
        assert slave.get("rail.q") == pytest.approx(0.4, abs=1e-15)


@pytest.mark.parametrize("mark", ["", "\ufeff"])
def test_the_table_travels_in_the_fmu(fmu_file, tmp_path, mark):
    """Also one that begins with a byte order mark, as spreadsheets write it."""
    fmu_file("pendulum")
    (tmp_path / "model.toml").write_text(MIXED.replace("LAW", "pd"))
    (tmp_path / "rail.csv").write_text(mark + RAIL)
    archive = build_fmu(tmp_path / "model.toml", tmp_path / "a.fmu")
    with zipfile.ZipFile(archive) as content:
        assert content.read("resources/rail.csv").decode() == mark + RAIL
    first = Unpacked(archive, tmp_path / "a")
    (tmp_path / "rail.csv").write_text(mark + RAIL.replace("0.4", "0.5"))
    second = Unpacked(build_fmu(tmp_path / "model.toml", tmp_path / "b.fmu"), tmp_path / "b")
    # another table is another FMU
    assert first.guid != second.guid
    for fmu, end in ((first, 0.4), (second, 0.5)):
        with Slave(fmu) as slave:
            slave.initialize()
            slave.run(0.7, 0.1)
            assert slave.get("rail.q") == pytest.approx(end, abs=1e-14)


def test_a_bad_table_is_refused_by_name(fmu_file, tmp_path):
    fmu_file("pendulum")
    (tmp_path / "model.toml").write_text(MIXED.replace("LAW", "pd"))
    (tmp_path / "rail.csv").write_text(RAIL + "oops\n")
    done = command("check", tmp_path / "model.toml")
    assert done.returncode == 1
    assert done.stderr.strip() == f"{tmp_path}/model.toml:11:43: trajectory 1: file 'rail.csv' has no number in column 'time' of line 6"
