"""Identification: the regressor against finite changes of the parameters, base parameters in closed form, statistics of noisy runs."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

import build_fmu as rds
from build_fmu.errors import UserError
from build_fmu.identify.base import base_of, estimate
from build_fmu.identify.consistent import inner
from build_fmu.identify.design import design, limits_of
from build_fmu.identify.filtering import low_pass
from build_fmu.identify.parameters import body_of, inertial_vector, pseudo_inertia, symmetric, vector_of
from build_fmu.identify.run import Run, arbitrary, equations, identify

DOUBLE = """
name = "double"  # two links
gravity = [9.81, 0, 0]
[[link]]
name = "upper"
mass = 2   # kg
com = [0.5, 0.1, 0]
inertia = [0.1, 0.1, 0.2]
[[link]]
name = "lower"
a = 1
mass = 1.5
com = [0.4, 0, 0]
inertia = [0.1, 0.1, 0.2]
damping = 0.3
friction = 0.5
static_friction = 0.7
armature = 0.05
"""


LOCKED = """
name = "locked"
gravity = [0, -9.81, 0]
[[link]]
name = "arm"
mass = 1
com = [1, 0, 0]
[[link]]
name = "tip"
drive = "locked"
a = 1
mass = 1
com = [1, 0, 0]
"""


def test_regressor_uses_the_start_positions_of_locked_joints(model):
    """The tip points up: both masses are at 1 m."""
    m = model(LOCKED)
    m.parameters = {"tip.q0": np.pi / 2, "solver.method": "erk"}
    torques, columns = m.plant().equations([[0]], [[0]], [[0]])
    assert torques[0] == pytest.approx([2 * 9.81]) == m.inverse([0], [0], [0])
    assert columns[0] @ m.plant().start() == pytest.approx(torques[0])


def test_a_plant_survives_its_model(model):
    m = model(DOUBLE)
    plant, row = m.plant(), [[0.1, 0.2]]
    before = plant.equations(row, row, row)[0]
    m.close()
    assert (plant.equations(row, row, row)[0] == before).all()


def test_nearly_singular_bodies_are_found(model):
    """The path to them leads along the limit of possible bodies; noise of 1e-5 of the torques."""
    random, data = np.random.default_rng(0), Path(__file__).parent / "data"
    before, true = (model((data / f"flat_{name}.toml").read_text()) for name in ("start", "true"))
    motion = random.uniform(-1, 1, (3, 400, len(before.plant().joints)))
    exact = true.inverse(*motion)
    noise = 1e-5 * np.sqrt(np.mean(exact**2, axis=0))
    found = before.identify(np.arange(400) * 0.01, motion[0], exact + noise * random.normal(size=exact.shape), *motion[1:])
    assert (found.after < 1.2 * noise).all() and not found.warnings


UNITS = [1e-6, 1e-3, 1.0, 1e3]


def in_units(S, gravity, mass=1.0):
    """An arm with a sliding joint, of length S (m) and density 1; `mass` is a factor of all masses and losses."""
    m = mass * S**3
    inertia = [x * m * S**2 for x in (0.1, 0.12, 0.2)]
    return f"""
name = "arm"
gravity = [{gravity}, 0, 0]
[[link]]
name = "upper"
mass = {2 * m}
com = [{0.5 * S}, {0.1 * S}, 0]
inertia = {inertia}
damping = {0.3 * m * S**2}
[[link]]
name = "slide"
joint = "prismatic"
alpha = 1.2
a = {S}
mass = {1.5 * m}
com = [{0.4 * S}, 0, {0.2 * S}]
inertia = {inertia}
damping = {0.2 * m}
friction_velocity = {0.01 * S}
[[link]]
name = "hand"
alpha = 0.7
d = {0.3 * S}
mass = {m}
com = [{0.2 * S}, {-0.1 * S}, {0.1 * S}]
inertia = {inertia}
armature = {0.01 * m * S**2}
friction = {0.1 * m * S**2}
"""


def motion(times, n, seed=3):
    """Fourier series with velocities and accelerations."""
    random, w = np.random.default_rng(seed), 2 * np.pi * 0.1 * np.arange(1, 6)
    a, b = random.normal(size=(2, 5, n)) / 5
    phase = np.outer(times, w)
    q = np.sin(phase) @ a + np.cos(phase) @ b
    return q, np.cos(phase) * w @ a - np.sin(phase) * w @ b, -(np.sin(phase) * w**2) @ a - np.cos(phase) * w**2 @ b


def numbers(plant):
    """Changes of each number of the model file, and the values that change with it."""
    for name, value in plant.values.items():
        what = name.rpartition(".")[2]
        if what == "friction":
            yield {
                name: value + 0.1,
                name.replace("friction", "static_friction"): plant.values[name.replace(what, "static_friction")] + 0.1,
            }
        elif what.startswith("inertia"):
            link = name.rpartition(".")[0]
            yield {name: value + 0.01 * min(plant.values[f"{link}.inertia[{k}]"] for k in (1, 2, 3))}
        elif what not in ("static_friction", "friction_velocity"):
            yield {name: value + 0.1}


@pytest.mark.parametrize("name", ["kuka_kr5", "scara", "rp_robot", DOUBLE])
def test_regressor_is_the_change_of_the_torques_with_the_parameters(model, name):
    plant = model(name).plant()
    changed = model(name, tunable=list(plant.values))
    random = np.random.default_rng(1)
    q, qd, qdd = random.normal(size=(3, 5, len(plant.joints)))
    torques, W = plant.equations(q, qd, qdd)
    for change in numbers(plant):
        changed.parameters = change
        pi = replace(plant, values={**plant.values, **change}).start()
        expected = changed.inverse(q, qd, qdd) - torques
        assert abs(W @ (pi - plant.start()) - expected).max() <= 2e-13 * max(abs(torques).max(), 1), change


def test_regressor_times_parameters_is_the_inverse_dynamics(model):
    m = model("kuka_kr5")
    plant, rows = m.plant(), np.random.default_rng(2).normal(size=(3, 50, 6))
    torques, W = plant.equations(*rows)
    assert abs(W @ plant.start() - m.inverse(*rows)).max() <= 1e-13 * abs(torques).max()


def test_base_parameters_of_a_planar_arm_are_those_of_the_textbook(model):
    plant = model(DOUBLE).plant()
    base = base_of(arbitrary(plant), plant.names, plant.chosen(()))
    expected = {
        "upper.mx": {"upper.mx": 1, "lower.m": 1},
        "upper.my": {"upper.my": 1},
        "upper.Izz": {"upper.Izz": 1, "upper.armature": 1, "lower.m": 1},
        "lower.mx": {"lower.mx": 1},
        "lower.my": {"lower.my": 1},
        "lower.Izz": {"lower.Izz": 1},
        **{name: {name: 1} for name in plant.losses if name != "upper.armature"},
    }
    found = {plant.names[k]: row for k, row in zip(base.independent, base.combine, strict=True)}
    assert found.keys() == expected.keys()
    for name, row in found.items():
        assert {plant.names[k]: pytest.approx(row[k], abs=1e-12) for k in np.flatnonzero(row)} == expected[name]
    # 36 inertial base parameters of an arm with six revolute joints, and of 18 losses all but the armatures of the first two joints
    plant = model("kuka_kr5").plant()
    base = base_of(arbitrary(plant), plant.names, plant.chosen(()))
    assert len(base.names) == 36 + 16


@pytest.mark.parametrize("S", UNITS)
def test_base_parameters_do_not_depend_on_the_unit_of_length(model, S):
    bases = []
    for text in (in_units(S, 9.81), in_units(1.0, 9.81)):
        plant = model(text).plant()
        bases.append(base_of(arbitrary(plant), plant.names, plant.chosen(())))
    assert bases[0].independent.tolist() == bases[1].independent.tolist()
    assert ((bases[0].combine != 0) == (bases[1].combine != 0)).all()


@pytest.mark.parametrize("S", UNITS)
def test_identified_file_does_not_depend_on_the_unit_of_length(model, tmp_path, S):
    times = np.arange(0, 10, 0.04)
    rows = [part * [1, S, 1] for part in motion(times, 3)]
    guess, truth = model(in_units(S, 9.81 * S)), model(in_units(S, 9.81 * S, mass=2))
    torques = truth.inverse(*rows)
    sizes = np.sqrt(np.mean(torques**2, axis=0))
    noise = 1e-6 * sizes * np.random.default_rng(10).normal(size=torques.shape)
    result = guess.identify(times, rows[0], torques + noise, *rows[1:])
    assert not [line for line in result.warnings if "poor excitation" not in line]
    assert result.noise / sizes == pytest.approx(1e-6, rel=0.2)
    assert (abs(result.values - result.base.combine @ truth.plant().start()) <= 5 * result.errors).all()
    result.write(tmp_path / "found.toml", guess.file)
    left = model((tmp_path / "found.toml").read_text()).inverse(*rows) - torques
    assert (abs(left).max(axis=0) <= 2e-6 * sizes).all()


def test_designed_motion_does_not_depend_on_the_unit_of_length(model):
    found = []
    for S in UNITS:
        plant, ends = model(in_units(S, 9.81 * S)).plant(), np.array([1, S, 1])
        found.append(design(plant, limits_of(plant, -ends, ends, ends), 10, 0.1, rounds=20).condition)
    assert found == pytest.approx([found[-1]] * len(UNITS), rel=1e-6)


def test_possible_bodies_are_found(model):
    # a link that is 20 times as heavy as in the file, with small noise
    times = np.arange(0, 10, 0.04)
    rows = motion(times, 2)
    truth = DOUBLE.replace("mass = 1.5", "mass = 30").replace("[0.4, 0, 0]", "[0.1, 0.3, 0.2]").replace("armature = 0.05", "armature = 0")
    torques = model(truth).inverse(*rows)
    torques += 1e-8 * np.sqrt(np.mean(torques**2, axis=0)) * np.random.default_rng(11).normal(size=torques.shape)
    result = model(DOUBLE).identify(times, rows[0], torques, *rows[1:])
    assert not [line for line in result.warnings if "consistent" in line]
    assert result.after == pytest.approx(result.noise, rel=0.1)


def test_data_of_a_textbook_arm_give_its_parameters(model):
    # Lagrange's equations of two point masses at the ends of massless rods, damping at the elbow
    m1, m2, l1, l2, damping = 1.2, 0.8, 1.0, 0.7, 0.4
    times = np.arange(0, 10, 0.02)
    q, qd, qdd = motion(times, 2)
    c, s = np.cos(q[:, 1]), np.sin(q[:, 1])
    M11 = m1 * l1**2 + m2 * (l1**2 + l2**2 + 2 * l1 * l2 * c)
    M12 = m2 * (l2**2 + l1 * l2 * c)
    g1, g2 = 9.81 * l1 * np.sin(q[:, 0]), 9.81 * l2 * np.sin(q.sum(axis=1))
    first = M11 * qdd[:, 0] + M12 * qdd[:, 1] - m2 * l1 * l2 * s * (2 * qd[:, 0] + qd[:, 1]) * qd[:, 1] + (m1 + m2) * g1 + m2 * g2
    second = M12 * qdd[:, 0] + m2 * l2**2 * qdd[:, 1] + m2 * l1 * l2 * s * qd[:, 0] ** 2 + m2 * g2 + damping * qd[:, 1]
    torques = np.column_stack([first, second])
    result = model(DOUBLE.replace("static_friction = 0.7", "")).identify(times, q, torques, qd, qdd)
    values = dict(zip((n.split(" ")[0] for n in result.names), result.values, strict=True))
    expected = {
        "upper.mx": (m1 + m2) * l1,
        "upper.Izz": (m1 + m2) * l1**2,
        "lower.mx": m2 * l2,
        "lower.Izz": m2 * l2**2,
        "lower.damping": damping,
    }
    for name, value in values.items():
        assert value == pytest.approx(expected.get(name, 0), abs=1e-9)
    # an exact point mass is the limit of the possible bodies
    assert result.warnings == [] and (result.after < 1e-3 * result.before).all()


@pytest.fixture(scope="module")
def noisy(model):
    """A run of the KR5 of 10 s: plant, rows and standard deviations of the noise."""
    m = model("kuka_kr5")
    times = np.arange(0, 10, 0.04)
    q, qd, qdd = motion(times, 6)
    return m, Run(times, q, m.inverse(q, qd, qdd), qd, qdd), np.array([0.5, 1.5, 0.3, 0.02, 0.02, 0.005])


@pytest.mark.parametrize("count", [20, pytest.param(100, marks=pytest.mark.slow)])
def test_base_parameters_of_noisy_runs_are_within_3_standard_errors(noisy, count):
    m, run, noise = noisy
    plant, random = m.plant(), np.random.default_rng(4)
    base = base_of(arbitrary(plant), plant.names, plant.chosen(()))
    columns = equations(plant, run, None)[0][:, :, base.independent]
    draws = [estimate(columns, random.normal(size=run.q.shape) * noise, noise) for _ in range(count)]
    inside = np.array([abs(draw.change) <= 3 * draw.errors for draw in draws])
    # normally distributed: 99.7 % of the values
    assert inside.mean() >= 0.99 and inside.mean(axis=0).min() >= (0.95 if count == 100 else 0.9)
    within_one = np.mean([abs(draw.change) <= draw.errors for draw in draws])
    assert within_one == pytest.approx(0.683, abs=0.03)
    assert np.mean([draw.noise for draw in draws], axis=0) == pytest.approx(noise, rel=0.03)


def test_identified_file_reproduces_the_run(noisy, tmp_path):
    m, run, noise = noisy
    run = replace(run, torques=run.torques + np.random.default_rng(5).normal(size=run.q.shape) * noise)
    # start from other parameters
    text = m.file.read_text().replace("mass = 12.973", "mass = 10  # guess").replace("[-3.3e-5, 0.007634, -0.109372]", "[0, 0, -0.05]")
    (tmp_path / "wrong.toml").write_text(text)
    with rds.load(tmp_path / "wrong.toml") as wrong:
        plant = wrong.plant()
        result = identify(plant, run)
        result.write(tmp_path / "right.toml", wrong.file)
    assert result.warnings == [] and result.before.max() > 10
    truth = result.base.combine @ m.plant().start()
    assert (abs(result.values - truth) <= 4 * result.errors).all()
    with rds.load(tmp_path / "right.toml") as right:
        left = equations(right.plant(), run, None)[2]
        assert left == pytest.approx(result.after, rel=1e-6) and left == pytest.approx(noise, rel=0.1)
        assert right.description.warnings == []
        for link in right.plant().links:
            assert np.linalg.eigvalsh(pseudo_inertia(inertial_vector(*right.plant().body(link)))).min() > 0
    written = (tmp_path / "right.toml").read_text()
    assert "# guess" in written and "# Without friction the motion is chaotic" in written and "[report]" not in written


def test_positions_alone_are_differentiated_without_phase(model):
    m = model("kuka_kr5")
    random, times = np.random.default_rng(6), np.arange(0, 10, 0.002)
    q, qd, qdd = motion(times, 6)
    rows = slice(None, None, 10)
    coarse = m.inverse(q[rows], qd[rows], qdd[rows])
    torques = np.column_stack([np.interp(times, times[rows], column) for column in coarse.T])
    noise = 0.02 * np.sqrt(np.mean(torques**2, axis=0)) + 0.01
    result = m.identify(times, q + 1e-5 * random.normal(size=q.shape), torques + noise * random.normal(size=q.shape))
    truth = result.base.combine @ m.plant().start()
    assert (abs(result.values - truth) <= 4 * result.errors).all()
    assert "filter" in result.method


def test_filtered_friction_is_that_of_the_model(model):
    # Coulomb friction jumps where the joint turns back: motion, torques and regressor must pass the same filter
    m, times = model(DOUBLE), np.arange(0, 10, 0.002)
    q, qd, qdd = motion(times, 2)
    torques = m.inverse(q, qd, qdd)
    result = m.identify(times, q, torques)
    assert result.values == pytest.approx(result.start, abs=1e-3)
    assert (result.after < 5e-3 * np.sqrt(np.mean(torques**2, axis=0))).all()


def test_filter_has_no_phase_and_keeps_slow_signals():
    times = np.arange(0, 20, 0.01)
    signal = np.sin(2 * np.pi * 0.5 * times) + 0.3 * times
    inner_rows = slice(300, -300)
    for derivative, exact in enumerate(
        (signal, np.pi * np.cos(np.pi * times) + 0.3, -(np.pi**2) * np.sin(np.pi * times)),
    ):
        assert low_pass(signal, 0.01, 10.0, derivative)[inner_rows] == pytest.approx(exact[inner_rows], abs=3e-6 * np.pi**derivative)
    fast = low_pass(np.sin(2 * np.pi * 20 * times), 0.01, 10.0)[inner_rows]
    assert np.sqrt(2 * np.mean(fast**2)) == pytest.approx(1 / (1 + 2**6), rel=0.01)


def test_bodies_survive_the_conversion():
    random = np.random.default_rng(7)
    A = random.normal(size=(3, 3))
    second = A @ A.T
    body = (2.5, random.normal(size=3), np.trace(second) * np.eye(3) - second)
    vector = inertial_vector(*body)
    assert vector_of(pseudo_inertia(vector)) == pytest.approx(vector)
    for part, expected in zip(body_of(vector), body, strict=True):
        assert part == pytest.approx(expected)
    factor = inner(vector, 1.0)
    assert factor @ factor.T == pytest.approx(pseudo_inertia(vector))
    # a point mass becomes a small body around the same center
    factor = inner(inertial_vector(2.0, np.array([1.0, 0, 0]), symmetric([0] * 6)), 1.0)
    assert np.linalg.eigvalsh(factor @ factor.T).min() > 0


def test_poor_runs_are_reported(model):
    m = model(DOUBLE)
    times = np.arange(0, 10, 0.02)
    q, qd, qdd = motion(times, 2)
    still = [np.column_stack([part[:, 0], 0 * part[:, 1]]) for part in (q, qd, qdd)]
    noise = 0.01 * np.random.default_rng(8).normal(size=q.shape)
    result = m.identify(times, still[0], m.inverse(*still) + noise, still[1], still[2])
    assert result.warnings[0].startswith("poor excitation: the run does not determine ") and np.isinf(result.errors).any()
    # an effect that the model does not have
    extra = noise + 0.5 * np.sin(3 * q)
    result = m.identify(times, q, m.inverse(q, qd, qdd) + extra, qd, qdd)
    assert "the model lacks an effect" in result.warnings[-1]
    # torques that only a negative mass explains
    result = m.identify(times, q, -m.inverse(q, qd, qdd) + noise, qd, qdd)
    assert any(line.startswith("no physically consistent parameters agree") for line in result.warnings)


def test_parameters_and_drives_of_the_model_are_known(model):
    m = model("kuka_kr5")
    rows = np.random.default_rng(9).normal(size=(3, 4, 6))
    torques = m.plant().equations(*rows)[0]
    m.parameters = {"link6.mass": 2.0, "joint1.damping": 3.0}
    try:
        plant = m.plant()
        heavy, W = plant.equations(*rows)
        assert heavy == pytest.approx(m.inverse(*rows), abs=1e-12) and abs(heavy - torques).max() > 1
        assert abs(W @ plant.start() - heavy).max() < 1e-12 * abs(heavy).max()
    finally:
        m.parameters = {}
    # controllers and their gains are no part of the plant
    assert model("kuka_kr5_computed_torque").plant().equations(*rows)[0] == pytest.approx(torques, abs=1e-12)
    # elastic gears: the torque on the joint is measured; the speed limit of the motor is one of the joint
    plant = model("kuka_kr5_harmonic").plant()
    assert plant.torques[0] == "joint1.tau_joint" and "joint1.damping" in plant.losses and "joint1.armature" not in plant.losses
    assert plant.values["joint1.speed_limit"] > 0


def test_unsuitable_models_and_runs_are_refused(model):
    with pytest.raises(UserError, match="supports open trees only, and 'closure' is one of the loops"):
        model("four_bar").plant()
    with pytest.raises(UserError, match="requires driven joints, but no input of the inverse model prescribes the motion of 'trunk'"):
        model("quadruped").plant()
    with pytest.raises(UserError, match="prescribes the motion of 'base'"):
        model("redysim_quadruped").plant()
    m = model(DOUBLE)
    times = np.arange(0, 10, 0.02)
    q, qd, qdd = motion(times, 2)
    with pytest.raises(UserError, match=r"unknown link or parameter of a joint 'lowr'; did you mean 'lower'\?"):
        m.identify(times, q, q, qd, qdd, ["lowr"])
    with pytest.raises(UserError, match="derivatives require equal time steps, but the step at t = 1 s is"):
        m.identify(np.where(times > 1.01, times + 0.01, times), q, q)
    with pytest.raises(UserError, match="the run is too short for a filter of 10 Hz"):
        m.identify(times[:10], q[:10], q[:10])
    with pytest.raises(UserError, match="too few for 11 base parameters"):
        m.identify(times[:5], q[:5], q[:5], qd[:5], qdd[:5])
    with pytest.raises(UserError, match=r"'tau' must be finite and have the shape \(rows, 2\)"):
        m.identify(times, q, q[:, :1])


def test_design_stays_within_limits_and_starts_at_rest(model):
    m = model(DOUBLE)
    found = m.design([-1, -2], [1, 0.5], [1, 3], duration=10, parameters=["upper", "lower"])
    assert (found.q.min(axis=0) >= [-1, -2]).all() and (found.q.max(axis=0) <= [1, 0.5]).all()
    assert (abs(found.qd).max(axis=0) <= [1, 3]).all()
    for part in (found.qd, found.qdd):
        assert abs(part[[0, -1]]).max() < 1e-12 * abs(part).max()
    assert np.gradient(found.q, found.time, axis=0)[1:-1] == pytest.approx(found.qd[1:-1], abs=1e-3)
    # better than the best of many random ones
    assert found.condition < 6
    result = m.identify(found.time, found.q, found.torques, found.qd, found.qdd, ["upper", "lower"])
    assert result.condition < 10
