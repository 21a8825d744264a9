"""[[coupling]]: rigid ones against reduced models in independent coordinates, elastic ones against quadrature."""

from __future__ import annotations

import json
import math

import numpy as np
import pytest
from scipy.integrate import quad

from build_fmu.errors import UserError
from build_fmu.model.describe import describe
from tests.fmi.raw import OK

TAU = [1.5, -0.7, 2.1, 0.4]
# Joints of unit inertia or mass 2, on the ground; without gravity they move independently but for the coupling.
AXES = {
    "revolute": ("inertia = [1, 1, 0.7]", 0.7),
    "prismatic": ("", 2.0),
    "screw": ("inertia = [1, 1, 0.7]\npitch = 0.3", 0.7 + 2.0 * 0.3**2),
}


def axle(name: str, kind: str, extra: str = "", parent: str = "ground") -> str:
    return f'[[link]]\nname = "{name}"\nparent = "{parent}"\njoint = "{kind}"\nmass = 2\n{AXES[kind][0]}\n{extra}\n'


def coupling(joints: list[str], ratios: list[float], extra: str = "", name: str = "gear") -> str:
    return f'[[coupling]]\nname = "{name}"\njoints = {json.dumps(joints)}\nratios = {ratios}\n{extra}\n'


def model(*parts: str, gravity: str = "[0, 0, 0]") -> str:
    solver = '[solver]\nrtol = 1e-10\natol = 1e-12\n[fmu]\noutputs = ["acceleration", "energy"]\n'
    return f'name = "coupled"\ngravity = {gravity}\n' + "\n".join(parts) + solver


def constrained(M: np.ndarray, force: np.ndarray, J: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Accelerations and multipliers of M qdd = force + J^T lambda, J qdd = 0, in a basis of the null space of J."""
    basis = np.linalg.svd(J)[2][len(J) :].T
    qdd = basis @ np.linalg.solve(basis.T @ M @ basis, basis.T @ force)
    return qdd, np.linalg.lstsq(J.T, M @ qdd - force, rcond=None)[0]


@pytest.mark.parametrize(
    ("kinds", "ratios"),
    [
        (["revolute", "revolute"], [3.0, -1.0]),
        (["revolute", "prismatic"], [0.02, -1.0]),
        (["prismatic", "prismatic"], [1.0, 2.5]),
        (["screw", "revolute"], [1.0, -4.0]),
        (["revolute", "prismatic", "screw", "revolute"], [1.0, -30.0, 2.0, 0.5]),
    ],
)
def test_a_rigid_coupling_of_any_joints_against_the_reduced_model(built, instance, kinds, ratios):
    names = [f"j{k}" for k in range(len(kinds))]
    one = instance(built(model(*(axle(n, kind) for n, kind in zip(names, kinds, strict=True)), coupling(names, ratios)))).initialize()
    for name, tau in zip(names, TAU, strict=False):
        assert one.set(f"{name}.tau", tau) == OK
    qdd, multipliers = constrained(np.diag([AXES[kind][1] for kind in kinds]), np.array(TAU[: len(kinds)]), np.array([ratios]))
    assert one.reals([f"{n}.qdd" for n in names]) == pytest.approx(list(qdd), rel=1e-12, abs=1e-13)
    assert one.get("gear.lambda") == pytest.approx(multipliers[0], rel=1e-12)
    one.run(1.0, 0.1)
    assert one.reals([f"{n}.q" for n in names]) == pytest.approx(list(qdd / 2), rel=1e-9)
    assert abs(one.get("gear.gap")) < 1e-14 and abs(one.get("energy.balance")) < 1e-9


def test_a_chain_of_couplings_of_joints_that_carry_each_other(built, instance):
    """A planar finger: the second and third joint follow the first; M of a serial arm in closed form."""
    masses, length, tau = [1.0, 0.7, 0.4], 0.5, [2.0, 0.3, -0.1]
    links = "".join(
        f'[[link]]\nname = "p{k}"\njoint_name = "j{k}"\na = {length if k else 0}\nmass = {m}\ncom = [{length}, 0, 0]\nq = 0.3\n'
        for k, m in enumerate(masses)
    )
    text = model(links, coupling(["j1", "j0"], [1, -1], name="first"), coupling(["j2", "j1"], [1, -1], name="second"))
    one = instance(built(text)).initialize()
    for k, value in enumerate(tau):
        assert one.set(f"j{k}.tau", value) == OK
    angles = np.cumsum([0.3] * 3)
    # velocity of the mass at the end of bar k by the rate of joint j: all bars from j to k turn
    arm = np.array([[-math.sin(a), math.cos(a)] for a in angles]) * length
    jacobians = [np.array([arm[j : k + 1].sum(axis=0) for j in range(3)]) for k in range(3)]
    M = sum(m * J @ J.T for m, J in zip(masses, jacobians, strict=True))
    J = np.array([[-1.0, 1, 0], [0, -1, 1]])
    qdd, multipliers = constrained(M, np.array(tau), J)
    assert one.reals(["j0.qdd", "j1.qdd", "j2.qdd"]) == pytest.approx(list(qdd), rel=1e-12)
    assert one.reals(["first.lambda", "second.lambda"]) == pytest.approx(list(multipliers), rel=1e-12)


@pytest.mark.parametrize("serial", [False, True])
def test_many_followers_of_one_leader(built, instance, serial):
    """Couplings of a leader with many joints, and one follower of a follower, become rows between neighbours."""
    count, length = 9, 0.2
    links = "".join(
        f'[[link]]\nname = "p{k}"\njoint_name = "j{k}"\nparent = "{f"p{k - 1}" if serial and k else "ground"}"\n'
        f"a = {length if k and serial else 0}\nmass = 1\ncom = [{length}, 0, 0]\ninertia = [0, 0, 0.01]\nq = {0.1 * k}\n"
        for k in range(count)
    )
    ratios = {k: 0.5 + 0.1 * k for k in range(1, count)}
    leader = {k: 3 if k == 7 else 0 for k in ratios}
    pairs = [coupling([f"j{k}", f"j{leader[k]}"], [r, -1], f"offset = {r * 0.1 * k - 0.1 * leader[k]}", f"c{k}") for k, r in ratios.items()]
    one = instance(built(model(links, *pairs))).initialize()
    tau = np.array([math.sin(1 + k) for k in range(count)])
    for k in range(count):
        assert one.set(f"j{k}.tau", tau[k]) == OK
    angles = np.cumsum([0.1 * k for k in range(count)]) if serial else np.array([0.1 * k for k in range(count)])
    arm = np.array([[-math.sin(a), math.cos(a)] for a in angles]) * length
    M = np.zeros((count, count))
    for k in range(count):
        inside = [j for j in range(count) if (j <= k if serial else j == k)]
        J = np.array([arm[j : k + 1].sum(axis=0) if j in inside else [0, 0] for j in range(count)])
        turning = np.array([1.0 if j in inside else 0.0 for j in range(count)])
        M += J @ J.T + 0.01 * np.outer(turning, turning)
    J = np.array([[{k: r, leader[k]: -1.0}.get(j, 0.0) for j in range(count)] for k, r in ratios.items()])
    qdd, multipliers = constrained(M, tau, J)
    assert one.reals([f"j{k}.qdd" for k in range(count)]) == pytest.approx(list(qdd), rel=1e-11)
    assert one.reals([f"c{k}.lambda" for k in ratios]) == pytest.approx(list(multipliers), rel=1e-10)
    one.run(0.5, 0.1)
    assert max(abs(one.get(f"c{k}.gap")) for k in ratios) < 1e-13 and abs(one.get("energy.balance")) < 1e-9


def test_prescribing_one_joint_prescribes_the_others(built, instance):
    text = model(axle("a", "revolute", 'drive = "motion"'), axle("b", "prismatic"), coupling(["a", "b"], [0.1, -1]))
    one = instance(built(text)).initialize()
    assert one.set("a.qd", 2.0) == OK and one.set("a.qdd", 0.5) == OK
    assert one.get("b.qdd") == pytest.approx(0.05, rel=1e-14)
    assert one.get("a.tau") == pytest.approx(0.7 * 0.5 + 0.1 * 2.0 * 0.05, rel=1e-13)
    one.run(1.0, 0.25)
    assert one.get("b.q") == pytest.approx(0.1 * (2.0 + 0.5 / 2), rel=1e-13)


def test_the_start_satisfies_the_couplings(built, instance):
    text = model(
        axle("a", "revolute", "q = 0.4\nhold = true"), axle("b", "revolute", "qd = 1"), coupling(["a", "b"], [2, -1], "offset = 0.1")
    )
    one = instance(built(text)).initialize()
    assert one.get("b.q") == pytest.approx(0.7, abs=1e-14)
    assert 2 * one.get("a.qd") - one.get("b.qd") == pytest.approx(0, abs=1e-14)
    said = "initial configuration violates the constraints by 0.7 rad; corrected: b by 0.7 rad"
    assert any(said in text for _, _, text in one.messages), one.messages


@pytest.mark.parametrize(("kind", "ratio", "q"), [("revolute", 1e4, 1.5), ("prismatic", 1e6, 0.1), ("prismatic", 1e-3, 1e-6)])
def test_a_motor_starts_where_its_gear_puts_it(built, instance, kind, ratio, q):
    """Held load, `motor = ratio * load`: one linear equation, however far the motor has to turn."""
    text = model(axle("motor", "revolute"), axle("load", kind, f"q = {q}\nhold = true"), coupling(["motor", "load"], [1.0, -ratio]))
    one = instance(built(text)).initialize()
    assert one.get("load.q") == q
    assert one.get("motor.q") == pytest.approx(ratio * q, rel=1e-12)


def test_more_motions_than_a_coupling_leaves_are_said(built, instance):
    text = model(axle("a", "revolute", 'drive = "motion"'), axle("b", "revolute", 'drive = "motion"'), coupling(["a", "b"], [1, -1]))
    one = instance(built(text)).initialize()
    assert one.set("a.q", 0.5) == OK
    assert one.step(0, 0.1) == OK and one.get("gear.gap") == pytest.approx(0.5)
    assert any("2 motions for 1 degree of freedom: 1 motion more than degrees of freedom" in text for _, _, text in one.messages)


def oscillator(extra: str) -> str:
    return model(axle("a", "revolute", "q = 0.3"), axle("b", "revolute"), coupling(["a", "b"], [1, -2], f"stiffness = 40\n{extra}"))


def test_an_elastic_gear_swings_with_its_period(built, instance):
    """y = a - 2 b from rest: y = y0 cos(w t), w^2 = 40 (1 / Ia + 4 / Ib)."""
    one = instance(built(oscillator(""))).initialize()
    w = math.sqrt(40 * 5 / 0.7)
    for k in range(10):
        assert one.get("gear.gap") == pytest.approx(0.3 * math.cos(0.1 * k * w), abs=1e-9)
        assert one.get("gear.lambda") == pytest.approx(-40 * one.get("gear.gap"), rel=1e-12)
        assert one.step(0.1 * k, 0.1) == OK


def test_a_gear_with_backlash_against_quadrature(built, instance):
    """From rest at y0 the sum reaches 0 after the integral of dy / v, with the energy of the smooth onset."""
    one = instance(built(oscillator("backlash = 0.2\nwidth = 0.05"))).initialize()

    def potential(y: float) -> float:
        x, w = abs(y) - 0.1, 0.05
        u, beyond = min(max(x / w, 0), 1), max(x - w, 0)
        return 40 * (w * w * (u**4 / 4 - u**5 / 10) + beyond * w / 2 + beyond**2 / 2)

    per_mass = 2 * 5 / 0.7
    fall = potential(0.3)
    # dy = 2 s ds removes the root at the start
    time = sum(
        quad(lambda s: 2 * s / math.sqrt(per_mass * (fall - potential(0.3 - s * s))), a, b, epsabs=1e-13, epsrel=1e-13)[0]
        for a, b in [(1e-9, math.sqrt(0.15)), (math.sqrt(0.15), math.sqrt(0.2)), (math.sqrt(0.2), math.sqrt(0.3))]
    )
    assert one.step(0, time) == OK
    speed = math.sqrt(per_mass * fall)
    assert one.get("gear.gap") == pytest.approx(0, abs=1e-9 * speed + 2e-9)
    assert one.get("a.qd") - 2 * one.get("b.qd") == pytest.approx(-speed, rel=1e-9)
    assert one.get("gear.lambda") == 0 and abs(one.get("energy.balance")) < 1e-9


def test_the_gap_depends_on_the_start_of_all_joints_of_an_elastic_coupling(built):
    joints = (("a", "revolute", ""), ("b", "revolute", ""), ("c", "prismatic", 'drive = "motion"'))
    links = [axle(name, kind, extra) for name, kind, extra in joints]
    fmu = built(model(*links, coupling(["a", "b", "c"], [1.0, -2.0, 3.0], "stiffness = 10")))
    assert fmu.dependencies("InitialUnknowns")["gear.gap"] == {"a.q0", "b.q0", "c.q"}


def test_damping_acts_with_the_onset_and_its_loss_is_work(built, instance):
    one = instance(built(oscillator("backlash = 0.2\ndamping = 3"))).initialize()
    one.run(2.0, 0.01)
    assert one.get("energy.total") < 0.7 * 0.5 * 40 * 0.2**2
    assert abs(one.get("energy.balance")) < 1e-8


@pytest.mark.parametrize(
    ("tables", "sentence"),
    [
        ('joints = ["a"]\nratios = [1]', "joints must be two or more"),
        ('joints = ["a", "a"]\nratios = [1, 2]', "joints lists 'a' twice"),
        ('joints = ["a", "c"]\nratios = [1, 2]', "joints 'c' is not a moving joint with one DOF"),
        ('joints = ["a", "ball"]\nratios = [1, 2]', "joints 'ball' is not a moving joint with one DOF"),
        ('joints = ["a", "b"]\nratios = [1, 0]', "ratios must not be 0"),
        ('joints = ["a", "b"]\nratios = [1]', "ratios must have one number for each of the 2 joints, got 1"),
        ('joints = ["a", "b"]\nratios = [1, 1]\nstiffness = 0', "stiffness must be > 0, got 0"),
        ('joints = ["a", "b"]\nratios = [1, 1]\nbacklash = 0.1', "backlash requires stiffness"),
        ('joints = ["a", "b"]\nratios = [1, 1]\nstiffness = 1\nwidth = 0.1', "width requires backlash"),
        (
            'joints = ["a", "b"]\nratios = [1, 1]\n[[coupling]]\nname = "h"\njoints = ["a", "b"]\nratios = [2, 2]\noffset = 1',
            "the couplings before this one require another offset",
        ),
    ],
)
def test_a_bad_coupling_gets_one_sentence(tmp_path, tables, sentence):
    ball = '[[link]]\nname = "ball"\nparent = "ground"\njoint = "spherical"\nmass = 1\ninertia = [1, 1, 1]\n'
    path = tmp_path / "bad.toml"
    path.write_text(model(axle("a", "revolute"), axle("b", "revolute"), ball, f'[[coupling]]\nname = "gear"\n{tables}\n'))
    with pytest.raises(UserError) as error:
        describe(path)
    lines = str(error.value).splitlines()
    assert len(lines) == 1 and sentence in lines[0] and "bad.toml:" in lines[0] and "coupling '" in lines[0]
