"""Array variables of FMI 3.0 (`build --fmi 3 --arrays`): the scalars of the same model, bit for bit, behind other references."""

from __future__ import annotations

import ctypes as c
import math

import numpy as np
import pytest

from build_fmu.errors import UserError
from build_fmu.fmu.arrays import with_arrays
from build_fmu.model.describe import describe
from tests.command_line import command
from tests.fmi.conftest import ROOT, build_fmu
from tests.fmi.raw import ERROR, OK
from tests.fmi.raw3 import Slave3, Unpacked3, array, count

STEP = 0.01
# every kind of variable; loops; trajectories beside driven joints; spherical joints; matrices
QUICK = ("everything", "four_bar", "parallel_gripper", "space_robot", "terms", "motors", "loop_motors", "held_loop")
TERMS = """
name = "terms"
gravity = [0, 0, -9.81]

[[link]]
name = "upper"
alpha = 1.5707963267948966
mass = 1
com = [0.3, 0, 0]

[[link]]
name = "lower"
a = 0.5
mass = 1
com = [0.3, 0, 0]

[[frame]]
name = "tip"
link = "lower"
position = [0.5, 0, 0]
outputs = ["pose", "jacobian"]
port = "ground"

[fmu]
outputs = ["mass_matrix", "bias", "regressor", "acceleration"]
tunable = ["lower.com[1]", "lower.com[2]", "lower.com[3]", "upper.com[1]", "upper.damping", "lower.damping"]
"""
# the current of the second motor only is a state
MOTORS = """
name = "motors"

[[link]]
name = "upper"
mass = 1
com = [0.3, 0, 0]

[[link]]
name = "lower"
a = 0.5
mass = 1
com = [0.3, 0, 0]

[[actuator]]
joint = "upper"
resistance = 1
torque_constant = 1

[[actuator]]
joint = "lower"
resistance = 1
torque_constant = 1
inductance = 0.1

[fmu]
outputs = ["acceleration", "energy", "actuator"]
"""
# the same at joints of a loop and outside
LOOP = """
[[link]]
name = "rocker"
parent = "ground"
mass = 1
com = [0.2, 0, 0]

[[link]]
name = "wheel"
parent = "ground"
mass = 1
inertia = [0.1, 0.1, 0.1]

[[link]]
name = "vane"
parent = "ground"
drive = "locked"
mass = 1
com = [0.1, 0, 0]

[[link]]
name = "disk"
parent = "ground"
mass = 1
inertia = [0.1, 0.1, 0.1]

[[loop]]
name = "pin"
type = "point"
link_a = "lower"
link_b = "rocker"
point_a = [0.4, 0, 0]
point_b = [0.9, 0, 0]
directions = [[0, 1, 0]]

[[actuator]]
joint = "wheel"
resistance = 1
torque_constant = 1

[[actuator]]
joint = "disk"
resistance = 1
torque_constant = 1
inductance = 0.1
"""
TEXTS = {"terms": TERMS, "motors": MOTORS, "loop_motors": MOTORS.replace("[fmu]", LOOP + "\n[fmu]")}
TEXTS["held_loop"] = TEXTS["loop_motors"].replace('name = "rocker"', 'name = "rocker"\ndrive = "locked"')


class Scene:
    """The FMU with arrays, that with scalars, and the elements of each array."""

    def __init__(self, model, file, scalars: Unpacked3, folder) -> None:
        self.file, self.scalars = file, scalars
        self.arrays = Unpacked3(file, folder)
        table = describe(model)
        merged = with_arrays(table).variables
        elements = {a.value_reference: a.elements for a in table.arrays}
        self.elements = {v.name: elements.get(v.value_reference, [v.name]) for v in merged if v.type == "Real"}

    def flat(self, names) -> list[str]:
        return [element for name in names for element in self.elements[name]]

    def ask(self, slave: Slave3, names) -> list[float]:
        values = (c.c_double * len(self.flat(names)))()
        status = slave.call("GetFloat64", self.arrays.references(names), count(len(names)), values, count(len(values)))
        assert status == OK, slave.errors
        return list(values)

    def put(self, slave: Slave3, names, values) -> int:
        return slave.call("SetFloat64", self.arrays.references(names), count(len(names)), array(c.c_double, values), count(len(values)))

    def derivative(self, slave: Slave3, function: str, unknowns, knowns, seed) -> list[float]:
        result = (c.c_double * len(self.flat(unknowns if function == "GetDirectionalDerivative" else knowns)))()
        references = self.arrays.references
        sizes = count(len(unknowns)), count(len(knowns))
        of_unknowns, of_knowns = references(unknowns), references(knowns)
        seeds = array(c.c_double, seed)
        assert (
            slave.call(function, of_unknowns, sizes[0], of_knowns, sizes[1], seeds, count(len(seed)), result, count(len(result))) == OK
        ), slave.errors
        return list(result)


@pytest.fixture(scope="module")
def scene(fmu_file, fmu3, tmp_path_factory):
    """Returns a function: name of a model -> its Scene."""
    made = {}

    def of(name: str) -> Scene:
        if name not in made:
            folder = tmp_path_factory.mktemp("arrays")
            model = ROOT / "models" / f"{name}.toml"
            if name in TEXTS:
                model = folder / f"{name}.toml"
                model.write_text(TEXTS[name])
            elif not model.is_file():
                model = fmu_file(name).with_suffix(".toml")
            file = build_fmu(model, folder / "arrays.fmu", "--fmi", "3", "--arrays")
            scalars = Unpacked3(build_fmu(model, folder / "scalars.fmu", "--fmi", "3"), folder / "scalars") if name in TEXTS else fmu3(name)
            made[name] = Scene(model, file, scalars, folder / "unpacked")
        return made[name]

    return of


@pytest.mark.parametrize("name", QUICK)
def test_the_description_is_valid_and_has_each_scalar_once(scene, name):
    from fmpy.validation import validate_fmu

    of = scene(name)
    assert validate_fmu(str(of.file)) == []
    lengths = {n: math.prod(int(d.get("start")) for d in e.findall("Dimension")) for n, e in of.arrays.elements.items()}
    assert {n: lengths[n] for n in of.elements} == {n: len(elements) for n, elements in of.elements.items()}
    every = [*of.flat(of.elements), *(n for n, (kind, _) in of.arrays.variables.items() if kind != "Float64"), "time"]
    assert sorted(every) == sorted(of.scalars.variables)
    assert any(len(elements) > 1 for elements in of.elements.values())


@pytest.mark.parametrize("name", QUICK)
def test_values_and_trajectories_are_those_of_the_scalars(scene, name):
    of = scene(name)
    outputs = of.arrays.named("output")
    inputs = [n for n in of.arrays.named("input") if n.rpartition(".")[2].startswith(("tau", "voltage", "force"))]
    with Slave3(of.arrays) as new, Slave3(of.scalars) as old:
        new.initialize()
        old.initialize()
        assert of.ask(new, of.arrays.named("parameter")) == old.get(of.flat(of.arrays.named("parameter")))
        for k in range(5):
            pushed = [math.sin(1 + i + 0.4 * k) for i in range(len(of.flat(inputs)))]
            assert of.put(new, inputs, pushed) == OK, new.errors
            for element, value in zip(of.flat(inputs), pushed, strict=True):
                assert old.set(element, value) == OK
            new.run(k, k + 1, STEP)
            old.run(k, k + 1, STEP)
            assert of.ask(new, outputs) == old.get(of.flat(outputs))


@pytest.mark.parametrize("name", QUICK)
def test_derivatives_are_those_of_the_scalars(scene, name):
    of = scene(name)
    unknowns = [n for n in of.arrays.named("output") if of.arrays.elements[n].get("variability") in (None, "continuous")]
    knowns = [n for n in of.arrays.named("input") if not n.startswith("q")] or ["q"]
    with Slave3(of.arrays) as new, Slave3(of.scalars) as old:
        for slave in (new, old):
            slave.initialize()
            slave.run(0, 1, STEP)
        for function, rows in (("GetDirectionalDerivative", knowns), ("GetAdjointDerivative", unknowns)):
            seed = [math.cos(i) for i in range(len(of.flat(rows)))]
            expected = old.derivative(function, of.flat(unknowns), of.flat(knowns), seed)
            assert expected[0] == OK and of.derivative(new, function, unknowns, knowns, seed) == expected[1]
            assert any(expected[1])
        rates = []
        for slave, fmu, names in ((new, of.arrays, unknowns), (old, of.scalars, of.flat(unknowns))):
            values = (c.c_double * len(of.flat(unknowns)))()
            orders = array(c.c_int, [1] * len(names))
            assert slave.call("GetOutputDerivatives", fmu.references(names), count(len(names)), orders, values, count(len(values))) == OK
            rates.append(list(values))
        assert rates[0] == rates[1]


@pytest.mark.parametrize("name", ["four_bar", "space_robot", "parallel_gripper"])
def test_cvode_gets_the_states_in_the_order_of_the_arrays(scene, name):
    from fmpy import simulate_fmu

    of = scene(name)
    options = {"stop_time": 0.1, "output_interval": 0.01}
    tight = {"solver.rtol": 1e-10, "solver.atol": 1e-12}
    if name == "space_robot":  # at rest otherwise
        options["start_values"] = {"qd0": [0.1 * k for k in range(len(of.elements["qd0"]))]}
        tight |= options["start_values"]
    own = simulate_fmu(str(of.file), fmi_type="CoSimulation", output=["q"], **options | {"start_values": tight})
    free = simulate_fmu(str(of.file), fmi_type="ModelExchange", solver="CVode", relative_tolerance=1e-9, output=["q"], **options)
    place = np.searchsorted(free["time"], own["time"] + 1e-9, side="right") - 1
    assert own["q"].ndim == 2 and np.ptp(own["q"], axis=0).max() > 1e-3
    assert np.abs(free["q"][place] - own["q"]).max() < 3e-5 * (1 + np.abs(own["q"]).max())


def test_start_values_are_set_as_a_vector(scene):
    of = scene("terms")
    with Slave3(of.arrays) as slave:
        assert slave.enter() == OK
        assert of.put(slave, ["q0", "lower.com"], [0.5, -0.25, 0.1, 0.2, 0.3]) == OK, slave.errors
        assert slave.call("ExitInitializationMode") == OK
        assert of.ask(slave, ["q", "lower.com"]) == [0.5, -0.25, 0.1, 0.2, 0.3]


def test_wrong_sizes_and_references_are_refused(scene):
    of = scene("terms")
    with Slave3(of.arrays) as slave:
        slave.initialize()
        before = of.ask(slave, ["q", "tau"])
        assert of.put(slave, ["tau"], [1.0]) == ERROR
        assert slave.errors[-1] == "fmi3SetFloat64: the value references need 2 values, got 1"
        assert of.put(slave, ["tau"], [1.0, math.nan]) == ERROR and "lower.tau" in slave.errors[-1]
        assert of.put(slave, ["q"], [1.0, 2.0]) == ERROR
        assert slave.errors[-1] == "fmi3SetFloat64: upper.q is an output and cannot be set"
        # that of a second element, of the time, and beyond the table
        first = of.arrays.variables["q"][1]
        for wrong in (first + 1, 1 << 30, (1 << 30) + 10**6, (1 << 32) - 1):
            values = (c.c_double * 1)()
            assert slave.call("GetFloat64", array(c.c_uint, [wrong]), count(1), values, count(1)) == ERROR
            assert f"no Float64 variable with value reference {wrong}" in slave.errors[-1]
        assert of.ask(slave, ["q", "tau"]) == before


def test_names_tell_inputs_and_prescribed_motions_apart(scene):
    assert {"q", "q_prescribed"} <= set(scene("parallel_gripper").elements)
    names = scene("everything").elements
    assert {"q", "q_input", "q_prescribed", "q0"} <= set(names)
    assert not set(names["q"]) & set(names["q_prescribed"])


def test_a_current_that_is_no_state_is_in_an_array_of_its_own(scene):
    names = scene("motors").elements
    assert (names["current"], names["current_algebraic"]) == (["lower.current"], ["upper.current"])


def test_terminals_refer_to_arrays(scene):
    text = (scene("terms").arrays.folder / "terminalsAndIcons" / "terminalsAndIcons.xml").read_text()
    assert 'variableName="tip.force" memberName="force" variableKind="inflow"' in text
    assert "tip.force[" not in text


def test_tunable_elements_stay_scalars(scene):
    names = scene("terms").elements
    assert {"lower.com", "upper.com[1]", "upper.damping", "mass_matrix", "tip.jacobian"} <= set(names)
    assert [len(names[n]) for n in ("lower.com", "mass_matrix", "tip.jacobian", "lower.regressor")] == [3, 4, 12, 20]


def test_arrays_need_fmi3_and_are_not_simulated(scene, tmp_path):
    done = command("build", ROOT / "models" / "four_bar.toml", "-o", tmp_path / "x.fmu", "--arrays")
    assert done.returncode != 0 and "FMI 2.0 has scalars only; add --fmi 3" in done.stderr
    assert not (tmp_path / "x.fmu").exists()
    from build_fmu.run.fmu_file import read_description

    with pytest.raises(UserError, match="is an array, which is not supported; build the FMU without --arrays"):
        read_description(scene("four_bar").file)


@pytest.mark.slow
@pytest.mark.parametrize("model", sorted((ROOT / "models").glob("*.toml")), ids=lambda path: path.stem)
def test_fmpy_finds_no_problem_in_any_model(model, tmp_path):
    from fmpy.validation import validate_fmu

    assert validate_fmu(str(build_fmu(model, tmp_path / "x.fmu", "--fmi", "3", "--arrays"))) == []
