"""`build_fmu.load`: the methods of a model against closed forms, and against the solver of the FMU."""

from __future__ import annotations

import pickle
import re
import zipfile
from pathlib import Path

import numpy as np
import pytest

import build_fmu as rds
from build_fmu.errors import UserError

LENGTHS, MASSES, G = (1.0, 0.8), (2.0, 1.5), 9.81

# point masses at the ends of massless rods in a vertical plane; angles from the vertical
DOUBLE = """
name = "double"
gravity = [9.81, 0, 0]
[[link]]
name = "upper"
mass = 2
com = [1, 0, 0]
q = 0.4
[[link]]
name = "lower"
a = 1
mass = 1.5
com = [0.8, 0, 0]
q = -0.7
qd = 0.5
"""


def terms(q, qd):
    """Mass matrix and bias of the double pendulum in relative angles (textbook form in absolute angles, transformed)."""
    (l1, l2), (m1, m2) = LENGTHS, MASSES
    a, b = q[0], q[0] + q[1]
    c, s = np.cos(a - b), np.sin(a - b)
    M = np.array([[(m1 + m2) * l1**2, m2 * l1 * l2 * c], [m2 * l1 * l2 * c, m2 * l2**2]])
    w1, w2 = qd[0], qd[0] + qd[1]
    h = np.array([m2 * l1 * l2 * s * w2**2, -m2 * l1 * l2 * s * w1**2]) + G * np.array([(m1 + m2) * l1 * np.sin(a), m2 * l2 * np.sin(b)])
    J = np.array([[1, 0], [1, 1]])
    return J.T @ M @ J, J.T @ h


def differences(function, x, size=1e-5):
    """Central differences of fourth order."""
    columns = []
    for d in size * np.eye(len(x)):
        columns.append((8 * (function(x + d) - function(x - d)) - function(x + 2 * d) + function(x - 2 * d)) / (12 * size))
    return np.column_stack(columns)


def test_terms_are_those_of_the_double_pendulum(model):
    m = model(DOUBLE)
    q, qd, qdd = np.random.default_rng(1).normal(size=(3, 2))
    M, h = terms(q, qd)
    assert m.mass_matrix(q) == pytest.approx(M, abs=1e-14)
    assert m.bias(q, qd) == pytest.approx(h, abs=1e-13)
    tau = M @ qdd + h
    assert m.inverse(q, qd, qdd) == pytest.approx(tau, abs=1e-13)
    assert m.forward(q, qd, tau) == pytest.approx(qdd, abs=1e-13)
    # rows, and a vector for all rows
    many = np.random.default_rng(2).normal(size=(5, 2))
    rows = m.inverse(many, qd, qdd)
    assert rows.shape == (5, 2)
    assert rows[3] == pytest.approx(terms(many[3], qd)[0] @ qdd + terms(many[3], qd)[1], abs=1e-13)


BODY = "mass = {0}\ncom = [0.2, 0.1, -0.1]\ninertia = [0.2, 0.3, 0.25]\na = 0.3\nalpha = {0}\n"
KINDS = (
    ["free", "revolute", "prismatic"],
    ["revolute", "spherical", "universal"],
    ["free", "spherical", "screw", "spherical", "cylindrical"],
)


@pytest.mark.parametrize("kinds", KINDS, ids="-".join)
def test_terms_have_the_order_of_velocities(model, kinds):
    """M qdd + bias = tau, where angular velocities of spherical and free joints follow all other ones."""
    links = (
        f'[[link]]\nname = "l{i}"\njoint = "{kind}"\n{"pitch = 0.2" if kind == "screw" else ""}\n{BODY.format(i + 1)}'
        for i, kind in enumerate(kinds)
    )
    m = model('name = "tree"\n' + "".join(links))
    rng = np.random.default_rng(3)
    q, qd, u = (rng.normal(size=len(names)) for names in (m.positions, m.velocities, m.inputs))
    for first in [i for i, name in enumerate(m.positions) if name.endswith("quaternion[1]")]:
        q[first : first + 4] /= np.linalg.norm(q[first : first + 4])
    force = dict(zip(m.inputs, u, strict=True))
    tau = [force[name.replace(".qd", ".tau").replace(".omega", ".tau")] for name in m.velocities]
    assert m.mass_matrix(q) @ m.forward(q, qd, u) + m.bias(q, qd) == pytest.approx(tau, abs=1e-11)


def test_a_model_keeps_the_files_that_were_loaded(tmp_path, monkeypatch):
    """Also a table of a trajectory, and after a change of the folder to which the path was relative."""
    text = 'name = "m"\ngravity = [0, -9.81, 0]\n[[link]]\nname = "b"\nmass = {}\ncom = [1, 0, 0]\n'
    text += '[controller]\nlaw = "pd"\nkp = 50\nkd = 5\n[[trajectory]]\njoint = "b"\ntype = "table"\nfile = "move.csv"\n'
    monkeypatch.chdir(tmp_path)
    Path("m.toml").write_text(text.format(2))
    Path("move.csv").write_text("time,q\n0,0\n1,1\n")
    with rds.load("m.toml") as m:
        Path("m.toml").write_text(text.format(5))
        Path("move.csv").unlink()
        monkeypatch.chdir("/")
        assert m.mass_matrix() == pytest.approx(2) and m.slope().size == 2
        assert m.plant().equations([[0]], [[0]], [[1]])[0] == pytest.approx(2 + 2 * 9.81)
        with zipfile.ZipFile(m.build(tmp_path / "m.fmu")) as archive:
            assert "mass = 2" in archive.read("resources/model.toml").decode() and "resources/move.csv" in archive.namelist()


def test_terms_are_not_those_of_joints_of_their_name(model):
    text = '\nname = "m"\n[[link]]\nname = "{}"\njoint = "universal"\nmass = 1\ncom = [1, 0, 0.3]\ninertia = [1, 1, 1]\n'
    terms = [
        (m.mass_matrix([0.1, 0.2]).tolist(), m.bias([0.1, 0.2]).tolist())
        for m in map(model, map(text.format, ("a", "mass_matrix", "bias")))
    ]
    assert terms[0] == terms[1] == terms[2]


def test_terms_include_prescribed_and_locked_joints(model):
    """A mass on a locked rail below a ball joint, and one on a rail with prescribed motion: the ball's entries are the last ones."""
    body = "mass = {}\ninertia = [1, 1, 1]\n"
    ball = '[[link]]\nname = "ball"\njoint = "spherical"\n' + body.format(4)
    rails = "".join(
        f'[[link]]\nname = "{drive}"\nparent = "ball"\njoint = "prismatic"\ndrive = "{drive}"\n{body.format(mass)}'
        for drive, mass in (("locked", 2), ("motion", 3))
    )
    m = model('name = "rails"\n' + ball + rails)
    assert m.velocities == [f"ball.omega[{i}]" for i in (1, 2, 3)]
    assert np.diag(m.mass_matrix()) == pytest.approx([2, 3, 3, 3, 3])
    assert m.bias() == pytest.approx([2 * 9.81, 3 * 9.81, 0, 0, 0])


def test_linearisation_is_that_of_the_double_pendulum(model):
    m = model(DOUBLE)
    assert m.states == ["upper.q", "lower.q", "upper.qd", "lower.qd"]
    assert (m.positions, m.velocities, m.inputs) == (m.states[:2], m.states[2:], ["upper.tau", "lower.tau"])
    assert list(m.start()) == [0.4, -0.7, 0, 0.5]
    x, u = np.array([0.3, -0.9, 0.7, -1.1]), np.array([2.0, -3.0])

    def slope(x, u=u):
        M, h = terms(x[:2], x[2:])
        return np.concatenate([x[2:], np.linalg.solve(M, u - h)])

    A, B = m.linearise(x, u)
    assert pytest.approx(differences(slope, x, 1e-3), abs=1e-9) == A
    assert pytest.approx(np.vstack([np.zeros((2, 2)), np.linalg.inv(terms(x[:2], x[2:])[0])]), abs=1e-13) == B
    assert m.slope(x, u) == pytest.approx(slope(x), abs=1e-13)


@pytest.mark.parametrize("name", ["double_pendulum", "kuka_kr5", "top", "four_bar", "bennett", "gripper_pd"])
def test_derivative_of_a_step_is_that_of_the_solver(model, name):
    """The step itself is made by the FMU's own solver, which shares no code with the derivative."""
    m = model(name)
    m.parameters = {"solver.rtol": 1e-12, "solver.atol": 1e-14}
    x, u, h = m.start(), np.zeros(len(m.inputs)), 0.02
    A, B = m.linearise(x, u, h)
    # directions that loops allow: the columns of a short step's derivative; not the length of a quaternion
    left, values, _ = np.linalg.svd(m.linearise(x, u, 1e-9)[0])
    allowed = left[:, : int((values > 0.1).sum())]
    length = np.array([x[i] if "quaternion" in n else 0 for i, n in enumerate(m.states)])
    if length.any():
        allowed = np.linalg.svd(np.eye(len(x)) - np.outer(length, length))[0][:, :-1]
    by_state = differences(lambda a: m.step(x + allowed @ a, u, h), np.zeros(allowed.shape[1]), 1e-3)
    assert pytest.approx(by_state, abs=1e-7 * abs(A).max()) == A @ allowed
    scale = np.diag(1 / abs(B).max(axis=0)) if len(u) else np.empty((0, 0))
    by_input = differences(lambda v: m.step(x, u + scale @ v, h), np.zeros(len(u)), 1e-3) if len(u) else B
    assert pytest.approx(by_input, abs=1e-7) == B @ scale


def test_derivative_of_a_step_whose_first_stages_are_out_of_reach(model):
    """With one interval, stages lie where the loops cannot be closed."""
    m = model("five_bar")
    A = m.linearise(h=0.4)[0]
    halves = m.linearise(h=0.2)[0], m.linearise(m.step(h=0.2), h=0.2)[0]
    assert pytest.approx(halves[1] @ halves[0], abs=1e-5 * abs(A).max()) == A


def five_bar_with_a_moved_crank() -> str:
    links = (
        ("a", "ground", 0, 1.2, 'drive = "motion"\nqd = 0.3\n'),
        ("b", "a", 0.4, -0.9, ""),
        ("c", "ground", 0.5, 1.7, ""),
        ("d", "c", 0.4, 0.8, ""),
    )
    return (
        'name = "f"\ngravity = [0, -9.81, 0]\n'
        + "".join(
            f'[[link]]\nname = "{name}"\nparent = "{parent}"\na = {a}\nmass = 1\ncom = [0.25, 0, 0]\ninertia = [0, 0, 0.02]\nq = {q}\n{rest}'
            for name, parent, a, q, rest in links
        )
        + '[[loop]]\nname = "l"\ntype = "point"\nlink_a = "b"\nlink_b = "d"\npoint_a = [0.6, 0, 0]\npoint_b = [0.6, 0, 0]\n'
        + "directions = [[1, 0, 0], [0, 1, 0]]\n[solver]\nrtol = 1e-11\natol = 1e-13\n"
    )


@pytest.mark.parametrize(
    "text",
    [
        DOUBLE.replace('name = "upper"', 'name = "upper"\ndrive = "motion"') + "[solver]\nrtol = 1e-11\natol = 1e-13\n",
        five_bar_with_a_moved_crank(),
    ],
)
def test_steps_with_prescribed_joints(model, text):
    """A step begins at x for any motion inputs, which continue by q + qd t + qdd t^2/2 also in its derivative."""
    m = model(text)
    x, u, h = m.start(), m.start_inputs(), 0.05
    u += [{"q": 0.05, "qd": 1.0, "qdd": 5.0}.get(name.rsplit(".", 1)[1], 0.1) for name in m.inputs]
    assert m.step(x, u, 1e-9) == pytest.approx(x, abs=1e-7)
    for exact, place in zip(m.linearise(x, u, h), ("x", "u"), strict=True):
        for column, change in zip(exact.T, 1e-4 * np.eye(exact.shape[1]), strict=True):
            ends = [m.step(*((x + c, u) if place == "x" else (x, u + c)), h) for c in (change, -change)]
            assert column == pytest.approx((ends[0] - ends[1]) / 2e-4, abs=1e-6 * max(1, abs(exact).max()))


def test_accelerations_without_inputs_are_those_of_the_start_inputs(model):
    """A joint at 0.2 rad behind one that is held at 0.7 rad."""
    links = '[[link]]\nname = "a"\ndrive = "motion"\nq = 0.7\n{0}[[link]]\nname = "b"\na = 1\nq = 0.2\n{0}'.format(
        "mass = 1\ncom = [1, 0, 0]\n"
    )
    m = model(f'name = "m"\ngravity = [0, -9.81, 0]\n{links}')
    assert m.forward([0.2], [0]) == pytest.approx([-9.81 * np.cos(0.9)]) == m.slope()[1:]


def test_no_linear_model_in_a_singular_configuration(model):
    with pytest.raises(UserError, match="singular configuration of the closed loops"):
        model("parallelogram").linearise()


def test_two_steps_multiply(model):
    m = model(DOUBLE)
    x, u, h = m.start(), np.array([1.0, -0.5]), 0.1
    m.parameters = {"solver.rtol": 1e-12, "solver.atol": 1e-14}
    first, second, whole = m.linearise(x, u, h)[0], m.linearise(m.step(x, u, h), u, h)[0], m.linearise(x, u, 2 * h)[0]
    assert pytest.approx(second @ first, abs=1e-9) == whole


def chain(count: int, stiffness: float, mass: float) -> str:
    """Equal masses on rails in a row, between springs, the first one on the ground; the last mass is free."""
    link = '[[link]]\nname = "m{0}"\njoint = "prismatic"\nmass = {1}\nstiffness = {2}\n'
    return 'name = "chain"\ngravity = [0, 0, 0]\n' + "".join(link.format(i, mass, stiffness) for i in range(count))


def test_modes_of_a_uniform_chain(model):
    """w_k = 2 sqrt(c/m) sin((2k-1) pi / (4n+2)) for n masses on n springs, one end free."""
    count, c, mass = 12, 700.0, 0.3
    modes = model(chain(count, c, mass)).modes()
    k = np.arange(1, count + 1)
    expected = 2 * np.sqrt(c / mass) * np.sin((2 * k - 1) * np.pi / (4 * count + 2)) / (2 * np.pi)
    assert modes.frequencies == pytest.approx(expected, rel=1e-10)
    # relative displacements of the joints add to those of the masses: sin(i (2k-1) pi / (2n+1))
    shape = np.cumsum(modes.shapes[:, 2])
    wanted = np.sin(np.arange(1, count + 1) * 5 * np.pi / (2 * count + 1))
    assert shape / shape[0] == pytest.approx(wanted / wanted[0], rel=1e-9)


@pytest.mark.parametrize("stiffness", [1e3, 1e5, 1e8])
def test_modes_of_a_stiff_joint_under_gravity(model, stiffness):
    """The equilibrium found is at rest, however stiff the joint is."""
    text = (
        f'name = "rod"\ngravity = [0, -9.81, 0]\nlink = [{{name = "a", mass = 2, com = [0.5, 0, 0], q = 0.3, stiffness = {stiffness}}}]\n'
    )
    m = model(text)
    assert m.modes(m.equilibrium()).frequencies == pytest.approx([np.sqrt(stiffness / 0.5) / (2 * np.pi)], rel=1e-2)


def test_modes_count_what_loops_leave(model):
    """A parallelogram with equal sides swings like a pendulum: one mode."""
    m = model("four_bar")
    x = m.equilibrium()
    modes = m.modes(x)
    assert len(modes.squares) == 1 and modes.squares[0] > 0
    # period of a small motion about the rest position, from the energy-preserving run
    start = {f"{n}0": v for n, v in zip(m.positions, x[: len(m.positions)] + 1e-4 * modes.shapes[:, 0], strict=True)}
    period = 1 / modes.frequencies[0]
    run = m.simulate(stop=period, step=period / 4, start=start | {n.replace(".qd", ".qd0"): 0 for n in m.velocities}, outputs=m.positions)
    moved = (run.values - x[: len(m.positions)]) @ modes.shapes[:, 0]
    assert moved / moved[0] == pytest.approx([1, 0, -1, 0, 1], abs=1e-3)


def test_equilibrium_of_a_loop_does_not_depend_on_start_velocities(model):
    """The velocity of the crank that follows from the others at rest is rounding."""
    pin = (
        '[[loop]]\nname = "pin"\ntype = "revolute"\nlink_a = "coupler"\nlink_b = "rocker"\npoint_a = [0.3, 0, 0]\npoint_b = [0.25, 0, 0]\n'
    )
    links = [
        ("crank", "q = 1.0\nqd = 3.0\nstiffness = 5"),
        ("coupler", "a = 0.1\nq = -0.7"),
        ("rocker", 'parent = "ground"\na = 0.3\nq = 1.4'),
    ]
    body = "mass = 1\ncom = [0.1, 0, 0]\ninertia = [1e-3, 1e-3, 1e-3]\n"
    text = 'name = "m"\ngravity = [0, -9.81, 0]\n' + "".join(f'[[link]]\nname = "{n}"\n{fields}\n{body}' for n, fields in links) + pin
    assert model(text).equilibrium() == pytest.approx(model(text.replace("qd = 3.0", "")).equilibrium(), abs=1e-8)


def test_equilibrium_and_hold(model):
    m = model(DOUBLE)
    assert m.equilibrium() == pytest.approx([0, 0, 0, 0], abs=1e-8)
    q = np.array([0.5, 1.0])
    assert m.hold(m.state(q)) == pytest.approx(terms(q, np.zeros(2))[1], abs=1e-12)
    # under a torque on the first joint only: sin(q1) = tau / (g l1 (m1 + m2)), the second rod is vertical
    held = m.equilibrium(u=[10.0, 0.0])
    M = G * ((MASSES[0] + MASSES[1]) * LENGTHS[0])
    assert held[0] == pytest.approx(np.arcsin(10 / M), abs=1e-8) and held[0] + held[1] == pytest.approx(0, abs=1e-8)
    up = m.modes(m.state([np.pi, 0], [0, 0]))
    assert (up.squares < 0).all() and np.isnan(up.frequencies).all()


def test_refused_parameters_leave_the_model_usable(model):
    m = model(DOUBLE, tunable=["lower.mass"])
    slope = m.slope()
    m.parameters = {"lower.mass": -1.0}
    with pytest.raises(UserError, match="lower.mass must be >= 0, got -1"):
        m.slope()
    m.parameters = {}
    assert (m.slope() == slope).all()


def test_each_instance_tells_its_own_reason(model):
    m = model(DOUBLE)
    m.inverse([0, 0], [0, 0], [0, 0])
    m.step([0, 0, 0, 0], None, 0.1)
    m.simulate(0.1, 0.1)  # an instance that is freed
    m.parameters = {"solver.rtol": -1.0}
    for call in (m.slope, lambda: m.inverse([0, 0], [0, 0], [0, 0])):
        with pytest.raises(UserError, match="solver.rtol must be > 0, got -1"):
            call()


def test_parameters_apply_to_every_verb(model):
    m = model(DOUBLE, tunable=["lower.mass"])
    before = m.mass_matrix([0, 0])[1, 1]
    m.parameters = {"lower.mass": 3.0}
    assert m.mass_matrix([0, 0])[1, 1] == pytest.approx(2 * before)
    assert m.inverse([0, 0], [0, 0], [0, 1])[1] == pytest.approx(2 * before)
    with pytest.raises(UserError, match="unknown parameter 'lower.mas'; did you mean 'lower.mass'"):
        m.parameters = {"lower.mas": 1.0}
    assert m.parameters == {"lower.mass": 3.0}
    m.parameters["lower.mas"] = 1.0
    with pytest.raises(UserError, match="unknown parameter 'lower.mas'"):
        m.mass_matrix()
    with pytest.raises(UserError, match="unknown parameter 'lower.mas'"):
        m.inverse([0, 0], [0, 0], [0, 0])
    m.parameters = {"lower.mass": 3.0, "upper.q0": 1.0}
    assert m.inverse([0, 0], [0, 0], [0, 1])[1] == pytest.approx(2 * before)


def test_parameters_may_be_strings(model):
    m = model(DOUBLE)
    options = {"stop": 0.5, "step": 0.1, "outputs": ["upper.q", "solver.rhs_evaluations"]}
    default, chosen = m.simulate(**options), m.simulate(start={"solver.method": "bdf"}, **options)
    m.parameters = {"solver.method": "bdf"}
    assert (m.simulate(**options).values == chosen.values).all()
    assert chosen["solver.rhs_evaluations"][-1] != default["solver.rhs_evaluations"][-1]
    assert m.simulate_many(stop=0.5, step=0.1, outputs=["upper.q"])["upper.q"][0, -1] == pytest.approx(chosen["upper.q"][-1], abs=1e-12)
    assert list(m.start()) == [0.4, -0.7, 0, 0.5]
    m.parameters = {"solver.method": "bdf", "upper.q0": "pi/8"}
    assert m.start()[0] == np.pi / 8
    m.parameters = {"solver.method": "bdf"}
    assert m.step(m.start(), None, 0.1)[0] == pytest.approx(chosen["upper.q"][1], abs=1e-12)
    for wrong, sentence in (
        ("rk", "solver.method must be .* got 'rk'"),
        (["bdf"], "'solver.method' must be a number or a string, got list"),
    ):
        with pytest.raises(UserError, match=sentence):
            m.simulate(start={"solver.method": wrong})
    m.parameters = {"solver.method": "rk"}
    with pytest.raises(UserError, match="solver.method must be .* got 'rk'"):
        m.start()


@pytest.mark.parametrize("name", ["four_bar", "five_bar"])
def test_inverse_of_loops_is_undone_by_forward_dynamics(model, name):
    m = model(name)
    x, tau = m.state(qd=np.full(len(m.velocities), 0.3)), np.linspace(0.5, 1, len(m.inputs))
    driven = [n.removesuffix(".tau") for n in m.inputs]
    starts = m.start_values(x)
    q, qd = ([starts[f"{joint}.{letter}0"] for joint in driven] for letter in ("q", "qd"))
    m.slope(x, tau)
    qdd = m._equations().read([f"{joint}.qdd" for joint in driven])
    assert m.inverse(q, qd, qdd) == pytest.approx(tau, rel=1e-9)


def test_simulate_follows_a_table(model):
    m = model("name = 'cart'\ngravity = [0, 0, 0]\n[[link]]\nname = 'cart'\njoint = 'prismatic'\nmass = 2\n")
    run = m.simulate(stop=3, step=0.5, inputs={"cart.tau": ([0, 3], [0, 6])}, outputs=["cart.q"])
    assert run["cart.q"] == pytest.approx(run.time**3 / 6, abs=1e-6)
    run = m.simulate(stop=1, inputs={"cart.tau": 4}, start={"cart.qd0": 1.0})
    assert run["cart.q"][-1] == pytest.approx(2, abs=1e-6)


def test_errors_are_one_sentence(model):
    m = model(DOUBLE)
    for call, sentence in (
        (lambda: m.mass_matrix([1]), r"'q' must have the shape \(2,\) \(upper.q, lower.q\), got \(1,\)"),
        (lambda: m.forward([0, np.nan], [0, 0]), "'q' is not finite: entry 'lower.q'"),
        (lambda: m.linearise(h=-1), "the step size h must be a positive time in s, got -1"),
        (lambda: m.simulate(outputs="lower.q"), "outputs must be a list of names, got 'lower.q'"),
        (lambda: m.simulate(inputs={"lower.tau": ([0, 1, 0.5], [0, 0, 0])}), "input 'lower.tau': times must not decrease"),
        (lambda: rds.load(m.file, tunable="lower.mass"), "tunable must be a list of names, got 'lower.mass'"),
        (lambda: m.step(), "the step size h must be a positive time in s, got None"),
        (lambda: setattr(m, "parameters", {"upper.q0": np.nan}), "parameter 'upper.q0' must be finite, got nan"),
        (lambda: m.simulate(start={"upper.q0": np.nan}), "parameter 'upper.q0' must be finite, got nan"),
        (lambda: m.design(-1, 1, 1, duration=-1), "duration and step must be positive times in s, step at most the duration, got -1 and"),
        (lambda: m.design(-1, 1, 1, duration=1, step=2), "step at most the duration, got 1 and 2"),
        (lambda: m.identify([0], [[0, 0]], [[0, 0]], cutoff=-1), "the cutoff must be a positive frequency in Hz, got -1"),
        (
            lambda: rds.load(m.file, tunable=["lower.mas"]),
            "^tunable 'lower.mas' is not a parameter of this model; did you mean 'lower.mass'",
        ),
        (lambda: m.simulate(inputs={"lower.tau": ([], [])}), "input 'lower.tau' has no values"),
        (lambda: m.simulate_many(stop=1, step=0.3), "the stop time 1 s is not a multiple of the step size 0.3 s"),
        (lambda: m.simulate_many(parameters={"upper.q0": []}), "a batch has at least one run"),
        (lambda: m.design(-1, 1, 1, duration=1e100), "rows are too many"),
        (lambda: m.plant().equations([[0, 0]], [[0, 0]], [0]), r"q, qd and qdd must have the shape \(rows, 2\)"),
        (lambda: m.modes(), "modes require a state at rest, but 'lower.qd"),
        (lambda: m.inverse(np.zeros((2, 2)), np.zeros((3, 2)), np.zeros(2)), "must be vectors or have 3 rows"),
        (
            lambda: model("kuka_kr5_computed_torque").linearise(h=10),
            "a trajectory changes at t = .* s, inside the step of 10 s",
        ),
        (lambda: setattr(m, "parameters", {"no.such": 1}), "unknown parameter 'no.such'"),
        (lambda: m.mass_matrix("a"), "'q' must be numbers: could not convert string to float: 'a'"),
        (lambda: m.forward([0, "x"], [0, 0]), "arguments must be numbers: "),
        (lambda: rds.load("absent.toml"), "model file 'absent.toml' does not exist"),
        (lambda: model("kuka_kr5_harmonic").step(model("kuka_kr5_harmonic").start(), None, 0.1), "has no start parameter"),
    ):
        with pytest.raises(UserError, match=sentence):
            call()
    with pytest.raises(UserError, match="no inputs hold the model at rest"):
        model(DOUBLE + "drive = 'free'\n").hold()


ROWS = np.zeros((50, 2))


def test_wrong_types_are_one_sentence(model, tmp_path):
    m = model(DOUBLE)
    time, run = np.arange(50) * 0.1, tmp_path / "out.toml"
    known = m.identify(time, np.random.default_rng(0).normal(size=(50, 2)), ROWS, ROWS, ROWS)
    for call, sentence in (
        (lambda: rds.load(None), "the model file must be a path, got None"),
        (lambda: rds.load(m.file, ["a", "b"]), "^tunable 'a' is not a parameter of this model$"),
        (lambda: rds.load(m.file, [1]), "tunable must be a list of names, got the entry 1"),
        (lambda: m.build(1.5), "the target must be a path, got 1.5"),
        (lambda: setattr(m, "parameters", [1]), r"parameters must be a dictionary of values by name, got \[1\]"),
        (lambda: setattr(m, "parameters", {"upper.q0": [1]}), "parameter 'upper.q0' must be a number or a string, got list"),
        (lambda: m.simulate(stop="x"), "the stop time must be a positive time in s, got 'x'"),
        (lambda: m.simulate(step=[1]), r"the step size must be a positive time in s, got \[1\]"),
        (lambda: m.simulate(inputs=[1]), "inputs must be a dictionary"),
        (lambda: m.simulate(start=[1]), "start must be a dictionary"),
        (lambda: m.simulate(outputs=[1]), "outputs must be a list of names, got the entry 1"),
        (lambda: m.simulate(inputs={"upper.tau": (["a"], [1])}), "times and values of input 'upper.tau' must be numbers: "),
        (lambda: m.simulate(inputs={"upper.tau": ([0], [1], [2])}), "input 'upper.tau' must be times and values, got 3 entries"),
        (lambda: m.simulate_many(inputs="x"), "'inputs' must be numbers: "),
        (lambda: m.simulate_many(inputs=[[1], [1, 2]]), "'inputs' must be numbers: "),
        (lambda: m.simulate_many(parameters=[1]), "parameters must be a dictionary"),
        (lambda: m.identify(time, None, ROWS), r"'q' must be finite and have the shape \(rows, 2\)"),
        (lambda: m.identify([[0], [1, 2]], ROWS, ROWS), "'time' must be numbers: "),
        (lambda: m.identify(time, ROWS, ROWS, cutoff="x"), "the cutoff must be a positive frequency in Hz, got 'x'"),
        (lambda: m.identify(time, ROWS, ROWS, parameters=[1]), "parameters must be a list of names"),
        (lambda: m.design([1, 2, 3], 1, 1), r"'low' must be a number or have the shape \(2,\)"),
        (lambda: m.design(-1, "x", 1), "'high' must be numbers: "),
        (lambda: m.design(-1, 1, 1, duration="x"), "the duration must be a number, got 'x'"),
        (lambda: m.design(-1, 1, 1, parameters=[1]), "parameters must be a list of names"),
        (lambda: m.plant().equations("x", 0, 0), "q, qd and qdd must be numbers: "),
        (lambda: known.added("zz"), "unknown link 'zz'"),
        (lambda: known.write(run, tmp_path / "nofile.toml"), "cannot read .*nofile.toml': No such file"),
    ):
        with pytest.raises(UserError, match=sentence) as caught:
            call()
        assert "\n" not in str(caught.value)


PENDULUM = """
name = "pendulum"
gravity = [9.81, 0, 0]
[[link]]
name = "rod"
joint_name = "j"
mass = 1
com = [1, 0, 0]
"""


@pytest.mark.parametrize(
    "fields",
    [
        "gear_ratio = 2",
        "torque_limit = 50",
        "time_constant = 0.1",
        "gear_ratio = 2\nrotor_inertia = 0.01\nstiffness = 100",
        "gear_ratio = 2\nresistance = 1\ntorque_constant = 0.5",
    ],
)
def test_inverse_gives_the_torque_on_the_joint_behind_any_actuator(model, fields):
    m = model(PENDULUM + f'[[actuator]]\njoint = "j"\n{fields}\n')
    assert m.inverse([0.3], [0], [0]) == pytest.approx([9.81 * np.sin(0.3)], rel=1e-12)


def test_hold_says_that_drives_with_states_keep_them(model):
    m = model(PENDULUM + '[[actuator]]\njoint = "j"\ntime_constant = 0.1\n')
    with pytest.raises(UserError, match="the actuators keep their states in x"):
        m.hold(m.state([0.3]))


@pytest.mark.parametrize("verb", ["slope", "hold", "linearise", "modes"])
def test_equations_under_a_sampled_controller_are_refused(model, verb):
    m = model(PENDULUM + '[controller]\nlaw = "pd"\nkp = 50\nkd = 5\ninput = true\nsample_time = 0.01\n')
    with pytest.raises(UserError, match="the controller is sampled every 0.01 s"):
        getattr(m, verb)()
    assert m.step([0.3, 0], None, 0.001)[1] == pytest.approx(-0.001 * (15 + 9.81 * np.sin(0.3)), rel=1e-3)
    assert m.equilibrium() == pytest.approx([0, 0], abs=1e-12)


def test_a_used_model_can_be_pickled(model):
    m = model(DOUBLE)
    expected = m.forward([0.1, 0.2], [0.3, 0.4])
    copy = pickle.loads(pickle.dumps(m))
    m.close()
    with copy:
        assert copy.forward([0.1, 0.2], [0.3, 0.4]) == pytest.approx(expected, rel=1e-14)


def test_build_writes_the_fmu(model, tmp_path):
    assert model(DOUBLE).build(tmp_path / "arm.fmu").stat().st_size > 100_000


def test_the_program_of_the_page_runs(monkeypatch):
    root = Path(__file__).parents[2]
    monkeypatch.chdir(root)
    program = re.search(r"```python\n(.*?)```", (root / "docs" / "python.md").read_text(encoding="utf-8"), re.DOTALL)[1]
    names: dict = {}
    exec(program, names)
    assert names["run"]["joint1.q"][-1] != names["run"]["joint1.q"][0]


PINNED = """name = "pinned"
link = [{name = "body", joint = "free", drive = "free", mass = 1, com = [0.5, 0, 0], inertia = [0.01, 0.02, 0.02], q = [0, 0, 0, 0.3, 1.3, 0.4]}]
loop = [{name = "pin", type = "spherical", link_a = "body", link_b = "ground"}]
bushing = [{name = "b", link_a = "body", link_b = "ground", stiffness = [0, 0, 0, 5, 6, 7]}]
"""


def test_a_spherical_joint_in_a_loop_rests_in_coordinates_of_its_rest_pose(model):
    """Eigenfrequencies by the body at rest: gravity turns it by about 0.65 rad about y; the start is near the singularity of its angles."""
    m = model(PINNED)
    with pytest.raises(UserError, match="use `start_at_rest`"):
        m.equilibrium()
    near = model(PINNED.replace("0.3, 1.3, 0.4", "0, 0.6, 0"))
    x, y = m.start_at_rest(), near.start_at_rest()
    assert abs(m.slope(x)).max() < 1e-9
    assert m.modes(x).frequencies == pytest.approx(near.modes(y).frequencies, rel=1e-7)
