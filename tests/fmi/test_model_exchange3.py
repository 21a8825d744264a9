"""Model exchange of FMI 3.0: the numbers of FMI 2.0 through another boundary, bit for bit."""

from __future__ import annotations

import ctypes as c
import math
import re
import shutil
import subprocess
from pathlib import Path

import fmpy
import numpy as np
import pytest

from tests.fmi.conftest import build_fmu
from tests.fmi.exchange import Exchange, Exchange3
from tests.fmi.raw import DISCARD, ERROR, OK
from tests.fmi.raw3 import Slave3, Unpacked3, count
from tests.fmi.test_model_exchange import FINE, MOVED, OTHERS, QUICK, moved, reals

MODELS = [*QUICK, *(pytest.param(name, marks=pytest.mark.slow) for name in OTHERS)]


@pytest.mark.parametrize("name", MODELS)
def test_cvode_follows_co_simulation(fmu3_file, fmu3, name):
    """FMPy's CVode, which knows states, derivatives, nominals and events, against the FMU's own solver."""
    from fmpy import simulate_fmu
    from fmpy.validation import validate_fmu

    file = str(fmu3_file(name))
    stop, inputs = MOVED.get(name, (0.5, {}))
    assert validate_fmu(file) == []
    with Exchange3(fmu3(name)) as tool:
        outputs = set(fmu3(name).named("output"))
        names = [state for state in tool.states if state in outputs]
    options = {"stop_time": stop, "output": names, "output_interval": FINE.get(name, 0.01)}
    tight = {"solver.rtol": 1e-10, "solver.atol": 1e-12}
    own = simulate_fmu(file, fmi_type="CoSimulation", start_values=tight | inputs, **options)
    free = simulate_fmu(file, fmi_type="ModelExchange", solver="CVode", relative_tolerance=1e-9, start_values=inputs, **options)
    assert free["time"][-1] == pytest.approx(stop)
    # of the samples at an event the last one counts
    place = np.searchsorted(free["time"], own["time"] + 1e-9, side="right") - 1
    for output in names:
        size = 1 + np.abs(own[output]).max()
        assert np.abs(free[output][place] - own[output]).max() < 3e-5 * size, output


def event_of(info) -> tuple:
    return info.again, info.terminate, info.new_nominals, info.new_values, info.has_next, info.next


@pytest.mark.parametrize("name", ["everything", "cart", *MODELS])
def test_numbers_are_those_of_fmi2(fmu, fmu3, name):
    with Exchange(fmu(name)) as old, Exchange3(fmu3(name)) as new:
        assert (new.states, new.slopes) == (old.states, old.slopes)
        assert event_of(new.begin()) == event_of(old.begin())
        numbers = new.number("GetNumberOfContinuousStates"), new.number("GetNumberOfEventIndicators")
        assert numbers == (len(old.states), int("independent.margin" in new.fmu.elements))
        assert numbers[1] == new.indicator_count == old.indicator_count
        start = list(old.get_states()), list(old.derivatives()), list(old.numbers("GetNominalsOfContinuousStates"))
        assert (list(new.get_states()), list(new.derivatives()), list(new.numbers("GetNominalsOfContinuousStates"))) == start
        assert start[2] == [float(new.fmu.elements[state].get("nominal", 1)) for state in new.states]
        time = 1e-5 if name in OTHERS else 0.05  # some are too stiff for longer explicit steps
        states = moved(old, time)
        assert list(moved(new, time)) == list(states)
        assert list(new.indicators()) == list(old.indicators())
        outputs = reals(fmu(name))
        assert new.get(outputs) == old.reals(outputs)
        assert new.get(["time"]) == [time]
        # drifted states are corrected alike
        for tool in (old, new):
            assert tool.set_states(1.01 * states) == OK
        assert new.completed_step() == old.completed_step()
        for tool in (old, new):
            assert tool.call("EnterEventMode") == OK
        assert event_of(new.event()) == event_of(old.event())
        assert list(new.get_states()) == list(old.get_states())
        rows = new.slopes + outputs
        knowns, seed = new.states, [math.cos(i) for i in range(len(new.states))]
        assert new.derivative("GetDirectionalDerivative", rows, knowns, seed) == (OK, list(old.directional(rows, knowns, seed)))


@pytest.mark.parametrize("name", MODELS)
def test_adjoint_derivatives_by_states(fmu3, name):
    with Exchange3(fmu3(name)) as tool:
        tool.begin()
        moved(tool, 1e-4)  # short enough for stiff models
        forward = jacobian(tool, tool.slopes, tool.states)
        seed = np.sin(1.0 + np.arange(len(tool.slopes)))
        status, gradient = tool.derivative("GetAdjointDerivative", tool.slopes, tool.states, seed)
        assert status == OK
        # sums below 1 or far below the others are what remains of larger terms, and so are derivatives by quaternions
        most = 1e-12 if any("quaternion" in state for state in tool.states) else 1e-13
        terms = np.abs(seed) @ np.abs(forward)
        assert (np.abs(seed @ forward - gradient) / np.maximum(terms, max(1, 1e-3 * terms.max()))).max() < most


def chain(generator, joints: int = 14) -> str:
    """Returns a random tree with joints of all simple types, and every law of a joint."""
    number = lambda low, high: f"{generator.uniform(low, high):.3f}"
    text = 'name = "chain"\ngravity = [1, -9.81, 2]\n'
    for k in range(joints):
        kind = ("revolute", "prismatic", "screw")[generator.integers(3)]
        parent = "ground" if k == 0 else f"l{generator.integers(max(0, k - 3), k)}"
        text += f'[[link]]\nname = "l{k}"\nparent = "{parent}"\njoint = "{kind}"\n' + "pitch = 0.07\n" * (kind == "screw")
        text += "".join(f"{name} = {number(-1, 1)}\n" for name in ("alpha", "a", "theta", "d", "gamma", "b", "q", "qd"))
        text += f"mass = {number(0.5, 2)}\ncom = [{number(-0.2, 0.2)}, 0.1, {number(-0.2, 0.2)}]\n"
        text += f"inertia = [{number(0.2, 0.3)}, {number(0.2, 0.3)}, {number(0.2, 0.3)}, 0.02, -0.01, 0.03]\n"
        text += f"damping = {number(0, 1)}\nstiffness = {number(0, 5)}\nrest = 0.1\narmature = {number(0, 0.1)}\n"
        text += "friction = 0.3\nstatic_friction = 0.4\nfriction_velocity = 0.5\n" * (k % 3 == 0)
        text += "lower = -0.2\nupper = 0.2\nstop_stiffness = 50\nstop_damping = 0.5\nstop_width = 0.05\n" * (k % 3 == 1)
    return text + '[fmu]\noutputs = ["acceleration", "energy"]\n'


@pytest.fixture(scope="module")
def random_chain(tmp_path_factory):
    """Returns a function: seed, number of joints -> the FMU of a random tree; 0: the mixed one."""

    def unpacked(seed: int, joints: int = 14) -> Unpacked3:
        folder, generator = tmp_path_factory.mktemp("chain"), np.random.default_rng(seed)
        (folder / "chain.toml").write_text(chain(generator, joints) if joints else mixed(generator))
        return Unpacked3(build_fmu(folder / "chain.toml", folder / "chain.fmu", "--fmi", "3"), folder / "unpacked")

    return unpacked


def mixed(generator) -> str:
    """Returns a random tree on a free base with forces between bodies, ports, actuators and an elastic coupling."""
    text = chain(generator, 8).replace('[fmu]\noutputs = ["acceleration", "energy"]\n', "")
    text = re.sub("armature = .*\n", "", text)
    joint = re.search(r'joint = "\w+"\n(pitch = .*\n)?', text)
    text = (
        text[: joint.start()]
        + 'joint = "free"\n'
        + re.sub(r"(?s)\A(alpha.*?)q = .*?(mass.*?)damping.*?(?=\[\[link)", r"\1\2", text[joint.end() :])
    )
    point = lambda: [float(number) for number in generator.uniform(-0.3, 0.3, 3)]
    for k in range(3):
        a, b = generator.choice(8, 2, replace=False)
        ends = f'link_a = "{"ground" if k == 0 else f"l{a}"}"\nlink_b = "l{b}"\npoint_a = {point()}\npoint_b = {point()}\n'
        text += f'[[spring]]\nname = "s{k}"\n{ends}stiffness = 40\ndamping = 3\nrest_length = 0.2\n'
        text += f'[[bushing]]\nname = "b{k}"\n{ends}rpy_a = {point()}\nstiffness = [9, 8, 7, 3, 2, 1]\ndamping = [1, 2, 3, 0.3, 0.2, 0.1]\n'
        text += f'[[contact]]\nname = "c{k}"\nlink_a = "l{b}"\nshape_a = "sphere"\nradius_a = 0.2\npoint_a = {point()}\n'
        text += ["", f'link_b = "l{a}"\nshape_b = "sphere"\nradius_b = 3\n', "point_b = [0, 0, 2]\n"][
            k
        ] + "stiffness = 90\ndamping = 0.4\nwidth = 0.01\n"
        text += "friction = 0.4\nfriction_velocity = 0.2\n"
        text += (
            f'[[frame]]\nname = "f{k}"\nlink = "l{a}"\nposition = {point()}\nrpy = {point()}\nport = "{["ground", "frame", "ground"][k]}"\n'
        )
    text += '[[coupling]]\nname = "belt"\njoints = ["l2", "l5"]\nratios = [1, -0.7]\nstiffness = 30\ndamping = 2\n'
    text += '[[actuator]]\njoint = "l3"\ngear_ratio = 20\nrotor_inertia = 1e-3\nstiffness = 100\ndamping = 1\ntime_constant = 0.1\n'
    text += '[[actuator]]\njoint = "l6"\nresistance = 2\ninductance = 0.1\ntorque_constant = 0.3\ngear_ratio = 5\nrotor_inertia = 1e-3\n'
    return text + '[fmu]\noutputs = ["acceleration"]\n'


def jacobian(tool: Exchange3, unknowns: list[str], knowns: list[str]) -> np.ndarray:
    columns = [tool.derivative("GetDirectionalDerivative", unknowns, knowns, unit) for unit in np.eye(len(knowns))]
    assert all(status == OK for status, _ in columns), tool.errors
    return np.array([column for _, column in columns]).T


@pytest.mark.parametrize("joints", [14, 0])
@pytest.mark.parametrize("seed", range(4))
def test_one_reverse_sweep_is_the_transposed_jacobian(random_chain, seed, joints):
    """Of slopes, states and accelerations by states and forces; forward derivatives are a different algorithm."""
    with Exchange3(random_chain(seed, joints)) as tool:
        tool.begin()
        for k, name in enumerate(tool.fmu.named("input")):
            assert tool.set(name, 0.3 * math.sin(1 + k)) == OK
        assert tool.set_states(tool.get_states() + 0.1 * np.sin(1 + np.arange(len(tool.states)))) == OK
        shown = [state for state in tool.states if "quaternion" not in state]  # what takes one sweep
        unknowns, knowns = tool.slopes + shown, tool.states + tool.fmu.named("input")
        forward = jacobian(tool, unknowns, knowns)
        assert np.abs(forward).max() > 1
        for k in range(3):
            weights = np.sin(1.0 + k + np.arange(len(unknowns)) * (k + 1))
            status, gradient = tool.derivative("GetAdjointDerivative", unknowns, knowns, weights)
            assert status == OK, tool.errors
            assert (np.abs(weights @ forward - gradient) / (np.abs(weights) @ np.abs(forward) + 1e-300)).max() < 1e-13


@pytest.fixture(scope="module")
def instructions(tmp_path_factory):
    """Returns a function: FMU, function of FMI 3.0 -> its instructions in adjoint_cost.c, by all states and inputs."""
    if not shutil.which("valgrind"):
        pytest.skip("Valgrind is not installed")
    program = tmp_path_factory.mktemp("cost") / "adjoint_cost"
    headers = Path(fmpy.__file__).parent / "c-code"
    subprocess.run(["cc", "-O1", f"-I{headers}", Path(__file__).with_name("adjoint_cost.c"), "-o", program, "-ldl"], check=True)

    def counted(fmu: Unpacked3, function: str) -> int:
        with Exchange3(fmu) as tool:
            slopes, states = tool.slopes, tool.states
        lists = [",".join(str(fmu.variables[name][1]) for name in names) for names in (slopes, states + fmu.named("input"))]
        library, resources = next((fmu.folder / "binaries" / "x86_64-linux").glob("*.so")), f"{fmu.folder / 'resources'}/"
        valgrind = ["valgrind", "--tool=callgrind", "--callgrind-out-file=/dev/null", f"--toggle-collect={function}"]
        done = subprocess.run([*valgrind, program, library, fmu.token, resources, str(len(states)), *lists], capture_output=True, text=True)
        assert done.returncode == 0, done.stderr
        return int(re.search(r"Collected : (\d+)", done.stderr).group(1))

    return counted


def test_cost_of_the_reverse_sweep_does_not_grow_with_the_knowns(random_chain, instructions):
    """Against the right-hand side at a new state; one directional derivative for each known costs hundreds of times as much."""
    for joints, most in ((6, 5), (30, 5), (0, 65)):
        fmu = random_chain(1, joints)
        slopes, gradient = (instructions(fmu, f"fmi3Get{name}") for name in ("ContinuousStateDerivatives", "AdjointDerivative"))
        assert 1 < gradient / slopes < most


def test_saved_states_pass_between_the_versions(fmu, fmu3):
    with Exchange(fmu("four_bar")) as old, Exchange3(fmu3("four_bar")) as new, Slave3(fmu3("four_bar")) as slave:
        old.begin()
        moved(old, 0.05)
        content = old.serialize(old.save())
        status, state = new.deserialize(content)
        assert status == OK and new.call("SetFMUState", state) == OK, new.errors
        assert list(moved(new, 0.07, seed=3)) == list(moved(old, 0.07, seed=3))
        # co-simulation refuses it
        slave.initialize()
        status, state = slave.deserialize(content)
        assert status == OK and slave.call("SetFMUState", state) == ERROR


def test_description(fmu3):
    """Derivatives refer to states, states that events correct are marked, and slopes along trajectories depend on time."""
    for name, corrected, with_time in (("four_bar", True, False), ("cart", False, False), ("kuka_kr5_computed_torque", False, True)):
        three = fmu3(name)
        assert (three.xml.find("ModelExchange").get("needsCompletedIntegratorStep") == "true") == corrected
        with Exchange3(three) as tool:
            marked = {n for n, element in three.elements.items() if element.get("reinit") == "true"}
            assert marked == (set(tool.states) if corrected else set())
        rows = three.xml.findall("ModelStructure/ContinuousStateDerivative[@dependencies]")
        assert rows and {"0" in row.get("dependencies").split() for row in rows} == {with_time}


# --- mistreatment ---

MODES = ("instantiated", "initialization", "event", "continuous", "terminated")
evaluated = set(MODES) - {"instantiated"}


def room(tool: Exchange3, size: int | None = None):
    size = len(tool.states) if size is None else size
    tool.kept = np.zeros(size)
    return tool.kept.ctypes.data_as(c.c_void_p), count(size)


def update(tool: Exchange3, absent: int = -1) -> int:
    places = [*(c.c_bool() for _ in range(5)), c.c_double()]
    return tool.call("UpdateDiscreteStates", *(None if k == absent else c.byref(place) for k, place in enumerate(places)))


def completed(tool: Exchange3, *absent: int) -> int:
    return tool.call("CompletedIntegratorStep", c.c_bool(True), *(None if k in absent else c.byref(c.c_bool()) for k in range(2)))


CALLS = {
    "EnterEventMode": (lambda t: t.call("EnterEventMode"), {"event", "continuous"}),
    "UpdateDiscreteStates": (update, {"event"}),
    "EnterContinuousTimeMode": (lambda t: t.call("EnterContinuousTimeMode"), {"event"}),
    "CompletedIntegratorStep": (completed, {"continuous"}),
    "SetTime": (lambda t: t.set_time(0.1), {"event", "continuous"}),
    "SetContinuousStates": (lambda t: t.set_states(np.ones(len(t.states))), {"continuous"}),
    "GetContinuousStates": (lambda t: t.call("GetContinuousStates", *room(t)), evaluated),
    "GetContinuousStateDerivatives": (lambda t: t.call("GetContinuousStateDerivatives", *room(t)), evaluated),
    "GetNominalsOfContinuousStates": (lambda t: t.call("GetNominalsOfContinuousStates", *room(t)), set(MODES)),
    "GetEventIndicators": (lambda t: t.call("GetEventIndicators", None, count(0)), evaluated),
    "GetNumberOfContinuousStates": (lambda t: t.call("GetNumberOfContinuousStates", c.byref(count(0))), set(MODES)),
    "GetNumberOfEventIndicators": (lambda t: t.call("GetNumberOfEventIndicators", c.byref(count(0))), set(MODES)),
    "SetFloat64 input": (lambda t: t.set("hinge.tau", 1.0), set(MODES) - {"terminated"}),
    "SetFloat64 tunable": (lambda t: t.set("pole.mass", 1.0), {"instantiated", "initialization", "event"}),
    "SetFloat64 fixed": (lambda t: t.set("hinge.q0", 1.0), {"instantiated", "initialization"}),
    "SetFloat64 state": (lambda t: t.set("hinge.q", 1.0), {"event", "continuous"}),
    "SetFloat64 local": (lambda t: t.set("energy.power", 1.0), set()),
    "SetString": (lambda t: t.set("solver.method", "bdf"), {"instantiated", "initialization"}),
    "Terminate": (lambda t: t.call("Terminate"), {"event", "continuous"}),
    "Reset": (lambda t: t.call("Reset"), set(MODES)),
    "DoStep": (lambda t: t.do_step(0.0, 0.1)[0], set()),
    "EnterStepMode": (lambda t: t.call("EnterStepMode"), set()),
    "EvaluateDiscreteStates": (lambda t: t.call("EvaluateDiscreteStates"), set()),
    "GetFMUState": (lambda t: t.call("GetFMUState", c.byref(c.c_void_p())), set(MODES)),
}


def bring_to(tool: Exchange3, mode: str) -> None:
    assert mode == "instantiated" or tool.enter() == OK
    for step in ("ExitInitializationMode", "EnterContinuousTimeMode", "Terminate")[: max(0, MODES.index(mode) - 1)]:
        assert tool.call(step) == OK


@pytest.mark.parametrize("mode", MODES)
@pytest.mark.parametrize("function", CALLS)
def test_every_function_in_every_mode(fmu3, function, mode):
    call, allowed = CALLS[function]
    with Exchange3(fmu3("cart")) as tool:
        bring_to(tool, mode)
        assert call(tool) == (OK if mode in allowed else ERROR), tool.errors
        assert [text.split(":")[0] for text in tool.errors] == ([] if mode in allowed else [f"fmi3{function.split()[0]}"])


def mistreatments():
    for function in ("SetContinuousStates", "GetContinuousStates", "GetContinuousStateDerivatives", "GetNominalsOfContinuousStates"):
        yield f"{function} of one too many", lambda t, f=function: t.call(f, *room(t, len(t.states) + 1))
        yield f"{function} of one too few", lambda t, f=function: t.call(f, *room(t, len(t.states) - 1))
        yield f"{function} of 2^64 - 1", lambda t, f=function: t.call(f, room(t)[0], count(2**64 - 1))
        yield f"{function} null", lambda t, f=function: t.call(f, None, count(len(t.states)))
    for bad in (math.nan, math.inf, -math.inf):
        yield f"time {bad}", lambda t, v=bad: t.set_time(v)
        yield f"state {bad}", lambda t, v=bad: t.set_states([v, *t.get_states()[1:]])
        yield f"input {bad}", lambda t, v=bad: t.set(t.fmu.named("input")[0], v)
    yield "a state set as a variable to nan", lambda t: t.set(t.states[0], math.nan)
    yield "an event indicator too many", lambda t: t.call("GetEventIndicators", *room(t, t.indicator_count + 1))
    for function in ("GetNumberOfContinuousStates", "GetNumberOfEventIndicators"):
        yield f"{function} null", lambda t, f=function: t.call(f, None)
    for absent in ((0,), (1,), (0, 1)):
        yield f"completed step without places {absent}", lambda t, a=absent: completed(t, *a)


MISTREATMENTS = dict(mistreatments())


@pytest.mark.parametrize("name", ["cart", "top", "four_bar"])
@pytest.mark.parametrize("what", MISTREATMENTS)
def test_mistreatment_is_refused_and_changes_nothing(fmu3, what, name):
    with Exchange3(fmu3(name)) as tool:
        tool.begin()
        states, slopes = tool.get_states(), tool.derivatives()
        assert MISTREATMENTS[what](tool) == ERROR
        assert len(tool.errors) == 1 and tool.errors[0].startswith("fmi3")
        assert (list(tool.get_states()), list(tool.derivatives())) == (list(states), list(slopes))
        assert not tool.completed_step()


def test_events_need_places_for_all_results(fmu3):
    with Exchange3(fmu3("top")) as tool:
        tool.initialize()
        for absent in range(6):
            assert update(tool, absent) == ERROR and "null pointer" in tool.errors[-1]
        assert update(tool) == OK
        quaternion = [k for k, name in enumerate(tool.states) if "quaternion" in name]
        assert tool.call("EnterContinuousTimeMode") == OK
        states = tool.get_states()
        states[quaternion] = 0
        assert tool.set_states(states) == ERROR and "no orientation" in tool.errors[-1]


def test_infinite_accelerations_ask_for_a_smaller_step(fmu3):
    with Exchange3(fmu3("cart")) as tool:
        tool.begin()
        assert tool.set("hinge.tau", 1e308) == OK and tool.set("rail.tau", -1e308) == OK
        assert tool.call("GetContinuousStateDerivatives", *room(tool)) == DISCARD
        assert tool.set("hinge.tau", 0.0) == OK and tool.set("rail.tau", 0.0) == OK
        assert np.isfinite(tool.derivatives()).all()


def test_discontinuous_contacts_have_no_model_exchange(fmu3):
    small = fmu3("redysim_small_biped")
    assert small.xml.find("ModelExchange") is None and small.xml.find("ModelStructure/ContinuousStateDerivative") is None
    tool = Exchange3(small)
    assert not tool.component.value
    assert len(tool.errors) == 1 and 'law = "redysim"' in tool.errors[0]
    assert tool.errors[0].startswith("fmi3InstantiateModelExchange: ")


def test_restored_and_reset_instances_serve_model_exchange(fmu3):
    with Exchange3(fmu3("top")) as tool:
        tool.begin()
        first = tool.derivatives()
        state = tool.save()
        moved(tool, 0.05)
        assert tool.call("SetFMUState", state) == OK and list(tool.derivatives()) == list(first)
        assert tool.call("Terminate") == OK and tool.call("Reset") == OK
        assert tool.begin().new_nominals == 1
        assert list(tool.derivatives()) == list(first)
