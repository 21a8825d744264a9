"""Energy of contact models: the balance with every method, and runs that do not depend on energy outputs."""

from __future__ import annotations

import json
import re
import tomllib
from itertools import product
from pathlib import Path

import numpy as np
import pytest

from build_fmu.report.sweep import METHODS
from tests.fmi.raw import OK, Slave, Unpacked

MODELS = Path(__file__).resolve().parents[2] / "models"
CONTACT_MODELS = sorted(file.stem for file in MODELS.glob("*.toml") if "[[contact]]" in file.read_text(encoding="utf-8"))
CASES = (
    *product(("bouncing_ball", "newtons_cradle"), METHODS),
    *product(("redysim_biped", "redysim_quadruped", "redysim_hexapod"), ("erk", "bdf")),
    *product(("rocking_block", "incline_block", "driven_wheel"), ("dirk", "bdf")),
    *product(("parallel_gripper",), ("bdf", "dirk", "auto")),  # the forces of its lift change fast
)


@pytest.fixture
def variant(built):
    """Returns a function: name of a model, method, output groups -> the FMU and the file's content."""

    def unpacked(name: str, method: str, outputs: list[str]) -> tuple[Unpacked, dict]:
        text = (MODELS / f"{name}.toml").read_text(encoding="utf-8")
        scene = tomllib.loads(text)
        head, _, last = re.sub(r"(?m)^method = .*\n", "", text).partition("[fmu]")
        last = re.sub(r"(?m)^outputs = .*\n", "", last)
        text = f"{head}[fmu]\noutputs = {json.dumps(outputs)}{last}"
        solver = f'[solver]\nmethod = "{method}"\n'
        text = text.replace("[solver]\n", solver) if "[solver]" in text else text + "\n" + solver
        tables = {table.stem: table.read_text() for table in MODELS.glob("*.csv") if table.name in text}
        return built(text, **tables), scene

    return unpacked


@pytest.mark.parametrize(("name", "method"), CASES)
def test_the_energy_balance_holds_with_contact(variant, instance, name, method):
    fmu, scene = variant(name, method, ["energy"])
    step, stop = scene["fmu"]["step_size"], min(scene["fmu"]["stop_time"], 2)
    for rtol in (1e-4, 1e-7):
        one, run = instance(fmu).initialize(start={"solver.rtol": rtol, "solver.atol": rtol / 100}), []
        for k in range(round(stop / step)):
            assert one.step(k * step, step) == OK, one.errors
            run.append(one.reals(["energy.kinetic", "energy.potential", "energy.work", "energy.balance"]))
        kinetic, potential, work, balance = np.array(run).T
        scale = max(kinetic.max(), np.ptp(potential), np.abs(work).max())
        assert np.abs(balance).max() < 100 * rtol * scale, rtol


ROD = """
name = "rod"
[[link]]
name = "rod"
joint = "free"
drive = "free"
mass = 1
inertia = [0.0833333, 0.0833333, 0.0002]
q = [0, 0, 0.8, 0.8, 0.6, 0, 0]
qd = [0, 0, 0, 1, 2, 0]
[[contact]]
name = "floor"
link_a = "rod"
shape_a = "capsule"
point_a = [0, 0, 0.5]
point_a2 = [0, 0, -0.5]
radius_a = 0.02
stiffness = 1e5
damping = 0
friction = 0
[fmu]
outputs = ["energy"]
[solver]
method = "{method}"
rtol = {rtol}
"""


@pytest.mark.parametrize("method", ["erk", "adams", "dirk", "auto"])
@pytest.mark.parametrize("rtol", [1e-4, 1e-6])
def test_a_step_that_leaves_a_contact_keeps_the_energy(built, instance, method, rtol):
    """Elastic bounces of both ends of a thin rod, each of a few ms; the fall releases 5 J."""
    one = instance(built(ROD.format(method=method, rtol=rtol))).initialize()
    one.run(0.75, 0.0125)
    share = 10 if method in ("erk", "dirk") else 20
    assert abs(one.get("energy.balance")) < share * rtol * 5


@pytest.mark.parametrize(
    ("name", "method", "rtol", "stop"),
    [
        ("driven_wheel", "bdf", 1e-3, 0.1),
        ("driven_wheel", "dirk", 1e-4, 0.2),
        ("redysim_quadruped", "bdf", 1e-5, 0.1),
        ("redysim_biped", "bdf", 1e-5, 0.4),
        ("driven_wheel", "auto", 1e-4, 0.2),  # whose choices follow from the right-hand sides of dirk
        ("parallel_gripper", "bdf", 1e-6, 0.4),
        ("redysim_hexapod", "adams", 1e-3, 0.5),
        ("redysim_small_biped", "bdf", 1e-6, 0.2),
        # in steps of `exponential`, and of `erk` and `dirk` with prescribed joints or a continuous law with a model of the plant, the error of the
        # work counts (docs/controllers.md)
        *(
            pytest.param(*case, 0.6, marks=pytest.mark.slow)
            for case in product(CONTACT_MODELS, METHODS, (1e-3, 1e-6))
            if case[1] in ("adams", "bdf")
            or (case[1] != "exponential" and not re.search('drive = "motion"|computed_torque', (MODELS / f"{case[0]}.toml").read_text()))
        ),
    ],
)
def test_energy_outputs_do_not_change_a_run(variant, instance, name, method, rtol, stop):
    """Bit for bit, also where the work is integrated anew between the steps of a controlled model."""
    runs = []
    for outputs in ([], ["energy"]):
        fmu, scene = variant(name, method, outputs)
        step, states = scene["fmu"]["step_size"], fmu.named("output", ".q") + fmu.named("output", ".qd")
        one = instance(fmu).initialize(start={"solver.rtol": rtol, "solver.atol": rtol / 100})
        runs.append([(one.step(k * step, step), one.reals(states)) for k in range(round(min(stop, scene["fmu"]["stop_time"]) / step))])
        assert all(status == OK for status, _ in runs[-1])
    assert runs[0] == runs[1]


PRESS = """name = "press"
[[link]]
name = "slide"
joint = "prismatic"
drive = "motion"
alpha = 1.5707963267948966
mass = 1
[[link]]
name = "tool"
joint = "prismatic"
drive = "motion"
alpha = -1.5707963267948966
mass = 1
[[link]]
name = "rod"
parent = "ground"
alpha = 1.5707963267948966
q = 1
mass = 1
com = [1, 0, 0]
[[contact]]
name = "floor"
link_a = "tool"
shape_a = "sphere"
radius_a = 0.1
stiffness = 3000
width = 0.003
friction = 0.3
[[trajectory]]
joint = "slide"
type = "speed"
speed = 1.0
[[trajectory]]
joint = "tool"
type = "polynomial"
coefficients = [0.11, -0.15, 0.25]
[solver]
method = "{method}"
rtol = 1e-8
[fmu]
outputs = ["energy"]
"""


@pytest.mark.parametrize("method", ["auto", "adams", "bdf", "erk"])
def test_the_work_of_contacts_of_prescribed_bodies(built, instance, method):
    """No state shows its error; the work of the drives cancels it in the total."""
    t = np.linspace(0, 1, 100001)
    depth = np.maximum(0.15 * t - 0.25 * t**2 - 0.01, 0)
    u = np.minimum(depth / 0.003, 1)
    power = -0.3 * 3000 * np.where(u < 1, 0.003 * u**3 * (1 - u / 2), depth - 0.0015)
    work = np.concatenate([[0], np.cumsum(power[1:] + power[:-1]) * 0.5e-5])
    one = instance(built(PRESS.format(method=method))).initialize()
    for k in range(1000):
        assert one.step(k * 1e-3, 1e-3) == OK
        assert one.get("energy.contact") == pytest.approx(work[100 * (k + 1)], abs=1e-7)


# Two spheres of bodies that a loop locks: the power of their contact is its force times rounding errors.
LOCKED = """name = "locked"
link = [
  {name = "a", joint = "spherical", drive = "free", mass = 1, com = [0.5, 0.1, -0.3], inertia = [0.1, 0.2, 0.25], q = [0.9, -0.8, -0.1]},
  {name = "b", joint = "cylindrical", drive = "free", mass = 1, com = [0.2, 0.3, 0.1], inertia = [0.1, 0.1, 0.1], a = 0.37, alpha = 0.6},
]
loop = [{name = "weld", type = "fixed", link_a = "a", link_b = "b", point_a = [0.37, 0, 0], axis_a = [0, -0.5646424733950354, 0.8253356149096783]}]
[[contact]]
name = "c"
link_a = "b"
shape_a = "sphere"
radius_a = 0.1
link_b = "a"
shape_b = "sphere"
point_b = [0.2, 0.02, 0.01]
radius_b = 0.1
stiffness = 1e5
"""


@pytest.mark.parametrize("method", METHODS)
def test_a_contact_that_a_loop_locks_does_no_work(built, method):
    with Slave(built(LOCKED)) as slave:
        slave.initialize(start={"solver.method": method})
        slave.run(0.5, 0.05)
        assert slave.get("energy.kinetic") > 1
        assert abs(slave.get("energy.work")) < 1e-12 and abs(slave.get("energy.balance")) < 1e-4


def test_a_step_past_an_edge_of_a_box_counts_as_one_with_a_corner(built):
    """The force turns by 90 degrees where the nearest face changes: unwatched, `dirk` lost 2e-4 J in four of 40 starts."""
    links = "".join(
        f'[[link]]\nname = "{name}"\njoint = "prismatic"\ndrive = "free"\nd = {d}\nqd = {qd}\n{rest}'
        for name, d, qd, rest in (
            ("up", 1.02, -1.4, 'parent = "ground"\n'),
            ("ball", 0.94, 1.3, "alpha = 1.5707963267948966\ngamma = 1.5707963267948966\nmass = 1\ninertia = [1, 1, 1]\n"),
        )
    )
    contact = 'link_a = "ball"\nshape_a = "sphere"\nradius_a = 0.01\nshape_b = "box"\nsize_b = [2, 2, 2]\nstiffness = 2000\nwidth = 0.01\n'
    fmu = built(f'name = "edge"\ngravity = [0, 0, 0]\n{links}[[contact]]\nname = "c"\n{contact}')
    balances = []
    for speed in np.linspace(0.7, 1.5, 40):
        with Slave(fmu) as slave:
            slave.initialize(start={"solver.method": "dirk", "solver.rtol": 1e-8, "solver.atol": 1e-10, "ball.qd0": speed})
            assert slave.step(0, 0.15) == OK, slave.errors
            balances.append(abs(slave.get("energy.balance")))
    assert sorted(balances)[35] < 5e-5
