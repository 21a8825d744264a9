"""Model exchange: the right-hand side that a master integrates, its Jacobian, its events, its saved states."""

from __future__ import annotations

import ctypes as c
from pathlib import Path

import numpy as np
import pytest

from tests.fmi.conftest import CART, ROOT
from tests.fmi.exchange import EventInfo, Exchange
from tests.fmi.raw import DISCARD, ERROR, OK, Slave

# a robot, a controlled one along a trajectory, trees with orientations, prescribed motions, loops (one overconstrained),
# contact; the others with -m slow
QUICK = ("double_pendulum", "kuka_kr5_computed_torque", "top", "driven_wheel", "stick_slip", "four_bar", "bennett", "incline_block")
# co-simulation only
REFUSED = ("redysim_biped", "redysim_hexapod", "redysim_quadruped", "redysim_small_biped")
NAMES = sorted(path.stem for path in (ROOT / "models").glob("*.toml"))
OTHERS = [name for name in NAMES if name not in (*QUICK, *REFUSED)]
# what CVode of FMPy, which gives up after 500 steps, needs as an interval
FINE = {"stiff_arm": 2e-5, "quadruped": 1e-3, "stiff_strut": 1e-3, "newtons_cradle": 2e-4, "rocking_block": 2e-4, "iftomm_squeezer": 3e-4}
# without its torque the squeezer rests in an unstable equilibrium
MOVED = {"iftomm_squeezer": (0.03, {"beta.tau": 0.033})}

# Every kind of state: an actuator with all of its own, a spherical joint; a prescribed joint.
ACTUATED = """
name = "actuated"
gravity = [0, -9.81, 0]
[[link]]
name = "upper"
mass = 1
com = [0.3, 0, 0]
inertia = [0.02, 0.03, 0.03]
q = 0.4
qd = 0.5
[[link]]
name = "lower"
a = 0.6
mass = 0.5
com = [0.2, 0, 0]
inertia = [0.01, 0.02, 0.02]
damping = 0.05
[[link]]
name = "wheel"
parent = "lower"
joint = "spherical"
a = 0.3
mass = 0.4
com = [0, 0.02, 0]
inertia = [0.01, 0.012, 0.015]
q = [0.2, 0.5, 0.3]
qd = [0.3, -0.5, 0.4]
[[link]]
name = "cam"
parent = "upper"
drive = "motion"
mass = 0.2
com = [0.1, 0, 0]
inertia = [0.01, 0.01, 0.01]
[[frame]]
name = "tip"
link = "lower"
outputs = ["pose", "velocity", "acceleration"]
port = "frame"
[[actuator]]
joint = "upper"
gear_ratio = 50
rotor_inertia = 1e-4
stiffness = 300
damping = 1
time_constant = 0.02
resistance = 1.2
inductance = 0.01
torque_constant = 0.05
[fmu]
outputs = OUTPUTS
"""
EVERY_GROUP = '["acceleration", "energy", "momentum", "power", "actuator"]'


def reals(fmu, *endings: str) -> list[str]:
    """Returns the continuous outputs, or those with one of the endings."""
    return [
        scalar.get("name")
        for scalar in fmu.xml.iter("ScalarVariable")
        if (scalar.get("causality"), scalar.get("variability")) == ("output", "continuous")
        and (not endings or scalar.get("name").endswith(endings))
    ]


@pytest.mark.parametrize("name", [*QUICK, *(pytest.param(name, marks=pytest.mark.slow) for name in OTHERS)])
def test_cvode_follows_co_simulation(fmu, fmu_file, name):
    """FMPy's CVode, which knows states, derivatives, nominals and events, against the FMU's own solver."""
    from fmpy import simulate_fmu

    stop, inputs = MOVED.get(name, (0.5, {}))
    names = reals(fmu(name), ".q", ".qd", ".work")
    names += [f for f in reals(fmu(name)) if ".quaternion[" in f or ".omega[" in f]
    interval = FINE.get(name, 0.01)
    options = {"stop_time": stop, "output": names, "output_interval": interval}
    tight = {"solver.rtol": 1e-10, "solver.atol": 1e-12}
    own = simulate_fmu(str(fmu_file(name)), fmi_type="CoSimulation", start_values=tight | inputs, **options)
    free = simulate_fmu(
        str(fmu_file(name)), fmi_type="ModelExchange", solver="CVode", relative_tolerance=1e-9, start_values=inputs, **options
    )
    assert free["time"][-1] == pytest.approx(stop)
    # of the samples at an event the last one counts
    place = np.searchsorted(free["time"], own["time"] + 1e-9, side="right") - 1
    for output in names:
        size = 1 + np.abs(own[output]).max()
        assert np.abs(free[output][place] - own[output]).max() < 3e-5 * size, output


@pytest.mark.parametrize("name", ["cart", "kuka_kr5", "top", "four_bar", "kuka_kr5_inverse"])
def test_states_and_derivatives_are_variables(fmu, name):
    with Exchange(fmu(name)) as tool:
        tool.begin()
        states = tool.get_states()
        assert tool.slope_at(0.0, states) == pytest.approx(tool.reals(tool.slopes), rel=1e-12, abs=1e-12)
        assert list(states) == pytest.approx(tool.reals(tool.states), rel=1e-9, abs=1e-9)
        assert (tool.numbers("GetNominalsOfContinuousStates") > 0).all()


@pytest.mark.parametrize("outputs", [EVERY_GROUP, "[]"])
def test_groups_not_requested_become_local(built, outputs):
    fmu = built(ACTUATED.replace("OUTPUTS", outputs))
    with Exchange(fmu) as tool:
        tool.begin()
        ending = [name.split(".")[-1] for name in tool.states]
        assert {"motor_q", "motor_qd", "current", "lagged"} <= set(ending)
        local = set(fmu.named("local"))
        assert ("upper.qdd" in local) == ("upper.motor_q" in local) == (outputs == "[]")
        assert {"upper.lagged", "upper.lagged_rate", "upper.current_rate", "wheel.quaternion_rate[4]"} <= local
        assert tool.derivatives() == pytest.approx(tool.reals(tool.slopes), rel=1e-12, abs=1e-12)


def moved(tool: Exchange, time: float, seed: int = 1) -> np.ndarray:
    """Goes on for a while, so that nothing rests; returns the states."""
    generator = np.random.default_rng(seed)
    for name in tool.fmu.named("input"):
        assert tool.set(name, generator.uniform(0.1, 0.5)) == OK
    for k in range(20):
        tool.advance(k * time / 20, time / 20)
    states = tool.get_states()
    tool.slope_at(time, states)
    return states


COUPLED_PENDULA = "".join(f'[[link]]\nname = "{side}"\nparent = "ground"\nmass = 1\ncom = [1, 0, 0]\n' for side in ("left", "right"))
COUPLED_PENDULA += '[[coupling]]\nname = "rod"\njoints = ["left", "right"]\nratios = [1, -1]\n[fmu]\n'
TOP_BESIDE_PENDULA = (ROOT / "models" / "top.toml").read_text(encoding="utf-8").replace("[fmu]\n", COUPLED_PENDULA)
JACOBIANS = {
    "top beside pendula": TOP_BESIDE_PENDULA,
    "tree": CART,
    "actuated": ACTUATED.replace("OUTPUTS", EVERY_GROUP),
    **{name: (ROOT / "models" / f"{name}.toml").read_text() for name in ("four_bar", "bennett", "space_five_bar")},
}


@pytest.mark.parametrize("name", JACOBIANS)
def test_jacobian_against_differences(built, name):
    """Of derivatives and outputs by states and inputs; differences of fourth order."""
    fmu = built(JACOBIANS[name])
    with Exchange(fmu) as tool:
        tool.begin()
        states = moved(tool, 0.05)
        unknowns = tool.slopes + reals(fmu)
        step = 1e-4

        def by(known, change):
            """The unknowns with one known changed."""
            if known in tool.states:
                there = states.copy()
                there[tool.states.index(known)] += change
                assert tool.set_states(there) == OK
                return np.array(tool.reals(unknowns))
            before = tool.get(known)
            assert tool.set(known, before + change) == OK
            found = np.array(tool.reals(unknowns))
            assert tool.set(known, before) == OK
            return found

        knowns = tool.states + fmu.named("input")
        exact = tool.jacobian(unknowns, knowns)
        for column, known in zip(exact.T, knowns, strict=True):
            differences = (8 * (by(known, step) - by(known, -step)) - (by(known, 2 * step) - by(known, -2 * step))) / (12 * step)
            tool.set_states(states)
            assert column == pytest.approx(differences, rel=1e-5, abs=1e-5 * (1 + np.abs(differences).max())), known
        # along the length of a quaternion, too
        direction = np.random.default_rng(2).uniform(-1, 1, len(knowns))
        assert tool.directional(unknowns, knowns, direction) == pytest.approx(
            exact @ direction, rel=1e-9, abs=1e-9 * (1 + np.abs(exact).max())
        )


def test_declared_independence_of_states_is_true(built):
    """No derivative and no output has a nonzero derivative by a known that its row does not name."""
    fmu = built(JACOBIANS["actuated"])
    scalars = [scalar.get("name") for scalar in fmu.xml.iter("ScalarVariable")]
    with Exchange(fmu) as tool:
        tool.begin()
        moved(tool, 0.05)
        knowns = tool.states + fmu.named("input")
        for group in ("Outputs", "Derivatives"):
            for row in fmu.xml.find(f"ModelStructure/{group}"):
                unknown = scalars[int(row.get("index")) - 1]
                if unknown.startswith("solver.") or row.get("dependencies") is None:
                    continue
                named = {scalars[int(i) - 1] for i in row.get("dependencies").split()}
                assert named <= set(knowns)
                for known in set(knowns) - named:
                    assert abs(tool.directional([unknown], [known], [1.0])) < 1e-13, f"{unknown} depends on {known}"


def test_implicit_steps_with_the_exact_jacobian(fmu):
    """A master that solves the trapezoidal rule by Newton's iteration: quadratic, so the Jacobian is exact."""
    with Exchange(fmu("stiff_strut")) as tool:
        tool.begin()
        states, h = tool.get_states(), 1e-3
        for k in range(20):
            before = tool.slope_at(k * h, states)
            guess, sizes = states + h * before, []
            for _ in range(6):
                slope = tool.slope_at((k + 1) * h, guess)
                matrix = np.eye(len(states)) - h / 2 * tool.jacobian(tool.slopes, tool.states)
                change = np.linalg.solve(matrix, states + h / 2 * (before + slope) - guess)
                guess = guess + change
                sizes.append(np.abs(change).max())
            assert sizes[-1] < 1e-12 * (1 + np.abs(guess).max()), sizes
            assert sizes[2] < 1e-3 * sizes[0] or sizes[2] < 1e-12
            states = guess
        assert not tool.errors


@pytest.mark.parametrize(
    "text", [(ROOT / "models" / "top.toml").read_text(encoding="utf-8"), TOP_BESIDE_PENDULA], ids=["top", "beside pendula"]
)
def test_slopes_do_not_depend_on_the_length_of_quaternions(built, text):
    with Exchange(built(text)) as tool:
        tool.begin()
        states = moved(tool, 0.05)
        unit = tool.slope_at(0.05, states)
        places = [k for k, name in enumerate(tool.states) if "quaternion" in name]
        longer = states.copy()
        longer[places] *= 1.2
        stretched = tool.slope_at(0.05, longer)
        assert stretched[places] == pytest.approx(1.2 * unit[places], rel=1e-12, abs=1e-12)
        others = [k for k in range(len(states)) if k not in places]
        assert stretched[others] == pytest.approx(unit[others], rel=1e-11, abs=1e-11)
        # the length is a first integral: nothing drifts but by errors of the integrator
        assert abs(longer[places] @ stretched[places]) < 1e-13
        assert tool.get("top.quaternion[1]") == longer[places[0]]


def test_stretched_quaternions_are_normalised_in_event_mode(fmu):
    with Exchange(fmu("top")) as tool:
        info = tool.begin()
        assert (info.new_nominals, info.new_values) == (1, 0)
        states = tool.get_states()
        places = [k for k, name in enumerate(tool.states) if "quaternion" in name]
        assert np.linalg.norm(states[places]) == pytest.approx(1, rel=1e-15)
        assert not tool.completed_step()
        states[places] *= 1 + 1e-2
        assert tool.set_states(states) == OK
        assert tool.completed_step()
        assert list(tool.get_states()) == list(states)  # not before the event
        assert tool.call("EnterEventMode") == OK
        info = tool.event()
        assert (info.new_nominals, info.new_values) == (0, 1)
        assert np.linalg.norm(tool.get_states()[places]) == pytest.approx(1, rel=1e-15)
        assert tool.event().new_values == 0
        assert tool.call("EnterContinuousTimeMode") == OK and not tool.completed_step()


TABLED = """
name = "tabled"
gravity = [0, -9.81, 0]
[[link]]
name = "crank"
drive = "motion"
mass = 1
com = [0.2, 0, 0]
inertia = [0.01, 0.02, 0.02]
[[link]]
name = "rod"
a = 0.3
mass = 1
com = [0.2, 0, 0]
inertia = [0.01, 0.02, 0.02]
[[trajectory]]
joint = "crank"
type = "table"
time = [0, 0.1, 0.3, 0.35, 0.6]
q = [0, 0.2, 0.1, 0.4, 0.25]
"""


def test_knots_of_a_table_are_time_events(built):
    with Exchange(built(TABLED)) as tool:
        info = tool.begin()
        seen = []
        while info.has_next:
            seen.append(info.next)
            # a master that adds up its steps arrives a rounding error early
            assert tool.set_time(info.next * (1 - 1e-15)) == OK
            assert tool.call("EnterEventMode") == OK
            info = tool.event()
            assert tool.call("EnterContinuousTimeMode") == OK
        assert seen == pytest.approx([0.1, 0.3, 0.35, 0.6])
        assert tool.set_time(0.9) == OK
        assert (tool.get("crank.q"), tool.get("crank.qd"), tool.get("crank.qdd")) == (pytest.approx(0.25), pytest.approx(0, abs=1e-12), 0)


def test_phases_change_in_event_mode_only(built):
    """An integrator that tries a step past the end of a trajectory sees its smooth continuation."""
    with Exchange(built(TABLED)) as tool:
        tool.begin()
        states = tool.get_states()
        before = tool.slope_at(0.55, states)
        assert tool.set_time(0.7) == OK
        assert abs(tool.get("crank.qdd")) > 1
        assert list(tool.slope_at(0.55, states)) == list(before)
        assert tool.set_time(0.7) == OK and tool.call("EnterEventMode") == OK
        tool.event()
        assert (tool.get("crank.qdd"), tool.get("crank.q")) == (0, pytest.approx(0.25))


SAMPLED = """
name = "sampled"
gravity = [0, -9.81, 0]
[[link]]
name = "arm"
mass = 1
com = [0.3, 0, 0]
inertia = [0.01, 0.02, 0.05]
damping = 0.1
[controller]
law = "pd"
kp = 40
kd = 5
target = 0.7
sample_time = 0.02
delay = 0.005
"""


def test_samples_of_a_controller_are_time_events(built):
    from fmpy import simulate_fmu

    fmu = built(SAMPLED)
    with Exchange(fmu) as tool:
        assert tool.begin().next == pytest.approx(0.005)
        assert tool.set_time(0.005) == OK and tool.call("EnterEventMode") == OK
        assert tool.event().next == pytest.approx(0.02)
    archive = str(fmu.folder.parent / "model.fmu")
    options = {"stop_time": 0.5, "output": ["arm.q"], "output_interval": 0.01}
    own = simulate_fmu(archive, fmi_type="CoSimulation", start_values={"solver.rtol": 1e-11}, **options)
    free = simulate_fmu(archive, fmi_type="ModelExchange", relative_tolerance=1e-9, **options)
    place = np.searchsorted(free["time"], own["time"] + 1e-9, side="right") - 1
    assert np.abs(own["arm.q"]).max() > 0.3
    assert free["arm.q"][place] == pytest.approx(own["arm.q"], abs=1e-6)


def test_motion_inputs_hold_at_every_time(fmu):
    """A master passes the motion as three functions of time."""
    with Exchange(fmu("kuka_kr5_inverse")) as tool:
        tool.begin()
        joint = tool.fmu.named("input", ".qdd")[1].removesuffix(".qdd")
        for time in (0.1, 0.05, 0.2):
            motion = {"q": np.sin(3 * time), "qd": 3 * np.cos(3 * time), "qdd": -9 * np.sin(3 * time)}
            assert tool.set_time(time) == OK
            for name, value in motion.items():
                assert tool.set(f"{joint}.{name}", value) == OK
            torque = tool.get(f"{joint}.tau")
            # set in another order, at another time before: the same
            assert tool.set_time(7.0) == OK and tool.set_time(time) == OK
            for name, value in reversed(motion.items()):
                assert tool.set(f"{joint}.{name}", value) == OK
            assert tool.get(f"{joint}.tau") == torque


@pytest.mark.parametrize("name", ["four_bar", "top", "kuka_kr5_computed_torque"])
def test_saved_states_continue_bit_for_bit(fmu, name):
    with Exchange(fmu(name)) as tool, Exchange(fmu(name)) as other:
        tool.begin()
        moved(tool, 0.05)
        content = tool.serialize(tool.save())
        reference = [tool.get_states(), tool.derivatives(), tool.reals(reals(fmu(name)))]
        goal = moved(tool, 0.07, seed=3)
        status, state = other.deserialize(content)
        assert status == OK and other.call("SetFMUstate", state) == OK, other.errors
        assert [list(part) for part in (other.get_states(), other.derivatives(), other.reals(reals(fmu(name))))] == [
            list(part) for part in reference
        ]
        assert list(moved(other, 0.07, seed=3)) == list(goal)
        assert other.call("EnterEventMode") == OK and other.event().new_nominals == 1


def test_states_of_the_other_kind_are_refused(fmu):
    cart = fmu("cart")
    with Exchange(cart) as tool, Slave(cart) as slave:
        tool.begin()
        slave.initialize()
        for one, two in ((tool, slave), (slave, tool)):
            before = two.get("hinge.qdd")
            status, state = two.deserialize(one.serialize(one.save()))
            assert status == OK and two.call("SetFMUstate", state) == ERROR
            assert two.get("hinge.qdd") == before


def test_reset_begins_again(fmu):
    with Exchange(fmu("top")) as tool:
        tool.begin()
        first = tool.derivatives()
        moved(tool, 0.05)
        assert tool.call("Terminate") == OK and tool.call("Reset") == OK
        assert tool.begin().new_nominals == 1
        assert list(tool.derivatives()) == list(first)


def test_tunable_parameters_are_set_in_event_mode(fmu):
    with Exchange(fmu("cart")) as tool:
        tool.begin()
        before = tool.derivatives()
        assert tool.set("pole.mass", 1.0) == ERROR
        assert "event mode" in tool.errors[-1]
        assert tool.call("EnterEventMode") == OK and tool.set("pole.mass", 1.0) == OK
        tool.event()
        assert tool.call("EnterContinuousTimeMode") == OK
        assert list(tool.derivatives()) != list(before)
        assert tool.get("energy.balance") == pytest.approx(0, abs=1e-12)


def test_mistreatment_changes_nothing(fmu):
    with Exchange(fmu("top")) as tool:
        tool.begin()
        states, slopes = tool.get_states(), tool.derivatives()
        size = len(states)
        many, none = c.c_size_t(size + 1), c.c_void_p()
        room = np.zeros(size + 1).ctypes.data_as(c.c_void_p)
        for function in ("SetContinuousStates", "GetContinuousStates", "GetDerivatives", "GetNominalsOfContinuousStates"):
            assert tool.call(function, room, many) == ERROR
            assert tool.call(function, none, c.c_size_t(size)) == ERROR
            assert tool.call(function, room, c.c_size_t(2**64 - 1)) == ERROR
        assert tool.call("GetEventIndicators", room, c.c_size_t(1)) == ERROR
        assert tool.call("GetEventIndicators", none, c.c_size_t(0)) == OK
        for bad in (np.nan, np.inf):
            assert tool.set_states(np.where(np.arange(size) == 1, bad, states)) == ERROR
            assert tool.set_time(bad) == ERROR
        assert tool.set_states(np.zeros(size)) == ERROR and "quaternion" in tool.errors[-1]
        assert tool.call("CompletedIntegratorStep", 1, none, none) == ERROR
        assert tool.call("NewDiscreteStates", none) == ERROR
        assert tool.call("EnterEventMode") == OK and tool.call("NewDiscreteStates", none) == ERROR
        assert tool.call("EnterContinuousTimeMode") == OK
        assert list(tool.get_states()) == list(states) and list(tool.derivatives()) == list(slopes)


@pytest.mark.parametrize("name", ["top", "four_bar", "series_elastic_leg"])
def test_states_can_be_set_as_variables(fmu, name):
    """As CasADi does, together with inputs."""
    with Exchange(fmu(name)) as tool, Exchange(fmu(name)) as other:
        for each in (tool, other):
            each.begin()
        states = tool.get_states() + 1e-3 * np.sin(1.0 + np.arange(len(tool.states)))
        inputs = [n for n in tool.fmu.named("input") if n.endswith(".tau")]
        values = [*states, *np.cos(np.arange(len(inputs)))]
        assert tool.set_reals(tool.states + inputs, values) == OK, tool.errors
        assert other.set_states(states) == OK and other.set_reals(inputs, values[len(states) :]) == OK
        assert list(tool.get_states()) == list(states)
        assert list(tool.derivatives()) == list(other.derivatives())
        # all or nothing
        assert tool.set_reals(inputs + tool.states[-1:], [1.0] * len(inputs) + [np.nan]) == ERROR
        assert tool.set_reals(tool.states + tool.slopes[-1:], [0.0] * (len(states) + 1)) == ERROR
        quaternion = [n for n in tool.states if ".quaternion[" in n]
        if quaternion:
            assert tool.set_reals(quaternion, [0.0] * len(quaternion)) == ERROR and "fmi2SetReal: a quaternion is zero" in tool.errors[-1]
        assert list(tool.get_states()) == list(states)
        assert list(tool.derivatives()) == list(other.derivatives())
        assert tool.call("EnterEventMode") == OK and tool.set_reals(tool.states, states) == OK
        assert tool.call("Terminate") == OK and tool.set_reals(tool.states, states) == ERROR


def test_infinite_accelerations_ask_for_a_smaller_step(fmu):
    with Exchange(fmu("cart")) as tool:
        tool.begin()
        states = tool.get_states()
        assert tool.set("hinge.tau", 1e308) == OK and tool.set("rail.tau", -1e308) == OK
        slopes = np.zeros(len(states))
        assert tool.call("GetDerivatives", slopes.ctypes.data_as(c.c_void_p), c.c_size_t(len(states))) == DISCARD
        assert np.isnan(slopes).all(), "for clients that do not look at the status, like CVode of FMPy"
        assert any("not finite" in text for _, _, text in tool.messages)
        status, acceleration = tool.try_get("hinge.qdd")
        assert (status, np.isnan(acceleration), tool.try_get("hinge.q")[0]) == (DISCARD, True, OK)
        assert tool.set("hinge.tau", 0.0) == OK and tool.set("rail.tau", 0.0) == OK
        assert np.isfinite(tool.derivatives()).all()


MODES = ("instantiated", "initialization", "event", "continuous", "terminated")
CALLS = {
    "EnterEventMode": (lambda t: t.call("EnterEventMode"), {"event", "continuous"}),
    "NewDiscreteStates": (lambda t: t.call("NewDiscreteStates", c.byref(EventInfo())), {"event"}),
    "EnterContinuousTimeMode": (lambda t: t.call("EnterContinuousTimeMode"), {"event"}),
    "CompletedIntegratorStep": (
        lambda t: t.call("CompletedIntegratorStep", 1, c.byref(c.c_int()), c.byref(c.c_int())),
        {"continuous"},
    ),
    "SetTime": (lambda t: t.set_time(0.1), {"event", "continuous"}),
    "SetContinuousStates": (lambda t: t.set_states(np.ones(len(t.states))), {"continuous"}),
    "GetContinuousStates": (lambda t: t.call("GetContinuousStates", *t.room()), set(MODES) - {"instantiated"}),
    "GetDerivatives": (lambda t: t.call("GetDerivatives", *t.room()), set(MODES) - {"instantiated"}),
    "GetNominals": (lambda t: t.call("GetNominalsOfContinuousStates", *t.room()), set(MODES)),
    "GetEventIndicators": (lambda t: t.call("GetEventIndicators", None, c.c_size_t(0)), set(MODES) - {"instantiated"}),
    "SetReal input": (lambda t: t.set("hinge.tau", 1.0), set(MODES) - {"terminated"}),
    "SetReal tunable": (lambda t: t.set("pole.mass", 1.0), {"instantiated", "initialization", "event"}),
    "SetReal fixed": (lambda t: t.set("hinge.q0", 1.0), {"instantiated", "initialization"}),
    "SetReal state": (lambda t: t.set("hinge.q", 1.0), {"event", "continuous"}),
    "SetReal local": (lambda t: t.set("energy.power", 1.0), set()),
    "SetString": (lambda t: t.set("solver.method", "bdf"), {"instantiated", "initialization"}),
    "GetReal local": (lambda t: t.try_get("energy.power")[0], set(MODES) - {"instantiated"}),
    "Terminate": (lambda t: t.call("Terminate"), {"event", "continuous"}),
    "Reset": (lambda t: t.call("Reset"), set(MODES)),
    "DoStep": (lambda t: t.step(0.0, 0.1), set()),
    "GetStatus": (lambda t: t.call("GetStatus", 0, c.byref(c.c_int())), set()),
    "SetRealInputDerivatives": (
        lambda t: t.call(
            "SetRealInputDerivatives", (c.c_uint * 1)(t.fmu.variables["hinge.tau"][1]), c.c_size_t(1), (c.c_int * 1)(1), (c.c_double * 1)(1)
        ),
        set(),
    ),
    "GetFMUstate": (lambda t: t.call("GetFMUstate", c.byref(c.c_void_p())), set(MODES)),
}


class AnyTime(Exchange):
    def room(self):
        """An array for one number a state, and their count."""
        self.kept = np.zeros(len(self.states))
        return self.kept.ctypes.data_as(c.c_void_p), c.c_size_t(len(self.kept))

    def go_to(self, mode: str) -> None:
        steps = ("EnterInitializationMode", "ExitInitializationMode", "EnterContinuousTimeMode", "Terminate")
        assert mode == "instantiated" or self.setup() == OK
        for step in steps[: MODES.index(mode)]:
            assert self.call(step) == OK


@pytest.mark.parametrize("mode", MODES)
def test_calls_in_every_mode(fmu, mode):
    for name, (call, allowed) in CALLS.items():
        with AnyTime(fmu("cart")) as tool:
            tool.go_to(mode)
            assert (call(tool) == OK) == (mode in allowed), f"{name} {mode} {tool.errors}"


def test_functions_of_model_exchange_are_refused_in_co_simulation(fmu):
    with Slave(fmu("cart")) as slave:
        slave.initialize()
        assert slave.call("SetTime", c.c_double(1)) == ERROR
        assert slave.call("GetDerivatives", None, c.c_size_t(0)) == ERROR
        assert slave.call("EnterEventMode") == ERROR


def test_discontinuous_contacts_have_no_model_exchange(fmu, fmu_file):
    small = fmu("redysim_small_biped")
    assert small.xml.find("ModelExchange") is None and small.xml.find("ModelStructure/Derivatives") is None
    assert small.named("local") == []
    tool = Exchange(small)
    assert not tool.component.value
    assert any('law = "redysim"' in text for text in tool.errors)


def test_build_says_why_there_is_no_model_exchange(tmp_path):
    from tests.command_line import command

    for name, says in (("redysim_small_biped", True), ("pendulum", False)):
        done = command("build", Path(ROOT / "models" / f"{name}.toml"), "-o", tmp_path / "a.fmu", "--no-show")
        assert done.returncode == 0
        assert ("note: no model exchange: the force of contacts" in done.stderr) == says


def test_a_thousand_joints_have_a_small_description(tmp_path):
    from build_fmu.fmu.description import model_description
    from build_fmu.model.describe import describe

    links = "".join(f'[[link]]\nname = "l{k}"\na = 0.1\nmass = 1\ncom = [0.05, 0, 0]\ninertia = [0.01, 0.01, 0.01]\n' for k in range(1000))
    (tmp_path / "chain.toml").write_text(f'name = "chain"\n{links}')
    assert len(model_description(describe(tmp_path / "chain.toml"))) < 3e6
