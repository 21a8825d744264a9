"""The published scenes through the FMU: 16-digit references made without any of our algorithms."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from tests.fmi.raw import OK, Slave

SCENES = Path(__file__).resolve().parents[1] / "scenes"
RANDOM_STATES = {
    "double_pendulum": "double_pendulum",
    "gripper": "gripper_freefall",
    "gripper_redysim": "gripper_redysim_freefall",
    "kuka_kr5": "kr5_freefall",
}
TRAJECTORIES = {"pendulum": "simple_pendulum", **RANDOM_STATES}


def columns(table: np.ndarray, letter: str) -> np.ndarray:
    names = [name for name in table.dtype.names if name.rstrip("0123456789") == letter]
    return np.stack([table[name] for name in names], axis=1)


def read(path: Path) -> np.ndarray:
    return np.genfromtxt(path, delimiter=",", names=True)


@pytest.mark.parametrize("model", RANDOM_STATES)
def test_accelerations_of_random_states(fmu, model):
    table = read(SCENES / f"{RANDOM_STATES[model]}_fd.csv")
    with Slave(fmu(model)) as slave:
        names = {
            ending: slave.fmu.named(causality, f".{ending}")
            for ending, causality in (("q0", "parameter"), ("qd0", "parameter"), ("tau", "input"), ("qdd", "output"))
        }
        for q, qd, tau, expected in zip(*(columns(table, letter) for letter in ("q", "qd", "tau", "qdd")), strict=True):
            assert slave.call("EnterInitializationMode") == OK
            for ending, values in (("q0", q), ("qd0", qd), ("tau", tau)):
                assert slave.set_reals(names[ending], values) == OK
            assert slave.call("ExitInitializationMode") == OK, slave.errors
            error = np.abs(slave.reals(names["qdd"]) - expected).max() / np.abs(expected).max()
            assert error < 1e-12
            assert slave.call("Reset") == OK


def run_scene(fmu, model: str, method: str) -> tuple[np.ndarray, dict[str, np.ndarray]]:
    """Returns the reference table and what the FMU says at its times, rtol 1e-8."""
    table = read(SCENES / f"{TRAJECTORIES[model]}.csv")
    with Slave(fmu(model)) as slave:
        slave.initialize(start={"solver.method": method, "solver.rtol": 1e-8, "solver.atol": 1e-10})
        names = {key: slave.fmu.named("output", key) for key in (".q", ".qd", "energy.kinetic", "energy.potential", "energy.balance")}
        rows = {key: [] for key in names}
        for k, time in enumerate(table["t"]):
            if k > 0:
                before = table["t"][k - 1]
                assert slave.step(before, time - before) == OK, slave.errors
            for key in names:
                rows[key].append(slave.reals(names[key]))
        return table, {key: np.array(values) for key, values in rows.items()}


@pytest.mark.parametrize("method", ["erk", "adams", "dirk", "bdf", "exponential", "auto"])
@pytest.mark.parametrize("model", TRAJECTORIES)
def test_trajectories(fmu, model, method):
    table, run = run_scene(fmu, model, method)
    assert np.abs(run[".q"] - columns(table, "q")).max() < 1e-5
    rates = columns(table, "qd")
    assert np.abs(run[".qd"] - rates).max() < 1e-5 * np.abs(rates).max()


@pytest.mark.parametrize("method", ["erk", "adams", "dirk", "bdf", "exponential", "auto"])
@pytest.mark.parametrize("model", TRAJECTORIES)
def test_energies(fmu, model, method):
    table, run = run_scene(fmu, model, method)
    scale = table["kinetic"].max()
    assert np.abs(run["energy.balance"]).max() < 3e-6 * scale
    for name in ("kinetic", "potential"):
        assert np.abs(run[f"energy.{name}"][:, 0] - table[name]).max() < 1e-5 * scale


@pytest.mark.parametrize("method", ["erk", "adams", "dirk", "bdf", "exponential", "auto"])
def test_work_of_drives_and_dampers_balances_the_energy(fmu, method):
    with Slave(fmu("cart")) as slave:
        slave.initialize(start={"solver.method": method, "solver.rtol": 1e-9, "solver.atol": 1e-11, "rail.damping": 2.0})
        start = slave.get("energy.total")
        for k in range(200):
            assert slave.set_reals(["rail.tau", "hinge.tau"], [5 * np.sin(0.1 * k), np.cos(0.05 * k)]) == OK
            assert slave.step(k * 0.01, 0.01) == OK
        assert abs(slave.get("energy.work")) > 0.1
        assert slave.get("energy.balance") == pytest.approx(slave.get("energy.total") - slave.get("energy.work") - start, abs=1e-12)
        assert abs(slave.get("energy.balance")) < 1e-6


def test_fmpy_simulates_it(fmu_file):
    from fmpy import simulate_fmu

    result = simulate_fmu(str(fmu_file("kuka_kr5")), stop_time=1, output=["joint2.q"], fmi_call_logger=None)
    assert result["joint2.q"][-1] == pytest.approx(read(SCENES / "kr5_freefall.csv")["q2"][-1], abs=1e-5)
