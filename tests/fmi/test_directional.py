"""Directional derivatives and time derivatives of outputs, against central differences through the same interface."""

from __future__ import annotations

import ctypes as c
import math
import random

import numpy as np
import pytest

from tests.fmi.conftest import ROOT
from tests.fmi.mixed_scenes import Scene
from tests.fmi.raw import ERROR, OK, Slave, Unpacked

STEP = 1e-3
MODELS = ("cart", "gripper", "four_bar", "four_bar_inverse", "slider_crank", "parallelogram", "three_rrr", "bennett", "space_robot", "top")


RESISTANCE = {
    "friction": 0.5,
    "static_friction": 0.8,
    "friction_velocity": 0.7,
    "lower": -0.2,
    "upper": 0.3,
    "stop_stiffness": 4,
    "stop_damping": 0.3,
    "stop_width": 0.1,
}

# a sensor at a fixed link, and what loads it
WRIST = """
[[link]]
name = "wrist"
joint = "fixed"
parent = "PARENT"
alpha = 0.3
a = 0.2
mass = 0.4
com = [0.05, 0.1, 0]
[[link]]
name = "hand"
mass = 0.3
com = [0.1, 0.02, 0.1]
inertia = [0.01, 0.02, 0.02]
a = 0.1
[[link]]
name = "finger"
joint = "fixed"
parent = "wrist"
a = 0.2
mass = 0.1
[[frame]]
name = "touch"
link = "finger"
port = "frame"
outputs = ["pose", "power"]
rpy = [0.3, 0, 0.2]
[[spring]]
name = "band"
link_a = "finger"
link_b = "ground"
stiffness = 3
damping = 0.5
[[bushing]]
name = "sleeve"
link_a = "finger"
link_b = "hand"
rpy_a = [0.3, 0.5, -0.2]
point_b = [0.1, 0.05, -0.1]
stiffness = [20, 30, 10, 3, 2, 1]
damping = [1, 0.5, 2, 0.1, 0.2, 0.3]
"""


def random_tree(seed: int) -> str:
    """A tree of joints of all drives, with frames, a port, tunable parameters, gravity and passive elements."""
    draw = random.Random(seed)
    near = lambda size: round(draw.uniform(-size, size), 3)
    text = f'name = "random"\ngravity = [{near(3)}, {near(3)}, -9.81]\n'
    names, tunable = [], [f"gravity[{k}]" for k in (1, 2, 3)]
    for i in range(5):
        parent = f'parent = "{draw.choice([*names, "ground"])}"\n' if names else ""
        kind, drive = draw.choice(["revolute", "prismatic"]), draw.choice(["torque", "torque", "motion"]) if i else "torque"
        text += f"""
[[link]]
name = "b{i}"
{parent}joint = "{kind}"
joint_name = "j{i}"
drive = "{drive}"
alpha = {near(2)}
a = {near(0.5)}
theta = {near(1)}
d = {near(0.5)}
q = {near(1)}
qd = {near(1)}
mass = {1 + abs(near(1))}
com = [{near(0.3)}, {near(0.3)}, {near(0.3)}]
inertia = [0.2, 0.25, 0.3, {near(0.03)}, {near(0.03)}, {near(0.03)}]
damping = {abs(near(0.2)) if i % 2 else 0}
"""
        if i % 2:
            text += "".join(f"{key} = {value}\n" for key, value in RESISTANCE.items())
            tunable += [f"j{i}.{key}" for key in RESISTANCE]
        names.append(f"b{i}")
        tunable += [
            f"b{i}.mass",
            *(f"b{i}.com[{k}]" for k in (1, 2, 3)),
            *(f"b{i}.inertia[{k}]" for k in range(1, 7)),
            f"j{i}.damping",
            f"j{i}.stiffness",
            f"j{i}.rest",
            f"j{i}.armature",
        ]
    for k, port in enumerate(("ground", "frame")):
        text += f"""
[[frame]]
name = "f{k}"
link = "b{3 + k}"
position = [{near(0.3)}, {near(0.3)}, {near(0.3)}]
outputs = ["pose", "rotation", "velocity", "acceleration", "imu", "power"]
port = "{port}"
"""
    text += WRIST.replace("PARENT", draw.choice(names[:3]))
    for name, outputs in (("wrist", ["imu", "wrench"]), ("mount", ["wrench"])):
        text += f'[[frame]]\nname = "at_{name}"\nlink = "{name}"\nposition = [0.1, 0.2, 0.3]\nrpy = [0.5, -0.2, 1]\noutputs = {outputs}\n'
    # what stands on the ground has potential energy only
    text += '[[link]]\nname = "mount"\nparent = "ground"\njoint = "fixed"\nalpha = 0.4\na = 0.3\nmass = 2\ncom = [0.1, 0.2, 0.3]\n'
    text += '[[link]]\nname = "swing"\nparent = "mount"\nalpha = 1\nmass = 0.5\ncom = [0.2, 0, 0.1]\ninertia = [0.01, 0.01, 0.01]\n'
    tunable += ["wrist.mass", "finger.com[1]", "swing.mass"]
    tunable += ["mount.mass", *(f"mount.com[{k}]" for k in (1, 2, 3))]
    outputs = ["acceleration", "energy", "momentum", "power", "solver", *TERMS]
    return text + f"\n[fmu]\noutputs = {outputs}\ntunable = {tunable}\n".replace("'", '"')


TERMS = ("mass_matrix", "bias", "gravity_torque", "coriolis", "passive")
LAWS = ("pd", "gravity_compensation", "feed_forward", "computed_torque")


def controlled(law: str) -> str:
    """A tree whose law meets springs, friction, a free and a guided joint; tunable are the plant, which the law knows, and the gains."""
    feed_forward = law == "feed_forward"
    swing = '{name = "swing", drive = "free", mass = 0.5, com = [0.2, 0, 0], inertia = [0.01, 0.02, 0.03], a = 0.4, alpha = 0.4},'
    base = "" if feed_forward else swing
    return f"""
name = "controlled"
gravity = [1, -9, 3]
link = [
  {{name = "rail", joint = "prismatic", drive = "motion", mass = 1, alpha = 1.57}},
  {{name = "arm", mass = 1, com = [0.3, 0, 0.1], inertia = [0.1, 0.2, 0.3], alpha = -1.57, q = 0.2, qd = 0.3, damping = 0.2, stiffness = 2, armature = 0.1}},
  {base}
  {{name = "hand", parent = "arm", mass = 0.4, com = [0.1, 0.05, 0], inertia = [0.01, 0.02, 0.03], a = 0.4, alpha = 0.3, q = -0.4, friction = 0.2, friction_velocity = 0.5}},
]
trajectory = [
  {{joint = "rail", type = "table", time = [0, 0.2, 0.35, 0.6], q = [0.1, 0.3, 0.2, 0.4]}},
  {{joint = "arm", type = "{"cycloid" if law == "pd" else "quintic"}", to = 1, start = 0.01, duration = 0.4}},
  {'{joint = "hand", type = "polynomial", coefficients = [-0.4, 1, 2, -3, 4]},' if feed_forward else ""}
]
frame = [{{name = "tool", link = "hand", position = [0.1, 0.2, 0], port = "ground", outputs = ["pose", "velocity", "power"]}}]
[controller]
law = "{law}"
joints = ["arm", "hand"]
kp = [30, 5]
kd = 2
input = true
[fmu]
outputs = ["acceleration", "energy", "solver", "reference", "momentum", "power"]
tunable = ["arm.kp", "arm.kd", "hand.kd", {"" if feed_forward else '"hand.target", '}"hand.mass", "hand.com[2]", "arm.inertia[3]", "arm.damping", "arm.stiffness",
           "arm.rest", "arm.armature", "hand.friction", "gravity[1]", "gravity[2]"]
"""


def controlled_loop(law: str) -> str:
    """The four-bar with a law at its crank: the law's model is closed, too."""
    text = (
        (ROOT / "models" / "four_bar.toml")
        .read_text()
        .replace('["crank_joint.damping"]', '["crank_joint.damping", "crank_joint.kp", "crank_joint.target"]')
    )
    return text + f'\n[controller]\nlaw = "{law}"\njoints = ["crank_joint"]\nkp = 3\nkd = 0.5\ntarget = 0.7\ninput = true\n'


def controlled_base(law: str) -> str:
    """A floating base with two controlled joints."""
    return f"""
name = "floating"
link = [
  {{name = "base", joint = "free", mass = 3, inertia = [0.3, 0.4, 0.5], q = [0, 0, 0, 0.3, 0.2, -0.4], qd = [0.1, 0, 0.2, 0.3, -0.2, 0.1]}},
  {{name = "arm", mass = 1, com = [0.3, 0, 0.1], inertia = [0.1, 0.2, 0.3], a = 0.5, alpha = 1, q = 0.2, qd = 0.3}},
  {{name = "hand", mass = 0.4, com = [0.1, 0.05, 0], inertia = [0.01, 0.02, 0.03], a = 0.4, alpha = 0.3}},
]
[controller]
law = "{law}"
joints = ["arm", "hand"]
kp = 10
kd = 2
target = [0.5, -0.5]
input = true
[fmu]
outputs = ["acceleration", "energy", "solver", "momentum", "power"]
tunable = ["arm.kp", "hand.target", "hand.mass"]
"""


def touching(kind: str) -> str:
    """A floating base with an arm, pressed on the ground and on a ball."""
    b = (
        'shape_b = "heightmap"\nfile = "ground.csv"\nspacing = 0.5\npoint_b = [-1, -1, -0.1]'
        if kind == "map"
        else "normal_b = [0.1, -0.2, 1]"
    )
    foot = (
        'shape_a = "disk"\naxis_a = [0.3, 1, 0.1]\nradius_a = 0.2\ntube_a = 0.05'
        if kind == "wheel"
        else 'shape_a = "box"\nsize_a = [0.4, 0.3, 0.3]'
    )
    law = "stiffness = 300\nwidth = 0.05\ndamping = 0.4\nfriction = 0.6\nstatic_friction = 0.8\nfriction_velocity = 0.5\nrolling = 0.02\ntorsion = 0.03"
    return f"""
name = "touching"
link = [
  {{name = "base", joint = "free", mass = 3, inertia = [0.3, 0.4, 0.5], q = [0.1, 0.2, 0.02, 0.3, 0.2, -0.4], qd = [0.1, 0, 0.2, 0.3, -0.2, 0.1]}},
  {{name = "sole", joint = "fixed", mass = 0.2}},
  {{name = "arm", parent = "base", mass = 1, com = [0.3, 0, 0.1], inertia = [0.1, 0.2, 0.3], a = 0.5, alpha = 1, q = 0.2, qd = 0.3}},
]
[[frame]]
name = "ankle"
link = "sole"
position = [0.1, 0, 0.1]
outputs = ["wrench", "imu", "acceleration", "jacobian", "jacobian_rate", "inverse_inertia"]
[[contact]]
name = "foot"
link_a = "sole"
{foot}
{b}
{law}
outputs = ["force", "torque", "depth", "point", "slip"]
[[contact]]
name = "hand"
link_a = "arm"
shape_a = "capsule"
point_a = [0.1, 0, 0]
point_a2 = [0.4, 0, 0.1]
radius_a = 0.1
link_b = "base"
shape_b = "sphere"
point_b = [0.5, 0.1, 0]
radius_b = 0.3
{law}
outputs = ["force", "torque", "depth", "point", "slip"]
[fmu]
outputs = ["acceleration", "energy", "solver", "momentum", "power", "mass_matrix", "bias", "gravity_torque", "coriolis", "passive", "reaction", "regressor"]
tunable = ["base.mass", "arm.com[1]", "gravity[2]", "foot.stiffness", "foot.damping", "foot.friction", "hand.static_friction", "hand.friction_velocity"]
"""


def actuated(law: str) -> str:
    """A floating base with an elastic, a limited and an electric joint, all away from the kinks of their laws."""
    control = f'[controller]\nlaw = "{law}"\njoints = ["arm", "wrist"]\nkp = 10\nkd = 2\ntarget = [0.5, -0.5]\ninput = true\n'
    return f"""
name = "actuated"
link = [
  {{name = "base", joint = "free", mass = 3, inertia = [0.3, 0.4, 0.5], q = [0, 0, 0, 0.3, 0.2, -0.4], qd = [0.1, 0, 0.2, 0.3, -0.2, 0.1]}},
  {{name = "arm", mass = 1, com = [0.3, 0, 0.1], inertia = [0.1, 0.2, 0.3], a = 0.5, alpha = 1, q = 0.2, qd = 0.3}},
  {{name = "hand", mass = 0.4, com = [0.1, 0.05, 0], inertia = [0.01, 0.02, 0.03], a = 0.4, alpha = 0.3, qd = 0.4}},
  {{name = "slide", joint = "prismatic", mass = 0.3, com = [0.1, 0.05, 0], inertia = [0.01, 0.02, 0.03], a = 0.2, alpha = -0.7}},
  {{name = "wrist", mass = 0.2, com = [0.1, 0.02, 0], inertia = [0.01, 0.02, 0.03], a = 0.2, alpha = 0.7}},
]
actuator = [
  {{joint = "arm", gear_ratio = -6, rotor_inertia = 0.01, stiffness = 20, damping = 1, backlash = 0.1, backlash_width = 0.6, torque_limit = 4, torque_limit_width = 4}},
  {{joint = "hand", gear_ratio = 4, resistance = 1, torque_constant = 0.3, inductance = 0.2, time_constant = 0.1, speed_limit = 2, speed_limit_width = 2}},
  {{joint = "slide", gear_ratio = 30, rotor_inertia = 1e-3, stiffness = 40, damping = 1, time_constant = 0.2}},
  {{joint = "wrist", torque_limit = 3, torque_limit_width = 3, speed_limit = 4, speed_limit_width = 4}},
]
frame = [{{name = "tool", link = "wrist", position = [0.1, 0.2, 0], port = "ground", outputs = ["pose", "velocity", "power"]}}]
{control if law != "none" else ""}
[fmu]
outputs = ["acceleration", "energy", "solver", "momentum", "power", "actuator"]
tunable = ["arm.mass", "hand.damping", "gravity[2]"]
"""


TOUCHING = [f"touching {kind}" for kind in ("box", "wheel", "map")]

GROUND = "0,0.1,0,0.05,0\n0.1,0,0.2,0,0\n0,0.1,0,0.1,0\n0.05,0,0.1,0,0\n"
MADE = {
    "touching": touching,
    "random": lambda seed: random_tree(int(seed)),
    "mixed": lambda seed: Scene(int(seed)).toml(),
    "opened": lambda seed: Scene(int(seed), open_by=0.05).toml(),
    "controlled": controlled,
    "controlled_loop": controlled_loop,
    "controlled_base": controlled_base,
    "actuated": actuated,
}


@pytest.fixture(scope="module")
def model(fmu, built):
    """Returns a function: name of a model, or "<maker> <what>" -> the unpacked FMU."""

    def unpacked(name: str) -> Unpacked:
        if " " not in name:
            return fmu(name)
        maker, what = name.split()
        return built(MADE[maker](what), ground=GROUND)

    return unpacked


def continuous_outputs(fmu) -> list[str]:
    return [
        s.get("name")
        for s in fmu.xml.iter("ScalarVariable")
        if s.get("causality") == "output" and s.get("variability") == "continuous" and s[0].tag == "Real"
    ]


def derivative(slave, unknowns, direction: dict[str, float]) -> list[float]:
    references = lambda names: (c.c_uint * len(names))(*[slave.fmu.variables[name][1] for name in names])
    found = (c.c_double * len(unknowns))()
    status = slave.call(
        "GetDirectionalDerivative",
        references(unknowns),
        c.c_size_t(len(unknowns)),
        references(list(direction)),
        c.c_size_t(len(direction)),
        (c.c_double * len(direction))(*direction.values()),
        found,
    )
    assert status == OK, slave.errors
    return list(found)


def differences(slave, unknowns, direction: dict[str, float], size: float = STEP) -> list[float]:
    """Five-point central differences; leaves the instance as it was."""
    state = slave.save()
    start = {name: slave.get(name) for name in direction}

    def at(k):
        for name, value in start.items():
            assert slave.set(name, value + k * size * direction[name]) == OK, slave.errors
        values = slave.reals(unknowns)
        assert slave.call("SetFMUstate", state) == OK
        return values

    far, near, near_, far_ = (at(k) for k in (-2, -1, 1, 2))
    assert slave.call("FreeFMUstate", c.byref(state)) == OK
    return [(8 * (p - m) - (pp - mm)) / (12 * size) for mm, m, p, pp in zip(far, near, near_, far_, strict=True)]


def assert_equal(slave, unknowns, direction, relative, size: float = STEP) -> None:
    exact, estimate = np.array(derivative(slave, unknowns, direction)), np.array(differences(slave, unknowns, direction, size))
    # not pytest.approx for each of a million pairs, which takes longer than the FMU
    near = abs(exact - estimate) <= relative * max(1.0, abs(estimate).max())
    wrong = {unknowns[k]: (exact[k], estimate[k]) for k in np.flatnonzero(~near)}
    assert not wrong, f"along {direction}"


MIXED = [f"mixed {seed}" for seed in range(6)]
OPENED = [f"opened {seed}" for seed in range(6)]  # assembled from afar
SINGULAR = ("parallelogram",)  # at the start
START = (".q0", ".qd0", ".q", ".qd", *(f".{name}0[{k}]" for name in ("quaternion", "omega") for k in range(1, 5)))
NAMES = [
    *MODELS,
    *MIXED,
    *TOUCHING,
    *(f"actuated {law}" for law in ("none", "pd")),
    *(f"random {seed}" for seed in range(4)),
    *(f"controlled {law}" for law in LAWS),
    *(f"controlled_{kind} {law}" for kind in ("loop", "base") for law in LAWS if law != "feed_forward"),
]


@pytest.mark.parametrize("name", NAMES)
def test_by_inputs_at_a_communication_point(model, name):
    draw = random.Random(name)
    with Slave(model(name)) as slave:
        slave.initialize()
        inputs = slave.fmu.named("input")
        for name_ in inputs:
            if not name_.endswith((".q", ".qd")):
                assert slave.set(name_, draw.uniform(-0.5, 0.5)) == OK
        for k in range(20):
            assert slave.step(k * 0.01, 0.01) == OK
        outputs = [o for o in continuous_outputs(slave.fmu) if not o.endswith(".gap")]
        prescribed = {i.rsplit(".", 1)[0]: slave.get(i) for i in inputs if i.endswith(".qdd")}
        if prescribed:  # the motion as it is by now, so that nothing jumps
            for joint, qdd in prescribed.items():
                q, qd = slave.get(f"{joint}.q"), slave.get(f"{joint}.qd")
                assert slave.set(f"{joint}.q", q + 0.2 * qd + 0.02 * qdd) == OK
                assert slave.set(f"{joint}.qd", qd + 0.2 * qdd) == OK
        for name_ in inputs:
            # where motions jump in loops the state is projected: shorter steps, and more of its rounding
            loose = name_.endswith((".q", ".qd")) and slave.fmu.named("output", ".gap")
            assert_equal(slave, outputs, {name_: 1.0}, 1e-6 if loose else 1e-8, size=3e-4 if loose else STEP)
        assert_equal(
            slave,
            outputs,
            {name_: draw.uniform(-1, 1) for name_ in inputs},
            1e-6,
            size=3e-4 if prescribed and slave.fmu.named("output", ".gap") else STEP,
        )


@pytest.mark.parametrize("name", [*(name for name in NAMES if name not in SINGULAR), *OPENED, "five_bar"])
def test_by_start_values_and_parameters_in_initialization(model, name):
    draw = random.Random(name)
    with Slave(model(name)) as slave:
        assert slave.setup() == OK and slave.call("EnterInitializationMode") == OK
        looped = bool(slave.fmu.named("output", ".gap"))
        outputs = [o for o in continuous_outputs(slave.fmu) if not o.endswith(".gap")]
        knowns = [k for k in slave.fmu.named("input") + slave.fmu.named("parameter") if not k.startswith("solver.")]
        if name in ("four_bar", "five_bar"):
            assert slave.set(next(k for k in knowns if k.endswith(".qd0")), 0.7) == OK  # the others follow
        for known in knowns:
            if known.endswith((".damping", ".stiffness", ".armature")):
                assert slave.set(known, slave.get(known) + 0.1) == OK  # away from the bound
        for known in knowns:
            # closed poses bend more than open trees
            bent = looped and known.endswith(START)
            assert_equal(slave, outputs, {known: 1.0}, 1e-6 if bent else 1e-7, size=2e-4 if bent else STEP)
        assert_equal(slave, outputs, {known: draw.uniform(-0.3, 0.3) for known in knowns}, 1e-6, size=3e-4 if looped else STEP)


@pytest.mark.parametrize("name", SINGULAR)
def test_a_singular_start_has_no_derivatives_by_start_values(fmu, name):
    """It lies on two branches at once, and differences on either."""
    with Slave(fmu(name)) as slave:
        assert slave.setup() == OK and slave.call("EnterInitializationMode") == OK
        outputs = slave.fmu.named("output", ".q")
        assert derivative(slave, outputs, {slave.fmu.named("input", ".tau")[0]: 1.0}) == [0] * len(outputs)
        references = lambda names: (c.c_uint * len(names))(*[slave.fmu.variables[name][1] for name in names])
        known = slave.fmu.named("parameter", ".q0")[:1]
        assert (
            slave.call(
                "GetDirectionalDerivative",
                references(outputs),
                c.c_size_t(len(outputs)),
                references(known),
                c.c_size_t(1),
                (c.c_double * 1)(1.0),
                (c.c_double * len(outputs))(),
            )
            == ERROR
        )
        assert "the initial configuration is singular" in slave.errors[-1]


@pytest.mark.parametrize("name", [*(name for name in (*MODELS, *MIXED) if name not in SINGULAR), *(f"random {seed}" for seed in range(4))])
def test_by_inputs_after_motions_have_jumped(model, name):
    draw = random.Random(name)
    with Slave(model(name)) as slave:
        motions = slave.fmu.named("input", ".q")
        if not motions:
            pytest.skip("no prescribed motion")
        slave.initialize()
        slave.run(0.05, 0.01)
        for motion in motions:
            q, qd = slave.get(motion), slave.get(f"{motion}d")
            assert slave.set(motion, q + 0.05 * qd + draw.uniform(0.02, 0.05)) == OK
            assert slave.set(f"{motion}d", qd + draw.uniform(0.02, 0.05)) == OK
        outputs = [o for o in continuous_outputs(slave.fmu) if not o.endswith(".gap")]
        for known in slave.fmu.named("input"):
            # forces and accelerations act linearly: long steps, no rounding
            assert_equal(slave, outputs, {known: 1.0}, 1e-6, size=2e-4 if known.endswith((".q", ".qd")) else 10.0)


@pytest.mark.parametrize(("name", "moved"), [("four_bar", 0.3), ("five_bar", 0.1), ("hoeken", -0.1)])
@pytest.mark.parametrize("held", [True, False])
def test_by_start_values_that_are_assembled_from_afar(built, name, moved, held):
    """The assembled configuration depends on the curvature of the loops, too."""
    text = (ROOT / "models" / f"{name}.toml").read_text()
    with Slave(built(text if held else text.replace("hold = true\n", ""))) as slave:
        assert slave.setup() == OK and slave.call("EnterInitializationMode") == OK
        knowns = [k for k in slave.fmu.named("parameter") if k.endswith((".q0", ".qd0"))]
        assert slave.set(knowns[0], slave.get(knowns[0]) + moved) == OK
        assert slave.set(next(k for k in knowns if k.endswith(".qd0")), 1.0) == OK
        outputs = slave.fmu.named("output", ".q") + slave.fmu.named("output", ".qd")
        for known in knowns:
            assert_equal(slave, outputs, {known: 1.0}, 1e-4, size=3e-3)


@pytest.mark.parametrize("name", NAMES)
def test_outputs_by_time(model, name):
    """The first time derivatives, against differences of states on both sides of a communication point."""
    with Slave(model(name)) as slave:
        slave.initialize(start={"solver.rtol": 1e-12, "solver.atol": 1e-13})
        outputs = [o for o in continuous_outputs(slave.fmu) if not o.endswith(".gap")]
        torques = [i for i in slave.fmu.named("input") if not i.endswith((".q", ".qd", ".qdd"))]
        for i, torque in enumerate(torques):
            assert slave.set(torque, 0.1 * (i + 1)) == OK
        assert slave.step(0, 0.05) == OK
        at, size, points = 0.05, 1e-4, []
        for k in range(5):
            points.append(slave.reals(outputs))
            if k == 2:
                found = (c.c_double * len(outputs))()
                references = (c.c_uint * len(outputs))(*[slave.fmu.variables[o][1] for o in outputs])
                assert (
                    slave.call(
                        "GetRealOutputDerivatives",
                        references,
                        c.c_size_t(len(outputs)),
                        (c.c_int * len(outputs))(*[1] * len(outputs)),
                        found,
                    )
                    == OK
                ), slave.errors
            assert slave.step(at, size) == OK
            at = slave.last_time()
        for k, output in enumerate(outputs):
            mm, m, _, p, pp = (point[k] for point in points)
            expected = (8 * (p - m) - (pp - mm)) / (12 * size)
            assert found[k] == pytest.approx(expected, rel=2e-5, abs=2e-5), output


def test_the_rate_of_inputs_counts(fmu):
    with Slave(fmu("pendulum")) as slave:
        slave.initialize()
        tau, qdd = slave.fmu.named("input")[0], slave.fmu.named("output", ".qdd")[0]
        rate = c.c_double()
        ask = lambda: slave.call(
            "GetRealOutputDerivatives", (c.c_uint * 1)(slave.fmu.variables[qdd][1]), c.c_size_t(1), (c.c_int * 1)(1), c.byref(rate)
        )
        assert ask() == OK
        before = rate.value
        assert (
            slave.call(
                "SetRealInputDerivatives",
                (c.c_uint * 1)(slave.fmu.variables[tau][1]),
                c.c_size_t(1),
                (c.c_int * 1)(1),
                (c.c_double * 1)(2.0),
            )
            == OK
        )
        assert ask() == OK
        assert rate.value - before == pytest.approx(2 * derivative(slave, [qdd], {tau: 1.0})[0], rel=1e-12)


def test_what_is_refused(fmu):
    with Slave(fmu("cart")) as slave:
        reference = lambda name: (c.c_uint * 1)(slave.fmu.variables[name][1])
        one, zero = c.c_size_t(1), c.c_size_t(0)

        def ask(unknown, known, direction=1.0):
            return slave.call(
                "GetDirectionalDerivative", reference(unknown), one, reference(known), one, (c.c_double * 1)(direction), (c.c_double * 1)()
            )

        assert ask("hinge.qdd", "hinge.tau") == ERROR, "not before initialization mode"
        slave.initialize()
        assert ask("hinge.qdd", "hinge.tau") == OK
        assert ask("hinge.qdd", "pole.mass") == ERROR and "initialization mode" in slave.errors[-1]
        assert ask("hinge.qdd", "hinge.qdd") == ERROR and "not a known" in slave.errors[-1]
        assert ask("hinge.tau", "hinge.tau") == ERROR and "not an output" in slave.errors[-1]
        assert ask("hinge.qdd", "solver.rtol") == ERROR
        assert ask("hinge.qdd", "hinge.tau", math.nan) == ERROR
        assert slave.call("GetDirectionalDerivative", None, zero, None, zero, None, None) == OK
        assert slave.call("GetDirectionalDerivative", None, one, None, zero, None, None) == ERROR
        assert slave.call("GetDirectionalDerivative", (c.c_uint * 1)(999), one, None, zero, None, (c.c_double * 1)()) == ERROR
        assert slave.reals(["hinge.q"]) == [0.3], "nothing has changed"
        ends = []
        for asks in (0, 3):
            assert slave.call("Reset") == OK
            slave.initialize(start={"solver.method": "bdf"})
            for k in range(20):
                for _ in range(asks):
                    assert ask("hinge.qdd", "hinge.tau") == OK
                assert slave.step(k * 0.01, 0.01) == OK
            ends.append(slave.reals(["hinge.q", "rail.qd"]))
        assert ends[0] == ends[1], "asking changes no bit of the run"


@pytest.mark.parametrize("name", NAMES)
def test_no_derivative_by_what_the_description_does_not_name(model, name):
    with Slave(model(name)) as slave:
        slave.initialize()
        inputs = slave.fmu.named("input")
        for output, named in slave.fmu.dependencies("Outputs").items():
            if slave.fmu.variables[output][0] != "Real":
                continue
            others = {known: 1.0 for known in inputs if known not in named}
            assert derivative(slave, [output], others) == [0], output
