"""Derivatives of a whole communication step: closed forms, products of steps, differences, saved states, refusals."""

from __future__ import annotations

import ctypes as c

import numpy as np
import pytest
from scipy.linalg import expm

from build_fmu.importers.rigid import rotation_x, rotation_z, transform
from tests.command_line import command
from tests.fmi.conftest import ROOT
from tests.fmi.raw import ERROR, OK, Slave
from tests.fmi.raw3 import Slave3, array, count
from tests.fmi.test_model_exchange import SAMPLED

OSCILLATOR = """
name = "oscillator"
gravity = [0, 0, 0]

[[link]]
name = "cart"
joint = "prismatic"
joint_name = "slide"
mass = 2.0
stiffness = 50.0
damping = 3.0
q = 0.1

[fmu]
outputs = ["step_jacobian", "parameter_jacobian"]
tunable = ["cart.mass", "slide.stiffness"]
"""
TIGHT = {"solver.rtol": 1e-12, "solver.atol": 1e-14}


def with_groups(model: str, groups: str = '"step_jacobian", "mass_matrix"') -> str:
    """Returns the text of a model in models/ with these outputs."""
    head, _, settings = (ROOT / "models" / f"{model}.toml").read_text().partition("[fmu]")
    settings = "\n".join(line for line in settings.splitlines() if not line.startswith("outputs"))
    return f"{head}\n[fmu]\noutputs = [{groups}]\n{settings}\n"


def jacobian(slave: Slave, part: str = "a") -> np.ndarray:
    names = slave.fmu.named("output")
    names = [name for name in names if name.startswith(f"step_jacobian.{part}[")]
    rows = int(names[-1].partition("[")[2].partition(",")[0])
    return np.array(slave.reals(names)).reshape(rows, -1)


def after(slave: Slave, *sizes: float) -> list[np.ndarray]:
    """Returns A of each of these steps."""
    found, time = [], 0.0
    for size in sizes:
        assert slave.step(time, size) == OK, slave.errors
        found.append(jacobian(slave))
        time += size
    return found


@pytest.mark.parametrize(("rtol", "bound"), [(1e-4, 1e-4), (1e-6, 1e-6), (1e-12, 1e-11)])
def test_oscillator(built, instance, rtol, bound):
    slave = instance(built(OSCILLATOR)).initialize(start={"solver.rtol": rtol, "solver.atol": rtol / 100})
    (A,) = after(slave, 0.3)
    continuous = np.zeros((5, 5))  # q, qd, and the constants tau, m, k
    continuous[:2, :3] = [[0, 1, 0], [-25, -1.5, 0.5]]
    expected = expm(0.3 * continuous)[:2]
    assert np.abs(A - expected[:, :2]).max() < bound and np.abs(jacobian(slave, "b") - expected[:, 2:3]).max() < bound

    def end(m: float, k: float) -> np.ndarray:
        return expm(0.3 * np.array([[0, 1], [-k / m, -3 / m]])) @ [0.1, 0]

    by_mass = (end(2 + 1e-5, 50) - end(2 - 1e-5, 50)) / 2e-5
    by_stiffness = (end(2, 50 + 1e-4) - end(2, 50 - 1e-4)) / 2e-4
    assert np.abs(jacobian(slave, "c") - np.stack([by_mass, by_stiffness], axis=1)).max() < bound + 1e-10


@pytest.mark.parametrize("controlled", ["a", "b"])
def test_feedback_of_one_joint_beside_the_torque_of_another(built, instance, controlled):
    links = "".join(f'[[link]]\nname = "{name}"\njoint = "prismatic"\nmass = {mass}\n' for name, mass in (("a", 2.0), ("b", 3.0)))
    law = f'[controller]\nlaw = "pd"\njoints = ["{controlled}"]\nkp = 40\nkd = 6\n'
    slave = instance(built(f'name = "carts"\n{links}{law}[fmu]\noutputs = ["step_jacobian"]\n')).initialize(start=TIGHT)
    own = "ab".index(controlled)
    continuous, force = np.zeros((5, 5)), np.linalg.inv([[5.0, 3.0], [3.0, 3.0]])  # b slides on a
    continuous[:2, 2:4] = np.eye(2)
    continuous[2:4, [own, 2 + own]] = np.outer(force[:, own], [-40, -6])
    continuous[2:4, 4] = force[:, 1 - own]
    assert slave.step(0, 0.3) == OK
    expected = expm(0.3 * continuous)[:4]
    for part, columns in (("b", expected[:, 4:]), ("a", expected[:, :4])):
        assert np.abs(jacobian(slave, part) - columns).max() < 1e-10


@pytest.mark.parametrize("rtol", [1e-4, 1e-10])
def test_parameters_of_a_contact_that_begins_in_the_step(built, instance, rtol):
    """Their columns are 0 up to the touch-down at 0.101 s."""
    text = """name = "drop"
[[link]]
name = "ball"
joint = "prismatic"
mass = 1
q = 0.15
[[contact]]
name = "floor"
link_a = "ball"
shape_a = "sphere"
radius_a = 0.1
stiffness = 1e4
damping = 0.5
[fmu]
outputs = ["step_jacobian", "parameter_jacobian"]
tunable = ["floor.stiffness", "floor.damping", "ball.mass"]
"""
    start = {"floor.stiffness": 1e4, "floor.damping": 0.5, "ball.mass": 1.0}

    def run(tolerance: float = 1e-12, **change: float) -> Slave:
        values = {name: value * change.get(name, 1) for name, value in start.items()}
        slave = instance(built(text)).initialize(start=values | {"solver.rtol": tolerance, "solver.atol": tolerance / 100})
        for k in range(11):
            assert slave.step(0.01 * k, 0.01) == OK
        return slave

    C, names = jacobian(run(rtol), "c"), list(start)
    for name, value in start.items():
        moved = [np.array(run(**{name: 1 + e}).reals(["ball.q", "ball.qd"])) for e in (-1e-4, 1e-4)]
        difference = (moved[1] - moved[0]) / (2e-4 * value)
        column = C[:, [n for n in run().fmu.named("parameter") if n in names].index(name)]
        assert np.abs(column - difference).max() < max(1e-5, 30 * rtol) * np.abs(difference).max()


def test_a_force_at_a_pin_to_the_ground_has_no_effect(built, instance):
    """The derivatives by such a force are rounding errors alone, which no step size makes accurate."""
    links, pose = "", np.eye(4)
    for k in range(4):
        alpha, a, theta, d = 0.3 + k, 0.2 + 0.1 * k, 0.4, 0.1
        links += f"[[link]]\nname = 'b{k}'\nalpha = {alpha}\na = {a}\ntheta = {theta}\nd = {d}\nmass = 1\ncom = [0.1, 0.05, 0.2]\n"
        links += "inertia = [0.02, 0.03, 0.04]\n"
        pose = pose @ transform(rotation_x(alpha), [0, 0, 0]) @ transform(rotation_z(theta), [a, 0, 0]) @ transform(None, [0, 0, d])
    point = [float(x) for x in (pose @ [0.1, 0.2, 0.3, 1])[:3]]
    ends = f"link_a = 'b3'\npoint_a = [0.1, 0.2, 0.3]\nlink_b = 'ground'\npoint_b = {point}\n"
    tip = "[[frame]]\nname = 'tip'\nlink = 'b3'\nposition = [0.1, 0.2, 0.3]\nport = 'ground'\n"
    text = f"name = 'pinned'\n{links}[[loop]]\nname = 'pin'\ntype = 'spherical'\n{ends}{tip}[fmu]\noutputs = ['step_jacobian']\n"
    slave = instance(built(text)).initialize()
    assert slave.step(0, 0.01) == OK
    B = jacobian(slave, "b")
    inputs = [name.partition("[")[0] for name in slave.fmu.named("input")]
    effects = np.abs(B).max(axis=0)
    for name, effect in zip(inputs, effects, strict=True):
        assert effect < 1e-14 if name == "tip.force" else effect > 1e-4


@pytest.mark.parametrize("model", ["double_pendulum", "four_bar", "top", "rolling_ball", "kuka_kr5_harmonic", "series_elastic_leg"])
def test_two_steps_are_one(built, instance, model):
    """Trees, loops, spherical joints, contact, elastic drives and limits: the Jacobian of a step is the product of those of its parts."""
    fmu = built(with_groups(model))
    first, second = after(instance(fmu).initialize(start=TIGHT), 0.02, 0.03)
    (whole,) = after(instance(fmu).initialize(start=TIGHT), 0.05)
    assert np.abs(second @ first - whole).max() < 1e-10 * max(1, np.abs(whole).max())


def test_a_conservative_arm_is_symplectic(built, instance):
    """In (q, p = M qd), with dM/dq by differences."""
    slave = instance(built(with_groups("double_pendulum"))).initialize(start=TIGHT)
    names = slave.fmu.named("output")
    joints = [name[:-2] for name in names if name.endswith(".q")]

    def by_momentum() -> np.ndarray:
        M = np.array(slave.reals([n for n in names if n.startswith("mass_matrix[")])).reshape(2, 2)
        qd = np.array(slave.reals([j + ".qd" for j in joints]))
        q = slave.reals([j + ".q" for j in joints])

        def momentum(angles: list[float]) -> np.ndarray:
            other = instance(slave.fmu).initialize(start=dict(zip([j + ".q0" for j in joints], angles, strict=True)))
            return np.array(other.reals([n for n in names if n.startswith("mass_matrix[")])).reshape(2, 2) @ qd

        change = np.empty((2, 2))
        for k in range(2):
            moved = [momentum([a + e * 1e-3 * (i == k) for i, a in enumerate(q)]) for e in (-2, -1, 1, 2)]
            change[:, k] = (moved[0] - 8 * moved[1] + 8 * moved[2] - moved[3]) / 12e-3
        return np.block([[np.eye(2), np.zeros((2, 2))], [change, M]])

    before = by_momentum()
    (A,) = after(slave, 0.2)
    canonical = by_momentum() @ A @ np.linalg.inv(before)
    J = np.block([[np.zeros((2, 2)), np.eye(2)], [-np.eye(2), np.zeros((2, 2))]])
    assert np.abs(canonical.T @ J @ canonical - J).max() < 1e-9


@pytest.mark.parametrize("method", ["erk", "bdf", "auto"])
def test_inputs_of_the_kr5_by_differences(built, instance, method):
    fmu = built(with_groups("kuka_kr5"))
    joints = [name[:-2] for name in fmu.named("output") if name.endswith(".q")]
    torques = [5.0, -8.0, 3.0, 0.01, -0.02, 0.005]
    state = [j + ending for ending in (".q", ".qd") for j in joints]

    def run(k: int = 0, change: float = 0) -> Slave:
        slave = instance(fmu).initialize(start={**TIGHT, "solver.method": method})
        for i, joint in enumerate(joints):
            assert slave.set(joint + ".tau", torques[i] + change * (i == k)) == OK
        assert slave.step(0, 0.01) == OK
        return slave

    B = jacobian(run(), "b")
    for k in range(6):
        step = 1e-3 * (1 if k < 3 else 1e-2)
        moved = [np.array(run(k, e * step).reals(state)) for e in (-2, -1, 1, 2)]
        difference = (moved[0] - 8 * moved[1] + 8 * moved[2] - moved[3]) / (12 * step)
        assert np.abs(B[:, k] - difference).max() < 1e-7 * np.abs(B[:, k]).max()


@pytest.mark.parametrize("model", ["four_bar", "rolling_ball"])
def test_reading_it_does_not_change_the_run(built, instance, model):
    fmu = built(with_groups(model, '"acceleration", "energy", "solver", "step_jacobian"'))
    others = [n for n in fmu.named("output") if not n.startswith("step_jacobian") and fmu.variables[n][0] == "Real"]

    def run(read: bool) -> list[float]:
        slave, found = instance(fmu).initialize(), []
        for k in range(20):
            assert slave.step(k * 0.01, 0.01) == OK
            if read:
                jacobian(slave)
            found += slave.reals(others)
        return found

    assert run(False) == run(True)


def test_saved_states_contain_the_last_step(built, instance):
    fmu = built(with_groups("four_bar"))
    slave = instance(fmu).initialize()
    assert slave.step(0, 0.01) == OK
    saved = slave.save()
    expected = jacobian(slave)
    assert slave.step(0.01, 0.02) == OK and not np.array_equal(jacobian(slave), expected)
    assert slave.call("SetFMUstate", saved) == OK
    assert np.array_equal(jacobian(slave), expected)


def test_without_a_step_it_is_the_identity(built, instance):
    slave = instance(built(OSCILLATOR)).initialize()
    assert np.array_equal(jacobian(slave), np.eye(2)) and not jacobian(slave, "b").any()
    assert slave.step(0, 0.1) == OK and not np.array_equal(jacobian(slave), np.eye(2))
    assert slave.call("Reset") == OK
    slave.initialize()
    assert np.array_equal(jacobian(slave), np.eye(2))


@pytest.mark.parametrize("read", [False, True])
def test_after_an_empty_step_it_is_the_identity(built, instance, read):
    slave = instance(built(OSCILLATOR)).initialize()
    assert slave.step(0, 0.1) == OK
    if read:
        jacobian(slave)
    assert slave.set("cart.mass", 3.0) == OK and slave.step(0.1, 0) == OK
    assert np.array_equal(jacobian(slave), np.eye(2)) and not jacobian(slave, "b").any() and not jacobian(slave, "c").any()
    assert slave.step(0.1, 0.1) == OK and not np.array_equal(jacobian(slave), np.eye(2))


def test_within_a_step_it_is_refused(built3):
    """In a callback of FMI 3.0; after the step it is that of the whole step."""
    fmu, statuses = built3(OSCILLATOR), []
    names = [f"step_jacobian.a[{i},{j}]" for i in (1, 2) for j in (1, 2)]

    def read(*_) -> None:
        statuses.append(slave.call("GetFloat64", fmu.references(names), count(4), array(c.c_double, [0.0] * 4), count(4)))

    expected = expm(0.3 * np.array([[0, 1], [-25, -1.5]])).ravel()
    with Slave3(fmu, update=read) as slave:
        slave.initialize(TIGHT)
        for k in range(2):
            slave.run(k, k + 1, 0.3)
            assert np.abs(np.array(slave.get(names)) - expected).max() < 1e-10
        assert set(statuses) == {ERROR}
        assert all("the communication step has not ended" in text for text in slave.errors)


@pytest.mark.parametrize("restore", [False, True])
def test_it_belongs_to_the_parameters_of_the_step(built, instance, restore):
    """Also if they change before it is read, and in a saved state."""
    fmu = built(OSCILLATOR)
    slave, other = instance(fmu).initialize(), instance(fmu).initialize(start={"cart.mass": 5.0})
    for k, mass in enumerate((2.0, 3.0)):
        assert slave.set("cart.mass", mass) == OK and slave.step(0.1 * k, 0.1) == OK
        saved = slave.save()
        expected = [jacobian(slave, part) for part in "abc"]
        assert slave.call("SetFMUstate", saved) == OK and slave.set("cart.mass", 4.0) == OK
        slave.reals(["slide.qdd"])  # the change takes effect
        reader = slave
        if restore:
            reader = other
            status, state = other.deserialize(slave.serialize(slave.save()))
            assert status == OK and other.call("SetFMUstate", state) == OK
        for part, matrix in zip("abc", expected, strict=True):
            assert np.array_equal(jacobian(reader, part), matrix)


@pytest.mark.parametrize(("start", "size"), [(1e3, 1e-12), (1e6, 1e-9)])
def test_a_step_of_a_few_rounding_errors_of_the_time(built, instance, start, size):
    """The current of a motor has no effect on the motion yet."""
    motor = '[[actuator]]\njoint = "slide"\nresistance = 1\ntorque_constant = 0.05\ninductance = 0.001\n[fmu]'
    slave = instance(built(OSCILLATOR.replace("[fmu]", motor)))
    assert slave.setup(start=start) == OK
    for function in ("EnterInitializationMode", "ExitInitializationMode"):
        assert slave.call(function) == OK, slave.errors
    assert slave.step(start, 0.01) == OK and slave.step(start + 0.01, size) == OK
    assert np.abs(jacobian(slave) - np.eye(3)).max() < 2e3 * size and np.abs(jacobian(slave, "b")).max() < 2e3 * size


@pytest.mark.parametrize("group", ["step_jacobian", "parameter_jacobian"])
def test_motions_without_derivatives_are_refused(tmp_path, group):
    walking = with_groups("redysim_biped", f'"{group}"')
    for table in (ROOT / "models").glob("redysim_biped*.csv"):
        (tmp_path / table.name).write_bytes(table.read_bytes())
    sampled = f'{SAMPLED}[fmu]\noutputs = ["{group}"]\n'
    for text, why in ((walking, 'contacts with law = "redysim"'), (sampled, "a sampled controller")):
        (tmp_path / "m.toml").write_text(text)
        done = command("check", tmp_path / "m.toml")
        assert done.returncode != 0 and f"'{group}' does not exist with {why}" in done.stderr


@pytest.mark.parametrize(("model", "scene"), [("double_pendulum", "double_pendulum"), ("kuka_kr5", "kr5_freefall")])
def test_heyoka_integrates_the_same_variational_equations(built, instance, monkeypatch, model, scene):
    """Taylor's method on symbolic equations of the same mechanism."""
    hy = pytest.importorskip("heyoka")
    monkeypatch.syspath_prepend(str(ROOT / "bench" / "peers"))
    import scenes
    import symbolic

    data = scenes.read(ROOT / "tests" / "scenes" / f"{scene}.json")
    variables = np.array(hy.make_vars(*(f"{name}{i}" for name in "qw" for i in range(data.joints))), dtype=object)
    q, qd = variables.reshape(2, -1)
    equations = list(zip(variables, [*qd, *symbolic.Tree(data, q, qd, hy.sin, hy.cos).accelerations()], strict=True))
    start = [*data.data["initial"]["q"], *data.data["initial"]["qd"]]
    taylor = hy.taylor_adaptive(hy.var_ode_sys(equations, hy.var_args.vars, order=1), start, tol=1e-16, compact_mode=True)
    taylor.propagate_until(0.2)
    expected = taylor.state[len(start) :].reshape(len(start), -1)
    (A,) = after(instance(built(with_groups(model))).initialize(start=TIGHT), 0.2)
    assert np.abs(A - expected).max() < 1e-9 * np.abs(expected).max()


BOUNCE = """
name = "bounce"
gravity = [0, 0, -9.81]

[[link]]
name = "ball"
joint = "prismatic"
joint_name = "z"
mass = 1.0
q = 0.1

[[contact]]
name = "floor"
link_a = "ball"
shape_a = "points"
points_a = [[0, 0, 0]]
stiffness = 1e5

[fmu]
outputs = ["step_jacobian"]
"""


@pytest.mark.parametrize("method", ["erk", "auto"])
def test_a_bounce_within_a_step_counts(built, instance, method):
    """The contact lasts from 0.14 to 0.15 s: neither the ends of the step nor its neighbourhood show it."""
    fmu = built(BOUNCE)
    start = {**TIGHT, "solver.method": method}

    def end(**change: float) -> np.ndarray:
        slave = instance(fmu).initialize(start={**start, **{f"z.{name}": value for name, value in change.items()}})
        assert slave.step(0, 0.25) == OK, slave.errors
        return np.array(slave.reals(["z.q", "z.qd"]))

    slave = instance(fmu).initialize(start=start)
    (A,) = after(slave, 0.25)
    for column, (name, at) in enumerate([("q0", 0.1), ("qd0", 0.0)]):
        moved = [end(**{name: at + e * 1e-5}) for e in (-2, -1, 1, 2)]
        difference = (moved[0] - 8 * moved[1] + 8 * moved[2] - moved[3]) / 12e-5
        assert np.abs(A[:, column] - difference).max() < 1e-6 * np.abs(A).max()


@pytest.mark.parametrize("model", ["kuka_kr5", "four_bar"])
def test_columns_that_are_read_together_or_apart(built, instance, model):
    """By inputs only what is read is computed; both orders give the same derivatives within the tolerance."""
    fmu = built(with_groups(model))
    names = [name for name in fmu.named("output") if name.startswith("step_jacobian.")]
    together, apart = (instance(fmu).initialize(start=TIGHT) for _ in range(2))
    for slave in (together, apart):
        assert slave.step(0, 0.01) == OK
    expected = np.array(together.reals(names))
    found = np.concatenate([jacobian(apart, part).ravel() for part in "ab"])
    assert np.abs(found - expected).max() < 1e-10 * np.abs(expected).max()
