"""Closed mechanisms through the built FMU, against closed forms, an Euler-Lagrange program and published results."""

from __future__ import annotations

import re
import subprocess
import sys
from math import cos, hypot, pi, radians, sin, tan

import numpy as np
import pytest

from build_fmu import native
from build_fmu.errors import UserError
from build_fmu.report.sweep import METHODS
from tests.command_line import command
from tests.fmi.conftest import ROOT
from tests.fmi.four_bar_lagrange import CLOSED, HOEKEN, REDYSIM
from tests.fmi.raw import ERROR, OK, Slave, Unpacked

TIGHT = {"solver.rtol": 1e-8, "solver.atol": 1e-10}
FOUR_BAR_JOINTS = ("crank_joint", "joint2", "joint3")
HOEKEN_JOINTS = ("crank_joint", "rocker_joint", "coupler_joint")


@pytest.fixture(scope="module")
def changed_model(built):
    """Returns a function: name of a model, text replacements -> the unpacked FMU."""

    def unpacked(name: str, replacements: dict[str, str]) -> Unpacked:
        text = (ROOT / "models" / f"{name}.toml").read_text()
        for old, new in replacements.items():
            assert old in text
            text = text.replace(old, new)
        return built(text)

    return unpacked


def run(slave: Slave, stop: float, size: float) -> dict[str, np.ndarray]:
    """Steps to `stop`; returns what the loops and energies say at each communication point."""
    gaps, record = slave.fmu.named("output", ".gap"), []
    for k in range(round(stop / size)):
        assert slave.step(k * size, size) == OK, slave.errors
        record.append([max(slave.reals(gaps)), slave.get("energy.balance"), slave.get("energy.kinetic")])
    return dict(zip(("gap", "balance", "kinetic"), np.array(record).T, strict=True))


def values(slave: Slave, joints: tuple[str, ...], ending: str) -> np.ndarray:
    return np.array(slave.reals([f"{joint}.{ending}" for joint in joints]))


# --- trajectories ---


@pytest.mark.parametrize("scene, torque", [("fourbar_freefall", 0), ("fourbar_forced", 2)])
def test_published_four_bar_scenes(fmu, scene, torque):
    table = np.genfromtxt(ROOT / "tests" / "scenes" / f"{scene}.csv", delimiter=",", names=True)
    with Slave(fmu("four_bar")) as slave:
        slave.initialize(start=TIGHT)
        assert slave.set("crank_joint.tau", torque) == OK
        for k in range(1, len(table)):
            before = table["t"][k - 1]
            assert slave.step(before, table["t"][k] - before) == OK
            for name in ("q", "qd"):
                expected = np.array([table[f"{name}{i}"][k] for i in (1, 2, 3)])
                scale = max(1, np.abs([table[f"{name}{i}"] for i in (1, 2, 3)]).max())
                assert np.abs(values(slave, FOUR_BAR_JOINTS, name) - expected).max() < 1e-6 * scale


@pytest.mark.parametrize("torque", [0, 2])
def test_four_bar_moves_as_euler_and_lagrange_say(fmu, torque):
    times = np.linspace(0, 1, 101)
    lagrange = REDYSIM.simulate(times, [0, CLOSED, CLOSED], [0, 0, 0], torque)
    allowed = {"q": 1e-7, "qd": 1e-6, "qdd": 1e-4, "f": 1e-4}
    with Slave(fmu("four_bar")) as slave:
        slave.initialize(start={"solver.rtol": 1e-10, "solver.atol": 1e-12})
        assert slave.set("crank_joint.tau", torque) == OK
        for k in range(len(times)):
            if k > 0:
                assert slave.step(times[k - 1], times[k] - times[k - 1]) == OK
            for name in ("q", "qd", "qdd"):
                assert np.abs(values(slave, FOUR_BAR_JOINTS, name) - lagrange[name][k]).max() < allowed[name]
            # the multipliers are the force on the coupler's tip, with this sign
            force = np.array(slave.reals(["closure.lambda[1]", "closure.lambda[2]"]))
            assert np.abs(force - lagrange["f"][k]).max() < allowed["f"]


def test_hoeken_as_lagrange_says_from_the_closed_start_and_as_published_from_the_open_one(fmu):
    times = np.linspace(0, 1.33, 134)
    shipped = HOEKEN.simulate(times, [0, 0.9844, 4.3144], [4.7124, 1.4045, 0])
    assert np.abs(shipped["q"][-1] - [0.001967898, 0.984967432, 4.314381214]).max() < 1e-6
    assert shipped["qd"][-1][0] == pytest.approx(4.597354942, abs=1e-5)
    with Slave(fmu("hoeken")) as slave:
        slave.initialize(start={"solver.rtol": 1e-10, "solver.atol": 1e-12})
        q, qd = values(slave, HOEKEN_JOINTS, "q"), values(slave, HOEKEN_JOINTS, "qd")
        # the crank keeps its speed, the others follow from the loop
        assert qd[0] == 4.7124
        assert np.abs(HOEKEN.gap(q)).max() < 1e-16
        assert np.abs(HOEKEN.jacobian(q) @ qd).max() < 1e-15
        assert np.abs(qd - [4.7124, 1.4045, 0]).max() < 0.01
        closed = HOEKEN.simulate(times, q, qd)
        for k in range(1, len(times)):
            assert slave.step(times[k - 1], times[k] - times[k - 1]) == OK
        assert np.abs(values(slave, HOEKEN_JOINTS, "q") - closed["q"][-1]).max() < 1e-7


@pytest.mark.parametrize("method", METHODS)
def test_slider_crank_before_its_singular_position(fmu, method):
    with Slave(fmu("slider_crank")) as slave:
        slave.initialize(start={**TIGHT, "solver.method": method})
        run(slave, 0.5, 0.05)
        joints = ("crank_joint", "rod_joint", "slider_joint")
        expected = np.array([-2.545205006, 8.232002666 - 2 * pi, 1.123314785])
        assert np.abs(values(slave, joints, "q") - expected).max() < 2e-8
        assert np.abs(values(slave, joints, "qd") - [-2.183492031, 4.366984064, -3.613111226]).max() < 1e-7


def test_leg_under_pd_control(fmu):
    # the controller 49 (-2 pi - q) - 14 qd as spring and damper of the drive
    with Slave(fmu("leg")) as slave:
        slave.initialize(start={**TIGHT, "crank_joint.stiffness": 49.0, "crank_joint.rest": -2 * pi, "crank_joint.damping": 14.0})
        record = run(slave, 0.2, 0.01)
        expected = [-3.158557789, 4.063256685, -1.854666683, -0.591670424, -1.953723392, -1.953718943, -1.187881593]
        # its start pose violates the loops by 8e-6 m
        assert np.abs(np.array(slave.reals(slave.fmu.named("output", ".q"))) - expected).max() < 2e-4
        assert record["gap"].max() < 1e-12


def test_bennett_linkage_obeys_its_closure_equation(fmu):
    # tan(q1 / 2) tan(q2 / 2) = sin((beta + alpha) / 2) / sin((beta - alpha) / 2), q3 = -q1
    constant = sin(radians(60)) / sin(radians(30))
    with Slave(fmu("bennett")) as slave:
        slave.initialize(start=TIGHT)
        turned = 0
        for k in range(200):
            assert slave.step(0.01 * k, 0.01) == OK
            q1, q2, q3 = slave.reals(["joint1.q", "joint2.q", "joint3.q"])
            assert tan(q1 / 2) * tan(q2 / 2) == pytest.approx(constant, rel=1e-9)
            assert abs((q1 + q3 + pi) % (2 * pi) - pi) < 1e-12
            turned = max(turned, abs(q1 - radians(80)))
        assert turned > 1
        assert abs(slave.get("energy.balance")) < 1e-7


def test_five_bar_hand_is_where_both_arms_reach(fmu):
    with Slave(fmu("five_bar")) as slave:
        slave.initialize(start=TIGHT)
        for k in range(50):
            assert slave.set_reals(["left_drive.tau", "right_drive.tau"], [sin(0.1 * k), -0.5]) == OK
            assert slave.step(0.01 * k, 0.01) == OK
            a, b, c, d = slave.reals(["left_drive.q", "left_elbow.q", "right_drive.q", "right_elbow.q"])
            left = 0.15 * np.exp(1j * a) + 0.25 * np.exp(1j * (a + b))
            right = 0.2 + 0.15 * np.exp(1j * c) + 0.25 * np.exp(1j * (c + d))
            assert abs(left - right) < 1e-14
        assert abs(slave.get("energy.work")) > 0.01
        assert abs(slave.get("energy.balance")) < 1e-7


# --- loops stay closed, energies stay ---


@pytest.mark.parametrize("method", METHODS)
@pytest.mark.parametrize(
    "model, stop", [("slider_crank", 3), ("parallelogram", 5), ("three_rrr", 2), ("bennett", 2), ("four_bar_chain", 1)]
)
def test_gap_and_energy_through_singular_and_redundant_positions(fmu, model, stop, method):
    with Slave(fmu(model)) as slave:
        slave.initialize(start={**TIGHT, "solver.method": method})
        # a Jacobian of 60 states and its exponential in each step: a tenth of the time
        record = run(slave, 0.1 if (model, method) == ("four_bar_chain", "exponential") else stop, 0.01)
        assert record["gap"].max() < 1e-12
        assert np.abs(record["balance"]).max() < 20 * TIGHT["solver.rtol"] * max(1, record["kinetic"].max())


@pytest.mark.parametrize("method", METHODS)
@pytest.mark.parametrize("rtol", [1e-8, 1e-10])
def test_slider_crank_passes_its_singular_position_straight(fmu, method, rtol):
    # crank and rod of one length: the rod turns by twice the crank's angle, or stays folded with the slider at rest, on the other branch
    with Slave(fmu("slider_crank")) as slave:
        slave.initialize(start={"solver.rtol": rtol, "solver.atol": 0.01 * rtol, "solver.method": method})
        for k in range(100):
            assert slave.step(0.01 * k, 0.01) == OK
            crank, rod, slider = slave.reals(["crank_joint.q", "rod_joint.q", "slider_joint.q"])
            assert abs(rod + 2 * crank + pi) < 1e-7
            assert abs(slider + 2 * sin(crank)) < 1e-7
        assert slider < -0.5
        assert abs(slave.get("energy.balance")) < 1e-6


def rhombus(gap: float, size: float) -> str:
    """Equal bars A, B, C on a base longer by `gap`, parallel at the start: the flat configuration is missed by `gap`."""

    def bar(name: str, parent: str, a: float, q: float, mass: float) -> str:
        return f"""
[[link]]
name = "{name}"
parent = "{parent}"
{"alpha = 1.5707963267948966" if parent == "ground" else ""}
{"hold = true" if name == "A" else ""}
a = {a * size!r}
q = {q}
mass = {mass}
com = [{0.5 * size!r}, 0, 0]
inertia = {[mass * size**2 * share for share in (0.001, 0.08, 0.08)]}
"""

    bars = bar("A", "ground", 0, 0.5, 1) + bar("B", "A", 1, -0.1, 0.2) + bar("C", "ground", 1 + gap, 0.4, 1)
    tip = f"[{size!r}, 0, 0]"
    loop = f'[[loop]]\nname = "tip"\ntype = "revolute"\nlink_a = "B"\nlink_b = "C"\npoint_a = {tip}\npoint_b = {tip}\n'
    return f'name = "rhombus"\ngravity = [0, 0, {-9.81 * size!r}]\n{bars}{loop}[fmu]\noutputs = ["energy"]\n'


@pytest.mark.parametrize("method", ["erk", "adams", "exponential", "auto"])
@pytest.mark.parametrize("gap, size", [(3e-10, 1), (7e-10, 1), (7e-10, 1e-6), (7e-10, 1e3), (2e-9, 1)])
def test_bars_that_miss_their_flat_configuration_turn_to_the_other_branch(built, method, gap, size):
    with Slave(built(rhombus(gap, size))) as slave:
        slave.initialize(start={"solver.rtol": 1e-6, "solver.atol": 1e-8, "solver.method": method})
        record = run(slave, 1.2, 0.02)
        assert np.abs(record["balance"]).max() < 2e-5 * record["kinetic"].max()
        # A stays on the base, B and C swing together: the tip of A closes the rhombus to first order in the gap
        a, c = slave.get("A.q"), slave.get("C.q")
        assert abs(c - 1.099) < 1e-3
        assert abs(a * tan(c) / gap - 1) < 1e-4


def test_four_bar_stays_closed_for_100_s(fmu):
    with Slave(fmu("four_bar")) as slave:
        slave.initialize(start=TIGHT)
        record = run(slave, 100, 0.1)
        assert record["gap"].max() < 1e-10
        assert np.abs(record["balance"]).max() < 1e-5 * record["kinetic"].max()


@pytest.mark.parametrize("rtol", [1e-4, 1e-6, 1e-8, 1e-10])
def test_energy_is_kept_as_by_the_same_bars_unpinned(fmu, changed_model, rtol):
    text = (ROOT / "models" / "four_bar.toml").read_text()
    opened = changed_model("four_bar", {text[text.index("[[loop]]") : text.index("[solver]")]: ""})

    def balance(bars: Unpacked) -> float:
        with Slave(bars) as slave:
            slave.initialize(start={"solver.rtol": rtol, "solver.atol": rtol / 100})
            largest = 0
            for k in range(300):
                assert slave.step(0.01 * k, 0.01) == OK
                largest = max(largest, abs(slave.get("energy.balance")))
            return largest

    assert balance(fmu("four_bar")) <= 2 * balance(opened)


@pytest.mark.parametrize("tilt", [0.3, 0.7])
@pytest.mark.parametrize("method", METHODS)
def test_a_row_across_the_plane_has_no_effect(changed_model, method, tilt):
    """In a tilted plane the levers of this row are rounding errors; they changed the velocities between the steps of adams and bdf."""
    rows = [[1, 0, 0], [0, cos(tilt), sin(tilt)], [0, -sin(tilt), cos(tilt)]]
    tilted = {'parent = "ground"\n': f'parent = "ground"\nalpha = {tilt}\n', "[[1, 0, 0], [0, 1, 0]]": str(rows)}
    with Slave(changed_model("four_bar", tilted)) as slave:
        slave.initialize(start=TIGHT | {"solver.method": method})
        for k in range(100):
            assert slave.step(k * 0.01, 0.01) == OK
            assert abs(slave.get("energy.balance")) < 1e-6


def test_cost_of_a_chain_grows_with_its_length(built):
    script = ROOT / "models" / "generate_four_bar_chain.py"
    for count in (2, 40):
        text = subprocess.run([sys.executable, script, str(count)], capture_output=True, text=True, check=True).stdout
        with Slave(built(text)) as slave:
            slave.initialize()
            record = run(slave, 0.1, 0.01)
            assert record["gap"].max() < 1e-12
            # each loop is a cluster of its own, so evaluations are O(n) each; and stiffness must not grow either
            assert slave.get("solver.rhs_evaluations") < 2000


def test_the_committed_chain_is_what_the_generator_prints():
    script = ROOT / "models" / "generate_four_bar_chain.py"
    text = subprocess.run([sys.executable, script, "10"], capture_output=True, text=True, check=True).stdout
    assert text == (ROOT / "models" / "four_bar_chain.toml").read_text()


# --- start ---


def test_an_open_start_is_assembled_and_said(fmu):
    with Slave(fmu("four_bar_redysim"), logging=True) as slave:
        assert slave.setup() == OK
        assert slave.call("EnterInitializationMode") == OK
        assert np.abs(values(slave, FOUR_BAR_JOINTS, "q") - [0, CLOSED, CLOSED]).max() < 1e-14
        assert slave.get("closure.gap") < 1e-16
        assert slave.call("ExitInitializationMode") == OK
        warnings = [text for _, category, text in slave.messages if category == "logStatusWarning"]
        assert warnings == [
            "initial configuration violates the loop constraints by 26.1 mm; corrected: joint2 by -0.262 rad, joint3 by 2.8e-05 rad"
        ]
        assert slave.step(0, 0.01) == OK


def test_changed_start_values_are_assembled_again(fmu):
    with Slave(fmu("four_bar")) as slave:
        assert slave.call("EnterInitializationMode") == OK
        for angle in (0.3, -0.4):
            assert slave.set("crank_joint.q0", angle) == OK
            q = values(slave, FOUR_BAR_JOINTS, "q")
            assert q[0] == angle
            assert np.abs(REDYSIM.gap(q)).max() < 1e-16


def test_a_start_that_cannot_close_is_refused_in_one_sentence(fmu, changed_model):
    free_crank = changed_model("slider_crank", {"q = 2\n": "q = 2\nhold = true\n"})
    with Slave(free_crank) as slave:
        assert slave.call("EnterInitializationMode") == OK
        assert slave.set("slider_joint.q0", 2.5) == OK
        # crank at -90 deg and the rod reach 2 m
        assert slave.get("pin.gap") == pytest.approx(0.5)
        assert slave.call("ExitInitializationMode") == ERROR
        assert slave.errors == [
            "fmi2ExitInitializationMode: loop 'pin': no configuration satisfies the loop constraints; smallest residual 0.5 m"
        ]


def test_an_impossible_loop_is_refused_when_the_fmu_is_built(tmp_path, fmu_file):
    fmu_file("four_bar")  # skips where nothing is built
    model = tmp_path / "open.toml"
    model.write_text((ROOT / "models" / "four_bar.toml").read_text().replace("point_b = [0.1, 0, 0]", "point_b = [0.4, 0, 0]"))
    check = command("check", model)
    assert check.returncode == 1
    assert check.stderr.strip().endswith("loop 'closure': no configuration satisfies the loop constraints; smallest residual 0.17 m")
    assert len(check.stderr.strip().splitlines()) == 1


def start_warnings(slave: Slave) -> list[str]:
    """Initializes; returns what the log warns of, but for motions that outnumber the degrees of freedom."""
    assert slave.call("ExitInitializationMode") == OK, slave.errors
    return [text for _, category, text in slave.messages if category == "logStatusWarning" and "degree of freedom" not in text]


def test_prescribed_accelerations_that_violate_a_loop_are_reported(changed_model):
    """The four-bar with all of its joints prescribed: one degree of freedom, so that two motions have to agree with the third."""
    driven = changed_model(
        "four_bar", {"hold = true\n": 'hold = true\ndrive = "motion"\n', '"free"': '"motion"', '["crank_joint.damping"]': "[]"}
    )
    J = REDYSIM.jacobian(np.array([0, CLOSED, CLOSED]))
    fitting = np.array([1.0, *np.linalg.solve(J[:, 1:], -J[:, 0])])
    for change in (0.0, 1e-3):
        with Slave(driven, logging=True) as slave:
            assert slave.setup() == OK and slave.call("EnterInitializationMode") == OK
            for joint, qdd in zip(FOUR_BAR_JOINTS, fitting + [change, 0, 0], strict=True):
                for name, value in (("q", slave.get(f"{joint}.q")), ("qd", 0.0), ("qdd", qdd)):
                    assert slave.set(f"{joint}.{name}", value) == OK
            warnings = start_warnings(slave)
            if change:  # of the crank's tip, 0.05 m from its joint
                assert warnings == ["loop 'closure': prescribed accelerations violate its constraints by 0.05 mm/s^2"]
            else:
                assert warnings == []


def test_start_velocities_that_loops_change_are_reported(fmu):
    with Slave(fmu("four_bar"), logging=True) as slave:
        assert slave.setup() == OK and slave.call("EnterInitializationMode") == OK
        assert slave.set("crank_joint.qd0", 2.0) == OK
        # the coupler translates: the rocker, as long as twice the crank's way, turns back at half the speed
        assert start_warnings(slave) == ["initial velocities violate the loop constraints by 0.1 m/s; corrected: joint2 by -1 rad/s"]


def test_check_says_what_assembly_moves():
    try:
        native.describe_program()
    except UserError as error:
        pytest.skip(str(error))
    check = command("check", ROOT / "models" / "four_bar_redysim.toml")
    assert check.returncode == 0
    assert "corrected: joint2 by -0.262 rad" in " ".join((check.stdout + check.stderr).split())


# --- dead points ---

# The slider leaves at 0.5 m with 0.1 m/s; crank and rod reach 0.6 m.
STRETCHED = """
name = "stretched"
gravity = [0, 0, 0]

[[link]]
name = "crank"
drive = "free"
mass = 1
inertia = [0.01, 0.01, 0.01]
q = -0.7

[[link]]
name = "rod"
drive = "free"
a = 0.2
mass = 1
inertia = [0.02, 0.02, 0.02]
q = -1.2

[[link]]
name = "slider"
parent = "ground"
joint = "prismatic"
drive = "motion"
alpha = 1.5707963267948966
q = 0.5
qd = 0.1

[[loop]]
name = "pin"
type = "revolute"
link_a = "rod"
link_b = "slider"
point_a = [0.4, 0, 0]
axis_a = [0, 0, 1]
axis_b = [0, 1, 0]
"""


@pytest.mark.parametrize("method", METHODS)
def test_a_prescribed_motion_beyond_the_reach_of_a_loop_stops_there(built, method):
    with Slave(built(STRETCHED)) as slave:
        slave.initialize(start={"solver.method": method})
        for k in range(9):
            assert slave.step(0.11 * k, 0.11) == OK, slave.errors
        assert slave.step(0.99, 0.11) == ERROR
        message = slave.errors[-1]
        assert "dead point" in message
        stopped = float(re.search(r"stopped at t = (\S+) s", message)[1])
        assert 1 - 1e-5 < stopped < 1 + 1e-5


# --- description ---


def test_loops_appear_in_the_table_and_open_trees_have_none_of_it(fmu):
    bennett, tree = fmu("bennett"), fmu("kuka_kr5")
    assert [name for name in bennett.named("output") if name.startswith("cut.")] == ["cut.gap", *(f"cut.lambda[{i}]" for i in range(1, 6))]
    assert not [name for name in tree.variables if "gap" in name or "lambda" in name]


def test_multipliers_that_a_planar_scene_leaves_out_are_zero(fmu):
    with Slave(fmu("slider_crank")) as slave:
        slave.initialize()
        forces = slave.reals([f"pin.lambda[{i}]" for i in range(1, 6)])
        assert forces[2:] == [0, 0, 0]
        assert hypot(*forces[:2]) > 0.1


WELD = """
name = "weld"
gravity = [0, 0, 0]
[[link]]
name = "ball"
joint = "spherical"
mass = 1
inertia = [1, 2, 3]
[[loop]]
name = "cut"
link_a = "ground"
link_b = "ball"
"""


@pytest.mark.parametrize(
    ("kind", "held"),
    [
        ('type = "fixed"', [0, 0, 0, -2, 1, 3]),
        ('type = "prismatic"', [0, 0, -2, 1, 3]),
        ('type = "universal"\naxis_b = [1, 0, 0]', [0, 0, 0, 2]),
    ],
)
def test_signs_of_the_moments_are_those_of_the_model_file_page(built, kind, held):
    """The loop holds the torques (1, 2, 3): moments on link_b about y, -x and -z, of universal about axis_b x axis_a = -y."""
    with Slave(built(WELD + kind + "\n")) as slave:
        slave.initialize(start={f"ball.tau[{i}]": i for i in (1, 2, 3)})
        assert slave.reals([f"cut.lambda[{i + 1}]" for i in range(len(held))]) == pytest.approx(held, abs=1e-12)


# --- orientation at the start ---


def random_rotation(random: np.random.Generator) -> np.ndarray:
    q, _ = np.linalg.qr(random.normal(size=(3, 3)))
    return q * np.sign(np.linalg.det(q))


@pytest.mark.parametrize("seed", range(8))
@pytest.mark.parametrize("kind", ["fixed", "prismatic"])
def test_frames_coincide_from_any_start(built, kind, seed):
    """The rows u . v = 0 also vanish where the frames differ by half a turn about an axis."""
    random = np.random.default_rng(seed)
    a, b, start = (random_rotation(random) for _ in range(3))
    angle = np.arccos((np.trace(a.T @ start @ b) - 1) / 2)
    half = np.arccos((np.trace(start) - 1) / 2) / 2
    axis = np.array([start[2, 1] - start[1, 2], start[0, 2] - start[2, 0], start[1, 0] - start[0, 1]])
    quaternion = [np.cos(half), *(np.sin(half) * axis / np.linalg.norm(axis))]
    text = f"""
name = "weld"
[[link]]
name = "body"
joint = "free"
mass = 1
inertia = [0.1, 0.2, 0.25]
q = {[0.1, 0.2, 0.3, *map(float, quaternion)]}
[[loop]]
name = "weld"
type = "{kind}"
link_a = "ground"
link_b = "body"
axis_a = {a[:, 2].tolist()}
x_a = {a[:, 0].tolist()}
axis_b = {b[:, 2].tolist()}
x_b = {b[:, 0].tolist()}
[[frame]]
name = "f"
link = "body"
outputs = ["rotation"]
"""
    with Slave(built(text)) as slave:
        slave.initialize()
        found = np.array([[slave.get(f"f.rotation[{i},{j}]") for j in (1, 2, 3)] for i in (1, 2, 3)])
        assert np.abs(found @ b - a).max() < 1e-9, f"from {np.degrees(angle):.0f} degrees"
        assert slave.get("weld.gap") < 1e-9


def test_a_start_in_a_singular_configuration_causes_a_warning(tmp_path):
    flat = (ROOT / "models" / "parallelogram.toml").read_text()
    turned = flat
    for qd, q in (("qd = 2\n", 0.01), ("qd = -2\n", -0.01)):
        turned = turned.replace(qd, f"{qd}q = {q}\n")
    for text, warns in ((flat, True), (turned, False)):
        model = tmp_path / "parallelogram.toml"
        model.write_text(text)
        check = command("check", model)
        assert check.returncode == 0
        assert ("parallelogram.toml:1:1: warning: the start is close to a singular configuration" in check.stderr) == warns
