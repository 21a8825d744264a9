"""The description: valid, and of one mind with the library."""

from __future__ import annotations

import pytest

from tests.fmi.raw import OK, Slave

MODELS = ("pendulum", "double_pendulum", "gripper", "kuka_kr5", "scara", "cart", "gripper_pd", "leg")


@pytest.mark.parametrize("name", MODELS)
def test_fmpy_finds_no_problem(fmu_file, name):
    from fmpy.validation import validate_fmu

    assert validate_fmu(str(fmu_file(name))) == []


@pytest.mark.parametrize("name", MODELS)
def test_value_references_are_dense_and_every_variable_can_be_read(fmu, name):
    with Slave(fmu(name)) as slave:
        slave.initialize()
        used = [reference for _, reference in slave.fmu.variables.values()]
        assert used == list(range(1, len(used) + 1))
        for variable in slave.fmu.variables:
            assert slave.try_get(variable)[0] == OK


def test_names_are_those_of_the_model(fmu):
    cart = fmu("cart")
    assert cart.named("input") == ["rail.tau", "hinge.tau"]  # idle has no drive, tip does not move
    assert cart.named("output", ".q") == ["rail.q", "hinge.q", "idle.q"]
    assert {"pole.mass", "pole.com[1]", "pole.inertia[4]", "tip.mass", "gravity[2]"} <= set(cart.named("parameter"))
    assert "time" not in cart.variables


def test_outputs_depend_on_what_acts_on_them(fmu):
    outputs = fmu("cart").dependencies("Outputs")
    assert outputs["hinge.q"] == outputs["hinge.qd"] == outputs["energy.total"] == set()
    assert outputs["hinge.qdd"] == {"rail.tau", "hinge.tau"}
    assert outputs["idle.qdd"] == set()


def test_initial_unknowns_depend_on_start_values_and_parameters(fmu):
    unknowns = fmu("cart").dependencies("InitialUnknowns")
    assert set(unknowns) == {*fmu("cart").named("output"), *fmu("cart").named("local")}
    assert unknowns["hinge.q"] == {"hinge.q0"} and unknowns["hinge.qd"] == {"hinge.qd0"}
    assert unknowns["idle.qdd"] == {"idle.q0", "idle.qd0", "idle.mass", "gravity[2]"}
    assert {"rail.tau", "rail.q0", "hinge.qd0", "pole.mass", "tip.mass", "hinge.rest"} <= unknowns["hinge.qdd"]
    assert "idle.mass" not in unknowns["hinge.qdd"]
    assert unknowns["energy.kinetic"] >= {"hinge.q0", "hinge.qd0", "pole.inertia[4]"}
    assert "gravity[2]" not in unknowns["energy.kinetic"] and "gravity[2]" in unknowns["energy.potential"]
    assert unknowns["energy.work"] == unknowns["energy.balance"] == set()


def test_declared_independence_is_true(fmu):
    """No output may change with a known that its row does not name."""
    unknowns = fmu("cart").dependencies("InitialUnknowns")
    outputs = [name for name in unknowns if not name.startswith("solver.")]
    with Slave(fmu("cart")) as slave:
        assert slave.call("EnterInitializationMode") == OK
        # nothing at rest or unloaded that would hide a dependence
        knowns = {
            name: slave.get(name) + 0.01
            for name in slave.fmu.named("input") + slave.fmu.named("parameter")
            if not name.startswith("solver.")
        }
        for name, value in knowns.items():
            assert slave.set(name, value) == OK, slave.errors
        before = dict(zip(outputs, slave.reals(outputs), strict=True))
        for known, value in knowns.items():
            assert slave.set(known, value + 0.001) == OK, slave.errors
            for output, now in zip(outputs, slave.reals(outputs), strict=True):
                assert now == before[output] or known in unknowns[output], f"{output} depends on {known}"
            assert slave.set(known, value) == OK
