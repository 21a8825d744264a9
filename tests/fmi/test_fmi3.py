"""FMI 3.0: the same instance behind another boundary. Trajectories, states and derivatives are those of FMI 2.0, bit for bit."""

from __future__ import annotations

import ctypes as c
import math
from pathlib import Path

import numpy as np
import pytest

from tests.fmi.conftest import ROOT
from tests.fmi.raw import ERROR, OK, Slave
from tests.fmi.raw3 import Slave3, array, count

STEP = 0.01
# loops; a controller on trajectories; spherical joints; friction and stops; contact; couplings; actuators; ports and everything else
QUICK = (
    "everything",
    "four_bar",
    "kuka_kr5_computed_torque",
    "space_robot",
    "stick_slip",
    "parallel_gripper",
    "mimic_hand",
    "kuka_kr5_harmonic",
    "cart",
)
ALL = [
    *QUICK,
    *(pytest.param(path.stem, marks=pytest.mark.slow) for path in sorted((ROOT / "models").glob("*.toml")) if path.stem not in QUICK),
]


@pytest.mark.parametrize("name", ALL)
def test_fmpy_finds_no_problem(fmu3_file, name):
    from fmpy.validation import validate_fmu

    assert validate_fmu(str(fmu3_file(name))) == []


def push(slave, names: list[str], k: int) -> None:
    for i, name in enumerate(names):
        if name.endswith((".tau", ".voltage")) or ".force[" in name or ".tau[" in name:
            assert slave.set(name, 0.3 * math.sin(1 + i + 0.4 * k)) == OK


@pytest.mark.parametrize("name", ALL)
def test_trajectories_are_those_of_fmi2_bit_for_bit(fmu, fmu3, name):
    two, three = fmu(name), fmu3(name)
    outputs, counts = three.named("output"), three.named("output", "Int32")
    assert {n: reference for n, (_, reference) in three.variables.items() if n != "time"} == {
        n: reference for n, (_, reference) in two.variables.items()
    }
    with Slave(two) as old, Slave3(three) as new:
        old.initialize()
        new.initialize()
        for k in range(12):
            push(old, two.named("input"), k)
            push(new, three.named("input"), k)
            assert old.step(k * STEP, STEP) == OK, old.errors
            new.run(k, k + 1, STEP)
            assert new.get(outputs) == old.reals(outputs)
        assert new.get(counts, "Int32") == [old.get(n) for n in counts]
        assert new.get(["time"]) == [11 * STEP + STEP]
        assert new.call("Terminate") == OK


@pytest.mark.parametrize("name", ["cart", "four_bar", "parallel_gripper", "kuka_kr5_harmonic"])
@pytest.mark.parametrize("method", ["erk", "bdf"])
def test_a_restored_run_continues_bit_for_bit(fmu3, name, method):
    with Slave3(fmu3(name)) as slave, Slave3(fmu3(name)) as fresh:
        slave.initialize({"solver.method": method})
        slave.run(0, 10, STEP)
        state = slave.save()
        slave.run(10, 20, STEP)
        expected = slave.everything()
        assert slave.call("SetFMUState", state) == OK
        slave.run(10, 20, STEP)
        assert slave.everything() == expected
        status, copy = fresh.deserialize(slave.serialize(state))
        assert status == OK and fresh.call("SetFMUState", copy) == OK, fresh.errors
        fresh.run(10, 20, STEP)
        assert fresh.everything() == expected
        assert slave.call("FreeFMUState", c.byref(state)) == OK and not state.value


def test_saved_states_pass_between_the_versions(fmu, fmu3):
    with Slave(fmu("four_bar")) as old, Slave3(fmu3("four_bar")) as new:
        old.initialize().run(0.1, STEP)
        status, state = new.deserialize(old.serialize(old.save()))
        assert status == OK and new.call("SetFMUState", state) == OK
        outputs = fmu3("four_bar").named("output")
        assert new.get(outputs) == old.reals(outputs)


# --- derivatives ---


def continuous(fmu3, causality: str) -> list[str]:
    return [n for n in fmu3.named(causality) if fmu3.elements[n].get("variability") == "continuous"]


@pytest.mark.parametrize("name", ["kuka_kr5", "four_bar", "everything"])
def test_directional_derivatives_are_those_of_fmi2(fmu, fmu3, name):
    three = fmu3(name)
    unknowns, knowns = continuous(three, "output"), continuous(three, "input")
    seed = [math.cos(i) for i in range(len(knowns))]
    expected = (c.c_double * len(unknowns))()
    with Slave(fmu(name)) as old, Slave3(three) as new:
        old.initialize().run(3 * STEP, STEP)
        new.initialize().run(0, 3, STEP)
        references = three.references(unknowns), count(len(unknowns)), three.references(knowns), count(len(knowns))
        assert old.call("GetDirectionalDerivative", *references, array(c.c_double, seed), expected) == OK, old.errors
        assert new.derivative("GetDirectionalDerivative", unknowns, knowns, seed) == (OK, list(expected))


@pytest.mark.parametrize("initially", [False, True])
@pytest.mark.parametrize("name", ["kuka_kr5", "four_bar", "space_robot"])
def test_adjoint_derivatives_are_the_transposed_forward_ones(fmu3, name, initially):
    three = fmu3(name)
    unknowns, knowns = continuous(three, "output"), continuous(three, "input")
    if initially:
        knowns += [n for n in three.named("parameter") if n.endswith((".q0", ".qd0", ".mass", ".damping"))]
    with Slave3(three) as slave:
        assert slave.enter() == OK
        if not initially:
            assert slave.call("ExitInitializationMode") == OK
            slave.run(0, 3, STEP)
        columns = []
        for k in range(len(knowns)):
            unit = [float(i == k) for i in range(len(knowns))]
            status, column = slave.derivative("GetDirectionalDerivative", unknowns, knowns, unit)
            assert status == OK, slave.errors
            columns.append(column)
        jacobian = np.array(columns).T
        assert np.abs(jacobian).max() > 0.1
        seed = np.sin(1.0 + np.arange(len(unknowns)))
        status, gradient = slave.derivative("GetAdjointDerivative", unknowns, knowns, seed)
        assert status == OK, slave.errors
        scale = np.abs(seed) @ np.abs(jacobian) + 1e-300
        assert (np.abs(seed @ jacobian - gradient) / scale).max() < 1e-13


def test_adjoint_derivative_of_a_pendulum_in_closed_form(fmu3):
    """Of the acceleration and the angle by the torque: 1 / (m l^2) and 0."""
    with Slave3(fmu3("pendulum")) as slave:
        slave.initialize().run(0, 2, STEP)
        status, gradient = slave.derivative("GetAdjointDerivative", ["pivot.qdd", "pivot.q"], ["pivot.tau"], [2.0, 5.0])
        assert status == OK and gradient[0] == pytest.approx(2.0, rel=1e-13)


def test_adjoint_derivative_after_a_prescribed_position_and_a_mass(built3):
    """Both are pending: the state follows the jump before the derivative is computed."""
    links = "".join(
        f'[[link]]\nname = "l{joint}"\njoint_name = "{joint}"\na = {a}\nmass = 1\ncom = [0.2, 0, 0]\ninertia = [0.01, 0.02, 0.02]\n{drive}'
        for joint, a, drive in (("a", 0, 'drive = "motion"\n'), ("b", 0.4, ""), ("c", 0.4, ""))
    )
    with Slave3(built3(f'name = "arm"\ngravity = [0, -9.81, 0]\n{links}[fmu]\ntunable = ["lc.mass"]\n')) as slave:
        slave.initialize().run(0, 3, STEP)
        assert slave.set("a.q", 1.0) == OK and slave.set("lc.mass", 5.0) == OK
        status, gradient = slave.derivative("GetAdjointDerivative", ["b.qdd"], ["c.tau"], [1.0])
        assert status == OK and [gradient] == [
            pytest.approx(slave.derivative("GetDirectionalDerivative", ["b.qdd"], ["c.tau"], [1.0])[1], rel=1e-13)
        ]


def test_output_derivatives(fmu3):
    with Slave3(fmu3("four_bar")) as slave:
        slave.initialize().run(0, 5, STEP)
        joints = [n.removesuffix(".q") for n in fmu3("four_bar").named("output") if n.endswith(".q")]
        rates = (c.c_double * len(joints))()
        arguments = fmu3("four_bar").references([f"{j}.q" for j in joints]), count(len(joints)), array(c.c_int32, [1] * len(joints))
        assert slave.call("GetOutputDerivatives", *arguments, rates, count(len(joints))) == OK, slave.errors
        assert list(rates) == slave.get([f"{j}.qd" for j in joints])


# --- mistreatment ---


STATES = ("instantiated", "initialization", "step", "failed", "terminated")
everywhere = set(STATES)


def bring_to(slave: Slave3, state: str) -> Slave3:
    if state == "instantiated":
        return slave
    assert slave.enter() == OK
    if state == "initialization":
        return slave
    assert slave.call("ExitInitializationMode") == OK, slave.errors
    if state == "failed":
        assert slave.set("hinge.tau", 1e308) == OK and slave.set("rail.tau", 1e308) == OK
        status, flags, time = slave.do_step(0, STEP)
        assert status == ERROR and flags == [False] * 3 and 0 <= time < STEP
        assert "fmi3DoStep: " in slave.errors[-1] and "the state is the one at" in slave.errors[-1]
    if state == "terminated":
        assert slave.call("Terminate") == OK
    return slave


def get(slave: Slave3, name: str) -> int:
    kind, reference = slave.fmu.variables[name]
    value = {"Float64": c.c_double, "Int32": c.c_int32, "String": c.c_char_p}[kind]()
    return slave.call(f"Get{kind}", array(c.c_uint, [reference]), count(1), c.byref(value), count(1))


def saved(slave: Slave3, use) -> int:
    return use(slave.save())


CALLS = {
    "SetDebugLogging": (lambda s: s.call("SetDebugLogging", c.c_bool(False), count(0), None), everywhere),
    "EnterInitializationMode": (lambda s: s.enter(), {"instantiated"}),
    "ExitInitializationMode": (lambda s: s.call("ExitInitializationMode"), {"initialization"}),
    "Terminate": (lambda s: s.call("Terminate"), {"step", "failed"}),
    "Reset": (lambda s: s.call("Reset"), everywhere),
    "GetFloat64 output": (lambda s: get(s, "hinge.q"), everywhere - {"instantiated"}),
    "GetFloat64 time": (lambda s: get(s, "time"), everywhere),
    "GetFloat64 parameter": (lambda s: get(s, "hinge.q0"), everywhere),
    "GetInt32": (lambda s: get(s, "solver.steps"), everywhere - {"instantiated"}),
    "GetString": (lambda s: get(s, "solver.method"), everywhere),
    "SetFloat64 input": (lambda s: s.set("hinge.tau", 1.0), {"instantiated", "initialization", "step"}),
    "SetFloat64 fixed": (lambda s: s.set("hinge.q0", 1.0), {"instantiated", "initialization"}),
    "SetFloat64 tunable": (lambda s: s.set("pole.mass", 1.0), {"instantiated", "initialization", "step"}),
    "SetFloat64 output": (lambda s: s.set("hinge.q", 1.0), set()),
    "SetFloat64 time": (lambda s: s.set("time", 1.0), set()),
    "SetInt32 output": (lambda s: s.set("solver.steps", 1), set()),
    "SetString": (lambda s: s.set("solver.method", "bdf"), {"instantiated", "initialization"}),
    "GetFMUState": (lambda s: s.call("GetFMUState", c.byref(c.c_void_p())), everywhere),
    "SetFMUState": (lambda s: saved(s, lambda state: s.call("SetFMUState", state)), everywhere),
    "FreeFMUState": (lambda s: saved(s, lambda state: s.call("FreeFMUState", c.byref(state))), everywhere),
    "serialization": (lambda s: saved(s, lambda state: s.deserialize(s.serialize(state))[0]), everywhere),
    "GetDirectionalDerivative": (
        lambda s: s.derivative("GetDirectionalDerivative", ["hinge.qdd"], ["hinge.tau"], [1])[0],
        {"initialization", "step", "terminated"},
    ),  # the failed step's forces are infinite
    "GetAdjointDerivative": (
        lambda s: s.derivative("GetAdjointDerivative", ["hinge.qdd"], ["hinge.tau"], [1])[0],
        {"initialization", "step", "terminated"},
    ),
    "GetOutputDerivatives": (
        lambda s: s.call(
            "GetOutputDerivatives", s.fmu.references(["hinge.q"]), count(1), c.byref(c.c_int32(1)), c.byref(c.c_double()), count(1)
        ),
        {"step", "failed", "terminated"},
    ),
    "DoStep": (lambda s: s.do_step(0, STEP)[0], {"step"}),
}


@pytest.mark.parametrize("state", STATES)
@pytest.mark.parametrize("function", CALLS)
def test_every_function_in_every_state(fmu3, function, state):
    call, allowed = CALLS[function]
    with Slave3(fmu3("cart")) as slave:
        before = len(bring_to(slave, state).errors)
        status = call(slave)
        assert status == (OK if state in allowed else ERROR), slave.errors
        if status == ERROR:
            assert len(slave.errors) == before + 1
            assert slave.errors[-1].startswith(f"fmi3{function.split()[0]}: ")


TYPED = [
    f"{way}{kind}" for kind in "Float32 Int8 UInt8 Int16 UInt16 UInt32 Int64 UInt64 Boolean Clock Binary".split() for way in ("Get", "Set")
]
ABSENT = """EnterConfigurationMode ExitConfigurationMode EnterEventMode EnterStepMode EvaluateDiscreteStates UpdateDiscreteStates
GetNumberOfVariableDependencies GetVariableDependencies GetIntervalDecimal GetIntervalFraction GetShiftDecimal GetShiftFraction SetIntervalDecimal
SetIntervalFraction SetShiftDecimal SetShiftFraction ActivateModelPartition EnterContinuousTimeMode CompletedIntegratorStep SetTime
SetContinuousStates GetContinuousStateDerivatives GetEventIndicators GetContinuousStates GetNominalsOfContinuousStates
GetNumberOfEventIndicators GetNumberOfContinuousStates""".split()


@pytest.mark.parametrize("function", TYPED + ABSENT)
def test_what_the_fmu_lacks_is_refused_with_one_sentence(fmu3, function):
    with Slave3(fmu3("cart")) as slave:
        bring_to(slave, "step")
        before = slave.everything()
        assert slave.call(function, array(c.c_uint, [1]), count(1), *[None] * 5) == ERROR
        assert [text.split(":")[0] for text in slave.errors] == [f"fmi3{function}"]
        assert slave.call(function, *[None] * 7) == (OK if function in TYPED else ERROR)
        assert slave.everything() == before
        assert getattr(slave.fmu.library, f"fmi3{function}")(None, None, count(0), *[None] * 5) == ERROR, "no instance"


def mistreatments():
    one, zero, value = count(1), count(0), c.c_double(0)
    for way in ("Get", "Set"):
        function = f"{way}Float64"
        yield f"{function} too few values", lambda s, j, f=function: s.call(f, s.fmu.references([f"{j}.tau"]), one, c.byref(value), zero)
        yield (
            f"{function} too many values",
            lambda s, j, f=function: s.call(f, s.fmu.references([f"{j}.tau"]), one, (c.c_double * 2)(), count(2)),
        )
        yield f"{function} null references", lambda s, j, f=function: s.call(f, None, one, c.byref(value), one)
        yield f"{function} null values", lambda s, j, f=function: s.call(f, s.fmu.references([f"{j}.tau"]), one, None, one)
        yield f"{function} of an Int32", lambda s, j, f=function: s.call(f, s.fmu.references(["solver.steps"]), one, c.byref(value), one)
        for reference in (10**6, 2**31, 2**32 - 1):
            yield (
                f"{function} of reference {reference}",
                lambda s, j, f=function, r=reference: s.call(f, array(c.c_uint, [r]), one, c.byref(value), one),
            )
        for huge in (2**64 - 1, 2**61):
            yield (
                f"{function} of {huge}",
                lambda s, j, f=function, n=huge: s.call(f, array(c.c_uint, [1]), count(n), c.byref(value), count(n)),
            )
    for bad in (math.nan, math.inf):
        yield f"input {bad}", lambda s, j, v=bad: s.set(f"{j}.tau", v)
        yield f"step size {bad}", lambda s, j, v=bad: s.do_step(0, v)[0]
        for function in ("GetDirectionalDerivative", "GetAdjointDerivative"):
            yield f"{function} {bad}", lambda s, j, f=function, v=bad: s.derivative(f, [f"{j}.qdd"], [f"{j}.tau"], [v])[0]
    yield "a step back", lambda s, j: s.do_step(0, -STEP)[0]
    yield "a step elsewhere", lambda s, j: s.do_step(1, STEP)[0]
    for function in ("GetDirectionalDerivative", "GetAdjointDerivative"):
        yield f"{function} by an output", lambda s, j, f=function: s.derivative(f, [f"{j}.qdd"], [f"{j}.qdd"], [1])[0]
        yield f"{function} by time", lambda s, j, f=function: s.derivative(f, [f"{j}.qdd"], ["time"], [1])[0]
        yield f"{function} of time", lambda s, j, f=function: s.derivative(f, ["time"], [f"{j}.tau"], [1])[0]
        yield f"{function} wrong seed", lambda s, j, f=function: s.derivative(f, [f"{j}.qdd"], [f"{j}.tau"], [1, 2])[0]
        yield f"{function} nulls", lambda s, j, f=function: s.call(f, None, one, None, one, None, one, None, one)
    flags = [c.byref(c.c_bool()) for _ in range(3)]
    yield "step without flags", lambda s, j: s.call("DoStep", c.c_double(0), c.c_double(STEP), c.c_bool(), None, None, None, c.byref(value))
    yield "step without a place for the time", lambda s, j: s.call("DoStep", c.c_double(0), c.c_double(STEP), c.c_bool(), *flags, None)
    yield "a state of nobody", lambda s, j: s.call("SetFMUState", c.c_void_p(12345))
    yield "no state", lambda s, j: s.call("GetFMUState", None)
    yield "damaged bytes", lambda s, j: s.deserialize(s.serialize(s.save())[:-1] + b"?")[0]
    yield "unknown log category", lambda s, j: s.call("SetDebugLogging", c.c_bool(True), one, array(c.c_char_p, [b"logNonsense"]))


MISTREATMENTS = dict(mistreatments())


@pytest.mark.parametrize(("name", "joint"), [("cart", "hinge"), ("kuka_kr5", "joint2"), ("four_bar", "crank_joint")])
@pytest.mark.parametrize("what", MISTREATMENTS)
def test_mistreatment_is_refused_and_changes_nothing(fmu3, what, name, joint):
    with Slave3(fmu3(name)) as slave, Slave3(fmu3(name)) as other:
        slave.initialize()
        other.initialize().run(0, 5, STEP)
        assert MISTREATMENTS[what](slave, joint) == ERROR
        assert len(slave.errors) == 1 and slave.errors[0].startswith("fmi3"), slave.errors
        slave.run(0, 5, STEP)
        assert slave.everything() == other.everything()
        assert slave.call("Reset") == OK
        slave.initialize().run(0, 5, STEP)
        assert slave.everything() == other.everything()


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        ({"token": "{00000000-0000-0000-0000-000000000000}"}, "belongs to another model file"),
        ({"name": b" "}, "the instance has no name"),
        ({"name": None}, "the instance has no name"),
        ({"event_mode": True}, "no event mode"),
        ({"interface": "ModelExchange", "token": "{00000000-0000-0000-0000-000000000000}"}, "belongs to another model file"),
        ({"interface": "ModelExchange", "name": None}, "the instance has no name"),
        ({"interface": "ScheduledExecution"}, "no scheduled execution"),
    ],
)
def test_instantiation_is_refused_with_the_reason(fmu3, arguments, words):
    slave = Slave3(fmu3("cart"), **arguments)
    assert not slave.component.value
    assert len(slave.errors) == 1 and words in slave.errors[0]
    assert slave.errors[0].startswith(f"fmi3Instantiate{arguments.get('interface', 'CoSimulation')}: ")


@pytest.mark.parametrize("resources", [None, b"/nowhere/"])
def test_the_library_finds_its_own_resources(fmu3, resources):
    with Slave3(fmu3("cart"), resources=resources) as slave:
        slave.initialize().run(0, 1, STEP)


def test_tolerance_and_stop_time_of_the_master(fmu3):
    def error_of(**experiment):
        with Slave3(fmu3("cart")) as slave:
            assert slave.enter(**experiment) == OK and slave.set("solver.method", "erk") == OK
            assert slave.call("ExitInitializationMode") == OK
            slave.run(0, 50, STEP)
            return slave.get(["hinge.q"])[0], slave.get(["solver.steps"], "Int32")[0], slave.do_step(0.5, STEP)[0]

    (_, steps, last), (_, more, after_stop) = error_of(), error_of(tolerance=1e-12, stop=0.5)
    assert more > steps and (last, after_stop) == (OK, ERROR)
    with Slave3(fmu3("cart")) as slave:
        assert slave.enter(tolerance=-1.0) == ERROR and slave.enter(stop=-1.0) == ERROR
        assert all(text.startswith("fmi3EnterInitializationMode: ") for text in slave.errors)
        slave.initialize()


def test_enabled_log_categories_leave_the_others_as_they_are(fmu3):
    with Slave3(fmu3("cart")) as slave:
        for name in (b"logEvents", b"logStatusWarning"):
            assert slave.call("SetDebugLogging", c.c_bool(True), count(1), (c.c_char_p * 1)(name)) == OK
        slave.call("Reset")
        assert slave.messages[-1][2] == "reset"
        assert slave.call("SetDebugLogging", c.c_bool(True), count(1), (c.c_char_p * 1)(b"a#r12#b")) == ERROR
        assert "a##r12##b" in slave.errors[-1]


def test_dependencies_include_tunable_parameters_and_time(built3):
    """At a communication point, and time in initialization mode, too: both differ from FMI 2.0."""
    fmu = built3("""name = "tuned"
[[link]]
name = "arm"
mass = 1
com = [0.5, 0, 0]
damping = 0.1
[[link]]
name = "other"
parent = "ground"
mass = 1
com = [0.5, 0, 0]
[[link]]
name = "wheel"
parent = "ground"
drive = "motion"
mass = 1
[[trajectory]]
joint = "wheel"
type = "speed"
speed = 1
[fmu]
tunable = ["arm.mass", "arm.damping"]
outputs = ["acceleration"]
""")

    def named(tag: str, of: str) -> set[str]:
        names = {variable.get("valueReference"): variable.get("name") for variable in fmu.xml.find("ModelVariables")}
        row = next(row for row in fmu.xml.findall(f"ModelStructure/{tag}") if names[row.get("valueReference")] == of)
        assert len(row.get("dependenciesKind", row.get("dependencies")).split()) == len(row.get("dependencies").split())
        return {names[reference] for reference in row.get("dependencies").split()}

    assert {"arm.mass", "arm.damping", "arm.q", "time"} <= named("Output", "arm.qdd")
    assert not {"arm.mass", "arm.damping"} & named("Output", "arm.q")
    assert "time" in named("InitialUnknown", "wheel.q")
    with Slave3(fmu) as slave:
        slave.initialize()
        assert slave.set("arm.tau", 1.0) == OK
        (before,) = slave.get(["arm.qdd"])
        assert slave.set("arm.mass", 2.0) == OK
        assert slave.get(["arm.qdd"])[0] != before


def test_outputs_of_a_model_with_prescribed_motion_depend_on_time(fmu3):
    def with_time(name: str) -> bool:
        rows = fmu3(name).xml.findall("ModelStructure/Output[@dependencies]")
        found = {"0" in row.get("dependencies").split() for row in rows}
        assert len(found) == 1
        return found.pop()

    assert with_time("kuka_kr5_computed_torque") and with_time("stick_slip") and not with_time("cart")


def test_frames_with_force_inputs_are_terminals(fmu3):
    from fmpy import __file__ as fmpy
    from lxml import etree

    schema = etree.XMLSchema(file=str(Path(fmpy).parent / "schema" / "fmi3" / "fmi3TerminalsAndIcons.xsd"))
    everything = fmu3("everything")
    page = etree.parse(str(everything.folder / "terminalsAndIcons" / "terminalsAndIcons.xml"))
    assert schema.validate(page), schema.error_log
    terminals = {t.get("name"): {m.get("variableName"): m.get("variableKind") for m in t} for t in page.iter("Terminal")}
    assert set(terminals) == {"tip", "tool"}
    for name, members in terminals.items():
        assert {f"{name}.{kind}[{i}]" for kind in ("force", "torque") for i in (1, 2, 3)} == {
            m for m, kind in members.items() if kind == "inflow"
        }
        assert all(member in everything.variables for member in members)
    assert terminals["tip"]["tip.position[1]"] == "signal"
    assert not (fmu3("cart").folder / "terminalsAndIcons").exists()


def test_the_commands_run_it(fmu_file, fmu3_file, tmp_path):
    from tests.command_line import command

    done = [
        command("simulate", file("four_bar"), "--stop", "0.2", "--csv", tmp_path / f"{k}.csv")
        for k, file in enumerate((fmu_file, fmu3_file))
    ]
    assert [one.returncode for one in done] == [0, 0], done[1].stderr
    assert (tmp_path / "0.csv").read_bytes() == (tmp_path / "1.csv").read_bytes()
    shown = command("show", fmu3_file("four_bar"), "-o", tmp_path / "four_bar.html")
    assert shown.returncode == 0, shown.stderr
    report = command("report", fmu3_file("four_bar"))
    assert report.returncode != 0 and "FMI 2.0 only" in report.stderr
