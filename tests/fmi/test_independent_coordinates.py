"""Model exchange of loops and rigid couplings: independent coordinates are the states."""

from __future__ import annotations

import ctypes as c
import re

import numpy as np
import pytest

from tests.fmi.conftest import ROOT
from tests.fmi.exchange import Exchange
from tests.fmi.raw import DISCARD, ERROR, OK, Slave
from tests.fmi.test_model_exchange import moved, reals

# a plate on a spherical joint, held by a rod between spherical joints: angles are independent, and the bodies turn many times
HELD_PLATE = """
name = "held_plate"
gravity = [0, 0, -9.81]
[[link]]
name = "plate"
joint = "spherical"
mass = 2
com = [0.3, 0, 0]
inertia = [0.02, 0.05, 0.06]
qd = [2.0, -0.5, 3.0]
[[link]]
name = "rod"
parent = "plate"
joint = "spherical"
a = 0.6
mass = 0.4
com = [0, 0, 0.2]
inertia = [0.006, 0.006, 0.0005]
qd = [0.0, 0.0, 5.0]
[[loop]]
name = "pivot"
type = "spherical"
link_a = "rod"
point_a = [0, 0, 0.5]
link_b = "ground"
point_b = [0.6, 0, 0.5]
[fmu]
outputs = ["acceleration", "energy"]
"""

LOOPS = (
    "bennett",
    "cognate",
    "differential_wrist",
    "five_bar",
    "four_bar",
    "leg",
    "mimic_hand",
    "parallelogram",
    "slider_crank",
    "stewart_platform",
    "three_rrr",
)


@pytest.mark.parametrize("name", LOOPS)
def test_loops_have_independent_states(fmu, name):
    """As many as degrees of freedom; all values of them close the loops."""
    freedom = {"differential_wrist": 2, "five_bar": 2, "stewart_platform": 6, "three_rrr": 3}.get(name, 1)
    with Exchange(fmu(name)) as tool:
        tool.begin()
        independent = [f"independent.{kind}[{k + 1}]" for kind in ("q", "qd") for k in range(freedom)]
        assert tool.states == ["energy.work", *independent]
        states = moved(tool, 0.02)
        gaps = reals(fmu(name), ".gap")
        assert np.abs(tool.reals(gaps)).max(initial=0) < 1e-11
        there = states + 0.02
        assert tool.set_states(there) == OK
        assert np.abs(tool.reals(gaps)).max(initial=0) < 1e-11
        assert list(tool.get_states()) == list(there)
        assert tool.derivatives()[1 : freedom + 1] == pytest.approx(there[freedom + 1 :], rel=1e-12)
        assert not tool.completed_step()


def test_independent_coordinates_are_chosen_anew(fmu):
    """Where the states of a five-bar no longer determine the other joints well, an event changes them; the motion goes on."""
    with Exchange(fmu("five_bar")) as tool:
        tool.begin()
        h, chosen = 2e-4, 0
        joints = reals(fmu("five_bar"), ".q", ".qd", ".qdd")
        for k in range(2000):
            tool.advance(k * h, h)
            if not tool.completed_step():
                continue
            before = tool.reals(joints)
            assert tool.call("EnterEventMode") == OK
            info = tool.event()
            assert (info.new_values, info.new_nominals) == (1, 1)
            assert tool.reals(joints) == pytest.approx(before, rel=1e-9, abs=1e-9)
            assert tool.call("EnterContinuousTimeMode") == OK and not tool.completed_step()
            chosen += 1
        assert 0 < chosen < 10


def test_states_far_away_are_refused_or_closed(fmu):
    """A master may try any state: the FMU closes the loops there, or asks for a shorter step."""
    with Exchange(fmu("slider_crank")) as tool:
        tool.begin()
        states = tool.get_states()
        for far in (0.5, 3.0, 100.0, 1e9):
            assert (tool.set_states(states + far), tool.set_time(0.0)) == (OK, OK)
            slopes = np.empty(len(states))
            status = tool.call("GetDerivatives", slopes.ctypes.data_as(c.c_void_p), c.c_size_t(len(slopes)))
            assert status == OK and np.isfinite(slopes).all() or status == DISCARD
        assert tool.set_states(states) == OK and np.isfinite(tool.derivatives()).all()


@pytest.mark.parametrize("name", ["five_bar", "slider_crank", "stewart_platform", "three_rrr"])
def test_rejected_trial_states_leave_no_trace(fmu, name):
    """After far states the last completed ones have the same slopes bit for bit: on their branch, and closed from there."""
    generator = np.random.default_rng(1)
    with Exchange(fmu(name)) as tool:
        tool.begin()
        states = tool.get_states()
        assert not tool.completed_step()
        before, slopes = list(tool.derivatives()), np.empty(len(states))
        for _ in range(200):
            assert tool.set_states(states + generator.uniform(-3, 3, len(states))) == OK
            assert tool.call("GetDerivatives", slopes.ctypes.data_as(c.c_void_p), c.c_size_t(len(slopes))) in (OK, DISCARD)
            assert tool.set_states(states) == OK and list(tool.derivatives()) == before


def test_a_master_that_completes_no_steps_follows_the_loop(fmu):
    joints = reals(fmu("four_bar"), ".q")
    with Exchange(fmu("four_bar")) as tool, Exchange(fmu("four_bar")) as complete:
        for one in (tool, complete):
            one.begin()
        start = tool.get_states()
        crank = list(tool.reals(["crank_joint.q"]))[0]
        for turn in np.arange(0.02, 4 * np.pi, 0.1):
            moved_by = np.zeros(len(start))
            moved_by[np.isclose(start, crank)] = turn
            assert moved_by.any()
            for one in (tool, complete):
                assert one.set_states(start + moved_by) == OK
            complete.reals(joints)
            complete.completed_step()
            assert tool.reals(joints) == pytest.approx(complete.reals(joints), abs=1e-9)


def test_singular_configurations_are_reported(fmu):
    """Where rows of a loop are dependent, accelerations leave the branch: a warning, once, and one for each derivative."""
    with Exchange(fmu("parallelogram")) as tool:
        tool.begin()
        states = tool.get_states()

        def warnings(function: str) -> int:
            return sum(f"{function}: " in text and "singular configuration" in text for _, _, text in tool.messages)

        for _ in range(2):
            tool.derivatives()
        assert warnings("GetDerivatives") == 1
        tool.directional(tool.slopes, tool.states[:1], [1.0])
        assert warnings("GetDirectionalDerivative") == 1
        crank = np.eye(len(states))[tool.slopes.index("independent.qd[1]")]
        assert tool.set_states(states + 1e-3 * crank) == OK
        tool.directional(tool.slopes, tool.states[:1], [1.0])
        assert warnings("GetDirectionalDerivative") == 1


def test_angles_of_spherical_joints_are_independent(built):
    """CVode of FMPy against the solver of the FMU, through several choices of charts and coordinates; the Jacobian is exact."""
    from fmpy import simulate_fmu

    fmu = built(HELD_PLATE)
    archive = str(fmu.folder.parent / "model.fmu")
    with Exchange(fmu) as tool:
        tool.begin()
        assert len(tool.states) == 1 + 2 * 3
        states = moved(tool, 0.05)
        exact = tool.jacobian(tool.slopes, tool.states)
        for column, change in zip(exact.T, 1e-4 * np.eye(len(states)), strict=True):
            near, far = (tool.slope_at(0.05, states + k * change) - tool.slope_at(0.05, states - k * change) for k in (1, 2))
            assert column == pytest.approx((8 * near - far) / 12e-4, rel=1e-6, abs=1e-6 * (1 + np.abs(column).max()))
    turning = [name for name in reals(fmu) if ".omega[" in name]
    options = {"stop_time": 2.0, "output": turning, "output_interval": 0.005}
    own = simulate_fmu(archive, fmi_type="CoSimulation", start_values={"solver.rtol": 1e-11, "solver.atol": 1e-13}, **options)
    free = simulate_fmu(archive, fmi_type="ModelExchange", solver="CVode", relative_tolerance=1e-9, **options)
    place = np.searchsorted(free["time"], own["time"] + 1e-9, side="right") - 1
    assert len(free["time"]) > len(own["time"]) + 3, "events in which coordinates were chosen"
    for name in turning:
        assert np.abs(free[name][place] - own[name]).max() < 1e-5 * (1 + np.abs(own[name]).max())


def test_driven_loops_follow_their_motion(built):
    """A crank with prescribed motion leaves a four-bar no states; the other joints follow it over long ways, too."""
    text = (ROOT / "models" / "four_bar.toml").read_text()
    text = text.replace('joint_name = "crank_joint"', 'joint_name = "crank_joint"\ndrive = "motion"', 1)
    fmu = built(re.sub(r"(?m)^tunable = .*$", "", text))
    with Exchange(fmu) as tool, Slave(fmu) as slave:
        tool.begin()
        slave.initialize()
        assert not any(name.startswith("independent") for name in tool.states)
        positions, rates = (reals(fmu, *(f"joint{k}.{letter}" for k in (2, 3))) for letter in ("q", "qd"))
        for k, angle in enumerate((0.0, 0.05, 0.6, 1.4, 0.9, -0.8)):
            for name, value in {"q": angle, "qd": 1.5, "qdd": -2.0}.items():
                assert tool.set(f"crank_joint.{name}", value) == OK and slave.set(f"crank_joint.{name}", value) == OK
            assert tool.reals(positions) == pytest.approx(slave.reals(positions), abs=1e-9)
            found, near = np.array(tool.reals(rates)), []
            for change in (1e-5, -1e-5):
                assert tool.set("crank_joint.q", angle + change) == OK
                near.append(np.array(tool.reals(positions)))
            assert found == pytest.approx(1.5 * (near[0] - near[1]) / 2e-5, abs=1e-9)
            assert tool.set("crank_joint.q", angle) == OK
            if k % 2:
                assert not tool.completed_step()


def leverage(tool: Exchange) -> float:
    """How far a dependent revolute joint moves per radian of an independent one, from exact derivatives."""
    joints = reals(tool.fmu, ".q")
    coordinates = [name for name in tool.states if name.startswith("independent.q[")]
    return float(np.abs(tool.jacobian(joints, coordinates)).max())


@pytest.mark.parametrize("name", ["five_bar", "three_rrr"])
def test_an_event_indicator_shows_singular_coordinates(fmu, name):
    """It changes its sign where a dependent joint moves ten times as far as the independent ones; the event chooses others."""
    h, events = 2e-4, 0
    with Exchange(fmu(name)) as tool:
        tool.begin()
        for k in range(4000):
            [margin] = tool.indicators()
            assert tool.reals(["independent.margin"]) == [margin]
            if (k % 20 == 0 or margin < 0.3) and leverage(tool) > 1:  # 1: of the independent joints themselves
                assert margin == pytest.approx((10 - leverage(tool)) / (10 + leverage(tool)), rel=1e-9, abs=1e-9)
            if margin < 0:
                assert tool.call("EnterEventMode") == OK
                info = tool.event()
                assert (info.new_values, info.new_nominals) == (1, 1)
                assert tool.call("EnterContinuousTimeMode") == OK
                assert tool.indicators()[0] > 0.3
                events += 1
            tool.advance(k * h, h)
            tool.call("CompletedIntegratorStep", 1, c.byref(c.c_int()), c.byref(c.c_int()))  # its request is ignored
    assert events > 0


def test_event_indicators_have_no_derivatives(fmu):
    with Exchange(fmu("four_bar")) as tool:
        tool.begin()
        reference, value = (c.c_uint * 1)(tool.fmu.variables["independent.margin"][1]), (c.c_double * 1)(1.0)
        state = (c.c_uint * 1)(tool.fmu.variables[tool.states[0]][1])
        for unknown, known in ((reference, state), (state, reference)):
            assert tool.call("GetDirectionalDerivative", unknown, c.c_size_t(1), known, c.c_size_t(1), value, value) == ERROR
        for count in (0, 2):
            assert tool.call("GetEventIndicators", value, c.c_size_t(count)) == ERROR
        assert tool.call("GetEventIndicators", None, c.c_size_t(1)) == ERROR


@pytest.mark.parametrize("name", ["five_bar", "three_rrr"])
def test_rare_completed_steps_of_fmpy_do_not_matter(fmu_file, name):
    """FMPy completes steps at output points only; within an interval of 0.25 s the coordinates of the start become singular."""
    from fmpy import simulate_fmu

    options = {"stop_time": 1, "output_interval": 0.25, "relative_tolerance": 1e-6, "output": ["energy.balance"]}
    result = simulate_fmu(str(fmu_file(name)), fmi_type="ModelExchange", **options)
    assert len(result) > 5, "at an event there are two samples"
    assert abs(result["energy.balance"]).max() < 0.01  # J; without events more than 1 J


def test_singular_coordinates_cause_a_warning_in_tools_without_events(fmu):
    with Exchange(fmu("five_bar")) as tool:
        tool.begin()
        for k in range(1950):  # until just before the singular configuration
            tool.advance(k * 2e-4, 2e-4)
    assert sum("near singular independent coordinates" in text for _, _, text in tool.messages) == 1
