"""A library compiled for one scene does what the general one does; slow, because it is compiled: run with `pytest -m slow`."""

from __future__ import annotations

import re
import shutil
import subprocess
from concurrent.futures import ThreadPoolExecutor

import numpy as np
import pytest

from build_fmu import native
from build_fmu.errors import UserError
from build_fmu.fmu.build import build, build_for_run
from build_fmu.model.describe import describe
from tests.fmi.raw import OK, Slave, Unpacked

MODELS = native.SOURCE_TREE / "models"
METHODS = ["erk", "adams", "dirk", "bdf", "exponential"]  # of auto


def run(fmu, stop=0.5, **start):
    from fmpy import simulate_fmu

    return simulate_fmu(str(fmu), stop_time=stop, output_interval=0.01, start_values=start)


def simulate(fmu, lines, start):
    from fmpy import simulate_fmu

    return simulate_fmu(
        str(fmu), stop_time=0.5, output_interval=0.01, start_values=start, logger=lambda *given: lines.append(given[-1].decode())
    )


@pytest.mark.slow
@pytest.mark.parametrize(
    "name, parts",
    [
        ("kuka_kr5", ["energies", *METHODS]),
        ("four_bar", ["loops", "energies", *METHODS]),
        ("mimic_hand", ["loops", "friction", "energies", *METHODS]),
        ("governor", ["springs", "energies", *METHODS]),
        ("space_arm", ["motion", "spherical", "control", "energies", *METHODS]),
        ("stick_slip", ["springs", "friction", "motion", "energies", *METHODS]),
        ("stewart_platform", ["loops", "motion", "spherical", "energies", *METHODS]),
    ],
)
def test_a_specialised_library_is_smaller_and_gives_the_same_motion(name, parts, tmp_path):
    if not shutil.which("cmake"):
        pytest.skip("cmake is not installed")
    model = describe(MODELS / f"{name}.toml")
    assert model.features == parts
    general, special = tmp_path / "general.fmu", tmp_path / "special.fmu"
    build(model, MODELS / f"{name}.toml", general)
    built = build(model, MODELS / f"{name}.toml", special, specialised=True)
    # code of loops, optimised for speed, exceeds the parts that are omitted
    assert special.stat().st_size < general.stat().st_size or "loops" in parts
    assert "no straight-line code" not in built.specialised
    assert float(re.search(r"([0-9.]+) times as fast", built.specialised)[1]) > 0
    a, b = (run(fmu, **{"solver.rtol": 1e-9}) for fmu in (general, special))
    for column in a.dtype.names:
        if not column.startswith("solver."):
            assert np.allclose(a[column], b[column], rtol=1e-7, atol=1e-7), column


@pytest.mark.parametrize(
    "name, reason",
    [
        ("parallelogram", "dependent at the start"),
        ("four_bar_chain", "operations is too long"),
        ("bouncing_ball", "without bushings and contacts"),
    ],
)
def test_the_reason_for_no_straight_line_code_is_given(name, reason):
    command = [str(native.describe_program()), "--straight-line", str(MODELS / f"{name}.toml")]
    run = subprocess.run(command, capture_output=True, text=True, check=False)
    assert run.returncode == 1 and reason in run.stderr and not run.stdout


@pytest.mark.slow
def test_a_library_without_energies_takes_its_method_by_name(tmp_path):
    file, special = tmp_path / "arm.toml", tmp_path / "arm.fmu"
    text = (MODELS / "double_pendulum.toml").read_text(encoding="utf-8").replace("[solver]", '[solver]\nmethod = "erk"')
    file.write_text(re.sub(r"(?m)^outputs = .*\n", "", text).replace("[fmu]", "[fmu]\noutputs = []"), encoding="utf-8")
    model = describe(file)
    assert model.features == ["erk"]
    build(model, file, special, specialised=True)
    assert np.array_equal(run(special)["elbow.q"], run(special, **{"solver.method": "erk"})["elbow.q"])
    with pytest.raises(Exception, match="error"):
        run(special, **{"solver.method": "bdf"})


@pytest.mark.slow
def test_a_straight_line_follows_tunable_parameters(tmp_path):
    general, special = tmp_path / "general.fmu", tmp_path / "special.fmu"
    model = describe(MODELS / "kuka_kr5.toml")
    build(model, MODELS / "kuka_kr5.toml", general)
    build(model, MODELS / "kuka_kr5.toml", special, specialised=True)
    start = {"link6.mass": 3.0, "joint2.damping": 20.0}
    assert np.allclose(run(general, **start)["joint2.q"], run(special, **start)["joint2.q"], atol=1e-7)
    assert not np.allclose(run(general)["joint2.q"], run(special, **start)["joint2.q"], atol=1e-3)


@pytest.mark.slow
def test_models_of_one_name_are_compiled_one_after_another(tmp_path):
    text = (MODELS / "double_pendulum.toml").read_text(encoding="utf-8")
    methods = ("erk", "adams")
    targets = [tmp_path / method / "double_pendulum.fmu" for method in methods]
    for method, target in zip(methods, targets, strict=True):
        target.parent.mkdir()
        target.with_suffix(".toml").write_text(text.replace("[solver]", f'[solver]\nmethod = "{method}"'), encoding="utf-8")

    def compiled(target):
        return build(describe(target.with_suffix(".toml")), target.with_suffix(".toml"), target, specialised=True).specialised

    with ThreadPoolExecutor() as pool:
        summaries = list(pool.map(compiled, targets))
    for method, target, summary in zip(methods, targets, summaries, strict=True):
        assert method in summary
        assert run(target)["time"][-1] == 0.5


@pytest.mark.slow
@pytest.mark.parametrize("method", ["auto", "bdf"])
def test_compiled_loops_pass_a_singular_configuration(method, tmp_path, fmu_file):
    special = tmp_path / "special.fmu"
    build(describe(MODELS / "slider_crank.toml"), MODELS / "slider_crank.toml", special, specialised=True)
    start = {"solver.method": method, "solver.rtol": 1e-8}
    a, b = run(special, stop=3, **start), run(fmu_file("slider_crank"), stop=3, **start)
    assert np.allclose(a["crank_joint.q"], b["crank_joint.q"], atol=1e-6)
    assert np.max(np.abs(a["pin.gap"])) < 1e-13
    assert np.max(np.abs(a["energy.balance"])) < 1e-6


@pytest.fixture(scope="module")
def series_model(tmp_path_factory):
    folder = tmp_path_factory.mktemp("taylor")
    file = folder / "pendulum.toml"
    file.write_text(
        (MODELS / "double_pendulum.toml").read_text(encoding="utf-8").replace("[solver]", '[solver]\nmethod = "taylor"'), encoding="utf-8"
    )
    return file


def test_the_general_library_refuses_taylor_and_runs_other_methods(series_model, tmp_path):
    with pytest.raises(UserError, match="method taylor requires --specialise"):
        build(describe(series_model), series_model, tmp_path / "pendulum.fmu")
    fmu = tmp_path / "run.fmu"
    build_for_run(describe(series_model), series_model, fmu)
    lines = []
    with pytest.raises(Exception, match="error"):
        simulate(fmu, lines, {})
    assert any("solver.method 'taylor' requires a library for the model" in line for line in lines)
    assert simulate(fmu, lines, {"solver.method": "auto"})["time"][-1] == 0.5


@pytest.mark.slow
def test_taylor_series_agree_with_runge_kutta(series_model, tmp_path):
    special, general = tmp_path / "special.fmu", tmp_path / "general.fmu"
    model = describe(series_model)
    assert model.features == ["energies", "taylor"]
    build(model, series_model, special, specialised=True)
    build_for_run(model, series_model, general)
    a, b = run(special, **{"solver.rtol": 1e-10}), run(general, **{"solver.method": "erk", "solver.rtol": 1e-12})
    for column in a.dtype.names:
        if not column.startswith("solver."):
            assert np.allclose(a[column], b[column], rtol=1e-7, atol=1e-8), column
    assert a["solver.rhs_evaluations"][-1] < b["solver.rhs_evaluations"][-1]


@pytest.fixture(scope="module")
def own_library(tmp_path_factory):
    """FMU of a small tree with the default method and a library of its own."""
    file, fmu = MODELS / "double_pendulum.toml", tmp_path_factory.mktemp("own") / "own.fmu"
    model = describe(file)
    assert model.features == ["energies", *METHODS, "taylor"]
    build(model, file, fmu, specialised=True)
    return fmu


@pytest.mark.slow
@pytest.mark.parametrize("damping, methods", [(0.0, {6}), (1e5, {3, 4})])  # taylor; dirk, bdf
def test_auto_uses_taylor_series_where_nothing_is_stiff(own_library, fmu_file, damping, methods):
    start = {"shoulder.damping": damping}
    a, b = run(own_library, **start), run(fmu_file("double_pendulum"), **start, **{"solver.method": "dirk", "solver.rtol": 1e-10})
    for column in a.dtype.names:
        if not column.startswith("solver."):
            assert np.allclose(a[column], b[column], rtol=1e-6, atol=1e-6), column
    used = set(a["solver.active"])
    assert used == methods if damping == 0 else used & methods


@pytest.mark.slow
@pytest.mark.parametrize("damping", [0.0, 1e5])
def test_auto_with_taylor_series_restores_bit_for_bit(own_library, damping, tmp_path):
    fmu = Unpacked(own_library, tmp_path)

    def drive(slave, first, last):
        for k in range(first, last):
            if k % 7 == 0:
                slave.set("elbow.tau", float(k % 2))
            assert slave.step(k * 0.013, 0.013) == OK, slave.errors
        return slave.reals(["shoulder.q", "elbow.q", "elbow.qd", "energy.balance"]) + [slave.get("solver.rhs_evaluations")]

    with Slave(fmu) as slave, Slave(fmu) as fresh:
        slave.initialize(start={"shoulder.damping": damping})
        drive(slave, 0, 24)
        content = slave.serialize(slave.save())
        expected = drive(slave, 24, 90)
        status, copy = fresh.deserialize(content)
        assert status == OK and fresh.call("SetFMUstate", copy) == OK
        assert drive(fresh, 24, 90) == expected


def test_taylor_refuses_a_controlled_model(tmp_path):
    if not shutil.which("ninja"):
        pytest.skip("ninja is not installed")
    file = tmp_path / "gripper.toml"
    text = (MODELS / "gripper_pd.toml").read_text(encoding="utf-8")
    file.write_text(text.replace("[solver]", '[solver]\nmethod = "taylor"'), encoding="utf-8")
    with pytest.raises(UserError, match="without controllers and actuators"):
        build(describe(file), file, tmp_path / "gripper.fmu", specialised=True)
