"""Setting and getting: what takes effect when, and what is refused with which sentence."""

from __future__ import annotations

import ctypes as c
import math
import random
import tomllib

import pytest

from tests.crosscheck.random_scenes import draw
from tests.crosscheck.scene_fmu import Library, Refused
from tests.fmi.raw import ERROR, OK, Slave


def test_outputs_in_initialization_mode_follow_the_start_values(fmu):
    with Slave(fmu("cart")) as slave:
        assert slave.call("EnterInitializationMode") == OK
        assert slave.get("hinge.q") == 0.3 and slave.get("hinge.qd") == -1
        first = slave.get("hinge.qdd"), slave.get("energy.kinetic"), slave.get("energy.potential")
        assert slave.set("hinge.q0", 1.2) == OK
        assert slave.set("hinge.qd0", 0.7) == OK
        assert slave.get("hinge.q") == 1.2 and slave.get("hinge.qd") == 0.7
        second = slave.get("hinge.qdd"), slave.get("energy.kinetic"), slave.get("energy.potential")
        assert all(a != b for a, b in zip(first, second, strict=True))
        assert slave.get("energy.balance") == slave.get("energy.work") == 0
        assert slave.call("ExitInitializationMode") == OK
        assert (slave.get("hinge.qdd"), slave.get("energy.kinetic"), slave.get("energy.potential")) == second
        assert slave.get("energy.balance") == slave.get("energy.work") == 0


def test_inputs_act_at_once_on_accelerations(fmu):
    with Slave(fmu("cart")) as slave:
        slave.initialize()
        before = slave.get("hinge.qdd")
        assert slave.set("hinge.tau", 3.0) == OK
        assert slave.get("hinge.tau") == 3.0
        assert slave.get("hinge.qdd") > before


def test_tunable_parameters_act_at_the_next_communication_point(fmu):
    with Slave(fmu("cart")) as slave:
        slave.initialize()
        slave.run(0.1, 0.01)
        before, balance = slave.get("idle.qdd"), slave.get("energy.balance")
        assert slave.set("gravity[2]", -1.62) == OK
        assert slave.get("idle.qdd") == pytest.approx(before * 1.62 / 9.81, rel=1e-12)
        assert slave.get("energy.balance") == pytest.approx(balance, abs=1e-12), "tuning is no energy error"
        slave.run(0.2, 0.01, start=0.1)
        assert abs(slave.get("energy.balance")) < 1e-6


@pytest.mark.parametrize("method", ["erk", "adams", "dirk", "bdf", "exponential", "auto"])
def test_tuning_to_the_same_value_changes_nothing(fmu, method):
    ends = []
    for tune in (False, True):
        with Slave(fmu("cart")) as slave:
            slave.initialize(start={"solver.method": method})
            for k in range(20):
                if tune:
                    assert slave.set("pole.mass", 0.5) == OK
                    assert slave.set("hinge.tau", 0.0) == OK
                assert slave.step(k * 0.01, 0.01) == OK
            ends.append(slave.reals(["hinge.q", "hinge.qd", "rail.q"]))
    assert ends[0] == ends[1]


@pytest.mark.parametrize(
    ("name", "value", "sentence"),
    [
        ("hinge.tau", math.nan, "hinge.tau must be a finite number, got nan"),
        ("hinge.tau", math.inf, "hinge.tau must be a finite number, got inf"),
        ("hinge.q0", -math.inf, "hinge.q0 must be a finite number, got -inf"),
        ("pole.mass", -1.0, "pole.mass must be >= 0, got -1"),
        ("pole.inertia[2]", -0.5, "pole.inertia[2] must be >= 0, got -0.5"),
        ("rail.damping", -1e-3, "rail.damping must be >= 0, got -0.001"),
        ("hinge.armature", -1.0, "hinge.armature must be >= 0, got -1"),
        ("solver.rtol", 0.0, "solver.rtol must be > 0, got 0"),
        ("solver.rtol", 0.5, "solver.rtol must be <= 0.1, got 0.5"),
        ("solver.atol", -1.0, "solver.atol must be >= 0, got -1"),
        ("solver.max_step", -1.0, "solver.max_step must be >= 0, got -1"),
        ("solver.method", "magic", "solver.method must be 'erk', 'adams', 'dirk', 'bdf', 'exponential', 'taylor' or 'auto', got 'magic'"),
        ("hinge.q", 1.0, "hinge.q is an output and cannot be set"),
        ("solver.steps", 1, "solver.steps is an output and cannot be set"),
    ],
)
def test_bad_values_are_refused_with_a_sentence(fmu, name, value, sentence):
    with Slave(fmu("cart")) as slave:
        assert slave.call("EnterInitializationMode") == OK
        before = slave.get(name)
        assert slave.set(name, value) == ERROR
        assert sentence in slave.errors[-1]
        assert slave.get(name) == before


def test_all_values_of_a_call_are_set_or_none(fmu):
    with Slave(fmu("cart")) as slave:
        assert slave.set_reals(["rail.tau", "hinge.tau"], [1.0, math.nan]) == ERROR
        assert slave.reals(["rail.tau", "hinge.tau"]) == [0, 0]
        assert slave.set_reals(["rail.tau", "hinge.tau"], [1.0, 2.0]) == OK
        assert slave.reals(["rail.tau", "hinge.tau"]) == [1, 2]


def test_an_impossible_inertia_is_refused_before_it_is_used(fmu):
    with Slave(fmu("cart")) as slave:
        assert slave.call("EnterInitializationMode") == OK
        assert slave.set("pole.inertia[4]", 5.0) == OK
        assert slave.call("ExitInitializationMode") == ERROR
        assert "link 'pole'" in slave.errors[-1]
        assert slave.set("pole.inertia[4]", 0.0) == OK
        assert slave.call("ExitInitializationMode") == OK


def test_a_start_that_cannot_move_is_refused(fmu):
    with Slave(fmu("cart")) as slave:
        assert slave.call("EnterInitializationMode") == OK
        assert slave.set("idle.mass", 0.0) == OK
        assert slave.call("ExitInitializationMode") == ERROR
        assert "idle" in slave.errors[-1]


def test_a_master_tightens_the_tolerance_and_never_loosens_it(fmu):
    ends, errors = {}, {}
    for tolerance in (None, 0.1, 1e-11):
        with Slave(fmu("cart")) as slave:
            assert slave.setup(tolerance=tolerance) == OK
            assert slave.call("EnterInitializationMode") == OK
            assert slave.call("ExitInitializationMode") == OK
            slave.run(1, 0.1)
            ends[tolerance] = slave.reals(["rail.q", "hinge.q"])
            errors[tolerance] = abs(slave.get("energy.balance"))
    assert ends[0.1] == ends[None]
    assert errors[1e-11] < 0.1 * errors[None]


def test_health_outputs_count(fmu):
    with Slave(fmu("cart")) as slave:
        slave.initialize()
        assert slave.get("solver.steps") == slave.get("solver.rhs_evaluations") == 0
        slave.run(0.5, 0.01)
        assert slave.get("solver.steps") > 0
        assert slave.get("solver.rhs_evaluations") > slave.get("solver.steps")
        assert 0 < slave.get("solver.error_estimate") <= 1


def test_output_derivatives_are_velocities_and_accelerations(fmu):
    with Slave(fmu("cart")) as slave:
        slave.initialize()
        slave.run(0.1, 0.01)
        for name, order, same_as in (("hinge.q", 1, "hinge.qd"), ("hinge.qd", 1, "hinge.qdd")):
            reference, value = slave.fmu.variables[name][1], (c.c_double * 1)()
            status = slave.call("GetRealOutputDerivatives", (c.c_uint * 1)(reference), c.c_size_t(1), (c.c_int * 1)(order), value)
            assert status == OK and value[0] == slave.get(same_as)
        for name, order in (("hinge.q", 0), ("hinge.q", 2), ("solver.error_estimate", 1), ("hinge.tau", 1)):
            reference = slave.fmu.variables[name][1]
            assert (
                slave.call("GetRealOutputDerivatives", (c.c_uint * 1)(reference), c.c_size_t(1), (c.c_int * 1)(order), (c.c_double * 1)())
                == ERROR
            )


def test_slides_that_move_less_than_the_tolerance_are_named_at_the_end(built):
    """A piezo stage: metres of mechanism, nanometres of motion, of which nothing in the file tells."""
    stage = built(
        'name = "stage"\ngravity = [0, 0, 0]\n[[link]]\nname = "stage"\njoint_name = "piezo"\njoint = "prismatic"\nmass = 2\n'
        "com = [0.3, 0, 0]\nstiffness = 2e6\n"
    )
    for force, atol, told in ((1e-3, 1e-8, True), (1e-3, 1e-12, False), (100, 1e-8, False), (0, 1e-8, False)):
        with Slave(stage, logging=True) as slave:
            slave.initialize(start={"solver.atol": atol})
            assert slave.set("piezo.tau", force) == OK
            slave.run(0.01, 0.001)
            assert not [text for _, category, text in slave.messages if category == "logStatusWarning"]
            assert slave.call("Terminate") == OK
            warnings = [text for _, category, text in slave.messages if category == "logStatusWarning"]
            assert len(warnings) == told
            assert not told or ("'piezo'" in warnings[0] and "solver.atol" in warnings[0])


def test_potential_energy_counts_links_that_are_fixed_to_the_ground(built):
    """-m g.r by hand: an arm, a post fixed to the ground and a load on the post; the zero is that of the origin."""
    link = '[[link]]\nname = "{}"\nparent = "{}"\njoint = "{}"\nmass = {}\ncom = {}\n'
    model = (
        'name = "post"\ngravity = [1, 2, -9]\n'
        + link.format("arm", "ground", "revolute", 0.5, [0.1, 0.2, 0.4])
        + link.format("post", "ground", "fixed", 3, [0, 0.5, 1])
        + "b = 0.25\n"
        + link.format("load", "post", "fixed", 2, [1, 0, 0])
        + 'd = 0.5\n[fmu]\noutputs = ["energy"]\ntunable = ["post.mass"]\n'
    )
    with Slave(built(model)) as slave:
        slave.initialize()
        arm, post, load = 0.5 * (0.1 + 0.4 - 3.6), 1.0 - 9 * 1.25, 2 * (1.0 - 9 * 0.75)
        assert slave.get("energy.potential") == pytest.approx(-(arm + 3 * post + load), rel=1e-14)
        assert slave.set("post.mass", 5.0) == OK
        assert slave.get("energy.potential") == pytest.approx(-(arm + 5 * post + load), rel=1e-14)


def test_values_do_not_depend_on_what_was_read_before(tmp_path):
    """Each output alone, in another order and after other forces: those of one call for all, up to rounding."""
    library, taken = Library(tmp_path), 0
    for index in range(25):
        try:
            text = draw(1789, index).text
            library.load(text)
            library.start({})
        except Refused:
            continue
        taken += 1
        names = library.outputs
        forces = [name for name in library.variables if name.endswith((".tau", ".force[1]")) and name not in names]
        lightest = min(link["mass"] for link in tomllib.loads(text)["link"] if link.get("mass"))
        with Slave(library) as slave:
            slave.initialize()
            for k in range(3):
                slave.set_reals(forces, [k * lightest] * len(forces))
                together = slave.reals(names)
                slave.set_reals(forces, [3 * lightest] * len(forces))
                slave.get(random.Random(index).choice(names))
                slave.set_reals(forces, [k * lightest] * len(forces))
                alone = {name: slave.get(name) for name in random.Random(k).sample(names, len(names))}
                size = max(map(abs, together))
                for name, value in zip(names, together, strict=True):
                    assert alone[name] == pytest.approx(value, rel=1e-9, abs=1e-14 * size), (index, name)
                slave.step(0.001 * k, 0.001)
    assert taken > 15
